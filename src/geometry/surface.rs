//! Tensor-product B-spline surfaces, polynomial or rational. Uses `knots`.
//!
//! Source of the formulas: Piegl and Tiller, The NURBS Book, chapters 3 and 4.

use super::bvh::Aabb;
use super::knots::{Basis, KnotError, Knots};
use super::patch::{Control, PatchTree};
use super::{Direction, Point, RigidMotion, Vector};
use std::sync::OnceLock;

/// A B-spline surface S(u, v), mm. Immutable, so that its search tree stays true.
#[derive(Clone, Debug)]
pub struct SplineSurface {
    knots_u: Knots,
    knots_v: Knots,
    /// Row by row: index i * (controls along v) + j.
    control: Vec<Point>,
    weights: Option<Vec<f64>>,
    tree: OnceLock<PatchTree>,
}

/// Point and partial derivatives to second order at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceJet {
    /// S, mm.
    pub point: Point,
    /// First derivative along u.
    pub su: Vector,
    /// First derivative along v.
    pub sv: Vector,
    /// Second derivative along u.
    pub suu: Vector,
    /// Mixed second derivative.
    pub suv: Vector,
    /// Second derivative along v.
    pub svv: Vector,
}

/// Why a surface is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// The knots along u do not fit.
    #[error("knots_u: {0}")]
    KnotsU(KnotError),
    /// The knots along v do not fit.
    #[error("knots_v: {0}")]
    KnotsV(KnotError),
    /// The rows of control points differ in length.
    #[error("control row {row} has {found} points, the rows before it {expected}")]
    Ragged {
        /// Row from 0.
        row: usize,
        /// Its length.
        found: usize,
        /// Length of row 0.
        expected: usize,
    },
    /// A coordinate that is not finite.
    #[error("control point [{row}][{column}] is not finite")]
    NotFinite {
        /// Row (along u) from 0.
        row: usize,
        /// Column (along v) from 0.
        column: usize,
    },
    /// As many weights as control points are needed.
    #[error("weights must have the same rows and columns as control; row {row} differs")]
    WeightCount {
        /// Row from 0.
        row: usize,
    },
    /// A weight that is not a positive finite number.
    #[error("weight [{row}][{column}] is {value}; weights must be positive")]
    Weight {
        /// Row (along u) from 0.
        row: usize,
        /// Column (along v) from 0.
        column: usize,
        /// Its value.
        value: f64,
    },
}

impl SplineSurface {
    /// Checks and joins degrees, knots, control points (`control[i][j]`: i along u, j along v) and weights.
    pub fn new(
        degree: [usize; 2],
        knots: [Vec<f64>; 2],
        control: Vec<Vec<Point>>,
        weights: Option<Vec<Vec<f64>>>,
    ) -> Result<Self, SurfaceError> {
        let columns = control.first().map_or(0, Vec::len);
        for (row, points) in control.iter().enumerate() {
            if points.len() != columns {
                return Err(SurfaceError::Ragged { row, found: points.len(), expected: columns });
            }
            if let Some(column) = points.iter().position(|p| !p.coords.iter().all(|x| x.is_finite())) {
                return Err(SurfaceError::NotFinite { row, column });
            }
        }
        let [knots_u, knots_v] = knots;
        let knots_u = Knots::new(degree[0], knots_u, control.len()).map_err(SurfaceError::KnotsU)?;
        let knots_v = Knots::new(degree[1], knots_v, columns).map_err(SurfaceError::KnotsV)?;
        if let Some(weights) = &weights {
            check_weights(weights, control.len(), columns)?;
        }
        Ok(Self {
            knots_u,
            knots_v,
            control: control.into_iter().flatten().collect(),
            weights: weights.map(|rows| rows.into_iter().flatten().collect()),
            tree: OnceLock::new(),
        })
    }

    /// Knots along u.
    pub fn knots_u(&self) -> &Knots {
        &self.knots_u
    }

    /// Knots along v.
    pub fn knots_v(&self) -> &Knots {
        &self.knots_v
    }

    /// Control points, row by row (rows along u).
    pub fn control(&self) -> &[Point] {
        &self.control
    }

