//! The tool's motion in time as a tree: each node is a stretch of time with a pose, a linear motion about it, and a bound
//! on how far the true motion leaves that. Uses `geometry`, `motion` and `simulate`.

use super::body::Body;
use crate::geometry::{Direction, Point, Vector};
use crate::motion::Pose;
use crate::simulate::{Segment, SegmentKind, ToolMotion};
use rayon::prelude::*;

/// A motion in blocks, each exact between its ends: what the verifier asks of a program.
pub trait BlockMotion: Sync {
    /// Number of blocks, in order of time.
    fn blocks(&self) -> usize;

    /// Tool pose at `share` (0 to 1) of a block, part frame.
    fn pose(&self, block: usize, share: f64) -> Pose;

    /// Bound on how far the axis point at `height` mm above the tip leaves the straight chord between its places at the
    /// shares `from` and `to` of a block, mm; convex in `height`. From a bound on its second derivative by the share
    /// that holds in all of that stretch: within each half of it a quarter of this is a bound, too.
    fn chord_bound(&self, block: usize, from: f64, to: f64, height: f64) -> f64;

    /// True where the block moves as fast as the machine can.
    fn is_rapid(&self, block: usize) -> bool;
}

impl BlockMotion for ToolMotion {
    fn blocks(&self) -> usize {
        self.segments().len()
    }

    fn pose(&self, block: usize, share: f64) -> Pose {
        self.pose(&self.segments()[block], share)
    }

    fn chord_bound(&self, block: usize, from: f64, to: f64, height: f64) -> f64 {
        self.chord_bound(&self.segments()[block], from, to, height)
    }

    fn is_rapid(&self, block: usize) -> bool {
        let Segment { kind, .. } = self.segments()[block];
        kind == SegmentKind::Rapid
    }
}

/// A place in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// Index of the block.
    pub block: usize,
    /// Share of its way, 0 to 1.
    pub share: f64,
}

/// Motion about a pose: at tau in `range` (from -1 to 1 where the pose is the middle one) the tip is `pose.tip + tau tip_rate` and the axis `pose.axis + tau axis_rate`,
/// but for an error bounded at the tip and at the reference height.
#[derive(Clone, Copy, Debug)]
pub(super) struct Linear {
    pub(super) pose: Pose,
    pub(super) tip_rate: Vector,
    pub(super) axis_rate: Vector,
    pub(super) range: (f64, f64),
    /// Length of `axis_rate`.
    pub(super) turn: f64,
    pub(super) tip_error: f64,
    pub(super) top_error: f64,
}

/// Feet on a joint motion are taken this far out at most: it returns to its middle seldom.
const MOST: f64 = 2.0;
/// Motions that leave their line by less than this are halved, mm.
const STRAIGHT: f64 = 1e-4;

/// The range of tau about a middle pose.
const WHOLE: (f64, f64) = (-1.0, 1.0);

/// A stretch of one block with what halving it needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub(super) stretch: Stretch,
    /// What is needed only where it is halved.
    ends: Option<Ends>,
}

#[derive(Clone, Copy, Debug)]
struct Ends {
    /// Poses at its ends.
    poses: [Pose; 2],
    /// How far tip and reference point leave their chords.
    bends: [f64; 2],
}

impl Ends {
    fn of(motion: &impl BlockMotion, block: usize, (from, to): (f64, f64), reference: f64) -> Self {
        let poses = [from, to].map(|share| motion.pose(block, share));
        let bends = [0.0, reference].map(|height| motion.chord_bound(block, from, to, height));
        Self { poses, bends }
    }
}

/// A stretch of one block with its linear motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    pub(super) block: u32,
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) linear: Linear,
}

/// A node: a leaf has one stretch; otherwise the children are the next node and `right`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) stretch: Stretch,
    /// First and one past the last block.
    pub(super) blocks: (u32, u32),
    /// Index of the second child; 0 in a leaf.
    pub(super) right: u32,
}

/// The tree over some of the blocks of a motion. The first node is the root; empty when there are no blocks.
#[derive(Clone, Debug, Default)]
pub(super) struct MotionTree {
    pub(super) nodes: Vec<Node>,
    /// Height at which `top_error` holds, mm.
    pub(super) reference: f64,
}

