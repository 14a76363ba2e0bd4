//! Curvatures of a surface from its derivatives. Source: do Carmo, Differential Geometry of Curves and Surfaces,
//! section 3.3.

use super::surface::SurfaceJet;
use super::{Direction, Vector};

/// The two fundamental forms of a surface at one point. Curvatures are counted with the normal Su × Sv, 1/mm: positive
/// where the surface bends toward that normal.
#[derive(Clone, Copy, Debug)]
pub struct Curvature {
    normal: Direction,
    su: Vector,
    sv: Vector,
    /// E, F, G.
    first: [f64; 3],
    /// L, M, N.
    second: [f64; 3],
}

/// Extreme normal curvatures and their directions.
#[derive(Clone, Copy, Debug)]
pub struct PrincipalCurvatures {
    /// Greater and lesser curvature, 1/mm.
    pub values: [f64; 2],
    /// Their directions, perpendicular to each other and to the normal.
    pub directions: [Direction; 2],
}

impl SurfaceJet {
    /// The fundamental forms; none where the surface has no normal.
    pub fn curvature(&self) -> Option<Curvature> {
        let normal = self.normal()?;
        Some(Curvature {
            normal,
            su: self.su,
            sv: self.sv,
            first: [self.su.dot(&self.su), self.su.dot(&self.sv), self.sv.dot(&self.sv)],
            second: [self.suu.dot(&normal), self.suv.dot(&normal), self.svv.dot(&normal)],
        })
    }
}

impl Curvature {
    /// The normal Su × Sv.
    pub fn normal(&self) -> Direction {
        self.normal
    }

    /// K = (L N - M²) / (E G - F²), 1/mm².
    pub fn gaussian(&self) -> f64 {
        let ([e, f, g], [l, m, n]) = (self.first, self.second);
        (l * n - m * m) / (e * g - f * f)
    }

    /// H = (E N - 2 F M + G L) / (2 (E G - F²)), 1/mm.
    pub fn mean(&self) -> f64 {
        let ([e, f, g], [l, m, n]) = (self.first, self.second);
        (e * n - 2.0 * f * m + g * l) / (2.0 * (e * g - f * f))
    }

    /// Normal curvature II(w, w) / I(w, w), 1/mm, along the part w of `direction` that lies in the tangent plane; none
    /// when there is no such part.
    pub fn normal_curvature(&self, direction: &Vector) -> Option<f64> {
        let ([e, f, g], [l, m, n]) = (self.first, self.second);
        let (du, dv) = (direction.dot(&self.su), direction.dot(&self.sv));
        // w = a Su + b Sv up to the factor E G - F², which cancels.
        let (a, b) = (g * du - f * dv, e * dv - f * du);
        let length = e * a * a + 2.0 * f * a * b + g * b * b;
        let value = (l * a * a + 2.0 * m * a * b + n * b * b) / length;
        value.is_finite().then_some(value)
    }

    /// Principal curvatures and directions. Where all directions are alike (umbilic), the first is along Su.
    pub fn principal(&self) -> PrincipalCurvatures {
        let ([e, f, g], [l, m, n]) = (self.first, self.second);
        let root = e.sqrt();
        let area = (e * g - f * f).max(0.0).sqrt();
        // Second form in the orthonormal frame e1 = Su/√E, e2 = n × e1 = (E Sv - F Su)/(√E √(EG - F²)).
        let b11 = l / e;
        let b12 = (e * m - f * l) / (e * area);
        let b22 = (e * e * n - 2.0 * e * f * m + f * f * l) / (e * area * area);
        let (mean, half) = ((b11 + b22) / 2.0, (b11 - b22) / 2.0);
        let radius = half.hypot(b12);
        let (sin, cos) = (0.5 * b12.atan2(half)).sin_cos();
        let e1 = self.su / root;
        let e2 = self.normal.cross(&e1);
        PrincipalCurvatures {
            values: [mean + radius, mean - radius],
            directions: [Direction::new_normalize(e1 * cos + e2 * sin), Direction::new_normalize(e2 * cos - e1 * sin)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use proptest::prelude::*;

    /// Saddle or bowl z = (k1 x² + k2 y²)/2 at its apex, in skewed parameters.
    fn quadric(k1: f64, k2: f64, skew: f64) -> SurfaceJet {
        let (su, sv) = (Vector::new(2.0, 0.0, 0.0), Vector::new(skew, 0.5, 0.0));
        let form = |a: &Vector, b: &Vector| Vector::z() * (k1 * a.x * b.x + k2 * a.y * b.y);
        SurfaceJet { point: Point::origin(), su, sv, suu: form(&su, &su), suv: form(&su, &sv), svv: form(&sv, &sv) }
    }

    proptest! {
        #[test]
        fn quadric_has_its_own_curvatures(k1 in 0.1..2.0f64, k2 in -2.0..0.05f64, skew in -3.0..3.0f64, t in 0.0..6.3f64) {
            let c = quadric(k1, k2, skew).curvature().unwrap();
            prop_assert!((c.gaussian() - k1 * k2).abs() < 1e-9);
            prop_assert!((c.mean() - (k1 + k2) / 2.0).abs() < 1e-9);
            let p = c.principal();
            prop_assert!((p.values[0] - k1).abs() < 1e-9 && (p.values[1] - k2).abs() < 1e-9);
            prop_assert!(p.directions[0].cross(&Vector::x()).norm() < 1e-6);
            // Euler's formula.
            let direction = Vector::new(t.cos(), t.sin(), 0.7);
            let euler = k1 * t.cos().powi(2) + k2 * t.sin().powi(2);
            prop_assert!((c.normal_curvature(&direction).unwrap() - euler).abs() < 1e-9);
        }
    }

    #[test]
    fn no_curvature_along_the_normal_and_none_without_one() {
        let jet = quadric(1.0, 1.0, 0.0);
        assert_eq!(jet.curvature().unwrap().normal_curvature(&Vector::z()), None);
        assert!(SurfaceJet { sv: jet.su, ..jet }.curvature().is_none());
    }
}