    /// Weights in the order of the control points, if the surface is rational.
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// Parameter rectangle: `[(u low, u high), (v low, v high)]`.
    pub fn domain(&self) -> [(f64, f64); 2] {
        [self.knots_u.domain(), self.knots_v.domain()]
    }

    /// Box around the control points, which holds the surface.
    pub fn bounds(&self) -> Aabb {
        Aabb::around(&self.control)
    }

    /// The same surface moved.
    #[must_use]
    pub fn transformed(&self, motion: &RigidMotion) -> Self {
        Self { control: self.control.iter().map(|p| motion * p).collect(), tree: OnceLock::new(), ..self.clone() }
    }

    /// Point and derivatives at (u, v). Outside the domain the end polynomials are continued.
    pub fn jet(&self, u: f64, v: f64) -> SurfaceJet {
        self.table::<false>(u, v).jet()
    }

    /// Point at (u, v).
    pub fn point(&self, u: f64, v: f64) -> Point {
        self.jet(u, v).point
    }

    /// Like [`Self::jet`] inside the domain. Outside, the surface goes on straight from the nearest edge point along the
    /// edge's cross derivative, bilinearly past a corner: with (a, b) the nearest parameters of the domain and
    /// (x, y) = (u - a, v - b), E(u, v) = S + x Su + y Sv + x y Suv, all at (a, b). E is C1 across the edges.
    pub fn extended_jet(&self, u: f64, v: f64) -> SurfaceJet {
        let [(u0, u1), (v0, v1)] = self.domain();
        let (a, b) = (u.clamp(u0, u1), v.clamp(v0, v1));
        let (x, y) = (u - a, v - b);
        if x == 0.0 && y == 0.0 {
            return self.jet(u, v);
        }
        let d = self.table::<true>(a, b).0;
        let zero = Vector::zeros();
        if x == 0.0 {
            return SurfaceJet {
                point: Point::from(d[0][0] + d[0][1] * y),
                su: d[1][0] + d[1][1] * y,
                sv: d[0][1],
                suu: d[2][0] + d[2][1] * y,
                suv: d[1][1],
                svv: zero,
            };
        }
        if y == 0.0 {
            return SurfaceJet {
                point: Point::from(d[0][0] + d[1][0] * x),
                su: d[1][0],
                sv: d[0][1] + d[1][1] * x,
                suu: zero,
                suv: d[1][1],
                svv: d[0][2] + d[1][2] * x,
            };
        }
        SurfaceJet {
            point: Point::from(d[0][0] + d[1][0] * x + d[0][1] * y + d[1][1] * (x * y)),
            su: d[1][0] + d[1][1] * y,
            sv: d[0][1] + d[1][1] * x,
            suu: zero,
            suv: d[1][1],
            svv: zero,
        }
    }

    /// The search tree, built at first use.
    pub(super) fn tree(&self) -> &PatchTree {
        let knots = [&self.knots_u, &self.knots_v];
        let control = Control { knots, points: &self.control, weights: self.weights.as_deref() };
        self.tree.get_or_init(|| PatchTree::new(&control))
    }

    /// Derivatives of mixed order up to two in each parameter; of total order above two only when `FULL`.
    fn table<const FULL: bool>(&self, u: f64, v: f64) -> DerivativeTable {
        if self.weights.is_none()
            && let (Some(bu), Some(bv)) = (self.knots_u.cubic_basis(u), self.knots_v.cubic_basis(v))
        {
            return self.bicubic_table::<FULL>(&bu, &bv);
        }
        let (bu, bv) = (self.knots_u.basis(u), self.knots_v.basis(v));
        let (p, q) = (self.knots_u.degree(), self.knots_v.degree());
        let columns = self.knots_v.controls();
        let mut sums = [[Vector::zeros(); 3]; 3];
        let mut weight = [[0.0; 3]; 3];
        for i in 0..=p {
            let start = (bu.first + i) * columns + bv.first;
            let points = &self.control[start..=start + q];
            let (row, row_weight) = match &self.weights {
                None => (row_sums(points, &bv), [0.0; 3]),
                Some(weights) => weighted_row_sums(points, &weights[start..=start + q], &bv),
            };
            for k in 0..3 {
                let along_u = bu.ders[k][i];
                for l in 0..if FULL { 3 } else { 3 - k } {
                    sums[k][l] += row[l] * along_u;
                    weight[k][l] += row_weight[l] * along_u;
                }
            }
        }
        if self.weights.is_some() { DerivativeTable::quotient(&sums, &weight) } else { DerivativeTable(sums) }
    }

