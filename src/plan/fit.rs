//! One strip as a least-squares problem: the motion of a rigid tool, given by two spline rails, whose flank touches
//! the design surface everywhere between two lines g = const.
//!
//! Unknowns are the control points of both rails. The lower rail carries the sphere centre at `lower_height` of the
//! tool's sphere family and stays over the strip's lower border, the upper rail over its upper border; the tool is
//! rigid whatever the rails do, since only their direction is used (Rajain 2023, R3 and R4 by construction).
//! Residual: sphere distance |c - foot(c)| - r, signed (R19), whose exact gradient is the foot's normal.

use super::attainable::FlankLaw;
use super::chart::{Chart, ChartFoot};
use super::rails::{BLOCK, RUN, Rails, SECOND_DIFFERENCE};
use super::reach::AxisBound;
use crate::geometry::{Point, SurfacePlace, Vector};
use crate::optimize::{LeastSquares, NormalEquations};
use crate::tool::{Contact, Tool};

/// The tool as a family of spheres along its axis, tabulated over the flank and what stands above it.
#[derive(Clone, Debug)]
pub(super) struct SphereFamily {
    /// Sphere centre heights above the tip with radius, increasing, the flank only.
    flank: Vec<(f64, f64)>,
    /// Contact height of each entry of `flank`.
    contacts: Vec<f64>,
    /// Spheres of the flutes below the flank in use, and of their rounded or sharp end.
    below: Vec<(f64, f64)>,
    /// Heights and radii of shank and holder profile points, which must stay clear.
    body: Vec<(f64, f64)>,
    /// Directions that its axis must keep to.
    reach: Option<AxisBound>,
}

impl SphereFamily {
    /// Tabulates the flank of `tool` from contact height `from` upward.
    pub(super) fn new(tool: &Tool, from: f64) -> Option<Self> {
        let samples = 400;
        let top = tool.flute_length();
        let mut heights: Vec<f64> =
            (0..=samples).map(|i| from + (top - from) * f64::from(i) / f64::from(samples)).collect();
        heights.extend(tool.flutes().iter().map(|e| e.start().height).filter(|h| (from..top).contains(h)));
        heights.sort_by(f64::total_cmp);
        let contacts = heights.into_iter().filter_map(|height| tool.contact_at(height));
        let mut table: Vec<Contact> = contacts.filter(|c| c.normal_radial > 1e-3).collect();
        // Of a ball, which is one sphere, the flank begins where the next element does.
        table.dedup_by(|b, a| {
            let rise = b.sphere_height() - a.sphere_height();
            if rise.abs() < SAME_SPHERE {
                *a = *b;
            }
            rise < SAME_SPHERE
        });
        let flank: Vec<(f64, f64)> = table.iter().map(|c| (c.sphere_height(), c.sphere_radius())).collect();
        let below = (0..=FLUTES_BELOW)
            .filter_map(|i| tool.contact_at(from * i as f64 / FLUTES_BELOW as f64))
            .filter(|c| c.normal_radial > 1e-3)
            .map(|c| (c.sphere_height(), c.sphere_radius()))
            .collect();
        let body = tool
            .body()
            .filter(|(_, element)| element.end().height - element.start().height > 1e-9)
            .flat_map(|(_, element)| {
                let count = (element.length() / 6.0).ceil().clamp(1.0, 16.0) as usize;
                (0..=count).map(move |i| {
                    let contact = element.contact(i as f64 / count as f64);
                    (contact.sphere_height(), contact.sphere_radius())
                })
            })
            .collect();
        let contacts = table.iter().map(|c| c.point.height).collect();
        (flank.len() >= 2).then_some(Self { flank, contacts, below, body, reach: None })
    }

    /// The same tool, its axis bound to some directions.
    pub(super) fn within(self, reach: Option<AxisBound>) -> Self {
        Self { reach, ..self }
    }

    /// Directions that its axis must keep to.
    pub(super) fn bound(&self) -> Option<&AxisBound> {
        self.reach.as_ref()
    }

