//! Least-squares fit of a bicubic B-spline surface to points with known parameters. Uses `surface`, `knots`.
//!
//! Source: Piegl and Tiller, The NURBS Book, section 9.4, with a smoothing term so that control points without data
//! are held by their neighbours.

use super::knots::Knots;
use super::surface::SplineSurface;
use super::{Point, Vector};
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};

/// A point that the surface shall meet.
#[derive(Clone, Copy, Debug)]
pub struct FitPoint {
    /// Where on the unit square.
    pub parameters: [f64; 2],
    /// The point, mm.
    pub point: Point,
    /// Weight of its squared distance.
    pub weight: f64,
}

/// The bicubic surface over the unit square with `controls` control points along u and v (at least 4) and equal spans
/// that is closest to the points in the sense of least squares, plus `smoothing` (a share of the points' mean influence
/// on a control point) times the squared second differences of the control net. None when the system breaks down.
pub fn fit_surface(points: &[FitPoint], controls: [usize; 2], smoothing: f64) -> Option<SplineSurface> {
    let knots = [Knots::clamped_uniform(3, controls[0]).ok()?, Knots::clamped_uniform(3, controls[1]).ok()?];
    let [rows, columns] = controls;
    let count = rows * columns;
    let mut normal = Normal::new(rows, columns);
    let mut right = Mat::<f64>::zeros(count, 3);
    let mut influence = 0.0;
    for FitPoint { parameters: [u, v], point, weight } in points {
        let (bu, bv) = (knots[0].basis(u.clamp(0.0, 1.0)), knots[1].basis(v.clamp(0.0, 1.0)));
        let mut row = [([0; 2], 0.0); 16];
        for (k, entry) in row.iter_mut().enumerate() {
            let (i, j) = (k / 4, k % 4);
            *entry = ([bu.first + i, bv.first + j], bu.ders[0][i] * bv.ders[0][j]);
        }
        normal.add(&row, *weight);
        for ([i, j], value) in row {
            influence += weight * value * value;
            for axis in 0..3 {
                right[(i * columns + j, axis)] += weight * value * point[axis];
            }
        }
    }
    normal.smooth(smoothing * influence / count as f64);
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(count, count, &normal.triplets()).ok()?;
    matrix.sp_cholesky(Side::Lower).ok()?.solve_in_place(right.as_mut());
    let control = (0..rows)
        .map(|i| (0..columns).map(|j| Point::from(Vector::from_fn(|axis, _| right[(i * columns + j, axis)]))).collect())
        .collect();
    let [knots_u, knots_v] = knots.map(|knots| knots.values().to_vec());
    SplineSurface::new([3, 3], [knots_u, knots_v], control, None).ok()
}

/// Lower triangle of a sum of weighted outer products of rows that each touch a block of at most 4 x 4 control points:
/// per control point, the entries with those up to three rows before it and three columns to either side.
struct Normal {
    rows: usize,
    columns: usize,
    stencils: Vec<[[f64; 7]; 4]>,
}

impl Normal {
    fn new(rows: usize, columns: usize) -> Self {
        Self { rows, columns, stencils: vec![[[0.0; 7]; 4]; rows * columns] }
    }

    fn add(&mut self, row: &[([usize; 2], f64)], weight: f64) {
        for ([i, j], a) in row {
            let stencil = &mut self.stencils[i * self.columns + j];
            for ([k, l], b) in row {
                if (k, l) <= (i, j) {
                    stencil[i - k][l + 3 - j] += weight * a * b;
                }
            }
        }
    }

    /// Second differences along rows, along columns and across.
    fn smooth(&mut self, stiffness: f64) {
        for i in 0..self.rows {
            for j in 0..self.columns {
                if i + 2 < self.rows {
                    self.add(&[([i, j], 1.0), ([i + 1, j], -2.0), ([i + 2, j], 1.0)], stiffness);
                }
                if j + 2 < self.columns {
                    self.add(&[([i, j], 1.0), ([i, j + 1], -2.0), ([i, j + 2], 1.0)], stiffness);
                }
                if i + 1 < self.rows && j + 1 < self.columns {
                    let (low, high) =
                        ([([i, j], 1.0), ([i, j + 1], -1.0)], [([i + 1, j], -1.0), ([i + 1, j + 1], 1.0)]);
                    self.add(&[low[0], low[1], high[0], high[1]], stiffness);
                }
            }
        }
    }

    fn triplets(&self) -> Vec<Triplet<usize, usize, f64>> {
        let mut triplets = Vec::with_capacity(self.stencils.len() * 25);
        for (index, stencil) in self.stencils.iter().enumerate() {
            let (i, j) = (index / self.columns, index % self.columns);
            for (back, line) in stencil.iter().enumerate().take(i + 1) {
                for (place, value) in line.iter().enumerate() {
                    let column = (j + place).checked_sub(3).filter(|l| *l < self.columns && (back > 0 || *l <= j));
                    if let Some(l) = column {
                        triplets.push(Triplet::new(index, (i - back) * self.columns + l, *value));
                    }
                }
            }
        }
        triplets
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_a_bicubic_give_it_back() {
        let height = |u: f64, v: f64| 3.0 * u * u * u - 2.0 * u * v * v + v * v * v * u * u;
        let points: Vec<FitPoint> = (0..15 * 15)
            .map(|k| [f64::from(k % 15) / 14.0, f64::from(k / 15) / 14.0])
            .map(|[u, v]| FitPoint {
                parameters: [u, v],
                point: Point::new(10.0 * u, 8.0 * v, height(u, v)),
                weight: 1.0,
            })
            .collect();
        let surface = fit_surface(&points, [6, 7], 1e-13).unwrap();
        for p in &points {
            assert!((surface.point(p.parameters[0], p.parameters[1]) - p.point).norm() < 1e-9);
        }
    }

    #[test]
    fn smoothing_carries_a_plane_over_a_hole_in_the_data() {
        let plane = |u: f64, v: f64| Point::new(10.0 * u, 8.0 * v, 2.0 * u - v);
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let points = corners.map(|[u, v]| FitPoint { parameters: [u, v], point: plane(u, v), weight: 1.0 });
        let surface = fit_surface(&points, [4, 4], 1e-6).unwrap();
        let foot = surface.closest(&plane(0.4, 0.7));
        assert!(foot.distance < 1e-6, "{}", foot.distance);
    }
}
