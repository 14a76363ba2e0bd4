//! The kinds of cutter a user can name, each turned into one meridian of lines and arcs.

use super::ToolError;
use super::meridian::{ArcSide, Element, at};
use super::profile::{self, ProfilePoint};
use crate::geometry::{Degrees, Radians};
use std::f64::consts::FRAC_PI_2;

/// The cutting shape as the user gives it. Lengths mm.
#[derive(Clone, Debug, PartialEq)]
pub enum CutterShape {
    /// Straight flank, flat or rounded bottom.
    Cylinder {
        /// Diameter of the flank.
        diameter: f64,
        /// Radius between bottom and flank; equal to half the diameter it is a ball, below that a bull nose.
        corner_radius: f64,
        /// Tip to end of flutes.
        flute_length: f64,
    },
    /// Conical flank.
    Cone {
        /// Diameter where the flank, continued, meets the tip plane.
        tip_diameter: f64,
        /// Angle between axis and flank.
        half_angle: Degrees,
        /// Radius between bottom and flank.
        corner_radius: f64,
        /// Tip to end of flutes.
        flute_length: f64,
    },
    /// Conical flank between two touching spheres, as Rajain 2023, R1 to R2 gives it. The tip plane is the circle where
    /// the small sphere touches the cone.
    EndSpheres {
        /// Radius of the sphere at the tip.
        r1: f64,
        /// Radius of the sphere at the other end.
        r2: f64,
        /// Distance of their centres.
        length: f64,
    },
    /// Conical flank tangent to a ball at the tip.
    TaperedBall {
        /// Diameter of the ball.
        ball_diameter: f64,
        /// Angle between axis and flank.
        half_angle: Degrees,
        /// Tip to end of flutes.
        flute_length: f64,
    },
    /// Flank that is one large convex arc (tangential barrel; conical barrel when tilted).
    Barrel {
        /// Diameter at half the flute length.
        diameter: f64,
        /// Radius of the flank's arc.
        barrel_radius: f64,
        /// Angle between axis and flank at half the flute length.
        half_angle: Degrees,
        /// Radius between bottom and flank.
        corner_radius: f64,
        /// Tip to end of flutes.
        flute_length: f64,
    },
    /// Straight pieces and arcs between given points, closed by a flat bottom.
    Meridian {
        /// Points from the tip upward, heights increasing, the first at height 0.
        points: Vec<ProfilePoint>,
    },
}

fn positive(key: &'static str, value: f64) -> Result<f64, ToolError> {
    if value.is_finite() && value > 0.0 && value < 1e4 {
        return Ok(value);
    }
    Err(ToolError::new(key, format!("{value} is not a length between 0 and 10000 mm")))
}

impl CutterShape {
    /// The word for this kind in job files and headers.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Cylinder { diameter, corner_radius, .. } if *corner_radius * 2.0 >= *diameter => "ball",
            Self::Cylinder { corner_radius, .. } if *corner_radius > 0.0 => "bull",
            Self::Cylinder { .. } => "cylinder",
            Self::Cone { .. } | Self::EndSpheres { .. } => "cone",
            Self::TaperedBall { .. } => "tapered-ball",
            Self::Barrel { .. } => "barrel",
            Self::Meridian { .. } => "meridian",
        }
    }

    /// The cutting profile from the axis at the tip upward, checked.
    pub fn flutes(&self) -> Result<Vec<Element>, ToolError> {
        match self {
            Self::Cylinder { diameter, corner_radius, flute_length } => {
                positive("diameter", *diameter)?;
                conical(diameter / 2.0, 0.0, *corner_radius, positive("flute_length", *flute_length)?)
            }
            Self::Cone { tip_diameter, half_angle, corner_radius, flute_length } => {
                if !(tip_diameter.is_finite() && *tip_diameter >= 0.0) {
                    return Err(ToolError::new("tip_diameter", format!("{tip_diameter} mm is negative")));
                }
                let angle = slope(*half_angle)?;
                conical(tip_diameter / 2.0, angle.0, *corner_radius, positive("flute_length", *flute_length)?)
            }
            Self::EndSpheres { r1, r2, length } => {
                let (r1, r2, length) =
                    (positive("spheres.r1", *r1)?, positive("spheres.r2", *r2)?, positive("spheres.length", *length)?);
                let sine = (r2 - r1) / length;
                if sine.abs() >= 1.0 {
                    return Err(ToolError::new(
                        "spheres",
                        format!("spheres of radius {r1} and {r2} only {length} mm apart lie one inside the other"),
                    ));
                }
                let cosine = (1.0 - sine * sine).sqrt();
                conical(r1 * cosine, sine.asin(), 0.0, length * cosine * cosine)
            }
            Self::TaperedBall { ball_diameter, half_angle, flute_length } => {
                let radius = positive("ball_diameter", *ball_diameter)? / 2.0;
                let angle = slope(*half_angle)?;
                // Where the tangent cone, continued, meets the tip plane.
                let tip_radius = radius * ((FRAC_PI_2 - angle.0) / 2.0).tan();
                conical(tip_radius, angle.0, radius, positive("flute_length", *flute_length)?)
            }
            Self::Barrel { diameter, barrel_radius, half_angle, corner_radius, flute_length } => barrel(
                positive("diameter", *diameter)?,
                positive("barrel_radius", *barrel_radius)?,
                slope(*half_angle)?,
                *corner_radius,
                positive("flute_length", *flute_length)?,
            ),
            Self::Meridian { points } => profile::elements(points),
        }
    }
}

