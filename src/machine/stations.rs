//! Poses along a tool path, close enough together that both branches of the inverse kinematics can be followed from one
//! to the next. Uses `diagnostic` and `motion`.

use super::course::{CoursedPass, Courses};
use super::place::whereabouts;
use super::setup::{InverseSolutions, Setup, Unreachable, unwind};
use crate::diagnostic::{Diagnostic, Result};
use crate::motion::{Pass, PassKind, PassMotion, Pose, ToolPath};

/// Largest turn of the tool axis between neighbouring stations, radians.
const AXIS_STEP: f64 = 0.035;
/// Largest turn of a rotary axis between neighbouring stations of one branch, radians.
const ROTARY_STEP: f64 = 0.35;
/// How near to a pole the approach is followed, radians.
const POLE_STEP: f64 = 1e-3;
/// Fewest intervals between two corners or knots where the axis turns at all.
const FEWEST: usize = 4;
/// Halvings after which an interval is taken as it is.
const DEEPEST: u32 = 44;

/// A pose of the path with its axis positions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Station {
    /// Index of the pass whose motion leads here.
    pub(super) pass: usize,
    /// What that pass is for.
    pub(super) kind: PassKind,
    /// Parameter in the pass.
    pub(super) t: f64,
    /// The pose.
    pub(super) pose: Pose,
    /// Both branches.
    pub(super) solutions: InverseSolutions,
    /// So near to the pole that the first rotary axis of the chain may stand anywhere.
    pub(super) free: bool,
}

impl Station {
    /// Whether one branch can be left for the other here.
    pub(super) fn merged(&self) -> bool {
        let [a, b] = self.solutions.branches.map(|branch| branch.rotary);
        self.free || (0..2).all(|k| (unwind(a[k], b[k]) - b[k]).abs() < 1e-6)
    }
}

/// Makes the stations of one pass after another.
pub(super) struct Surveyor<'a> {
    pub(super) path: &'a ToolPath,
    pub(super) courses: &'a Courses<'a>,
    pub(super) setup: &'a Setup,
    /// Below this angle to the pole the first axis is free, radians.
    pub(super) pole_radius: f64,
}

impl Surveyor<'_> {
    /// The stations of the whole path. A pass begins with the last station of the pass before.
    pub(super) fn survey(&self) -> Result<Vec<Station>> {
        let poses = |pass: &Pass| pass.motion.breaks().len();
        let mut stations: Vec<Station> = Vec::with_capacity(self.path.passes.iter().map(poses).sum());
        for (index, pass) in (0..).map_while(|index| Some((index, self.courses.get(index)?))) {
            let parameters = marks(pass);
            let Some(start) = parameters.first() else { continue };
            let mut last = self.station(index, pass, *start)?;
            match stations.last() {
                None => stations.push(last),
                Some(before) => self.joined(index, before, &last)?,
            }
            for t in parameters.iter().skip(1) {
                let next = self.station(index, pass, *t)?;
                self.refine(&last, &next, pass, 0, &mut stations)?;
                last = next;
            }
        }
        if stations.is_empty() {
            return Err(Diagnostic::error("the tool path has no motion").help("plan at least one pass"));
        }
        Ok(stations)
    }

    /// A pass must start where the one before ends.
    fn joined(&self, index: usize, before: &Station, start: &Station) -> Result<()> {
        let gap = before.pose.distance_along(&start.pose, self.path.tool.flute_length);
        if gap <= self.path.linearization {
            return Ok(());
        }
        let place = whereabouts(self.path, index, &start.pose);
        Err(Diagnostic::error(format!("{place} starts {gap:.4} mm away from the end of the pass before"))
            .help("join the passes by a link"))
    }

    fn station(&self, index: usize, pass: &CoursedPass<'_>, t: f64) -> Result<Station> {
        let pose = pass.pose_of(self.path, index, t)?;
        let solutions = self.setup.inverse(&pose).map_err(|e| self.unreachable(index, &pose, e))?;
        let free = solutions.free.is_some() || self.setup.near_pole(&pose.axis, self.pole_radius);
        Ok(Station { pass: index, kind: pass.pass.kind, t, pose, solutions, free })
    }

    fn unreachable(&self, pass: usize, pose: &Pose, error: Unreachable) -> Box<Diagnostic> {
        let [low, high] = self.setup.reach().map(f64::to_degrees);
        let place = whereabouts(self.path, pass, pose);
        Diagnostic::error(format!(
            "{place} is out of reach: axis {} would have to tilt {:.4} degrees further than its geometry allows",
            error.axis,
            error.by.to_degrees()
        ))
        .help(format!(
            "this machine makes tool axes {low:.3} to {high:.3} degrees from its rotary axis nearer the part; mount the \
             part turned over, or choose another machine"
        ))
    }

    /// Appends `to` and what is needed between.
    fn refine(
        &self,
        from: &Station,
        to: &Station,
        pass: &CoursedPass<'_>,
        depth: u32,
        out: &mut Vec<Station>,
    ) -> Result<()> {
        let mid = from.t + (to.t - from.t) / 2.0;
        if depth < DEEPEST && mid > from.t && mid < to.t && !near_enough(from, to) {
            let mid = self.station(to.pass, pass, mid)?;
            self.refine(from, &mid, pass, depth + 1, out)?;
            return self.refine(&mid, to, pass, depth + 1, out);
        }
        out.push(*to);
        Ok(())
    }
}

/// Whether both branches can be followed from one station to the next without doubt.
fn near_enough(from: &Station, to: &Station) -> bool {
    // Chord and angle are the same to a thousandth at such steps.
    let square = (from.pose.axis.into_inner() - to.pose.axis.into_inner()).norm_squared();
    let turns_less = |step: f64| square < step * step;
    match (from.free, to.free) {
        (true, true) => turns_less(AXIS_STEP),
        (true, false) | (false, true) => turns_less(POLE_STEP),
        (false, false) => {
            let branches = from.solutions.branches.iter().zip(&to.solutions.branches);
            let steady = |a: &f64, b: &f64| (unwind(*b, *a) - a).abs() < ROTARY_STEP;
            turns_less(AXIS_STEP)
                && branches.into_iter().all(|(a, b)| a.rotary.iter().zip(&b.rotary).all(|(a, b)| steady(a, b)))
        }
    }
}

/// Parameters of corners and knots of a pass, with points between where the axis turns other than along great circles.
fn marks(pass: &CoursedPass<'_>) -> Vec<f64> {
    let breaks = pass.breaks();
    if let PassMotion::Poses(_) | PassMotion::Timed(_) = pass.pass.motion {
        return breaks;
    }
    let mut marks = Vec::with_capacity(breaks.len() * FEWEST);
    for pair in breaks.windows(2) {
        let [low, high] = *pair else { continue };
        let turn = match (pass.pose(low), pass.pose((low + high) / 2.0), pass.pose(high)) {
            (Some(a), Some(b), Some(c)) => a.axis_angle(&b) + b.axis_angle(&c),
            _ => 0.0,
        };
        let count = if turn < 1e-9 { 1 } else { FEWEST };
        marks.extend((0..count).map(|i| low + (high - low) * i as f64 / count as f64));
    }
    marks.extend(breaks.last());
    marks
}
