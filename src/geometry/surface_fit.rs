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
    let mut normal = Lower { triplets: Vec::with_capacity(points.len() * 136) };
    let mut right = Mat::<f64>::zeros(count, 3);
    let mut influence = 0.0;
    for FitPoint { parameters: [u, v], point, weight } in points {
        let (bu, bv) = (knots[0].basis(u.clamp(0.0, 1.0)), knots[1].basis(v.clamp(0.0, 1.0)));
        let mut row = [(0, 0.0); 16];
        for (k, entry) in row.iter_mut().enumerate() {
            let (i, j) = (k / 4, k % 4);
            *entry = ((bu.first + i) * columns + bv.first + j, bu.ders[0][i] * bv.ders[0][j]);
        }
        normal.add(&row, *weight);
        for (index, value) in row {
            influence += weight * value * value;
            for axis in 0..3 {
                right[(index, axis)] += weight * value * point[axis];
            }
        }
    }
    let stiffness = smoothing * influence / count as f64;
    for i in 0..rows {
        for j in 0..columns {
            let at = |a: usize, b: usize| a * columns + b;
            if i + 2 < rows {
                normal.add(&[(at(i, j), 1.0), (at(i + 1, j), -2.0), (at(i + 2, j), 1.0)], stiffness);
            }
            if j + 2 < columns {
                normal.add(&[(at(i, j), 1.0), (at(i, j + 1), -2.0), (at(i, j + 2), 1.0)], stiffness);
            }
            if i + 1 < rows && j + 1 < columns {
                let twist = [(at(i, j), 1.0), (at(i + 1, j), -1.0), (at(i, j + 1), -1.0), (at(i + 1, j + 1), 1.0)];
                normal.add(&twist, stiffness);
            }
        }
    }
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(count, count, &normal.triplets).ok()?;
    matrix.sp_cholesky(Side::Lower).ok()?.solve_in_place(right.as_mut());
    let control = (0..rows)
        .map(|i| (0..columns).map(|j| Point::from(Vector::from_fn(|axis, _| right[(i * columns + j, axis)]))).collect())
        .collect();
    let [knots_u, knots_v] = knots.map(|knots| knots.values().to_vec());
    SplineSurface::new([3, 3], [knots_u, knots_v], control, None).ok()
}

/// Lower triangle of a sum of weighted outer products.
struct Lower {
    triplets: Vec<Triplet<usize, usize, f64>>,
}

impl Lower {
    fn add(&mut self, row: &[(usize, f64)], weight: f64) {
        for (i, a) in row {
            for (j, b) in row {
                if i >= j {
                    self.triplets.push(Triplet::new(*i, *j, weight * a * b));
                }
            }
        }
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
