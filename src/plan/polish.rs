//! One strip as a minimax problem: the largest deviation of its true envelope, over the part alone, as small as can be,
//! with overcut held to its limit, the whole band covered, and both rails moving forward.
//!
//! A row is one point of the envelope, at a fixed instant and a fixed share of the flank. Its deviation changes, to first
//! order, as the axis point under it moves along the envelope's normal. Roughness is priced on the step, not on the
//! motion: it keeps what the rows leave free in place and sets the accuracy no floor.

use super::assess::{Borders, Survey};
use super::chart::{Chart, Frame};
use super::fit::{BESIDE_MARGIN, BODY_MARGIN, SphereFamily, side_foot};
use super::limits::Limits;
use super::rails::{BLOCK, RUN, Rails, SECOND_DIFFERENCE};
use super::reach::MARGIN;
use super::touch::{Hint, Instant, NoTouch, Probe, Touch, axis_gradient, point_gradient};
use crate::geometry::{SurfacePlace, Vector};
use crate::motion::RuledMotion;
use crate::optimize::minimax::{Minimax, Rows, Sides};
use crate::tool::Tool;

/// What a strip is fitted to and with what.
#[derive(Clone, Copy)]
pub(super) struct Setting<'a> {
    pub(super) chart: &'a Chart<'a>,
    pub(super) tool: &'a Tool,
    pub(super) family: &'a SphereFamily,
    pub(super) borders: &'a Borders,
    pub(super) limits: &'a Limits,
}

impl Setting<'_> {
    /// True for a single sweep over the whole surface, whose flank may be only just long enough for it.
    pub(super) fn alone(&self) -> bool {
        self.borders.alone()
    }

    /// The measure of a motion.
    pub(super) fn probe<'m>(&'m self, motion: &'m RuledMotion) -> Probe<'m> {
        Probe { chart: self.chart, tool: self.tool, family: self.family, motion }
    }
}

/// A point of the flank that is followed, at its instant.
#[derive(Clone, Copy, Debug)]
struct Spot {
    share: f64,
    hint: Hint,
    /// An end of the flank, which must reach its border.
    end: bool,
}

/// A sphere beside the strip's flank, or a point of the shank or holder, at one instant.
#[derive(Clone, Copy, Debug)]
struct Beside {
    /// Height above the tip, mm; for flutes above the strip, share of what is left of the flank.
    at: Place,
    /// Where the search for its foot starts.
    near: SurfacePlace,
    /// It cannot gouge before it has moved this far from `seen`, mm.
    clear: f64,
    seen: Vector,
}

#[derive(Clone, Copy, Debug)]
enum Place {
    /// Flutes above the strip, at this share from its upper rail to the flank's end.
    Above(f64),
    /// Flutes below the strip: height and radius.
    Below(f64, f64),
    /// Shank or holder: height and radius.
    Body(f64, f64),
}

#[derive(Clone, Debug)]
struct Moment {
    t: f64,
    spots: Vec<Spot>,
    beside: Vec<Beside>,
}

/// The minimax problem of one strip.
pub(super) struct Polish<'a> {
    setting: Setting<'a>,
    rails: &'a Rails,
    moments: Vec<Moment>,
    /// First and last instant, which must lie off the surface.
    ends: (f64, f64),
    /// For each rail and each pair of neighbouring control points: direction and least way along it.
    forward: Vec<(usize, Vector, f64)>,
    /// Largest strain of the limits, whatever else a step gains.
    bearable: f64,
    /// Price of squared second differences of a step, per mm^2.
    price: f64,
}

