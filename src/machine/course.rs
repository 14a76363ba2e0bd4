//! The poses that a machine is to follow along a pass: the pass itself, or, near a pole, the pass with its rulings slid
//! along both rails. Uses `diagnostic`, `geometry` and `motion`.
//!
//! Near a pole a tiny change of the tool axis asks the first rotary axis for a large turn, so the pass takes as long as
//! that turn. A flank leaves one freedom: the tool may turn about the contact normal, for every point of its axis then
//! moves along the surface that the axis sweeps. Here the ruling that joins the rails `L` and `U` at `t` is replaced by
//! the one that joins
//!
//! ```text
//! L(t - s(t))  and  U(t + s(t)),     s(t) = s0 (1 - ((t - t0)/w)^2)^3   near t0, else 0
//! ```
//!
//! Spheres inscribed in the tool then have their centres within the distance `d` between the slid ruling and the surface
//! of the pass, measured between points of one height, so that the flank leaves what it would have left within `d`. On a
//! plane `d` is zero; a twist `a'` of the axis lifts the middle by `s |U - L| |a'| / 2`, of which half is taken back by
//! shifting the ruling. `t0` and `s0` are those at which the axis passes exactly through the pole, where the first axis
//! need not turn at all.

use super::place::whereabouts;
use super::setup::Setup;
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Direction, Point, Vector};
use crate::motion::path::PoseRate;
use crate::motion::{Pass, PassKind, PassMotion, Pose, RuledMotion, ToolPath};
use rayon::prelude::*;

/// Share of the linearization allowance that sliding may use.
const SHARE: f64 = 0.5;
/// How far from the pole the axis is turned back to it at most, radians.
const FARTHEST: f64 = 0.1;
/// Half the width of the window over the distance from the pole, both as turns of the axis: wider windows bend the way
/// of the axis less.
const WIDTH: f64 = 12.0;
/// Samples of a pass between neighbouring breaks, where the pole is looked for.
const SAMPLES: usize = 32;
/// Samples of a window, where the distance is measured.
const MEASURES: usize = 64;

/// Rulings slid along the rails about one place of a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Slide {
    /// Parameter at which the axis passes through the pole.
    centre: f64,
    /// Half the width of the window, in the parameter.
    width: f64,
    /// Slide at the centre, in the parameter.
    amount: f64,
}

impl Slide {
    fn at(&self, t: f64) -> f64 {
        let x = (t - self.centre) / self.width;
        let rest = (1.0 - x * x).max(0.0);
        self.amount * rest * rest * rest
    }
}

/// A pass with what is slid in it.
#[derive(Clone, Debug)]
pub(super) struct CoursedPass<'a> {
    /// The pass.
    pub(super) pass: &'a Pass,
    slides: Vec<Slide>,
    /// Largest distance of the slid rulings from the surface of the pass, mm.
    pub(super) slid_by: f64,
}

/// All passes of a path.
pub(super) struct Courses<'a> {
    passes: Vec<CoursedPass<'a>>,
}

impl<'a> Courses<'a> {
    /// Slides rulings where the first axis would turn faster than it can, as far as the path's linearization allows.
    pub(super) fn new(path: &'a ToolPath, setup: &Setup) -> Self {
        let course = |pass: &'a Pass| {
            let mut course = CoursedPass { pass, slides: Vec::new(), slid_by: 0.0 };
            if let (PassMotion::Ruled(motion), PassKind::Cut) = (&pass.motion, pass.kind) {
                Relief { path, setup, motion }.relieve(&mut course);
            }
            course
        };
        Self { passes: path.passes.par_iter().map(course).collect() }
    }

    /// A pass by its index in the path.
    pub(super) fn get(&self, pass: usize) -> Option<&CoursedPass<'a>> {
        self.passes.get(pass)
    }
}

