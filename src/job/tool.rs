//! From the keys of `[tool]` to a tool.

use super::limits::{Checks, LENGTH, TOOL_NUMBER};
use super::raw::{self, ToolKind};
use crate::geometry::Degrees;
use crate::tool::{CutterShape, Fixture, MeridianPoint, Tool};

/// Keys that every kind has.
const COMMON: [&str; 5] = ["number", "kind", "shank_diameter", "gauge_length", "holder"];

impl ToolKind {
    fn word(self) -> &'static str {
        match self {
            Self::Cylinder => "cylinder",
            Self::Ball => "ball",
            Self::Bull => "bull",
            Self::Cone => "cone",
            Self::TaperedBall => "tapered-ball",
            Self::Barrel => "barrel",
            Self::Meridian => "meridian",
        }
    }

    /// The keys of this kind beside the common ones.
    fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Cylinder | Self::Bull => &["diameter", "corner_radius", "flute_length"],
            Self::Ball => &["diameter", "flute_length"],
            Self::Cone => &["tip_diameter", "half_angle_deg", "corner_radius", "flute_length", "spheres"],
            Self::TaperedBall => &["ball_diameter", "half_angle_deg", "flute_length"],
            Self::Barrel => &["diameter", "barrel_radius", "half_angle_deg", "corner_radius", "flute_length"],
            Self::Meridian => &["points"],
        }
    }
}

/// Checks the keys and joins them to a tool; `None` after a finding.
pub(super) fn build(checks: &mut Checks<'_>, raw: raw::Tool) -> Option<Tool> {
    checks.within("tool.number", f64::from(raw.number), &TOOL_NUMBER);
    refuse_foreign_keys(checks, &raw);
    for (key, value) in [
        ("tip_diameter", raw.tip_diameter),
        ("corner_radius", raw.corner_radius),
        ("flute_length", raw.flute_length),
        ("diameter", raw.diameter),
        ("ball_diameter", raw.ball_diameter),
        ("barrel_radius", raw.barrel_radius),
        ("shank_diameter", raw.shank_diameter),
        ("gauge_length", Some(raw.gauge_length)),
    ] {
        if let Some(value) = value {
            checks.within(&format!("tool.{key}"), value, &LENGTH);
        }
    }
    for (key, list) in [("points", raw.points.as_deref().unwrap_or_default()), ("holder", &raw.holder)] {
        for (i, point) in list.iter().enumerate() {
            checks.all_within(&format!("tool.{key}[{i}]"), point, &LENGTH);
        }
    }
    let shape = shape(checks, &raw)?;
    // A size that is out of range by itself would be blamed a second time for not fitting the others.
    if checks.found_under("tool") {
        return None;
    }
    let fixture = Fixture {
        shank_diameter: raw.shank_diameter,
        gauge_length: raw.gauge_length,
        holder: raw.holder.iter().map(meridian_point).collect(),
    };
    match Tool::new(raw.number, &shape, &fixture) {
        Ok(tool) => Some(tool),
        Err(error) => {
            let key = format!("tool.{}", error.key);
            checks.refuse(&key, error.to_string(), remedy(error.key));
            None
        }
    }
}

fn meridian_point(&[height, radius]: &[f64; 2]) -> MeridianPoint {
    MeridianPoint { height, radius }
}

fn remedy(key: &str) -> &'static str {
    match key {
        "gauge_length" => "write the distance from the tip to the gauge line, at least the flute length",
        "holder" => "write [[height from tip, radius], …] in mm, heights increasing, the first above the flutes",
        "points" => "write [[height from tip, radius], …] in mm, the first height 0, heights increasing",
        "half_angle_deg" => "write the angle between axis and flank in degrees, such as 4.0",
        "spheres" | "spheres.r1" | "spheres.r2" | "spheres.length" => {
            "write radii of the two end spheres and the distance of their centres, larger than the radii differ"
        }
        _ => "write a positive length in mm that fits the other sizes of this tool",
    }
}

fn refuse_foreign_keys(checks: &mut Checks<'_>, raw: &raw::Tool) {
    let own = raw.kind.keys();
    for key in checks.keys("tool") {
        if !COMMON.contains(&key.as_str()) && !own.contains(&key.as_str()) {
            let kind = raw.kind.word();
            checks.refuse(
                &format!("tool.{key}"),
                format!("a tool of kind \"{kind}\" has no `{key}`"),
                format!("leave it out; the sizes of this kind are: {}", own.join(", ")),
            );
        } else if raw.spheres.is_some() && key != "spheres" && own.contains(&key.as_str()) {
            checks.refuse(
                &format!("tool.{key}"),
                format!("`spheres` already gives the cone; `{key}` contradicts it"),
                "leave out either `spheres` or the other sizes",
            );
        }
    }
}

fn shape(checks: &mut Checks<'_>, raw: &raw::Tool) -> Option<CutterShape> {
    let kind = raw.kind.word();
    let mut need = |key: &str, value: Option<f64>| {
        if value.is_none() {
            checks.refuse(
                "tool",
                format!("a tool of kind \"{kind}\" needs `{key}`"),
                format!("add a line `{key} = …` to this table"),
            );
        }
        value
    };
    let optional_corner = raw.corner_radius.unwrap_or(0.0);
    match raw.kind {
        ToolKind::Cylinder | ToolKind::Ball | ToolKind::Bull => {
            let (diameter, flute_length) = (need("diameter", raw.diameter), need("flute_length", raw.flute_length));
            let corner_radius = match raw.kind {
                ToolKind::Ball => raw.diameter.map(|d| d / 2.0),
                ToolKind::Bull => need("corner_radius", raw.corner_radius),
                _ => Some(optional_corner),
            };
            Some(CutterShape::Cylinder {
                diameter: diameter?,
                corner_radius: corner_radius?,
                flute_length: flute_length?,
            })
        }
        ToolKind::Cone => match raw.spheres {
            Some(s) => Some(CutterShape::EndSpheres { r1: s.r1, r2: s.r2, length: s.length }),
            None => {
                let tip_diameter = need("tip_diameter", raw.tip_diameter);
                let half_angle = need("half_angle_deg", raw.half_angle_deg).map(Degrees);
                let flute_length = need("flute_length", raw.flute_length);
                Some(CutterShape::Cone {
                    tip_diameter: tip_diameter?,
                    half_angle: half_angle?,
                    corner_radius: optional_corner,
                    flute_length: flute_length?,
                })
            }
        },
        ToolKind::TaperedBall => {
            let ball_diameter = need("ball_diameter", raw.ball_diameter);
            let half_angle = need("half_angle_deg", raw.half_angle_deg).map(Degrees);
            let flute_length = need("flute_length", raw.flute_length);
            Some(CutterShape::TaperedBall {
                ball_diameter: ball_diameter?,
                half_angle: half_angle?,
                flute_length: flute_length?,
            })
        }
        ToolKind::Barrel => {
            let diameter = need("diameter", raw.diameter);
            let barrel_radius = need("barrel_radius", raw.barrel_radius);
            let flute_length = need("flute_length", raw.flute_length);
            Some(CutterShape::Barrel {
                diameter: diameter?,
                barrel_radius: barrel_radius?,
                half_angle: Degrees(raw.half_angle_deg.unwrap_or(0.0)),
                corner_radius: optional_corner,
                flute_length: flute_length?,
            })
        }
        ToolKind::Meridian => {
            if raw.points.is_none() {
                checks.refuse("tool", "a tool of kind \"meridian\" needs `points`", remedy("points"));
            }
            Some(CutterShape::Meridian { points: raw.points.as_ref()?.iter().map(meridian_point).collect() })
        }
    }
}