/// A box along the axes of the part frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) low: Vector,
    pub(super) high: Vector,
}

impl Linear {
    /// The tip and the axis direction at tau.
    fn at(&self, tau: f64) -> (Vector, Vector) {
        (self.pose.tip.coords + self.tip_rate * tau, self.pose.axis.into_inner() + self.axis_rate * tau)
    }

    /// The pose half way, not moving.
    pub(super) fn standing(&self) -> Self {
        let (zero, none) = (Vector::zeros(), 0.0);
        Self { tip_rate: zero, axis_rate: zero, turn: none, tip_error: none, top_error: none, ..*self }
    }

    /// The same motion about where its axis point at `height` comes nearest to a point. That pose is one of the line,
    /// not of the motion.
    pub(super) fn about(&self, point: &Point, height: f64, reference: f64) -> Self {
        let rate = self.tip_rate + self.axis_rate * height;
        let square = rate.norm_squared();
        let along = (point - self.pose.at_height(height)).dot(&rate);
        let tau = if square > 0.0 { (along / square).clamp(self.range.0, self.range.1) } else { 0.0 };
        let (tip, direction) = self.at(tau);
        let Some(axis) = Direction::try_new(direction, 0.5) else { return *self };
        Self {
            pose: Pose { tip: tip.into(), axis },
            range: (self.range.0 - tau, self.range.1 - tau),
            top_error: self.top_error + (direction.norm() - 1.0).abs() * reference,
            ..*self
        }
    }

    /// Bound on the error of the axis point at `height`: the error is affine along the axis, its norm convex.
    pub(super) fn error_at(&self, height: f64, reference: f64) -> f64 {
        let share = height / reference;
        (1.0 - share).abs() * self.tip_error + share.abs() * self.top_error
    }

    /// How far tip and reference point go from the pose along the line, mm.
    pub(super) fn way(&self, reference: f64) -> f64 {
        let rate = self.tip_rate.norm().max((self.tip_rate + self.axis_rate * reference).norm());
        rate * self.range.1.max(-self.range.0)
    }

    /// Bound on how far any point of a body about the axis, between two heights and within a radius, goes from where it
    /// is at tau 0; turns about the axis do not count.
    pub(super) fn travel(&self, heights: (f64, f64), radius: f64, reference: f64) -> f64 {
        let along = |height: f64| (self.tip_rate + self.axis_rate * height).norm() + self.error_at(height, reference);
        // The turn by the shortest way moves a point at the radius by at most its angle, which the chord 2 sin(a/2)
        // bounds to within pi/2.
        let turn = self.turn + self.axis_error(reference);
        along(heights.0).max(along(heights.1)) + std::f64::consts::FRAC_PI_2 * radius * turn
    }

    /// Bound on the error of the axis direction.
    pub(super) fn axis_error(&self, reference: f64) -> f64 {
        (self.tip_error + self.top_error) / reference
    }
}

impl Node {
    /// True where an instant lies in one of the node's blocks.
    pub(super) fn holds(&self, when: Instant) -> bool {
        (self.blocks.0 as usize..self.blocks.1 as usize).contains(&when.block)
    }
}

impl Stretch {
    /// Linear motion between two shares of a block, with the block's own bound.
    pub(super) fn new(motion: &impl BlockMotion, block: usize, from: f64, to: f64, reference: f64) -> Self {
        let ends = Ends::of(motion, block, (from, to), reference);
        Part::between(motion, block, (from, to), reference, ends).stretch
    }

    pub(super) fn middle(&self) -> Instant {
        Instant { block: self.block as usize, share: 0.5 * (self.from + self.to) }
    }
}

impl Part {
    /// The whole of a stretch.
    pub(super) fn of(stretch: &Stretch) -> Self {
        Self { stretch: *stretch, ends: None }
    }

