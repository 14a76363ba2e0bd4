//! The tool's radius function: sphere radius r(s) along the axis, s from the lowest sphere centre upward, with its
//! derivatives by the shape's coefficients. Uses `geometry` and `tool`.
//!
//! The sphere at s touches the meridian at height s - r r', radius r sqrt(1 - r'^2). The family is a proper tool where
//! |r'| < 1 and 1 - r'^2 - r r'' > 0: elsewhere spheres swallow their neighbours.

use crate::geometry::knots::Knots;
use crate::tool::{Contact, MeridianPoint};
use nalgebra::{DMatrix, DVector};

/// Coefficients of a free meridian (Bo 2016, section 5: a cubic spline with ten control points).
pub const FREE_COEFFICIENTS: usize = 10;

/// Which meridians are allowed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MeridianFamily {
    /// Any cubic spline.
    #[default]
    Free,
    /// Straight: the radius is linear in s.
    Cone,
    /// Constant radius.
    Cylinder,
    /// One circular arc, bulging or hollow.
    Barrel,
}

/// A radius function with given coefficients over 0..=`length`.
#[derive(Clone, Debug, PartialEq)]
pub struct RadiusFunction {
    family: MeridianFamily,
    knots: Knots,
    length: f64,
    /// Free: control values. Cone: radii at both ends. Cylinder: the radius. Barrel: distance of the arc's middle from
    /// the axis, angle between axis and arc there (radians), curvature there (1/mm, positive for a bulge).
    coefficients: Vec<f64>,
    /// True: a fit may not change it.
    held: bool,
}

/// Radius with two derivatives along the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadiusJet {
    /// r, mm.
    pub radius: f64,
    /// r', without unit.
    pub slope: f64,
    /// r'', 1/mm.
    pub bend: f64,
}

impl RadiusJet {
    /// 1 - r'^2 - r r'': positive where the sphere shows on the envelope of the family.
    pub fn visibility(&self) -> f64 {
        1.0 - self.slope * self.slope - self.radius * self.bend
    }

    /// True where the sphere family is a proper surface of revolution.
    pub fn is_valid(&self) -> bool {
        self.radius > 0.0 && self.slope.abs() < 1.0 && self.visibility() > 0.0
    }

    /// Where the sphere centred at `s` touches the meridian; heights counted from s = 0.
    pub fn contact(&self, s: f64) -> Contact {
        let cosine = (1.0 - self.slope * self.slope).max(0.0).sqrt();
        Contact {
            point: MeridianPoint { height: s - self.radius * self.slope, radius: self.radius * cosine },
            normal_axial: -self.slope,
            normal_radial: cosine,
        }
    }

    /// Signed curvature of the meridian at its touching point, 1/mm, positive for a bulge: the sphere's centre moves
    /// 1 along the axis while the contact moves (1 - r'^2 - r r'') / sqrt(1 - r'^2) along the meridian and the normal
    /// turns by -r'' / sqrt(1 - r'^2).
    pub fn meridian_curvature(&self) -> f64 {
        -self.bend / self.visibility()
    }
}

/// Derivatives of radius, slope and bend by each coefficient.
#[derive(Clone, Debug)]
pub(super) struct ByCoefficients {
    pub(super) radius: Vec<f64>,
    /// Slope and bend; empty for families whose shape cannot swallow itself.
    pub(super) shape: Option<(Vec<f64>, Vec<f64>)>,
}

impl RadiusFunction {
    /// A constant radius over 0..=`length`, to start from; `free` is the number of coefficients of a free meridian, at
    /// least 4.
    pub fn constant(family: MeridianFamily, radius: f64, length: f64, free: usize) -> Option<Self> {
        let coefficients = match family {
            MeridianFamily::Free => vec![radius; free],
            MeridianFamily::Cone => vec![radius; 2],
            MeridianFamily::Cylinder => vec![radius],
            MeridianFamily::Barrel => vec![radius, 0.0, 0.0],
        };
        let knots = Knots::clamped_uniform(3, free).ok()?;
        Some(Self { family, knots, length, coefficients, held: false })
    }

    /// The straight flank between end spheres of given radii, as far apart as `length`; no fit changes it.
    pub(super) fn between(ends: (f64, f64), length: f64) -> Option<Self> {
        let cone = Self::constant(MeridianFamily::Cone, ends.0, length, FREE_COEFFICIENTS)?;
        Some(cone.with(&[ends.0, ends.1]).held())
    }

    /// The same function, which no fit changes any more.
    pub(super) fn held(&self) -> Self {
        Self { held: true, ..self.clone() }
    }

    /// The same function with other coefficients, as many as before.
    pub(super) fn with(&self, coefficients: &[f64]) -> Self {
        Self { coefficients: coefficients.to_vec(), ..self.clone() }
    }

