//! Block ends along a tool path, so that what the control does between them stays near the path along the whole flute.
//! Uses `diagnostic` and `motion`.
//!
//! Between two ends the control moves the tip straight and turns the rotary axes linearly (TCP on), or moves every axis
//! linearly (TCP off). Either way the flank leaves the ruled surface by an error that grows with the square of the
//! block's length. Each block is made as long as the allowance permits, then the ends of a smooth stretch are spread so
//! that all its blocks have the same share of error. Ends are measured as the words will be written, rounding included.

use super::axes::{AxisMove, AxisPosition};
use super::course::{CoursedPass, Courses};
use super::limits::Excess;
use super::place::{CONTINUOUS, Stop, whereabouts};
use super::rewind::{Rewinder, Room};
use super::scene::Scene;
use super::setup::Setup;
use super::track::{Choice, track};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::Vector;
use crate::motion::{Pass, PassMotion, Pose, ToolPath};
use rayon::prelude::*;

/// Share of the allowance that a block is aimed at.
const AIM: f64 = 0.95;
/// Samples of a block while its length is sought, and for the final measure.
const SAMPLES: (usize, usize) = (8, 24);
/// Attempts to find the longest block from one place.
const ATTEMPTS: usize = 12;
/// Share of the allowance within which the axis may be held in the pole rather than turned about it.
const POLE_SHARE: f64 = 0.05;

/// What bounds a block besides the path's linearization allowance.
#[derive(Clone, Copy, Debug)]
pub struct LinearizeOptions<'a> {
    /// How far a rapid may leave its path, mm.
    pub rapid_deviation: f64,
    /// Longest way of tip or top of the flutes in one block, mm.
    pub longest: f64,
    /// Largest turn of a rotary axis in one block, radians.
    pub largest_turn: f64,
    /// What the tool must stay clear of where it leaves the part to turn back; `None` where nothing is known of it.
    pub scene: Option<&'a Scene>,
}

impl Default for LinearizeOptions<'_> {
    fn default() -> Self {
        Self { rapid_deviation: 0.1, longest: 50.0, largest_turn: 0.2, scene: None }
    }
}

/// The moves of a whole path.
#[derive(Clone, Debug, PartialEq)]
pub struct Linearized {
    /// In order; the first goes to where the path starts, from wherever the machine stands.
    pub moves: Vec<AxisMove>,
    /// Largest distance, mm, of the moving flank from the path along the flutes, measured densely on every block of
    /// passes that are not rapid, rounding of words included. Near a pole, where rulings are slid along the surface of
    /// the pass, the distance from that surface.
    pub deviation: f64,
    /// What the choice of branches and turns costs.
    pub choice: Choice,
}

/// Chooses branch, turns and block ends for a path on a machine. With `tcp` the words are tip and rotary angles, else
/// axis positions; either way they are rounded to the dialect's decimals before anything is measured, and the axis
/// positions returned are those of the rounded words.
///
/// # Errors
/// A pose out of reach or out of limits, no continuous way of the rotary axes, or an allowance smaller than the rounding.
pub fn linearize(path: &ToolPath, setup: &Setup, tcp: bool, options: &LinearizeOptions<'_>) -> Result<Linearized> {
    let pole_radius = slack(path);
    let courses = Courses::new(path, setup);
    let room = Room { setup, scene: options.scene, tcp };
    let track = track(path, &courses, room, pole_radius)?;
    let stretches = stretches(path, &track.stops);
    let Some(first) = track.stops.first() else {
        return Err(Diagnostic::error("the tool path has no motion").help("plan at least one pass"));
    };
    let solved: Vec<Result<(Vec<AxisMove>, f64)>> = stretches
        .par_iter()
        .map(|stretch| {
            let Some(course) = courses.get(stretch.pass) else { return Ok((Vec::new(), 0.0)) };
            let rapid = course.pass.kind.is_rapid();
            let allowance = if rapid { options.rapid_deviation } else { path.linearization - course.slid_by };
            Cutter { path, courses: &courses, setup, tcp, options, pole_radius, course, stretch, allowance }.blocks()
        })
        .collect();
    let to = rounded(setup, &AxisPosition { linear: first.linear, rotary: first.rotary }, tcp);
    let kind = path.passes[first.pass].kind;
    let mut moves = vec![AxisMove { to, pose: setup.forward(&to), kind, pass: first.pass, asked: None }];
    let mut deviation: f64 = 0.0;
    for part in solved {
        let (blocks, worst) = part?;
        moves.extend(blocks);
        deviation = deviation.max(worst);
    }
    inside_limits(path, setup, &moves)?;
    Ok(Linearized { moves, deviation, choice: track.choice })
}

