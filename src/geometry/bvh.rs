//! Axis-aligned boxes and a bounding volume hierarchy over them, shared by spline patches and triangles.

use super::{Point, Vector};

/// An axis-aligned box, mm. Empty when low exceeds high.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Least coordinates.
    pub low: Point,
    /// Greatest coordinates.
    pub high: Point,
}

impl Aabb {
    /// The box that holds nothing.
    pub fn empty() -> Self {
        Self { low: Point::from(Vector::repeat(f64::INFINITY)), high: Point::from(Vector::repeat(f64::NEG_INFINITY)) }
    }

    /// Smallest box around points.
    pub fn around<'a>(points: impl IntoIterator<Item = &'a Point>) -> Self {
        points.into_iter().fold(Self::empty(), |bounds, p| Self { low: bounds.low.inf(p), high: bounds.high.sup(p) })
    }

    /// Smallest box around both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// Middle.
    pub fn centre(&self) -> Point {
        nalgebra::center(&self.low, &self.high)
    }

    /// Length of the diagonal, mm; 0 for an empty box.
    pub fn diagonal(&self) -> f64 {
        if self.low.x > self.high.x { 0.0 } else { (self.high - self.low).norm() }
    }

    /// Square of the distance from `p`; 0 inside.
    pub fn distance_squared(&self, p: &Point) -> f64 {
        (self.low - p).sup(&(p - self.high)).sup(&Vector::zeros()).norm_squared()
    }
}
