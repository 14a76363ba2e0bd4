//! Which pass cut what, and how neighbouring strips meet. Uses `part`, `motion` and the other files of this module.

use super::deviation::PartDeviation;
use super::measured::{MeasuredSample, ray_of};
use super::motion_tree::{BlockMotion, Instant};
use super::sweep::Sweep;
use super::swept::Touch;
use crate::motion::pose::angle_between;
use crate::part::{DesignSurface, SurfaceSample};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Seam crossings measured at most; beyond that every k-th.
const MOST_CROSSINGS: usize = 2000;

/// Cosine of the angle between part and tool surface within which a tool lies along the part.
const ALONG: f64 = 0.5;

/// Halvings of a grid edge towards the seam that crosses it.
const HALVINGS: usize = 14;

/// Uninterrupted feed moves near the part: run 0 up to the first link, and so on.
#[derive(Clone, Debug)]
pub struct Runs {
    of_block: Vec<Option<u32>>,
}

impl Runs {
    /// Counts the runs of a motion; `links` says of each block whether it is a rapid or leads through free space.
    pub(super) fn of(links: &[bool]) -> Self {
        let (mut run, mut broken) = (0, false);
        let of_block = links.iter().enumerate().map(|(block, link)| {
            if *link {
                broken = true;
                return None;
            }
            if std::mem::take(&mut broken) && block > 0 {
                run += 1;
            }
            Some(run)
        });
        Self { of_block: of_block.collect() }
    }

    /// The run of a block; `None` for a link.
    pub fn of_block(&self, block: usize) -> Option<u32> {
        self.of_block.get(block).copied().flatten()
    }

    /// The run that cut a sample.
    pub fn owner(&self, sample: &MeasuredSample) -> Option<u32> {
        sample.touch.and_then(|t| self.of_block(t.when.block))
    }
}

/// How neighbouring strips meet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Seams {
    /// Runs that cut some of the part.
    pub strips: usize,
    /// Largest angle between the tool's tangent planes on either side of a seam, degrees; where a tool's end stands
    /// across the part there is a step, not a kink.
    pub kink_max_deg: f64,
    /// Mean over the crossings of the grid's edges with the seams, degrees.
    pub kink_mean_deg: f64,
    /// Largest step between the strips at a seam, along the part's normal, mm.
    pub gap_max: f64,
}

/// Finds and measures the seams.
pub(super) fn seams<M: BlockMotion>(
    surface: &DesignSurface,
    sweep: &Sweep<'_, M>,
    part: &PartDeviation,
    runs: &Runs,
) -> Seams {
    let owners: Vec<Option<u32>> = part.samples.iter().map(|s| runs.owner(s)).collect();
    let strips = owners.iter().flatten().collect::<BTreeSet<_>>().len();
    let mut crossings = Vec::new();
    for triangle in &part.triangles {
        for k in 0..3 {
            let (a, b) = (triangle[k] as usize, triangle[(k + 1) % 3] as usize);
            // Inner edges belong to two triangles, once in each direction.
            if a < b && owners[a].is_some() && owners[b].is_some() && owners[a] != owners[b] {
                crossings.push((triangle, k));
            }
        }
    }
    let stride = crossings.len().div_ceil(MOST_CROSSINGS).max(1);
    let picked: Vec<_> = crossings.into_iter().step_by(stride).collect();
    let measured: Vec<Option<(Option<f64>, f64)>> =
        picked.par_iter().map(|(triangle, k)| crossing(surface, sweep, part, runs, triangle, *k)).collect();
    let found: Vec<(Option<f64>, f64)> = measured.into_iter().flatten().collect();
    let kinks = || found.iter().filter_map(|f| f.0).map(f64::to_degrees);
    Seams {
        strips,
        kink_max_deg: kinks().fold(0.0, f64::max),
        kink_mean_deg: kinks().fold(0.0, |sum, kink| sum + kink) / kinks().count().max(1) as f64,
        gap_max: found.iter().map(|f| f.1).fold(0.0, f64::max),
    }
}

/// Kink, radians, where both tools lie along the part, and step, mm, where a seam crosses one edge of a triangle; none
/// where what lies beyond is not a strip.
fn crossing<M: BlockMotion>(
    surface: &DesignSurface,
    sweep: &Sweep<'_, M>,
    part: &PartDeviation,
    runs: &Runs,
    triangle: &[u32; 3],
    edge: usize,
) -> Option<(Option<f64>, f64)> {
    let corners = triangle.map(|v| &part.samples[v as usize].sample);
    let ends = [edge, (edge + 1) % 3].map(|k| part.samples[triangle[k] as usize]);
    let sample_at = |share: f64| {
        let mut weights = [0.0; 3];
        weights[edge] = 1.0 - share;
        weights[(edge + 1) % 3] = share;
        surface.between(corners, weights)
    };
    let [near, far] = followed(sweep, runs, sample_at, &ends).or_else(|| searched(sweep, runs, sample_at, &ends))?;
    let (a, b) = (near.touch?, far.touch?);
    let along = |found: &MeasuredSample, touch: &Touch| found.sample.normal.0.dot(&touch.tool_normal) < -ALONG;
    let kink = (along(&near, &a) && along(&far, &b)).then(|| angle_between(&a.tool_normal, &b.tool_normal));
    Some((kink, (a.depth - b.depth).abs()))
}

/// The samples on either side of a seam, by following only the two tools that cut the edge's ends to where the second
/// comes below the first; `None` where another pass cuts between them.
fn followed<M: BlockMotion>(
    sweep: &Sweep<'_, M>,
    runs: &Runs,
    sample_at: impl Fn(f64) -> SurfaceSample,
    ends: &[MeasuredSample; 2],
) -> Option<[MeasuredSample; 2]> {
    let (mut low, mut high) = (0.0, 1.0);
    let [mut first, mut second] = [ends[0].touch?.when, ends[1].touch?.when];
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        let ray = ray_of(&sample_at(middle));
        let (a, b) = (sweep.feed.near(&ray, first), sweep.feed.near(&ray, second));
        if b.is_some_and(|b| a.is_none_or(|a| b.depth < a.depth)) {
            high = middle;
        } else {
            low = middle;
        }
        first = a.map_or(first, |touch| touch.when);
        second = b.map_or(second, |touch| touch.when);
    }
    let look = |share: f64, hint: Instant, end: &MeasuredSample| {
        let sample = sample_at(share);
        let found = MeasuredSample { sample, touch: sweep.lowest(&ray_of(&sample), Some(hint), f64::INFINITY) };
        (runs.owner(&found) == runs.owner(end)).then_some(found)
    };
    Some([look(low, first, &ends[0])?, look(high, second, &ends[1])?])
}

/// The samples on either side of where the pass that cut the edge's start no longer is the lowest, by looking at all
/// passes; `None` where what lies beyond is not a strip.
fn searched<M: BlockMotion>(
    sweep: &Sweep<'_, M>,
    runs: &Runs,
    sample_at: impl Fn(f64) -> SurfaceSample,
    ends: &[MeasuredSample; 2],
) -> Option<[MeasuredSample; 2]> {
    let [mut near, mut far] = *ends;
    let owner = runs.owner(&near)?;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle: f64 = 0.5 * (low + high);
        let sample = sample_at(middle);
        let hint = near.touch.map(|t| t.when);
        let found = MeasuredSample { sample, touch: sweep.lowest(&ray_of(&sample), hint, f64::INFINITY) };
        if runs.owner(&found) == Some(owner) {
            (near, low) = (found, middle);
        } else {
            (far, high) = (found, middle);
        }
    }
    runs.owner(&far)?;
    Some([near, far])
}
