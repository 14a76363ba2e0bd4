//! The program as its users meet it: commands, files, exit statuses, messages.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "cli_commands/axis_bound.rs"]
mod axis_bound;
#[path = "cli_commands/bad_input.rs"]
mod bad_input;
#[path = "cli_commands/bad_plan.rs"]
mod bad_plan;
#[path = "cli_commands/bad_programs.rs"]
mod bad_programs;
#[path = "cli_commands/bodies.rs"]
mod bodies;
#[path = "cli_commands/findings.rs"]
mod findings;
#[path = "cli_commands/good_input.rs"]
mod good_input;
#[path = "cli_commands/interrupt.rs"]
mod interrupt;
#[path = "cli_commands/programs.rs"]
mod programs;
#[path = "cli_commands/rajain.rs"]
mod rajain;
#[path = "cli_commands/stock.rs"]
mod stock;
#[path = "cli_commands/tools.rs"]
mod tools;
#[path = "cli_commands/workshop.rs"]
mod workshop;
