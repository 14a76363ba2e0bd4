//! Lattice and lines: for each direction of the part frame one grid of lines, all through the nodes of one lattice. Uses
//! `geometry`.

use super::dexel::{Dexel, Run};
use crate::geometry::{Aabb, Point, Vector};
use rayon::prelude::*;
use std::ops::Range;

/// Nodes along the axes of the part frame. The stock's box ends half a cell outside the outer nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    /// The first node, mm.
    pub(super) origin: Vector,
    /// Distance of neighbours, mm.
    pub(super) cell: f64,
    pub(super) counts: [usize; 3],
}

impl Lattice {
    pub(super) fn over(bounds: &Aabb, cell: f64) -> Self {
        let size = bounds.high - bounds.low;
        let counts = [0, 1, 2].map(|k| (size[k] / cell).round().max(1.0) as usize);
        // In the middle, so that both ends of a side are alike.
        let middle = bounds.centre().coords;
        let origin = Vector::from_fn(|k, _| middle[k] - 0.5 * cell * (counts[k] as f64 - 1.0));
        Self { origin, cell, counts }
    }

    /// Coordinate of a node.
    pub(super) fn place(&self, axis: usize, index: usize) -> f64 {
        self.origin[axis] + self.cell * index as f64
    }

    /// The nodes between two coordinates.
    pub(super) fn covering(&self, axis: usize, low: f64, high: f64) -> Range<usize> {
        let last = self.counts[axis] as f64;
        let index = |x: f64| ((x - self.origin[axis]) / self.cell).clamp(-1.0, last);
        let (first, end) = (index(low).ceil().max(0.0), (index(high).floor() + 1.0).max(0.0));
        first as usize..end.min(last) as usize
    }

    /// Lines of all three directions.
    pub(super) fn lines(&self) -> usize {
        let [x, y, z] = self.counts;
        x * y + y * z + z * x
    }
}

/// The lines along one coordinate, row by row: columns run along the next coordinate, rows along the one after it.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub(super) along: usize,
    pub(super) columns: usize,
    pub(super) dexels: Vec<Dexel>,
}

impl Grid {
    /// Fills every line with what `runs` gives for its foot, the point whose coordinate along the line is 0.
    pub(super) fn filled(lattice: &Lattice, along: usize, runs: impl Fn(Vector) -> Vec<Run> + Sync) -> Self {
        let (first, second) = ((along + 1) % 3, (along + 2) % 3);
        let [columns, rows] = [lattice.counts[first], lattice.counts[second]];
        let dexel = |index: usize| {
            let mut foot = Vector::zeros();
            foot[first] = lattice.place(first, index % columns);
            foot[second] = lattice.place(second, index / columns);
            Dexel::of(runs(foot))
        };
        Self { along, columns, dexels: (0..columns * rows).into_par_iter().map(dexel).collect() }
    }

    /// Length of all material, mm; in the order of the lines, so that it is the same every time.
    pub(super) fn length(&self) -> f64 {
        self.dexels.iter().map(Dexel::length).sum()
    }
}

impl Grid {
    /// Every end of material: its place and the outward normal there.
    pub(super) fn ends<'a>(&'a self, lattice: &'a Lattice) -> impl Iterator<Item = (Point, Vector)> + 'a {
        let (first, second) = ((self.along + 1) % 3, (self.along + 2) % 3);
        self.dexels.iter().enumerate().flat_map(move |(index, dexel)| {
            let mut foot = Point::origin();
            foot[first] = lattice.place(first, index % self.columns);
            foot[second] = lattice.place(second, index / self.columns);
            dexel.runs().flat_map(move |run| [(run.low, run.normals[0]), (run.high, run.normals[1])]).map(
                move |(place, normal)| {
                    let mut point = foot;
                    point[self.along] = place;
                    (point, normal.vector())
                },
            )
        })
    }
}