impl CoursedPass<'_> {
    /// The pose at a parameter of the pass.
    pub(super) fn pose(&self, t: f64) -> Option<Pose> {
        match &self.pass.motion {
            PassMotion::Ruled(motion) => match self.slide(t) {
                0.0 => self.pass.motion.pose(t),
                slide => slid(motion, t, slide),
            },
            motion @ (PassMotion::Poses(_) | PassMotion::Timed(_)) => motion.pose(t),
        }
    }

    /// The pose at a parameter; an error names the pass.
    pub(super) fn pose_of(&self, path: &ToolPath, index: usize, t: f64) -> Result<Pose> {
        self.pose(t).ok_or_else(|| {
            let name = path.passes.get(index).and_then(|p| p.motion.pose(p.motion.domain().0));
            let place = name.map_or_else(|| format!("pass {index}"), |pose| whereabouts(path, index, &pose));
            Diagnostic::error(format!("{place} has no tool axis at parameter {t}"))
                .help("keep the two rails of a pass apart")
        })
    }

    /// Pose, and rates of tip and axis, per unit of parameter.
    pub(super) fn rate(&self, t: f64) -> Option<PoseRate> {
        match &self.pass.motion {
            PassMotion::Ruled(motion) if self.slide(t) == 0.0 => motion.pose_rate(t),
            _ => {
                let step = 1e-6;
                let (pose, after, before) = (self.pose(t)?, self.pose(t + step)?, self.pose(t - step)?);
                let axis_rate = (after.axis.into_inner() - before.axis.into_inner()) / (2.0 * step);
                Some(PoseRate { pose, tip_rate: (after.tip - before.tip) / (2.0 * step), axis_rate })
            }
        }
    }

    /// Parameters between which the pass is smooth, and the ends and middles of windows.
    pub(super) fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.pass.motion.breaks();
        if !self.slides.is_empty() {
            breaks.extend(self.slides.iter().flat_map(|s| [s.centre - s.width, s.centre, s.centre + s.width]));
            breaks.sort_by(f64::total_cmp);
            breaks.dedup();
        }
        breaks
    }

    fn slide(&self, t: f64) -> f64 {
        self.slides.iter().map(|slide| slide.at(t)).sum()
    }
}

/// The ruling that joins the rails at `t` less and plus the slide, shifted so that it leaves the surface as far at its
/// middle as at its ends.
fn slid(motion: &RuledMotion, t: f64, slide: f64) -> Option<Pose> {
    let (low, high) = motion.domain();
    let lower = motion.lower.point((t - slide).clamp(low, high));
    let upper = motion.upper.point((t + slide).clamp(low, high));
    let axis = Direction::try_new(upper - lower, 1e-9)?;
    let lifted = (lower.coords + upper.coords - motion.lower.point(t).coords - motion.upper.point(t).coords) / 2.0;
    Some(Pose { tip: lower - lifted / 2.0 - axis.into_inner() * motion.lower_height, axis })
}

/// Finds what to slide in one pass.
struct Relief<'a> {
    path: &'a ToolPath,
    setup: &'a Setup,
    motion: &'a RuledMotion,
}

