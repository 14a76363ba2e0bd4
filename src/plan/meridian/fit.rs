//! Sweeps and the meridian of their tool as one least-squares problem.
//!
//! Unknowns: the control points of two rails a sweep, and the coefficients of the radius function that all sweeps
//! share (Bo 2016, section 4.5, where the radii along the axis are unknowns too). Only the rails' direction is used,
//! so the tool is rigid whatever they do. Residual: sphere distance |c - foot(c)| - r(s), signed (Rajain 2023, R19),
//! whose gradient by c is the foot's normal, and by the coefficients that of -r.

use super::problem::{Band, Sweep, Terms};
use super::radius::{RadiusFunction, RadiusJet};
use crate::geometry::knots::{Basis, Knots};
use crate::geometry::{Point, SplineCurve, Vector};
use crate::motion::RuledMotion;
use crate::optimize::{BorderedEquations, BorderedLeastSquares};
use crate::plan::chart::{Chart, ChartFoot};

/// Unknowns per control point index: three of the lower rail, three of the upper.
const BLOCK: usize = 6;
/// Stations at which the radius function is held inside its bounds.
const STATIONS: usize = 40;
/// 1 - r'^2 - r r'' that the fit keeps at least.
pub(super) const LEAST_VISIBILITY: f64 = 0.05;
/// Weight of samples past the continued surface, against those on it.
const BEYOND: f64 = 1e-3;
/// How much more firmly an end is held where part of the band would stay uncut, and at least against accuracy.
const FIRM: f64 = 300.0;
const HOLD: f64 = 3.0;
/// How far a sweep may run past the ends of its band, as a share of it: samples out there count for little, and a fit
/// that cannot do better would send them all there.
const LONGEST_OVERHANG: f64 = 0.3;
/// Least weight, against accuracy, of rails that stand apart as the flank is long: it only fixes which points of the axis
/// they carry, and keeps what the fit covers what the flank covers.
const GAUGE: f64 = 0.03;

/// What a sample showed at the last assembly.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampled {
    /// Signed deviation of the sphere, mm: positive is undercut.
    pub(super) deviation: f64,
    /// Foot inside the band.
    pub(super) inside: bool,
}

/// The problem.
pub(super) struct SweepFit<'a> {
    chart: &'a Chart<'a>,
    sweeps: &'a [Sweep],
    radius: RadiusFunction,
    /// Radius bounds, mm.
    bounds: (f64, f64),
    knots: Knots,
    times: Vec<f64>,
    shares: Vec<f64>,
    pub(super) terms: Terms,
    /// Weights per (sweep, time, share), mean 1: for outliers and for evening out.
    pub(super) sample_weights: Vec<f64>,
    /// Wanted deviation, mm.
    pub(super) target: f64,
    hints: Vec<(f64, f64)>,
    counted: Vec<bool>,
    /// Rails and coefficients that the proximity term holds to.
    anchor: Vec<f64>,
    /// Last deviations per (sweep, time, share).
    pub(super) samples: Vec<Sampled>,
}

struct Row {
    lower: Vector,
    upper: Vector,
    residual: f64,
    weight: f64,
}

/// One instant: rails and axis.
struct Instant {
    lower: Point,
    span: Vector,
    length: f64,
    axis: Vector,
}

