//! Where the part leaves its tolerance, told by the lines of the program: stretches of blocks that cut too deep or leave
//! too much, each with the block at which it begins. Uses `part` and the other files of this module.

use super::deviation::PartDeviation;
use super::measured::{MeasuredSample, ray_of};
use super::motion_tree::{BlockMotion, Instant};
use super::outlier::Ends;
use super::ray::NormalRay;
use super::strips::Runs;
use super::sweep::Sweep;
use super::swept::Touch;
use crate::part::DesignSurface;
use rayon::prelude::*;

/// Blocks between two bad places that still are one stretch.
const GAP: usize = 3;
/// Earliest bad samples from which the beginning of a stretch is looked for.
const EARLIEST: usize = 24;
/// Halvings of a grid edge towards the place where a stretch begins.
const HALVINGS: usize = 12;
/// Blocks that the beginning of a stretch is traced back by.
const MOST_BACK: usize = 50;
/// Pieces of the side of a triangle between fine rays.
const FINE: u32 = 16;
/// Rapids between feed moves that are looked at, each in all of the part.
const MOST_RAPIDS: usize = 200;
/// Share of what is left over by which the end of a block must be off the course of the others to explain it.
const OFF_SHARE: f64 = 0.5;
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
    /// The one to blame first.
    pub(super) begin: usize,
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
            let worst = worst?;
            // What is left ahead of the tool is nearest to it long before it goes away: there the worst place tells.
            let begin = match fault {
                Fault::Overcut => self.beginning(fault, allowed, first).min(first.block),
                Fault::Undercut => worst.touch.map_or(first.block, |touch| self.blamed(fault, &touch).block),
            };
            let begin = self.arrival(fault, allowed, begin, &worst);
            let begin = match fault {
                Fault::Overcut => begin,
                Fault::Undercut => {
                    let missing = worst.deviation().map_or(0.0, |deviation| fault.beyond(deviation, allowed));
                    self.wrong_block((first.block.min(begin), last.block.max(begin)), missing).unwrap_or(begin)
                }
            };
            Some(Stretch { begin, first: first.block.min(begin), last: last.block, worst })
        };
        bad.chunk_by(one).filter_map(stretch).collect()
    }

    /// Single rapids between feed moves during all of which the tool is within `near` mm of the part: cuts in a hurry.
    pub(super) fn grazing_rapids(&self, motion: &M, near: f64) -> Vec<usize> {
        let rays: Vec<NormalRay> = self.part.samples.iter().map(|sample| ray_of(&sample.sample)).collect();
        let touches = |block: usize, share: f64| {
            let touch = |ray: &NormalRay| self.sweep.rapid.at(ray, Instant { block, share });
            rays.par_iter().any(|ray| touch(ray).is_some_and(|touch| touch.depth < near))
        };
        let single = |block: &usize| {
            let feed = |block: usize| block < motion.blocks() && !motion.is_rapid(block);
            motion.is_rapid(*block) && *block > 0 && feed(block - 1) && feed(block + 1)
        };
        let grazes = |block: &usize| [0.0, 0.5, 1.0].iter().all(|share| touches(*block, *share));
        (0..motion.blocks()).filter(single).take(MOST_RAPIDS).filter(grazes).collect()
    }

    /// The block that brought the tool to where it is at fault: as long as it is when a block begins, the one before is to
    /// blame. Looked at on a fine grid around the worst place.
    fn arrival(&self, fault: Fault, allowed: f64, first: usize, worst: &MeasuredSample) -> usize {
        let rays = self.fine_rays(worst);
        let at_fault = |block: usize| {
            let depth =
                |ray: &NormalRay| self.sweep.feed.at(ray, Instant { block, share: 0.0 }).map(|touch| touch.depth);
            let lowest = rays.iter().filter_map(depth).reduce(f64::min);
            lowest.is_some_and(|lowest| fault.beyond(lowest, allowed) > 0.0)
        };
        let mut block = first;
        for _ in 0..MOST_BACK {
            let before = block.checked_sub(1).filter(|before| self.runs.of_block(*before) == self.runs.of_block(block));
            match before.filter(|_| at_fault(block)) {
                Some(before) => block = before,
                None => break,
            }
        }
        block
    }

    /// The first block about a stretch that ends off the course of the others, far enough for so much to be left over: the
    /// tool there goes away, on a way of several blocks, from material that it nearly reaches before and after.
    fn wrong_block(&self, (first, last): (usize, usize), missing: f64) -> Option<usize> {
        let run = self.runs.of_block(first);
        let height = self.sweep.feed.tree.reference;
        let same = |block: usize| self.runs.of_block(block) == run;
        Ends::around(self.sweep.feed.motion, (first, last), height, same)?.first_wrong(OFF_SHARE * missing)
    }

    /// Rays all over the triangles about the sample of the grid that is nearest to a place.
    fn fine_rays(&self, place: &MeasuredSample) -> Vec<NormalRay> {
        let distance = |sample: &MeasuredSample| (sample.sample.point - place.sample.point).norm_squared();
        let nearer = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1);
        let distances = self.part.samples.iter().map(distance).enumerate();
        let Some((nearest, _)) = distances.min_by(nearer) else { return Vec::new() };
        let around = self.part.triangles.iter().filter(|triangle| triangle.iter().any(|v| *v as usize == nearest));
        let mut rays = vec![ray_of(&place.sample)];
        for triangle in around {
            let [Some(a), Some(b), Some(c)] = triangle.map(|v| self.part.samples.get(v as usize)) else { continue };
            let corners = [a, b, c].map(|sample| &sample.sample);
            for i in 0..=FINE {
                for j in 0..=FINE - i {
                    let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(FINE));
                    rays.push(ray_of(&self.surface.between(corners, [1.0 - u - v, u, v])));
                }
            }
        }
        rays
    }

    /// The moment to blame for a touch: what is left where a block ends is left by the next one, which goes away; what is
    /// left where a block begins, by the one before, which came from away.
    fn blamed(&self, fault: Fault, touch: &Touch) -> Instant {
        let Instant { block, share } = touch.when;
        let goes_on = self.runs.of_block(block).is_some() && self.runs.of_block(block) == self.runs.of_block(block + 1);
        let came_on = block > 0 && self.runs.of_block(block - 1) == self.runs.of_block(block);
        match fault {
            Fault::Undercut if share > 1.0 - END && goes_on => Instant { block: block + 1, share: 0.0 },
            Fault::Undercut if share < END && came_on => Instant { block: block - 1, share: 1.0 },
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
