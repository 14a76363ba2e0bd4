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

/// A tool axis direction that the rotary axes cannot make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unreachable {
    /// Letter of the rotary axis that would have to reach further.
    pub axis: char,
    /// By how much the direction misses the reachable zone, radians.
    pub by: f64,
}

/// Both pairs of angles for one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientations {
    /// `[first, second]` in chain order, radians, within half a turn of zero; one pair a branch.
    pub angles: [[f64; 2]; 2],
    /// The first angle may be anything; it is given as zero.
    pub free: bool,
}

/// Two rotary axes in the order of the chain from part to tool, with what does not change from pose to pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotaries {
    first: Vector,
    second: Vector,
    /// Components of the spindle axis: along the second axis, across it, and the third direction.
    along: Vector,
    across: Vector,
    third: Vector,
    /// Angle of the second axis at which the tool comes nearest to the first axis.
    nearest: f64,
    /// Sine and cosine of (mu - kappa)/2 and (mu + kappa)/2.
    half_difference: (f64, f64),
    half_sum: (f64, f64),
}

impl Rotaries {
    /// Refuses directions with which no two angles of freedom remain.
    pub fn new(first: Direction, second: Direction, spindle: Direction) -> Result<Self, &'static str> {
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
            second: e2,
            along,
            across,
            third,
            nearest: e1.dot(&third).atan2(e1.dot(&across)),
            half_difference: ((mu - kappa) / 2.0).sin_cos(),
            half_sum: ((mu + kappa) / 2.0).sin_cos(),
        })
    }

    /// Smallest and largest angle between the first axis and the directions that can be made, radians.
    pub fn reach(&self) -> [f64; 2] {
        let difference = 2.0 * self.half_difference.0.atan2(self.half_difference.1);
        let sum = 2.0 * self.half_sum.0.atan2(self.half_sum.1);
        [difference.abs(), sum.min(2.0 * PI - sum)]
    }

    /// Angle between the tool axis and the pole, that is the first axis or its opposite, radians.
    pub fn pole_distance(&self, axis: &Direction) -> f64 {
        let (near, far) = ((self.first - axis.into_inner()).norm(), (self.first + axis.into_inner()).norm());
        2.0 * (near.min(far) / 2.0).min(1.0).asin()
    }

    /// The angles for a direction.
    pub fn solve(&self, axis: &Direction) -> Result<Orientations, Unreachable> {
        let d = axis.into_inner();
        // Half chords: sine and cosine of alpha/2, exact near both poles.
        let (sin, cos) = ((self.first - d).norm() / 2.0, (self.first + d).norm() / 2.0);
        let (ds, dc) = self.half_difference;
        let (ss, sc) = self.half_sum;
        let over = [sin * dc + cos * ds, sin * dc - cos * ds];
        let under = [ss * cos + sc * sin, ss * cos - sc * sin];
        let short = over[0].min(over[1]).min(under[0]).min(under[1]);
        if short < -ROUNDING / 2.0 {
            return Err(Unreachable { axis: ' ', by: -2.0 * short.max(-1.0).asin() });
        }
        let rise = (over[0] * over[1]).max(0.0).sqrt();
        let run = (under[0] * under[1]).max(0.0).sqrt();
        let psi = 2.0 * rise.atan2(run);
        let free = sin < POLE / 2.0 || cos < POLE / 2.0;
        let branch = |second: f64| {
            let (s, c) = second.sin_cos();
            let tool = self.along + self.across * c + self.third * s;
            let first = if free { 0.0 } else { self.turn_onto(&tool, &d) };
            [first, wrap(second)]
        };
        Ok(Orientations { angles: [branch(self.nearest + psi), branch(self.nearest - psi)], free })
    }

    /// Angle about the first axis from `from` to `to`; from components across the axis, which stay exact near it.
    fn turn_onto(&self, from: &Vector, to: &Vector) -> f64 {
        let (from, to) = (self.first.cross(from), self.first.cross(to));
        self.first.dot(&from.cross(&to)).atan2(from.dot(&to))
    }

    /// Directions of the axes in the order of the chain.
    pub fn directions(&self) -> [Vector; 2] {
        [self.first, self.second]
    }
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