impl<'a> SweepFit<'a> {
    /// Sets up `sweeps` over `chart` with `controls` control points a rail, looked at in as many instants as their
    /// starts have rulings and at `heights` places along the axis.
    pub(super) fn new(
        (chart, sweeps): (&'a Chart<'a>, &'a [Sweep]),
        (radius, bounds): (RadiusFunction, (f64, f64)),
        (controls, heights): (usize, usize),
        terms: Terms,
    ) -> Option<Self> {
        let instants = sweeps.first()?.rulings.len();
        let times = (0..instants).map(|j| j as f64 / (instants - 1) as f64).collect::<Vec<_>>();
        // Denser toward the ends, where polynomials err most.
        let shares: Vec<f64> =
            (0..heights).map(|k| 0.5 - 0.5 * (std::f64::consts::PI * k as f64 / (heights - 1) as f64).cos()).collect();
        let mut hints = Vec::new();
        for sweep in sweeps {
            for j in 0..instants {
                let (low, high) = sweep.feet[j];
                hints.extend(shares.iter().map(|f| (low.0 + f * (high.0 - low.0), low.1 + f * (high.1 - low.1))));
            }
        }
        let count = hints.len();
        let counted = sweeps
            .iter()
            .zip(hints.chunks(instants * heights))
            .flat_map(|(sweep, hints)| hints.iter().map(|place| sweep.band.holds(*place)))
            .collect();
        Some(Self {
            chart,
            sweeps,
            radius,
            bounds,
            knots: Knots::clamped_uniform(3, controls).ok()?,
            times,
            shares,
            terms,
            sample_weights: vec![1.0; count],
            target: 0.0,
            hints,
            counted,
            anchor: Vec::new(),
            samples: vec![Sampled { deviation: 0.0, inside: false }; count],
        })
    }

    /// Unknowns that pass as near as can be through the sweeps' rulings, with the radius function's coefficients.
    pub(super) fn start(&mut self) -> Option<Vec<f64>> {
        let mut equations = BorderedEquations::new(self.unknowns(), self.half_bandwidth(), 0);
        let zero = vec![0.0; self.unknowns()];
        for (index, sweep) in self.sweeps.iter().enumerate() {
            for (t, (a, b)) in self.times.iter().zip(&sweep.rulings) {
                let basis = self.knots.basis(*t);
                for c in 0..BLOCK {
                    let value = if c < 3 { a[c] } else { b[c - 3] };
                    let mut run = [0.0; BLOCK * 4];
                    for i in 0..4 {
                        run[i * BLOCK + c] = basis.ders[0][i];
                    }
                    equations.add(self.first(index, &basis), &run, &[], -value, 1.0);
                }
            }
        }
        self.add_fairness(&zero, &mut equations, 1e-6);
        let mut x = equations.solve()?;
        x.extend(self.radius.coefficients());
        self.anchor.clone_from(&x);
        Some(x)
    }

    /// Looks at every sample anew.
    pub(super) fn look(&mut self, x: &[f64]) -> Option<()> {
        let mut equations = BorderedEquations::new(self.unknowns(), self.half_bandwidth(), self.shared());
        self.assemble(x, &mut equations)
    }

    /// Lets samples that now lie over the band count in full, and holds the rails to where they are.
    pub(super) fn settle(&mut self, x: &[f64]) {
        for (counted, sample) in self.counted.iter_mut().zip(&self.samples) {
            *counted = sample.inside;
        }
        self.anchor = x.to_vec();
    }

    /// The surface that the sweeps are over.
    pub(super) fn chart(&self) -> &'a Chart<'a> {
        self.chart
    }

    /// What each sweep has to cover.
    pub(super) fn bands(&self) -> impl Iterator<Item = Band> {
        self.sweeps.iter().map(|sweep| sweep.band)
    }

    /// The radius function that unknowns stand for.
    pub(super) fn radius(&self, x: &[f64]) -> RadiusFunction {
        self.radius.with(&x[self.unknowns()..])
    }

    /// The motion of each sweep; the lower rail carries the sphere centre at s = 0.
    pub(super) fn motions(&self, x: &[f64]) -> Option<Vec<RuledMotion>> {
        let lowest = self.radius(x).jet(0.0);
        // The tip is where the lowest sphere touches: at s = -r r'.
        let lower_height = lowest.radius * lowest.slope;
        x[..self.unknowns()]
            .chunks(self.knots.controls() * BLOCK)
            .map(|x| {
                let rail = |offset: usize| {
                    let control = x.chunks(BLOCK).map(|c| Point::new(c[offset], c[offset + 1], c[offset + 2]));
                    SplineCurve::from_knots(self.knots.clone(), control.collect()).ok()
                };
                Some(RuledMotion { lower: rail(0)?, upper: rail(3)?, lower_height })
            })
            .collect()
    }

    /// First unknown of a sweep's run at a time.
    fn first(&self, sweep: usize, basis: &Basis) -> usize {
        (sweep * self.knots.controls() + basis.first) * BLOCK
    }

    fn add_fairness(&self, x: &[f64], equations: &mut BorderedEquations, weight: f64) {
        let controls = self.knots.controls();
        // Second differences shrink with the square of the spacing; this keeps the integral of |P''|^2 in proportion.
        let scaled = weight * (controls as f64).powi(3) / 400.0;
        for sweep in 0..self.sweeps.len() {
            for i in 0..controls.saturating_sub(2) {
                let first = (sweep * controls + i) * BLOCK;
                for c in 0..BLOCK {
                    let mut run = [0.0; BLOCK * 3];
                    run[c] = 1.0;
                    run[BLOCK + c] = -2.0;
                    run[2 * BLOCK + c] = 1.0;
                    let at = |k: usize| x[first + k * BLOCK + c];
                    equations.add(first, &run, &[], at(0) - 2.0 * at(1) + at(2), scaled);
                }
            }
        }
    }

    fn instant(&self, x: &[f64], sweep: usize, basis: &Basis) -> Option<Instant> {
        let first = self.first(sweep, basis);
        let mut sums = [0.0; BLOCK];
        for i in 0..4 {
            for (c, sum) in sums.iter_mut().enumerate() {
                *sum += basis.ders[0][i] * x[first + i * BLOCK + c];
            }
        }
        let lower = Point::new(sums[0], sums[1], sums[2]);
        let span = Point::new(sums[3], sums[4], sums[5]) - lower;
        let length = span.norm();
        (length > 1e-6 && length.is_finite()).then(|| Instant { lower, span, length, axis: span / length })
    }

    fn add_row(&self, first: usize, basis: &Basis, row: &Row, shared: &[f64], equations: &mut BorderedEquations) {
        let mut run = [0.0; BLOCK * 4];
        for i in 0..4 {
            let b = basis.ders[0][i];
            for c in 0..3 {
                run[i * BLOCK + c] = b * row.lower[c];
                run[i * BLOCK + 3 + c] = b * row.upper[c];
            }
        }
        equations.add(first, &run, shared, row.residual, row.weight);
    }

    /// Rows of one instant of one sweep.
    fn rows_at(
        &mut self,
        x: &[f64],
        (sweep, j): (usize, usize),
        radius: &RadiusFunction,
        equations: &mut BorderedEquations,
    ) -> Option<()> {
        let basis = self.knots.basis(self.times[j]);
        let first = self.first(sweep, &basis);
        let here = self.instant(x, sweep, &basis)?;
        let scale = 1.0 / self.samples.len() as f64;
        let heights = self.shares.len();
        for k in 0..heights {
            let f = self.shares[k];
            let index = (sweep * self.times.len() + j) * heights + k;
            let centre = here.lower + here.span * f;
            let foot = self.chart.foot(&centre, self.hints[index])?;
            self.hints[index] = foot.frame.place;
            let s = f * here.length;
            let RadiusJet { radius: r, slope, .. } = radius.jet(s);
            let deviation = foot.distance - r;
            let inside = self.sweeps[sweep].band.holds(foot.frame.place);
            self.samples[index] = Sampled { deviation, inside };
            let weight = match (self.counted[index], foot.frame.inside()) {
                (true, _) => 1.0,
                (false, true) => self.terms.extension,
                (false, false) => self.terms.extension * BEYOND,
            };
            let by: Vec<f64> = radius.by_coefficients(s).radius.iter().map(|value| -value).collect();
            let (n, d) = (foot.frame.normal, here.axis);
            let row = Row {
                lower: n * (1.0 - f) + d * (slope * f),
                upper: n * f - d * (slope * f),
                residual: deviation - self.target,
                weight: self.terms.accuracy * scale * weight * self.sample_weights[index],
            };
            self.add_row(first, &basis, &row, &by, equations);
            if k == 0 || k + 1 == heights {
                self.hold_end(x, (sweep, j), &basis, (&foot, k > 0), equations);
            }
        }
        let gauge = Row {
            lower: -here.axis,
            upper: here.axis,
            residual: here.length - radius.length(),
            weight: self.terms.rigidity.max(GAUGE * self.terms.accuracy) / self.times.len() as f64,
        };
        self.add_row(first, &basis, &gauge, &[], equations);
        Some(())
    }

    /// Holds an end of the axis near where it was, along the surface, and firmly outside the band it has to cover.
    fn hold_end(
        &self,
        x: &[f64],
        (sweep, j): (usize, usize),
        basis: &Basis,
        (foot, upper): (&ChartFoot, bool),
        equations: &mut BorderedEquations,
    ) {
        let first = self.first(sweep, basis);
        let instants = (self.times.len() * self.sweeps.len()) as f64;
        let loose = self.terms.proximity / instants;
        let firm = (loose.max(1e-6) * FIRM).max(HOLD * self.terms.accuracy / instants);
        let offset = if upper { 3 } else { 0 };
        let moved: Vector = (0..4)
            .map(|i| {
                let at = first + i * BLOCK + offset;
                let by = |c: usize| x[at + c] - self.anchor[at + c];
                Vector::new(by(0), by(1), by(2)) * basis.ders[0][i]
            })
            .sum();
        let band = &self.sweeps[sweep].band;
        let (g, h) = foot.frame.place;
        let last = j + 1 == self.times.len();
        // How far, in chart coordinates, the end still is from where it uncovers the band.
        let over_h = (band.start..=band.end).contains(&h);
        let across = if upper { (band.high - g).max(0.0) } else { (band.low - g).min(0.0) };
        let overhang = LONGEST_OVERHANG * (band.end - band.start);
        let least = if last { band.end } else { band.start - overhang };
        let most = if j == 0 { band.start } else { band.end + overhang };
        let along = (least - h).max(0.0) + (most - h).min(0.0);
        for (gauge, short) in
            [(foot.frame.across_gauge(), if over_h { across } else { 0.0 }), (foot.frame.along_gauge(), along)]
        {
            let Some((tangent, rate)) = gauge else { continue };
            let mut push = |residual: f64, weight: f64| {
                let (lower, upper) = if upper { (Vector::zeros(), tangent) } else { (tangent, Vector::zeros()) };
                self.add_row(first, basis, &Row { lower, upper, residual, weight }, &[], equations);
            };
            push(moved.dot(&tangent), loose);
            if short != 0.0 {
                push(-short / rate, firm);
            }
        }
    }

    /// Bounds on the radius, validity of the sphere family, and the gauge of its size.
    fn add_shape_rows(&self, radius: &RadiusFunction, equations: &mut BorderedEquations) {
        let weight = self.terms.shape / STATIONS as f64;
        for s in radius.stations(STATIONS) {
            let jet = radius.jet(s);
            let by = radius.by_coefficients(s);
            let outside = (jet.radius - self.bounds.0).min(0.0) + (jet.radius - self.bounds.1).max(0.0);
            if outside != 0.0 {
                equations.add(0, &[], &by.radius, outside, weight);
            }
            let Some((slope, bend)) = &by.shape else { continue };
            let hidden = jet.visibility() - LEAST_VISIBILITY;
            if hidden < 0.0 {
                let terms = by.radius.iter().zip(slope).zip(bend);
                let row: Vec<f64> =
                    terms.map(|((r, p), q)| -2.0 * jet.slope * p - jet.radius * q - jet.bend * r).collect();
                equations.add(0, &[], &row, hidden, weight);
            }
        }
        let first = self.unknowns();
        for (i, (value, anchor)) in radius.coefficients().iter().zip(&self.anchor[first..]).enumerate() {
            let mut row = vec![0.0; radius.coefficients().len()];
            row[i] = 1.0;
            equations.add(0, &[], &row, value - anchor, self.terms.size);
        }
    }
}

impl BorderedLeastSquares for SweepFit<'_> {
    fn unknowns(&self) -> usize {
        self.sweeps.len() * self.knots.controls() * BLOCK
    }

    fn half_bandwidth(&self) -> usize {
        4 * BLOCK - 1
    }

    fn shared(&self) -> usize {
        self.radius.coefficients().len()
    }

    fn assemble(&mut self, x: &[f64], equations: &mut BorderedEquations) -> Option<()> {
        let radius = self.radius(x);
        for sweep in 0..self.sweeps.len() {
            for j in 0..self.times.len() {
                self.rows_at(x, (sweep, j), &radius, equations)?;
            }
        }
        self.add_shape_rows(&radius, equations);
        self.add_fairness(x, equations, self.terms.fairness);
        Some(())
    }
}
