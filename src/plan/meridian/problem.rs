//! What a sweep has to cover, from where its search starts, and what counts how much.

use crate::geometry::Point;
use crate::motion::RuledMotion;
use crate::plan::chart::Chart;

/// The rectangle of chart coordinates that a sweep has to cover: g across, h along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Band {
    /// Lower border, g.
    pub(super) low: f64,
    /// Upper border, g.
    pub(super) high: f64,
    /// Where the cut begins, h.
    pub(super) start: f64,
    /// Where it ends, h.
    pub(super) end: f64,
}

impl Band {
    /// Everything but a margin all around.
    pub(super) fn inside(margin: f64) -> Self {
        Self { low: margin, high: 1.0 - margin, start: margin, end: 1.0 - margin }
    }

    /// `count` bands beside each other, equally wide.
    pub(super) fn divided(&self, count: usize) -> Vec<Self> {
        let at = |i: usize| self.low + (self.high - self.low) * i as f64 / count as f64;
        (0..count).map(|i| Self { low: at(i), high: at(i + 1), ..*self }).collect()
    }

    /// Its area in chart coordinates.
    pub(super) fn area(&self) -> f64 {
        (self.high - self.low) * (self.end - self.start)
    }

    /// Its halves both ways, and its quarters.
    pub(super) fn parts(&self) -> Vec<Self> {
        let (g, h) = (0.5 * (self.low + self.high), 0.5 * (self.start + self.end));
        let across = [Self { high: g, ..*self }, Self { low: g, ..*self }];
        let along = [Self { end: h, ..*self }, Self { start: h, ..*self }];
        let quarters = across.iter().flat_map(|half| [Self { end: h, ..*half }, Self { start: h, ..*half }]);
        across.iter().chain(&along).copied().chain(quarters).collect()
    }

    /// What `taken` leaves of it: full length on either side of it, then before and after it.
    pub(super) fn without(&self, taken: &Self) -> Vec<Self> {
        let rest = [
            Self { high: taken.low, ..*self },
            Self { low: taken.high, ..*self },
            Self { start: self.start, end: taken.start, ..*taken },
            Self { start: taken.end, end: self.end, ..*taken },
        ];
        let wide = |band: &Self| {
            let (across, along) = (band.high - band.low, band.end - band.start);
            across > SLIVER * (self.high - self.low) && along > SLIVER * (self.end - self.start)
        };
        rest.into_iter().filter(wide).collect()
    }

    /// A place as shares of this band.
    pub(super) fn share(&self, (g, h): (f64, f64)) -> (f64, f64) {
        ((g - self.low) / (self.high - self.low), (h - self.start) / (self.end - self.start))
    }

    /// True for places inside.
    pub(super) fn holds(&self, (g, h): (f64, f64)) -> bool {
        (self.low..=self.high).contains(&g) && (self.start..=self.end).contains(&h)
    }
}

/// Share of a band that is too narrow to be swept by itself.
const SLIVER: f64 = 0.01;

/// Weights of the terms; residuals are in mm. The defaults are those of Bo 2016 (section 4.5), whose rigidity term
/// became a gauge: here the tool is rigid by construction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeridianWeights {
    /// Distance between envelope and part.
    pub accuracy: f64,
    /// Distance of the rails.
    pub rigidity: f64,
    /// Second differences of the rails.
    pub fairness: f64,
    /// Distance of the rails' ends from where they were.
    pub proximity: f64,
}

impl Default for MeridianWeights {
    fn default() -> Self {
        Self { accuracy: 1.0, rigidity: 0.1, fairness: 0.001, proximity: 0.1 }
    }
}

/// Weight of samples beyond the band at the end: enough to settle how the sweep crosses the band's ends.
const LEAST_EXTENSION: f64 = 0.01;

/// The weights as one stage of the fit uses them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Terms {
    pub(super) accuracy: f64,
    pub(super) rigidity: f64,
    pub(super) fairness: f64,
    pub(super) proximity: f64,
    /// Samples beyond the band, against 1 inside.
    pub(super) extension: f64,
    /// Bounds and validity of the radius function.
    pub(super) shape: f64,
    /// Change of the radius coefficients since the stage began.
    pub(super) size: f64,
}

impl Terms {
    /// The user's weights with what only guides the search scaled by `guidance`.
    pub(super) fn new(weights: &MeridianWeights, guidance: f64) -> Self {
        Self {
            accuracy: weights.accuracy,
            rigidity: weights.rigidity * guidance,
            fairness: weights.fairness * guidance,
            proximity: weights.proximity * guidance,
            extension: (0.3 * guidance.sqrt()).max(LEAST_EXTENSION),
            shape: 10.0 * weights.accuracy,
            size: weights.proximity * guidance * 1e-3,
        }
    }
}

