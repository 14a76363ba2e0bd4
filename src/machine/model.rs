//! A machine as plain checked values: axes, bodies, spindle, control. Uses `diagnostic` and `geometry`.
//!
//! Frames: the machine frame stands on the machine's base; its zero is where every linear axis reads zero. All
//! directions and pivots are given in it, with every axis at zero.

use super::bodies::{Body, Form};
use super::control::Control;
use crate::diagnostic::Result;
use crate::geometry::{Direction, Point};

/// How far a rotary axis turns and how its control counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Travel {
    /// Between two ends, radians; words are literal angles.
    Limited {
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
    },
    /// Turns without end; words are literal angles, so 720 is two turns from 0.
    Unlimited,
    /// Turns without end; words count from 0 to below 360 degrees and the control takes the shorter way.
    Wrapped,
}

impl Travel {
    /// How far `angle` lies outside, radians; 0 inside.
    pub fn excess(&self, angle: f64) -> f64 {
        match self {
            Self::Limited { min, max } => (min - angle).max(angle - max).max(0.0),
            Self::Unlimited | Self::Wrapped => 0.0,
        }
    }
}

/// X, Y or Z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearAxis {
    /// `X`, `Y` or `Z`.
    pub letter: char,
    /// What it moves.
    pub on: Carrier,
    /// Way in which the tool moves relative to the table when the axis counts up.
    pub direction: Direction,
    /// Lowest position, mm.
    pub min: f64,
    /// Highest position, mm.
    pub max: f64,
    /// Top speed, mm/s.
    pub speed: f64,
    /// Top acceleration, mm/s^2.
    pub acceleration: f64,
    /// Top jerk, mm/s^3; `None` where it is not limited.
    pub jerk: Option<f64>,
}

/// What an axis moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Carrier {
    /// The part.
    Table,
    /// The tool.
    Head,
}

/// Which way a positive word turns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sense {
    /// ISO 841: the tool turns right-handed about the axis direction as seen from the part, so a table turns the
    /// other way.
    #[default]
    Iso,
    /// The opposite of ISO 841.
    Reversed,
}

/// When a rotary axis can turn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum RotaryMotion {
    /// At any time, together with the other axes.
    #[default]
    Continuous,
    /// Only while the tool does not cut; it is clamped at multiples of the step, radians, or anywhere if that is zero.
    Indexed {
        /// Distance between the angles at which it is clamped, radians.
        step: f64,
    },
    /// Never: the machine has no such axis. It stands at zero in a place of the chain that would else be empty, so that
    /// machines with fewer axes are five-axis machines with locked ones.
    Absent,
}

/// A rotary axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotaryAxis {
    /// `A`, `B` or `C`.
    pub letter: char,
    /// What it turns.
    pub on: Carrier,
    /// Direction of its axis.
    pub direction: Direction,
    /// A point of its axis, mm.
    pub pivot: Point,
    /// Which way a positive word turns.
    pub sense: Sense,
    /// How far it turns.
    pub travel: Travel,
    /// When it can turn.
    pub motion: RotaryMotion,
    /// Top speed, rad/s.
    pub speed: f64,
    /// Top acceleration, rad/s^2.
    pub acceleration: f64,
    /// Top jerk, rad/s^3; `None` where it is not limited.
    pub jerk: Option<f64>,
}

impl RotaryAxis {
    /// +1 where a positive word turns the tool right-handed as seen from the part, else -1.
    pub fn sign(&self) -> f64 {
        match self.sense {
            Sense::Iso => 1.0,
            Sense::Reversed => -1.0,
        }
    }

    /// Whether the machine has this axis.
    pub fn is_present(&self) -> bool {
        self.motion != RotaryMotion::Absent
    }

    /// Whether it turns while the tool cuts.
    pub fn is_continuous(&self) -> bool {
        self.motion == RotaryMotion::Continuous
    }
}

/// What the linear axes count at rotary zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AxisZero {
    /// The gauge point of the spindle: with a longer tool the axes stand further away for the same tip.
    #[default]
    GaugePoint,
    /// The tip of the tool: the control takes the tool length into its kinematics and out of the axes.
    Tip,
}

/// Where the tool sits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spindle {
    /// From the tip toward the spindle, with the rotary axes at zero.
    pub axis: Direction,
    /// The gauge point with every axis at zero, mm.
    pub gauge_point: Point,
    /// What the linear axes count.
    pub axis_zero: AxisZero,
}

