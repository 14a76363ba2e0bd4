//! The whole way from a job to a report, on bytes and text: no file is touched here. Uses everything but `cli`.

mod body_views;
mod check;
mod diff;
mod explain;
mod followed;
mod foreign;
mod inputs;
mod inspect;
mod inspect_path;
mod pace;
mod page;
mod posted;
mod reach;
mod recover;
mod retarget;
mod scene;
mod stages;
mod stock;
mod suspect;

pub use check::{CheckRequest, Checked, check, doubts};
pub use diff::{Compared, Difference, Differences, ProgramSize, diff};
pub use explain::{PlanRecord, RajainRecord, SeamRecord, SphereRecord, StripRecord, explain};
pub use followed::Source;
pub use foreign::{Reading, is_apt, read_path};
pub use inputs::{InputFile, Inputs, PartFiles, hash, machine_of_job};
pub use inspect::{
    Control, Extent, FindingSummary, MotionSummary, MoveCounts, PartSummary, ProgramSummary, inspect_part,
    inspect_program, to_json,
};
pub use inspect_path::{OperationSummary, PathSummary, inspect_path};
pub use pace::{Load, Pace, Passage, SlowStretch};
pub use page::page;
pub use posted::{PostRecord, RotaryChoice};
pub use retarget::{Recovered, RetargetGoal, RetargetRequest, Retargeted, recover, retarget};
pub use stages::{Judged, Judging, PostRequest, Posted, judge, mill_program, plan, plan_observed, post, post_job};
pub use stock::{StockReport, stock_report};
