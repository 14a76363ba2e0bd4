//! What any solid covers of a line while it moves and turns: its section is taken at single moments, and the extremes
//! over time are found by their derivatives. Uses `geometry` and `motion`.
//!
//! Where the tool moves by v at the lower end of its section, n the solid's normal and u the line's direction, that end
//! moves by n.v / n.u along the line; it is lowest where n.v = 0, which is the condition of the envelope. For a solid that
//! is only shifted the lower end is a convex function of time, so two tangents bound its minimum; within a stretch the
//! turn is small enough for the same to hold.

use super::extent::{End, Extent, roots};
use super::solid::{Face, Side, Solid};
use crate::geometry::Vector;
use crate::motion::Pose;

/// Ends are found to this, mm.
const RESOLUTION: f64 = 1e-6;
/// Steps after which a search ends, whatever is left: halving alone brings a stretch below a millionth of itself.
const MOST_STEPS: usize = 24;
/// Steps that look for a moment of touch.
const LOOKS: usize = 16;
/// Slack on heights at the corners of a section, mm.
const SLACK: f64 = 1e-9;

/// A solid in a stretch, for lines of one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turning<'a> {
    solid: &'a Solid,
    from: Pose,
    tip_way: Vector,
    axis_way: Vector,
    /// Coordinate that the lines run along.
    along: usize,
    /// No point of the solid goes farther, mm.
    travel: f64,
}

/// A solid at one moment against a line.
enum Section {
    /// The ends and how fast each moves along the line, mm a stretch.
    Covers(Extent, [f64; 2]),
    /// About how far away the line is, mm.
    Misses(f64),
}

/// A moment known on one side of an extreme.
#[derive(Clone, Copy)]
enum Bracket {
    Outside,
    At(End, f64),
}

impl<'a> Turning<'a> {
    pub(super) fn new(solid: &'a Solid, from: Pose, to: Pose, along: usize) -> Self {
        let (tip_way, axis_way) = (to.tip - from.tip, to.axis.into_inner() - from.axis.into_inner());
        let ends = [solid.low, solid.high].map(|h| (tip_way + axis_way * h).norm());
        let travel = ends[0].max(ends[1]) + std::f64::consts::FRAC_PI_2 * solid.radius * axis_way.norm();
        Self { solid, from, tip_way, axis_way, along, travel }
    }

    /// Tip and axis at a share of the stretch.
    pub(super) fn pose(&self, t: f64) -> (Vector, Vector) {
        let axis = self.from.axis.into_inner() + self.axis_way * t;
        (self.from.tip.coords + self.tip_way * t, axis / axis.norm())
    }

    /// What is covered of the line through `foot`, a point of the part frame whose coordinate along the line is 0.
    pub(super) fn extent(&self, foot: &Vector) -> Option<Extent> {
        let (start, end) = (self.at(foot, 0.0), self.at(foot, 1.0));
        let known = match (&start, &end) {
            (Section::Covers(..), _) => 0.0,
            (_, Section::Covers(..)) => 1.0,
            (Section::Misses(a), Section::Misses(b)) => self.touching(foot, *a, *b)?,
        };
        let lowest = self.extreme(foot, 0, [&start, &end], known)?;
        let highest = self.extreme(foot, 1, [&start, &end], known)?;
        Some([lowest, highest])
    }

    /// A moment at which the solid touches a line that it misses by `a` and `b` at both ends: golden section on the
    /// distance, which has one minimum.
    fn touching(&self, foot: &Vector, a: f64, b: f64) -> Option<f64> {
        // The distance is known roughly for cones; half of it is never too much.
        if 0.5 * (a + b) > self.travel {
            return None;
        }
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let (mut low, mut high) = (0.0, 1.0);
        let (mut left, mut right) = (high - GOLDEN, low + GOLDEN);
        let distance = |t: f64| match self.at(foot, t) {
            Section::Covers(..) => None,
            Section::Misses(distance) => Some(distance),
        };
        let Some(mut at_left) = distance(left) else { return Some(left) };
        let Some(mut at_right) = distance(right) else { return Some(right) };
        for _ in 0..LOOKS {
            if at_left < at_right {
                (high, right, at_right) = (right, left, at_left);
                left = high - GOLDEN * (high - low);
                let Some(found) = distance(left) else { return Some(left) };
                at_left = found;
            } else {
                (low, left, at_left) = (left, right, at_right);
                right = low + GOLDEN * (high - low);
                let Some(found) = distance(right) else { return Some(right) };
                at_right = found;
            }
            if 0.5 * at_left.min(at_right) > self.travel * (high - low) {
                return None;
            }
        }
        None
    }

