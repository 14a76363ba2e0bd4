//! The design surface and its straight extension past its edges, by its own parameters scaled to 0..1. Uses
//! `geometry` and `part`.

use crate::geometry::{Point, SurfaceJet, Vector};
use crate::part::OrientedSpline;
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2};

/// A place of the sheet: parameters that are 0..1 on the surface and go on past its edges.
pub(super) type Place = (f64, f64);

/// The design surface with its extension.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheet<'a> {
    spline: &'a OrientedSpline,
}

/// A point of the sheet with its first derivatives by the scaled parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Where.
    pub(super) place: Place,
    /// The point, mm.
    pub(super) point: Point,
    /// Unit normal out of the material.
    pub(super) normal: Vector,
    /// Derivatives of the point, mm per unit.
    pub(super) tangents: Matrix3x2<f64>,
}

/// The closest point of the sheet to a point in space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    /// The sheet there.
    pub(super) frame: Frame,
    /// Distance along the normal, mm: positive on the tool's side.
    pub(super) distance: f64,
}

/// True where a place lies on the surface itself.
pub(super) fn inside((u, v): Place) -> bool {
    (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v)
}

impl Frame {
    /// Coefficients (a, b) of the tangential part of `w`: w = a Su + b Sv + (w·n) n.
    pub(super) fn components(&self, w: &Vector) -> Option<Vector2<f64>> {
        let first = self.tangents.transpose() * self.tangents;
        Some(first.try_inverse()? * (self.tangents.transpose() * w))
    }

    /// The unit tangent along the tangential part of `w`; `None` where less than a twentieth of `w` is tangential.
    pub(super) fn along(&self, w: &Vector) -> Option<Vector> {
        let tangential = w - self.normal * self.normal.dot(w);
        let length = tangential.norm();
        (length > LEAST_TANGENTIAL * w.norm()).then(|| tangential / length)
    }
}

/// A vector with a smaller share in the tangent plane gives no direction there.
const LEAST_TANGENTIAL: f64 = 0.05;

impl<'a> Sheet<'a> {
    pub(super) fn new(spline: &'a OrientedSpline) -> Self {
        Self { spline }
    }

    fn scale(&self) -> [(f64, f64); 2] {
        let [(u0, u1), (v0, v1)] = self.spline.surface().domain();
        [(u0, u1 - u0), (v0, v1 - v0)]
    }

    fn parameters(&self, (u, v): Place) -> (f64, f64) {
        let [(u0, du), (v0, dv)] = self.scale();
        (u0 + u * du, v0 + v * dv)
    }

    fn place(&self, u: f64, v: f64) -> Place {
        let [(u0, du), (v0, dv)] = self.scale();
        ((u - u0) / du, (v - v0) / dv)
    }

    fn jet(&self, place: Place) -> SurfaceJet {
        let (u, v) = self.parameters(place);
        self.spline.surface().extended_jet(u, v)
    }

    /// The sheet at a place; `None` where it has no normal.
    pub(super) fn frame(&self, place: Place) -> Option<Frame> {
        let jet = self.jet(place);
        let normal = jet.normal()?.into_inner() * self.spline.side();
        let [(_, du), (_, dv)] = self.scale();
        Some(Frame { place, point: jet.point, normal, tangents: Matrix3x2::from_columns(&[jet.su * du, jet.sv * dv]) })
    }

    /// The foot of `p`, found from a place nearby.
    pub(super) fn foot(&self, p: &Point, near: Place) -> Option<Foot> {
        let foot = self.spline.surface().closest_from(p, self.parameters(near));
        let frame = self.frame(self.place(foot.u, foot.v))?;
        let distance = (p - frame.point).dot(&frame.normal);
        distance.is_finite().then_some(Foot { frame, distance })
    }

    /// Derivative of the unit normal at the foot of a point by that point, `distance` above `place`.
    ///
    /// With T the tangents, I and II the fundamental forms (II with the outward normal): a point p + rho n over
    /// parameters q moves by T' dm = (I - rho II) dq, and the normal by dn = -T I^-1 II dq. Source: do Carmo,
    /// Differential Geometry of Curves and Surfaces, section 3.3 (Weingarten's equations).
    pub(super) fn normal_rate(&self, place: Place, distance: f64) -> Option<Matrix3<f64>> {
        let jet = self.jet(place);
        let normal = jet.normal()?.into_inner() * self.spline.side();
        let tangents = Matrix3x2::from_columns(&[jet.su, jet.sv]);
        let first = tangents.transpose() * tangents;
        let (l, m, n) = (jet.suu.dot(&normal), jet.suv.dot(&normal), jet.svv.dot(&normal));
        let second = Matrix2::new(l, m, m, n);
        let moved = (first - second * distance).try_inverse()?;
        Some(-tangents * first.try_inverse()? * second * moved * tangents.transpose())
    }

    /// Normal curvature of the surface along a tangent, 1/mm: positive in a hollow, as seen from the tool's side.
    pub(super) fn curvature(&self, place: Place, tangent: &Vector) -> Option<f64> {
        Some(self.spline.side() * self.jet(place).curvature()?.normal_curvature(tangent)?)
    }

    /// Mean lengths of the surface along its two parameters, mm.
    pub(super) fn lengths(&self) -> Option<(f64, f64)> {
        let (mut along_u, mut along_v) = (0.0, 0.0);
        let steps = 8;
        for i in 0..steps {
            for j in 0..steps {
                let middle = |k: i32| (f64::from(k) + 0.5) / f64::from(steps);
                let frame = self.frame((middle(i), middle(j)))?;
                along_u += frame.tangents.column(0).norm();
                along_v += frame.tangents.column(1).norm();
            }
        }
        let count = f64::from(steps * steps);
        Some((along_u / count, along_v / count))
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::saddle;
    use super::*;

    #[test]
    fn normal_rate_is_the_derivative_of_the_normal_at_the_foot() {
        let spline = saddle();
        let sheet = Sheet::new(&spline);
        let frame = sheet.frame((0.3, 0.6)).unwrap();
        let p = frame.point + frame.normal * 1.7;
        let rate = sheet.normal_rate(frame.place, 1.7).unwrap();
        for axis in 0..3 {
            let mut step = Vector::zeros();
            step[axis] = 1e-4;
            let normal = |q: Point| sheet.foot(&q, frame.place).unwrap().frame.normal;
            let difference = (normal(p + step) - normal(p - step)) / 2e-4;
            assert!((rate.column(axis) - difference).norm() < 1e-7, "{axis}: {rate} {difference}");
        }
    }

    #[test]
    fn components_rebuild_the_tangential_part() {
        let spline = saddle();
        let frame = Sheet::new(&spline).frame((0.2, 0.9)).unwrap();
        let w = Vector::new(0.4, -1.0, 0.3);
        let found = frame.tangents * frame.components(&w).unwrap();
        assert!((found - (w - frame.normal * frame.normal.dot(&w))).norm() < 1e-12);
        assert!(frame.along(&frame.normal).is_none());
    }
}
