//! Where a strip's envelope lies over the part: the one measure that both the refinement and the judgement use.

use super::chart::{Chart, ChartFoot};
use super::fit::SphereFamily;
use crate::envelope::{NoContact, envelope_point};
use crate::geometry::{SurfacePlace, Vector};
use crate::motion::RuledMotion;
use crate::motion::path::PoseRate;
use crate::tool::Tool;

/// A strip's motion, with what it is measured against.
#[derive(Clone, Copy)]
pub(super) struct Probe<'a> {
    pub(super) chart: &'a Chart<'a>,
    pub(super) tool: &'a Tool,
    pub(super) family: &'a SphereFamily,
    pub(super) motion: &'a RuledMotion,
}

/// The tool at one instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instant {
    /// Pose and its rate.
    pub(super) rate: PoseRate,
    /// Distance between the rails, mm.
    pub(super) length: f64,
}

/// Where a search for a foot starts, and which of the two branches of the envelope is the part's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hint {
    /// Chart coordinates.
    pub(super) place: (f64, f64),
    /// The part's normal nearby.
    pub(super) normal: Vector,
    /// Where the search starts.
    pub(super) at: SurfacePlace,
}

impl Hint {
    fn of(foot: &ChartFoot) -> Self {
        Self { place: foot.frame.place, normal: foot.frame.normal, at: foot.at }
    }
}

/// A point of the envelope with its foot on the part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Height above the tip of the centre of the sphere that touches there, mm.
    pub(super) centre_height: f64,
    /// Normal of the envelope, out of the material.
    pub(super) normal: Vector,
    /// Foot of the envelope point; its distance is the strip's deviation there.
    pub(super) foot: ChartFoot,
}

/// Why there is no such point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NoTouch {
    /// No envelope, at this height above the tip; `over` is true over the surface itself, false beside it.
    Envelope { height: f64, cause: NoContact, over: bool },
    /// Rails meet, or the surface has no normal.
    Degenerate,
}

impl Touch {
    /// Where to look next to it.
    pub(super) fn hint(&self) -> Hint {
        Hint::of(&self.foot)
    }
}

impl Probe<'_> {
    /// The tool at `t`.
    pub(super) fn instant(&self, t: f64) -> Option<Instant> {
        let length = (self.motion.upper.point(t) - self.motion.lower.point(t)).norm();
        Some(Instant { rate: self.motion.pose_rate(t)?, length })
    }

    /// A hint for `share` of the flank from a place nearby.
    pub(super) fn hint(&self, at: &Instant, share: f64, near: (f64, f64)) -> Option<Hint> {
        let centre = at.rate.pose.at_height(self.motion.lower_height + share * at.length);
        self.chart.foot(&centre, near).map(|foot| Hint::of(&foot))
    }

    /// The envelope at `share` of the flank between the rails.
    pub(super) fn touch(&self, at: &Instant, share: f64, hint: &Hint) -> Result<Touch, NoTouch> {
        let centre_height = (self.motion.lower_height + share * at.length).min(self.family.highest());
        self.touch_at(at, self.family.contact_height(centre_height), hint)
    }

    /// The envelope at a contact height above the tip, mm.
    pub(super) fn touch_at(&self, at: &Instant, height: f64, hint: &Hint) -> Result<Touch, NoTouch> {
        let contact = self.tool.contact_at(height).ok_or(NoTouch::Degenerate)?;
        let point = envelope_point(&at.rate, &contact, &-hint.normal).map_err(|cause| {
            let centre = at.rate.pose.at_height(contact.sphere_height());
            let over = self.chart.foot_from(&centre, &hint.at).is_none_or(|foot| foot.frame.inside());
            NoTouch::Envelope { height, cause, over }
        })?;
        let foot = self.chart.foot_from(&point.point, &hint.at).ok_or(NoTouch::Degenerate)?;
        Ok(Touch { centre_height: contact.sphere_height(), normal: -point.normal.into_inner(), foot })
    }
}

/// Derivatives of `direction . c` with respect to the lower and the upper rail point, c being the axis point that stays
/// at `share` of the way between them measured in millimetres from the lower one: c = a + beta d with beta fixed.
///
/// A point on the tool's surface moves along its own normal as the axis point that the normal meets, so with the normal
/// as direction this is the first-order change of the deviation (the envelope is tangent to the tool).
pub(super) fn axis_gradient(direction: &Vector, axis: &Vector, share: f64) -> (Vector, Vector) {
    let turned = (direction - axis * direction.dot(axis)) * share;
    (direction - turned, turned)
}

