//! A machine with a part and a tool on it: forward and inverse kinematics, and the words of a program. Uses
//! `diagnostic`, `geometry` and `motion`.
//!
//! With the part's zero at `o`, the linear axes at `j` (directions in the columns of `U`), and `R_k` the right-handed
//! rotation by `sign * word` about rotary axis `k` of the chain from part to tool, a point of the part `x` that the tip
//! touches is
//!
//! ```text
//! x + o = R_tables (U j + R_heads(t) + s),   t = gauge point - length * spindle axis
//! ```
//!
//! where `s` is zero if the axes count the gauge point, and `length * spindle axis` if they count the tip,
//!
//! and the tool axis is `d = R_1 R_2 a` with `a` the spindle axis: ISO 841 counts how the tool moves as seen from the
//! part, so every ISO axis enters with its plain sign, whether it turns table or head.

use super::axes::AxisPosition;
use super::control::{OrientationWords, TcpInterpolation};
use super::model::{AxisZero, Carrier, Machine};
use super::rotaries::{Orientations, Rotaries, Turn};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Direction, Point, Vector};
use crate::motion::Pose;
use nalgebra::Matrix3;
use std::f64::consts::{PI, TAU};

/// How the control gets from one block's end to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Every axis linear (TCP off).
    Axes,
    /// Tip straight in the part, rotary axes linear (TCP on).
    TipAndRotary,
    /// Tip straight in the part, tool axis along the great circle (TCP on with vector interpolation).
    TipAndVector,
}

/// A tool axis direction that the rotary axes cannot make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unreachable {
    /// Letter of the rotary axis that would have to reach further.
    pub axis: char,
    /// By how much the direction misses the reachable zone, radians.
    pub by: f64,
}

/// The axis positions that bring the tool to a pose: one a branch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseSolutions {
    /// The two branches; equal where they meet. Rotary angles lie within half a turn of zero; whole turns may be added.
    pub branches: [AxisPosition; 2],
    /// Index of the rotary axis that may stand anywhere, because the tool axis lies along it (pole). The branches then
    /// hold it at zero; [`Setup::with_rotary`] gives the position for another angle.
    pub free: Option<usize>,
}

/// A machine with the part at a work offset and a tool in the spindle.
#[derive(Clone, Debug)]
pub struct Setup {
    machine: Machine,
    work_offset: [f64; 3],
    tool_length: f64,
    /// Rotary axes in the order of the chain.
    joints: [Joint; 2],
    rotaries: Rotaries,
    directions: Matrix3<f64>,
    inverse_directions: Matrix3<f64>,
    /// Tip with every axis at zero if the axes counted the gauge point, machine frame, mm.
    tip: Vector,
    /// What is added because the axes count the tip, mm.
    shift: Vector,
}

/// A rotary axis as the chain sees it.
#[derive(Clone, Copy, Debug)]
struct Joint {
    /// Index in the machine file's order.
    index: usize,
    on: Carrier,
    direction: Vector,
    pivot: Vector,
    sign: f64,
}

impl Joint {
    /// Turns a point about the axis.
    fn turn(&self, turn: &Turn, point: Vector) -> Vector {
        turn.apply(&self.direction, point - self.pivot) + self.pivot
    }
}

impl Setup {
    /// Puts the part at a work offset named in the machine file, and a tool of `tool_length` mm (tip to gauge point)
    /// into the spindle.
    pub fn new(machine: &Machine, work_offset: &str, tool_length: f64) -> Result<Self> {
        let offsets = &machine.control.work_offsets;
        let Some(found) = offsets.iter().find(|o| o.name == work_offset) else {
            let names: Vec<&str> = offsets.iter().map(|o| o.name.as_str()).collect();
            return Err(Diagnostic::error(format!("machine {} has no work offset \"{work_offset}\"", machine.name))
                .help(format!("write one of {}, or add it to [control.work_offsets]", names.join(", "))));
        };
        Self::at(machine, found.linear, tool_length)
    }

    /// Puts the part's zero at `work_offset` mm in the machine frame.
    pub fn at(machine: &Machine, work_offset: [f64; 3], tool_length: f64) -> Result<Self> {
        if !(tool_length.is_finite() && tool_length >= 0.0) {
            return Err(Diagnostic::error(format!("tool length {tool_length} mm is not a length"))
                .help("write the distance from tip to gauge line in mm, zero or more"));
        }
        if let Some(bad) = work_offset.iter().find(|v| !v.is_finite()) {
            return Err(Diagnostic::error(format!("work offset {bad} is not a finite number"))
                .help("write the position of the part's zero in mm"));
        }
        let joints = machine.chain.map(|index| {
            let axis = &machine.rotary[index];
            Joint {
                index,
                on: axis.on,
                direction: axis.direction.into_inner(),
                pivot: axis.pivot.coords,
                sign: axis.sign(),
            }
        });
        let directions = Matrix3::from_columns(&machine.linear.each_ref().map(|axis| axis.direction.into_inner()));
        let inverse_directions = directions.try_inverse().ok_or_else(|| {
            Diagnostic::error(format!("the linear axes of machine {} lie in one plane", machine.name))
                .help("give them directions that span space")
        })?;
        let [first, second] = machine.chain.map(|index| machine.rotary[index].direction);
        let rotaries = Rotaries::new(first, second, machine.spindle.axis)
            .map_err(|reason| Diagnostic::error(format!("machine {}: {reason}", machine.name)))?;
        let lever = machine.spindle.axis.into_inner() * tool_length;
        let shift = match machine.spindle.axis_zero {
            AxisZero::GaugePoint => Vector::zeros(),
            AxisZero::Tip => lever,
        };
        Ok(Self {
            machine: machine.clone(),
            work_offset,
            tool_length,
            joints,
            rotaries,
            directions,
            inverse_directions,
            tip: machine.spindle.gauge_point.coords - lever,
            shift,
        })
    }

