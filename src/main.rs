//! Hands over to the command line.

fn main() -> std::process::ExitCode {
    regulus::cli::main()
}