    /// The same in the common case, in which the compiler knows all lengths.
    fn bicubic_table<const FULL: bool>(&self, bu: &Basis<4>, bv: &Basis<4>) -> DerivativeTable {
        let columns = self.knots_v.controls();
        let mut sums = [[Vector::zeros(); 3]; 3];
        for i in 0..4 {
            let start = (bu.first + i) * columns + bv.first;
            let Some(points) = self.control[start..].first_chunk::<4>() else { continue };
            let row = row_sums(points, bv);
            for (k, sums) in sums.iter_mut().enumerate() {
                let along_u = bu.ders[k][i];
                for l in 0..if FULL { 3 } else { 3 - k } {
                    sums[l] += row[l] * along_u;
                }
            }
        }
        DerivativeTable(sums)
    }
}

/// Sums of one row of control points with the basis functions along v and their derivatives.
#[inline(always)]
fn row_sums<const N: usize>(points: &[Point], basis: &Basis<N>) -> [Vector; 3] {
    let mut sums = [Vector::zeros(); 3];
    for (j, point) in points.iter().enumerate() {
        for (sum, ders) in sums.iter_mut().zip(&basis.ders) {
            *sum += point.coords * ders[j];
        }
    }
    sums
}

/// The same for a rational surface: of the weighted points, and of the weights.
fn weighted_row_sums(points: &[Point], weights: &[f64], basis: &Basis) -> ([Vector; 3], [f64; 3]) {
    let (mut sums, mut weight_sums) = ([Vector::zeros(); 3], [0.0; 3]);
    for (j, (point, weight)) in points.iter().zip(weights).enumerate() {
        for (l, ders) in basis.ders.iter().enumerate() {
            sums[l] += point.coords * (ders[j] * weight);
            weight_sums[l] += ders[j] * weight;
        }
    }
    (sums, weight_sums)
}

fn check_weights(weights: &[Vec<f64>], rows: usize, columns: usize) -> Result<(), SurfaceError> {
    if weights.len() != rows {
        return Err(SurfaceError::WeightCount { row: weights.len().min(rows) });
    }
    for (row, values) in weights.iter().enumerate() {
        if values.len() != columns {
            return Err(SurfaceError::WeightCount { row });
        }
        if let Some(column) = values.iter().position(|w| !(w.is_finite() && *w > 0.0)) {
            return Err(SurfaceError::Weight { row, column, value: values[column] });
        }
    }
    Ok(())
}

/// Entry `[k][l]`: derivative of order k along u and l along v.
struct DerivativeTable([[Vector; 3]; 3]);

impl DerivativeTable {
    /// Derivatives of A/w from those of A and w: the quotient rule, A4.4.
    fn quotient(sums: &[[Vector; 3]; 3], weight: &[[f64; 3]; 3]) -> Self {
        const BINOMIAL: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 1.0]];
        let mut table = [[Vector::zeros(); 3]; 3];
        for k in 0..3 {
            for l in 0..3 {
                let mut value = sums[k][l];
                for i in 0..=k {
                    for j in 0..=l {
                        if i + j > 0 {
                            value -= table[k - i][l - j] * (BINOMIAL[k][i] * BINOMIAL[l][j] * weight[i][j]);
                        }
                    }
                }
                table[k][l] = value / weight[0][0];
            }
        }
        Self(table)
    }

    fn jet(&self) -> SurfaceJet {
        let d = &self.0;
        SurfaceJet { point: Point::from(d[0][0]), su: d[1][0], sv: d[0][1], suu: d[2][0], suv: d[1][1], svv: d[0][2] }
    }
}

impl SurfaceJet {
    /// Unit normal Su × Sv; none where the derivatives vanish or are parallel.
    pub fn normal(&self) -> Option<Direction> {
        let normal = self.su.cross(&self.sv);
        Direction::try_new(normal, 1e-12 * self.su.norm() * self.sv.norm()).filter(|n| n.x.is_finite())
    }
}

#[cfg(test)]
#[path = "surface_tests.rs"]
mod tests;