    /// The machine.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Part's zero in the machine frame at rotary zero, mm.
    pub fn work_offset(&self) -> [f64; 3] {
        self.work_offset
    }

    /// Tip to gauge point, mm.
    pub fn tool_length(&self) -> f64 {
        self.tool_length
    }

    /// Smallest and largest angle between the pole (the rotary axis nearer the part) and the tool axes that the rotary
    /// axes can make, radians.
    pub fn reach(&self) -> [f64; 2] {
        self.rotaries.reach()
    }

    /// Angle between a tool axis and the line of the pole, radians.
    pub fn pole_distance(&self, axis: &Direction) -> f64 {
        self.rotaries.pole_distance(axis)
    }

    /// Whether a tool axis lies within a small angle, radians, of the line of the pole.
    pub(super) fn near_pole(&self, axis: &Direction, angle: f64) -> bool {
        self.rotaries.near_pole(axis, angle)
    }

    /// How the control of this machine gets from one block's end to the next in programs written for it, with TCP on or
    /// off.
    pub fn interpolation(&self, tcp: bool) -> Interpolation {
        let options = &self.machine.control.options;
        let turning = match options.orientation {
            OrientationWords::Angles => options.tcp_interpolation,
            OrientationWords::Vectors => options.vector_interpolation,
        };
        match (tcp, turning) {
            (false, _) => Interpolation::Axes,
            (true, TcpInterpolation::RotaryLinear) => Interpolation::TipAndRotary,
            (true, TcpInterpolation::GreatCircle) => Interpolation::TipAndVector,
        }
    }

    /// The tip with every axis at zero if the axes counted the gauge point, machine frame, mm.
    pub(super) fn tip_at_zero(&self) -> Vector {
        self.tip
    }

    /// Where the linear axes would stand if they counted the gauge point, mm.
    pub(super) fn counted(&self, axes: &AxisPosition) -> Vector {
        Vector::from(axes.linear) + self.inverse_directions * self.shift
    }

    /// Directions of the linear axes in columns, and the inverse of that.
    pub(super) fn linear_directions(&self) -> (&Matrix3<f64>, &Matrix3<f64>) {
        (&self.directions, &self.inverse_directions)
    }

    /// The turns of the chain from part to tool for rotary positions in the machine file's order, radians.
    fn turns(&self, rotary: [f64; 2]) -> [Turn; 2] {
        self.joints.each_ref().map(|joint| Turn::by(joint.sign * rotary[joint.index & 1]))
    }

    /// The tip before the tables turn it: head turns applied, linear axes at zero.
    fn tip_at_linear_zero(&self, turns: &[Turn; 2]) -> Vector {
        let mut tip = self.tip;
        for (joint, turn) in self.joints.iter().zip(turns).rev() {
            if joint.on == Carrier::Head {
                tip = joint.turn(turn, tip);
            }
        }
        tip + self.shift
    }

    fn turned_axis(&self, [first, second]: &[Turn; 2]) -> Direction {
        Direction::new_normalize(first.apply(&self.joints[0].direction, self.rotaries.tilted(second)))
    }

    /// Where the tool stands in the part frame.
    pub fn forward(&self, axes: &AxisPosition) -> Pose {
        let turns = self.turns(axes.rotary);
        let mut tip = self.tip_at_linear_zero(&turns) + self.directions * Vector::from(axes.linear);
        for (joint, turn) in self.joints.iter().zip(&turns).rev() {
            if joint.on == Carrier::Table {
                tip = joint.turn(turn, tip);
            }
        }
        Pose { tip: Point::from(tip - Vector::from(self.work_offset)), axis: self.turned_axis(&turns) }
    }

    /// The tool axis in the part frame for rotary positions in the machine file's order, radians.
    pub fn axis(&self, rotary: [f64; 2]) -> Direction {
        self.turned_axis(&self.turns(rotary))
    }

    /// The positions of the linear axes that bring the tip to a point of the part with the rotary axes where they are;
    /// `rotary` in radians, `tip` in the part frame.
    pub fn with_rotary(&self, tip: &Point, rotary: [f64; 2]) -> AxisPosition {
        AxisPosition { linear: self.linear(tip, &self.turns(rotary)), rotary }
    }