    /// Sphere centre height of the lowest flank point.
    pub(super) fn lowest(&self) -> f64 {
        self.flank[0].0
    }

    /// Sphere centre height of the highest flank point.
    pub(super) fn highest(&self) -> f64 {
        self.flank[self.flank.len() - 1].0
    }

    /// The flank as the law of attainable errors sees it.
    pub(super) fn law(&self) -> FlankLaw {
        let (low, high) = (self.lowest(), self.highest());
        let length = high - low;
        let [first, middle, last] = [low, 0.5 * (low + high), high].map(|s| self.radius(s).0);
        let slope = (last - first) / length;
        FlankLaw {
            reach: length * (1.0 - slope * slope).max(0.0).sqrt(),
            radius: middle,
            bend: 4.0 * (first + last - 2.0 * middle) / (length * length),
        }
    }

    /// Flutes below the flank in use: (height, radius).
    pub(super) fn below(&self) -> &[(f64, f64)] {
        &self.below
    }

    /// Shank and holder points: (height, radius).
    pub(super) fn body(&self) -> &[(f64, f64)] {
        &self.body
    }

    /// Height above the tip at which the sphere centred at height `s` touches the flank.
    pub(super) fn contact_height(&self, s: f64) -> f64 {
        let last = self.flank.len() - 2;
        let index = self.flank.partition_point(|p| p.0 <= s).saturating_sub(1).min(last);
        let (s0, s1) = (self.flank[index].0, self.flank[index + 1].0);
        let (h0, h1) = (self.contacts[index], self.contacts[index + 1]);
        (h0 + (s - s0) / (s1 - s0) * (h1 - h0)).clamp(self.contacts[0], self.contacts[last + 1])
    }

    /// Radius and its derivative at sphere centre height `s`; the flank's end pieces are continued.
    pub(super) fn radius(&self, s: f64) -> (f64, f64) {
        let last = self.flank.len() - 2;
        let index = self.flank.partition_point(|p| p.0 <= s).saturating_sub(1).min(last);
        let ((s0, r0), (s1, r1)) = (self.flank[index], self.flank[index + 1]);
        let slope = (r1 - r0) / (s1 - s0);
        (r0 + slope * (s - s0), slope)
    }
}

/// Weights of the terms; all residuals are in mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct FitWeights {
    /// Samples on the surface's extension, against 1 on the surface.
    pub(super) extension: f64,
    /// Rails over their borders and at their times.
    pub(super) anchor: f64,
    /// The same where a rail would leave part of the band uncut.
    pub(super) firm: f64,
    /// Second differences of the control points.
    pub(super) fairness: f64,
    /// Gouging by parts of the tool outside the strip.
    pub(super) clearance: f64,
}

/// One strip's borders and sampling.
#[derive(Clone, Debug)]
pub(super) struct StripSpec {
    /// g of the lower border, margins included.
    pub(super) low: f64,
    /// g of the upper border, margins included.
    pub(super) high: f64,
    /// Wanted h of the lower rail's foot at each time sample.
    pub(super) lower_time: Vec<f64>,
    /// Wanted h of the upper rail's foot at each time sample.
    pub(super) upper_time: Vec<f64>,
}

/// The least-squares problem of one strip.
pub(super) struct StripFit<'a> {
    chart: &'a Chart<'a>,
    family: &'a SphereFamily,
    spec: &'a StripSpec,
    rails: Rails,
    /// Time samples, each with its basis.
    times: Vec<f64>,
    /// Shares of the engaged flank, 0 at the lower rail.
    shares: Vec<f64>,
    /// Weights of the terms.
    pub(super) weights: FitWeights,
    /// Last known feet per (time, share), then per (time, outside point).
    hints: Vec<SurfacePlace>,
    /// Samples that count in full, fixed while a minimization runs so that its cost stays smooth.
    counted: Vec<bool>,
    /// Whether each (time, share) lay over the surface at the last assembly.
    inside: Vec<bool>,
}

