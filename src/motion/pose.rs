//! Where a tool is: tip and axis direction.

use crate::geometry::{Direction, Point, RigidMotion, Vector};

/// A tool position in the part frame: the tip, mm, and the unit axis from the tip toward the spindle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Tip of the tool, on its axis.
    pub tip: Point,
    /// From the tip toward the spindle.
    pub axis: Direction,
}

impl Pose {
    /// The point of the axis at `height` above the tip, mm.
    pub fn at_height(&self, height: f64) -> Point {
        self.tip + self.axis.into_inner() * height
    }

    /// The same tool seen from another frame.
    pub fn transformed(&self, motion: &RigidMotion) -> Self {
        Self { tip: motion * self.tip, axis: motion * self.axis }
    }

    /// Tip on the straight line, axis on the great circle, between `self` (share 0) and `other` (share 1).
    pub fn interpolate(&self, other: &Self, share: f64) -> Self {
        Self { tip: self.tip + (other.tip - self.tip) * share, axis: great_circle(&self.axis, &other.axis, share) }
    }

    /// Largest distance of two tools along their axes from the tip to `height`: the distance is convex along the axis,
    /// so the larger of both ends.
    pub fn distance_along(&self, other: &Self, height: f64) -> f64 {
        (self.tip - other.tip).norm().max((self.at_height(height) - other.at_height(height)).norm())
    }

    /// Angle between the axes, radians, exact for small angles too.
    pub fn axis_angle(&self, other: &Self) -> f64 {
        angle_between(&self.axis, &other.axis)
    }
}

/// Angle between two directions, radians, exact for small and near-opposite angles.
pub fn angle_between(a: &Vector, b: &Vector) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

/// The direction at `share` of the great circle from `a` to `b`. Opposite directions have no great circle; then `a`
/// is kept up to half way.
pub fn great_circle(a: &Direction, b: &Direction, share: f64) -> Direction {
    let angle = angle_between(a, b);
    let sine = angle.sin();
    if angle < 1e-9 || sine < 1e-9 {
        let nearer = if share < 0.5 { a } else { b };
        return *nearer;
    }
    let mixed = a.into_inner() * ((1.0 - share) * angle).sin() + b.into_inner() * (share * angle).sin();
    Direction::new_normalize(mixed)
}
