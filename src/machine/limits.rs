//! Axis positions against the limits of a machine. Uses nothing beyond the machine.

use super::axes::AxisPosition;
use super::model::{Machine, RotaryAxis, Travel};

/// Slack on limits for rounding, mm and degrees.
const SLACK: f64 = 1e-9;

/// Why an axis cannot stand where it would have to.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Reason {
    /// It passes a limit.
    Limit,
    /// It is clamped while the tool cuts.
    Clamped,
    /// The machine does not have it.
    Absent,
}

/// An axis that would have to stand where it cannot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Excess {
    axis: char,
    value: f64,
    limit: f64,
    /// How far beyond, mm or degrees.
    pub(super) by: f64,
    unit: &'static str,
    reason: Reason,
}

impl Excess {
    /// A rotary axis at an angle, radians, beyond its travel by more than `slack`, radians.
    pub(super) fn of_rotary(axis: &RotaryAxis, angle: f64, slack: f64) -> Option<Self> {
        let by = axis.travel.excess(angle);
        let limit = if let Travel::Limited { min, max } = axis.travel { angle.clamp(min, max) } else { angle };
        let outside = by > slack + SLACK.to_radians();
        let [value, limit, by] = [angle, limit, by].map(f64::to_degrees);
        outside.then_some(Self {
            axis: axis.letter,
            value,
            limit,
            by,
            unit: "degrees",
            reason: reason(axis, Reason::Limit),
        })
    }

    /// A rotary axis that would have to turn by `by` radians away from where it must stand still.
    pub(super) fn of_standing(axis: &RotaryAxis, held: f64, by: f64) -> Self {
        let [value, limit, by] = [held + by, held, by].map(f64::to_degrees);
        Self { axis: axis.letter, value, limit, by, unit: "degrees", reason: reason(axis, Reason::Clamped) }
    }

    /// A linear axis beyond its travel, mm.
    pub(super) fn of_linear(machine: &Machine, linear: &[f64; 3]) -> Option<Self> {
        machine.linear.iter().zip(linear).find_map(|(axis, value)| {
            let by = (axis.min - value).max(value - axis.max);
            let limit = value.clamp(axis.min, axis.max);
            (by > SLACK).then_some(Self {
                axis: axis.letter,
                value: *value,
                limit,
                by,
                unit: "mm",
                reason: Reason::Limit,
            })
        })
    }

    /// What helps.
    pub(super) fn remedy(&self) -> &'static str {
        match self.reason {
            Reason::Limit => "move the work offset, mount the part turned, or choose a machine with more travel",
            Reason::Clamped => {
                "mount the part so that the axis is clamped where the path needs it, or choose a machine whose axis turns \
                 while the tool cuts"
            }
            Reason::Absent => "mount the part tilted, or choose a machine with more rotary axes",
        }
    }

    /// An axis outside its limits, if any; the rotary axes first.
    pub(super) fn of(machine: &Machine, axes: &AxisPosition) -> Option<Self> {
        let mut rotary = machine.rotary.iter().zip(axes.rotary);
        let rotary = rotary.find_map(|(axis, angle)| Self::of_rotary(axis, angle, 0.0));
        rotary.or_else(|| Self::of_linear(machine, &axes.linear))
    }
}

impl std::fmt::Display for Excess {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { axis, value, limit, by, unit, reason } = self;
        match reason {
            Reason::Limit => {
                write!(
                    f,
                    "axis {axis} would have to stand at {value:.4} {unit}, {by:.4} {unit} beyond its limit {limit:.4}"
                )
            }
            Reason::Clamped => {
                write!(
                    f,
                    "axis {axis} is clamped at {limit:.4} {unit} while the tool cuts, and would have to turn by {by:.4}"
                )
            }
            Reason::Absent => {
                write!(f, "the tool would have to tilt {by:.4} degrees, for which the machine has no axis")
            }
        }
    }
}

/// An axis that is not there is the reason before any other.
fn reason(axis: &RotaryAxis, other: Reason) -> Reason {
    if axis.is_present() { other } else { Reason::Absent }
}
