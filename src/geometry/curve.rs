//! B-spline curves in space.

use super::knots::{Basis, KnotError, Knots};
use super::{Point, Vector};

/// A polynomial B-spline curve, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct SplineCurve {
    knots: Knots,
    control: Vec<Point>,
}

impl SplineCurve {
    /// Joins knots and control points.
    pub fn new(degree: usize, knots: Vec<f64>, control: Vec<Point>) -> Result<Self, KnotError> {
        let knots = Knots::new(degree, knots, control.len())?;
        Ok(Self { knots, control })
    }

    /// Joins checked knots and control points.
    pub fn from_knots(knots: Knots, control: Vec<Point>) -> Result<Self, KnotError> {
        if knots.controls() == control.len() {
            return Ok(Self { knots, control });
        }
        Err(KnotError::Count { knots: knots.values().len(), degree: knots.degree(), controls: control.len() })
    }

    /// The knots.
    pub fn knots(&self) -> &Knots {
        &self.knots
    }

    /// The control points.
    pub fn control(&self) -> &[Point] {
        &self.control
    }

    /// Moves the control points in place; their number stays.
    pub fn control_mut(&mut self) -> &mut [Point] {
        &mut self.control
    }

    /// Point and first two derivatives with respect to the parameter, at `t`.
    pub fn jet(&self, t: f64) -> [Vector; 3] {
        match self.knots.cubic_basis(t) {
            Some(basis) => self.sums(&basis),
            None => self.sums(&self.knots.basis(t)),
        }
    }

    #[inline(always)]
    fn sums<const N: usize>(&self, basis: &Basis<N>) -> [Vector; 3] {
        let mut jet = [Vector::zeros(); 3];
        for (j, point) in self.control[basis.first..=basis.first + self.knots.degree()].iter().enumerate() {
            for (value, weights) in jet.iter_mut().zip(&basis.ders) {
                *value += point.coords * weights[j];
            }
        }
        jet
    }

    /// Point at `t`.
    pub fn point(&self, t: f64) -> Point {
        Point::from(self.jet(t)[0])
    }
}