struct Row {
    time: usize,
    lower: Vector,
    upper: Vector,
    residual: f64,
    weight: f64,
}

impl<'a> StripFit<'a> {
    /// Sets up a strip with `controls` control points a rail.
    pub(super) fn new(
        chart: &'a Chart<'a>,
        family: &'a SphereFamily,
        spec: &'a StripSpec,
        controls: usize,
        heights: usize,
        weights: FitWeights,
    ) -> Option<Self> {
        let rails = Rails::new(controls, family.lowest())?;
        let count = spec.lower_time.len();
        let times: Vec<f64> = (0..count).map(|j| j as f64 / (count - 1) as f64).collect();
        // Chebyshev-like spacing: minimax needs samples near both ends of the flank.
        let shares: Vec<f64> =
            (0..heights).map(|k| 0.5 - 0.5 * (std::f64::consts::PI * k as f64 / (heights - 1) as f64).cos()).collect();
        let mut hints = Vec::with_capacity(count * heights);
        for j in 0..count {
            hints.extend(shares.iter().map(|f| {
                (spec.low + f * (spec.high - spec.low), spec.lower_time[j] * (1.0 - f) + spec.upper_time[j] * f)
            }));
        }
        hints.extend((0..count * outside_points(family)).map(|i| {
            let j = i / outside_points(family);
            (spec.high, spec.upper_time[j])
        }));
        Some(Self {
            inside: vec![false; count * heights],
            counted: hints
                .iter()
                .take(count * heights)
                .map(|at| chart.frame(*at).is_some_and(|f| f.inside()))
                .collect(),
            hints: hints.into_iter().map(|at| chart.seat(at)).collect(),
            chart,
            family,
            spec,
            rails,
            times,
            shares,
            weights,
        })
    }

    /// Lets the samples that now lie over the surface count in full, the others as its extension.
    pub(super) fn recount(&mut self) {
        self.counted.clone_from(&self.inside);
    }

    /// Rails that pass as near as can be through one ruling per time sample.
    pub(super) fn start(&self, rulings: &[(Point, Point)]) -> Option<Vec<f64>> {
        let mut equations = NormalEquations::new(self.unknowns(), self.half_bandwidth());
        for (t, (a, b)) in self.times.iter().zip(rulings) {
            for c in 0..3 {
                let unit = Vector::ith(c, 1.0);
                for (value, lower, upper) in [(a[c], unit, Vector::zeros()), (b[c], Vector::zeros(), unit)] {
                    let (first, run) = self.rails.gradient(*t, &lower, &upper);
                    equations.add(first, &run, -value, 1.0);
                }
            }
        }
        self.add_fairness(&vec![0.0; self.unknowns()], &mut equations, 1e-6);
        let mut x: Vec<f64> = equations.gradient.iter().map(|g| -g).collect();
        equations.matrix.factor()?.solve(&mut x);
        Some(x)
    }

    /// The layout of the unknowns.
    pub(super) fn rails(&self) -> &Rails {
        &self.rails
    }

    fn add_fairness(&self, x: &[f64], equations: &mut NormalEquations, weight: f64) {
        let controls = self.rails.controls();
        // Second differences shrink with the square of the spacing; this keeps the integral of |P''|^2 in proportion.
        let scaled = weight * (controls as f64).powi(3) / 400.0;
        let mut run = [0.0; BLOCK * 2 + 1];
        for (k, coefficient) in SECOND_DIFFERENCE.iter().enumerate() {
            run[k * BLOCK] = *coefficient;
        }
        for (first, value) in self.rails.second_differences(x) {
            equations.add(first, &run, value, scaled);
        }
    }

    fn add_row(&self, row: &Row, equations: &mut NormalEquations) {
        let (first, run) = self.rails.gradient(self.times[row.time], &row.lower, &row.upper);
        equations.add(first, &run, row.residual, row.weight);
    }

