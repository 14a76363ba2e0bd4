//! The whole way from a job to a report, on bytes and text: no file is touched here. Uses everything but `cli`.

mod inputs;

pub use inputs::{InputFile, Inputs, hash, machine_of_job};