/// The rest of the tool is looked at every so many instants: it must only stay clear.
const BESIDE_STRIDE: usize = 3;
/// Spheres of the flutes above the strip.
const ABOVE: usize = 8;
/// Share of its way that a control point keeps from the next.
const FORWARD: f64 = 0.1;
/// Price of a step itself, against that of its second differences.
const STILL: f64 = 1e-4;
/// A step's roughness that costs as much as the error itself, as a multiple of the error.
const ROUGH: f64 = 1e3;
/// First trust region, as a multiple of the error.
const BOLD: f64 = 10.0;
/// Largest first trust region, as a share of the flank: linearizations of a turn go no farther.
const BOLDEST: f64 = 0.1;
/// How much more a border that is not reached counts than an error of the same size: no gain in accuracy is worth it.
const COVER: f64 = 20.0;
/// How far the axis, felt for all around, may be beyond its bound, radians: it stays inside between two instants.
const HELD: f64 = 0.5 * MARGIN;
/// Smallest error that is still worked on, mm.
const RESOLUTION: f64 = 1e-9;
/// How far rails pass their borders, and the strip's ends those of the surface, at least, mm.
const PASSED: f64 = 1.5e-3;

impl<'a> Polish<'a> {
    /// Follows `instants` x `heights` points of the motion that `x` stands for; `None` where it has no proper envelope.
    pub(super) fn new(
        setting: Setting<'a>,
        rails: &'a Rails,
        x: &[f64],
        (instants, heights): (usize, usize),
    ) -> Option<Self> {
        let motion = rails.motion(x)?;
        let probe = setting.probe(&motion);
        let (start, end) = motion.domain();
        let (low, high) = (setting.borders.low, setting.borders.high);
        let mut moments = Vec::with_capacity(instants);
        let mut near: Vec<Option<(f64, f64)>> = vec![None; heights];
        for j in 0..instants {
            let t = start + (end - start) * j as f64 / (instants - 1) as f64;
            let at = probe.instant(t)?;
            let mut spots = Vec::with_capacity(heights);
            for (k, near) in near.iter_mut().enumerate() {
                // Chebyshev-like spacing: the largest errors lie at both ends of the flank.
                let share = 0.5 - 0.5 * (std::f64::consts::PI * k as f64 / (heights - 1) as f64).cos();
                let hint =
                    probe.hint(&at, share, near.unwrap_or((low + share * (high - low), setting.borders.first)))?;
                *near = Some(hint.place);
                spots.push(Spot { share, hint, end: k == 0 || k + 1 == heights });
            }
            let beside = match (spots.first(), spots.last()) {
                (Some(first), Some(last)) if j % BESIDE_STRIDE == 0 => {
                    beside(setting.family, first.hint.at, last.hint.at)
                }
                _ => Vec::new(),
            };
            moments.push(Moment { t, spots, beside });
        }
        let forward = forward(rails, x);
        let ends = (start, end);
        Some(Self { setting, rails, moments, ends, forward, bearable: f64::INFINITY, price: 0.0 })
    }

    /// Follows the points of a survey that stand out from their neighbours beyond `strain` as well, and those at which the
    /// flank stops short. True when there was one.
    pub(super) fn follow(&mut self, survey: &Survey, strain: f64) -> bool {
        let limits = self.setting.limits;
        let strains: Vec<f64> =
            survey.points.iter().map(|p| p.deviation.map_or(f64::NEG_INFINITY, |e| limits.strain_of(e))).collect();
        let mut found = false;
        for (i, point) in survey.points.iter().enumerate() {
            if strains[i] <= strain && !point.short {
                continue;
            }
            let rows = (i / survey.heights).saturating_sub(1)..=i / survey.heights + 1;
            let columns = (i % survey.heights).saturating_sub(1)..=(i % survey.heights + 1).min(survey.heights - 1);
            let peak = rows
                .flat_map(|row| columns.clone().map(move |column| row * survey.heights + column))
                .all(|other| strains.get(other).is_none_or(|s| *s <= strains[i]));
            if peak || point.short {
                let end = point.share == 0.0 || point.share == 1.0;
                let spot = Spot { share: point.share, hint: point.hint, end };
                let moment = self.moment(point.t);
                if moment.spots.iter().all(|s| s.share != spot.share) {
                    moment.spots.push(spot);
                    found = true;
                }
            }
        }
        self.follow_beside(survey) || found
    }

