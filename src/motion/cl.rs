//! CL files: the tool path as JSON text and back, exact to the last bit. Uses `diagnostic`, `geometry` and the rest of
//! `motion`.
//!
//! Format `regulus-cl`, version 1. Part frame, mm, mm/min, 1/min. The head names job, tool, feed and tolerances;
//! `passes` lists the motions in order of execution, each starting where the one before ends. A pass either rules a
//! surface between two rails (`ruled`: B-splines of one degree and one knot vector) or goes through poses (`poses`:
//! tip x, y, z and unit axis i, j, k from tip toward spindle), maybe with times of its own (`timed`: the poses, the
//! seconds from the start of the pass at each, the indices of those where there may be a corner, and lines of the file
//! that they came from).

use super::path::{FeedReference, Pass, PassKind, PassMotion, RuledMotion, TimedPoses, ToolPath, ToolSummary};
use super::pose::{Pose, angle_between};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::knots::Knots;
use crate::geometry::{Direction, Point, SplineCurve, Vector};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

const FORMAT: &str = "regulus-cl";
const VERSION: u32 = 1;
/// How far from 1 the length of an axis may be: what writing a unit vector with 7 digits leaves.
const AXIS_LENGTH_TOLERANCE: f64 = 1e-6;
/// Axes whose length is this near to 1 are taken as they are, so that what was written is what is read.
const UNIT_ROUNDING: f64 = 1e-14;
/// Largest jump between the end of a pass and the start of the next, mm and radians.
const JOINT_TOLERANCE: f64 = 1e-6;

