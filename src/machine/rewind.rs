//! Leaving the part in the middle of a pass, turning the rotary axes to other angles of the same tool axis, and coming
//! back to the same place. Uses `diagnostic`, `geometry`, `motion` and, through the scene, `collide`.
//!
//! The way out: off the flank as far as the path's own retracts go, if it has any; out along the tool axis until the tip
//! is outside the sphere around all that the path touches; then, if need be, along the pole until the tool stays outside
//! the sphere however the axes turn. They turn there with the tip at rest in the part. The way back is the way out. Where
//! the tool, or a body of the machine, would run into another on the way, the tool goes farther along its axis, then along
//! the pole; ways on which nothing even comes near are preferred.

use super::axes::AxisPosition;
use super::course::{CoursedPass, Courses};
use super::limits::Excess;
use super::links::{AxisCourse, Hop};
use super::place::{Stop, whereabouts};
use super::scene::{Encounter, Scene};
use super::setup::Setup;
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Direction, Point, Vector};
use crate::motion::{Pass, PassKind, Pose, ToolPath};

/// Distance between the sphere around the path and the tip while the axes turn, mm.
const CLEARANCE: f64 = 5.0;
/// Largest turn of a rotary axis from one point of the way to the next, radians.
const TURN: f64 = 0.1;
/// Farthest way along the pole, mm.
const FARTHEST: f64 = 2000.0;
/// Last part of the way back along the tool axis, which is done at feed, mm.
const ENGAGE: f64 = 2.0;

/// How much farther the tool goes along its axis, and along the pole, where the way is not clear of bodies, mm.
const FARTHER: [(f64, f64); 9] = [
    (0.0, 0.0),
    (50.0, 0.0),
    (100.0, 0.0),
    (200.0, 0.0),
    (400.0, 0.0),
    (0.0, 100.0),
    (0.0, 200.0),
    (0.0, 400.0),
    (200.0, 400.0),
];

/// One point of the way out, of the turn, or of the way back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waypoint {
    pub(super) axes: AxisPosition,
    pub(super) kind: PassKind,
}

/// Plans ways out of the part and back.
pub(super) struct Rewinder<'a> {
    path: &'a ToolPath,
    courses: &'a Courses<'a>,
    room: Room<'a>,
    centre: Point,
    radius: f64,
}

/// The machine, and what stands and moves on it.
#[derive(Clone, Copy)]
pub(super) struct Room<'a> {
    pub(super) setup: &'a Setup,
    /// `None` where nothing is known of bodies.
    pub(super) scene: Option<&'a Scene>,
    /// Whether the tip goes straight in the part between the ends of blocks.
    pub(super) tcp: bool,
}

impl<'a> Rewinder<'a> {
    /// Puts a sphere around all that the path touches: its tips, for links run outside the part, and its flutes where it
    /// is not rapid. `None` for a path without poses.
    pub(super) fn new(path: &'a ToolPath, courses: &'a Courses<'a>, room: Room<'a>) -> Option<Self> {
        let touched = |pass: &Pass| {
            let flute = if pass.kind.is_rapid() { 0.0 } else { path.tool.flute_length };
            let (low, high) = pass.motion.domain();
            let breaks = pass.motion.breaks().len().max(2) * 4;
            let at = |i: usize| pass.motion.pose(low + (high - low) * i as f64 / breaks as f64);
            (0..=breaks).filter_map(at).flat_map(|pose| [pose.tip, pose.at_height(flute)]).collect::<Vec<_>>()
        };
        let tips: Vec<Point> = path.passes.iter().flat_map(touched).collect();
        let first = tips.first()?.coords;
        let (low, high) = tips.iter().fold((first, first), |(l, h), p| (l.inf(&p.coords), h.sup(&p.coords)));
        let centre = Point::from((low + high) / 2.0);
        let radius = tips.iter().map(|tip| (tip - centre).norm()).fold(0.0, f64::max);
        Some(Self { path, courses, room, centre, radius })
    }

    /// The way from one stop to the next, which is at the same place with other rotary positions; the last waypoint is
    /// there. An error says which axis has no room, by how much, or what is in the way.
    pub(super) fn maneuver(&self, from: &Stop, to: &Stop) -> Result<Vec<Waypoint>> {
        let course =
            self.courses.get(to.pass).ok_or_else(|| Diagnostic::error(format!("there is no pass {}", to.pass)))?;
        let pose = course.pose_of(self.path, to.pass, to.t)?;
        let Some(scene) = self.room.scene.filter(|scene| !scene.is_empty()) else {
            let (moves, rest) = self.moves((from, to), course, &pose, FARTHER[0]);
            return self.check(to, &pose, &moves, &rest).map(|()| moves);
        };
        let mut refused = None;
        for near_counts in [true, false] {
            refused = None;
            for farther in FARTHER {
                let (moves, rest) = self.moves((from, to), course, &pose, farther);
                let checked = self.check(to, &pose, &moves, &rest);
                match checked.and_then(|()| self.clear(scene, (from, to), &pose, &moves, near_counts)) {
                    Ok(()) => return Ok(moves),
                    Err(error) => refused = refused.or(Some(error)),
                }
            }
        }
        Err(refused.unwrap_or_else(|| Diagnostic::error("there is no way out of the part")))
    }

