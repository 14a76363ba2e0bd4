//! Guaranteed bounds on overcut and undercut: proofs, cell by cell, that no place between samples exceeds them. Uses
//! `part` and the other files of this module.
//!
//! No overcut beyond a depth: over every stretch of time a plane that touches the tool keeps all rays of a cell clear of
//! it below that depth. No undercut beyond a height: at some instant one convex piece of the tool holds the cell's
//! corners, lifted by that height along the normals, deep enough to hold all between them. Where a proof fails the cell is
//! quartered; where quarters no longer help, more is allowed. What is clear of a whole group of cells is shown once.

use super::deviation::PartDeviation;
use super::fan::Fan;
use super::measured::{MeasuredSample, edges, ray_of};
use super::motion_tree::{BlockMotion, Instant};
use super::ray::NormalRay;
use super::record::ToleranceRecord;
use super::strips::Runs;
use super::sweep::{Sweep, along_curve};
use super::swept::{OpenStretch, SweptTool};
use crate::part::{Cell, Cells, DesignSurface};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

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
/// Where less than that, but more than this share of the resolution, is left up to what is allowed, that is tried first.
const LEAST: f64 = 0.1;
/// Cells that one thread looks at together, and into how many groups they are parted.
const GROUP: usize = 64;
const PARTS: usize = 4;
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
    /// Bounds no more than `resolution` above the largest sampled figures, and within the tolerance where they are, if the
    /// proofs go through.
    pub(super) fn bounds(&self, resolution: f64, tolerance: ToleranceRecord) -> Bounds {
        let cells = Cells::new(self.surface);
        let part = self.part;
        let overcut = part.worst_overcut.and_then(|m| m.deviation()).map_or(0.0, |d| -d);
        let undercut = match part.worst_undercut {
            Some(worst) => worst.deviation(),
            None => Some(0.0),
        };
        let rounding = self.sweep.feed.slack() + ROUNDING;
        let limits = |from: f64, allowed: f64| limits(from, resolution, allowed - rounding);
        let shown = |most: f64| most.is_finite().then_some(most + rounding);
        Bounds {
            overcut: shown(self.least_overcut(&cells, &limits(overcut, tolerance.overcut)).max(overcut)),
            undercut: undercut
                .and_then(|from| shown(self.least_undercut(&cells, &limits(from, tolerance.undercut)).max(from))),
        }
    }

    /// The cell of a triangle of the grid.
    fn cell(&self, cells: &Cells<'_>, triangle: &[u32; 3]) -> Cell {
        cells.cell(triangle.map(|v| self.part.samples[v as usize].sample))
    }

    /// The least of some rising limits below which no triangle is cut; infinite where none of them is shown for one.
    fn least_overcut(&self, cells: &Cells<'_>, limits: &[f64]) -> f64 {
        let triangles = &self.part.triangles;
        let first: Vec<NormalRay> =
            triangles.iter().map(|[a, ..]| ray_of(&self.part.samples[*a as usize].sample)).collect();
        let of_group = |group: &[usize]| {
            let group: Vec<Cell> = group.iter().map(|index| self.cell(cells, &triangles[*index])).collect();
            self.overcut_of(cells, &group, limits, [&[0], &[0]])
        };
        along_curve(&first).par_chunks(GROUP).map(of_group).reduce(|| 0.0, f64::max)
    }

    /// The same for some cells, where feed moves and rapids are known to be clear of them outside some nodes.
    fn overcut_of(&self, cells: &Cells<'_>, group: &[Cell], limits: &[f64], open: [&[u32]; 2]) -> f64 {
        if let [cell] = group {
            let shown = |limit: &f64| self.no_overcut(cells, cell, *limit, open);
            return limits.iter().copied().find(shown).unwrap_or(f64::INFINITY);
        }
        let goal = -limits.first().copied().unwrap_or_default();
        let fan = Fan::over(group);
        let left = |swept: &SweptTool<'_, M>, open: &[u32]| {
            let left = fan.as_ref().and_then(|fan| swept.open_to(fan, goal, usize::MAX, open));
            left.unwrap_or_else(|| open.to_vec())
        };
        let (feed, rapid) = (left(&self.sweep.feed, open[0]), left(&self.sweep.rapid, open[1]));
        let parts = group.chunks(group.len().div_ceil(PARTS).max(1));
        parts.map(|part| self.overcut_of(cells, part, limits, [&feed, &rapid])).fold(0.0, f64::max)
    }

    /// The least of some rising limits up to which every triangle is cut; infinite where none of them is shown for one.
    fn least_undercut(&self, cells: &Cells<'_>, limits: &[f64]) -> f64 {
        let nearby = self.cuts_nearby();
        let of_triangle = |triangle: &[u32; 3]| {
            let cell = self.cell(cells, triangle);
            let cuts = with_mean(triangle.map(|v| nearby[v as usize].as_slice()));
            let shown = |limit: &f64| self.no_undercut(cells, &cell, &cuts, *limit);
            limits.iter().copied().find(shown).unwrap_or(f64::INFINITY)
        };
        self.part.triangles.par_iter().map(of_triangle).reduce(|| 0.0, f64::max)
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

    /// Shows that no move, of those in some nodes of feed moves and rapids, reaches deeper than `limit` below any point of
    /// a cell.
    fn no_overcut(&self, cells: &Cells<'_>, cell: &Cell, limit: f64, [feed, rapid]: [&[u32]; 2]) -> bool {
        let clear = |swept: &SweptTool<'_, M>, nodes: &[u32]| {
            let open: Vec<OpenStretch> = nodes.iter().copied().map(OpenStretch::Node).collect();
            by_quarters(cells, *cell, open, &|cell, open: &Vec<OpenStretch>, _| {
                let stuck = swept.not_clear_of(&Fan::of(cell), -limit, open);
                if stuck.is_empty() { Shown::Yes } else { Shown::OfQuarters(stuck) }
            })
        };
        clear(&self.sweep.feed, feed) && clear(&self.sweep.rapid, rapid)
    }

    /// Shows that over every point of a cell some move comes down to `limit`.
    fn no_undercut(&self, cells: &Cells<'_>, cell: &Cell, cuts: &[Instant], limit: f64) -> bool {
        by_quarters(cells, *cell, cuts.to_vec(), &|cell, cuts: &Vec<Instant>, quarterings| {
            if self.covered(cell, cuts, limit) {
                return Shown::Yes;
            }
            let settled = self.settled(cell, cuts);
            if self.covered(cell, &settled, limit) {
                return Shown::Yes;
            }
            // Where known cuts come down to every corner, each to some, no other one is wanting: the cell is too large for
            // any, as where it lies across a seam.
            let known =
                if (1..QUARTERINGS).contains(&quarterings) { self.all_down(cell, &settled, limit) } else { None };
            if let Some(known) = known {
                let beside = self.covered(cell, &self.beside(&known, cell), limit);
                return if beside { Shown::Yes } else { Shown::OfQuarters(known) };
            }
            let cuts = self.deepest(cell, &settled);
            if self.covered(cell, &cuts, limit) || self.covered(cell, &self.beside(&cuts, cell), limit) {
                return Shown::Yes;
            }
            if cuts.is_empty() { Shown::Never } else { Shown::OfQuarters(cuts) }
        })
    }

    /// The instants at which the passes of some cuts are lowest over a cell's middle and corners; `None` unless one of them
    /// comes down to `limit` over each of these.
    fn all_down(&self, cell: &Cell, cuts: &[Instant], limit: f64) -> Option<Vec<Instant>> {
        let mut known = Vec::new();
        for ray in std::iter::once(Fan::of(cell).ray).chain(cell.corners.iter().map(ray_of)) {
            let touches = cuts.iter().filter_map(|when| self.sweep.feed.near(&ray, *when));
            let down: Vec<Instant> = touches.filter(|touch| touch.depth <= limit).map(|touch| touch.when).collect();
            if down.is_empty() {
                return None;
            }
            known.extend(down);
        }
        Some(distinct(known.into_iter()))
    }

    /// When the passes that cut nearby places at known times cut a cell's middle.
    fn settled(&self, cell: &Cell, nearby: &[Instant]) -> Vec<Instant> {
        let ray = Fan::of(cell).ray;
        distinct(nearby.iter().filter_map(|when| self.sweep.feed.near(&ray, *when)).map(|touch| touch.when))
    }

    /// When a cell's middle and corners are cut by whatever cuts them deepest; then other cuts of it. At a seam the deeper
    /// pass may end within the cell, where another one counts.
    fn deepest(&self, cell: &Cell, others: &[Instant]) -> Vec<Instant> {
        let rays = std::iter::once(Fan::of(cell).ray).chain(cell.corners.iter().map(ray_of));
        let deepest = rays.filter_map(|ray| self.sweep.lowest(&ray, others.first().copied(), f64::INFINITY));
        distinct(deepest.map(|touch| touch.when).chain(others.iter().copied()))
    }

    /// Instants a little before and after some cuts. Where the tool's end passes over a cell it cuts deepest with its rim,
    /// which holds nothing about the place; soon after, or before, the tool does, and hardly higher.
    fn beside(&self, cuts: &[Instant], cell: &Cell) -> Vec<Instant> {
        const WAYS: [f64; 6] = [3.0, -3.0, 12.0, -12.0, 48.0, -48.0];
        let ways = WAYS.map(|way| way * cell.radius());
        cuts.iter().flat_map(|cut| self.sweep.feed.farther_on(*cut, ways).into_iter().flatten()).collect()
    }

    /// True where the tool at one of some instants holds the whole cell, lifted by `limit`.
    fn covered(&self, cell: &Cell, cuts: &[Instant], limit: f64) -> bool {
        let rays = cell.corners.map(|corner| ray_of(&corner));
        // Normals of the cell and means of the corners' are each within the turn of the middle one.
        let margin = cell.bulge + 2.0 * cell.turn * limit;
        cuts.iter().any(|when| self.sweep.feed.holds_all(*when, &rays, limit, margin))
    }
}