/// The file. `P` is a pass: parsed or as raw text.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File<P> {
    format: String,
    version: u32,
    name: String,
    tool: ToolSummary,
    cut_feed: f64,
    feed_reference: FeedReference,
    spindle_rpm: f64,
    linearization: f64,
    tolerance: Tolerance,
    passes: Vec<P>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Tolerance {
    overcut: f64,
    undercut: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FilePass {
    kind: PassKind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    strip: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ruled: Option<Ruled>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    poses: Option<Vec<[f64; 6]>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    timed: Option<Timed>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Timed {
    poses: Vec<[f64; 6]>,
    seconds: Vec<f64>,
    corners: Vec<usize>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    lines: Vec<usize>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Ruled {
    degree: usize,
    knots: Vec<f64>,
    lower: Vec<[f64; 3]>,
    upper: Vec<[f64; 3]>,
    lower_height: f64,
}

/// Writes a tool path, one pass a line. Refuses a path that holds a number which is not finite or rails on different
/// knots: such a path has no file.
pub fn write(path: &ToolPath) -> Result<String> {
    let mut passes = Vec::with_capacity(path.passes.len());
    for (i, pass) in path.passes.iter().enumerate() {
        let text = file_pass(pass).and_then(|p| to_json(&p)).map_err(|mut e| {
            e.message = format!("pass {i}: {}", e.message);
            e
        })?;
        passes.push(text);
    }
    let head = File::<()> {
        format: FORMAT.to_owned(),
        version: VERSION,
        name: path.name.clone(),
        tool: path.tool.clone(),
        cut_feed: path.cut_feed,
        feed_reference: path.feed_reference,
        spindle_rpm: path.spindle_rpm,
        linearization: path.linearization,
        tolerance: Tolerance { overcut: path.overcut_tolerance, undercut: path.undercut_tolerance },
        passes: Vec::new(),
    };
    let numbers =
        [path.cut_feed, path.spindle_rpm, path.linearization, path.overcut_tolerance, path.undercut_tolerance];
    all_finite(numbers.iter().chain(&[path.tool.gauge_length, path.tool.flute_length]))?;
    let head = to_json(&head)?;
    let head = head.trim_end_matches("]}");
    Ok(format!("{head}\n{}\n]}}\n", passes.join(",\n")))
}

/// Reads a tool path; `file` is its name in messages.
pub fn read(text: &str, file: &str) -> Result<ToolPath> {
    let raw: File<&RawValue> = serde_json::from_str(text).map_err(|e| located(&e, text, 0).in_file(file))?;
    check_head(&raw).map_err(|e| e.in_file(file).at_offset(text, 0))?;
    let mut passes: Vec<Pass> = Vec::with_capacity(raw.passes.len());
    for (i, raw_pass) in raw.passes.iter().enumerate() {
        let start = offset_in(text, raw_pass.get());
        let parsed: FilePass =
            serde_json::from_str(raw_pass.get()).map_err(|e| located(&e, text, start).in_file(file))?;
        let here = |mut e: Box<Diagnostic>| {
            e.message = format!("pass {i}: {}", e.message);
            e.in_file(file).at_offset(text, start)
        };
        let pass = pass(parsed).map_err(here)?;
        if let Some(before) = passes.last() {
            check_joint(before, &pass).map_err(here)?;
        }
        passes.push(pass);
    }
    if passes.is_empty() {
        return Err(Diagnostic::error("the tool path has no pass")
            .in_file(file)
            .at_offset(text, 0)
            .help("list at least one in `passes`"));
    }
    Ok(ToolPath {
        name: raw.name,
        tool: raw.tool,
        cut_feed: raw.cut_feed,
        feed_reference: raw.feed_reference,
        spindle_rpm: raw.spindle_rpm,
        linearization: raw.linearization,
        overcut_tolerance: raw.tolerance.overcut,
        undercut_tolerance: raw.tolerance.undercut,
        passes,
    })
}

fn to_json(value: &impl Serialize) -> Result<String> {
    serde_json::to_string(value).map_err(|e| Diagnostic::error(format!("the tool path cannot be written: {e}")))
}

/// JSON has no word for numbers that are not finite.
fn all_finite<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> Result<()> {
    match numbers.into_iter().find(|n| !n.is_finite()) {
        None => Ok(()),
        Some(n) => Err(Diagnostic::error(format!("the tool path holds {n}, which is not a finite number"))),
    }
}

fn file_pass(pass: &Pass) -> Result<FilePass> {
    let mut file = FilePass { kind: pass.kind, strip: pass.strip, ruled: None, poses: None, timed: None };
    match &pass.motion {
        PassMotion::Ruled(motion) => {
            let knots = motion.lower.knots();
            if motion.upper.knots() != knots {
                return Err(Diagnostic::error("the rails have different knots"));
            }
            let rail = |curve: &SplineCurve| curve.control().iter().map(|p| p.coords.into()).collect();
            let ruled = Ruled {
                degree: knots.degree(),
                knots: knots.values().to_vec(),
                lower: rail(&motion.lower),
                upper: rail(&motion.upper),
                lower_height: motion.lower_height,
            };
            all_finite(ruled.lower.iter().chain(&ruled.upper).flatten().chain([&ruled.lower_height]))?;
            file.ruled = Some(ruled);
        }
        PassMotion::Poses(poses) => file.poses = Some(file_poses(poses)?),
        PassMotion::Timed(timed) => {
            all_finite(&timed.seconds)?;
            file.timed = Some(Timed {
                poses: file_poses(&timed.poses)?,
                seconds: timed.seconds.clone(),
                corners: timed.corners.clone(),
                lines: timed.lines.clone(),
            });
        }
    }
    Ok(file)
}

fn file_poses(poses: &[Pose]) -> Result<Vec<[f64; 6]>> {
    let poses: Vec<[f64; 6]> =
        poses.iter().map(|p| [p.tip.x, p.tip.y, p.tip.z, p.axis.x, p.axis.y, p.axis.z]).collect();
    all_finite(poses.iter().flatten())?;
    Ok(poses)
}

fn check_head<P>(file: &File<P>) -> Result<()> {
    if file.format != FORMAT {
        return Err(Diagnostic::error(format!("format \"{}\" is not that of a tool path", file.format))
            .help(format!("this command reads \"format\":\"{FORMAT}\"")));
    }
    if file.version != VERSION {
        return Err(Diagnostic::error(format!("version {} of the {FORMAT} format is not known", file.version))
            .help(format!("write the tool path again with this program, which knows version {VERSION}")));
    }
    let tool = &file.tool;
    for (key, value, zero_allowed) in [
        ("cut_feed", file.cut_feed, false),
        ("spindle_rpm", file.spindle_rpm, true),
        ("linearization", file.linearization, false),
        ("tolerance.overcut", file.tolerance.overcut, true),
        ("tolerance.undercut", file.tolerance.undercut, true),
        ("tool.flute_length", tool.flute_length, false),
        ("tool.gauge_length", tool.gauge_length, false),
    ] {
        if value < 0.0 || (value == 0.0 && !zero_allowed) {
            return Err(
                Diagnostic::error(format!("`{key}` is {value}")).help(format!("write a positive number for `{key}`"))
            );
        }
    }
    if tool.gauge_length < tool.flute_length {
        return Err(Diagnostic::error(format!(
            "`tool.gauge_length` {} is shorter than `tool.flute_length` {}",
            tool.gauge_length, tool.flute_length
        ))
        .help("write the distance from the tip to the gauge line"));
    }
    Ok(())
}

fn pass(file: FilePass) -> Result<Pass> {
    let motion = match (file.ruled, file.poses, file.timed) {
        (Some(ruled), None, None) => PassMotion::Ruled(ruled_motion(ruled)?),
        (None, Some(poses), None) => PassMotion::Poses(read_poses(&poses)?),
        (None, None, Some(timed)) => PassMotion::Timed(timed_poses(timed)?),
        _ => {
            return Err(
                Diagnostic::error("a pass moves in exactly one way").help("give one of `ruled`, `poses` and `timed`")
            );
        }
    };
    Ok(Pass { kind: file.kind, strip: file.strip, motion })
}

fn ruled_motion(ruled: Ruled) -> Result<RuledMotion> {
    let knots = Knots::new(ruled.degree, ruled.knots, ruled.lower.len())
        .map_err(|e| Diagnostic::error(format!("`ruled`: {e}")).help("correct `degree`, `knots` or `lower`"))?;
    let points = |rail: Vec<[f64; 3]>| rail.into_iter().map(Point::from).collect();
    let rail = |name: &str, control: Vec<[f64; 3]>| {
        SplineCurve::from_knots(knots.clone(), points(control))
            .map_err(|e| Diagnostic::error(format!("`{name}`: {e}")).help("give both rails as many control points"))
    };
    let motion = RuledMotion {
        lower: rail("lower", ruled.lower)?,
        upper: rail("upper", ruled.upper)?,
        lower_height: ruled.lower_height,
    };
    let (low, high) = motion.domain();
    for t in [low, high] {
        if motion.pose(t).is_none() {
            return Err(Diagnostic::error(format!("the rails meet at parameter {t} and span no tool axis"))
                .help("keep `lower` and `upper` apart"));
        }
    }
    Ok(motion)
}

fn read_poses(poses: &[[f64; 6]]) -> Result<Vec<Pose>> {
    if poses.is_empty() {
        return Err(Diagnostic::error("`poses` is empty").help("give at least one pose"));
    }
    poses.iter().enumerate().map(pose).collect()
}

fn timed_poses(timed: Timed) -> Result<TimedPoses> {
    let poses = read_poses(&timed.poses)?;
    let Timed { seconds, corners, lines, .. } = timed;
    if seconds.len() != poses.len() || !(lines.is_empty() || lines.len() == poses.len()) {
        return Err(Diagnostic::error("`timed` has lists of different length")
            .help("give one number of `seconds`, and one of `lines` if any, for each pose"));
    }
    if seconds.windows(2).any(|pair| pair[1] < pair[0]) {
        return Err(Diagnostic::error("`seconds` fall").help("write the time since the start of the pass at each pose"));
    }
    if corners.windows(2).any(|pair| pair[1] <= pair[0]) || corners.last().is_some_and(|last| *last >= poses.len()) {
        return Err(Diagnostic::error("`corners` are no ascending indices of poses")
            .help("write indices from 0, each larger than the one before"));
    }
    Ok(TimedPoses { poses, seconds, corners, lines })
}

fn pose((i, &[x, y, z, a, b, c]): (usize, &[f64; 6])) -> Result<Pose> {
    let axis = Vector::new(a, b, c);
    let length = axis.norm();
    if (length - 1.0).abs() > AXIS_LENGTH_TOLERANCE {
        return Err(Diagnostic::error(format!("the axis of pose {i} has length {length}"))
            .help("write tip x, y, z and the unit axis i, j, k"));
    }
    let axis = if (length - 1.0).abs() <= UNIT_ROUNDING {
        Direction::new_unchecked(axis)
    } else {
        Direction::new_normalize(axis)
    };
    Ok(Pose { tip: Point::new(x, y, z), axis })
}

/// A pass must start where the one before ends: what lies between would be a motion that nobody planned.
fn check_joint(before: &Pass, after: &Pass) -> Result<()> {
    let (Some(end), Some(start)) =
        (before.motion.pose(before.motion.domain().1), after.motion.pose(after.motion.domain().0))
    else {
        return Err(Diagnostic::error("the tool has no pose where this pass begins"));
    };
    let distance = (start.tip - end.tip).norm();
    let angle = angle_between(&start.axis, &end.axis);
    if distance > JOINT_TOLERANCE || angle > JOINT_TOLERANCE {
        return Err(Diagnostic::error(format!(
            "starts {distance:.6} mm and {:.6} degrees away from the end of the pass before it",
            angle.to_degrees()
        ))
        .help("add a pass of kind \"rapid\" between them"));
    }
    Ok(())
}

/// Byte offset of `part` in `text`, of which it is a slice.
fn offset_in(text: &str, part: &str) -> usize {
    (part.as_ptr() as usize).saturating_sub(text.as_ptr() as usize).min(text.len())
}

/// Turns the parser's error about the text from `start` on into a located complaint.
fn located(error: &serde_json::Error, text: &str, start: usize) -> Box<Diagnostic> {
    let rest = text.get(start..).unwrap_or_default();
    let line_start: usize = rest.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum();
    let message = error.to_string();
    // The parser counts lines of the part it saw; the place below counts those of the file.
    let message = message.split_once(" at line ").map_or(message.as_str(), |(m, _)| m);
    Diagnostic::error(format!("not a tool path: {message}"))
        .at_offset(text, start + line_start + error.column().saturating_sub(1))
        .help("write the tool path again with `regulus plan`")
}

#[cfg(test)]
mod tests;