    fn between(motion: &impl BlockMotion, block: usize, (from, to): (f64, f64), reference: f64, ends: Ends) -> Self {
        let Ends { poses: [first, last], bends } = &ends;
        let pose = motion.pose(block, 0.5 * (from + to));
        let tip_rate = (last.tip - first.tip) * 0.5;
        let axis_rate = (last.axis.into_inner() - first.axis.into_inner()) * 0.5;
        // The model runs parallel to the chord, through the middle pose; both may lie off the chord.
        let off = |height: f64, bend: f64| {
            let middle = (first.at_height(height).coords + last.at_height(height).coords) * 0.5;
            (pose.at_height(height).coords - middle).norm() + bend
        };
        let (tip_error, top_error) = (off(0.0, bends[0]), off(reference, bends[1]));
        let (range, turn) = (WHOLE, axis_rate.norm());
        let linear = Linear { pose, tip_rate, axis_rate, range, turn, tip_error, top_error };
        Self { stretch: Stretch { block: block as u32, from, to, linear }, ends: Some(ends) }
    }

    /// Both halves; none where the shares can no longer be told apart.
    pub(super) fn halves(&self, motion: &impl BlockMotion, reference: f64) -> Option<[Self; 2]> {
        let Stretch { block, from, to, linear } = &self.stretch;
        let middle = 0.5 * (from + to);
        if middle <= *from || middle >= *to {
            return None;
        }
        let block = *block as usize;
        let ends = self.ends.unwrap_or_else(|| Ends::of(motion, block, (*from, *to), reference));
        let ([first, last], bends) = (ends.poses, ends.bends.map(|bend| 0.25 * bend));
        let half = |from, to, poses| Self::between(motion, block, (from, to), reference, Ends { poses, bends });
        Some([half(*from, middle, [first, linear.pose]), half(middle, *to, [linear.pose, last])])
    }
}

impl MotionTree {
    /// Gathers the blocks that `wanted` picks. Blocks whose chords are off by more than `sag` mm are split, up to
    /// `MOST_PARTS` parts; what is left is split where it matters, on the way.
    pub(super) fn new(
        motion: &impl BlockMotion,
        reference: f64,
        sag: f64,
        wanted: impl Fn(usize) -> bool + Sync + Send,
    ) -> Self {
        const MOST_PARTS: f64 = 8.0;
        let parts_of = |block: usize| {
            let bound =
                [0.0, reference].map(|h| motion.chord_bound(block, 0.0, 1.0, h)).into_iter().fold(0.0, f64::max);
            let parts = (bound / sag).sqrt().ceil().clamp(1.0, MOST_PARTS);
            let share = move |k: usize| k as f64 / parts;
            (0..parts as usize).map(move |part| Stretch::new(motion, block, share(part), share(part + 1), reference))
        };
        let blocks = (0..motion.blocks()).into_par_iter().filter(|block| wanted(*block));
        let leaves: Vec<Stretch> = blocks.flat_map_iter(parts_of).collect();
        let Some(first) = leaves.first() else { return Self { nodes: Vec::new(), reference } };
        let unset = Node { stretch: *first, blocks: (0, 0), right: 0 };
        let mut nodes = vec![unset; 2 * leaves.len() - 1];
        grow(&mut nodes, 0, &leaves, reference);
        Self { nodes, reference }
    }