    /// Rows of one time sample: engaged flank, borders, and the rest of the tool.
    fn rows_at(&mut self, x: &[f64], j: usize, rows: &mut Vec<Row>) -> Option<()> {
        let (a, b) = self.rails.points(x, self.times[j]);
        let span = b - a;
        let length = span.norm();
        if length <= 1e-6 || !length.is_finite() {
            return None;
        }
        let d = span / length;
        let scale = 1.0 / (self.times.len() * self.shares.len()) as f64;
        let longest = self.family.highest() - self.rails.lower_height;
        if length > longest {
            // Beyond the end of the flank nothing is cut.
            let weight = REACH * scale;
            rows.push(Row { time: j, lower: -d, upper: d, residual: length - longest, weight });
        }
        if let Some((by, out)) = self.family.bound().and_then(|bound| bound.pull(&d)) {
            // In mm at the flank's end: the axis turns by what its ends move apart across it, over its length.
            let weight = BOUND * scale;
            rows.push(Row { time: j, lower: -out, upper: out, residual: by * length, weight });
        }
        for (k, f) in self.shares.clone().into_iter().enumerate() {
            let index = j * self.shares.len() + k;
            let centre = a + span * f;
            let foot = self.chart.foot_from(&centre, &self.hints[index])?;
            self.hints[index] = foot.at;
            let (radius, slope) = self.family.radius(self.rails.lower_height + f * length);
            let deviation = foot.distance - radius;
            self.inside[index] = foot.frame.inside();
            let n = foot.frame.normal;
            let weight = if self.counted[index] { 1.0 } else { self.weights.extension };
            rows.push(Row {
                time: j,
                lower: n * (1.0 - f) + d * (slope * f),
                upper: n * f - d * (slope * f),
                residual: deviation,
                weight: scale * weight,
            });
            if k == 0 {
                self.anchor(j, &foot, self.spec.low, self.spec.lower_time[j], false, rows);
            } else if k + 1 == self.shares.len() {
                self.anchor(j, &foot, self.spec.high, self.spec.upper_time[j], true, rows);
            }
        }
        match j % CLEARANCE_STRIDE {
            0 => self.clearance_rows(j, &a, &d, length, rows),
            _ => Some(()),
        }
    }

    /// Keeps a rail's foot near its border and its time; firmly where it would otherwise leave part of the band uncut.
    fn anchor(&self, j: usize, foot: &ChartFoot, g: f64, h: f64, upper: bool, rows: &mut Vec<Row>) {
        let (g_off, h_off) = (foot.frame.place.0 - g, foot.frame.place.1 - h);
        let inside_band = if upper { g_off < 0.0 } else { g_off > 0.0 };
        let inside_time = j == 0 && h_off > 0.0 || j + 1 == self.times.len() && h_off < 0.0;
        let mut push = |gauge: Option<(Vector, f64)>, off: f64, weight: f64| {
            let Some((tangent, rate)) = gauge else { return };
            let (lower, upper) = if upper { (Vector::zeros(), tangent) } else { (tangent, Vector::zeros()) };
            rows.push(Row { time: j, lower, upper, residual: off / rate, weight });
        };
        let count = self.times.len() as f64;
        let weight = |firm: bool| if firm { self.weights.firm / count } else { self.weights.anchor / count };
        push(foot.frame.across_gauge(), g_off, weight(inside_band));
        push(foot.frame.along_gauge(), h_off, 0.1 * weight(inside_time));
    }

