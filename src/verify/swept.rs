//! How deep a moving tool reaches on a normal of the part: the exact minimum over all poses, by branch and bound in
//! time. Uses `geometry`, `motion` and the other files of this module.
//!
//! For a sample x with normal n the tool at time t holds some of the points x + lambda n; the smallest lambda over all
//! times is what is left of the material. To show that a stretch of time does not reach below a depth b already found,
//! take one pose of the stretch and a plane that separates the tool there from the ray's part below b. The plane rides
//! with the tool. Its distance g from a point y of the ray is `m(t).(y - c(t)) + const` for every point c of the tool's
//! axis; with d the axis, e the radial direction of the plane's normal m = mu d + nu e, and delta the change of d,
//!
//! `g(t) = g - m.(c(t) - c) + (mu delta - nu (e.delta) d).(y - c) + R`,
//! `|R| <= |nu| |delta|^2 / 2 |y - c| + |delta| |c(t) - c|`
//!
//! (the turn that takes d to d + delta by the shortest way; a turn about the axis changes nothing). With the linear
//! motion of a stretch and its error bounds this is a lower bound of g over the stretch. It is of second order: where
//! the tool slides along the part, long stretches are settled by one pose. A hollow piece has no support plane but a
//! tangent sphere, which costs |y - s|^2 / 2a more.

use super::body::{Body, Piece};
use super::fan::Fan;
use super::motion_tree::{BlockMotion, Bounds, Instant, Linear, MotionTree, Part, Stretch};
use super::plane::{Plane, radial_direction};
use super::ray::{Entry, LocalRay, NormalRay};
use crate::geometry::Direction;
use crate::motion::Pose;

/// How far along a normal the tool is looked for, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Into the material; a tool that reaches deeper is reported at this depth.
    pub inward: f64,
    /// Out of the material; where no tool comes nearer the sample is uncut.
    pub outward: f64,
}

/// The lowest point that the tool reaches on a normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// lambda, mm: positive where material is left, negative where the tool cut too deep.
    pub depth: f64,
    /// When.
    pub when: Instant,
    /// Outward unit normal of the tool where it is touched, part frame.
    pub tool_normal: Direction,
}

/// A body (flutes, or shank and holder) moved through some blocks of a motion.
pub(super) struct SweptTool<'a, M> {
    motion: &'a M,
    tree: &'a MotionTree,
    body: &'a Body,
    boxes: Vec<Bounds>,
    window: Window,
    /// Depth below which no difference is looked for, mm.
    resolution: f64,
}

/// What is asked of a sweep beside the ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Query {
    /// A time that is likely to be good; it only saves work.
    pub(super) hint: Option<Instant>,
    /// Only blocks before this one count.
    pub(super) end: usize,
    /// Only depths below this one count, mm.
    pub(super) limit: f64,
}

/// A stretch of time of which something is still to be shown.
#[derive(Clone)]
pub(super) enum OpenStretch {
    /// A node of the motion's tree, by its index; the first is all of it.
    Node(u32),
    /// A part of one block.
    Part(Box<Part>),
}

/// What one pose and its planes say of a stretch.
enum Verdict {
    /// No pose of the stretch reaches below the depth.
    Clear,
    /// The tool at the stretch's own pose does.
    Deeper(Entry),
    /// Not settled; the lower the number, the more likely the stretch reaches deeper.
    Open(f64),
}

impl<'a, M: BlockMotion> SweptTool<'a, M> {
    pub(super) fn new(motion: &'a M, tree: &'a MotionTree, body: &'a Body, window: Window, resolution: f64) -> Self {
        Self { motion, tree, body, boxes: tree.boxes(body), window, resolution }
    }

