//! Where the part leaves its tolerance, told by the lines of the program: stretches of blocks that cut too deep or leave
//! too much, each with the block at which it begins. Uses `part` and the other files of this module.

use super::deviation::PartDeviation;
use super::measured::{MeasuredSample, ray_of};
use super::motion_tree::{BlockMotion, Instant};
use super::strips::Runs;
use super::sweep::Sweep;
use super::swept::Touch;
use crate::part::DesignSurface;

/// Blocks between two bad places that still are one stretch.
const GAP: usize = 3;
/// Earliest bad samples from which the beginning of a stretch is looked for.
const EARLIEST: usize = 24;
/// Halvings of a grid edge towards the place where a stretch begins.
const HALVINGS: usize = 12;
/// Share of a block within which a touch counts as its end.
const END: f64 = 1e-3;

/// Which way the part leaves its tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// Too deep.
    Overcut,
    /// Too high.
    Undercut,
}

/// Blocks that follow each other and are at fault.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    /// The first of them.
    pub(super) first: usize,
    /// The last.
    pub(super) last: usize,
    /// The worst place.
    pub(super) worst: MeasuredSample,
}

/// What faults are looked for in.
pub(super) struct Faults<'a, M> {
    pub(super) surface: &'a DesignSurface,
    pub(super) sweep: &'a Sweep<'a, M>,
    pub(super) part: &'a PartDeviation,
    pub(super) runs: &'a Runs,
}

impl Fault {
    /// How far a deviation is beyond what is allowed, mm.
    fn beyond(self, deviation: f64, allowed: f64) -> f64 {
        match self {
            Self::Overcut => -deviation - allowed,
            Self::Undercut => deviation - allowed,
        }
    }
}

impl<M: BlockMotion> Faults<'_, M> {
    /// The stretches in which the part is beyond what is `allowed`, mm, in the order of the program.
    pub(super) fn stretches(&self, fault: Fault, allowed: f64) -> Vec<Stretch> {
        let beyond = |sample: &MeasuredSample| sample.deviation().map_or(0.0, |d| fault.beyond(d, allowed));
        let worst = match fault {
            Fault::Overcut => self.part.worst_overcut,
            Fault::Undercut => self.part.worst_undercut,
        };
        let mut bad: Vec<(Instant, MeasuredSample)> = self
            .part
            .samples
            .iter()
            .chain(&worst)
            .filter(|sample| beyond(sample) > 0.0)
            .filter_map(|sample| Some((self.blamed(fault, &sample.touch?), *sample)))
            .collect();
        bad.sort_by(|(a, _), (b, _)| a.block.cmp(&b.block).then(a.share.total_cmp(&b.share)));
        let one = |(a, _): &(Instant, MeasuredSample), (b, _): &(Instant, MeasuredSample)| {
            b.block - a.block <= GAP && self.runs.of_block(a.block) == self.runs.of_block(b.block)
        };
        let stretch = |bad: &[(Instant, MeasuredSample)]| {
            let (first, last) = (bad.first()?.0, bad.last()?.0);
            let worst =
                bad.iter().map(|(_, sample)| *sample).reduce(|a, b| if beyond(&b) > beyond(&a) { b } else { a });
            let begin = self.beginning(fault, allowed, first);
            Some(Stretch { first: begin.min(first.block), last: last.block, worst: worst? })
        };
        bad.chunk_by(one).filter_map(stretch).collect()
    }

    /// The moment to blame for a touch: what is left where a block ends is left by the next one, which goes away.
    fn blamed(&self, fault: Fault, touch: &Touch) -> Instant {
        let Instant { block, share } = touch.when;
        let goes_on = self.runs.of_block(block).is_some() && self.runs.of_block(block) == self.runs.of_block(block + 1);
        match fault {
            Fault::Undercut if share > 1.0 - END && goes_on => Instant { block: block + 1, share: 0.0 },
            _ => Instant { block, share },
        }
    }

    /// The first block at fault before or at the moment of the earliest bad sample: on the edges of the grid from the
    /// samples touched then to good ones, the place is looked for at which the fault begins.
    fn beginning(&self, fault: Fault, allowed: f64, first: Instant) -> usize {
        let bad = |sample: &MeasuredSample| sample.deviation().is_some_and(|d| fault.beyond(d, allowed) > 0.0);
        let early = |sample: &MeasuredSample| {
            bad(sample) && sample.touch.is_some_and(|touch| self.blamed(fault, &touch).block == first.block)
        };
        let corner = |vertex: u32| self.part.samples.get(vertex as usize);
        let mut begin = first.block;
        let mut looked = 0;
        for triangle in &self.part.triangles {
            let corners = triangle.map(|v| corner(v).filter(|sample| early(sample)).is_some());
            if looked == EARLIEST || corners.iter().all(|c| *c) || corners.iter().all(|c| !*c) {
                continue;
            }
            let [Some(a), Some(b), Some(c)] = triangle.map(corner) else { continue };
            let samples = [a, b, c];
            for (from, to) in [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)] {
                if early(samples[from]) && !bad(samples[to]) {
                    looked += 1;
                    let found = self.edge(fault, &bad, samples.map(|s| &s.sample), (from, to));
                    begin = begin.min(found.unwrap_or(begin));
                }
            }
        }
        begin
    }

    /// The block blamed where a fault begins between a bad corner of a triangle and a good one.
    fn edge(
        &self,
        fault: Fault,
        bad: &impl Fn(&MeasuredSample) -> bool,
        corners: [&crate::part::SurfaceSample; 3],
        (from, to): (usize, usize),
    ) -> Option<usize> {
        let (mut low, mut high) = (0.0, 1.0);
        let mut found = None;
        for _ in 0..HALVINGS {
            let middle: f64 = 0.5 * (low + high);
            let mut weights = [0.0; 3];
            weights[from] = 1.0 - middle;
            weights[to] = middle;
            let sample = self.surface.between(corners, weights);
            let touch = self.sweep.lowest(&ray_of(&sample), None, f64::INFINITY);
            if bad(&MeasuredSample { sample, touch }) {
                low = middle;
                found = touch.map(|touch| self.blamed(fault, &touch).block);
            } else {
                high = middle;
            }
        }
        found
    }
}
