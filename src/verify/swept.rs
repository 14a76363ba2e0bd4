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
use std::sync::Arc;

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
    pub(super) motion: &'a M,
    pub(super) tree: &'a MotionTree,
    pub(super) body: &'a Body,
    boxes: Vec<Bounds>,
    pub(super) window: Window,
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

/// What a stretch must not reach below `goal`: a ray, or all rays of a fan about it.
#[derive(Clone, Copy)]
pub(super) struct Target<'t> {
    pub(super) ray: &'t NormalRay,
    pub(super) fan: Option<&'t Fan>,
    /// Normal of a plane that may separate them: the tool's where it has touched the ray before.
    pub(super) guide: Option<Direction>,
    pub(super) goal: f64,
}

/// A stretch of time of which something is still to be shown.
#[derive(Clone)]
pub(super) enum OpenStretch {
    /// A node of the motion's tree, by its index; the first is all of it.
    Node(u32),
    /// A part of one block.
    Part(Arc<Part>),
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
        self.search(ray, query, self.hinted(ray, query), &[0])
    }

    /// Where the hint of a query leads.
    pub(super) fn hinted(&self, ray: &NormalRay, query: &Query) -> Option<Touch> {
        let touch = query.hint.filter(|h| h.block < query.end).and_then(|when| self.at(ray, when));
        touch.filter(|touch| touch.depth < query.limit).map(|touch| self.settle(ray, query, touch))
    }

    /// The lowest point reached below what is known, in the stretches of some nodes.
    pub(super) fn search(
        &self,
        ray: &NormalRay,
        query: &Query,
        mut best: Option<Touch>,
        roots: &[u32],
    ) -> Option<Touch> {
        if self.tree.nodes.is_empty() || self.body.pieces.is_empty() {
            return best;
        }
        let promise = |index: u32, best: &Option<Touch>| {
            // Where the tool slides along the part, the plane that it touches the ray with settles long stretches.
            let guide = best.as_ref().filter(|touch| self.tree.nodes[index as usize].holds(touch.when));
            let goal = self.goal(query, best.as_ref());
            let target = Target { ray, fan: None, guide: guide.map(|touch| touch.tool_normal), goal };
            self.promise(&target, index, query.end)
        };
        let mut stack = Vec::new();
        push_open(&mut stack, roots.iter().map(|root| (*root, promise(*root, &best))));
        let mut parts = Vec::new();
        let at_bottom = |best: &Option<Touch>| self.goal(query, best.as_ref()) <= -self.window.inward;
        while let Some((index, _)) = stack.pop().filter(|_| !at_bottom(&best)) {
            let node = &self.tree.nodes[index as usize];
            if node.right != 0 {
                let children = [index + 1, node.right].map(|child| (child, promise(child, &best)));
                push_open(&mut stack, children);
                continue;
            }
            parts.push(Part::of(&node.stretch));
            while let Some(part) = parts.pop().filter(|_| !at_bottom(&best)) {
                self.visit_part(ray, part, query, &mut best, &mut parts);
            }
        }
        best
    }

    /// The depth that a stretch must go below to matter.
    pub(super) fn goal(&self, query: &Query, best: Option<&Touch>) -> f64 {
        best.map_or(query.limit.min(self.window.outward), |b| b.depth - self.resolution)
    }

    /// How likely a node reaches below a target's goal, the lower the likelier: infinite when it certainly does not.
    pub(super) fn promise(&self, target: &Target<'_>, index: u32, end: usize) -> f64 {
        let node = &self.tree.nodes[index as usize];
        if node.blocks.0 as usize >= end || self.far(index, target) {
            return f64::INFINITY;
        }
        let linear = &node.stretch.linear;
        // Nothing can be said of a motion known no better than to the size of the body.
        if linear.tip_error + linear.top_error > self.body.radius {
            return 0.0;
        }
        let point = target.ray.origin + target.ray.normal.into_inner() * target.goal;
        let height = (point - linear.pose.tip).dot(&linear.pose.axis);
        let height = height.clamp(self.body.heights.0, self.body.heights.1);
        match self.judge(target, &linear.about(&point, height, self.tree.reference)) {
            Verdict::Clear => f64::INFINITY,
            Verdict::Open(promise) => promise,
            Verdict::Deeper(_) => f64::NEG_INFINITY,
        }
    }

    /// True where a node's box shows that it does not come near a target between the window's bottom and its goal.
    fn far(&self, index: u32, target: &Target<'_>) -> bool {
        let Target { ray, fan, goal, .. } = target;
        let at = |lambda: f64| ray.origin.coords + ray.normal.into_inner() * lambda;
        let margin = fan.map_or(0.0, |fan| fan.reach(self.window.inward.max(*goal)));
        self.boxes[index as usize].misses(&at(-self.window.inward), &at(*goal), margin)
    }

    fn visit_part(&self, ray: &NormalRay, part: Part, query: &Query, best: &mut Option<Touch>, parts: &mut Vec<Part>) {
        let linear = &part.stretch.linear;
        let goal = self.goal(query, best.as_ref());
        let guide = best.as_ref().map(|touch| touch.tool_normal);
        match self.judge(&Target { ray, fan: None, guide, goal }, linear) {
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

    /// Tests a stretch against the target's part from the bottom of the window up to its goal.
    fn judge(&self, target: &Target<'_>, linear: &Linear) -> Verdict {
        let local = LocalRay::new(target.ray, &linear.pose);
        let mut promise = f64::INFINITY;
        for piece in &self.body.pieces {
            match self.judge_piece(target, &local, linear, piece) {
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

    fn judge_piece(&self, target: &Target<'_>, local: &LocalRay, linear: &Linear, piece: &Piece) -> Verdict {
        let Target { ray, fan, guide, goal } = *target;
        let bottom = -self.window.inward;
        let clear =
            |plane: &Plane| plane.lowest(ray, linear, piece, (bottom, goal), self.tree.reference, fan) > -self.slack();
        let convex = piece.clear_radius.is_infinite();
        if guide.filter(|_| convex).is_some_and(|normal| clear(&Plane::support(&normal, linear, piece))) {
            return Verdict::Clear;
        }
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
            let profile = fan.filter(|_| convex).and_then(|_| plane.along_profile(linear, &nearest));
            if profile.is_some_and(|plane| clear(&plane)) {
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
                    if clear(&parallel) {
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
    pub(super) fn not_clear_of(&self, fan: &Fan, goal: f64, open: &[OpenStretch]) -> Vec<OpenStretch> {
        let target = Target { ray: &fan.ray, fan: Some(fan), guide: None, goal };
        let clear = |linear: &Linear| matches!(self.judge(&target, linear), Verdict::Clear);
        let mut stuck = Vec::new();
        let mut stack = open.to_vec();
        while let Some(one) = stack.pop() {
            match one {
                OpenStretch::Node(index) => {
                    let Some(node) = self.tree.nodes.get(index as usize) else { continue };
                    if self.promise(&target, index, usize::MAX) == f64::INFINITY {
                        continue;
                    }
                    match node.right {
                        0 => stack.push(OpenStretch::Part(Arc::new(Part::of(&node.stretch)))),
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
                        Some(halves) => stack.extend(halves.map(|half| OpenStretch::Part(Arc::new(half)))),
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
}

/// Puts what may reach deeper on a stack, the more promising on top.
fn push_open(stack: &mut Vec<(u32, f64)>, nodes: impl IntoIterator<Item = (u32, f64)>) {
    let known = stack.len();
    stack.extend(nodes.into_iter().filter(|(_, promise)| *promise < f64::INFINITY));
    stack[known..].sort_by(|(_, a), (_, b)| b.total_cmp(a));
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