    /// The lowest point reached; `None` where no block that counts comes below the limit.
    pub(super) fn lowest(&self, ray: &NormalRay, query: &Query) -> Option<Touch> {
        if self.tree.nodes.is_empty() || self.body.pieces.is_empty() {
            return None;
        }
        let hinted = query.hint.filter(|h| h.block < query.end).and_then(|when| self.at(ray, when));
        let mut best = hinted.filter(|touch| touch.depth < query.limit).map(|touch| self.settle(ray, query, touch));
        let mut stack = vec![0];
        let mut parts = Vec::new();
        let at_bottom = |best: &Option<Touch>| self.goal(query, best.as_ref()) <= -self.window.inward;
        while let Some(index) = stack.pop().filter(|_| !at_bottom(&best)) {
            let node = &self.tree.nodes[index as usize];
            if node.blocks.0 as usize >= query.end {
                continue;
            }
            if node.right != 0 {
                self.visit_children(ray, [index + 1, node.right], query, &mut best, &mut stack);
                continue;
            }
            parts.push(Part::of(self.motion, &node.stretch, self.tree.reference));
            while let Some(part) = parts.pop().filter(|_| !at_bottom(&best)) {
                self.visit_part(ray, part, query, &mut best, &mut parts);
            }
        }
        best
    }

    /// The depth that a stretch must go below to matter.
    fn goal(&self, query: &Query, best: Option<&Touch>) -> f64 {
        best.map_or(query.limit.min(self.window.outward), |b| b.depth - self.resolution)
    }

    fn visit_children(
        &self,
        ray: &NormalRay,
        children: [u32; 2],
        query: &Query,
        best: &mut Option<Touch>,
        stack: &mut Vec<u32>,
    ) {
        let mut children = children.map(|child| (child, self.promise(ray, child, query, best)));
        // The more promising child goes on top of the stack.
        if children[0].1 < children[1].1 {
            children.swap(0, 1);
        }
        stack.extend(children.into_iter().filter(|c| c.1 < f64::INFINITY).map(|c| c.0));
    }

    /// How likely a node reaches deeper: infinite when it certainly does not.
    fn promise(&self, ray: &NormalRay, index: u32, query: &Query, best: &mut Option<Touch>) -> f64 {
        let goal = self.goal(query, best.as_ref());
        let at = |lambda: f64| ray.origin.coords + ray.normal.into_inner() * lambda;
        if self.boxes[index as usize].misses(&at(-self.window.inward), &at(goal)) {
            return f64::INFINITY;
        }
        let node = &self.tree.nodes[index as usize];
        let stretch = &node.stretch;
        // Nothing can be said of a motion known no better than to the size of the body.
        let vague = stretch.linear.tip_error + stretch.linear.top_error > self.body.radius;
        if vague || stretch.block as usize >= query.end {
            return 0.0;
        }
        match self.judge(ray, None, &stretch.linear, goal) {
            Verdict::Clear => f64::INFINITY,
            Verdict::Open(promise) => promise,
            Verdict::Deeper(entry) => {
                *best = Some(self.found(ray, query, stretch, &entry));
                f64::NEG_INFINITY
            }
        }
    }

    fn visit_part(&self, ray: &NormalRay, part: Part, query: &Query, best: &mut Option<Touch>, parts: &mut Vec<Part>) {
        let linear = &part.stretch.linear;
        match self.judge(ray, None, linear, self.goal(query, best.as_ref())) {
            Verdict::Clear => return,
            Verdict::Open(_) => {}
            Verdict::Deeper(entry) => {
                *best = Some(self.found(ray, query, &part.stretch, &entry));
                parts.push(part);
                return;
            }
        }
        // The tool in the middle of the stretch does not matter, and no point of it goes farther than the slack.
        if linear.travel(self.body.heights, self.body.radius, self.tree.reference) >= self.slack() {
            parts.extend(part.halves(self.motion, self.tree.reference).into_iter().flatten());
        }
    }

    /// From what the tool at a stretch's own pose enters to the depth that it leads to downhill. Poses of inner nodes
    /// are the motion's own, too.
    fn found(&self, ray: &NormalRay, query: &Query, stretch: &Stretch, entry: &Entry) -> Touch {
        self.settle(ray, query, touch(ray, &stretch.linear.pose, stretch.middle(), entry))
    }

