//! Writes a tool path as APT text that other systems read. Uses `diagnostic` and `motion`.

use crate::diagnostic::{Diagnostic, Result};
use crate::motion::path::{FeedReference, Pass, PassMotion, ToolPath};
use crate::motion::pose::Pose;
use std::fmt::Write;

/// Halvings of a piece of a ruled motion after which it is taken as it is.
const DEEPEST: u32 = 20;

/// Writes a path: straight GOTOs that stay within the path's linearization of it along the flutes, feeds of the tip in
/// mm/min. What APT does not carry, such as strips and the times of rotations in place, is not in the file.
///
/// # Errors
/// A pass without a tool axis, numbers that are not finite.
pub fn write(path: &ToolPath) -> Result<String> {
    let mut text = String::new();
    let tool = &path.tool;
    let plain: String = path.name.chars().map(|c| if c.is_ascii_graphic() { c } else { ' ' }).collect();
    // Writing to a string cannot fail.
    let _ = writeln!(text, "PARTNO/{plain}\nUNITS/MM\nMULTAX/ON");
    let _ = writeln!(text, "LOADTL/{},LENGTH,{}", tool.number, number(tool.gauge_length, 6)?);
    let _ = writeln!(text, "SPINDL/RPM,{},CLW", number(path.spindle_rpm, 3)?);
    let mut feed = None;
    let mut at: Option<Pose> = None;
    for (index, pass) in path.passes.iter().enumerate() {
        let stops = stops(path, index, pass)?;
        for (pose, asked) in stops {
            let Some(last) = at.replace(pose) else {
                let _ = writeln!(text, "FROM/{}", place(&pose)?);
                continue;
            };
            if last == pose {
                continue;
            }
            if pass.kind.is_rapid() {
                text.push_str("RAPID\n");
            } else {
                let asked = tip_feed(path, &last, &pose, asked);
                let word = number(asked, 4)?;
                if feed.as_ref() != Some(&word) {
                    let _ = writeln!(text, "FEDRAT/{word},MMPM");
                    feed = Some(word);
                }
            }
            let _ = writeln!(text, "GOTO/{}", place(&pose)?);
        }
    }
    text.push_str("FINI\n");
    Ok(text)
}

/// Feed of the tip, mm/min, over a piece that takes `asked` seconds, or as long as the feed reference wants.
fn tip_feed(path: &ToolPath, from: &Pose, to: &Pose, asked: Option<f64>) -> f64 {
    let flute = path.tool.flute_length;
    let way = |height: f64| (to.at_height(height) - from.at_height(height)).norm();
    let tip = way(0.0);
    let reference = match path.feed_reference {
        FeedReference::Tip => tip,
        FeedReference::Mid => way(flute / 2.0),
        FeedReference::Top => way(flute),
        FeedReference::Fastest => tip.max(way(flute)),
        FeedReference::Mean => (tip + 4.0 * way(flute / 2.0) + way(flute)) / 6.0,
    };
    let seconds = asked.filter(|seconds| *seconds > 0.0).unwrap_or(60.0 * reference / path.cut_feed);
    if tip > 1e-9 && seconds > 0.0 { 60.0 * tip / seconds } else { path.cut_feed }
}

/// The poses of a pass, each with the seconds since the one before where the pass has times of its own.
fn stops(path: &ToolPath, index: usize, pass: &Pass) -> Result<Vec<(Pose, Option<f64>)>> {
    let nowhere = || {
        Diagnostic::error(format!("pass {index} has no tool axis everywhere"))
            .help("keep the two rails of a pass apart")
    };
    let motion = &pass.motion;
    let pose = |t: f64| motion.pose(t).ok_or_else(nowhere);
    let breaks = motion.breaks();
    let mut stops = Vec::with_capacity(breaks.len());
    for (k, t) in breaks.iter().enumerate() {
        let Some(before) = k.checked_sub(1).map(|k| breaks[k]) else {
            stops.push((pose(*t)?, None));
            continue;
        };
        if matches!(motion, PassMotion::Ruled(_)) {
            refine(path, &pose, (before, pose(before)?), (*t, pose(*t)?), 0, &mut stops)?;
        } else {
            stops.push((pose(*t)?, motion.seconds(before, *t)));
        }
    }
    Ok(stops)
}

/// Halves a piece of a curved motion until tip straight and axis on the great circle follow it.
fn refine(
    path: &ToolPath,
    pose: &impl Fn(f64) -> Result<Pose>,
    from: (f64, Pose),
    to: (f64, Pose),
    depth: u32,
    stops: &mut Vec<(Pose, Option<f64>)>,
) -> Result<()> {
    let mid = (from.0 + to.0) / 2.0;
    let mut off: f64 = 0.0;
    for share in [0.25, 0.5, 0.75] {
        let real = pose(from.0 + (to.0 - from.0) * share)?;
        // The nearest place of the straight piece, by the tip's way along it.
        let (way, size) = (to.1.tip - from.1.tip, (to.1.tip - from.1.tip).norm_squared());
        let along = if size > 0.0 { way.dot(&(real.tip - from.1.tip)) / size } else { share };
        off = off.max(real.distance_along(&from.1.interpolate(&to.1, along.clamp(0.0, 1.0)), path.tool.flute_length));
    }
    if off > path.linearization && depth < DEEPEST {
        let middle = (mid, pose(mid)?);
        refine(path, pose, from, middle, depth + 1, stops)?;
        return refine(path, pose, middle, to, depth + 1, stops);
    }
    stops.push((to.1, None));
    Ok(())
}

fn place(pose: &Pose) -> Result<String> {
    let (tip, axis) = (pose.tip, pose.axis);
    let tip = [tip.x, tip.y, tip.z].map(|value| number(value, 6));
    let axis = [axis.x, axis.y, axis.z].map(|value| number(value, 9));
    let words: Vec<String> = tip.into_iter().chain(axis).collect::<Result<_>>()?;
    Ok(words.join(","))
}

fn number(value: f64, decimals: usize) -> Result<String> {
    if !value.is_finite() {
        return Err(Diagnostic::error(format!("the tool path holds {value}, which is not a finite number")));
    }
    let text = format!("{value:.decimals$}");
    // Never minus zero.
    let zero = text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.');
    Ok(if zero { text.trim_start_matches('-').to_owned() } else { text })
}
