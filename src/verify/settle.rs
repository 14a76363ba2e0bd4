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

    /// The instants at which the tool has gone so many mm farther, or back where they are negative, in blocks of the same
    /// kind; `None` where these end before.
    pub(super) fn farther_on<const N: usize>(&self, from: Instant, ways: [f64; N]) -> [Option<Instant>; N] {
        let first = self.way_of(from.block);
        ways.map(|way| self.gone(from, way, first))
    }

    /// The instant at which the tool has gone `way` mm on from another, whose block is `first` mm long.
    fn gone(&self, from: Instant, way: f64, first: f64) -> Option<Instant> {
        const BLOCKS: usize = 8;
        let (mut now, mut left, mut length) = (from, way, first);
        for _ in 0..BLOCKS {
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
            length = self.way_of(next);
        }
        None
    }

    /// How far tip or reference point goes in a block, mm.
    fn way_of(&self, block: usize) -> f64 {
        let [start, end] = [0.0, 1.0].map(|share| self.motion.pose(block, share));
        let height = self.tree.reference;
        (end.tip - start.tip).norm().max((end.at_height(height) - start.at_height(height)).norm())
    }

    /// Follows the depth downhill in time from a touch: by parabolas over blocks and within them, then on into the
    /// neighbouring blocks while the minimum lies at an end.
    pub(super) fn settle(&self, ray: &NormalRay, query: &Query, start: Touch) -> Touch {
        let mut best = self.glide(ray, query, start);
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

    /// Goes to about where the depth is lowest in the blocks near a touch.
    fn glide(&self, ray: &NormalRay, query: &Query, start: Touch) -> Touch {
        /// How far to look, in blocks, how far to go at once, and how often.
        const AROUND: f64 = 1.0;
        const LEAP: f64 = 6.0;
        const TIMES: usize = 6;
        let mut best = start;
        for _ in 0..TIMES {
            let from = best.when;
            let touch = |shift: f64| {
                let when = self.in_blocks(from, shift, query.end)?;
                self.at(ray, when).map(|touch| (shift, touch))
            };
            let (Some(before), Some(after)) = (touch(-AROUND), touch(AROUND)) else { break };
            let (a, b, c) = ((-AROUND, before.1.depth), (0.0, best.depth), (AROUND, after.1.depth));
            let leap = match Parabola::through(a, b, c).and_then(|parabola| parabola.vertex()) {
                Some(shift) => shift.clamp(-LEAP, LEAP),
                None if a.1 < c.1 => -LEAP,
                None => LEAP,
            };
            let found = [touch(leap), Some(before), Some(after)].into_iter().flatten();
            let (shift, lowest) = found.fold((0.0, best), |x, y| if y.1.depth < x.1.depth { y } else { x });
            best = lowest;
            if shift.abs() < AROUND {
                break;
            }
        }
        best
    }

    /// The instant so many blocks later, or earlier where that is negative, if the blocks on the way are of one kind.
    fn in_blocks(&self, from: Instant, shift: f64, end: usize) -> Option<Instant> {
        let time = from.block as f64 + from.share + shift;
        let when = (time >= 0.0).then(|| Instant { block: time as usize, share: time.fract() })?;
        let mut way = from.block.min(when.block)..=from.block.max(when.block);
        let same_kind = |block| {
            block < self.motion.blocks().min(end) && self.motion.is_rapid(block) == self.motion.is_rapid(from.block)
        };
        way.all(same_kind).then_some(when)
    }

    /// The lowest point in the block of a touch, downhill from it.
    fn settle_in_block(&self, ray: &NormalRay, start: Touch) -> Touch {
        let mut best = start;
        let mut probe = |share: f64| {
            let touch = self.at(ray, Instant { block: start.when.block, share });
            if let Some(touch) = touch.filter(|touch| touch.depth < best.depth) {
                best = touch;
            }
            (share, touch.map_or(f64::INFINITY, |touch| touch.depth))
        };
        let Some(mut valley) = Valley::around((start.when.share, start.depth), &mut probe) else { return best };
        for step in 0..MOST_STEPS {
            let parabola = Parabola::through(valley.before, valley.lowest, valley.after);
            let vertex = parabola.as_ref().and_then(Parabola::vertex).filter(|_| step % PATIENCE != PATIENCE - 1);
            let share = vertex.map_or(valley.widest(), |share| share.clamp(valley.before.0, valley.after.0));
            let found = probe(share);
            let foreseen = parabola.filter(|_| vertex.is_some()).map(|parabola| parabola.at(share));
            valley.take(found);
            if foreseen.is_some_and(|depth| (depth - found.1).abs() < SETTLED) || valley.width() < NARROW {
                break;
            }
        }
        best
    }
}