/// Where one sweep's search starts: a ruling and its feet at each of a number of equally spaced instants.
#[derive(Clone, Debug)]
pub(super) struct Sweep {
    pub(super) band: Band,
    /// Both ends of the axis, the one nearer the tip first, mm.
    pub(super) rulings: Vec<(Point, Point)>,
    /// Chart coordinates of their feet.
    pub(super) feet: Vec<((f64, f64), (f64, f64))>,
}

impl Sweep {
    /// Surface-driven start: rulings straight across the band in chart coordinates, their ends `radii` above it, each of
    /// the same length. `margin` is how far they run past the band's borders, `overrun` past its ends, mm.
    pub(super) fn across(
        chart: &Chart<'_>,
        band: Band,
        radii: (f64, f64),
        (margin, overrun): (f64, f64),
        instants: usize,
    ) -> Option<(Self, f64)> {
        let middle = chart.frame((0.5 * (band.low + band.high), 0.5 * (band.start + band.end)))?;
        let (by_g, by_h) = (margin / middle.across.norm(), overrun / middle.along.norm());
        let (low, high) = (band.low - by_g, band.high + by_g);
        let (start, end) = (band.start - by_h, band.end + by_h);
        let mut rulings: Vec<(Point, Point)> = Vec::with_capacity(instants);
        let mut feet = Vec::with_capacity(instants);
        for j in 0..instants {
            let h = start + (end - start) * j as f64 / (instants - 1) as f64;
            let (lower, upper) = (chart.frame((low, h))?, chart.frame((high, h))?);
            rulings.push((lower.point + lower.normal * radii.0, upper.point + upper.normal * radii.1));
            feet.push(((low, h), (high, h)));
        }
        let (least, length) = rulings
            .iter()
            .map(|(a, b)| (b - a).norm())
            .fold((f64::INFINITY, 0.0_f64), |(l, h), x| (l.min(x), h.max(x)));
        (least > 1e-6).then(|| (Self { band, rulings, feet }.stretched(length), length))
    }

    /// The same rulings, all of one length: each is stretched about its middle.
    pub(super) fn stretched(mut self, length: f64) -> Self {
        for (a, b) in &mut self.rulings {
            let (centre, half) = (nalgebra::center(a, b), (*b - *a).normalize() * (0.5 * length));
            (*a, *b) = (centre - half, centre + half);
        }
        self
    }

    /// Start from a motion found before.
    pub(super) fn along(chart: &Chart<'_>, motion: &RuledMotion, band: Band, instants: usize) -> Option<Self> {
        Self::during(chart, motion, motion.domain(), band, instants)
    }

    /// Start from as much of a motion found before as passes over `band`, and `overrun` mm more at both ends.
    pub(super) fn over(
        chart: &Chart<'_>,
        motion: &RuledMotion,
        band: Band,
        overrun: f64,
        instants: usize,
    ) -> Option<Self> {
        let whole = Self::along(chart, motion, band, 4 * instants)?;
        let middle = chart.frame((0.5 * (band.low + band.high), 0.5 * (band.start + band.end)))?;
        let by = overrun / middle.along.norm();
        let passes =
            |((_, a), (_, b)): &((f64, f64), (f64, f64))| a.max(*b) > band.start - by && a.min(*b) < band.end + by;
        let (first, last) = (whole.feet.iter().position(passes)?, whole.feet.iter().rposition(passes)?);
        let (start, end) = motion.domain();
        let at = |j: usize| start + (end - start) * j as f64 / (whole.feet.len() - 1) as f64;
        (last > first).then(|| Self::during(chart, motion, (at(first), at(last)), band, instants))?
    }

    fn during(
        chart: &Chart<'_>,
        motion: &RuledMotion,
        (first, last): (f64, f64),
        band: Band,
        instants: usize,
    ) -> Option<Self> {
        let mut rulings = Vec::with_capacity(instants);
        let mut feet = Vec::with_capacity(instants);
        let mut near = [(band.low, band.start), (band.high, band.start)];
        for j in 0..instants {
            let t = first + (last - first) * j as f64 / (instants - 1) as f64;
            let ends = [motion.lower.point(t), motion.upper.point(t)];
            near = [chart.foot(&ends[0], near[0])?.frame.place, chart.foot(&ends[1], near[1])?.frame.place];
            rulings.push((ends[0], ends[1]));
            feet.push((near[0], near[1]));
        }
        Some(Self { band, rulings, feet })
    }
}
