//! Places along a tool path, and their names in messages. Uses `motion`.

use crate::motion::{PassKind, PassMotion, Pose, ToolPath};

/// Largest turn of a rotary axis that counts as continuous between neighbouring stations, radians.
pub(super) const CONTINUOUS: f64 = 0.45;

/// A place of a path with chosen rotary positions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stop {
    pub(super) pass: usize,
    pub(super) t: f64,
    pub(super) rotary: [f64; 2],
    /// Where the linear axes then stand, mm.
    pub(super) linear: [f64; 3],
    /// The tool leaves the part between the stop before and this one, which are at one place.
    pub(super) rewound: bool,
}

/// Names a pose of a path for a message.
pub(super) fn whereabouts(path: &ToolPath, pass: usize, pose: &Pose) -> String {
    let strip = path.passes.get(pass).and_then(|p| p.strip).map(|s| format!(", strip {}", s + 1)).unwrap_or_default();
    let kind = match path.passes.get(pass).map(|p| p.kind) {
        Some(PassKind::Cut) => "cut",
        Some(PassKind::LeadIn) => "lead-in",
        Some(PassKind::LeadOut) => "lead-out",
        Some(PassKind::Approach) => "approach",
        Some(PassKind::Retract) => "retract",
        Some(PassKind::Rapid) => "rapid",
        None => "no pass",
    };
    let (tip, axis) = (pose.tip, pose.axis);
    // Where the path was read from a file, its line says more than the pass.
    let line = match path.passes.get(pass).map(|p| &p.motion) {
        Some(PassMotion::Timed(timed)) => timed.line_near(pose),
        _ => None,
    };
    let line = line.map(|line| format!("line {line}, ")).unwrap_or_default();
    format!(
        "{line}pass {pass} ({kind}{strip}) at tip [{:.3}, {:.3}, {:.3}], axis [{:.5}, {:.5}, {:.5}]",
        tip.x, tip.y, tip.z, axis.x, axis.y, axis.z
    )
}