/// Derivatives of `out . x` with respect to the lower and the upper rail point and to their rates, x being the envelope
/// point c + r n on the sphere whose centre c, at `height` above the lower rail point of the axis of `length`, is given by
/// its height above the tip, with r its radius and n the tool's outward normal (`contact`).
///
/// n keeps its angle to the axis d and stays square to the velocity v of c, so with n_a = n . d it changes by
/// dn = n_a dd - d (n . dd) + turn (d x n), turn = -(n . dv + n_a dd . v - (d . v)(n . dd)) / ((d x n) . v).
/// What v changes with d alone is left out: it is small against what it changes with the rates.
pub(super) fn point_gradient(
    rate: &PoseRate,
    (length, height): (f64, f64),
    (centre_height, radius, normal): (f64, f64, Vector),
    out: &Vector,
) -> [Vector; 4] {
    let axis = rate.pose.axis.into_inner();
    let share = height / length;
    let velocity = rate.tip_rate + rate.axis_rate * centre_height;
    let around = axis.cross(&normal);
    let turn = radius * around.dot(out) / around.dot(&velocity);
    let turn = if turn.is_finite() { -turn } else { 0.0 };
    let axial = normal.dot(&axis);
    // By dd, which is square to d.
    let by_axis =
        (out * axial - normal * axis.dot(out)) * radius + (velocity * axial - normal * axis.dot(&velocity)) * turn;
    let tilted = (by_axis - axis * by_axis.dot(&axis)) / length;
    let (lower, upper) = axis_gradient(out, &axis, share);
    let (lower_rate, upper_rate) = axis_gradient(&(normal * turn), &axis, share);
    [lower - tilted, upper + tilted, lower_rate, upper_rate]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use proptest::prelude::*;

    /// Against central differences of the envelope itself, by every coordinate of both rail points and their rates.
    #[test]
    fn the_envelope_point_moves_as_its_gradient_says() {
        use crate::geometry::Direction;
        use crate::motion::Pose;
        use crate::tool::meridian::{Element, at};
        let contact = Element::Line { from: at(0.0, 3.0), to: at(14.0, 6.0) }.contact(0.6);
        // Lower and upper rail point, and their rates; nearly without turning, which is what the gradient leaves out.
        let state = [0.2, -0.3, 1.0, 1.1, 0.4, 9.0, 20.0, 1.0, 3.0, 20.0, 1.0, 3.0];
        let into = Vector::new(0.1, 0.9, 0.2);
        let look = |s: &[f64; 12]| {
            let at = |i: usize| Vector::new(s[i], s[i + 1], s[i + 2]);
            let (span, rate) = (at(3) - at(0), at(9) - at(6));
            let (d, length) = (span.normalize(), span.norm());
            let axis_rate = (rate - d * d.dot(&rate)) / length;
            let lower_height = 1.0;
            let pose = Pose { tip: Point::from(at(0) - d * lower_height), axis: Direction::new_normalize(d) };
            let rate = PoseRate { pose, tip_rate: at(6) - axis_rate * lower_height, axis_rate };
            (envelope_point(&rate, &contact, &into).unwrap(), rate, length)
        };
        let (point, rate, length) = look(&state);
        let height = contact.sphere_height();
        let contact_of = (height, contact.sphere_radius(), point.normal.into_inner());
        for out in [point.normal.into_inner(), Vector::x(), Vector::y(), Vector::z()] {
            let gradient = point_gradient(&rate, (length, height - 1.0), contact_of, &out);
            for i in 0..12 {
                let moved = |by: f64| {
                    let mut state = state;
                    state[i] += by;
                    look(&state).0.point.coords.dot(&out)
                };
                let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                assert!((gradient[i / 3][i % 3] - difference).abs() < 1e-6, "{out} {i}: {gradient:?} {difference}");
            }
        }
    }

    fn vector() -> impl Strategy<Value = Vector> {
        [-2.0..2.0_f64, -2.0..2.0, -2.0..2.0].prop_map(Vector::from)
    }

    proptest! {
        /// Against central differences of n . c, c = a + beta d.
        #[test]
        fn gradient_is_that_of_the_axis_point(a in vector(), span in vector(), n in vector(), share in -1.0..2.0_f64) {
            prop_assume!(span.norm() > 0.5);
            let (a, b) = (Point::from(a), Point::from(a + span));
            let beta = share * span.norm();
            let value = |a: Point, b: Point| n.dot(&(a + (b - a).normalize() * beta).coords);
            let (lower, upper) = axis_gradient(&n, &span.normalize(), share);
            for i in 0..3 {
                let step = Vector::ith(i, 1e-5);
                let by_a = (value(a + step, b) - value(a - step, b)) / 2e-5;
                let by_b = (value(a, b + step) - value(a, b - step)) / 2e-5;
                prop_assert!((by_a - lower[i]).abs() < 1e-7 && (by_b - upper[i]).abs() < 1e-7);
            }
        }
    }
}
