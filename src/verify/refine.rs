//! The extremes of the deviation between the samples of a grid. Uses `part` and the other files of this module.
//!
//! Triangles are split at the middles of their sides, those first that may rise highest. How high is judged by how the
//! deviation bends at the scale of a triangle; a crease halves its bend with each split, a smooth surface quarters it,
//! so half is what is counted on.

use super::measured::{MeasuredSample, edges, measure_samples};
use super::motion_tree::{BlockMotion, Instant};
use super::sweep::Sweep;
use super::swept::Window;
use crate::geometry::{Point, Vector};
use crate::part::{DesignSurface, SampleGrid};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Which extreme is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// The deepest place below the surface.
    Overcut,
    /// The highest place above it.
    Undercut,
}

/// Part of a grid triangle, by its corners' weights in that triangle.
#[derive(Clone, Copy)]
struct Facet {
    triangle: usize,
    weights: [[f64; 3]; 3],
    values: [f64; 3],
    corners: [Corner; 3],
    /// How high the deviation may be somewhere in it, mm.
    potential: f64,
}

impl Facet {
    fn new(triangle: usize, weights: [[f64; 3]; 3], values: [f64; 3], corners: [Corner; 3], bump: f64) -> Self {
        Self { triangle, weights, values, corners, potential: potential(&values, &corners, bump) }
    }

    /// What a climber goes by: the highest corner, and the others a little, which tell the two sides of it apart.
    fn score(&self) -> f64 {
        highest(&self.values) + 0.1 * self.values.iter().sum::<f64>()
    }
}

fn highest(values: &[f64; 3]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// How high the deviation may be somewhere in a triangle with these corners: by `bump`, which is how far it bends, and by
/// how far each corner's tangent can rise. The lesser counts: where the deviation jumps it seems to bend without end,
/// where it is rough no tangent leads far.
fn potential(values: &[f64; 3], corners: &[Corner; 3], bump: f64) -> f64 {
    let tangent = |(value, from): (&f64, &Corner)| match from.rise {
        Some(rise) => corners.iter().map(|to| value + rise.dot(&(to.point - from.point))).fold(*value, f64::max),
        None => f64::INFINITY,
    };
    let reach = values.iter().zip(corners).map(tangent).fold(f64::NEG_INFINITY, f64::max);
    reach.min(highest(values) + 2.0 * bump)
}

/// A facet in a heap that gives what promises most first, of equals the earlier one.
struct Waiting {
    facet: Facet,
    number: usize,
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        self.facet.potential.total_cmp(&other.facet.potential).then(other.number.cmp(&self.number))
    }
}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Waiting {}

/// What is known at the corner of a facet.
#[derive(Clone, Copy)]
struct Corner {
    point: Point,
    /// How the value rises along the part, as the tangent plane of the tool does; `None` where no tool is or lies along.
    rise: Option<Vector>,
    /// When it is cut.
    when: Option<Instant>,
}

/// The search for one extreme.
pub(super) struct Refinement<'a, M> {
    surface: &'a DesignSurface,
    sweep: &'a Sweep<'a, M>,
    grid: &'a SampleGrid,
    side: Side,
    /// Deviation that counts for uncut samples, mm.
    uncut: f64,
    /// Value beyond which nothing is measured, mm.
    clamp: f64,
    samples: &'a [MeasuredSample],
    /// How far the deviation leaves the mean of its neighbours at each sample, mm.
    bumps: Vec<f64>,
    best: Option<MeasuredSample>,
    peak: f64,
    spent: usize,
}

/// Weights of the corners of a whole triangle.
const WHOLE: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// Triangles climbed in from the start.
const CLIMBERS: usize = 48;
/// Splits of a climb: a millimetre comes down to less than a tenth of a micrometre.
const CLIMB: usize = 14;
/// Facets that a climb keeps.
const BEAM: usize = 2;
/// The samples spent end at those of the grid by this.
const BUDGET: usize = 4;
/// Facets split at once in the sweep over all.
const BATCH: usize = 256;

