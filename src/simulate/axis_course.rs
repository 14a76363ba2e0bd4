//! Segments as ways of the axes, for whatever follows the bodies of a machine. Uses `geometry` and `machine`.

use super::segment::{Path, Segment};
use super::tool_motion::ToolMotion;
use crate::geometry::Vector;
use crate::machine::{AxisCourse, AxisPosition, AxisRates, LinearRates, Setup};

/// How far what moves may be from the way that a control takes with vector interpolation, mm at the rotary axes' lever.
const LEAVE: f64 = 1e-3;
/// Distance from the pivots at which that is measured, mm.
const LEVER: f64 = 500.0;
/// Pieces that such a way is followed in at most.
const MOST_PIECES: usize = 256;

/// A stretch of a segment in which the rotary axes turn evenly.
#[derive(Clone, Copy, Debug)]
pub struct SegmentCourse<'a> {
    setup: &'a Setup,
    segment: Segment,
    /// Shares of the program's segment at its ends.
    pub shares: [f64; 2],
}

impl SegmentCourse<'_> {
    /// The share of the program's segment at a share of the stretch.
    pub fn share(&self, share: f64) -> f64 {
        self.shares[0] + (self.shares[1] - self.shares[0]) * share
    }
}

impl AxisCourse for SegmentCourse<'_> {
    fn axes(&self, share: f64) -> AxisPosition {
        self.segment.axes(self.setup, share)
    }

    fn rates(&self) -> AxisRates {
        let Segment { from, to, path, .. } = &self.segment;
        let rotary = std::array::from_fn(|k| to.rotary[k] - from.rotary[k]);
        let axes = self.setup.machine().linear.iter();
        let linear = match path {
            Path::Joints => {
                let ways = axes.zip(from.linear.iter().zip(to.linear));
                let way = ways
                    .fold(Vector::zeros(), |sum, (axis, (from, to))| sum + axis.direction.into_inner() * (to - from));
                LinearRates::Axes { speed: way.norm(), acceleration: 0.0 }
            }
            Path::JointArc(arc) => {
                // Directions that are not square may lengthen a way, by less than the root of their number.
                let longer = 3.0_f64.sqrt();
                let (speed, acceleration) = arc.derivative_bounds();
                LinearRates::Axes { speed: longer * speed, acceleration: longer * acceleration }
            }
            Path::Tip { from, to } => LinearRates::Tip { speed: (to - from).norm(), acceleration: 0.0 },
            Path::TipArc(arc) => {
                let (speed, acceleration) = arc.derivative_bounds();
                LinearRates::Tip { speed, acceleration }
            }
            Path::Vector { from, to } => LinearRates::Tip { speed: (to.tip - from.tip).norm(), acceleration: 0.0 },
        };
        AxisRates { rotary, linear }
    }
}

impl ToolMotion {
    /// A segment as ways of the axes with even turns, one after the other. With vector interpolation, where the rotary
    /// axes follow from the tool axis, the way is cut so fine that they leave even turns by less than a micrometre at half
    /// a metre from the pivots, as measured between the cuts.
    pub fn courses(&self, segment: &Segment) -> Vec<SegmentCourse<'_>> {
        let setup = self.setup();
        let Path::Vector { .. } = segment.path else {
            return vec![SegmentCourse { setup, segment: *segment, shares: [0.0, 1.0] }];
        };
        let mut pieces = 1;
        while pieces < MOST_PIECES && self.leaves_even_turns(segment, pieces) > LEAVE / LEVER {
            pieces *= 2;
        }
        let share = |k: usize| k as f64 / pieces as f64;
        let piece = |k: usize| {
            let shares = [share(k), share(k + 1)];
            let [from, to] = shares.map(|share| self.axes(segment, share));
            let [start, end] = shares.map(|share| self.pose(segment, share).tip);
            let path = Path::Tip { from: start, to: end };
            SegmentCourse { setup, segment: Segment { from, to, path, ..*segment }, shares }
        };
        (0..pieces).map(piece).collect()
    }

    /// Largest angle, radians, by which a rotary axis is off the mean of both ends half way through a piece.
    fn leaves_even_turns(&self, segment: &Segment, pieces: usize) -> f64 {
        let rotary = |k: usize| self.axes(segment, k as f64 / (2 * pieces) as f64).rotary;
        let off = |k: usize| {
            let (from, half, to) = (rotary(2 * k), rotary(2 * k + 1), rotary(2 * k + 2));
            (0..2).map(|axis| (half[axis] - 0.5 * (from[axis] + to[axis])).abs()).fold(0.0, f64::max)
        };
        (0..pieces).map(off).fold(0.0, f64::max)
    }
}
