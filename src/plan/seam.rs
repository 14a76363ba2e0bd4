//! Where neighbouring strips meet: where the lower of their true envelopes changes from one to the other, the angle
//! between them (the kink that a user sees, not the angles to the part's normal of Rajain 2023, R15), and how far a rim
//! lies below the other flank. Uses `envelope`, `geometry`, `motion`, `part` and `tool`.

use crate::envelope::{EnvelopePoint, envelope_point};
use crate::geometry::{Point, Vector};
use crate::motion::RuledMotion;
use crate::motion::pose::angle_between;
use crate::part::OrientedSpline;
use crate::tool::Tool;
use nalgebra::{Matrix2, Rotation3, Vector2};

/// Instants at which a seam is looked at.
const INSTANTS: usize = 60;
/// Halvings of the heights between which two flanks cross.
const HALVINGS: usize = 6;
/// Change of instant and height, as a share of all, at which the nearest point is found.
const CLOSE: f64 = 1e-5;
/// How far beside a rim, mm, the other flank may end and still lie under it.
const BESIDE: f64 = 1e-2;
/// Share of its way that an edge must go along its axis to leave a slope, not a wall.
const WALL: f64 = 1e-6;
/// How far beyond their contact, mm along the part, neighbouring strips may be apart and still share a seam.
const APART: f64 = 0.5;

/// A seam between a strip and the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// Largest angle between the envelopes, degrees.
    pub kink_max_deg: f64,
    /// Mean angle, degrees.
    pub kink_mean_deg: f64,
    /// Largest depth of the end of one flank below the other strip, mm: there its rim leaves a groove, whose angle is
    /// the kink.
    pub step_max: f64,
}

/// A strip's motion with the contact heights between which the flank is engaged at an instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Engaged<'a> {
    pub(super) motion: &'a RuledMotion,
    pub(super) tool: &'a Tool,
    /// Contact heights of the flutes, lowest and highest, mm.
    pub(super) flank: (f64, f64),
}