    /// Watches the rest of the tool where it cuts deepest, if that is too deep. True when that is new.
    fn follow_beside(&mut self, survey: &Survey) -> bool {
        let (limit, family) = (self.setting.limits.sides_within(self.bearable).hard_below, self.setting.family);
        let mut found = false;
        for (j, (gouge, points)) in survey.gouges.iter().zip(survey.points.chunks(survey.heights)).enumerate() {
            let next = [j.checked_sub(1), Some(j + 1)].into_iter().flatten();
            let peak = next.filter_map(|k| survey.gouges.get(k)).all(|other| other <= gouge);
            let (Some(first), Some(last)) = (points.first(), points.last()) else { continue };
            if *gouge <= limit || !peak {
                continue;
            }
            let moment = self.moment(first.t);
            if moment.beside.is_empty() {
                moment.beside = beside(family, first.hint.at, last.hint.at);
                found = true;
            }
        }
        found
    }

    /// What is followed at an instant.
    fn moment(&mut self, t: f64) -> &mut Moment {
        let at = self.moments.partition_point(|m| m.t < t);
        if self.moments.get(at).is_none_or(|m| m.t != t) {
            self.moments.insert(at, Moment { t, spots: Vec::new(), beside: Vec::new() });
        }
        &mut self.moments[at]
    }

    /// Lets no limit be strained more than this.
    pub(super) fn bear(&mut self, strain: f64) {
        self.bearable = strain;
    }

    /// Sets the price of steps for where `x` stands, and returns the first trust region, mm.
    pub(super) fn ready(&mut self, x: &[f64]) -> Option<f64> {
        let mut rows = Rows::default();
        self.linearize(x, &mut rows)?;
        let (tau, trespass) = rows.largest_error()?;
        let worst = (tau * self.setting.limits.undercut).max(trespass / COVER).max(RESOLUTION);
        self.price = self.setting.limits.strain_of(worst) / (ROUGH * worst).powi(2);
        let flank = self.setting.family.highest() - self.rails.lower_height;
        Some((BOLD * worst).min(BOLDEST * flank))
    }

    /// Makes steps dearer by a factor.
    pub(super) fn dearer(&mut self, factor: f64) {
        self.price *= factor;
    }

    /// Adds a row whose gradients with respect to the rail points at `t` are given.
    fn add(&self, rows: &mut Rows, t: f64, value: f64, sides: Sides, (lower, upper): (Vector, Vector)) {
        let (first, run) = self.rails.gradient(t, &lower, &upper);
        rows.bound(value, sides, run.into_iter().enumerate().map(move |(i, g)| (first + i, g)));
    }

    /// Adds a row that changes by `factor` times what its envelope point moves along `out`.
    fn add_moving(
        &self,
        rows: &mut Rows,
        (t, at): (f64, &Instant),
        touch: &Touch,
        (value, sides): (f64, Sides),
        (factor, out): (f64, &Vector),
    ) {
        let (first, run) = self.moving((t, at), touch, out);
        rows.bound(value, sides, run.into_iter().enumerate().map(move |(i, g)| (first + i, factor * g)));
    }

    /// What an envelope point moves along `out` with the unknowns: where the run of them starts, and the run.
    pub(super) fn moving(&self, (t, at): (f64, &Instant), touch: &Touch, out: &Vector) -> (usize, [f64; RUN]) {
        let height = touch.centre_height - self.rails.lower_height;
        let radius = self.setting.family.radius(touch.centre_height).0;
        let contact = (touch.centre_height, radius, -touch.normal);
        let [lower, upper, lower_rate, upper_rate] = point_gradient(&at.rate, (at.length, height), contact, out);
        self.rails.rate_gradient(t, (&lower, &upper), (&lower_rate, &upper_rate))
    }