    /// The extreme of one end of the section, 0 the lower, 1 the upper.
    fn extreme(&self, foot: &Vector, which: usize, [start, end]: [&Section; 2], known: f64) -> Option<End> {
        // The upper end is the lower one of the line turned round.
        let sign = if which == 0 { 1.0 } else { -1.0 };
        let side = |section: &Section| match section {
            Section::Covers(extent, slopes) => Bracket::At(extent[which], sign * slopes[which]),
            Section::Misses(_) => Bracket::Outside,
        };
        let (mut left, mut right) = ((0.0, side(start)), (1.0, side(end)));
        let better = |best: Option<End>, side: &Bracket| match side {
            Bracket::At(end, _) if best.is_none_or(|b| sign * end.s < sign * b.s) => Some(*end),
            _ => best,
        };
        let mut best = better(better(None, &left.1), &right.1);
        let mut next = known;
        for step in 0..MOST_STEPS {
            match (left.1, right.1) {
                (Bracket::At(_, slope), _) if slope >= 0.0 => break,
                (_, Bracket::At(_, slope)) if slope <= 0.0 => break,
                (Bracket::At(a, sa), Bracket::At(b, sb)) => {
                    let width = right.0 - left.0;
                    let (va, vb) = (sign * a.s, sign * b.s);
                    // Where both tangents meet: no lower value lies between.
                    let corner = ((vb - va - sb * width) / (sa - sb)).clamp(0.0, width);
                    if va.min(vb) - (va + sa * corner) < RESOLUTION {
                        break;
                    }
                    let share = if step % 2 == 0 { -sa / (sb - sa) } else { corner / width };
                    next = left.0 + width * share.clamp(0.02, 0.98);
                }
                _ if step > 0 || next <= left.0 || next >= right.0 => next = 0.5 * (left.0 + right.0),
                _ => {}
            }
            if self.travel * (right.0 - left.0) < RESOLUTION {
                break;
            }
            let found = side(&self.at(foot, next));
            best = better(best, &found);
            match found {
                Bracket::At(_, slope) if slope < 0.0 => left = (next, found),
                Bracket::At(..) => right = (next, found),
                // Covered are the moments about the best one.
                Bracket::Outside if best.map_or(known, |b| b.t) > next => left = (next, found),
                Bracket::Outside => right = (next, found),
            }
        }
        best
    }

    /// The section at one moment.
    fn at(&self, foot: &Vector, t: f64) -> Section {
        let (tip, axis) = self.pose(t);
        let o = foot - tip;
        let found = match self.solid.side {
            Side::Quadric { alpha, beta, gamma } => self.quadric(&o, &axis, (alpha, beta, gamma)),
            Side::Torus { height, radius, arc } => self.torus(&o, &axis, (height, radius, arc)),
        };
        let ends = match found {
            Ok(ends) => ends,
            Err(distance) => return Section::Misses(distance),
        };
        let slopes = ends.map(|(s, face)| {
            let mut x = o;
            x[self.along] += s;
            let normal = self.solid.normal(face, &x, &axis);
            // omega = d x d', and a turn about the axis changes nothing.
            let turn = axis.cross(&self.axis_way);
            let speed = normal.dot(&(self.tip_way + turn.cross(&x)));
            let across = normal[self.along];
            // Where the line grazes the solid, the end runs away at once.
            speed / if across.abs() > 1e-9 { across } else { 1e-9_f64.copysign(across) }
        });
        Section::Covers(ends.map(|(s, face)| End { s, t, face }), slopes)
    }