    /// The way out, the turn and the way back, and where the tip rests in the turn.
    fn moves(
        &self,
        (from, to): (&Stop, &Stop),
        course: &CoursedPass<'_>,
        pose: &Pose,
        farther: (f64, f64),
    ) -> (Vec<Waypoint>, Point) {
        let out = self.way_out(course, to, pose, farther);
        let mut moves = Vec::new();
        let rest = out.last().copied().unwrap_or(pose.tip);
        for (index, tip) in out.iter().enumerate() {
            let kind = if index == 0 { PassKind::Retract } else { PassKind::Rapid };
            moves.push(Waypoint { axes: self.room.setup.with_rotary(tip, from.rotary), kind });
        }
        let turn = (0..2).map(|k| (to.rotary[k] - from.rotary[k]).abs()).fold(0.0, f64::max);
        let steps = (turn / TURN).ceil().max(1.0) as u32;
        for step in 1..=steps {
            let share = f64::from(step) / f64::from(steps);
            let rotary = std::array::from_fn(|k| from.rotary[k] + (to.rotary[k] - from.rotary[k]) * share);
            moves.push(Waypoint { axes: self.room.setup.with_rotary(&rest, rotary), kind: PassKind::Rapid });
        }
        let back = out.iter().rev().skip(1).map(|tip| (*tip, PassKind::Rapid));
        for (tip, kind) in back.chain([(pose.tip, PassKind::Approach)]) {
            moves.push(Waypoint { axes: self.room.setup.with_rotary(&tip, to.rotary), kind });
        }
        (moves, rest)
    }

    /// No two bodies may run into each other on the way; with `near_counts` they may not come near each other either,
    /// but for those that are near where the tool cuts. What the tool works on it may touch while it leaves the flank.
    fn clear(
        &self,
        scene: &Scene,
        (from, to): (&Stop, &Stop),
        pose: &Pose,
        moves: &[Waypoint],
        near_counts: bool,
    ) -> Result<()> {
        let Room { setup, tcp, .. } = self.room;
        let start = setup.with_rotary(&pose.tip, from.rotary);
        let mut hints = scene.hints();
        let mut ends = [start, start];
        let mut near: Vec<usize> = Vec::new();
        for place in [from.rotary, to.rotary] {
            let stands = setup.with_rotary(&pose.tip, place);
            let hop = Hop { setup, ends: [stands, stands], tips: None };
            near.extend(scene.encounters(&hop, &mut hints).iter().map(|met| met.pair));
        }
        for (index, way) in moves.iter().enumerate() {
            let at_flank = index == 0 || index + 1 == moves.len();
            ends = [ends[1], way.axes];
            let tips = tcp.then(|| ends.each_ref().map(|axes| setup.forward(axes).tip));
            let hop = Hop { setup, ends, tips };
            let met = scene.encounters(&hop, &mut hints);
            let counts = |met: &&Encounter| {
                let known = near.contains(&met.pair);
                let leaves = at_flank && known && scene.is_work(met.pair);
                !leaves && (scene.collides(met) || (near_counts && !known))
            };
            if let Some(met) = met.iter().find(counts) {
                return Err(self.blocked(scene, to, pose, met, &hop.axes(met.share)));
            }
        }
        Ok(())
    }

    /// What is in the way, and where.
    fn blocked(
        &self,
        scene: &Scene,
        stop: &Stop,
        pose: &Pose,
        met: &Encounter,
        axes: &AxisPosition,
    ) -> Box<Diagnostic> {
        let ([a, b], at) = (scene.names(met.pair), self.room.setup.forward(axes));
        let machine = self.room.setup.machine();
        let turned = machine.rotary.iter().zip(axes.rotary).filter(|(axis, _)| axis.is_present());
        let turned: Vec<_> = turned.map(|(axis, by)| format!("{} {:.3}", axis.letter, by.to_degrees())).collect();
        let how = if met.is_collision() {
            format!("{a} would be {:.3} mm inside the {b}", -met.distance)
        } else {
            format!("{a} would come within {:.3} mm of the {b}", met.distance.max(0.0))
        };
        Diagnostic::error(format!(
            "{}: no rewind room: {how} with the tip at [{:.3}, {:.3}, {:.3}] and {} degrees, and no way farther out is clear",
            whereabouts(self.path, stop.pass, pose),
            at.tip.x,
            at.tip.y,
            at.tip.z,
            turned.join(", ")
        ))
        .help(format!(
            "mount the part higher or turned, or move the {b}, so that the axes can turn back there; or split the pass, or \
             use another tool length"
        ))
    }