    /// Deviation of one point, and whether it reaches its border.
    fn spot_rows(&self, rows: &mut Rows, probe: &Probe<'_>, (t, at): (f64, &Instant), spot: &mut Spot) -> Option<()> {
        let touch = match probe.touch(at, spot.share, &spot.hint) {
            Ok(touch) => touch,
            Err(NoTouch::Envelope { over: false, .. }) => {
                for _ in 0..=usize::from(spot.end) + usize::from(self.is_end(t)) {
                    rows.bound(0.0, Sides::FREE, []);
                }
                return Some(());
            }
            Err(_) => return None,
        };
        spot.hint = touch.hint();
        let frame = &touch.foot.frame;
        self.add_moving(rows, (t, at), &touch, (touch.foot.distance, self.sides(frame)), (1.0, &frame.normal));
        let borders = self.setting.borders;
        // Beside the surface a border need not be reached, the less the farther: no point may step over its edge to where
        // it would suddenly come short.
        let must = || match frame.within(BESIDE_MARGIN) {
            true => Sides::at_least(COVER * (PASSED - frame.off)),
            false => Sides::FREE,
        };
        if spot.end {
            let (tangent, rate) = frame.across_gauge()?;
            let low = spot.share < 0.5;
            let (beyond, out) =
                if low { (borders.low - frame.place.0, -tangent) } else { (frame.place.0 - borders.high, tangent) };
            self.add_moving(rows, (t, at), &touch, (COVER * beyond / rate, must()), (COVER, &out));
        }
        if self.is_end(t) {
            let (tangent, rate) = frame.along_gauge()?;
            let first = t == self.ends.0;
            let (beyond, out) =
                if first { (borders.first - frame.place.1, -tangent) } else { (frame.place.1 - borders.last, tangent) };
            self.add_moving(rows, (t, at), &touch, (COVER * beyond / rate, must()), (COVER, &out));
        }
        Some(())
    }

    /// Limits of a deviation over the part, and beside it, where the motion need not follow: there the allowance grows with
    /// the square of the distance. As far as the part goes on like itself it counts in full, lest its edge come to lie
    /// between two instants and the error there be seen by none.
    fn sides(&self, frame: &Frame) -> Sides {
        let limits = self.setting.limits.sides_within(self.bearable);
        let continued = self.setting.chart.continued();
        if frame.within(continued) {
            return limits;
        }
        let off = frame.off * (1.0 - continued / frame.beyond);
        let allowance = off * off / self.setting.family.radius(self.rails.lower_height).0;
        match allowance.is_finite() {
            true => {
                let (hard_above, hard_below) = (limits.hard_above + allowance, limits.hard_below + allowance);
                Sides { allowance, hard_above, hard_below, ..limits }
            }
            false => Sides::FREE,
        }
    }

    /// The rails must not stand farther apart than the flank is long.
    fn length_row(&self, rows: &mut Rows, t: f64, at: &Instant) {
        let axis = at.rate.pose.axis.into_inner();
        let left = self.setting.family.highest() - self.rails.lower_height - at.length;
        self.add(rows, t, left, Sides::at_least(0.0), (axis, -axis));
    }

    /// The axis must keep to the directions that the machine makes. In mm at the flank's end: the axis turns by what its
    /// ends move apart across it, over its length.
    fn bound_row(&self, rows: &mut Rows, t: f64, at: &Instant) {
        let Some(bound) = self.setting.family.bound() else { return };
        match bound.pull(&at.rate.pose.axis.into_inner()) {
            Some((by, out)) => {
                let left = (HELD - by) * at.length;
                self.add(rows, t, COVER * left, Sides::at_least(0.0), (out * COVER, -out * COVER));
            }
            None => rows.bound(0.0, Sides::FREE, []),
        }
    }

    fn is_end(&self, t: f64) -> bool {
        t == self.ends.0 || t == self.ends.1
    }

