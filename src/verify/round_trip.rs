//! The program's motion against the tool path it was posted from, as curves. Uses `motion` and the other files of this
//! module.

use super::motion_tree::BlockMotion;
use crate::motion::{Pass, PassKind, Pose, ToolPath};
use rayon::prelude::*;

/// Largest distances of the program from the tool path, over the cutting passes with their lead-ins and lead-outs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RoundTrip {
    /// Between tips, mm.
    pub tip_max: f64,
    /// Between axes, radians.
    pub axis_max: f64,
}

/// Poses along a pass between which the nearest place is looked for.
const PER_SPAN: usize = 8;

/// A piece of the tool path between two neighbouring table poses.
struct Place<'a> {
    pass: &'a Pass,
    from: f64,
    to: f64,
}

/// The end of a block next to a link that is farther from the path than this, mm, while its other end is not, belongs to
/// a way out of the part or back that is no part of the path: to where rotary axes are turned back.
const ASIDE: f64 = 0.1;

/// Measures every feed move against the nearest place of the path, but for those of which `links` says that they lead
/// through free space and which are no part of the path. Behind a link the path is looked for anew, never before where
/// it was met last, so that passes which cross are not confused. `None` when one of both has no cutting pass, or a pass has no poses.
pub(super) fn round_trip(
    motion: &impl BlockMotion,
    links: &[bool],
    path: &ToolPath,
    flute_length: f64,
) -> Option<RoundTrip> {
    if path.passes.iter().all(|pass| pass.kind.is_rapid()) {
        return None;
    }
    let (places, poses) = table(&path.passes)?;
    let chart = Chart { motion, places: &places, poses: &poses, flute_length };
    let feed: Vec<usize> = (0..motion.blocks()).filter(|block| !motion.is_rapid(*block)).collect();
    let on_path = |block: &usize| {
        links.get(*block) == Some(&false) || [0.0, 1.0].map(|share| chart.end(*block, share, 0).1 <= ASIDE) == [true; 2]
    };
    let mut blocks: Vec<usize> = feed.par_iter().filter(|block| on_path(block)).copied().collect();
    if blocks.is_empty() {
        blocks = feed;
    }
    let mut met = 0;
    let runs: Vec<Run<'_>> = blocks
        .chunk_by(|a, b| a + 1 == *b)
        .map(|blocks| {
            let run = chart.run(blocks, met);
            met = run.start;
            run
        })
        .collect();
    let per_run: Vec<RoundTrip> = runs.par_iter().map(|run| chart.compare(run)).collect();
    per_run
        .into_iter()
        .reduce(|a, b| RoundTrip { tip_max: a.tip_max.max(b.tip_max), axis_max: a.axis_max.max(b.axis_max) })
}

/// Blocks between links.
struct Run<'a> {
    blocks: &'a [usize],
    /// Table pose at which it begins.
    start: usize,
    /// Its first block only leads to the path, its last one only away from it.
    arrives: bool,
    leaves: bool,
}

/// A motion beside a path.
struct Chart<'a, M> {
    motion: &'a M,
    places: &'a [Place<'a>],
    poses: &'a [Pose],
    flute_length: f64,
}

impl<M: BlockMotion> Chart<'_, M> {
    /// The run of these blocks, looked for from a table pose on.
    fn run<'b>(&self, blocks: &'b [usize], from: usize) -> Run<'b> {
        let end = |block: Option<&usize>, share: f64| block.map_or((from, 0.0), |block| self.end(*block, share, from));
        let [start, arrived] = [0.0, 1.0].map(|share| end(blocks.first(), share));
        let [left, aside] = [0.0, 1.0].map(|share| end(blocks.last(), share));
        let (arrives, leaves) = (start.1 > ASIDE && arrived.1 <= ASIDE, aside.1 > ASIDE && left.1 <= ASIDE);
        Run { blocks, start: if arrives { arrived.0 } else { start.0 }, arrives, leaves }
    }

    /// The table pose, from one on, that is nearest to a place of a block, the first of equal ones, and how far the path
    /// is there, mm.
    fn end(&self, block: usize, share: f64, from: usize) -> (usize, f64) {
        let pose = &self.motion.pose(block, share);
        let candidates = self.poses.iter().enumerate().skip(from);
        let squares = candidates.map(|(index, other)| (index, square_distance(pose, other, self.flute_length)));
        let (index, _) = squares.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((from, 0.0));
        let square = self.place(pose, index).map_or(f64::INFINITY, |((_, square), _)| square);
        (index, square.sqrt())
    }

    /// The nearest pose about a table pose, with its squared distance and the place where it is.
    fn place(&self, pose: &Pose, index: usize) -> Option<((Pose, f64), &Place<'_>)> {
        // Table pose k joins the places k - 1 and k; where passes meet, one of them has no length and its other
        // neighbour counts too.
        (index.saturating_sub(2)..=index + 1)
            .filter_map(|k| self.places.get(k))
            .filter_map(|place| nearest_in(pose, place, self.flute_length).map(|near| (near, place)))
            .min_by(|a, b| a.0.1.total_cmp(&b.0.1))
    }

    fn compare(&self, run: &Run<'_>) -> RoundTrip {
        let mut worst = RoundTrip::default();
        let mut index = run.start;
        let ends = (run.blocks.first(), run.blocks.last());
        for (block, share) in run.blocks.iter().flat_map(|block| [0.0, 0.5, 1.0].map(|share| (block, share))) {
            let arriving = run.arrives && Some(block) == ends.0 && share < 1.0;
            let leaving = run.leaves && Some(block) == ends.1 && share > 0.0;
            if arriving || leaving {
                continue;
            }
            let pose = self.motion.pose(*block, share);
            index = nearest_from(&pose, self.poses, index, self.flute_length);
            let Some(((near, _), place)) = self.place(&pose, index) else { continue };
            if matches!(place.pass.kind, PassKind::Cut | PassKind::LeadIn | PassKind::LeadOut) {
                worst.tip_max = worst.tip_max.max((pose.tip - near.tip).norm());
                worst.axis_max = worst.axis_max.max(pose.axis_angle(&near));
            }
        }
        worst
    }
}