    /// The tips on the way out, the part's frame.
    fn way_out(&self, course: &CoursedPass<'_>, stop: &Stop, pose: &Pose, (along, up_by): (f64, f64)) -> Vec<Point> {
        let axis = pose.axis.into_inner();
        let first = match self.stand_off(course, stop) {
            Some(aside) => pose.tip + aside,
            None => pose.tip + axis * ENGAGE,
        };
        // Where the ray along the axis leaves the sphere.
        let from = first - self.centre;
        let (height, wanted) = (from.dot(&axis), self.radius + CLEARANCE);
        let root = (height * height - from.norm_squared() + wanted * wanted).max(0.0).sqrt();
        let outside = first + axis * ((root - height).max(CLEARANCE) + along);
        let mut way = vec![first, outside];
        let machine = self.room.setup.machine();
        let pole = machine.rotary[machine.chain[0]].direction;
        let up = if pole.dot(&axis) < 0.0 { -pole } else { pole };
        let height = self.clear_height(&outside, &up, &axis);
        if height.is_some() || up_by > 0.0 {
            way.push(outside + up.into_inner() * (height.unwrap_or(0.0) + up_by));
        }
        way
    }

    /// How far to go along the pole so that the tool stays outside the sphere while it turns about the pole; `None` if it
    /// does where it is.
    fn clear_height(&self, tip: &Point, up: &Direction, axis: &Vector) -> Option<f64> {
        let from = tip - self.centre;
        let tilt = up.dot(axis);
        let level = (from - up.into_inner() * from.dot(up)).norm();
        let across = (1.0 - tilt * tilt).max(0.0).sqrt();
        // Least of (tip - centre) . axis while the axis goes round the pole: the tool then points away from the sphere.
        let least = |height: f64| (from.dot(up) + height) * tilt - level * across;
        if least(0.0) >= 0.0 || tilt <= 1e-3 {
            return None;
        }
        Some((level * across / tilt - from.dot(up)).clamp(0.0, FARTHEST))
    }

    /// How far, and which way, the path's own retract of the strip stands off the flank, turned to this place.
    fn stand_off(&self, course: &CoursedPass<'_>, stop: &Stop) -> Option<Vector> {
        let strip = course.pass.strip;
        let after = self.path.passes.iter().skip(stop.pass + 1).take_while(|pass| pass.strip == strip);
        let retract = after.into_iter().find(|pass| pass.kind == PassKind::Retract)?;
        let (low, high) = retract.motion.domain();
        let (start, end) = (retract.motion.pose(low)?, retract.motion.pose(high)?);
        let aside = end.tip - start.tip;
        let aside = aside - start.axis.into_inner() * aside.dot(&start.axis);
        let normal = |t: f64| {
            let rate = course.rate(t)?;
            let way = rate.tip_rate + rate.axis_rate * (self.path.tool.flute_length / 2.0);
            Direction::try_new(rate.pose.axis.cross(&way), 1e-12)
        };
        let at_end = normal(course.pass.motion.domain().1)?;
        let length = aside.dot(&at_end);
        (length.abs() > 0.5 * aside.norm() && length != 0.0).then_some(())?;
        Some(normal(stop.t)?.into_inner() * length)
    }

    /// Every waypoint must be within the limits, and the tool outside the sphere while it turns.
    fn check(&self, stop: &Stop, pose: &Pose, moves: &[Waypoint], rest: &Point) -> Result<()> {
        let place = whereabouts(self.path, stop.pass, pose);
        let machine = self.room.setup.machine();
        if let Some(needs) = moves.iter().find_map(|way| Excess::of(machine, &way.axes)) {
            let message = format!("{place}: no room to leave the part, turn back and come again: {needs}");
            return Err(Diagnostic::error(message).help(needs.remedy()));
        }
        let entered = |way: &&Waypoint| {
            let tool = self.room.setup.forward(&way.axes);
            let from = tool.tip - self.centre;
            let along = from.dot(&tool.axis);
            let near = if along >= 0.0 { from.norm() } else { (from.norm_squared() - along * along).max(0.0).sqrt() };
            (tool.tip - rest).norm() < 1e-6 && near < self.radius
        };
        if moves.iter().any(|way| entered(&way)) {
            let message = format!("{place}: the tool would pass through the part while the rotary axes turn back");
            let help = "split the pass where the axes can be turned back, or mount the part turned";
            return Err(Diagnostic::error(message).help(help));
        }
        Ok(())
    }
}