/// Steps within a block at most; after so many of them one halves what encloses the minimum.
const MOST_STEPS: usize = 60;
const PATIENCE: usize = 4;
/// Share of a block beside a touch that is looked at first.
const LOOK: f64 = 0.2;
/// Share of a block within which a minimum needs no closer look.
const NARROW: f64 = 1e-8;

/// Three places of a block, by share and depth, of which the middle one is the lowest or the minimum lies at an end.
struct Valley {
    before: (f64, f64),
    lowest: (f64, f64),
    after: (f64, f64),
}

impl Valley {
    /// Goes downhill from a place until the depth rises or the block ends; `None` where that is at once.
    fn around(start: (f64, f64), probe: &mut impl FnMut(f64) -> (f64, f64)) -> Option<Self> {
        let mut look = LOOK;
        let (mut before, mut lowest, mut after) =
            (probe((start.0 - look).max(0.0)), start, probe((start.0 + look).min(1.0)));
        while before.1 < lowest.1 && before.0 > 0.0 {
            look *= 2.0;
            (before, lowest, after) = (probe((before.0 - look).max(0.0)), before, lowest);
        }
        while after.1 < lowest.1 && after.0 < 1.0 {
            look *= 2.0;
            (before, lowest, after) = (lowest, after, probe((after.0 + look).min(1.0)));
        }
        // At an end of the block one of them is missing.
        if before.0 >= lowest.0 {
            (before, lowest) = (lowest, probe(0.5 * (lowest.0 + after.0)));
        } else if after.0 <= lowest.0 {
            (after, lowest) = (lowest, probe(0.5 * (before.0 + lowest.0)));
        }
        (before.0 < lowest.0 && lowest.0 < after.0).then_some(Self { before, lowest, after })
    }

    /// The middle of the wider side.
    fn widest(&self) -> f64 {
        let (left, right) = (self.lowest.0 - self.before.0, self.after.0 - self.lowest.0);
        if left > right { self.lowest.0 - 0.5 * left } else { self.lowest.0 + 0.5 * right }
    }

    /// Takes in one more place.
    fn take(&mut self, place: (f64, f64)) {
        let before = place.0 < self.lowest.0;
        match (place.1 < self.lowest.1, before) {
            (true, true) => (self.after, self.lowest) = (self.lowest, place),
            (true, false) => (self.before, self.lowest) = (self.lowest, place),
            (false, true) => self.before = place,
            (false, false) => self.after = place,
        }
    }

    fn width(&self) -> f64 {
        self.after.0 - self.before.0
    }
}

/// Change of depth below which a minimum is settled, mm.
const SETTLED: f64 = 1e-10;

/// The parabola through three places.
#[derive(Clone, Copy)]
struct Parabola {
    middle: (f64, f64),
    /// Its slope in the middle, and how that grows.
    slope: f64,
    bend: f64,
}

impl Parabola {
    /// `None` where the places are not in order or not finite.
    fn through(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> Option<Self> {
        let (left, right) = (b.0 - a.0, c.0 - b.0);
        if left <= 0.0 || right <= 0.0 {
            return None;
        }
        let (slope_left, slope_right) = ((b.1 - a.1) / left, (c.1 - b.1) / right);
        let bend = (slope_right - slope_left) / (0.5 * (left + right));
        let slope = (slope_left * right + slope_right * left) / (left + right);
        (bend.is_finite() && slope.is_finite()).then_some(Self { middle: b, slope, bend })
    }

    /// Where it is lowest.
    fn vertex(&self) -> Option<f64> {
        (self.bend > 0.0).then(|| self.middle.0 - self.slope / self.bend)
    }

    fn at(&self, share: f64) -> f64 {
        let step = share - self.middle.0;
        self.middle.1 + step * (self.slope + 0.5 * self.bend * step)
    }
}
