//! A whole program's sweep: feed and rapid moves of one body. Uses the other files of this module.

use super::body::Body;
use super::motion_tree::{BlockMotion, Instant, MotionTree};
use super::ray::NormalRay;
use super::swept::{Query, SweptTool, Touch, Window};
use crate::geometry::Vector;
use rayon::prelude::*;

/// Samples that one thread does together. A constant, so that results do not depend on the number of threads.
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

    /// [`Self::lowest`] for many rays, in order; `ask` gives each ray's hint and limit by its index.
    pub(super) fn lowest_all(
        &self,
        rays: &[NormalRay],
        ask: impl Fn(usize) -> (Option<Instant>, f64) + Sync + Send,
    ) -> Vec<Option<Touch>> {
        let order = along_curve(rays);
        let run = |run: &[usize]| {
            let asked = run.iter().map(|index| {
                let (hint, limit) = ask(*index);
                (rays[*index], Query { hint, end: usize::MAX, limit })
            });
            self.lowest_of(asked.collect())
        };
        let found: Vec<Option<Touch>> = order.par_chunks(RUN).flat_map_iter(run).collect();
        let mut touches = vec![None; rays.len()];
        for (index, touch) in order.into_iter().zip(found) {
            touches[index] = touch;
        }
        touches
    }

    /// [`Self::lowest`] for a run of rays.
    fn lowest_of(&self, mut cluster: Vec<(NormalRay, Query)>) -> Vec<Option<Touch>> {
        let feed = self.feed.lowest_of(&cluster);
        for ((_, query), touch) in cluster.iter_mut().zip(&feed) {
            *query = Query { hint: None, limit: touch.map_or(query.limit, |touch| touch.depth), ..*query };
        }
        let rapid = self.rapid.lowest_of(&cluster);
        rapid.into_iter().zip(feed).map(|(rapid, feed)| rapid.or(feed)).collect()
    }
}

/// The indices of rays in the order of a curve that fills space (Morton 1966): neighbours in the order are neighbours in
/// space, mostly.
pub(super) fn along_curve(rays: &[NormalRay]) -> Vec<usize> {
    const BITS: u32 = 16;
    let corner = |pick: fn(&Vector, &Vector) -> Vector| {
        rays.iter().map(|ray| ray.origin.coords).reduce(|a, b| pick(&a, &b)).unwrap_or_default()
    };
    let (low, high) = (corner(Vector::inf), corner(Vector::sup));
    let scale = f64::from((1_u32 << BITS) - 1) / (high - low).max().max(f64::MIN_POSITIVE);
    let spread = |x: u64| (0..BITS).fold(0, |code, bit| code | ((x >> bit) & 1) << (3 * bit));
    let code = |ray: &NormalRay| {
        let [x, y, z] = ((ray.origin.coords - low) * scale).map(|x| spread(x as u64)).into();
        x | y << 1 | z << 2
    };
    let mut order: Vec<(u64, usize)> = rays.iter().enumerate().map(|(index, ray)| (code(ray), index)).collect();
    order.par_sort_unstable();
    order.into_iter().map(|(_, index)| index).collect()
}