/// The axis positions at the corners and knots of a path and at places between, with branch and turns chosen over the
/// whole path, and what the choice costs; where the tool leaves the part to turn back, two follow each other.
///
/// # Errors
/// As for [`linearize`], but for the rounding.
pub fn axis_positions(path: &ToolPath, setup: &Setup) -> Result<(Vec<AxisPosition>, Choice)> {
    let courses = Courses::new(path, setup);
    let room = Room { setup, scene: None, tcp: setup.machine().control.tcp };
    let track = track(path, &courses, room, slack(path))?;
    let position = |stop: &Stop| AxisPosition { linear: stop.linear, rotary: stop.rotary };
    Ok((track.stops.iter().map(position).collect(), track.choice))
}

/// How near to the pole the axis may be held in it, and by how much a rotary axis that stands still may miss a direction,
/// radians.
fn slack(path: &ToolPath) -> f64 {
    POLE_SHARE * path.linearization / path.tool.flute_length.max(1.0)
}

/// The axis positions that the rounded words of a position command.
fn rounded(setup: &Setup, axes: &AxisPosition, tcp: bool) -> AxisPosition {
    let options = &setup.machine().control.options;
    let words = setup.words(axes, tcp).rounded(options.linear_digits, options.rotary_digits);
    setup.axes_from_words(&words, axes, tcp)
}

/// The track kept its stops inside the limits; ends between them and rounded ones must be inside, too.
fn inside_limits(path: &ToolPath, setup: &Setup, moves: &[AxisMove]) -> Result<()> {
    let outside = moves.iter().find_map(|step| Some((step, Excess::of(setup.machine(), &step.to)?)));
    match outside {
        None => Ok(()),
        Some((step, needs)) => {
            let place = whereabouts(path, step.pass, &step.pose);
            Err(Diagnostic::error(format!("{place} is out of reach: {needs}")).help(needs.remedy()))
        }
    }
}

/// A smooth piece of one pass with the rotary positions to follow; or a move that is made in one go.
struct Stretch<'a> {
    pass: usize,
    stops: &'a [Stop],
    /// A turn in place, or a change of branch or turns on a rapid: one block, not measured against the path.
    direct: bool,
    /// A way out of the part, a turn, and the way back.
    rewound: bool,
}

/// Cuts the stops into stretches at corners, turns in place, and changes of branch.
fn stretches<'a>(path: &ToolPath, stops: &'a [Stop]) -> Vec<Stretch<'a>> {
    let corners: Vec<Vec<f64>> = path.passes.iter().map(corners).collect();
    let mut stretches = Vec::new();
    let mut start = 0;
    for (index, pair) in stops.windows(2).enumerate() {
        let [from, to] = pair else { continue };
        let turn = (0..2).map(|k| (to.rotary[k] - from.rotary[k]).abs()).fold(0.0, f64::max);
        let in_place = from.pass == to.pass && from.t == to.t;
        let direct = in_place || turn > CONTINUOUS;
        let corner = corners[to.pass].binary_search_by(|c| c.total_cmp(&to.t)).is_ok();
        let next = stops.get(index + 2);
        let next_direct = next.is_some_and(|next| {
            let turn = (0..2).map(|k| (next.rotary[k] - to.rotary[k]).abs()).fold(0.0, f64::max);
            (next.pass == to.pass && next.t == to.t) || turn > CONTINUOUS
        });
        let pass_ends = next.is_none_or(|next| next.pass != to.pass);
        if direct || corner || next_direct || pass_ends {
            stretches.push(Stretch { pass: to.pass, stops: &stops[start..index + 2], direct, rewound: to.rewound });
            start = index + 1;
        }
    }
    stretches
}