fn slope(angle: Degrees) -> Result<Radians, ToolError> {
    if angle.0.is_finite() && angle.0.abs() < 80.0 {
        return Ok(angle.into());
    }
    Err(ToolError::new("half_angle_deg", format!("{} degrees is outside -80..80", angle.0)))
}

/// Flat disc, corner arc and straight flank; pieces of no length are left out.
fn conical(tip_radius: f64, angle: f64, corner: f64, flute_length: f64) -> Result<Vec<Element>, ToolError> {
    if !(corner.is_finite() && corner >= 0.0) {
        return Err(ToolError::new("corner_radius", format!("{corner} mm is negative")));
    }
    // Tangent length from the corner between tip plane and flank, whose inner angle is 90 degrees + angle.
    let tangent = corner * ((FRAC_PI_2 - angle) / 2.0).tan();
    let flat = tip_radius - tangent;
    if flat < -1e-9 * corner.max(1.0) {
        let limit = tip_radius / ((FRAC_PI_2 - angle) / 2.0).tan();
        return Err(ToolError::new(
            "corner_radius",
            format!("{corner} mm does not fit; this tip takes at most {limit:.4} mm"),
        ));
    }
    let flat = flat.max(0.0);
    let top = at(flute_length, tip_radius + flute_length * angle.tan());
    if top.radius <= 0.0 {
        return Err(ToolError::new(
            "half_angle_deg",
            format!("the flank reaches the axis before the end of the flutes at {flute_length} mm"),
        ));
    }
    let mut elements = vec![Element::Line { from: at(0.0, 0.0), to: at(0.0, flat) }];
    let mut flank_start = at(0.0, tip_radius);
    if corner > 0.0 {
        let arc = Element::Arc {
            centre: at(corner, flat),
            radius: corner,
            from: 0.0,
            to: FRAC_PI_2 - angle,
            side: ArcSide::Convex,
        };
        flank_start = arc.end();
        elements.push(arc);
    }
    if flank_start.height >= flute_length {
        return Err(ToolError::new(
            "flute_length",
            format!("{flute_length} mm ends inside the corner radius, which needs {:.4} mm", flank_start.height),
        ));
    }
    elements.push(Element::Line { from: flank_start, to: top });
    elements.retain(|e| e.length() > 1e-12);
    Ok(elements)
}