/// How far the machine may be from its own numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Of each pivot along each of the machine's directions, mm.
    pub pivot: f64,
    /// Of the direction of each rotary axis, about each of the machine's directions, radians.
    pub direction: f64,
    /// Of the angle at which each rotary axis stands, radians.
    pub angle: f64,
}

/// A machine of three to five axes and its control.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Name, as in a job file.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// Where the numbers come from.
    pub source: String,
    /// X, Y, Z.
    pub linear: [LinearAxis; 3],
    /// Indices into `linear` from the base outward: what sits on another axis comes after it.
    pub linear_order: [usize; 3],
    /// The two rotary axes in the order of the machine file, which is the order in [`super::AxisPosition::rotary`]; those
    /// that the machine does not have come last.
    pub rotary: [RotaryAxis; 2],
    /// Indices into `rotary` in the order of the chain from the part to the tool.
    pub chain: [usize; 2],
    /// What it is made of, as far as a tool or a part could run into it.
    pub bodies: Vec<Body>,
    /// Where the tool sits.
    pub spindle: Spindle,
    /// How far all this may be off; `None` where the machine file does not say.
    pub tolerances: Option<Tolerances>,
    /// The control.
    pub control: Control,
}

impl Machine {
    /// The letters of the five axes: X, Y, Z, then the rotary axes in the order of the machine file. An axis that the
    /// machine does not have gets a letter that no other has.
    pub fn letters(&self) -> [char; 5] {
        let [x, y, z] = self.linear.each_ref().map(|axis| axis.letter);
        let [first, second] = self.rotary.each_ref().map(|axis| axis.letter);
        [x, y, z, first, second]
    }

    /// The letters of the axes that the machine has.
    pub fn present_letters(&self) -> Vec<char> {
        let rotary = self.rotary.iter().filter(|axis| axis.is_present()).map(|axis| axis.letter);
        self.linear.iter().map(|axis| axis.letter).chain(rotary).collect()
    }

    /// The files of meshes that bodies name and that have not been read yet: index of the body and name, relative to the
    /// folder of the machine file.
    pub fn body_files(&self) -> impl Iterator<Item = (usize, &str)> {
        let file = |(index, body)| match body {
            &Body { form: Form::File(ref file), .. } => Some((index, file.as_str())),
            _ => None,
        };
        self.bodies.iter().enumerate().filter_map(file)
    }

    /// The machine with the content of the file that a body names; `name` is the file's for messages.
    ///
    /// # Errors
    /// A file that holds no closed mesh.
    pub fn with_body_file(mut self, index: usize, name: &str, bytes: &[u8]) -> Result<Self> {
        if let Some(body) = self.bodies.get_mut(index) {
            *body = body.clone().with_file(name, bytes)?;
        }
        Ok(self)
    }

    /// Whether the machine has the axis of an index in [`Self::letters`].
    pub fn has_axis(&self, index: usize) -> bool {
        index < 3 || self.rotary.get(index - 3).is_some_and(RotaryAxis::is_present)
    }

    /// Top speeds in the order of [`Self::letters`], mm/s and rad/s.
    pub fn speeds(&self) -> [f64; 5] {
        let ([x, y, z], [a, b]) = (self.linear.each_ref().map(|a| a.speed), self.rotary.each_ref().map(|a| a.speed));
        [x, y, z, a, b]
    }

    /// Top accelerations in the order of [`Self::letters`], mm/s^2 and rad/s^2.
    pub fn accelerations(&self) -> [f64; 5] {
        let [x, y, z] = self.linear.each_ref().map(|a| a.acceleration);
        let [a, b] = self.rotary.each_ref().map(|a| a.acceleration);
        [x, y, z, a, b]
    }

    /// Top jerks in the order of [`Self::letters`], mm/s^3 and rad/s^3; infinite where there is no limit.
    pub fn jerks(&self) -> [f64; 5] {
        let [x, y, z] = self.linear.each_ref().map(|a| a.jerk.unwrap_or(f64::INFINITY));
        let [a, b] = self.rotary.each_ref().map(|a| a.jerk.unwrap_or(f64::INFINITY));
        [x, y, z, a, b]
    }
}