impl Engaged<'_> {
    /// Contact height of the sphere centred at `height` above the tip, mm: by bisection, since heights of contact and
    /// centre grow together along the flutes.
    fn contact_height(&self, height: f64) -> f64 {
        let (mut low, mut high) = self.flank;
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            let below = self.tool.contact_at(middle).is_none_or(|c| c.sphere_height() < height);
            if below {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// Contact heights at which the rails run, at `t`.
    fn ends(&self, t: f64) -> (f64, f64) {
        let length = (self.motion.upper.point(t) - self.motion.lower.point(t)).norm();
        let low = self.motion.lower_height;
        (self.contact_height(low), self.contact_height(low + length))
    }

    /// Envelope point at `t` and a contact height, on the part's side.
    fn envelope(&self, part: &OrientedSpline, t: f64, height: f64, near: &mut (f64, f64)) -> Option<EnvelopePoint> {
        let rate = self.motion.pose_rate(t)?;
        let contact = self.tool.contact_at(height)?;
        let foot = part.surface().closest_from(&rate.pose.at_height(contact.sphere_height()), *near);
        *near = (foot.u, foot.v);
        let normal = part.surface().extended_jet(foot.u, foot.v).normal()?.into_inner() * part.side();
        envelope_point(&rate, &contact, &-normal).ok()
    }
}

/// The seam between the upper border of `strip` and the strip above; none where they do not meet over the part.
pub(super) fn seam(strip: &Engaged<'_>, above: &Engaged<'_>, part: &OrientedSpline) -> Option<Seam> {
    let (start, end) = strip.motion.domain();
    let (mut most, mut sum, mut count, mut step) = (0.0_f64, 0.0, 0_u32, 0.0_f64);
    let mut near: Option<(f64, f64)> = None;
    for j in 0..=INSTANTS {
        let t = start + (end - start) * j as f64 / INSTANTS as f64;
        let mut place = near.unwrap_or_else(|| {
            let foot = part.surface().closest(&strip.motion.upper.point(t));
            (foot.u, foot.v)
        });
        let border = strip.ends(t).1;
        if strip.envelope(part, t, border, &mut place).is_none() {
            continue;
        }
        near = Some(place);
        if !is_on(part, place) {
            continue;
        }
        let Some(found) = crossings(strip, above, part, (t, border, place)) else { continue };
        step = step.max(found.step);
        for kink in found.kinks.into_iter().flatten().map(f64::to_degrees) {
            (most, sum, count) = (most.max(kink), sum + kink, count + 1);
        }
    }
    (count > 0).then(|| Seam { kink_max_deg: most, kink_mean_deg: sum / f64::from(count), step_max: step })
}

fn is_on(part: &OrientedSpline, (u, v): (f64, f64)) -> bool {
    let [(u0, u1), (v0, v1)] = part.surface().domain();
    (u0..=u1).contains(&u) && (v0..=v1).contains(&v)
}

/// What two strips leave where they meet at one instant of the lower one.
#[derive(Debug)]
struct Crossings {
    /// Angles, radians: of both flanks, of the upper strip's rim, of the lower strip's rim.
    kinks: [Option<f64>; 3],
    /// Largest depth, mm, of a rim below the other strip.
    step: f64,
}

/// Where the lower of two envelopes changes, from the border at `t`, its contact height and its place: between the upper
/// strip's rim and the lower strip's rim where their flanks cross, and at a rim that lies deeper than the other flank.
fn crossings(
    strip: &Engaged<'_>,
    above: &Engaged<'_>,
    part: &OrientedSpline,
    (t, border, place): (f64, f64, (f64, f64)),
) -> Option<Crossings> {
    let mut near = place;
    let own = strip.envelope(part, t, border, &mut near)?;
    let met = above.nearest(part, &own.point, near, above.first(&own.point))?;
    if met.beside(&own) > APART {
        return None;
    }
    let mut found = Crossings { kinks: [None; 3], step: 0.0 };
    // Heights of this strip between which the flanks may cross: both rims above the other strip.
    let (mut low, mut high) = (None, None);
    if let Some(rim) = above.over(part, (met.t, above.flank.0), near)
        && let Some(under) = strip.nearest(part, &rim.point, near, (t, border))
        && under.beside(&rim) <= BESIDE
    {
        let deeper = -under.deeper(&rim);
        low = (deeper <= 0.0).then_some(under.height);
        found.take(1, deeper, || {
            Some(angle_between(&above.rim(met.t, &rim, (above.flank.0, -1.0), deeper)?, &under.point.normal))
        });
    }
    if let Some(rim) = strip.over(part, (t, strip.flank.1), near)
        && let Some(under) = above.nearest(part, &rim.point, near, (met.t, met.height))
        && under.beside(&rim) <= BESIDE
    {
        let deeper = -under.deeper(&rim);
        high = (deeper <= 0.0).then_some(strip.flank.1);
        found.take(2, deeper, || {
            Some(angle_between(&strip.rim(t, &rim, (strip.flank.1, 1.0), deeper)?, &under.point.normal))
        });
    }
    let (mut from, mut to) = (low.unwrap_or(border), high.unwrap_or(border));
    let mut guess = (met.t, met.height);
    let mut kink = angle_between(&own.normal, &met.point.normal);
    for _ in 0..if from < to { HALVINGS } else { 0 } {
        let height = 0.5 * (from + to);
        let own = strip.envelope(part, t, height, &mut near)?;
        let met = above.nearest(part, &own.point, near, guess)?;
        guess = (met.t, met.height);
        kink = angle_between(&own.normal, &met.point.normal);
        if met.deeper(&own) > 0.0 { to = height } else { from = height }
    }
    found.kinks[0] = (from <= to).then_some(kink);
    Some(found)
}

impl Crossings {
    /// Takes in a rim that lies `deeper` than the other flank.
    fn take(&mut self, which: usize, deeper: f64, kink: impl FnOnce() -> Option<f64>) {
        if deeper > 0.0 {
            self.step = self.step.max(deeper);
            self.kinks[which] = kink();
        }
    }
}

/// A point of an envelope with its instant and contact height.
#[derive(Debug)]
struct Met {
    point: EnvelopePoint,
    t: f64,
    height: f64,
}

impl Met {
    /// How much deeper this lies than another envelope's point, mm.
    fn deeper(&self, than: &EnvelopePoint) -> f64 {
        (self.point.point - than.point).dot(&than.normal)
    }

    /// How far beside another envelope's point this lies, mm.
    fn beside(&self, other: &EnvelopePoint) -> f64 {
        let between = self.point.point - other.point;
        (between - other.normal.into_inner() * between.dot(&other.normal)).norm()
    }
}

impl Engaged<'_> {
    /// Envelope point at an instant and a contact height, if it lies over the part.
    fn over(&self, part: &OrientedSpline, (t, height): (f64, f64), mut near: (f64, f64)) -> Option<EnvelopePoint> {
        let point = self.envelope(part, t, height, &mut near)?;
        is_on(part, near).then_some(point)
    }

    /// Instant and contact height of the lower border point nearest `p`.
    fn first(&self, p: &Point) -> (f64, f64) {
        let (start, end) = self.motion.domain();
        let at = |j: usize| start + (end - start) * j as f64 / INSTANTS as f64;
        let distance = |j: &usize| (self.motion.lower.point(at(*j)) - p).norm();
        let t = at((0..=INSTANTS).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0));
        (t, self.ends(t).0)
    }

    /// The point of the envelope nearest `p`: Gauss-Newton from an instant and contact height, within the flank.
    fn nearest(&self, part: &OrientedSpline, p: &Point, mut near: (f64, f64), from: (f64, f64)) -> Option<Met> {
        let (start, end) = self.motion.domain();
        let (mut t, mut height) = from;
        let flank = self.flank;
        let (dt, dh) = (1e-4 * (end - start), 1e-3 * (flank.1 - flank.0));
        let mut here = self.envelope(part, t, height, &mut near)?;
        for _ in 0..12 {
            // One-sided differences, inward at the ends.
            let (to_t, to_h) = (if t + dt > end { -dt } else { dt }, if height + dh > flank.1 { -dh } else { dh });
            let by_t = (self.envelope(part, t + to_t, height, &mut near)?.point - here.point) / to_t;
            let by_h = (self.envelope(part, t, height + to_h, &mut near)?.point - here.point) / to_h;
            let off = p - here.point;
            let normal = Matrix2::new(by_t.dot(&by_t), by_t.dot(&by_h), by_t.dot(&by_h), by_h.dot(&by_h));
            let step = normal.try_inverse()? * Vector2::new(by_t.dot(&off), by_h.dot(&off));
            let (next_t, next_h) = ((t + step.x).clamp(start, end), (height + step.y).clamp(flank.0, flank.1));
            let moved = ((next_t - t).abs() / (end - start)).max((next_h - height).abs() / (flank.1 - flank.0));
            (t, height) = (next_t, next_h);
            here = self.envelope(part, t, height, &mut near)?;
            if moved < CLOSE {
                break;
            }
        }
        Some(Met { point: here, t, height })
    }

    /// Normal of the flank, out of the tool, where the edge at one end of it comes up again from `depth` below the other
    /// strip. `edge`: its contact height and the sense in which the axis leaves the flank there.
    ///
    /// The edge is a circle of radius R about the axis d; turned by phi from where the flank touches, at e, it lies
    /// R (1 - cos phi) higher. Moving along its own axis it cuts on the side whose e . v and d . v differ in sign; moving
    /// square to it, it leaves a wall, and the flank is not turned.
    fn rim(&self, t: f64, at: &EnvelopePoint, (height, sense): (f64, f64), depth: f64) -> Option<Vector> {
        let rate = self.motion.pose_rate(t)?;
        let radius = self.tool.contact_at(height)?.point.radius;
        let axis = rate.pose.axis.into_inner();
        let velocity = rate.tip_rate + rate.axis_rate * height;
        let along = sense * axis.dot(&velocity);
        if along.abs() < WALL * velocity.norm() {
            return Some(at.normal.into_inner());
        }
        let angle = (1.0 - depth / radius).clamp(-1.0, 1.0).acos();
        let turned = |angle: f64| Rotation3::from_axis_angle(&rate.pose.axis, angle) * at.normal.into_inner();
        [angle, -angle].map(turned).into_iter().find(|normal| normal.dot(&velocity) * along < 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Knots, SplineCurve, SplineSurface};
    use crate::tool::{CutterShape, Fixture};

    fn plane() -> OrientedSpline {
        let knots = || vec![0.0, 0.0, 1.0, 1.0];
        let control = vec![
            vec![Point::new(0.0, 0.0, 0.0), Point::new(0.0, 20.0, 0.0)],
            vec![Point::new(30.0, 0.0, 0.0), Point::new(30.0, 20.0, 0.0)],
        ];
        OrientedSpline::new(SplineSurface::new([1, 1], [knots(), knots()], control, None).unwrap(), false).unwrap()
    }

    /// A cylinder of radius 2 that moves along x with its axis from `y`, tilted about x by `tilt`, touching the plane's
    /// line at `touch` there.
    fn strip(y: f64, tilt: f64, touch: f64) -> RuledMotion {
        let axis = Vector::new(0.0, tilt.cos(), tilt.sin());
        let normal = Vector::new(0.0, -tilt.sin(), tilt.cos());
        let base = Point::new(0.0, touch, 0.0) + normal * 2.0 + axis * (y - touch);
        let knots = || Knots::clamped_uniform(3, 5).unwrap();
        let rail = |from: Point| {
            let control = (0..5).map(|i| from + Vector::x() * 7.5 * f64::from(i)).collect();
            SplineCurve::from_knots(knots(), control).unwrap()
        };
        RuledMotion { lower: rail(base), upper: rail(base + axis * 8.0), lower_height: 1.0 }
    }

    #[test]
    fn two_cylinders_that_lean_against_each_other_meet_at_the_sum_of_their_tilts() {
        let shape = CutterShape::Cylinder { diameter: 4.0, corner_radius: 0.0, flute_length: 12.0 };
        let tool = Tool::new(1, &shape, &Fixture { gauge_length: 40.0, ..Fixture::default() }).unwrap();
        let (low, high) = (strip(1.0, 0.02, 9.0), strip(9.0, -0.03, 9.0));
        let engaged = |motion| Engaged { motion, tool: &tool, flank: (0.0, 12.0) };
        let seam = seam(&engaged(&low), &engaged(&high), &plane()).unwrap();
        assert!((seam.kink_max_deg - 0.05_f64.to_degrees()).abs() < 1e-6, "{seam:?}");
        assert!((seam.kink_mean_deg - seam.kink_max_deg).abs() < 1e-6);
        assert!(seam.step_max < 1e-6, "{seam:?}");
    }

    #[test]
    fn an_end_of_a_flank_that_lies_too_low_is_a_step_as_deep_unless_it_lies_beside_the_part() {
        let shape = CutterShape::Cylinder { diameter: 4.0, corner_radius: 0.0, flute_length: 12.0 };
        let tool = Tool::new(1, &shape, &Fixture { gauge_length: 40.0, ..Fixture::default() }).unwrap();
        let engaged = |motion| Engaged { motion, tool: &tool, flank: (0.0, 12.0) };
        let (leaning, flat) = (strip(1.0, -0.02, 9.0), strip(9.0, 0.0, 9.0));
        let found = seam(&engaged(&leaning), &engaged(&flat), &plane()).unwrap();
        assert!((found.kink_max_deg - 0.02_f64.to_degrees()).abs() < 1e-6, "{found:?}");
        // The flank ends 11 mm above the lower rail, 3 mm beyond where it crosses the other one.
        let depth = |beyond: f64| beyond * 0.02_f64.sin() * 0.02_f64.cos();
        assert!((found.step_max - depth(3.0)).abs() < 1e-6, "{found:?}");
        // Nearer the edge of the part only the flat strip's lower end is left over it, 1 mm before the crossing.
        let (leaning, flat) = (strip(11.0, -0.02, 19.0), strip(19.0, 0.0, 19.0));
        let beside = seam(&engaged(&leaning), &engaged(&flat), &plane()).unwrap();
        assert!((beside.step_max - depth(1.0)).abs() < 1e-6, "{beside:?}");
    }

    #[test]
    fn strips_far_from_each_other_have_no_seam() {
        let shape = CutterShape::Cylinder { diameter: 4.0, corner_radius: 0.0, flute_length: 10.0 };
        let tool = Tool::new(1, &shape, &Fixture { gauge_length: 40.0, ..Fixture::default() }).unwrap();
        let (low, high) = (strip(1.0, 0.0, 1.0), strip(12.0, 0.0, 12.0));
        let engaged = |motion| Engaged { motion, tool: &tool, flank: (0.0, 10.0) };
        assert!(seam(&engaged(&low), &engaged(&high), &plane()).is_none());
    }
}
