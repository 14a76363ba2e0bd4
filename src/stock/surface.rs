//! The surface of the stock as a closed triangle mesh. Uses `geometry` and the other files of this module.
//!
//! Dual contouring (Ju, Losasso, Schaefer and Warren, Dual contouring of Hermite data, 2002): the ends of material on the
//! lines, with their normals, are points of the surface; each cell of the lattice that the surface passes gets the point
//! that fits their tangent planes best, so that edges stay sharp. Material that touches along an edge or in a corner of
//! the lattice alone is taken away first: then each edge of the mesh has two triangles.

use super::dexel::{Dexel, Normal};
use super::grid::{Grid, Lattice};
use crate::geometry::{Point, Vector};
use nalgebra::Matrix3;

/// Nodes that the lattice of a mesh may have; a finer one is thinned out.
const MOST_NODES: f64 = 1.5e8;
/// Pull of a cell's point to the mean of its data: it decides where planes leave a direction open.
const PULL: f64 = 1e-3;
/// Points keep this distance from the sides of their cells, cells.
const MARGIN: f64 = 0.02;

/// Nodes inside and outside of the material, with one layer of outside around them.
struct Nodes<'a> {
    lattice: &'a Lattice,
    grids: &'a [Grid; 3],
    /// Every so many lines count.
    stride: usize,
    counts: [usize; 3],
    inside: Vec<bool>,
}

/// The triangles of the surface of a stock, corners anticlockwise seen from outside, mm.
pub(super) fn triangles(lattice: &Lattice, grids: &[Grid; 3]) -> Vec<[Point; 3]> {
    let mut nodes = Nodes::new(lattice, grids);
    nodes.part_at_corners();
    let cells = nodes.cells();
    let points: Vec<Point> = cells.iter().map(|cell| nodes.point(*cell)).collect();
    let of_cell = |cell: usize| cells.binary_search(&cell).ok().and_then(|index| points.get(index)).copied();
    nodes
        .crossed_edges()
        .flat_map(|(node, axis, outward)| {
            let (first, second) = (nodes.step((axis + 1) % 3), nodes.step((axis + 2) % 3));
            // The four cells around the edge, anticlockwise seen from its far end.
            let around = [node - first - second, node - second, node, node - first].map(of_cell);
            let [Some(a), Some(b), Some(c), Some(d)] = around else { return Vec::new() };
            let [a, b, c, d] = if outward { [a, b, c, d] } else { [d, c, b, a] };
            if (c - a).norm_squared() <= (d - b).norm_squared() {
                vec![[a, b, c], [a, c, d]]
            } else {
                vec![[a, b, d], [b, c, d]]
            }
        })
        .collect()
}

impl<'a> Nodes<'a> {
    fn new(lattice: &'a Lattice, grids: &'a [Grid; 3]) -> Self {
        let all = lattice.counts.iter().map(|n| *n as f64).product::<f64>();
        let stride = (all / MOST_NODES).cbrt().ceil().max(1.0) as usize;
        let counts = lattice.counts.map(|n| n.div_ceil(stride) + 2);
        let mut nodes = Self { lattice, grids, stride, counts, inside: vec![false; counts.iter().product()] };
        for j in 1..counts[1] - 1 {
            for i in 1..counts[0] - 1 {
                for run in nodes.dexel(2, [i, j, 1]).runs() {
                    let cell = stride as f64 * lattice.cell;
                    let index = |z: f64| (z - lattice.origin.z) / cell + 1.0;
                    let last = (counts[2] - 1) as f64;
                    let (low, high) = (index(run.low).ceil().max(1.0), index(run.high).floor().min(last - 1.0));
                    for k in low as usize..(high + 1.0) as usize {
                        let node = nodes.index([i, j, k]);
                        nodes.inside[node] = true;
                    }
                }
            }
        }
        nodes
    }