fn barrel(
    diameter: f64,
    barrel_radius: f64,
    angle: Radians,
    corner: f64,
    flute_length: f64,
) -> Result<Vec<Element>, ToolError> {
    if !(corner.is_finite() && corner >= 0.0) {
        return Err(ToolError::new("corner_radius", format!("{corner} mm is negative")));
    }
    let (sin, cos) = angle.sin_cos();
    // Normal at half the flute length is (-sin, cos) in (height, radius); the centre lies one radius behind it.
    let centre = at(flute_length / 2.0 + barrel_radius * sin, diameter / 2.0 - barrel_radius * cos);
    let phi_at = |height: f64| -> Option<f64> {
        let cosine = (centre.height - height) / barrel_radius;
        (cosine.abs() < 1.0).then(|| cosine.acos())
    };
    let too_curved = || {
        ToolError::new(
            "barrel_radius",
            format!("an arc of {barrel_radius} mm does not span the flute length {flute_length} mm"),
        )
    };
    let to = phi_at(flute_length).ok_or_else(too_curved)?;
    // The corner circle touches the tip plane from above and the flank's circle from inside.
    let reach = barrel_radius - corner;
    let lift = centre.height - corner;
    if reach <= lift.abs() {
        return Err(too_curved());
    }
    let corner_centre = at(corner, centre.radius + (reach * reach - lift * lift).sqrt());
    let from = phi_at(if corner > 0.0 { centre.height - barrel_radius * (lift / reach) } else { 0.0 })
        .ok_or_else(too_curved)?;
    if corner_centre.radius < 0.0 || from >= to {
        return Err(ToolError::new("corner_radius", format!("{corner} mm does not fit under this flank")));
    }
    let flank = Element::Arc { centre, radius: barrel_radius, from, to, side: ArcSide::Convex };
    if flank.start().radius <= 0.0 || flank.end().radius <= 0.0 {
        return Err(ToolError::new("diameter", format!("{diameter} mm is too small: the flank crosses the axis")));
    }
    let mut elements = vec![Element::Line { from: at(0.0, 0.0), to: at(0.0, corner_centre.radius) }];
    if corner > 0.0 {
        elements.push(Element::Arc {
            centre: corner_centre,
            radius: corner,
            from: 0.0,
            to: from,
            side: ArcSide::Convex,
        });
    }
    elements.push(flank);
    elements.retain(|e| e.length() > 1e-12);
    Ok(elements)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_joined(elements: &[Element]) {
        for pair in elements.windows(2) {
            let (a, b) = (pair[0].end(), pair[1].start());
            assert!((a.height - b.height).hypot(a.radius - b.radius) < 1e-9, "{a:?} {b:?}");
        }
        let start = elements[0].start();
        assert!(start.height.hypot(start.radius) < 1e-12, "{start:?}");
    }

    fn assert_smooth(elements: &[Element]) {
        assert_joined(elements);
        for pair in elements.windows(2) {
            let (a, b) = (pair[0].contact(1.0), pair[1].contact(0.0));
            assert!((a.normal_axial - b.normal_axial).hypot(a.normal_radial - b.normal_radial) < 1e-9, "{a:?} {b:?}");
        }
    }

    #[test]
    fn rounded_cutters_have_continuous_normals() {
        let degrees = Degrees(7.0);
        for shape in [
            CutterShape::Cylinder { diameter: 10.0, corner_radius: 5.0, flute_length: 20.0 },
            CutterShape::Cylinder { diameter: 10.0, corner_radius: 1.5, flute_length: 20.0 },
            CutterShape::Cone { tip_diameter: 6.0, half_angle: degrees, corner_radius: 1.0, flute_length: 20.0 },
            CutterShape::Cone { tip_diameter: 12.0, half_angle: Degrees(-5.0), corner_radius: 1.0, flute_length: 20.0 },
            CutterShape::TaperedBall { ball_diameter: 6.0, half_angle: degrees, flute_length: 30.0 },
            CutterShape::Barrel {
                diameter: 10.0,
                barrel_radius: 85.0,
                half_angle: Degrees(0.0),
                corner_radius: 1.0,
                flute_length: 20.0,
            },
            CutterShape::Barrel {
                diameter: 10.0,
                barrel_radius: 250.0,
                half_angle: Degrees(10.0),
                corner_radius: 0.5,
                flute_length: 20.0,
            },
        ] {
            assert_smooth(&shape.flutes().unwrap());
        }
    }

    #[test]
    fn tapered_ball_touches_tip_and_its_own_sphere() {
        let shape = CutterShape::TaperedBall { ball_diameter: 6.0, half_angle: Degrees(4.0), flute_length: 30.0 };
        let flutes = shape.flutes().unwrap();
        let Element::Arc { centre, radius, .. } = flutes[0] else { panic!("starts with the ball: {flutes:?}") };
        assert!((centre.height - 3.0).abs() < 1e-12 && centre.radius.abs() < 1e-12 && radius == 3.0);
    }

    #[test]
    fn end_spheres_touch_the_flank() {
        let (r1, r2, length) = (3.0, 6.0, 14.0);
        let flutes = CutterShape::EndSpheres { r1, r2, length }.flutes().unwrap();
        let flank = flutes.last().unwrap();
        let (low, high) = (flank.contact(0.0), flank.contact(1.0));
        assert!((low.sphere_radius() - r1).abs() < 1e-12);
        assert!((high.sphere_radius() - r2).abs() < 1e-12);
        assert!((high.sphere_height() - low.sphere_height() - length).abs() < 1e-12);
    }

    #[test]
    fn absurd_sizes_name_their_key() {
        let key = |shape: CutterShape| shape.flutes().unwrap_err().key;
        assert_eq!(key(CutterShape::Cylinder { diameter: -1.0, corner_radius: 0.0, flute_length: 1.0 }), "diameter");
        assert_eq!(
            key(CutterShape::Cylinder { diameter: 4.0, corner_radius: 2.1, flute_length: 9.0 }),
            "corner_radius"
        );
        assert_eq!(
            key(CutterShape::Cone {
                tip_diameter: 2.0,
                half_angle: Degrees(f64::NAN),
                corner_radius: 0.0,
                flute_length: 9.0
            }),
            "half_angle_deg"
        );
        assert_eq!(key(CutterShape::EndSpheres { r1: 1.0, r2: 5.0, length: 3.0 }), "spheres");
        assert_eq!(
            key(CutterShape::Meridian { points: vec![ProfilePoint { point: at(0.0, 1.0), bulge: 0.0 }] }),
            "points"
        );
    }
}