    /// For every node a box that holds what the body sweeps.
    pub(super) fn boxes(&self, body: &Body) -> Vec<Bounds> {
        let mut boxes = vec![Bounds { low: Vector::zeros(), high: Vector::zeros() }; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate().rev() {
            boxes[index] = if node.right == 0 {
                swept_box(&node.stretch.linear, body, self.reference)
            } else {
                boxes[index + 1].union(&boxes[node.right as usize])
            };
        }
        boxes
    }
}

/// Fills `nodes`, the first of which has the index `base` in the tree, with the tree over some leaves: one fewer than twice
/// their number.
fn grow(nodes: &mut [Node], base: usize, leaves: &[Stretch], reference: f64) {
    /// Trees over fewer leaves are not worth a thread.
    const SMALL: usize = 256;
    let (Some((node, below)), [first, .., last] | [first @ last]) = (nodes.split_first_mut(), leaves) else { return };
    let blocks = (first.block, last.block + 1);
    if leaves.len() == 1 {
        *node = Node { stretch: *first, blocks, right: 0 };
        return;
    }
    let (stretch, split) = join(leaves, reference);
    let right = base + 2 * split;
    *node = Node { stretch, blocks, right: right as u32 };
    let (left_nodes, right_nodes) = below.split_at_mut(2 * split - 1);
    let (left_leaves, right_leaves) = leaves.split_at(split);
    let mut grow_left = || grow(left_nodes, base + 1, left_leaves, reference);
    let mut grow_right = || grow(right_nodes, right, right_leaves, reference);
    if leaves.len() < SMALL {
        grow_left();
        grow_right();
    } else {
        rayon::join(grow_left, grow_right);
    }
}

impl Bounds {
    fn union(&self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// True where a box around the segment between two points stays farther than `margin` from this box.
    pub(super) fn misses(&self, a: &Vector, b: &Vector, margin: f64) -> bool {
        (0..3).any(|i| a[i].max(b[i]) < self.low[i] - margin || a[i].min(b[i]) > self.high[i] + margin)
    }
}

fn swept_box(linear: &Linear, body: &Body, reference: f64) -> Bounds {
    let mut bounds = Bounds { low: Vector::repeat(f64::INFINITY), high: Vector::repeat(f64::NEG_INFINITY) };
    for height in [body.heights.0, body.heights.1] {
        // A disc of radius R about the axis d reaches R sqrt(1 - d_i^2) along coordinate i; R is enough.
        let margin = Vector::repeat(body.radius + linear.error_at(height, reference));
        for tau in [-1.0, 1.0] {
            let (tip, axis) = linear.at(tau);
            let point = tip + axis * height;
            bounds = bounds.union(&Bounds { low: point - margin, high: point + margin });
        }
    }
    bounds
}

/// One linear motion for several stretches, about the middle pose of the middle one.
///
/// Each end of a stretch's chord is laid at the tau of its foot on the joint motion of tip and reference point; between
/// the ends of a chord the error is at most that of the worse end, so the bound holds for the chords, and the stretches'
/// own errors are added. Beside it which leaf begins the second half: where the motion leaves the line farthest, about the
/// middle.
fn join(leaves: &[Stretch], reference: f64) -> (Stretch, usize) {
    let middle = &leaves[leaves.len() / 2];
    let (first, last) = (&leaves[0], &leaves[leaves.len() - 1]);
    let pose = middle.linear.pose;
    let ends = (first.linear.at(-1.0), last.linear.at(1.0));
    let tip_rate = (ends.1.0 - ends.0.0) * 0.5;
    let axis_rate = (ends.1.1 - ends.0.1) * 0.5;
    let top_rate = tip_rate + axis_rate * reference;
    let square = tip_rate.norm_squared() + top_rate.norm_squared();
    let turn = axis_rate.norm();
    let mut linear = Linear { pose, tip_rate, axis_rate, range: (0.0, 0.0), turn, tip_error: 0.0, top_error: 0.0 };
    let mut corner = (0.0, leaves.len() / 2);
    for (index, leaf) in leaves.iter().enumerate() {
        for end in [-1.0, 1.0] {
            let (tip, axis) = leaf.linear.at(end);
            let tip_off = tip - pose.tip.coords;
            let top_off = tip_off + (axis - pose.axis.into_inner()) * reference;
            let along = tip_off.dot(&tip_rate) + top_off.dot(&top_rate);
            let tau = if square > 0.0 { (along / square).clamp(-MOST, MOST) } else { 0.0 };
            linear.range = (linear.range.0.min(tau), linear.range.1.max(tau));
            let [tip_off, top_off] = [(tip_off - tip_rate * tau).norm(), (top_off - top_rate * tau).norm()];
            linear.tip_error = linear.tip_error.max(tip_off + leaf.linear.tip_error);
            linear.top_error = linear.top_error.max(top_off + leaf.linear.top_error);
            let from_chord = |off: Vector, rate: Vector| {
                let share =
                    if square > 0.0 { off.dot(&rate) / rate.norm_squared().max(f64::MIN_POSITIVE) } else { 0.0 };
                (off - rate * share).norm()
            };
            let off = from_chord(tip - ends.0.0, tip_rate)
                + from_chord(tip - ends.0.0 + (axis - ends.0.1) * reference, top_rate);
            if end < 0.0 && index > 0 && off > corner.0 {
                corner = (off, index);
            }
        }
    }
    let split = if corner.0 > STRAIGHT { corner.1 } else { leaves.len() / 2 };
    let stretch = Stretch { block: middle.block, from: middle.from, to: middle.to, linear };
    (stretch, split.clamp(leaves.len().div_ceil(4), (3 * leaves.len()) / 4))
}
