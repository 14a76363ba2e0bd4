//! The material before the first cut: box, cylinder or closed mesh, laid on lines. Uses `geometry`.

use super::dexel::{Dexel, Normal, Run};
use super::grid::{Grid, Lattice};
use crate::geometry::{Aabb, Direction, Point, TriangleMesh, Vector};
use rayon::prelude::*;

/// Material before the first cut, part frame, mm.
#[derive(Clone, Debug)]
pub enum Blank {
    /// A box along the axes of the part frame.
    Box {
        /// Least coordinates.
        min: Point,
        /// Greatest coordinates.
        max: Point,
    },
    /// A round bar.
    Cylinder {
        /// Centre of its base.
        base: Point,
        /// From base to top.
        axis: Direction,
        /// Radius.
        radius: f64,
        /// From base to top.
        height: f64,
    },
    /// A closed mesh, normals outward.
    Mesh(Box<TriangleMesh>),
}

impl Blank {
    /// Smallest box around it along the axes of the part frame.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Box { min, max } => Aabb { low: *min, high: *max },
            Self::Cylinder { base, axis, radius, height } => {
                let margin = axis.map(|c| radius * (1.0 - c * c).max(0.0).sqrt());
                let top = base + axis.into_inner() * *height;
                Aabb { low: base.inf(&top) - margin, high: base.sup(&top) + margin }
            }
            Self::Mesh(mesh) => mesh.bounds(),
        }
    }

    /// The lines of one direction.
    pub(super) fn grid(&self, lattice: &Lattice, along: usize) -> Grid {
        match self {
            Self::Mesh(mesh) => mesh_grid(mesh, lattice, along),
            Self::Box { min, max } => {
                let outward = |sign: f64| Normal::new(&(Vector::ith(along, sign)));
                let run = Run { low: min[along], high: max[along], normals: [outward(-1.0), outward(1.0)] };
                Grid::filled(lattice, along, |_| vec![run])
            }
            Self::Cylinder { base, axis, radius, height } => Grid::filled(lattice, along, |foot| {
                let bar = Bar { axis: axis.into_inner(), radius: *radius, height: *height };
                bar.run(foot - base.coords, along).into_iter().collect()
            }),
        }
    }
}

struct Bar {
    axis: Vector,
    radius: f64,
    height: f64,
}

impl Bar {
    /// The line through `o`, from the centre of the base, in the bar; places count from the line's own zero.
    fn run(&self, o: Vector, along: usize) -> Option<Run> {
        let (du, height) = (self.axis[along], self.axis.dot(&o));
        let (a, b) = (1.0 - du * du, o[along] - height * du);
        let c = o.norm_squared() - height * height - self.radius * self.radius;
        let mut ends = [(f64::NEG_INFINITY, Vector::zeros()), (f64::INFINITY, Vector::zeros())];
        if a > 1e-12 {
            let square = b * b - a * c;
            if square <= 0.0 {
                return None;
            }
            let at = |s: f64| {
                let x = o + Vector::ith(along, s);
                (s, (x - self.axis * self.axis.dot(&x)) / self.radius)
            };
            ends = [at((-b - square.sqrt()) / a), at((-b + square.sqrt()) / a)];
        } else if c > 0.0 {
            return None;
        }
        if du.abs() > 1e-12 {
            let mut discs = [(-height / du, -self.axis), ((self.height - height) / du, self.axis)];
            discs.sort_by(|p, q| p.0.total_cmp(&q.0));
            if discs[0].0 > ends[0].0 {
                ends[0] = discs[0];
            }
            if discs[1].0 < ends[1].0 {
                ends[1] = discs[1];
            }
        } else if height < 0.0 || height > self.height {
            return None;
        }
        let [(low, below), (high, above)] = ends;
        // Places count from the foot on the plane through zero, as all lines of a grid do.
        (low < high).then(|| Run { low, high, normals: [Normal::new(&below), Normal::new(&above)] })
    }
}

/// A crossing of a line with a triangle: place, winding (1 out of the material, -1 into it), normal.
type Crossing = (f64, i32, Normal);

/// Every triangle marks the lines that pass it; a line is in the material where the windings say so. Borders of triangles
/// belong to one of both neighbours by the rule of rasterizers (an edge belongs to the triangle on its upper side), so no
/// line slips through a seam or counts it twice.
fn mesh_grid(mesh: &TriangleMesh, lattice: &Lattice, along: usize) -> Grid {
    let (first, second) = ((along + 1) % 3, (along + 2) % 3);
    let [columns, rows] = [lattice.counts[first], lattice.counts[second]];
    let mut crossings: Vec<Vec<Crossing>> = vec![Vec::new(); columns * rows];
    for face in 0..mesh.triangles().len() {
        let corners = mesh.corners(face);
        let flat = corners.map(|p| [p[first], p[second]]);
        let area = cross(flat[0], flat[1], flat[2]);
        if area == 0.0 {
            continue;
        }
        let normal = mesh.face_normals()[face];
        let (winding, packed) = (if area > 0.0 { 1 } else { -1 }, Normal::new(&normal));
        let range = |axis: usize, k: usize| {
            let values = flat.map(|p| p[k]);
            let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (v.min(l), v.max(h)));
            lattice.covering(axis, low, high)
        };
        for row in range(second, 1) {
            for column in range(first, 0) {
                let p = [lattice.place(first, column), lattice.place(second, row)];
                if holds(&flat, p, area > 0.0) {
                    let (u, v) = (p[0] - corners[0][first], p[1] - corners[0][second]);
                    let place = corners[0][along] - (normal[first] * u + normal[second] * v) / normal[along];
                    crossings[row * columns + column].push((place, winding, packed));
                }
            }
        }
    }
    let dexels = crossings.into_par_iter().map(|found| Dexel::of(runs(found))).collect();
    Grid { along, columns, dexels }
}

fn cross(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}

/// Whether a triangle holds a point: of an edge that passes it exactly, the side that a point a little up, then a little
/// to the right, would be on.
fn holds(corners: &[[f64; 2]; 3], p: [f64; 2], anticlockwise: bool) -> bool {
    (0..3).all(|k| {
        // The same two ends in the same order from both triangles, so that rounding is the same.
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let turned = a > b;
        let (low, high) = if turned { (b, a) } else { (a, b) };
        let mut side = cross(low, high, p);
        if side == 0.0 {
            side = if high[0] - low[0] > 0.0 { 1.0 } else { -1.0 };
        }
        (side > 0.0) == (anticlockwise != turned)
    })
}

fn runs(mut crossings: Vec<Crossing>) -> Vec<Run> {
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut runs = Vec::new();
    let (mut depth, mut start) = (0, None);
    for (place, winding, normal) in crossings {
        let before = depth;
        depth -= winding;
        if before <= 0 && depth > 0 {
            start = Some((place, normal));
        } else if before > 0
            && depth <= 0
            && let Some((low, below)) = start.take().filter(|s: &(f64, Normal)| place > s.0)
        {
            runs.push(Run { low, high: place, normals: [below, normal] });
        }
    }
    runs
}
