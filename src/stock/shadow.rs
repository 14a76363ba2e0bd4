//! Which lines of a grid a moving solid can meet, and where along them. Uses `geometry`.

use super::grid::Lattice;
use super::moves::Stretch;
use super::solid::Solid;
use crate::geometry::Vector;
use std::f64::consts::PI;
use std::ops::Range;

/// Directions across the lines in which the shadow is bounded.
const DIRECTIONS: usize = 8;

/// Bounds of a solid's sweep, seen along each coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shadow {
    /// Seen along the lines: in the plane of the next coordinate (columns) and the one after it (rows).
    across: Outline,
    /// Seen along the rows and along the columns: the other coordinate, and that along the lines.
    beside: [Outline; 2],
    axes: [usize; 2],
}

/// Bounds in several directions of a plane: cosine and sine, least and most.
type Outline = [([f64; 2], f64, f64); DIRECTIONS];

fn outline(solid: &Solid, stretch: &Stretch, [first, second]: [usize; 2]) -> Outline {
    std::array::from_fn(|k| {
        let (sin, cos) = (PI * k as f64 / DIRECTIONS as f64).sin_cos();
        let mut w = Vector::zeros();
        (w[first], w[second]) = (cos, sin);
        let (low, high) = bounds(solid, stretch, &w);
        ([cos, sin], low, high)
    })
}

/// The interval of one coordinate that an outline leaves where the other has a value; empty where low exceeds high.
fn cut_of(outline: &Outline, value: f64, wanted: usize) -> (f64, f64) {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for (direction, least, most) in outline {
        let (wanted, other) = (direction[wanted], direction[1 - wanted]);
        let (a, b) = (least - other * value, most - other * value);
        if wanted.abs() > 1e-9 {
            let (p, q) = (a / wanted, b / wanted);
            low = low.max(p.min(q));
            high = high.min(p.max(q));
        } else if a > 0.0 || b < 0.0 {
            return (f64::INFINITY, f64::NEG_INFINITY);
        }
    }
    (low, high)
}

impl Shadow {
    pub(super) fn new(solid: &Solid, stretch: &Stretch, along: usize) -> Self {
        let axes = [(along + 1) % 3, (along + 2) % 3];
        let beside = axes.map(|axis| outline(solid, stretch, [axis, along]));
        Self { across: outline(solid, stretch, axes), beside, axes }
    }

    /// The columns of a row that can be met.
    pub(super) fn columns(&self, lattice: &Lattice, row: f64) -> Range<usize> {
        let (low, high) = cut_of(&self.across, row, 0);
        if low > high { 0..0 } else { lattice.covering(self.axes[0], low, high) }
    }

    /// The rows that can be met.
    pub(super) fn rows(&self, lattice: &Lattice) -> Range<usize> {
        let (_, low, high) = self.across[DIRECTIONS / 2];
        lattice.covering(self.axes[1], low, high)
    }

    /// What can be met along the lines of a column, or of a row, at a coordinate.
    pub(super) fn along_column(&self, place: f64) -> (f64, f64) {
        cut_of(&self.beside[0], place, 1)
    }

    pub(super) fn along_row(&self, place: f64) -> (f64, f64) {
        cut_of(&self.beside[1], place, 1)
    }
}

/// Bounds of w.x over the sweep: points of the axis move along chords, so their ends bound them; a disc of radius R about
/// d reaches R sqrt(1 - (w.d)^2), which a turn changes by less than R times the turn.
pub(super) fn bounds(solid: &Solid, stretch: &Stretch, w: &Vector) -> (f64, f64) {
    let turn = (stretch.to.axis.into_inner() - stretch.from.axis.into_inner()).norm();
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for pose in [&stretch.from, &stretch.to] {
        let along = w.dot(&pose.axis);
        let margin = solid.radius * ((1.0 - along * along).max(0.0).sqrt() + turn);
        let tip = w.dot(&pose.tip.coords);
        for height in [solid.low, solid.high] {
            low = low.min(tip + along * height - margin);
            high = high.max(tip + along * height + margin);
        }
    }
    (low, high)
}