    /// Clearance of one sphere or point beside the strip.
    fn beside_row(&self, rows: &mut Rows, (t, at): (f64, &Instant), beside: &mut Beside) -> Option<()> {
        let family = self.setting.family;
        let top = self.rails.lower_height + at.length;
        let (height, radius, straight) = match beside.at {
            Place::Above(share) => {
                let height = top + (family.highest() - top).max(0.0) * share;
                (height, family.radius(height).0, false)
            }
            Place::Below(height, radius) => (height, radius, false),
            Place::Body(height, radius) => (height, radius, true),
        };
        let centre = at.rate.pose.at_height(height);
        // The distance to the surface changes by no more than the point moves; a side turns with the axis.
        if (centre.coords - beside.seen).norm() * if straight { 3.0 } else { 1.0 } < beside.clear {
            rows.bound(0.0, Sides::FREE, []);
            return Some(());
        }
        let axis = at.rate.pose.axis.into_inner();
        let foot = self.setting.chart.foot_from(&centre, &beside.near)?;
        beside.near = foot.at;
        let (foot, deviation, margin) = if straight {
            let side = side_foot(self.setting.chart, &centre, &axis, radius, &foot)?;
            (side, side.distance, BODY_MARGIN)
        } else {
            (foot, foot.distance - radius, BESIDE_MARGIN)
        };
        (beside.clear, beside.seen) = (deviation, centre.coords);
        let between = (self.rails.lower_height..top).contains(&height);
        let sides = match !between && foot.frame.within(margin) {
            // Beside a single sweep lies nothing of the part.
            true if self.setting.alone() => Sides { above: f64::INFINITY, ..self.sides(&foot.frame) },
            true => {
                let limits = self.setting.limits.sides_within(self.bearable);
                Sides { above: f64::INFINITY, hard_above: f64::INFINITY, ..limits }
            }
            false => Sides::FREE,
        };
        let share = (height - self.rails.lower_height) / at.length;
        self.add(rows, t, deviation, sides, axis_gradient(&foot.frame.normal, &axis, share));
        Some(())
    }
}

/// Everything of the tool that is not between the rails.
fn beside(family: &SphereFamily, low: SurfacePlace, high: SurfacePlace) -> Vec<Beside> {
    let at = |at: Place, near: SurfacePlace| Beside { at, near, clear: 0.0, seen: Vector::zeros() };
    let above = (1..=ABOVE).map(|i| at(Place::Above(i as f64 / ABOVE as f64), high));
    let below = family.below().iter().map(|(height, radius)| at(Place::Below(*height, *radius), low));
    let body = family.body().iter().map(|(height, radius)| at(Place::Body(*height, *radius), high));
    above.chain(below).chain(body).collect()
}

/// Neighbouring control points of each rail: index of the first unknown, direction of the way between them, least way.
fn forward(rails: &Rails, x: &[f64]) -> Vec<(usize, Vector, f64)> {
    let mut pairs = Vec::new();
    for i in 0..(rails.controls() - 1) * 2 {
        let first = i / 2 * BLOCK + i % 2 * 3;
        let way = Vector::from_fn(|c, _| x[first + BLOCK + c] - x[first + c]);
        let length = way.norm();
        if length > 0.0 {
            pairs.push((first, way / length, FORWARD * length));
        }
    }
    pairs
}

impl Minimax for Polish<'_> {
    fn unknowns(&self) -> usize {
        self.rails.unknowns()
    }

    fn linearize(&mut self, x: &[f64], rows: &mut Rows) -> Option<()> {
        let motion = self.rails.motion(x)?;
        let setting = self.setting;
        let probe = setting.probe(&motion);
        let mut moments = std::mem::take(&mut self.moments);
        let done = moments.iter_mut().try_for_each(|moment| {
            let at = probe.instant(moment.t)?;
            self.length_row(rows, moment.t, &at);
            self.bound_row(rows, moment.t, &at);
            moment.spots.iter_mut().try_for_each(|spot| self.spot_rows(rows, &probe, (moment.t, &at), spot))?;
            moment.beside.iter_mut().try_for_each(|beside| self.beside_row(rows, (moment.t, &at), beside))
        });
        self.moments = moments;
        done?;
        for (first, direction, least) in &self.forward {
            let way: f64 = (0..3).map(|c| (x[first + BLOCK + c] - x[first + c]) * direction[c]).sum();
            let gradient = (0..3).flat_map(|c| [(first + c, -direction[c]), (first + BLOCK + c, direction[c])]);
            rows.bound(way, Sides::at_least(*least), gradient);
        }
        for (first, _) in self.rails.second_differences(x) {
            let gradient = SECOND_DIFFERENCE.iter().enumerate().map(|(k, c)| (first + k * BLOCK, *c));
            rows.square(0.0, self.price, gradient);
        }
        for i in 0..x.len() {
            rows.square(0.0, STILL * self.price, [(i, 1.0)]);
        }
        Some(())
    }
}
