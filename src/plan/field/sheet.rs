//! The surface as the fields see it: stations on a grid over normalized parameters, with metric and bending.

use crate::geometry::knots::{Basis, Knots};
use crate::part::OrientedSpline;
use crate::plan::attainable::Bending;

/// Stations along each parameter.
const STATIONS: usize = 29;

/// One place of the surface. Derivatives are with respect to (s, t), the parameters normalized to 0..1.
#[derive(Clone, Copy, Debug)]
pub(in crate::plan) struct Station {
    /// Normalized parameters.
    pub(in crate::plan) place: (f64, f64),
    /// Frame of the tangent plane and second form in it.
    pub(in crate::plan) bending: Bending,
    /// E, F, G of the first form.
    metric: [f64; 3],
    /// Share of the surface's area.
    pub(in crate::plan) area: f64,
}

impl Station {
    /// Surface gradient, in the frame, of a function with derivatives (by s, by t), per mm.
    pub(in crate::plan) fn gradient(&self, (by_s, by_t): (f64, f64)) -> [f64; 2] {
        let [e, f, g] = self.metric;
        let root = e.sqrt();
        [by_s / root, (e * by_t - f * by_s) / (root * (e * g - f * f).sqrt())]
    }
}

/// Stations all over a surface.
#[derive(Clone, Debug)]
pub(in crate::plan) struct Sheet {
    /// Row by row, t running fastest.
    pub(in crate::plan) stations: Vec<Station>,
}

impl Sheet {
    /// `None` where the surface has no normal.
    pub(in crate::plan) fn new(spline: &OrientedSpline) -> Option<Self> {
        let [(u0, u1), (v0, v1)] = spline.surface().domain();
        let share = |i: usize| i as f64 / (STATIONS - 1) as f64;
        let mut stations = Vec::with_capacity(STATIONS * STATIONS);
        for i in 0..STATIONS {
            for j in 0..STATIONS {
                let place = (share(i), share(j));
                let jet = spline.surface().jet(u0 + place.0 * (u1 - u0), v0 + place.1 * (v1 - v0));
                let (by_s, by_t) = (jet.su * (u1 - u0), jet.sv * (v1 - v0));
                let metric = [by_s.norm_squared(), by_s.dot(&by_t), by_t.norm_squared()];
                // Trapezoidal rule: edges and corners stand for less.
                let weight = |k: usize| if k == 0 || k + 1 == STATIONS { 0.5 } else { 1.0 };
                let area = by_s.cross(&by_t).norm() * weight(i) * weight(j);
                stations.push(Station { place, bending: Bending::at(spline, &jet)?, metric, area });
            }
        }
        let total: f64 = stations.iter().map(|s| s.area).sum();
        for station in &mut stations {
            station.area /= total;
        }
        Some(Self { stations })
    }
}

/// A tensor-product spline basis over normalized parameters, tabulated nowhere: cheap enough to ask again.
#[derive(Clone, Debug)]
pub(in crate::plan) struct Net {
    knots: Knots,
}

/// The 16 functions of a [`Net`] that live at a place.
pub(in crate::plan) struct Local {
    s: Basis,
    t: Basis,
    side: usize,
}

impl Net {
    /// Cubic, with `side` functions along each parameter.
    pub(in crate::plan) fn new(side: usize) -> Option<Self> {
        Some(Self { knots: Knots::clamped_uniform(3, side).ok()? })
    }

    /// Knots along either parameter.
    pub(in crate::plan) fn knots(&self) -> &Knots {
        &self.knots
    }

    /// Functions along each parameter.
    pub(in crate::plan) fn side(&self) -> usize {
        self.knots.controls()
    }

    /// Number of functions.
    pub(in crate::plan) fn size(&self) -> usize {
        self.side() * self.side()
    }

    /// The functions at a place.
    pub(in crate::plan) fn at(&self, (s, t): (f64, f64)) -> Local {
        Local { s: self.knots.basis(s), t: self.knots.basis(t), side: self.side() }
    }
}

impl Local {
    /// Index, value, derivative by s, derivative by t of each function.
    pub(in crate::plan) fn functions(&self) -> impl Iterator<Item = (usize, [f64; 3])> + '_ {
        (0..4).flat_map(move |i| {
            (0..4).map(move |j| {
                let index = (self.s.first + i) * self.side + self.t.first + j;
                let (a, b) = ([self.s.ders[0][i], self.s.ders[1][i]], [self.t.ders[0][j], self.t.ders[1][j]]);
                (index, [a[0] * b[0], a[1] * b[0], a[0] * b[1]])
            })
        })
    }

    /// Value and derivatives of the spline with the given coefficients.
    pub(in crate::plan) fn value(&self, coefficients: &[f64]) -> [f64; 3] {
        self.functions().fold([0.0; 3], |sum, (index, value)| {
            let c = coefficients[index];
            [sum[0] + c * value[0], sum[1] + c * value[1], sum[2] + c * value[2]]
        })
    }
}
