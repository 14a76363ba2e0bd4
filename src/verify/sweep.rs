//! A whole program's sweep: feed and rapid moves of one body. Uses the other files of this module.

use super::body::Body;
use super::motion_tree::{BlockMotion, Instant, MotionTree};
use super::ray::NormalRay;
use super::swept::{Query, SweptTool, Touch, Window};
use rayon::prelude::*;

/// Samples that one thread does in a row, each starting from the time found for the one before. A constant, so that
/// results do not depend on the number of threads.
const RUN: usize = 64;

/// Chords of feed moves are followed to this error before the search, mm; closer where it matters.
const FEED_SAG: f64 = 1e-5;
/// The same for rapids, which seldom come near.
const RAPID_SAG: f64 = 1e-2;

/// Feed moves and rapids of a motion, each as a tree in time.
pub(super) struct Timeline<'a, M> {
    pub(super) motion: &'a M,
    feed: MotionTree,
    rapid: MotionTree,
}

/// A body moved through all of a motion.
pub(super) struct Sweep<'a, M> {
    pub(super) feed: SweptTool<'a, M>,
    pub(super) rapid: SweptTool<'a, M>,
}

impl<'a, M: BlockMotion> Timeline<'a, M> {
    /// `reference` is the height at which motions are compared beside the tip: the length of the flutes.
    pub(super) fn new(motion: &'a M, reference: f64) -> Self {
        let (feed, rapid) = rayon::join(
            || MotionTree::new(motion, reference, FEED_SAG, |b| !motion.is_rapid(b)),
            || MotionTree::new(motion, reference, RAPID_SAG, |b| motion.is_rapid(b)),
        );
        Self { motion, feed, rapid }
    }

    /// The sweep of a body.
    pub(super) fn sweep<'b>(&'b self, body: &'b Body, window: Window, resolution: f64) -> Sweep<'b, M> {
        let of = |tree: &'b MotionTree| SweptTool::new(self.motion, tree, body, window, resolution);
        Sweep { feed: of(&self.feed), rapid: of(&self.rapid) }
    }
}

impl<M: BlockMotion> Sweep<'_, M> {
    /// The lowest point reached by any move, below `limit`.
    pub(super) fn lowest(&self, ray: &NormalRay, hint: Option<Instant>, limit: f64) -> Option<Touch> {
        let feed = self.feed.lowest(ray, &Query { hint, end: usize::MAX, limit });
        let limit = feed.map_or(limit, |touch| touch.depth);
        self.rapid.lowest(ray, &Query { hint: None, end: usize::MAX, limit }).or(feed)
    }

    /// [`Self::lowest`] for many rays, in order; `limit` gives each ray's limit by its index.
    pub(super) fn lowest_all(
        &self,
        rays: &[NormalRay],
        limit: impl Fn(usize) -> f64 + Sync + Send,
    ) -> Vec<Option<Touch>> {
        let limit = &limit;
        let run = |(index, rays): (usize, &[NormalRay])| {
            let mut hint = None;
            let follow = move |(offset, ray): (usize, &NormalRay)| {
                let touch = self.lowest(ray, hint, limit(index * RUN + offset));
                hint = touch.map(|t| t.when).or(hint);
                touch
            };
            rays.iter().enumerate().map(follow).collect::<Vec<_>>()
        };
        rays.par_chunks(RUN).enumerate().flat_map_iter(run).collect()
    }
}
