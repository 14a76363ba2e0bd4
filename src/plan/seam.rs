//! Where neighbouring strips meet: the angle and the step between their true envelopes (the kink that a user sees, not
//! the angles to the part's normal of Rajain 2023, R15). Uses `envelope`, `geometry`, `motion`, `part` and `tool`.

use crate::envelope::{EnvelopePoint, envelope_point};
use crate::geometry::Point;
use crate::motion::RuledMotion;
use crate::motion::pose::angle_between;
use crate::part::OrientedSpline;
use crate::tool::Tool;
use nalgebra::{Matrix2, Vector2};

/// Instants at which a seam is looked at.
const INSTANTS: usize = 60;
/// How far beyond their contact, mm along the part, neighbouring strips may be apart and still share a seam.
const APART: f64 = 0.5;

/// A seam between a strip and the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// Largest angle between the envelopes, degrees.
    pub kink_max_deg: f64,
    /// Mean angle, degrees.
    pub kink_mean_deg: f64,
    /// Largest distance of the envelopes from each other across the part, mm.
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
    let [(u0, u1), (v0, v1)] = part.surface().domain();
    let (mut most, mut sum, mut count, mut step) = (0.0_f64, 0.0, 0_u32, 0.0_f64);
    let mut near: Option<(f64, f64)> = None;
    for j in 0..=INSTANTS {
        let t = start + (end - start) * j as f64 / INSTANTS as f64;
        let mut place = near.unwrap_or_else(|| {
            let foot = part.surface().closest(&strip.motion.upper.point(t));
            (foot.u, foot.v)
        });
        let Some(own) = strip.envelope(part, t, strip.ends(t).1, &mut place) else { continue };
        near = Some(place);
        if !((u0..=u1).contains(&place.0) && (v0..=v1).contains(&place.1)) {
            continue;
        }
        let Some(other) = nearest(above, part, &own.point, place) else { continue };
        let between = other.point - own.point;
        let across = between.dot(&own.normal);
        if (between - own.normal.into_inner() * across).norm() > APART {
            continue;
        }
        let kink = angle_between(&own.normal, &other.normal).to_degrees();
        (most, sum, count) = (most.max(kink), sum + kink, count + 1);
        step = step.max(across.abs());
    }
    (count > 0).then(|| Seam { kink_max_deg: most, kink_mean_deg: sum / f64::from(count), step_max: step })
}

/// The point of a strip's envelope nearest `p`: Gauss-Newton from its nearest lower border point, within its borders.
fn nearest(strip: &Engaged<'_>, part: &OrientedSpline, p: &Point, place: (f64, f64)) -> Option<EnvelopePoint> {
    let (start, end) = strip.motion.domain();
    let at = |j: usize| start + (end - start) * j as f64 / INSTANTS as f64;
    let distance = |j: &usize| (strip.motion.lower.point(at(*j)) - p).norm();
    let first = (0..=INSTANTS).min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let mut t = at(first);
    let flank = strip.flank;
    let mut height = strip.ends(t).0;
    let (dt, dh) = (1e-4 * (end - start), 1e-3 * (flank.1 - flank.0));
    let mut near = place;
    let mut here = strip.envelope(part, t, height, &mut near)?;
    for _ in 0..12 {
        // One-sided differences, inward at the ends.
        let (to_t, to_h) = (if t + dt > end { -dt } else { dt }, if height + dh > flank.1 { -dh } else { dh });
        let by_t = (strip.envelope(part, t + to_t, height, &mut near)?.point - here.point) / to_t;
        let by_h = (strip.envelope(part, t, height + to_h, &mut near)?.point - here.point) / to_h;
        let off = p - here.point;
        let normal = Matrix2::new(by_t.dot(&by_t), by_t.dot(&by_h), by_t.dot(&by_h), by_h.dot(&by_h));
        let step = normal.try_inverse()? * Vector2::new(by_t.dot(&off), by_h.dot(&off));
        let (next_t, next_h) = ((t + step.x).clamp(start, end), (height + step.y).clamp(flank.0, flank.1));
        let moved = ((next_t - t).abs() / (end - start)).max((next_h - height).abs() / (flank.1 - flank.0));
        (t, height) = (next_t, next_h);
        here = strip.envelope(part, t, height, &mut near)?;
        if moved < 1e-7 {
            break;
        }
    }
    Some(here)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Knots, SplineCurve, SplineSurface, Vector};
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
    fn strips_far_from_each_other_have_no_seam() {
        let shape = CutterShape::Cylinder { diameter: 4.0, corner_radius: 0.0, flute_length: 10.0 };
        let tool = Tool::new(1, &shape, &Fixture { gauge_length: 40.0, ..Fixture::default() }).unwrap();
        let (low, high) = (strip(1.0, 0.0, 1.0), strip(12.0, 0.0, 12.0));
        let engaged = |motion| Engaged { motion, tool: &tool, flank: (0.0, 10.0) };
        assert!(seam(&engaged(&low), &engaged(&high), &plane()).is_none());
    }
}