    /// The lowest point of the tool at one instant.
    pub(super) fn at(&self, ray: &NormalRay, when: Instant) -> Option<Touch> {
        let pose = self.motion.pose(when.block, when.share);
        let entry = self.body.entry(&LocalRay::new(ray, &pose), -self.window.inward, self.window.outward)?;
        Some(touch(ray, &pose, when, &entry))
    }

    /// Tests a stretch against the ray's part from the bottom of the window up to `goal`.
    fn judge(&self, ray: &NormalRay, fan: Option<&Fan>, linear: &Linear, goal: f64) -> Verdict {
        let local = LocalRay::new(ray, &linear.pose);
        let mut promise = f64::INFINITY;
        for piece in &self.body.pieces {
            match self.judge_piece((ray, fan), &local, linear, piece, goal) {
                Verdict::Clear => {}
                Verdict::Open(value) => promise = promise.min(value),
                Verdict::Deeper(entry) => {
                    // Another piece may be entered lower still.
                    let lowest = self.body.entry(&local, -self.window.inward, entry.lambda);
                    return Verdict::Deeper(lowest.unwrap_or(entry));
                }
            }
        }
        if promise < f64::INFINITY { Verdict::Open(promise) } else { Verdict::Clear }
    }

    fn judge_piece(
        &self,
        (ray, fan): (&NormalRay, Option<&Fan>),
        local: &LocalRay,
        linear: &Linear,
        piece: &Piece,
        goal: f64,
    ) -> Verdict {
        let bottom = -self.window.inward;
        // The distance from a convex piece is convex along the ray: walk to where it is smallest, or until a plane
        // separates. The upper end is nearly always that place. Between two planes, one leaning each way along the
        // ray, lies one parallel to it; where the ray passes close to a rim only that one separates.
        let (mut low, mut high, mut lambda) = (bottom, goal, goal);
        let (mut falling, mut rising): (Option<Plane>, Option<Plane>) = (None, None);
        let mut promise = f64::INFINITY;
        for _ in 0..40 {
            let Some(nearest) = piece.nearest(local.height(lambda), local.radius(lambda)) else {
                return match piece.entry(local, bottom, lambda) {
                    Some(entry) => Verdict::Deeper(entry),
                    None => Verdict::Open(0.0),
                };
            };
            let plane = Plane::new(ray, local, linear, lambda, &nearest);
            let value = plane.lowest(ray, linear, piece, (bottom, goal), self.tree.reference, fan);
            if value > -self.slack() {
                return Verdict::Clear;
            }
            promise = promise.min(value);
            let slope = plane.slope(ray);
            let at_end = slope == 0.0 || (slope < 0.0 && lambda == goal) || (slope > 0.0 && lambda == bottom);
            if at_end || plane.separates(ray, (bottom, goal)) {
                break;
            }
            if slope > 0.0 {
                (high, rising) = (lambda, Some(plane));
            } else {
                (low, falling) = (lambda, Some(plane));
            }
            lambda = 0.5 * (low + high);
            match (&falling, &rising) {
                (None, Some(_)) => lambda = bottom,
                (Some(falling), Some(rising)) => {
                    let Some(parallel) = Plane::parallel(falling, rising, ray, linear, piece) else { continue };
                    if parallel.lowest(ray, linear, piece, (bottom, goal), self.tree.reference, fan) > -self.slack() {
                        return Verdict::Clear;
                    }
                    if parallel.separates(ray, (bottom, goal)) {
                        break;
                    }
                    let (foot, margin) = (parallel.foot_on(ray), 0.1 * (high - low));
                    if foot > low + margin && foot < high - margin {
                        lambda = foot;
                    }
                }
                _ => {}
            }
        }
        Verdict::Open(promise)
    }

