//! Circular and helical ways. Uses `geometry` and the reading half of `nc`.

use crate::geometry::{Point, Vector};
use crate::nc::program::{ArcCentre, ArcWords};
use std::f64::consts::TAU;

/// A circular or helical way of a point; a slight difference of its radii at both ends is spread evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Centre, in the plane of the start.
    pub centre: Point,
    /// From the centre to the start.
    pub radius: Vector,
    /// Unit normal of the plane.
    pub normal: Vector,
    /// Angle swept, radians, right-handed about the normal.
    pub angle: f64,
    /// Motion along the normal.
    pub rise: Vector,
    /// Radius at the end over radius at the start.
    pub growth: f64,
}

/// Largest difference of the radii at both ends that counts as rounding, mm, and as a share of the radius.
const RADIUS_TOLERANCE: (f64, f64) = (0.02, 0.001);

/// Angle that counts as no turn at all, so that a whole one is meant, radians.
const FULL_TURN: f64 = 1e-9;

impl Arc {
    /// The arc from `from` to `to` that the words mean; `zero` is the work zero in the same coordinates. The reason in
    /// words where there is none.
    pub(super) fn from_words(words: &ArcWords, from: Point, to: Point, zero: Point) -> Result<Self, String> {
        let [first, second, across] = words.plane.axes();
        let mut normal = Vector::zeros();
        normal[across] = 1.0;
        let centre = match words.centre {
            ArcCentre::Radius(radius) => centre_by_radius(words, from, to, radius)?,
            ArcCentre::Point { words: offsets, absolute } => {
                let base = if absolute { zero } else { from };
                let mut centre = from;
                centre[first] = base[first] + offsets[first];
                centre[second] = base[second] + offsets[second];
                centre
            }
        };
        let rise = normal * (to[across] - from[across]);
        let (start, end) = (from - centre, to - rise - centre);
        let (start_radius, end_radius) = (start.norm(), end.norm());
        let difference = (start_radius - end_radius).abs();
        if start_radius.min(end_radius) < 1e-9 {
            return Err("the arc's centre is one of its ends".into());
        }
        if difference > RADIUS_TOLERANCE.0 && difference > RADIUS_TOLERANCE.1 * start_radius.max(end_radius) {
            return Err(format!(
                "the arc's radius is {start_radius:.4} mm at its start and {end_radius:.4} at its end"
            ));
        }
        let turned = normal.dot(&start.cross(&end)).atan2(start.dot(&end));
        let sign = if words.clockwise { -1.0 } else { 1.0 };
        let mut angle = (turned * sign).rem_euclid(TAU);
        if angle < FULL_TURN {
            angle += TAU;
        }
        angle += TAU * f64::from(words.turns.saturating_sub(1));
        Ok(Self { centre, radius: start, normal, angle: sign * angle, rise, growth: end_radius / start_radius })
    }

    /// The same arc moved.
    pub(super) fn moved(mut self, by: Vector) -> Self {
        self.centre += by;
        self
    }

    /// The point at `share`, 0 to 1.
    pub fn point(&self, share: f64) -> Point {
        let (sin, cos) = (self.angle * share).sin_cos();
        let turned = self.radius * cos + self.normal.cross(&self.radius) * sin;
        self.centre + turned * (1.0 + (self.growth - 1.0) * share) + self.rise * share
    }

    /// Length of the way, mm.
    pub fn length(&self) -> f64 {
        let mean = self.radius.norm() * (1.0 + self.growth) / 2.0;
        (self.angle * mean).hypot(self.rise.norm())
    }

    /// Bounds on the first and second derivative of the point by the share.
    pub(super) fn derivative_bounds(&self) -> (f64, f64) {
        let radius = self.radius.norm();
        let (largest, change) = (radius * self.growth.max(1.0), radius * (self.growth - 1.0).abs());
        let turn = self.angle.abs();
        (turn * largest + change + self.rise.norm(), turn * (turn * largest + 2.0 * change))
    }
}

/// The centre of the arc with that radius; a positive one takes the shorter way.
fn centre_by_radius(words: &ArcWords, from: Point, to: Point, radius: f64) -> Result<Point, String> {
    let [first, second, _] = words.plane.axes();
    let (du, dv) = (to[first] - from[first], to[second] - from[second]);
    let chord = du.hypot(dv);
    if chord < 1e-9 {
        return Err("an arc with a radius (R) cannot end where it starts".into());
    }
    let short = chord / 2.0 - radius.abs();
    if short > RADIUS_TOLERANCE.0 {
        return Err(format!("the arc's radius {radius} mm is too small for ends {chord:.4} mm apart"));
    }
    let height = (radius * radius - chord * chord / 4.0).max(0.0).sqrt();
    // The centre of a counterclockwise arc shorter than half a turn lies left of the chord.
    let side = if words.clockwise == (radius > 0.0) { -height } else { height };
    let mut centre = from;
    centre[first] += du / 2.0 - dv / chord * side;
    centre[second] += dv / 2.0 + du / chord * side;
    Ok(centre)
}