impl Relief<'_> {
    fn relieve(&self, course: &mut CoursedPass<'_>) {
        let machine = self.setup.machine();
        let first = &machine.rotary[machine.chain[0]];
        if !machine.rotary.iter().all(|axis| axis.is_continuous()) {
            return;
        }
        for pole in [first.direction, -first.direction] {
            for t in self.approaches(&pole) {
                if let Some((slide, distance)) = self.slide(t, &pole, first.speed) {
                    let apart = |other: &Slide| (other.centre - slide.centre).abs() >= other.width + slide.width;
                    if course.slides.iter().all(apart) {
                        course.slides.push(slide);
                        course.slid_by = course.slid_by.max(distance);
                    }
                }
            }
        }
    }

    /// Parameters at which the axis comes nearest to the pole.
    fn approaches(&self, pole: &Direction) -> Vec<f64> {
        let breaks = self.motion.lower.knots().breaks();
        let spans = breaks.windows(2).flat_map(|pair| {
            let [low, high] = [pair[0], pair[1]];
            (0..SAMPLES).map(move |i| low + (high - low) * i as f64 / SAMPLES as f64)
        });
        let mut marks: Vec<f64> = spans.collect();
        marks.extend(breaks.last());
        let distance =
            |t: f64| self.motion.pose(t).map_or(f64::INFINITY, |p| (p.axis.into_inner() - pole.into_inner()).norm());
        let distances: Vec<f64> = marks.iter().map(|t| distance(*t)).collect();
        let mut found = Vec::new();
        for k in 1..marks.len().saturating_sub(1) {
            // Between samples the axis may be nearer by as much as it goes from one to the next.
            let steps = (distances[k - 1] - distances[k]).abs().max((distances[k + 1] - distances[k]).abs());
            if distances[k] <= distances[k - 1] && distances[k] < distances[k + 1] && distances[k] < FARTHEST + steps {
                found.push(marks[k]);
            }
        }
        found
    }

    /// The slide that brings the axis into the pole near `t`, with the distance it costs, mm; `None` where the axis is
    /// slow enough without, where sliding does not lead there, or where it costs too much.
    fn slide(&self, t: f64, pole: &Direction, top_speed: f64) -> Option<(Slide, f64)> {
        let (x, y) = square(pole);
        let off = |t: f64, slide: f64| {
            let axis = slid(self.motion, t, slide)?.axis;
            Some((axis.dot(&x), axis.dot(&y)))
        };
        let (low, high) = self.motion.domain();
        let step = (high - low) * 1e-6;
        let (mut centre, mut amount) = (t, 0.0);
        for _ in 0..20 {
            let (u, v) = off(centre, amount)?;
            let (after, before) = (off(centre + step, amount)?, off(centre - step, amount)?);
            let (more, less) = (off(centre, amount + step)?, off(centre, amount - step)?);
            let by_t = ((after.0 - before.0) / (2.0 * step), (after.1 - before.1) / (2.0 * step));
            let by_slide = ((more.0 - less.0) / (2.0 * step), (more.1 - less.1) / (2.0 * step));
            let turn = by_t.0 * by_slide.1 - by_t.1 * by_slide.0;
            // Sliding must lead across the way of the axis, or it leads nowhere.
            if turn.abs() <= 0.05 * by_t.0.hypot(by_t.1) * by_slide.0.hypot(by_slide.1) {
                return None;
            }
            let dt = (u * by_slide.1 - v * by_slide.0) / turn;
            let ds = (v * by_t.0 - u * by_t.1) / turn;
            (centre, amount) = (centre - dt, amount - ds);
            if !(low..=high).contains(&centre) {
                return None;
            }
            if dt.abs() + ds.abs() < 1e-13 * (high - low) {
                break;
            }
        }
        let rate = self.motion.pose_rate(centre)?;
        let miss = (rate.pose.axis.into_inner() - pole.into_inner()).norm();
        let flute = self.path.tool.flute_length;
        let speed = (rate.tip_rate + rate.axis_rate * (flute / 2.0)).norm();
        let turning = rate.axis_rate.norm();
        // Passing at this distance, the first axis turns by the way of the tool axis over the distance.
        let asked = turning / speed * (self.path.cut_feed / 60.0) / miss;
        if amount.abs() < 1e-12 * (high - low) || asked <= top_speed {
            return None;
        }
        let width = (WIDTH * miss / turning).min(centre - low).min(high - centre);
        let slide = Slide { centre, width, amount };
        let distance = self.distance(&slide)?; // The window must leave room, or the way of the axis would bend about as sharply as before.
        (width * turning >= WIDTH / 3.0 * miss && distance <= SHARE * self.path.linearization)
            .then_some((slide, distance))
    }

    /// Largest distance between slid rulings and the surface of the pass, between points of one height, mm.
    fn distance(&self, slide: &Slide) -> Option<f64> {
        let flute = self.path.tool.flute_length;
        let mut worst: f64 = 0.0;
        for k in 0..=MEASURES {
            let t = slide.centre + slide.width * (2.0 * k as f64 / MEASURES as f64 - 1.0);
            let pose = slid(self.motion, t, slide.at(t))?;
            for height in [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| share * flute) {
                worst = worst.max(self.off_surface(&pose.at_height(height), height, t)?);
            }
        }
        Some(worst)
    }

    /// Distance of a point from the way that the axis point of one height takes, by Newton's method from `t`.
    fn off_surface(&self, point: &Point, height: f64, t: f64) -> Option<f64> {
        let (low, high) = self.motion.domain();
        let mut t = t;
        let mut least = f64::INFINITY;
        for _ in 0..12 {
            let rate = self.motion.pose_rate(t)?;
            let off: Vector = point - rate.pose.at_height(height);
            let way = rate.tip_rate + rate.axis_rate * height;
            least = least.min(off.norm());
            let step = off.dot(&way) / way.norm_squared().max(f64::MIN_POSITIVE);
            let next = (t + step).clamp(low, high);
            if (next - t).abs() < 1e-12 * (high - low) {
                break;
            }
            t = next;
        }
        Some(least)
    }
}

/// Two directions square to one and to each other.
fn square(pole: &Direction) -> (Vector, Vector) {
    let some = if pole.x.abs() < 0.6 { Vector::x() } else { Vector::y() };
    let x = pole.cross(&some).normalize();
    (x, pole.cross(&x))
}
