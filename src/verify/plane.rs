//! Planes that touch the tool and ride with it, and how far they keep a line away over a stretch of time. Uses `geometry`
//! and the other files of this module.

use super::body::{Cap, NEAR_POLE, Nearest, Piece, Support};
use super::fan::Fan;
use super::motion_tree::Linear;
use super::ray::{LocalRay, NormalRay};
use crate::geometry::{Direction, Vector};
use crate::motion::Pose;

/// A plane that touches a piece from outside. On a round part of the tool it keeps its direction while the tool turns
/// under it; elsewhere it rides with the tool.
pub(super) struct Plane {
    /// Unit normal, out of the tool.
    normal: Vector,
    /// Its parts along the axis and square to it.
    axial: f64,
    radial: f64,
    /// Unit radial direction.
    out: Vector,
    /// Where it touches.
    foot: Vector,
    /// Height of the axis point about which the motion is expanded: where the normal meets the axis, if near.
    pivot: f64,
    /// The round part of the tool that it touches.
    cap: Option<Cap>,
}

impl Plane {
    /// The plane square to the shortest way from a point of the ray to the piece.
    pub(super) fn new(ray: &NormalRay, local: &LocalRay, linear: &Linear, lambda: f64, nearest: &Nearest) -> Self {
        let axis = linear.pose.axis.into_inner();
        let out = radial_direction(ray, &linear.pose, lambda, local.height(lambda));
        let foot = linear.pose.at_height(nearest.height).coords + out * nearest.radius;
        let pivot = pivot((nearest.height, nearest.radius), (nearest.axial, nearest.radial));
        let normal = axis * nearest.axial + out * nearest.radial;
        Self { normal, axial: nearest.axial, radial: nearest.radial, out, foot, pivot, cap: nearest.cap }
    }

    /// The plane in the same place that touches the profile alone: at a rim, which the nearest point often is, it leans
    /// least against the rays of a fan that the profile faces.
    pub(super) fn along_profile(&self, linear: &Linear, nearest: &Nearest) -> Option<Self> {
        let leans = |(axial, radial): &(f64, f64)| {
            (axial - nearest.axial).abs() + (radial - nearest.radial).abs() > f64::EPSILON.sqrt()
        };
        let (axial, radial) = nearest.profile.filter(leans)?;
        let normal = linear.pose.axis.into_inner() * axial + self.out * radial;
        let pivot = pivot((nearest.height, nearest.radius), (axial, radial));
        Some(Self { normal, axial, radial, pivot, cap: None, ..*self })
    }

    /// The tangent plane of a convex piece that is parallel to the ray, between two that lean one each way; `None` for
    /// hollow pieces, and where the two face each other.
    pub(super) fn parallel(
        falling: &Self,
        rising: &Self,
        ray: &NormalRay,
        linear: &Linear,
        piece: &Piece,
    ) -> Option<Self> {
        if piece.clear_radius.is_finite() {
            return None;
        }
        let (down, up) = (-falling.slope(ray), rising.slope(ray));
        let normal = Direction::try_new(falling.normal * up + rising.normal * down, 1e-6 * (down + up))?.into_inner();
        Some(Self::support(&normal, linear, piece))
    }

    /// The tangent plane of a convex piece, at the stretch's own pose, with a given unit normal.
    pub(super) fn support(normal: &Vector, linear: &Linear, piece: &Piece) -> Self {
        let axis = linear.pose.axis.into_inner();
        let axial = normal.dot(&axis);
        let across = normal - axis * axial;
        // Along the axis only rounding is left, which may lie anywhere.
        let across = across - axis * across.dot(&axis);
        let radial = across.norm();
        let out = if radial > 0.0 { across / radial } else { across };
        let Support { height, radius, cap } = piece.support(axial, radial);
        let foot = linear.pose.at_height(height).coords + out * radius;
        Self { normal: *normal, axial, radial, out, foot, pivot: pivot((height, radius), (axial, radial)), cap }
    }

    /// How the distance from the plane changes along the ray.
    pub(super) fn slope(&self, ray: &NormalRay) -> f64 {
        self.normal.dot(&ray.normal)
    }

    /// The place on the ray nearest to where the plane touches.
    pub(super) fn foot_on(&self, ray: &NormalRay) -> f64 {
        ray.normal.dot(&(self.foot - ray.origin.coords))
    }

    /// True where the ray between two lambdas lies outside.
    pub(super) fn separates(&self, ray: &NormalRay, ends: (f64, f64)) -> bool {
        self.distance(ray, ends.0).min(self.distance(ray, ends.1)) > 0.0
    }