    fn quadric(
        &self,
        o: &Vector,
        axis: &Vector,
        (alpha, beta, gamma): (f64, f64, f64),
    ) -> Result<[(f64, Face); 2], f64> {
        let (du, height) = (axis[self.along], axis.dot(o));
        let lever = alpha * height + beta;
        let (a, b) = (1.0 - alpha * du * du, o[self.along] - lever * du);
        let c = o.norm_squared() - (lever + beta) * height - gamma;
        let mut ends: Option<[(f64, Face); 2]> = None;
        let mut add = |s: f64, face: Face| {
            let [low, high] = ends.get_or_insert([(s, face); 2]);
            if s < low.0 {
                *low = (s, face);
            }
            if s > high.0 {
                *high = (s, face);
            }
        };
        for s in roots(a, b, c).into_iter().flatten() {
            let h = height + s * du;
            if h >= self.solid.low - SLACK && h <= self.solid.high + SLACK {
                add(s, Face::Side);
            }
        }
        let value = |s: f64| (a * s + 2.0 * b) * s + c;
        let slab = self.slab(height, du);
        if let Some(slab) = slab {
            for (s, face) in slab {
                if value(s) <= SLACK {
                    add(s, face);
                }
            }
        }
        ends.ok_or_else(|| {
            let free = if a > 0.0 { -b / a } else { 0.0 };
            let in_slab = slab.map_or(free, |[p, q]| free.clamp(p.0, q.0));
            let square = self.solid.radius * self.solid.radius;
            let beside = |s: f64| (value(s).max(0.0) + square).sqrt() - self.solid.radius;
            beside(in_slab).min(beside(free).hypot(self.above_or_below(height + free * du)))
        })
    }

    /// How far a height lies outside the slab between the end discs.
    fn above_or_below(&self, height: f64) -> f64 {
        (self.solid.low - height).max(height - self.solid.high).max(0.0)
    }

    /// Where the line passes the end discs' planes, lower end first; nothing where it runs along them.
    fn slab(&self, height: f64, du: f64) -> Option<[(f64, Face); 2]> {
        let Solid { low, high, .. } = *self.solid;
        if du.abs() < 1e-12 {
            return None;
        }
        let (p, q) = ((low - height) / du, (high - height) / du);
        Some(if du > 0.0 { [(p, Face::Low), (q, Face::High)] } else { [(q, Face::High), (p, Face::Low)] })
    }

    /// The distance from the arc is convex along the line, so Newton's method from either side of the section never
    /// passes its end, and a slope that turns without a touch shows that there is none.
    fn torus(&self, o: &Vector, axis: &Vector, (centre, ring, arc): (f64, f64, f64)) -> Result<[(f64, Face); 2], f64> {
        let (du, height) = (axis[self.along], axis.dot(o));
        let a = 1.0 - du * du;
        let b = o[self.along] - height * du;
        let free = if a > 1e-12 { -b / a } else { 0.0 };
        let mut range = [(free - 1e4, Face::Side), (free + 1e4, Face::Side)];
        if a > 1e-12 {
            // Inside the cylinder around the solid.
            let square = o.norm_squared() - height * height;
            let reach = (self.solid.radius.powi(2) - (square - b * b / a)).max(0.0).sqrt() / a.sqrt() + 1e-6;
            range = [(free - reach, Face::Side), (free + reach, Face::Side)];
        }
        let mut nearest = free;
        if let Some([low, high]) = self.slab(height, du) {
            nearest = free.clamp(low.0, high.0);
            if low.0 > range[0].0 {
                range[0] = low;
            }
            if high.0 < range[1].0 {
                range[1] = high;
            }
        }
        let distance = |s: f64| {
            let mut x = *o;
            x[self.along] += s;
            let h = height + s * du;
            let across = x - axis * h;
            let rho = across.norm();
            let (out, up) = ((rho - ring).max(0.0), h - centre);
            let length = out.hypot(up);
            let slope = if rho > 0.0 { out * across[self.along] / rho + up * du } else { up * du };
            (length - arc, if length > 0.0 { slope / length } else { 0.0 })
        };
        let outside = |s: f64| distance(s).0.max(0.0).hypot(self.above_or_below(height + s * du));
        let misses = || outside(free).min(outside(nearest)).max(SLACK);
        if range[0].0 > range[1].0 {
            return Err(misses());
        }
        let newton = |(start, face): (f64, Face), sense: f64| {
            let mut s = start;
            for _ in 0..50 {
                let (value, slope) = distance(s);
                if value <= 1e-10 {
                    return Ok((s, if s == start { face } else { Face::Side }));
                }
                let step = -value / slope;
                if slope * sense >= 0.0 || (s + step - start) * sense > range[1].0 - range[0].0 {
                    return Err(value.min(misses()));
                }
                s += step;
            }
            Ok((s, Face::Side))
        };
        Ok([newton(range[0], 1.0)?, newton(range[1], -1.0)?])
    }
}