impl<'a, M: BlockMotion> Refinement<'a, M> {
    pub(super) fn new(
        surface: &'a DesignSurface,
        sweep: &'a Sweep<'a, M>,
        window: Window,
        grid: &'a SampleGrid,
        samples: &'a [MeasuredSample],
        side: Side,
    ) -> Self {
        let (uncut, clamp) = match side {
            Side::Overcut => (-window.outward, window.inward),
            Side::Undercut => (window.outward, window.outward),
        };
        let (bumps, best, peak, spent) = (Vec::new(), None, f64::NEG_INFINITY, 0);
        let mut this = Self { surface, sweep, grid, side, uncut, clamp, samples, bumps, best, peak, spent };
        let values: Vec<f64> = samples.iter().map(|s| this.value(s)).collect();
        for sample in samples {
            this.consider(*sample);
        }
        this.bumps = self::bumps(grid, &values);
        this
    }

    /// Splits the facets that may rise above the highest value found until none may by more than `change`, or the
    /// samples spent exceed a share of those of the grid. Returns the extreme and the number of samples spent.
    pub(super) fn run(mut self, change: f64) -> (Option<MeasuredSample>, usize) {
        let promising = self.promising(self.peak + 0.1 * change);
        self.climb(&promising, change);
        let mut whole = promising.into_iter().peekable();
        let mut parts: BinaryHeap<Waiting> = BinaryHeap::new();
        let mut number = 0;
        let budget = (self.grid.samples.len() / BUDGET).max(4096);
        while self.spent < budget && self.peak < self.clamp {
            let floor = self.peak + change;
            let mut batch = Vec::with_capacity(BATCH);
            while batch.len() < BATCH {
                let next = whole.peek().map_or(f64::NEG_INFINITY, |(potential, _)| *potential);
                let part = parts.peek().map_or(f64::NEG_INFINITY, |waiting| waiting.facet.potential);
                if next.max(part) <= floor {
                    break;
                }
                let facet = if next >= part {
                    whole.next().map(|(_, triangle)| self.facet(triangle))
                } else {
                    parts.pop().map(|waiting| waiting.facet)
                };
                batch.extend(facet);
            }
            if batch.is_empty() {
                break;
            }
            for facet in self.split(&batch).into_iter().flatten() {
                number += 1;
                parts.push(Waiting { facet, number });
            }
        }
        (self.best, self.spent)
    }

    /// The triangles that promise more than `floor`, with what they promise, the most first.
    fn promising(&self, floor: f64) -> Vec<(f64, usize)> {
        // Overcut is not looked for next to uncut samples, where the deviation jumps: what no pass reaches fails anyway.
        let cut = |corners: &[u32; 3]| corners.iter().all(|v| self.samples[*v as usize].touch.is_some());
        let of = |(triangle, corners): (usize, &[u32; 3])| {
            cut(corners).then(|| (self.facet(triangle).potential, triangle)).filter(|(potential, _)| *potential > floor)
        };
        let mut found: Vec<(f64, usize)> = self.grid.triangles.par_iter().enumerate().filter_map(of).collect();
        found.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        found
    }

    /// A whole triangle of the grid.
    fn facet(&self, triangle: usize) -> Facet {
        let corners = self.grid.triangles[triangle].map(|v| v as usize);
        let samples = corners.map(|v| &self.samples[v]);
        let bump = corners.map(|v| self.bumps[v]).into_iter().fold(0.0, f64::max);
        let values = samples.map(|sample| self.value(sample));
        Facet::new(triangle, WHOLE, values, samples.map(|sample| self.side.corner(sample)), bump)
    }

    /// Goes straight up from the most promising triangles, so that the sweep over all has a high floor.
    fn climb(&mut self, promising: &[(f64, usize)], change: f64) {
        let first = promising.iter().take(CLIMBERS);
        let mut climbs: Vec<Vec<Facet>> = first.map(|(_, triangle)| vec![self.facet(*triangle)]).collect();
        for _ in 0..CLIMB {
            if self.peak >= self.clamp {
                return;
            }
            let floor = self.peak + 0.1 * change;
            climbs.iter_mut().for_each(|climb| climb.retain(|f| f.potential > floor));
            let batch: Vec<Facet> = climbs.concat();
            let mut children = self.split(&batch).into_iter();
            for climb in &mut climbs {
                let mut next: Vec<Facet> = children.by_ref().take(climb.len()).flatten().collect();
                next.sort_by(|a, b| b.score().total_cmp(&a.score()));
                next.truncate(BEAM);
                *climb = next;
            }
        }
    }