/// The places of a chain of passes in order, and the poses at their ends: one more than places, joints between passes
/// counted as places of no length.
fn table(passes: &[Pass]) -> Option<(Vec<Place<'_>>, Vec<Pose>)> {
    let (mut places, mut poses) = (Vec::new(), Vec::new());
    for pass in passes {
        let breaks = pass.motion.breaks();
        let first = *breaks.first()?;
        if let Some(last) = places.last().map(|p: &Place<'_>| (p.pass, p.to)) {
            places.push(Place { pass: last.0, from: last.1, to: last.1 });
        }
        poses.push(pass.motion.pose(first)?);
        for span in breaks.windows(2) {
            let at = |k: usize| span[0] + (span[1] - span[0]) * k as f64 / PER_SPAN as f64;
            for k in 0..PER_SPAN {
                places.push(Place { pass, from: at(k), to: at(k + 1) });
                poses.push(pass.motion.pose(at(k + 1))?);
            }
        }
    }
    Some((places, poses))
}

/// Squared distance of two tools: tips and ends of flutes.
fn square_distance(a: &Pose, b: &Pose, flute_length: f64) -> f64 {
    (a.tip - b.tip).norm_squared() + (a.at_height(flute_length) - b.at_height(flute_length)).norm_squared()
}

/// The nearest table pose, walking on from the last one while it gets nearer, and looking a little ahead.
fn nearest_from(pose: &Pose, poses: &[Pose], last: usize, flute_length: f64) -> usize {
    const AHEAD: usize = 2 * PER_SPAN;
    let distance = |k: usize| square_distance(pose, &poses[k], flute_length);
    let mut best = last.min(poses.len().saturating_sub(1));
    let mut least = distance(best);
    let mut k = best;
    while k + 1 < poses.len() && k < best + AHEAD {
        k += 1;
        if distance(k) <= least {
            (best, least) = (k, distance(k));
        }
    }
    best
}

/// The nearest pose within a place, with its squared distance: from either end, steps to the foot on the tangent
/// (Gauss and Newton), the tangent from a difference of poses.
fn nearest_in(pose: &Pose, place: &Place<'_>, flute_length: f64) -> Option<(Pose, f64)> {
    let width = place.to - place.from;
    let at = |t: f64| place.pass.motion.pose(t.clamp(place.from, place.to));
    let mut best: Option<(Pose, f64)> = None;
    for start in [place.from, place.to] {
        let mut t = start;
        for _ in 0..FOOT_STEPS {
            let near = at(t)?;
            let square = square_distance(pose, &near, flute_length);
            if best.is_none_or(|b| square < b.1) {
                best = Some((near, square));
            }
            let (before, after) = ((t - DIFFERENCE * width).max(place.from), (t + DIFFERENCE * width).min(place.to));
            let (a, b) = (at(before)?, at(after)?);
            let ways =
                [0.0, flute_length].map(|h| (b.at_height(h) - a.at_height(h), pose.at_height(h) - near.at_height(h)));
            let length: f64 = ways.iter().map(|(way, _)| way.norm_squared()).sum();
            let along: f64 = ways.iter().map(|(way, off)| way.dot(off)).sum();
            let next = (t + (after - before) * along / length).clamp(place.from, place.to);
            if length == 0.0 || (next - t).abs() <= 1e-9 * width {
                break;
            }
            t = next;
        }
    }
    best
}

/// Steps to a foot; each gains a factor of about the distance over the radius of curvature.
const FOOT_STEPS: usize = 12;

/// Half the distance of the poses that give a tangent, as a share of the place.
const DIFFERENCE: f64 = 1e-3;
