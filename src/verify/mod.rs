//! The swept tool against the part, axis limits, round trip, and the verdict. May use: geometry, part, tool, motion,
//! collide, machine, nc (reading half), simulate, stock.

mod bodies;
mod body;
mod bound;
mod cluster;
mod contacts;
mod course;
mod crossings;
mod deviation;
mod fan;
mod faults;
mod findings;
mod judge;
mod links;
mod measured;
mod modal;
mod motion_tree;
mod outlier;
mod plane;
mod ray;
mod record;
mod refine;
mod round_trip;
mod settle;
mod stock;
mod strips;
mod sweep;
mod swept;
mod uncertainty;

pub use bodies::{BodiesMet, bodies_met};
pub use contacts::{Contact, Obstacle, ToolBody};
pub use deviation::PartDeviation;
pub use judge::{Settings, Subject, Verified, verify, verify_motion};
pub use measured::MeasuredSample;
pub use motion_tree::{BlockMotion, Instant};
pub use ray::NormalRay;
pub use record::{
    AxisRecord, CollisionRecord, DeviationRecord, FindingRecord, MachineVerification, NearMissRecord, ParameterRecord,
    ProgramRecord, RoundTripRecord, StockRecord, StripsRecord, ToleranceRecord, UncertaintyRecord, Verdict,
    Verification, by_letter,
};
pub use stock::{Milled, StockLimits, removal_rate};
pub use strips::Runs;
pub use swept::{Touch, Window};

#[cfg(test)]
mod tests;
