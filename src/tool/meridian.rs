//! The half profile of a surface of revolution: line and circular-arc elements in the (height, radius) half plane.
//!
//! Height runs along the tool axis from the tip (0) toward the holder; radius is the distance from the axis. Elements
//! are listed from the tip upward, with the body on the side of the axis.

/// A point of the half plane, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeridianPoint {
    /// Along the axis, from the tip toward the holder.
    pub height: f64,
    /// Distance from the axis, never negative.
    pub radius: f64,
}

/// Shorthand for a [`MeridianPoint`].
pub fn at(height: f64, radius: f64) -> MeridianPoint {
    MeridianPoint { height, radius }
}

/// On which side of an arc the body lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArcSide {
    /// The body contains the arc's centre side: a bulge (ball, corner radius, barrel).
    Convex,
    /// The body lies outside the arc's circle: a hollow.
    Concave,
}

/// One smooth piece of a meridian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Element {
    /// A straight piece: cone, cylinder, or flat disc or shoulder where the height stays.
    Line {
        /// End nearer the tip along the profile.
        from: MeridianPoint,
        /// Other end.
        to: MeridianPoint,
    },
    /// A circular arc: torus, or sphere where the centre is on the axis.
    ///
    /// The point at angle `phi` is `(centre.height - radius cos phi, centre.radius + radius sin phi)`, so 0 points to
    /// the tip, 90 degrees away from the axis.
    Arc {
        /// Centre of the circle; its `radius` may be negative (barrels) and is then across the axis.
        centre: MeridianPoint,
        /// Radius of the circle, positive.
        radius: f64,
        /// Angle of the first end, radians.
        from: f64,
        /// Angle of the last end, radians; larger than `from` for convex arcs, smaller for concave ones.
        to: f64,
        /// Side of the body.
        side: ArcSide,
    },
}

/// A point on a meridian with its outward unit normal in the half plane, and the sphere that touches there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Where the surface is touched.
    pub point: MeridianPoint,
    /// Component of the outward normal along the axis (toward the holder); `-sin` of the half angle on a cone.
    pub normal_axial: f64,
    /// Component of the outward normal away from the axis.
    pub normal_radial: f64,
}

impl Contact {
    /// Height on the axis of the centre of the sphere that touches the meridian here: where the normal meets the axis.
    /// Defined where `normal_radial` is not zero. With rho the radius as a function of h it is `h + rho rho'`.
    pub fn sphere_height(&self) -> f64 {
        self.point.height - self.point.radius * self.normal_axial / self.normal_radial
    }

    /// Radius of that sphere.
    pub fn sphere_radius(&self) -> f64 {
        self.point.radius / self.normal_radial
    }
}

impl Element {
    /// First end.
    pub fn start(&self) -> MeridianPoint {
        match self {
            Self::Line { from, .. } => *from,
            Self::Arc { from, .. } => self.arc_point(*from),
        }
    }

    /// Last end.
    pub fn end(&self) -> MeridianPoint {
        match self {
            Self::Line { to, .. } => *to,
            Self::Arc { to, .. } => self.arc_point(*to),
        }
    }

    fn arc_point(&self, phi: f64) -> MeridianPoint {
        match self {
            Self::Arc { centre, radius, .. } => {
                let (sin, cos) = phi.sin_cos();
                at(centre.height - radius * cos, centre.radius + radius * sin)
            }
            Self::Line { from, .. } => *from,
        }
    }

    /// Length of the profile.
    pub fn length(&self) -> f64 {
        match self {
            Self::Line { from, to } => (to.height - from.height).hypot(to.radius - from.radius),
            Self::Arc { radius, from, to, .. } => radius * (to - from).abs(),
        }
    }

    /// The contact at share `s` of the profile's length, `s` in 0..=1.
    pub fn contact(&self, s: f64) -> Contact {
        match self {
            Self::Line { from, to } => {
                let (dh, dr) = (to.height - from.height, to.radius - from.radius);
                let length = dh.hypot(dr);
                Contact {
                    point: at(from.height + s * dh, from.radius + s * dr),
                    normal_axial: -dr / length,
                    normal_radial: dh / length,
                }
            }
            Self::Arc { from, to, side, .. } => {
                let phi = from + s * (to - from);
                let sign = if *side == ArcSide::Convex { 1.0 } else { -1.0 };
                Contact { point: self.arc_point(phi), normal_axial: -sign * phi.cos(), normal_radial: sign * phi.sin() }
            }
        }
    }

    /// Largest distance from the axis.
    pub fn max_radius(&self) -> f64 {
        let ends = self.start().radius.max(self.end().radius);
        match self {
            Self::Arc { centre, radius, from, to, .. } => {
                let top = std::f64::consts::FRAC_PI_2;
                if (from.min(*to)..=from.max(*to)).contains(&top) { ends.max(centre.radius + radius) } else { ends }
            }
            Self::Line { .. } => ends,
        }
    }
}
