//! Two rotary angles from a tool axis direction: the second Paden-Kahan subproblem for any two directions, in closed
//! form. Uses `geometry`.
//!
//! Wanted are `p1`, `p2` with `R(e1, p1) R(e2, p2) a = d`. The arcs between e1 and e2 (kappa), e2 and a (mu) and e1 and
//! d (alpha) are the sides of a spherical triangle whose angle at e2 is psi:
//!
//! ```text
//! cos alpha = cos kappa cos mu + sin kappa sin mu cos psi
//! tan(psi/2)^2 = sin((alpha + mu - kappa)/2) sin((alpha + kappa - mu)/2)
//!              / (sin((kappa + mu + alpha)/2) sin((kappa + mu - alpha)/2))
//! ```
//!
//! The half-angle form (spherical trigonometry's half-side rule) keeps full accuracy near the pole, where the cosine
//! form loses half the digits. Then `p2 = p0 +- psi`, with `p0` the angle at which `R(e2, p2) a` is nearest to e1, and
//! `p1` turns the result onto d. Source: Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation, 3.3.

use crate::geometry::{Direction, Vector};
use std::f64::consts::PI;

/// How near to the pole, radians, the first angle is called free.
const POLE: f64 = 1e-11;

/// How far out of reach, radians, a direction may lie to be taken as rounding.
const ROUNDING: f64 = 2e-11;

/// A right-handed turn about an axis, with what it costs to know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Turn {
    /// Radians.
    pub(super) angle: f64,
    /// Its sine and cosine.
    pub(super) sin_cos: (f64, f64),
}

impl Turn {
    /// A turn by an angle, radians.
    pub(super) fn by(angle: f64) -> Self {
        Self { angle, sin_cos: angle.sin_cos() }
    }

    /// Turns a vector about a unit axis (Rodrigues).
    pub(super) fn apply(&self, axis: &Vector, v: Vector) -> Vector {
        let (sin, cos) = self.sin_cos;
        let along = axis * axis.dot(&v);
        along + (v - along) * cos + axis.cross(&v) * sin
    }

    /// The turn the other way.
    #[must_use]
    pub(super) fn back(&self) -> Self {
        let (sin, cos) = self.sin_cos;
        Self { angle: -self.angle, sin_cos: (-sin, cos) }
    }
}

/// Both pairs of turns for one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Orientations {
    /// `[first, second]` in chain order, within half a turn of zero; one pair a branch.
    pub(super) branches: [[Turn; 2]; 2],
    /// The first angle may be anything; it is given as zero.
    pub(super) free: bool,
}

/// Two rotary axes in the order of the chain from part to tool, with what does not change from pose to pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rotaries {
    first: Vector,
    /// Components of the spindle axis: along the second axis, across it, and the third direction.
    along: Vector,
    across: Vector,
    third: Vector,
    /// Turn of the second axis at which the tool comes nearest to the first axis.
    nearest: Turn,
    /// Sine and cosine of (mu - kappa)/2 and (mu + kappa)/2.
    half_difference: (f64, f64),
    half_sum: (f64, f64),
}