/// Whether something is shown of a cell.
enum Shown<T> {
    Yes,
    /// Its quarters do not help.
    Never,
    /// It is where it is shown of all its quarters, by what is handed on to them.
    OfQuarters(T),
}

/// Whether `shown`, which is told how many times a cell has been quartered, holds of a cell, or of its quarters, theirs and so on, as many cells as may be spent on one. Threads
/// share the quarters: what is shown does not depend on their order, for all of them count.
fn by_quarters<T: Sync + Send>(
    cells: &Cells<'_>,
    cell: Cell,
    known: T,
    shown: &(impl Fn(&Cell, &T, u32) -> Shown<T> + Sync),
) -> bool {
    struct Proof<'p, 'c, F> {
        cells: &'p Cells<'c>,
        shown: &'p F,
        spent: AtomicUsize,
    }
    fn holds<T: Sync + Send, F: Fn(&Cell, &T, u32) -> Shown<T> + Sync>(
        proof: &Proof<'_, '_, F>,
        cell: &Cell,
        known: &T,
        quarterings: u32,
    ) -> bool {
        let spent = proof.spent.fetch_add(1, Ordering::Relaxed) + 1;
        if spent > MOST_CELLS {
            return false;
        }
        match (proof.shown)(cell, known, quarterings) {
            Shown::Yes => true,
            Shown::Never => false,
            Shown::OfQuarters(_) if quarterings == QUARTERINGS => false,
            Shown::OfQuarters(known) => {
                proof.cells.quarters(cell).par_iter().all(|quarter| holds(proof, quarter, &known, quarterings + 1))
            }
        }
    }
    holds(&Proof { cells, shown, spent: AtomicUsize::new(0) }, &cell, &known, 0)
}

/// Instants less than this apart, in blocks, are one cut.
const SAME_CUT: f64 = 1e-2;
/// Passes that may be needed to cover one cell: where seams meet.
const MOST_CUTS: usize = 6;

/// The first of some cuts, those left out that are one with an earlier one.
fn distinct(cuts: impl Iterator<Item = Instant>) -> Vec<Instant> {
    let mut kept: Vec<Instant> = Vec::new();
    for cut in cuts {
        if kept.len() < MOST_CUTS && !kept.iter().any(|known| (time(known) - time(&cut)).abs() < SAME_CUT) {
            kept.push(cut);
        }
    }
    kept
}

/// The limits to be tried, rising: what is allowed where that is a little above what was sampled, then the resolution
/// above that and more.
fn limits(from: f64, resolution: f64, allowed: f64) -> Vec<f64> {
    let within = Some(allowed).filter(|_| (LEAST..FIRST).contains(&((allowed - from) / resolution)));
    within.into_iter().chain((0..=DOUBLINGS).map(|k| from + FIRST * resolution * 2.0_f64.powi(k))).collect()
}

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
