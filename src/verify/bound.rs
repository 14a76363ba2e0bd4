//! Guaranteed bounds on overcut and undercut: proofs, cell by cell, that no place between samples exceeds them. Uses
//! `part` and the other files of this module.
//!
//! No overcut beyond a depth: over every stretch of time a plane that touches the tool keeps all rays of a cell clear of
//! it below that depth. No undercut beyond a height: at some instant one convex piece of the tool holds the cell's
//! corners, lifted by that height along the normals, deep enough to hold all between them. Where a proof fails the cell is
//! quartered; where quarters no longer help, more is allowed.

use super::deviation::PartDeviation;
use super::fan::Fan;
use super::measured::{MeasuredSample, edges, ray_of};
use super::motion_tree::{BlockMotion, Instant};
use super::strips::Runs;
use super::sweep::Sweep;
use super::swept::{OpenStretch, SweptTool};
use crate::part::{Cell, Cells, DesignSurface};
use rayon::prelude::*;

/// Upper bounds over the whole region, mm; `None` where nothing could be shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub(super) overcut: Option<f64>,
    pub(super) undercut: Option<f64>,
}

/// A cell is quartered so many times at most.
const QUARTERINGS: u32 = 8;
/// Cells that one triangle of the grid may be cut into before more is allowed.
const MOST_CELLS: usize = 4096;
/// This share of the resolution is added to what was sampled: the more room, the fewer cells. So many times it is doubled
/// where a proof fails.
const FIRST: f64 = 0.9;
const DOUBLINGS: i32 = 8;
/// Covers the rounding of the figures themselves, mm.
const ROUNDING: f64 = 1e-9;

/// What is left of the part, with what it was measured by.
pub(super) struct Region<'a, M> {
    pub(super) surface: &'a DesignSurface,
    pub(super) sweep: &'a Sweep<'a, M>,
    pub(super) part: &'a PartDeviation,
    pub(super) runs: &'a Runs,
}