impl Rotaries {
    /// Refuses directions with which no two angles of freedom remain.
    pub(super) fn new(first: Direction, second: Direction, spindle: Direction) -> Result<Self, &'static str> {
        let (e1, e2, a) = (first.into_inner(), second.into_inner(), spindle.into_inner());
        if e1.cross(&e2).norm() < 1e-6 {
            return Err("the two rotary axes are parallel, so that together they turn about one direction only");
        }
        if e2.cross(&a).norm() < 1e-6 {
            return Err("the rotary axis nearer the tool lies along the spindle and does not tilt the tool");
        }
        let kappa = angle(&e1, &e2);
        let mu = angle(&e2, &a);
        let along = e2 * e2.dot(&a);
        let (across, third) = (a - along, e2.cross(&a));
        Ok(Self {
            first: e1,
            along,
            across,
            third,
            nearest: Turn::by(e1.dot(&third).atan2(e1.dot(&across))),
            half_difference: ((mu - kappa) / 2.0).sin_cos(),
            half_sum: ((mu + kappa) / 2.0).sin_cos(),
        })
    }

    /// The spindle axis, turned about the second axis.
    pub(super) fn tilted(&self, second: &Turn) -> Vector {
        let (sin, cos) = second.sin_cos;
        self.along + self.across * cos + self.third * sin
    }

    /// Smallest and largest angle between the first axis and the directions that can be made, radians.
    pub(super) fn reach(&self) -> [f64; 2] {
        let difference = 2.0 * self.half_difference.0.atan2(self.half_difference.1);
        let sum = 2.0 * self.half_sum.0.atan2(self.half_sum.1);
        [difference.abs(), sum.min(2.0 * PI - sum)]
    }

    /// Angle between the tool axis and the pole, that is the first axis or its opposite, radians.
    pub(super) fn pole_distance(&self, axis: &Direction) -> f64 {
        let (near, far) = ((self.first - axis.into_inner()).norm(), (self.first + axis.into_inner()).norm());
        2.0 * (near.min(far) / 2.0).min(1.0).asin()
    }

    /// Whether the tool axis lies within a small angle, radians, of the pole: chord and angle are then the same.
    pub(super) fn near_pole(&self, axis: &Direction, angle: f64) -> bool {
        let d = axis.into_inner();
        (self.first - d).norm_squared().min((self.first + d).norm_squared()) < angle * angle
    }

    /// The turns for a direction; or by how much, in radians, it misses what the axes can make.
    pub(super) fn solve(&self, axis: &Direction) -> Result<Orientations, f64> {
        let d = axis.into_inner();
        // Half chords: sine and cosine of alpha/2, exact near both poles.
        let (sin, cos) = ((self.first - d).norm() / 2.0, (self.first + d).norm() / 2.0);
        let (ds, dc) = self.half_difference;
        let (ss, sc) = self.half_sum;
        let over = [sin * dc + cos * ds, sin * dc - cos * ds];
        let under = [ss * cos + sc * sin, ss * cos - sc * sin];
        let short = over[0].min(over[1]).min(under[0]).min(under[1]);
        if short < -ROUNDING / 2.0 {
            return Err(-2.0 * short.max(-1.0).asin());
        }
        let rise = (over[0] * over[1]).max(0.0).sqrt();
        let run = (under[0] * under[1]).max(0.0).sqrt();
        let psi = Turn { angle: 2.0 * rise.atan2(run), sin_cos: double(rise, run) };
        let free = sin < POLE / 2.0 || cos < POLE / 2.0;
        let branch = |psi: Turn| {
            let second = sum(&self.nearest, &psi);
            let tool = self.tilted(&second);
            let first = if free { Turn::by(0.0) } else { self.turn_onto(&tool, &d) };
            [first, second]
        };
        Ok(Orientations { branches: [branch(psi), branch(psi.back())], free })
    }

    /// Turn about the first axis from `from` to `to`; from components across the axis, which stay exact near it.
    fn turn_onto(&self, from: &Vector, to: &Vector) -> Turn {
        let (from, to) = (self.first.cross(from), self.first.cross(to));
        let (y, x) = (self.first.dot(&from.cross(&to)), from.dot(&to));
        let length = (x * x + y * y).sqrt();
        if length > 0.0 { Turn { angle: y.atan2(x), sin_cos: (y / length, x / length) } } else { Turn::by(0.0) }
    }
}

/// Sine and cosine of twice the angle whose tangent is `rise / run`.
fn double(rise: f64, run: f64) -> (f64, f64) {
    let square = rise * rise + run * run;
    (2.0 * rise * run / square, (run * run - rise * rise) / square)
}

/// One turn after another about the same axis, within half a turn of zero.
fn sum(a: &Turn, b: &Turn) -> Turn {
    let ((sa, ca), (sb, cb)) = (a.sin_cos, b.sin_cos);
    Turn { angle: wrap(a.angle + b.angle), sin_cos: (sa * cb + ca * sb, ca * cb - sa * sb) }
}

/// The same angle within half a turn of zero, radians.
fn wrap(angle: f64) -> f64 {
    if angle > PI {
        angle - 2.0 * PI
    } else if angle < -PI {
        angle + 2.0 * PI
    } else {
        angle
    }
}

fn angle(a: &Vector, b: &Vector) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}
