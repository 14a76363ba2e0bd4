//! Triangular cells of a design surface, with guaranteed bounds on how far the surface leaves the flat triangle and how
//! far its normal turns. Uses `geometry`.

use super::design_surface::DesignSurface;
use super::mesh_sampling;
use super::sample::{SurfacePlace, SurfaceSample};
use crate::geometry::{CurvedMesh, DerivativeTable, Point, Vector};

/// A triangle of the surface. For every point x of it there are weights with which the mean of the corners is within
/// `bulge` of x, and the normal at x is within `turn` of `normal`.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Points of the surface.
    pub corners: [SurfaceSample; 3],
    /// Mean of the corners, mm: beside the surface where that is curved.
    pub centre: Point,
    /// Unit normal of the surface at the mean of the corners' places, out of the material.
    pub normal: Vector,
    /// mm.
    pub bulge: f64,
    /// Length of the difference of unit vectors.
    pub turn: f64,
}

/// Makes the cells of one surface.
#[derive(Debug)]
pub struct Cells<'a> {
    surface: &'a DesignSurface,
    table: Option<DerivativeTable>,
}

impl<'a> Cells<'a> {
    /// Looks at the whole surface once.
    pub fn new(surface: &'a DesignSurface) -> Self {
        let table = match surface {
            DesignSurface::Spline(spline) => Some(DerivativeTable::new(spline.surface())),
            DesignSurface::Mesh(_) | DesignSurface::Curved(_) => None,
        };
        Self { surface, table }
    }

    /// The cell between three samples of a triangle of the surface's own grid, or of a part of one.
    pub fn cell(&self, corners: [SurfaceSample; 3]) -> Cell {
        let [a, b, c] = &corners;
        let third = 1.0 / 3.0;
        let middle = self.surface.between([a, b, c], [third; 3]);
        let centre = Point::from((a.point.coords + b.point.coords + c.point.coords) / 3.0);
        let normal = middle.normal.0.into_inner();
        // Normals that lie in the cap about the middle one that holds those of the corners.
        let cap = || corners.iter().map(|s| (s.normal.0.into_inner() - normal).norm()).fold(0.0, f64::max);
        let (bulge, turn) = match (&self.table, self.surface) {
            (Some(table), DesignSurface::Spline(spline)) => {
                let cross = |u: f64, v: f64| {
                    let jet = spline.surface().jet(u, v);
                    jet.su.cross(&jet.sv).norm()
                };
                spline_bounds(table, &corners, &middle, cross)
            }
            (_, DesignSurface::Curved(mesh)) => {
                let (bulge, turn) = curved_bounds(mesh, &corners, &normal);
                (bulge, turn.max(cap()))
            }
            // A mesh is flat between its edges, its normals are means of those of the corners.
            _ => (0.0, cap()),
        };
        Cell { corners, centre, normal, bulge, turn }
    }

    /// The quarters of a cell.
    pub fn quarters(&self, cell: &Cell) -> [Cell; 4] {
        let [a, b, c] = cell.corners;
        let half = |p: &SurfaceSample, q: &SurfaceSample| self.surface.between([p, q, q], [0.5, 0.5, 0.0]);
        let (ab, bc, ca) = (half(&a, &b), half(&b, &c), half(&c, &a));
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(|corners| self.cell(corners))
    }
}

impl Cell {
    /// Distance of the farthest corner from the centre, mm.
    pub fn radius(&self) -> f64 {
        self.corners.iter().map(|s| (s.point - self.centre).norm()).fold(0.0, f64::max)
    }
}

/// Bulge and turn of a cell of a curved mesh. A corner that was drawn in over an edge lies on the neighbour's patch, and
/// beside this one by what is added.
fn curved_bounds(mesh: &CurvedMesh, corners: &[SurfaceSample; 3], normal: &Vector) -> (f64, f64) {
    let (face, places) = mesh.together(corners.each_ref().map(|corner| mesh_sampling::place_on(mesh, corner)));
    let beside = corners.iter().zip(&places).map(|(corner, w)| (corner.point - mesh.point(face, w)).norm());
    let bounds = mesh.part_bounds(face, &places, normal);
    (bounds.bulge + beside.fold(0.0, f64::max), bounds.turn)
}