impl<M: BlockMotion> Region<'_, M> {
    /// Bounds no more than `resolution` above the largest sampled figures, where the proofs go through.
    pub(super) fn bounds(&self, resolution: f64) -> Bounds {
        let cells = Cells::new(self.surface);
        let part = self.part;
        let overcut = part.worst_overcut.and_then(|m| m.deviation()).map_or(0.0, |d| -d);
        let undercut = match part.worst_undercut {
            Some(worst) => worst.deviation(),
            None => Some(0.0),
        };
        let nearby = self.cuts_nearby();
        let least = |from: f64, shown: &(dyn Fn(&Cell, &[Instant], f64) -> bool + Sync)| {
            let of_triangle = |corners: &[u32; 3]| {
                let cell = cells.cell(corners.map(|v| part.samples[v as usize].sample));
                let cuts = with_mean(corners.map(|v| nearby[v as usize].as_slice()));
                let step = |k: i32| from + FIRST * resolution * 2.0_f64.powi(k);
                (0..=DOUBLINGS).map(step).find(|limit| shown(&cell, &cuts, *limit)).unwrap_or(f64::INFINITY)
            };
            let most = part.triangles.par_iter().map(of_triangle).reduce(|| from, f64::max);
            most.is_finite().then_some(most + self.sweep.feed.slack() + ROUNDING)
        };
        Bounds {
            overcut: least(overcut, &|cell, _, limit| self.no_overcut(&cells, cell, limit)),
            undercut: undercut
                .and_then(|from| least(from, &|cell, cuts, limit| self.no_undercut(&cells, cell, cuts, limit))),
        }
    }

    /// For each sample of the grid when it is cut, then when places up to two edges away are, once for each other pass:
    /// the deeper pass may end between here and there.
    fn cuts_nearby(&self) -> Vec<Vec<Instant>> {
        const EDGES: usize = 2;
        let own = |m: &MeasuredSample| m.touch.map(|touch| touch.when).into_iter().collect();
        let mut cuts: Vec<Vec<Instant>> = self.part.samples.iter().map(own).collect();
        for _ in 0..EDGES {
            let before = cuts.clone();
            for (a, b) in self.part.triangles.iter().flat_map(edges) {
                for (to, from) in [(a, b), (b, a)] {
                    let mine = &mut cuts[to as usize];
                    for cut in &before[from as usize] {
                        let run = self.runs.of_block(cut.block);
                        if mine.len() < MOST_CUTS && !mine.iter().any(|own| self.runs.of_block(own.block) == run) {
                            mine.push(*cut);
                        }
                    }
                }
            }
        }
        cuts
    }

    /// Shows that no move reaches deeper than `limit` below any point of a cell.
    fn no_overcut(&self, cells: &Cells<'_>, cell: &Cell, limit: f64) -> bool {
        let all = || vec![OpenStretch::Node(0)];
        self.clear(&self.sweep.feed, cells, cell, limit, all())
            && self.clear(&self.sweep.rapid, cells, cell, limit, all())
    }

    fn clear(
        &self,
        swept: &SweptTool<'_, M>,
        cells: &Cells<'_>,
        cell: &Cell,
        limit: f64,
        open: Vec<OpenStretch>,
    ) -> bool {
        let mut stack = vec![(*cell, open, 0)];
        let mut spent = 0;
        while let Some((cell, open, quarterings)) = stack.pop() {
            spent += 1;
            let stuck = swept.not_clear_of(&Fan::of(&cell), -limit, open);
            if stuck.is_empty() {
                continue;
            }
            if quarterings == QUARTERINGS || spent > MOST_CELLS {
                return false;
            }
            stack.extend(cells.quarters(&cell).map(|quarter| (quarter, stuck.clone(), quarterings + 1)));
        }
        true
    }

    /// Shows that over every point of a cell some move comes down to `limit`.
    fn no_undercut(&self, cells: &Cells<'_>, cell: &Cell, cuts: &[Instant], limit: f64) -> bool {
        let mut stack = vec![(*cell, cuts.to_vec(), 0)];
        let mut spent = 0;
        while let Some((cell, cuts, quarterings)) = stack.pop() {
            spent += 1;
            if self.covered(&cell, &cuts, limit) {
                continue;
            }
            let cuts = self.cuts_of(&cell, &cuts);
            if self.covered(&cell, &cuts, limit) || self.covered(&cell, &self.beside(&cuts, &cell), limit) {
                continue;
            }
            if cuts.is_empty() || quarterings == QUARTERINGS || spent > MOST_CELLS {
                return false;
            }
            stack.extend(cells.quarters(&cell).map(|quarter| (quarter, cuts.clone(), quarterings + 1)));
        }
        true
    }

    /// When a cell is cut: its middle and corners by whatever cuts them deepest, and its middle by the passes that cut
    /// nearby places at known times. At a seam the deeper pass may end within the cell, where the other one counts.
    fn cuts_of(&self, cell: &Cell, nearby: &[Instant]) -> Vec<Instant> {
        let ray = Fan::of(cell).ray;
        let rays = std::iter::once(ray).chain(cell.corners.iter().map(ray_of));
        let deepest = rays.filter_map(|ray| self.sweep.lowest(&ray, nearby.first().copied(), f64::INFINITY));
        let others = nearby.iter().filter_map(|when| self.sweep.feed.near(&ray, *when));
        let mut cuts: Vec<Instant> = Vec::new();
        for touch in deepest.chain(others) {
            let same = |known: &Instant| (time(known) - time(&touch.when)).abs() < SAME_CUT;
            if cuts.len() < MOST_CUTS && !cuts.iter().any(same) {
                cuts.push(touch.when);
            }
        }
        cuts
    }

    /// Instants a little before and after some cuts. Where the tool's end passes over a cell it cuts deepest with its rim,
    /// which holds nothing about the place; soon after, or before, the tool does, and hardly higher.
    fn beside(&self, cuts: &[Instant], cell: &Cell) -> Vec<Instant> {
        const WAYS: [f64; 3] = [3.0, 12.0, 48.0];
        let ways = || WAYS.into_iter().flat_map(|way| [way, -way]).map(|way| way * cell.radius());
        cuts.iter().flat_map(|cut| ways().filter_map(|way| self.sweep.feed.farther_on(*cut, way))).collect()
    }

    /// True where the tool at one of some instants holds the whole cell, lifted by `limit`.
    fn covered(&self, cell: &Cell, cuts: &[Instant], limit: f64) -> bool {
        let rays = cell.corners.map(|corner| ray_of(&corner));
        // Normals of the cell and means of the corners' are each within the turn of the middle one.
        let margin = cell.bulge + 2.0 * cell.turn * limit;
        cuts.iter().any(|when| self.sweep.feed.holds_all(*when, &rays, limit, margin))
    }
}

/// Instants less than this apart, in blocks, are one cut.
const SAME_CUT: f64 = 1e-2;
/// Passes that may be needed to cover one cell: where seams meet.
const MOST_CUTS: usize = 6;

/// The time in blocks.
fn time(when: &Instant) -> f64 {
    when.block as f64 + when.share
}

/// The first cut of each corner and the mean of these in time, then one cut of every other pass.
fn with_mean(corners: [&[Instant]; 3]) -> Vec<Instant> {
    let own: Vec<Instant> = corners.iter().filter_map(|cuts| cuts.first()).copied().collect();
    let mean = own.iter().map(time).sum::<f64>() / own.len().max(1) as f64;
    let middle = (!own.is_empty()).then_some(Instant { block: mean as usize, share: mean.fract() });
    let others = corners.into_iter().flat_map(|cuts| cuts.iter().skip(1)).copied();
    middle.into_iter().chain(own.iter().copied()).chain(others).collect()
}