    fn linear(&self, tip: &Point, turns: &[Turn; 2]) -> [f64; 3] {
        let mut wanted = tip.coords + Vector::from(self.work_offset);
        for (joint, turn) in self.joints.iter().zip(turns) {
            if joint.on == Carrier::Table {
                wanted = joint.turn(&turn.back(), wanted);
            }
        }
        (self.inverse_directions * (wanted - self.tip_at_linear_zero(turns))).into()
    }

    /// Rotary positions in the machine file's order of turns in the order of the chain.
    fn rotary(&self, turns: &[Turn; 2]) -> [f64; 2] {
        let mut rotary = [0.0; 2];
        for (joint, turn) in self.joints.iter().zip(turns) {
            rotary[joint.index & 1] = joint.sign * turn.angle;
        }
        rotary
    }

    /// The axis positions that bring the tool to a pose of the part frame. Limits are not looked at.
    pub fn inverse(&self, pose: &Pose) -> Result<InverseSolutions, Unreachable> {
        let Orientations { branches, free } = self.orientations(pose)?;
        let branches =
            branches.map(|turns| AxisPosition { linear: self.linear(&pose.tip, &turns), rotary: self.rotary(&turns) });
        Ok(InverseSolutions { branches, free: free.then_some(self.joints[0].index) })
    }

    fn orientations(&self, pose: &Pose) -> Result<Orientations, Unreachable> {
        let letter = self.machine.rotary[self.joints[1].index].letter;
        self.rotaries.solve(&pose.axis).map_err(|by| Unreachable { axis: letter, by })
    }

    /// Of all axis positions for a pose, whole turns added, the one whose rotary angles are nearest to `rotary`,
    /// radians. A free axis stays at its angle in `rotary`. `None` if the machine cannot make the direction.
    pub fn inverse_near(&self, pose: &Pose, rotary: [f64; 2]) -> Option<AxisPosition> {
        let Orientations { branches, free } = self.orientations(pose).ok()?;
        let unwound = branches.each_ref().map(|turns| {
            let angles = self.rotary(turns);
            let mut angles: [f64; 2] = std::array::from_fn(|k| unwind(angles[k], rotary[k]));
            if free {
                let index = self.joints[0].index & 1;
                angles[index] = rotary[index];
            }
            angles
        });
        let distance = |angles: &[f64; 2]| (angles[0] - rotary[0]).hypot(angles[1] - rotary[1]);
        let best = usize::from(distance(&unwound[1]) < distance(&unwound[0]));
        if free {
            return Some(self.with_rotary(&pose.tip, unwound[best]));
        }
        Some(AxisPosition { linear: self.linear(&pose.tip, &branches[best]), rotary: unwound[best] })
    }

    /// What the control does between two positions.
    pub fn segment(&self, from: &AxisPosition, to: &AxisPosition, how: Interpolation) -> Segment<'_> {
        Segment { setup: self, axes: [*from, *to], poses: [self.forward(from), self.forward(to)], how }
    }
}

/// One block as the control plays it.
#[derive(Clone, Debug)]
pub struct Segment<'a> {
    setup: &'a Setup,
    axes: [AxisPosition; 2],
    poses: [Pose; 2],
    how: Interpolation,
}

impl Segment<'_> {
    /// Axis positions at both ends.
    pub fn ends(&self) -> &[AxisPosition; 2] {
        &self.axes
    }

    /// Pose in the part frame at `share` of the block, 0 to 1.
    pub fn pose(&self, share: f64) -> Pose {
        let [start, end] = &self.poses;
        match self.how {
            Interpolation::Axes => self.setup.forward(&self.axes[0].interpolate(&self.axes[1], share)),
            Interpolation::TipAndRotary => {
                let turned = self.axes[0].interpolate(&self.axes[1], share);
                Pose { tip: start.tip + (end.tip - start.tip) * share, axis: self.setup.axis(turned.rotary) }
            }
            Interpolation::TipAndVector => start.interpolate(end, share),
        }
    }

    /// Axis positions at `share` of the block, 0 to 1. With vector interpolation the rotary axes are taken near the
    /// straight way between the ends; `None` if the machine cannot make the direction.
    pub fn axes(&self, share: f64) -> Option<AxisPosition> {
        let straight = self.axes[0].interpolate(&self.axes[1], share);
        match self.how {
            Interpolation::Axes => Some(straight),
            Interpolation::TipAndRotary => Some(self.setup.with_rotary(&self.pose(share).tip, straight.rotary)),
            Interpolation::TipAndVector => self.setup.inverse_near(&self.pose(share), straight.rotary),
        }
    }
}

/// The angle that differs from `angle` by whole turns and is nearest to `near`, radians.
pub fn unwind(angle: f64, near: f64) -> f64 {
    let off = near - angle;
    // Most angles along a path are near the one before.
    if off.abs() < PI { angle } else { angle + (off / TAU).round() * TAU }
}
