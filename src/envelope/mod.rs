//! What a moving tool sweeps: characteristic, deviation, kink. Uses `geometry`, `part`, `tool` and `motion`.
//!
//! Notation of Rajain 2023 (R5, R6) carried to any meridian: at height h the tool's outward normals are
//! `n = n_a d + n_r (cos phi w +- sin phi u)`; the envelope is touched where `n . v = 0`, v the velocity of the sphere
//! centre on the axis.

use crate::geometry::{Direction, Point, Vector};
use crate::motion::path::PoseRate;
use crate::tool::Contact;

/// A point of the envelope with the tool's outward normal there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvelopePoint {
    /// Where the tool touches its envelope, mm.
    pub point: Point,
    /// Out of the tool, into the material.
    pub normal: Direction,
}

/// Why a tool does not touch its envelope at some height and time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoContact {
    /// The sphere at this height lies inside its neighbours.
    #[error("the tool moves so steeply along its axis that this height cuts nothing of its own")]
    Swallowed,
    /// The tool moves along its axis only, or stands still.
    #[error("the tool does not move sideways here")]
    Unsteady,
}

/// The envelope point of the tool at `contact` on the branch whose normal leans toward `into_material`.
///
/// `cos phi = -n_a v_d / (n_r q)` with `v = v_d d + q w` the velocity of the sphere centre and `w` a unit vector.
pub fn envelope_point(rate: &PoseRate, contact: &Contact, into_material: &Vector) -> Result<EnvelopePoint, NoContact> {
    let d = rate.pose.axis.into_inner();
    let velocity = rate.tip_rate + rate.axis_rate * contact.sphere_height();
    let along = velocity.dot(&d);
    let across = velocity - d * along;
    let q = across.norm();
    if q <= 1e-9 * (1.0 + along.abs()) {
        return Err(NoContact::Unsteady);
    }
    let w = across / q;
    let u = d.cross(&w);
    let cosine = -contact.normal_axial * along / (contact.normal_radial * q);
    if cosine.abs() > 1.0 {
        return Err(NoContact::Swallowed);
    }
    let sine = (1.0 - cosine * cosine).sqrt();
    let branch = if u.dot(into_material) >= 0.0 { 1.0 } else { -1.0 };
    let radial = w * cosine + u * (branch * sine);
    let normal = d * contact.normal_axial + radial * contact.normal_radial;
    let point = rate.pose.at_height(contact.point.height) + radial * contact.point.radius;
    Ok(EnvelopePoint { point, normal: Direction::new_normalize(normal) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Pose;
    use crate::tool::meridian::{Element, at};

    fn moving(tip_rate: Vector, axis_rate: Vector) -> PoseRate {
        PoseRate { pose: Pose { tip: Point::origin(), axis: Vector::z_axis() }, tip_rate, axis_rate }
    }

    #[test]
    fn translated_cone_touches_along_its_silhouette() {
        let cone = Element::Line { from: at(0.0, 1.0), to: at(10.0, 3.0) };
        let rate = moving(Vector::new(2.0, 0.0, 0.5), Vector::zeros());
        let into = -Vector::y();
        for s in [0.0, 0.3, 1.0] {
            let contact = cone.contact(s);
            let touch = envelope_point(&rate, &contact, &into).unwrap();
            assert!(touch.normal.dot(&rate.tip_rate).abs() < 1e-12);
            assert!(touch.normal.dot(&into) > 0.0);
            let radius = touch.point.x.hypot(touch.point.y);
            assert!((radius - contact.point.radius).abs() < 1e-12);
        }
    }

    #[test]
    fn plunge_and_steep_slide_are_named() {
        let cone = Element::Line { from: at(0.0, 1.0), to: at(10.0, 3.0) }.contact(0.5);
        let plunge = moving(Vector::z(), Vector::zeros());
        assert_eq!(envelope_point(&plunge, &cone, &Vector::y()), Err(NoContact::Unsteady));
        let slide = moving(Vector::new(0.1, 0.0, 1.0), Vector::zeros());
        assert_eq!(envelope_point(&slide, &cone, &Vector::y()), Err(NoContact::Swallowed));
    }
}