    /// One-sided rows: flutes above and below the strip, shank and holder must not gouge the surface.
    fn clearance_rows(&mut self, j: usize, a: &Point, d: &Vector, length: f64, rows: &mut Vec<Row>) -> Option<()> {
        let scale = self.weights.clearance / (self.times.len() * self.shares.len()) as f64;
        let first = self.times.len() * self.shares.len() + j * outside_points(self.family);
        let upper_height = self.rails.lower_height + length;
        let above = (self.family.highest() - upper_height).max(0.0);
        let flutes_above = (1..=FLUTES_ABOVE).map(|i| {
            let height = upper_height + above * i as f64 / FLUTES_ABOVE as f64;
            (height, self.family.radius(height).0)
        });
        let flutes_below = self.family.below.iter().copied();
        let points: Vec<(f64, f64)> =
            flutes_above.chain(flutes_below).chain(self.family.body().iter().copied()).collect();
        let beside = FLUTES_ABOVE + self.family.below.len();
        for (i, (height, radius)) in points.into_iter().enumerate() {
            let f = (height - self.rails.lower_height) / length;
            if (0.0..1.0).contains(&f) {
                continue;
            }
            let centre = a + d * (height - self.rails.lower_height);
            let mut foot = self.chart.foot_from(&centre, &self.hints[first + i])?;
            self.hints[first + i] = foot.at;
            let (deviation, margin) = if i < beside {
                (foot.distance - radius, BESIDE_MARGIN)
            } else {
                foot = side_foot(self.chart, &centre, d, radius, &foot)?;
                (foot.distance, BODY_MARGIN)
            };
            if deviation >= 0.0 || !foot.frame.within(margin) {
                continue;
            }
            // c = a + beta d at fixed beta, so only the turn of d counts: its part along d drops out.
            let n = foot.frame.normal;
            let turned = (n - d * n.dot(d)) * f;
            rows.push(Row { time: j, lower: n - turned, upper: turned, residual: deviation, weight: scale });
        }
        Some(())
    }
}

/// Height, mm, between the centres of spheres that count as one.
const SAME_SPHERE: f64 = 1e-9;
/// Weight of rails that lie farther apart than the flank reaches, against 1 for a deviation.
const REACH: f64 = 300.0;
/// Weight of axes that the machine does not make: no deviation is worth them.
const BOUND: f64 = 3e3;
/// The rest of the tool is looked at every so many instants: it must only stay clear.
const CLEARANCE_STRIDE: usize = 3;
/// The foot of the point of a cylinder of `radius` about the axis `d` that is nearest the part, seen from its centre's
/// foot: shank and holder end abruptly, so their spheres would reach past their ends.
pub(super) fn side_foot(
    chart: &Chart<'_>,
    centre: &Point,
    d: &Vector,
    radius: f64,
    foot: &ChartFoot,
) -> Option<ChartFoot> {
    if foot.distance > radius {
        // The whole sphere is clear; and far from the part another descent could end at another foot.
        return Some(ChartFoot { distance: foot.distance - radius, ..*foot });
    }
    let toward = -(foot.frame.normal - d * foot.frame.normal.dot(d)).normalize();
    chart.foot_from(&(centre + toward * radius), &foot.at)
}

/// How far beyond the surface, in chart coordinates, flutes beside the strip must stay clear of its extension: the
/// deepest gouge is often at the border, between two samples.
pub(super) const BESIDE_MARGIN: f64 = 0.03;
/// The same for shank and holder, whose samples lie farther apart.
pub(super) const BODY_MARGIN: f64 = 0.05;
/// Spans sampled on the flutes below the flank in use.
const FLUTES_BELOW: usize = 3;
/// Points sampled on the flutes above the strip.
const FLUTES_ABOVE: usize = 8;

fn outside_points(family: &SphereFamily) -> usize {
    FLUTES_ABOVE + family.below.len() + family.body().len()
}

impl LeastSquares for StripFit<'_> {
    fn unknowns(&self) -> usize {
        self.rails.unknowns()
    }

    fn half_bandwidth(&self) -> usize {
        RUN - 1
    }

    fn assemble(&mut self, x: &[f64], equations: &mut NormalEquations) -> Option<()> {
        let mut rows = Vec::new();
        for j in 0..self.times.len() {
            rows.clear();
            self.rows_at(x, j, &mut rows)?;
            for row in &rows {
                self.add_row(row, equations);
            }
        }
        self.add_fairness(x, equations, self.weights.fairness);
        Some(())
    }
}
