//! The unknowns of one strip: the control points of two cubic rails with the same knots, one behind the other along the
//! path, so that everything at one instant depends on four neighbouring blocks.

use crate::geometry::knots::Knots;
use crate::geometry::{Point, SplineCurve, Vector};
use crate::motion::RuledMotion;

/// Unknowns per control point index: three of the lower rail, three of the upper.
pub(super) const BLOCK: usize = 6;
/// Length of the run of unknowns on which the pose at one instant depends.
pub(super) const RUN: usize = 4 * BLOCK;

/// Knots of both rails, and the height on the tool's axis that rides on the lower one.
#[derive(Clone, Debug)]
pub(super) struct Rails {
    knots: Knots,
    /// Height above the tip of the axis point on the lower rail, mm.
    pub(super) lower_height: f64,
}

impl Rails {
    /// Rails of `controls` control points each.
    pub(super) fn new(controls: usize, lower_height: f64) -> Option<Self> {
        Some(Self { knots: Knots::clamped_uniform(3, controls).ok()?, lower_height })
    }

    /// Rails and unknowns of a motion.
    pub(super) fn of(motion: &RuledMotion) -> (Self, Vec<f64>) {
        let pairs = motion.lower.control().iter().zip(motion.upper.control());
        let x = pairs.flat_map(|(a, b)| [a.x, a.y, a.z, b.x, b.y, b.z]).collect();
        (Self { knots: motion.lower.knots().clone(), lower_height: motion.lower_height }, x)
    }

    /// Control points a rail.
    pub(super) fn controls(&self) -> usize {
        self.knots.controls()
    }

    /// Length of the vector of unknowns.
    pub(super) fn unknowns(&self) -> usize {
        self.controls() * BLOCK
    }

    /// The motion that unknowns stand for.
    pub(super) fn motion(&self, x: &[f64]) -> Option<RuledMotion> {
        let rail = |offset: usize| {
            let control = x.chunks(BLOCK).map(|c| Point::new(c[offset], c[offset + 1], c[offset + 2])).collect();
            SplineCurve::from_knots(self.knots.clone(), control).ok()
        };
        Some(RuledMotion { lower: rail(0)?, upper: rail(3)?, lower_height: self.lower_height })
    }

    /// Lower and upper rail points at `t`.
    pub(super) fn points(&self, x: &[f64], t: f64) -> (Point, Point) {
        let basis = self.knots.basis(t);
        let mut sums = [0.0; BLOCK];
        for i in 0..4 {
            for (c, sum) in sums.iter_mut().enumerate() {
                *sum += basis.ders[0][i] * x[(basis.first + i) * BLOCK + c];
            }
        }
        (Point::new(sums[0], sums[1], sums[2]), Point::new(sums[3], sums[4], sums[5]))
    }

    /// Gradient with respect to the unknowns of something that depends on the rail points at `t`, given its gradients
    /// with respect to those: where the run starts, and the run.
    pub(super) fn gradient(&self, t: f64, lower: &Vector, upper: &Vector) -> (usize, [f64; RUN]) {
        let basis = self.knots.basis(t);
        let mut run = [0.0; RUN];
        for i in 0..4 {
            let b = basis.ders[0][i];
            for c in 0..3 {
                run[i * BLOCK + c] = b * lower[c];
                run[i * BLOCK + 3 + c] = b * upper[c];
            }
        }
        (basis.first * BLOCK, run)
    }

    /// The same of something that depends on the velocities of the rail points as well, given by what it changes with
    /// them.
    pub(super) fn rate_gradient(
        &self,
        t: f64,
        (lower, upper): (&Vector, &Vector),
        (lower_rate, upper_rate): (&Vector, &Vector),
    ) -> (usize, [f64; RUN]) {
        let basis = self.knots.basis(t);
        let (first, mut run) = self.gradient(t, lower, upper);
        for i in 0..4 {
            let b = basis.ders[1][i];
            for c in 0..3 {
                run[i * BLOCK + c] += b * lower_rate[c];
                run[i * BLOCK + 3 + c] += b * upper_rate[c];
            }
        }
        (first, run)
    }

    /// Unknowns `i` of three neighbouring blocks, for second differences: (first of three, its value under `x`).
    pub(super) fn second_differences<'x>(&self, x: &'x [f64]) -> impl Iterator<Item = (usize, f64)> + use<'x> {
        (0..x.len().saturating_sub(2 * BLOCK)).map(|i| (i, x[i] - 2.0 * x[i + BLOCK] + x[i + 2 * BLOCK]))
    }
}

/// Coefficients of a second difference on unknowns `i`, `i + BLOCK`, `i + 2 BLOCK`.
pub(super) const SECOND_DIFFERENCE: [f64; 3] = [1.0, -2.0, 1.0];
