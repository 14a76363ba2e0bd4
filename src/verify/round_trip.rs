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

/// Measures every feed move against the nearest place of the path; the path's moves and the program's are taken in
/// order, so that passes which cross are not confused. `None` when one of both has no cutting pass, or a pass has no
/// poses.
pub(super) fn round_trip(motion: &impl BlockMotion, path: &ToolPath, flute_length: f64) -> Option<RoundTrip> {
    let wanted = |pass: &&Pass| matches!(pass.kind, PassKind::Cut | PassKind::LeadIn | PassKind::LeadOut);
    let groups: Vec<Vec<&Pass>> = path
        .passes
        .chunk_by(|a, b| a.kind.is_rapid() == b.kind.is_rapid())
        .filter(|group| group.first().is_some_and(|p| !p.kind.is_rapid()))
        .map(|group| group.iter().collect())
        .collect();
    let feed: Vec<usize> = (0..motion.blocks()).filter(|b| !motion.is_rapid(*b)).collect();
    let runs: Vec<&[usize]> = feed.chunk_by(|a, b| a + 1 == *b).collect();
    let pairs: Vec<(Vec<&Pass>, Vec<usize>)> = if groups.len() == runs.len() {
        groups.into_iter().zip(runs).map(|(group, run)| (group, run.to_vec())).collect()
    } else {
        vec![(groups.concat(), feed)]
    };
    let per_pair: Option<Vec<RoundTrip>> =
        pairs.par_iter().map(|(group, run)| compare(motion, run, group, flute_length, |pass| wanted(&pass))).collect();
    let worst = per_pair?
        .into_iter()
        .reduce(|a, b| RoundTrip { tip_max: a.tip_max.max(b.tip_max), axis_max: a.axis_max.max(b.axis_max) })?;
    Some(worst)
}

fn compare(
    motion: &impl BlockMotion,
    run: &[usize],
    group: &[&Pass],
    flute_length: f64,
    wanted: impl Fn(&Pass) -> bool,
) -> Option<RoundTrip> {
    let (places, poses) = table(group)?;
    let mut worst = RoundTrip::default();
    let mut last = 0;
    for (block, share) in run.iter().flat_map(|b| [(*b, 0.0), (*b, 0.5), (*b, 1.0)]) {
        let pose = motion.pose(block, share);
        last = nearest_from(&pose, &poses, last, flute_length);
        // Table pose k joins the places k - 1 and k; where passes meet, one of them has no length and its other
        // neighbour counts too.
        let best = (last.saturating_sub(2)..=last + 1)
            .filter_map(|k| places.get(k))
            .filter_map(|place| nearest_in(&pose, place, flute_length).map(|near| (near, place)))
            .min_by(|a, b| a.0.1.total_cmp(&b.0.1));
        let Some(((near, _), place)) = best else { continue };
        if wanted(place.pass) {
            worst.tip_max = worst.tip_max.max((pose.tip - near.tip).norm());
            worst.axis_max = worst.axis_max.max(pose.axis_angle(&near));
        }
    }
    Some(worst)
}

/// The places of a chain of passes in order, and the poses at their ends: one more than places, joints between passes
/// counted as places of no length.
fn table<'a>(group: &[&'a Pass]) -> Option<(Vec<Place<'a>>, Vec<Pose>)> {
    let (mut places, mut poses) = (Vec::new(), Vec::new());
    for pass in group {
        let breaks = pass.motion.breaks();
        let first = *breaks.first()?;
        if let Some(last) = places.last().map(|p: &Place<'a>| (p.pass, p.to)) {
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
