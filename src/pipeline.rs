//! The whole way from a job to a report, on bytes and text: no file is touched here. Uses everything but `cli`.

mod explain;
mod inputs;
mod inspect;
mod page;
mod stages;

pub use explain::{PlanRecord, RajainRecord, SeamRecord, SphereRecord, StripRecord, explain};
pub use inputs::{InputFile, Inputs, PartFiles, hash, machine_of_job};
pub use inspect::{
    Control, Extent, FindingSummary, MotionSummary, MoveCounts, PartSummary, ProgramSummary, inspect_part,
    inspect_program, to_json,
};
pub use page::page;
pub use stages::{Judged, PostRequest, Posted, judge, plan, plan_observed, post, post_job};
