//! From a touch downhill in time to the deepest one near it. Uses the sweep and the other files of this module.

use super::motion_tree::{BlockMotion, Instant};
use super::ray::NormalRay;
use super::swept::{Query, SweptTool, Touch};

impl<M: BlockMotion> SweptTool<'_, M> {
    /// The lowest point of the tool near an instant, downhill in time; `None` where it does not meet the ray then.
    pub(super) fn near(&self, ray: &NormalRay, when: Instant) -> Option<Touch> {
        let query = Query { hint: None, end: usize::MAX, limit: f64::INFINITY };
        self.at(ray, when).map(|touch| self.settle(ray, &query, touch))
    }

    /// The instant at which the tool has gone `way` mm farther, or back where that is negative, in blocks of the same kind.
    pub(super) fn farther_on(&self, from: Instant, way: f64) -> Option<Instant> {
        const BLOCKS: usize = 8;
        let (mut now, mut left) = (from, way);
        for _ in 0..BLOCKS {
            let [start, end] = [0.0, 1.0].map(|share| self.motion.pose(now.block, share));
            let height = self.tree.reference;
            let length = (end.tip - start.tip).norm().max((end.at_height(height) - start.at_height(height)).norm());
            let share = now.share + left / length.max(f64::MIN_POSITIVE);
            if (0.0..=1.0).contains(&share) {
                return Some(Instant { share, ..now });
            }
            let (next, reached) = if left > 0.0 { (now.block + 1, 1.0) } else { (now.block.checked_sub(1)?, 0.0) };
            if next >= self.motion.blocks() || self.motion.is_rapid(next) != self.motion.is_rapid(now.block) {
                return None;
            }
            left -= (reached - now.share) * length;
            now = Instant { block: next, share: 1.0 - reached };
        }
        None
    }

    /// Follows the depth downhill in time from a touch: successive parabolas within a block, then on into the
    /// neighbouring blocks while the minimum lies at an end.
    pub(super) fn settle(&self, ray: &NormalRay, query: &Query, start: Touch) -> Touch {
        let mut best = start;
        for _ in 0..self.tree.nodes.len() {
            let inside = self.settle_in_block(ray, best);
            let block = inside.when.block;
            best = inside;
            let next = if inside.when.share >= 1.0 - 1e-6 {
                Instant { block: block + 1, share: 0.0 }
            } else if inside.when.share <= 1e-6 && block > 0 {
                Instant { block: block - 1, share: 1.0 }
            } else {
                break;
            };
            let same_kind = next.block < self.motion.blocks().min(query.end)
                && self.motion.is_rapid(next.block) == self.motion.is_rapid(block);
            if !same_kind {
                break;
            }
            let inward = if next.share == 0.0 { 1e-3 } else { 1.0 - 1e-3 };
            match self.at(ray, Instant { block: next.block, share: inward }) {
                Some(touch) if touch.depth < best.depth => best = touch,
                _ => break,
            }
        }
        best
    }

    fn settle_in_block(&self, ray: &NormalRay, start: Touch) -> Touch {
        let depth = |share: f64| -> Option<Touch> { self.at(ray, Instant { block: start.when.block, share }) };
        let mut best = start;
        let mut step: f64 = 0.25;
        for _ in 0..60 {
            let share = best.when.share;
            let (before, after) = ((share - step).max(0.0), (share + step).min(1.0));
            let (a, b) = (depth(before), depth(after));
            let proposal = match (&a, &b) {
                (Some(a), Some(b)) => vertex((before, a.depth), (share, best.depth), (after, b.depth)),
                _ => None,
            };
            let tried = proposal.and_then(|p| depth(p.clamp(0.0, 1.0)));
            let found = [a, b, tried].into_iter().flatten().fold(best, |x, y| if y.depth < x.depth { y } else { x });
            let (gain, moved) = (best.depth - found.depth, (found.when.share - share).abs());
            best = found;
            if gain < SETTLED && step < 0.02 {
                break;
            }
            step = if moved >= step { step } else { (step * 0.1).max(2.0 * moved.min(0.05)).min(step * 0.5) };
            if step < 1e-9 {
                break;
            }
        }
        best
    }
}

/// Change of depth below which a minimum is settled, mm.
const SETTLED: f64 = 1e-10;

/// Where the parabola through three points has its minimum.
fn vertex(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> Option<f64> {
    let (left, right) = (b.0 - a.0, c.0 - b.0);
    if left <= 0.0 || right <= 0.0 {
        return None;
    }
    let (slope_left, slope_right) = ((b.1 - a.1) / left, (c.1 - b.1) / right);
    let bend = (slope_right - slope_left) / (0.5 * (left + right));
    // Slope at b, from the parabola.
    let slope = (slope_left * right + slope_right * left) / (left + right);
    (bend > 0.0).then(|| b.0 - slope / bend)
}