    /// Goes on showing, stretch by stretch, that no pose reaches any ray of a fan below `goal`. Returns the stretches that
    /// only a narrower fan can settle.
    pub(super) fn not_clear_of(&self, fan: &Fan, goal: f64, open: Vec<OpenStretch>) -> Vec<OpenStretch> {
        let at = |lambda: f64| fan.ray.origin.coords + fan.ray.normal.into_inner() * lambda;
        let (bottom, margin) = (-self.window.inward, fan.reach(self.window.inward));
        let clear = |linear: &Linear| matches!(self.judge(&fan.ray, Some(fan), linear, goal), Verdict::Clear);
        let mut stuck = Vec::new();
        let mut stack = open;
        while let Some(one) = stack.pop() {
            match one {
                OpenStretch::Node(index) => {
                    let Some(node) = self.tree.nodes.get(index as usize) else { continue };
                    let linear = &node.stretch.linear;
                    let vague = linear.tip_error + linear.top_error > self.body.radius;
                    let missed = self.boxes[index as usize].grown(margin).misses(&at(bottom), &at(goal));
                    if missed || (!vague && clear(linear)) {
                        continue;
                    }
                    match node.right {
                        0 => stack.push(OpenStretch::Part(Box::new(Part::of(
                            self.motion,
                            &node.stretch,
                            self.tree.reference,
                        )))),
                        right => stack.extend([OpenStretch::Node(right), OpenStretch::Node(index + 1)]),
                    }
                }
                OpenStretch::Part(part) => {
                    if clear(&part.stretch.linear) {
                        continue;
                    }
                    // Where the tool standing still is not clear of the fan, less motion does not help.
                    let halves =
                        clear(&part.stretch.linear.standing()).then(|| part.halves(self.motion, self.tree.reference));
                    match halves.flatten() {
                        Some(halves) => stack.extend(halves.map(|half| OpenStretch::Part(Box::new(half)))),
                        None => stuck.push(OpenStretch::Part(part)),
                    }
                }
            }
        }
        stuck
    }

    /// True where one convex piece of the tool, at an instant, holds a point of each ray, none higher than `limit`, with
    /// a ball of radius `margin` about it. Points just inside, half way and at the limit are tried: near the end of the
    /// flutes the ray may soon leave the tool again.
    pub(super) fn holds_all(&self, when: Instant, rays: &[NormalRay; 3], limit: f64, margin: f64) -> bool {
        let pose = self.motion.pose(when.block, when.share);
        let locals = rays.map(|ray| LocalRay::new(&ray, &pose));
        let entries = locals.map(|local| self.body.entry(&local, -self.window.inward, limit).map(|e| e.lambda));
        let [Some(a), Some(b), Some(c)] = entries else { return false };
        [1.0, 0.4, 0.1].into_iter().any(|share| {
            let lifts = [a, b, c].map(|entry| entry + share * (limit - entry));
            self.body.pieces.iter().any(|piece| {
                locals.iter().zip(lifts).all(|(local, lift)| {
                    let depth = piece.depth(local.height(lift), local.radius(lift));
                    depth.is_some_and(|depth| depth >= margin)
                })
            })
        })
    }

    /// A body that enters the ray by no more than this, square to its surface, counts as clear, mm.
    pub(super) fn slack(&self) -> f64 {
        0.1 * self.resolution
    }

    /// The lowest point of the tool near an instant, downhill in time; `None` where it does not meet the ray then.
    pub(super) fn near(&self, ray: &NormalRay, when: Instant) -> Option<Touch> {
        let query = Query { hint: None, end: usize::MAX, limit: f64::INFINITY };
        self.at(ray, when).map(|touch| self.settle(ray, &query, touch))
    }

    /// Follows the depth downhill in time from a touch: successive parabolas within a block, then on into the
    /// neighbouring blocks while the minimum lies at an end.
    fn settle(&self, ray: &NormalRay, query: &Query, start: Touch) -> Touch {
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

fn touch(ray: &NormalRay, pose: &Pose, when: Instant, entry: &Entry) -> Touch {
    let axis = pose.axis.into_inner();
    let radial = radial_direction(ray, pose, entry.lambda, entry.height);
    Touch {
        depth: entry.lambda,
        when,
        tool_normal: Direction::new_normalize(axis * entry.axial + radial * entry.radial),
    }
}