    /// The same shape with `count` coefficients, closest in the sense of least squares; other families as they are.
    pub(super) fn refined(&self, count: usize) -> Option<Self> {
        if self.family != MeridianFamily::Free || self.held {
            return Some(self.clone());
        }
        let knots = Knots::clamped_uniform(3, count).ok()?;
        let rows = 4 * count;
        let mut matrix = DMatrix::zeros(rows, count);
        let mut values = DVector::zeros(rows);
        for (row, s) in self.stations(rows - 1).enumerate() {
            let basis = knots.basis(s / self.length);
            for i in 0..4 {
                matrix[(row, basis.first + i)] = basis.ders[0][i];
            }
            values[row] = self.jet(s).radius;
        }
        let normal = matrix.transpose() * &matrix;
        let coefficients = normal.cholesky()?.solve(&(matrix.transpose() * values));
        Some(Self { knots, coefficients: coefficients.iter().copied().collect(), ..self.clone() })
    }

    /// The coefficients.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Where the last sphere is centred, mm above the first.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The family.
    pub fn family(&self) -> MeridianFamily {
        self.family
    }

    /// Radius and derivatives at `s`; the end pieces are continued.
    pub fn jet(&self, s: f64) -> RadiusJet {
        let q = &self.coefficients;
        match self.family {
            MeridianFamily::Free => {
                let basis = self.knots.basis(s / self.length);
                let sum = |order: usize| -> f64 {
                    (0..4).map(|i| basis.ders[order][i] * q[basis.first + i]).sum::<f64>()
                        / self.length.powi(order as i32)
                };
                RadiusJet { radius: sum(0), slope: sum(1), bend: sum(2) }
            }
            MeridianFamily::Cone => {
                let slope = (q[1] - q[0]) / self.length;
                RadiusJet { radius: q[0] + slope * s, slope, bend: 0.0 }
            }
            MeridianFamily::Cylinder => RadiusJet { radius: q[0], slope: 0.0, bend: 0.0 },
            MeridianFamily::Barrel => {
                let arc = self.arc(s);
                let slope = -(arc.along - arc.curvature * arc.offset) / arc.root;
                RadiusJet { radius: arc.radius, slope, bend: -arc.curvature * (1.0 - slope * slope) / arc.root }
            }
        }
    }

    /// The inscribed sphere of a circle through P = (length / 2, rho) with outward normal N = (-sin, cos) of the angle
    /// and curvature k there: with w = (s, 0) - P, D = sqrt(1 + 2 k N.w + k^2 w.w), r = -(2 N.w + k w.w) / (1 + D),
    /// smooth at k = 0.
    fn arc(&self, s: f64) -> ArcTerms {
        let &[rho, angle, curvature] = self.coefficients.as_slice() else { return ArcTerms::default() };
        let (sin, cos) = angle.sin_cos();
        let offset = -(s - self.length / 2.0);
        let (x, y) = (-offset, -rho);
        let (normal, square) = (-sin * x + cos * y, x * x + y * y);
        let root = (1.0 + 2.0 * curvature * normal + curvature * curvature * square).max(0.0).sqrt();
        let radius = -(2.0 * normal + curvature * square) / (1.0 + root);
        ArcTerms { rho, sin, cos, curvature, offset, normal, square, root, radius, along: -sin }
    }

    /// Derivatives by the coefficients at `s`; none where they are held.
    pub(super) fn by_coefficients(&self, s: f64) -> ByCoefficients {
        if self.held {
            return ByCoefficients { radius: vec![0.0; self.coefficients.len()], shape: None };
        }
        match self.family {
            MeridianFamily::Free => {
                let basis = self.knots.basis(s / self.length);
                let spread = |order: usize| {
                    let mut row = vec![0.0; self.coefficients.len()];
                    for i in 0..4 {
                        row[basis.first + i] = basis.ders[order][i] / self.length.powi(order as i32);
                    }
                    row
                };
                ByCoefficients { radius: spread(0), shape: Some((spread(1), spread(2))) }
            }
            MeridianFamily::Cone => {
                let share = s / self.length;
                let slopes = vec![-1.0 / self.length, 1.0 / self.length];
                ByCoefficients { radius: vec![1.0 - share, share], shape: Some((slopes, vec![0.0; 2])) }
            }
            MeridianFamily::Cylinder => ByCoefficients { radius: vec![1.0], shape: None },
            MeridianFamily::Barrel => ByCoefficients { radius: self.arc(s).by_coefficients(), shape: None },
        }
    }

    /// Equally spaced heights over the function's length, ends included.
    pub(super) fn stations(&self, count: usize) -> impl Iterator<Item = f64> + use<> {
        let length = self.length;
        (0..=count).map(move |i| length * i as f64 / count as f64)
    }