/// Bulge and turn of a cell of a spline.
///
/// A function with |D²f(h)| <= A hu² + B hv² leaves its linear interpolant on a triangle by at most R²/2, R being the
/// radius of a circle around the triangle in the metric A, B (Waldron 1998, SIAM J. Numer. Anal. 35); the circle around
/// the triangle's box has R² = (A du² + B dv²) / 4. The mixed term is shared out: 2 |hu hv| <= hu² dv/du + hv² du/dv.
///
/// The normal turns with N = Su x Sv, which over the box leaves its value N0 in the middle by no more than E: it turns
/// by no more than the angle whose sine is E / |N0|.
fn spline_bounds(
    table: &DerivativeTable,
    corners: &[SurfaceSample; 3],
    middle: &SurfaceSample,
    cross: impl Fn(f64, f64) -> f64,
) -> (f64, f64) {
    const NOTHING_KNOWN: (f64, f64) = (f64::INFINITY, 2.0);
    let parameters = |s: &SurfaceSample| match s.place {
        SurfacePlace::Parameters { u, v } => Some((u, v)),
        SurfacePlace::Face { .. } => None,
    };
    let [Some(a), Some(b), Some(c)] = [&corners[0], &corners[1], &corners[2]].map(parameters) else {
        return NOTHING_KNOWN;
    };
    let Some(middle) = parameters(middle) else { return NOTHING_KNOWN };
    let range = |x: [f64; 3]| (x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2]));
    let (u, v) = (range([a.0, b.0, c.0]), range([a.1, b.1, c.1]));
    let (du, dv) = (u.1 - u.0, v.1 - v.0);
    let d = table.within([u, v]);
    if d.crease {
        return (d.su * du + d.sv * dv, 2.0);
    }
    let bulge = (d.suu * du * du + 2.0 * d.suv * du * dv + d.svv * dv * dv) / 8.0;
    let (far_u, far_v) = ((middle.0 - u.0).max(u.1 - middle.0), (middle.1 - v.0).max(v.1 - middle.1));
    let change = (d.suu * far_u + d.suv * far_v) * d.sv + d.su * (d.suv * far_u + d.svv * far_v);
    let sine = change / cross(middle.0, middle.1);
    let turn = if sine < 1.0 { 2.0 * (0.5 * sine.asin()).sin() } else { 2.0 };
    (bulge, turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{CurvedMesh, Radians, SplineSurface, TriangleMesh};
    use crate::part::OrientedSpline;
    use proptest::prelude::*;

    fn wavy(values: &[f64]) -> DesignSurface {
        let knots = || vec![0.0, 0.0, 0.0, 0.0, 0.3, 1.0, 1.0, 1.0, 1.0];
        let off = |i: usize, j: usize| values[5 * i + j];
        let control =
            (0..5).map(|i| (0..5).map(|j| Point::new(4.0 * i as f64, 3.0 * j as f64, off(i, j))).collect()).collect();
        let surface = SplineSurface::new([3, 3], [knots(), knots()], control, None).unwrap();
        DesignSurface::Spline(OrientedSpline::new(surface, false).unwrap())
    }

    /// How far a place of a cell is from the flat triangle, and how far its normal is from the cell's.
    fn at_a_place(surface: &DesignSurface, cell: &Cell, (a, b): (f64, f64)) -> (f64, f64) {
        let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
        let weights = [1.0 - a - b, a, b];
        let [p, q, r] = &cell.corners;
        let exact = surface.between([p, q, r], weights);
        let flat = p.point.coords * weights[0] + q.point.coords * weights[1] + r.point.coords * weights[2];
        ((exact.point.coords - flat).norm(), (exact.normal.0.into_inner() - cell.normal).norm())
    }

    proptest! {
        #[test]
        fn no_point_of_a_cell_is_beyond_its_bounds(
            values in prop::collection::vec(-1.0..1.0f64, 25), pick in 0..10_000usize, times in 0..4usize,
            (a, b) in (0.0..1.0f64, 0.0..1.0f64),
        ) {
            let surface = wavy(&values);
            let grid = surface.sample(2.5);
            let cells = Cells::new(&surface);
            let corners = grid.triangles[pick % grid.triangles.len()].map(|v| grid.samples[v as usize]);
            let mut cell = cells.cell(corners);
            for k in 0..times {
                cell = cells.quarters(&cell)[(pick >> k) & 3];
            }
            let (beyond, turned) = at_a_place(&surface, &cell, (a, b));
            prop_assert!(beyond <= cell.bulge + 1e-12 && turned <= cell.turn + 1e-12);
        }
    }

    fn curved(values: &[f64]) -> DesignSurface {
        let points = (0..25).map(|k| Point::new(f64::from(k / 5), f64::from(k % 5), 0.12 * values[k as usize]));
        let quads = (0..16).map(|k| 5 * (k / 4) + k % 4);
        let triangles = quads.flat_map(|a| [[a, a + 5, a + 6], [a, a + 6, a + 1]]).collect();
        let mesh = TriangleMesh::new(points.collect(), triangles).unwrap();
        DesignSurface::Curved(CurvedMesh::with_creases(mesh, Radians(0.9)).unwrap())
    }

    proptest! {
        #[test]
        fn no_point_of_a_curved_cell_is_beyond_its_bounds(
            values in prop::collection::vec(-1.0..1.0f64, 25), pick in 0..10_000usize, times in 0..4usize,
            (a, b) in (0.0..1.0f64, 0.0..1.0f64), drawn: bool,
        ) {
            let surface = curved(&values);
            let mut grid = surface.sample(0.7);
            if drawn {
                // A corner drawn over an edge into a neighbouring triangle, as at the edge of a region.
                let triangle = grid.triangles[(pick + 1) % grid.triangles.len()];
                let corners = triangle.map(|v| &grid.samples[v as usize]);
                grid.samples[triangle[0] as usize] = surface.between(corners, [0.98, 0.01, 0.01]);
            }
            let cells = Cells::new(&surface);
            let mut cell = cells.cell(grid.triangles[pick % grid.triangles.len()].map(|v| grid.samples[v as usize]));
            for k in 0..times {
                cell = cells.quarters(&cell)[(pick >> k) & 3];
            }
            let (beyond, turned) = at_a_place(&surface, &cell, (a, b));
            prop_assert!(beyond <= cell.bulge + 1e-12 && turned <= cell.turn + 1e-12);
        }
    }

    #[test]
    fn bounds_fall_with_the_square_and_with_the_size() {
        let values: Vec<f64> = (0..25).map(|k| f64::from(k * 7 % 11) / 11.0).collect();
        let surface = wavy(&values);
        let grid = surface.sample(1.0);
        let cells = Cells::new(&surface);
        let whole = cells.cell(grid.triangles[0].map(|v| grid.samples[v as usize]));
        let quarter = cells.quarters(&whole)[3];
        assert!(quarter.bulge < 0.27 * whole.bulge && quarter.turn < 0.55 * whole.turn, "{whole:?} {quarter:?}");
    }
}