    fn value(&self, sample: &MeasuredSample) -> f64 {
        let sign = self.side.sign();
        sample.deviation().map_or(sign * self.uncut, |d| sign * d)
    }

    fn consider(&mut self, sample: MeasuredSample) {
        let value = self.value(&sample);
        if value > self.peak {
            self.peak = value;
            self.best = Some(sample);
        }
    }

    /// The four quarters of each facet.
    fn split(&mut self, batch: &[Facet]) -> Vec<[Facet; 4]> {
        let places = batch.iter().flat_map(|facet| {
            let corners = self.grid.triangles[facet.triangle].map(|v| &self.grid.samples[v as usize]);
            facet.middles().map(|weights| self.surface.between(corners, weights))
        });
        let hint = |index: usize| batch.get(index / 3).and_then(|facet| facet.corners[index % 3].when);
        let measured = measure_samples(self.sweep, places.collect(), hint);
        self.spent += measured.len();
        for sample in &measured {
            self.consider(*sample);
        }
        let found: Vec<(f64, Corner)> =
            measured.iter().map(|sample| (self.value(sample), self.side.corner(sample))).collect();
        let quarters = |(facet, found): (&Facet, &[(f64, Corner)])| facet.quarters([found[0], found[1], found[2]]);
        batch.iter().zip(found.chunks_exact(3)).map(quarters).collect()
    }
}

impl Facet {
    /// Weights of the middles of the sides.
    fn middles(&self) -> [[f64; 3]; 3] {
        let w = &self.weights;
        [(0, 1), (1, 2), (2, 0)].map(|(a, b)| std::array::from_fn(|i| 0.5 * (w[a][i] + w[b][i])))
    }

    /// The quarters, given values and corners in the middles of the sides.
    fn quarters(&self, found: [(f64, Corner); 3]) -> [Self; 4] {
        let (w, m, v, c) = (&self.weights, self.middles(), &self.values, &self.corners);
        let (mv, mc) = (found.map(|f| f.0), found.map(|f| f.1));
        let bend = |k: usize| (mv[k] - 0.5 * (v[k] + v[(k + 1) % 3])).abs();
        let bump = bend(0).max(bend(1)).max(bend(2));
        let triangle = self.triangle;
        let quarter = |weights, values, corners| Self::new(triangle, weights, values, corners, bump);
        [
            quarter([w[0], m[0], m[2]], [v[0], mv[0], mv[2]], [c[0], mc[0], mc[2]]),
            quarter([m[0], w[1], m[1]], [mv[0], v[1], mv[1]], [mc[0], c[1], mc[1]]),
            quarter([m[2], m[1], w[2]], [mv[2], mv[1], v[2]], [mc[2], mc[1], c[2]]),
            quarter(m, mv, mc),
        ]
    }
}

impl Side {
    /// The sign that makes the larger value the worse.
    fn sign(self) -> f64 {
        match self {
            Self::Overcut => -1.0,
            Self::Undercut => 1.0,
        }
    }

    fn corner(self, sample: &MeasuredSample) -> Corner {
        let (point, normal) = (sample.sample.point, sample.sample.normal.0.into_inner());
        let rise = sample.touch.and_then(|touch| {
            let facing = -touch.tool_normal.dot(&normal);
            let across = touch.tool_normal.into_inner() + normal * facing;
            (facing > 0.0).then(|| across * (self.sign() / facing))
        });
        Corner { point, rise, when: sample.touch.map(|touch| touch.when) }
    }
}

/// How far each value lies from the mean of its neighbours.
fn bumps(grid: &SampleGrid, values: &[f64]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0u32); values.len()];
    for triangle in &grid.triangles {
        for (a, b) in edges(triangle) {
            for (vertex, other) in [(a, b), (b, a)] {
                let sum = &mut sums[vertex as usize];
                sum.0 += values[other as usize];
                sum.1 += 1;
            }
        }
    }
    values.iter().zip(sums).map(|(v, (sum, n))| if n > 0 { (v - sum / f64::from(n)).abs() } else { 0.0 }).collect()
}