    /// The first place of `count` that shows no proper surface of revolution.
    pub fn first_invalid(&self, count: usize) -> Option<f64> {
        self.stations(count).find(|s| !self.jet(*s).is_valid())
    }
}

#[derive(Default)]
struct ArcTerms {
    rho: f64,
    sin: f64,
    cos: f64,
    curvature: f64,
    /// length / 2 - s.
    offset: f64,
    /// N.w.
    normal: f64,
    /// w.w.
    square: f64,
    root: f64,
    radius: f64,
    /// Derivative of N.w along s.
    along: f64,
}

impl ArcTerms {
    /// From r = -U / (1 + D): dr = -(dU + r dD) / (1 + D), and D dD = d(D^2) / 2.
    fn by_coefficients(&self) -> Vec<f64> {
        let (k, d) = (self.curvature, self.root.max(1e-12));
        let row = |normal: f64, square: f64, by_curvature: f64| {
            let top = 2.0 * normal + k * square + by_curvature * self.square;
            let root = (k * normal + 0.5 * k * k * square + by_curvature * (self.normal + k * self.square)) / d;
            -(top + self.radius * root) / (1.0 + self.root)
        };
        // w = (-offset, -rho): by rho, w moves by (0, -1); by the angle, N turns to (-cos, -sin).
        let turned = self.cos * self.offset + self.sin * self.rho;
        vec![row(-self.cos, 2.0 * self.rho, 0.0), row(turned, 0.0, 0.0), row(0.0, 0.0, 1.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(family: MeridianFamily) -> RadiusFunction {
        let start = RadiusFunction::constant(family, 5.0, 20.0, FREE_COEFFICIENTS).unwrap();
        let wobble: Vec<f64> = match family {
            MeridianFamily::Barrel => vec![5.0, 0.1, 0.02],
            _ => start.coefficients().iter().enumerate().map(|(i, r)| r + 0.1 * (i as f64 * 1.7).sin()).collect(),
        };
        start.with(&wobble)
    }

    const FAMILIES: [MeridianFamily; 4] =
        [MeridianFamily::Free, MeridianFamily::Cone, MeridianFamily::Cylinder, MeridianFamily::Barrel];

    #[test]
    fn derivatives_match_differences() {
        for family in FAMILIES {
            let function = sample(family);
            for s in [0.0, 3.1, 10.0, 19.0] {
                let step = 1e-5;
                let (low, here, high) = (function.jet(s - step), function.jet(s), function.jet(s + step));
                assert!((here.slope - (high.radius - low.radius) / (2.0 * step)).abs() < 1e-8, "{family:?} {s}");
                assert!((here.bend - (high.slope - low.slope) / (2.0 * step)).abs() < 1e-7, "{family:?} {s}");
                let by = function.by_coefficients(s);
                for i in 0..function.coefficients().len() {
                    let moved = |by: f64| {
                        let mut q = function.coefficients().to_vec();
                        q[i] += by;
                        function.with(&q).jet(s)
                    };
                    let (low, high) = (moved(-1e-6), moved(1e-6));
                    assert!((by.radius[i] - (high.radius - low.radius) / 2e-6).abs() < 1e-7, "{family:?} {s} {i}");
                    if let Some((slope, bend)) = &by.shape {
                        assert!((slope[i] - (high.slope - low.slope) / 2e-6).abs() < 1e-7);
                        assert!((bend[i] - (high.bend - low.bend) / 2e-6).abs() < 1e-7);
                    }
                }
            }
        }
    }

    #[test]
    fn a_barrel_is_touched_on_its_circle() {
        let function = sample(MeridianFamily::Barrel);
        let (rho, angle, k) = (5.0, 0.1_f64, 0.02);
        // Centre one radius behind the middle point along its normal.
        let centre = (10.0 + angle.sin() / k, rho - angle.cos() / k);
        for s in [0.0, 4.0, 10.0, 20.0] {
            let jet = function.jet(s);
            let contact = jet.contact(s);
            let distance = (contact.point.height - centre.0).hypot(contact.point.radius - centre.1);
            assert!((distance - 1.0 / k).abs() < 1e-9, "{s}: {distance}");
            assert!((jet.meridian_curvature() - k).abs() < 1e-9);
            assert!(jet.is_valid());
        }
    }

    #[test]
    fn swallowed_spheres_are_found() {
        let start = RadiusFunction::constant(MeridianFamily::Free, 5.0, 20.0, FREE_COEFFICIENTS).unwrap();
        assert!(start.first_invalid(100).is_none());
        let mut q = start.coefficients().to_vec();
        q[5] -= 2.0;
        assert!(start.with(&q).first_invalid(100).is_some());
    }
}