/// Parameters at which a pass may have a corner.
fn corners(pass: &Pass) -> Vec<f64> {
    match &pass.motion {
        PassMotion::Poses(poses) => (0..poses.len()).map(|i| i as f64).collect(),
        PassMotion::Timed(timed) => timed.corners.iter().map(|i| *i as f64).collect(),
        PassMotion::Ruled(motion) => {
            let knots = motion.lower.knots();
            let repeated = |t: &f64| knots.values().iter().filter(|k| *k == t).count() >= knots.degree();
            knots.breaks().into_iter().filter(repeated).collect()
        }
    }
}

/// Cuts one stretch into blocks.
struct Cutter<'a> {
    path: &'a ToolPath,
    courses: &'a Courses<'a>,
    setup: &'a Setup,
    tcp: bool,
    options: &'a LinearizeOptions<'a>,
    pole_radius: f64,
    course: &'a CoursedPass<'a>,
    stretch: &'a Stretch<'a>,
    allowance: f64,
}

/// A block end: parameter in the pass and the axis positions of the rounded words.
#[derive(Clone, Copy, Debug)]
struct End {
    t: f64,
    axes: AxisPosition,
}

impl Cutter<'_> {
    fn blocks(&self) -> Result<(Vec<AxisMove>, f64)> {
        let [first, .., last] = self.stretch.stops else { return Ok((Vec::new(), 0.0)) };
        if self.stretch.rewound {
            return Ok((self.rewind(first, last)?, 0.0));
        }
        let low = if first.pass == self.stretch.pass { first.t } else { self.course.pass.motion.domain().0 };
        let start = End { t: low, axes: self.rounded(&self.at_stop(first)?) };
        let end = End { t: last.t, axes: self.rounded(&self.at_stop(last)?) };
        if self.stretch.direct {
            return Ok((vec![self.step(&start, &end)], 0.0));
        }
        let greedy = self.greedy(start, end)?;
        let (mut moves, mut worst): (Vec<AxisMove>, f64) = (Vec::with_capacity(greedy.len()), 0.0);
        let mut from = start;
        for to in self.spread(&start, &greedy) {
            worst = worst.max(self.certify(&from, &to, &mut moves)?);
            from = to;
        }
        Ok((moves, if self.course.pass.kind.is_rapid() { 0.0 } else { worst + self.course.slid_by }))
    }

    /// The blocks of a way out of the part, a turn, and the way back.
    fn rewind(&self, from: &Stop, to: &Stop) -> Result<Vec<AxisMove>> {
        let no_place = || Diagnostic::error("the tool path has no place to turn back").help("plan at least one pass");
        let room = Room { setup: self.setup, scene: self.options.scene, tcp: self.tcp };
        let rewinder = Rewinder::new(self.path, self.courses, room).ok_or_else(no_place)?;
        let block = |axes: &AxisPosition, kind| {
            let to = self.rounded(axes);
            AxisMove { to, pose: self.setup.forward(&to), kind, pass: self.stretch.pass, asked: None }
        };
        Ok(rewinder.maneuver(from, to)?.iter().map(|way| block(&way.axes, way.kind)).collect())
    }

    /// Measures a block densely and halves it as long as it leaves the allowance; appends what results and returns the
    /// largest deviation.
    fn certify(&self, from: &End, to: &End, moves: &mut Vec<AxisMove>) -> Result<f64> {
        let measured = self.deviation(from, to, SAMPLES.1);
        let mid = from.t + (to.t - from.t) / 2.0;
        if measured <= self.allowance {
            moves.push(self.step(from, to));
            return Ok(measured);
        }
        if mid <= from.t || mid >= to.t {
            return Err(self.too_tight(from));
        }
        let mid = self.end_at(mid)?;
        Ok(self.certify(from, &mid, moves)?.max(self.certify(&mid, to, moves)?))
    }

    fn step(&self, start: &End, end: &End) -> AxisMove {
        AxisMove {
            to: end.axes,
            pose: self.setup.forward(&end.axes),
            kind: self.course.pass.kind,
            pass: self.stretch.pass,
            asked: self.course.pass.motion.seconds(start.t, end.t),
        }
    }

    fn rounded(&self, axes: &AxisPosition) -> AxisPosition {
        rounded(self.setup, axes, self.tcp)
    }

    fn pose(&self, t: f64) -> Result<Pose> {
        self.course.pose_of(self.path, self.stretch.pass, t)
    }

    /// Axis positions at a stop, which may be the end of the pass before.
    fn at_stop(&self, stop: &Stop) -> Result<AxisPosition> {
        let pose = self.courses.get(stop.pass).and_then(|course| course.pose(stop.t));
        let tip = pose.map_or_else(|| self.pose(stop.t), Ok)?.tip;
        Ok(self.setup.with_rotary(&tip, stop.rotary))
    }

    /// Rounded axis positions at a parameter inside the stretch, on the branch and turn of its stops.
    fn end_at(&self, t: f64) -> Result<End> {
        let stops = self.stretch.stops;
        let after =
            stops.partition_point(|stop| stop.pass != self.stretch.pass || stop.t < t).clamp(1, stops.len() - 1);
        let (before, after) = (&stops[after - 1], &stops[after]);
        let low = if before.pass == self.stretch.pass { before.t } else { self.course.pass.motion.domain().0 };
        let share = if after.t > low { ((t - low) / (after.t - low)).clamp(0.0, 1.0) } else { 1.0 };
        let near = std::array::from_fn(|k| before.rotary[k] + (after.rotary[k] - before.rotary[k]) * share);
        let pose = self.pose(t)?;
        let stands = self.setup.machine().rotary.each_ref().map(|axis| !axis.is_continuous());
        let axes = if stands == [true; 2] || self.setup.near_pole(&pose.axis, self.pole_radius) {
            self.setup.with_rotary(&pose.tip, near)
        } else {
            // The stops are all reachable; between them a direction may miss by rounding only.
            let axes = self.setup.inverse_near(&pose, near).unwrap_or_else(|| self.setup.with_rotary(&pose.tip, near));
            match stands {
                [false, false] => axes,
                _ => {
                    let rotary = std::array::from_fn(|k| if stands[k] { near[k] } else { axes.rotary[k] });
                    self.setup.with_rotary(&pose.tip, rotary)
                }
            }
        };
        Ok(End { t, axes: self.rounded(&axes) })
    }

    /// Ends as far apart as the allowance permits.
    fn greedy(&self, start: End, end: End) -> Result<Vec<(End, f64)>> {
        let mut ends: Vec<(End, f64)> = Vec::new();
        let mut from = start;
        let mut length = end.t - start.t;
        while from.t < end.t {
            let (to, share) = self.longest(&from, &end, length)?;
            // The next block is likely to be as long; where this one was cut short by the end, that is the last.
            length = to.t - from.t;
            ends.push((to, share));
            from = to;
        }
        if ends.is_empty() {
            ends.push((end, 0.0));
        }
        Ok(ends)
    }

    /// The furthest end that one block from `from` can have, with its share of what is allowed.
    fn longest(&self, from: &End, end: &End, guess: f64) -> Result<(End, f64)> {
        let rest = end.t - from.t;
        let (mut good, mut bad): (Option<(End, f64)>, f64) = (None, f64::INFINITY);
        let mut length = guess.min(rest);
        for _ in 0..ATTEMPTS {
            let whole = length >= rest * (1.0 - 1e-9);
            let to = if whole { *end } else { self.end_at(from.t + length)? };
            let share = self.share(from, &to);
            if share <= 1.0 {
                good = Some((to, share));
                if whole || share > 0.85 {
                    break;
                }
            } else {
                bad = length;
            }
            // The share grows with the square of the length.
            let wanted = length * (AIM / share.max(1e-4)).sqrt().clamp(0.1, 8.0);
            let least = good.map_or(0.0, |(to, _)| to.t - from.t);
            length = if bad.is_finite() && wanted >= bad { (least + bad) / 2.0 } else { wanted.max(least) }.min(rest);
            if length <= least * 1.02 && good.is_some() {
                break;
            }
        }
        good.ok_or_else(|| self.too_tight(from))
    }

    fn too_tight(&self, from: &End) -> Box<Diagnostic> {
        let pose = self.setup.forward(&from.axes);
        let place = whereabouts(self.path, self.stretch.pass, &pose);
        let options = &self.setup.machine().control.options;
        Diagnostic::error(format!(
            "{place}: no block is short enough to stay within {} mm of the path with words of {} and {} decimals",
            self.allowance, options.linear_digits, options.rotary_digits
        ))
        .help("allow a larger linearization, or give the control more digits in the machine file")
    }

    /// How much of what is allowed a block uses, 1 being all: deviation, length, turn.
    fn share(&self, from: &End, to: &End) -> f64 {
        let turn = (0..2).map(|k| (to.axes.rotary[k] - from.axes.rotary[k]).abs()).fold(0.0, f64::max);
        let turn = turn / self.options.largest_turn;
        let way = self.setup.forward(&from.axes).distance_along(&self.setup.forward(&to.axes), self.flute());
        let bounds = turn.max(way / self.options.longest);
        // Squared, because these grow with the length while the deviation grows with its square.
        if bounds > 2.0 {
            return bounds * bounds;
        }
        (self.deviation(from, to, SAMPLES.0) / self.allowance).max(bounds * bounds)
    }

    fn flute(&self) -> f64 {
        self.path.tool.flute_length
    }

    /// Spreads the ends so that every block has the same share, if that keeps all within what is allowed.
    fn spread(&self, start: &End, greedy: &[(End, f64)]) -> Vec<End> {
        let ends: Vec<End> = greedy.iter().map(|(end, _)| *end).collect();
        let count = ends.len();
        let weights: Vec<f64> = greedy.iter().map(|(_, share)| share.max(1e-6).sqrt()).collect();
        let total: f64 = weights.iter().sum();
        let mut spread = Vec::with_capacity(count);
        let (mut block, mut passed, mut low) = (0, 0.0, start.t);
        for k in 1..count {
            let wanted = total * k as f64 / count as f64;
            while block + 1 < count && passed + weights[block] < wanted {
                passed += weights[block];
                low = ends[block].t;
                block += 1;
            }
            let t = low + (ends[block].t - low) * ((wanted - passed) / weights[block]).clamp(0.0, 1.0);
            match self.end_at(t) {
                Ok(end) => spread.push(end),
                Err(_) => return ends,
            }
        }
        spread.extend(ends.last());
        let fits =
            std::iter::once(start).chain(&spread).zip(&spread).all(|(a, b)| a.t < b.t && self.share(a, b) <= 1.0);
        if fits { spread } else { ends }
    }

    /// Largest distance along the flutes between what the control does in a block and the nearest pose of the path.
    fn deviation(&self, from: &End, to: &End, samples: usize) -> f64 {
        let how = self.setup.interpolation(self.tcp);
        let segment = self.setup.segment(&from.axes, &to.axes, how);
        let mut t = from.t;
        let mut worst: f64 = 0.0;
        for i in 0..=samples {
            let share = i as f64 / samples as f64;
            t = if i == 0 { from.t } else { t + (to.t - from.t) / samples as f64 };
            let (near, distance) = self.nearest(&segment.pose(share), t, from.t, to.t);
            t = near;
            worst = worst.max(distance);
        }
        worst
    }

    /// Parameter and distance of the pose of the path nearest to `moving`: two Gauss-Newton steps on the squared
    /// distances of tip and top.
    fn nearest(&self, moving: &Pose, guess: f64, low: f64, high: f64) -> (f64, f64) {
        let mut t = guess.clamp(low, high);
        let mut best = (t, f64::INFINITY);
        for _ in 0..3 {
            let Some((pose, tip_rate, top_rate)) = self.rate(t) else { break };
            let distance = pose.distance_along(moving, self.flute());
            if distance >= best.1 {
                break;
            }
            best = (t, distance);
            let tip = moving.tip - pose.tip;
            let top = moving.at_height(self.flute()) - pose.at_height(self.flute());
            let size = tip_rate.norm_squared() + top_rate.norm_squared();
            let slope = tip.dot(&tip_rate) + top.dot(&top_rate);
            // A step gains slope^2 / size of the squared distance.
            if slope * slope <= 1e-3 * distance * distance * size {
                break;
            }
            t = (t + slope / size).clamp(low, high);
        }
        best
    }

    /// Pose, and rates of tip and top of the flutes, mm per unit of parameter.
    fn rate(&self, t: f64) -> Option<(Pose, Vector, Vector)> {
        let rate = self.course.rate(t)?;
        Some((rate.pose, rate.tip_rate, rate.tip_rate + rate.axis_rate * self.flute()))
    }
}
