//! The machine's chain reduced to what following a program needs: the tool in the part frame from the axes, the
//! linear axes from the tip, and a bound on how far axis points leave their chords.

use super::tool_motion::{Path, Segment};
use crate::geometry::{Direction, Point, RigidMotion, Vector};
use crate::machine::AxisPosition;
use crate::motion::Pose;
use nalgebra::Matrix3;

/// A rotary joint: a line of the machine frame at axis zero, and which axis turns about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// Index into [`AxisPosition::rotary`].
    pub axis: usize,
    /// A point of the line, mm.
    pub pivot: Point,
    /// Unit direction; a positive axis value turns right-handed about it.
    pub direction: Direction,
}

impl Turn {
    /// `vector` turned by `angle` radians (Rodrigues).
    fn turn(&self, vector: Vector, angle: f64) -> Vector {
        let (sin, cos) = angle.sin_cos();
        let axis = self.direction.into_inner();
        vector * cos + axis.cross(&vector) * sin + axis * (axis.dot(&vector) * (1.0 - cos))
    }

    /// `point` turned about the line by `angle` radians.
    fn turn_point(&self, point: Point, angle: f64) -> Point {
        self.pivot + self.turn(point - self.pivot, angle)
    }
}

/// A chain part - table turns - linear axes - head turns - tool, all given in the machine frame with every axis at
/// zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Turns that carry the part, from the base outward.
    table: Vec<Turn>,
    /// Turns that carry the tool, from the base outward.
    head: Vec<Turn>,
    /// Columns: motion of the tool relative to the base per mm of X, Y, Z.
    linear: Matrix3<f64>,
    /// Its inverse.
    linear_inverse: Matrix3<f64>,
    /// Tip with every axis at zero.
    tip: Point,
    /// Tool axis with every axis at zero.
    axis: Direction,
    /// From the part frame to the machine frame with every axis at zero.
    placement: RigidMotion,
}

impl Chain {
    /// Joins the parts; `None` when the three linear directions do not span space.
    pub fn new(
        table: Vec<Turn>,
        head: Vec<Turn>,
        linear: Matrix3<f64>,
        tool: Pose,
        placement: RigidMotion,
    ) -> Option<Self> {
        let linear_inverse = linear.try_inverse()?;
        Some(Self { table, head, linear, linear_inverse, tip: tool.tip, axis: tool.axis, placement })
    }

    /// A vector of the machine frame seen from the part frame.
    fn vector_to_part(&self, vector: Vector, rotary: [f64; 2]) -> Vector {
        let turned = self.table.iter().fold(vector, |v, joint| joint.turn(v, -rotary[joint.axis]));
        self.placement.inverse_transform_vector(&turned)
    }

    /// Tool axis in the part frame for rotary angles in radians.
    pub fn axis(&self, rotary: [f64; 2]) -> Direction {
        let axis = self.head.iter().rev().fold(self.axis.into_inner(), |v, joint| joint.turn(v, rotary[joint.axis]));
        Direction::new_normalize(self.vector_to_part(axis, rotary))
    }

    /// Tip in the machine frame as the head turns alone place it.
    fn head_tip(&self, rotary: [f64; 2]) -> Point {
        self.head.iter().rev().fold(self.tip, |p, joint| joint.turn_point(p, rotary[joint.axis]))
    }

    /// Tool pose in the part frame.
    pub fn pose(&self, axes: &AxisPosition) -> Pose {
        let carried = self.head_tip(axes.rotary) + self.linear * Vector::from(axes.linear);
        let tip = self.table.iter().fold(carried, |p, joint| joint.turn_point(p, -axes.rotary[joint.axis]));
        Pose { tip: self.placement.inverse_transform_point(&tip), axis: self.axis(axes.rotary) }
    }

    /// X, Y, Z that put the tip at a point of the part frame, for given rotary angles.
    pub fn linear_for(&self, tip: Point, rotary: [f64; 2]) -> [f64; 3] {
        let placed = self.placement * tip;
        let turned = self.table.iter().rev().fold(placed, |p, joint| joint.turn_point(p, rotary[joint.axis]));
        (self.linear_inverse * (turned - self.head_tip(rotary))).into()
    }

    /// See [`super::ToolMotion::chord_bound`].
    ///
    /// A curve leaves its chord over a parameter interval w by at most max|p''| w^2 / 8. The axis point is a sum of
    /// vectors, each turned by some of the joints; a vector of length r turned by joints of total rate W has a second
    /// derivative of at most W^2 r, and one that also grows at the speed v, at most W^2 r + 2 W v.
    pub(super) fn chord_bound(&self, segment: &Segment, from: f64, to: f64, height: f64) -> f64 {
        let rate = |joint: &Turn| (segment.to.rotary[joint.axis] - segment.from.rotary[joint.axis]).abs();
        let second_derivative = match segment.path {
            Path::Tip { .. } => {
                let rate: f64 = self.table.iter().chain(&self.head).map(rate).sum();
                rate * rate * height.abs()
            }
            Path::Joints => self.joint_bend(segment, (from, to), height, rate),
        };
        second_derivative * (to - from).powi(2) / 8.0
    }

    /// Bound on the second derivative of the axis point by the share, where every axis moves linearly.
    fn joint_bend(&self, segment: &Segment, shares: (f64, f64), height: f64, rate: impl Fn(&Turn) -> f64) -> f64 {
        let mut bend = 0.0;
        // Table: p = c_n + R_n(c_{n-1} - c_n) + ... + R_n ... R_1 (u - c_1), outermost joint n turning last.
        let mut table_rate: f64 = self.table.iter().map(&rate).sum();
        let mut carried_rate = table_rate;
        for pair in self.table.windows(2) {
            let [inner, outer] = pair else { continue };
            table_rate -= rate(inner);
            bend += table_rate * table_rate * (inner.pivot - outer.pivot).norm();
        }
        // Base: the linear axes, and what stands still beside them.
        let base = self.head.first().map_or(self.tip + self.axis.into_inner() * height, |joint| joint.pivot);
        let origin = self.table.first().map_or(base, |joint| joint.pivot);
        let (start, end) = (Vector::from(segment.from.linear), Vector::from(segment.to.linear));
        let reach = |share: f64| (self.linear * (start + (end - start) * share) + (base - origin)).norm();
        let speed = (self.linear * (end - start)).norm();
        bend += carried_rate * (carried_rate * reach(shares.0).max(reach(shares.1)) + 2.0 * speed);
        // Head: u = c_1 + K_1(c_2 - c_1) + ... + K_1 ... K_m(tool point - c_m).
        for (index, joint) in self.head.iter().enumerate() {
            let next = self.head.get(index + 1);
            let end = next.map_or(self.tip + self.axis.into_inner() * height, |joint| joint.pivot);
            carried_rate += rate(joint);
            bend += carried_rate * carried_rate * (end - joint.pivot).norm();
        }
        bend
    }
}