    /// Distance of a point of the ray from the plane.
    fn distance(&self, ray: &NormalRay, lambda: f64) -> f64 {
        self.normal.dot(&(ray.origin.coords + ray.normal.into_inner() * lambda - self.foot))
    }

    /// Lower bound, over the stretch and over the ray between two lambdas, of the distance of the ray from the plane
    /// (from the tangent sphere for hollow pieces); with a fan, of all its rays, of which `ray` is the middle one.
    pub(super) fn lowest(
        &self,
        ray: &NormalRay,
        linear: &Linear,
        piece: &Piece,
        ends: (f64, f64),
        reference: f64,
        fan: Option<&Fan>,
    ) -> f64 {
        let axial_turn = |far: f64| self.normal.dot(&linear.axis_rate).abs() * far + linear.axis_error(reference);
        let far = linear.range.1.max(-linear.range.0);
        if let Some(cap) = self.cap.filter(|cap| axial_turn(far) <= cap.freedom) {
            let spread = |lambda: f64| fan.map_or(0.0, |fan| fan.spread(&self.normal, lambda));
            let away = [ends.0, ends.1].map(|lambda| self.distance(ray, lambda) - spread(lambda));
            return away[0].min(away[1]) - self.approach(linear, &cap, reference);
        }
        let axis = linear.pose.axis.into_inner();
        let centre = linear.pose.at_height(self.pivot).coords;
        let centre_rate = linear.tip_rate + linear.axis_rate * self.pivot;
        let normal_rate = linear.axis_rate * self.axial - axis * (self.radial * self.out.dot(&linear.axis_rate));
        let centre_error = linear.error_at(self.pivot, reference);
        let axis_error = linear.axis_error(reference);
        let (first, last) = linear.range;
        let turn = linear.turn * far + axis_error;
        let travel = centre_rate.norm() * far + centre_error;
        let normal_error = std::f64::consts::SQRT_2 * axis_error + 0.5 * self.radial.abs() * turn * turn;
        // What normal and centre do to each other: their own rates by the sign that counts, the rest by its size.
        let tilt = normal_rate.norm() * far;
        let crossed = normal_rate.dot(&centre_rate).max(0.0) * far * far + tilt * centre_error + normal_error * travel;
        let shortening = 0.5 * (tilt + normal_error).powi(2);
        let mut lowest = f64::INFINITY;
        for lambda in [ends.0, ends.1] {
            let point = ray.origin.coords + ray.normal.into_inner() * lambda;
            let lever = point - centre;
            // Along itself the normal changes by the second order only: its length stays 1.
            let along = self.normal.dot(&lever);
            let across = lever - self.normal * along;
            let slope = normal_rate.dot(&across) - self.normal.dot(&centre_rate);
            let mut value = self.normal.dot(&(point - self.foot)) + (slope * first).min(slope * last)
                - (centre_error + normal_error * across.norm() + shortening * along.max(0.0) + crossed);
            let reach = fan.map_or(0.0, |fan| fan.reach(lambda));
            if let Some(fan) = fan {
                value -= fan.spread(&self.normal, lambda) + (tilt + normal_error) * reach;
            }
            if piece.clear_radius.is_finite() {
                let away = (point - self.foot).norm() + travel + turn * lever.norm() + reach;
                value -= away * away / (2.0 * piece.clear_radius);
            }
            lowest = lowest.min(value);
        }
        lowest
    }

    /// How much nearer a plane that keeps its direction comes over the stretch: it goes as the axis point does at which its
    /// normal meets the axis.
    fn approach(&self, linear: &Linear, cap: &Cap, reference: f64) -> f64 {
        let slope = self.normal.dot(&(linear.tip_rate + linear.axis_rate * cap.pivot));
        (slope * linear.range.0).max(slope * linear.range.1) + linear.error_at(cap.pivot, reference)
    }
}

/// Height of the axis point about which the motion is expanded: where the normal meets the axis, if near.
fn pivot(foot: (f64, f64), (axial, radial): (f64, f64)) -> f64 {
    if radial > NEAR_POLE { foot.0 - foot.1 * axial / radial } else { foot.0 }
}

/// Unit vector from the axis to a point of the ray, square to the axis; zero on the axis.
pub(super) fn radial_direction(ray: &NormalRay, pose: &Pose, lambda: f64, height: f64) -> Vector {
    let point = ray.origin.coords + ray.normal.into_inner() * lambda;
    let out = point - pose.at_height(height).coords;
    let length = out.norm();
    if length > 0.0 { out / length } else { Vector::zeros() }
}
