//! Where a strip's envelope lies over the part: the one measure that both the refinement and the judgement use.

use super::chart::{Chart, ChartFoot};
use super::fit::SphereFamily;
use crate::envelope::{NoContact, envelope_point};
use crate::geometry::Vector;
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
        Hint { place: self.foot.frame.place, normal: self.foot.frame.normal }
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
        let frame = self.chart.foot(&centre, near)?.frame;
        Some(Hint { place: frame.place, normal: frame.normal })
    }

    /// The envelope at `share` of the flank between the rails.
    pub(super) fn touch(&self, at: &Instant, share: f64, hint: &Hint) -> Result<Touch, NoTouch> {
        let centre_height = (self.motion.lower_height + share * at.length).min(self.family.highest());
        let height = self.family.contact_height(centre_height);
        let contact = self.tool.contact_at(height).ok_or(NoTouch::Degenerate)?;
        let point = envelope_point(&at.rate, &contact, &-hint.normal).map_err(|cause| {
            let centre = at.rate.pose.at_height(contact.sphere_height());
            let over = self.chart.foot(&centre, hint.place).is_none_or(|foot| foot.frame.inside());
            NoTouch::Envelope { height, cause, over }
        })?;
        let foot = self.chart.foot(&point.point, hint.place).ok_or(NoTouch::Degenerate)?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use proptest::prelude::*;

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