    fn step(&self, axis: usize) -> usize {
        self.counts[..axis].iter().product()
    }

    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.counts[0] * (j + self.counts[1] * k)
    }

    fn place(&self, index: usize) -> [usize; 3] {
        let [x, y, _] = self.counts;
        [index % x, index / x % y, index / (x * y)]
    }

    /// The line along an axis through a node inside the outer layer.
    fn dexel(&self, axis: usize, node: [usize; 3]) -> &'a Dexel {
        let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
        let at = |axis: usize| (node[axis] - 1) * self.stride;
        let grid = &self.grids[axis];
        &grid.dexels[at(second) * grid.columns + at(first)]
    }

    /// First nodes of all cells.
    fn all_cells(&self) -> impl Iterator<Item = usize> {
        let [x, y, z] = self.counts;
        (0..z - 1).flat_map(move |k| (0..y - 1).flat_map(move |j| (0..x - 1).map(move |i| i + x * (j + y * k))))
    }

    /// Takes away nodes until no two that are inside, or outside, touch along an edge or in a corner alone.
    fn part_at_corners(&mut self) {
        let steps = [0, 1, 2].map(|axis| self.step(axis));
        loop {
            let mut taken = false;
            for cell in self.all_cells().collect::<Vec<_>>() {
                let corners: [usize; 8] =
                    std::array::from_fn(|c| (0..3).map(|k| (c >> k & 1) * steps[k]).sum::<usize>() + cell);
                let count = corners.iter().filter(|c| self.inside[**c]).count();
                if count == 0 || count == 8 {
                    continue;
                }
                for face in 0..6 {
                    let (axis, side) = (face / 2, face % 2);
                    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
                    let base = side << axis;
                    let [a, b, c, d] = [base, base + u, base + u + v, base + v].map(|c| corners[c]);
                    let [ia, ib, ic, id] = [a, b, c, d].map(|n| self.inside[n]);
                    if ia == ic && ib == id && ia != ib {
                        self.inside[if ia { a } else { b }] = false;
                        taken = true;
                    }
                }
                for c in 0..4 {
                    let (p, q) = (corners[c], corners[7 - c]);
                    let count = corners.iter().filter(|c| self.inside[**c]).count();
                    if self.inside[p] && self.inside[q] && count == 2 {
                        self.inside[p] = false;
                        taken = true;
                    } else if !self.inside[p] && !self.inside[q] && count == 6 {
                        self.inside[corners[c ^ 1]] = false;
                        taken = true;
                    }
                }
            }
            if !taken {
                return;
            }
        }
    }

    /// Cells that the surface passes, in order.
    fn cells(&self) -> Vec<usize> {
        let steps = [0, 1, 2].map(|axis| self.step(axis));
        let mixed = |cell: &usize| {
            let mut corners = (0..8).map(|c: usize| (0..3).map(|k| (c >> k & 1) * steps[k]).sum::<usize>() + cell);
            let first = self.inside[*cell];
            corners.any(|corner| self.inside[corner] != first)
        };
        self.all_cells().filter(mixed).collect()
    }

    /// Edges from a node to the next one along an axis between inside and outside, and whether outward.
    fn crossed_edges(&self) -> impl Iterator<Item = (usize, usize, bool)> {
        let steps = [0, 1, 2].map(|axis| self.step(axis));
        self.all_cells().flat_map(move |node| {
            (0..3).filter_map(move |axis| {
                let (here, there) = (self.inside[node], self.inside[node + steps[axis]]);
                (here != there).then_some((node, axis, here))
            })
        })
    }

    fn coordinate(&self, axis: usize, node: usize) -> f64 {
        self.lattice.origin[axis] + (node as f64 - 1.0) * self.stride as f64 * self.lattice.cell
    }

    /// Point and normal of the surface on an edge between inside and outside.
    fn crossing(&self, node: usize, axis: usize) -> (Vector, Vector) {
        let at = self.place(node);
        let mut point = Vector::from_fn(|k, _| self.coordinate(k, at[k]));
        let (low, high) = (point[axis], self.coordinate(axis, at[axis] + 1));
        let outward = self.inside[node];
        let slack = 1e-9 * self.lattice.cell;
        let ends = self
            .dexel(axis, at)
            .runs()
            .map(|run| if outward { (run.high, run.normals[1]) } else { (run.low, run.normals[0]) });
        let found = ends.into_iter().find(|(place, _)| (low - slack..=high + slack).contains(place));
        // Where a node was taken away the surface passes half way.
        let (place, normal) = found.map_or_else(
            || (0.5 * (low + high), Vector::ith(axis, if outward { 1.0 } else { -1.0 })),
            |(place, normal): (f64, Normal)| (place, normal.vector()),
        );
        point[axis] = place;
        (point, normal)
    }

    /// The point of a cell: nearest to the planes of its crossings.
    fn point(&self, cell: usize) -> Point {
        let steps = [0, 1, 2].map(|axis| self.step(axis));
        let mut data: Vec<(Vector, Vector)> = Vec::with_capacity(12);
        for axis in 0..3 {
            for corner in (0..8_usize).filter(|corner| corner >> axis & 1 == 0) {
                let node = (0..3).map(|k| (corner >> k & 1) * steps[k]).sum::<usize>() + cell;
                if self.inside[node] != self.inside[node + steps[axis]] {
                    data.push(self.crossing(node, axis));
                }
            }
        }
        let mean = data.iter().map(|(p, _)| p).sum::<Vector>() / data.len().max(1) as f64;
        let (mut square, mut right) = (Matrix3::identity() * PULL, Vector::zeros());
        for (p, n) in &data {
            square += n * n.transpose();
            right += n * n.dot(&(p - mean));
        }
        let free = mean + square.cholesky().map_or(Vector::zeros(), |c| c.solve(&right));
        let at = self.place(cell);
        let inside = Vector::from_fn(|k, _| {
            let (low, high) = (self.coordinate(k, at[k]), self.coordinate(k, at[k] + 1));
            let margin = MARGIN * (high - low);
            free[k].clamp(low + margin, high - margin)
        });
        Point::from(inside)
    }
}
