//! From the keys of `[tool]` to a tool, or to the wish for one.

use super::limits::{COEFFICIENTS, Checks, LENGTH, SIZE, TOOL_NUMBER, WEIGHT};
use super::raw::{self, ToolKind};
use crate::geometry::Degrees;
use crate::plan::meridian::{MeridianFamily, MeridianWeights, Seed, ToolWish};
use crate::tool::{CutterShape, Fixture, MeridianPoint, ProfilePoint, Tool};

/// The tool of a job.
#[derive(Clone, Debug, PartialEq)]
pub enum ToolSpec {
    /// Its sizes are given.
    Given(Box<Tool>),
    /// The planner is to find it.
    Wanted(Box<ToolWish>),
}

impl ToolSpec {
    /// Number in the control's tool table.
    pub fn number(&self) -> u32 {
        match self {
            Self::Given(tool) => tool.number,
            Self::Wanted(wish) => wish.number,
        }
    }

    /// The tool, where its sizes are given.
    pub fn given(&self) -> Option<&Tool> {
        match self {
            Self::Given(tool) => Some(tool),
            Self::Wanted(_) => None,
        }
    }
}

/// Keys that every kind has.
const COMMON: [&str; 6] = ["name", "number", "kind", "shank_diameter", "gauge_length", "holder"];

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
            Self::Optimize => "optimize",
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
            Self::Optimize => &["family", "coefficients", "radius", "ends", "length", "start", "weights"],
        }
    }
}

/// Checks the keys and joins them to a tool; `None` after a finding.
pub(super) fn build(checks: &mut Checks<'_>, raw: raw::Tool) -> Option<ToolSpec> {
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
    for (i, point) in raw.holder.iter().enumerate() {
        checks.all_within(&format!("tool.holder[{i}]"), point, &LENGTH);
    }
    if let ToolKind::Optimize = raw.kind {
        let wish = wish(checks, &raw);
        return (!checks.found_under("tool")).then(|| ToolSpec::Wanted(Box::new(wish)));
    }
    let shape = shape(checks, &raw)?;
    // A size that is out of range by itself would be blamed a second time for not fitting the others.
    if checks.found_under("tool") {
        return None;
    }
    match Tool::new(raw.number, &shape, &fixture(&raw)) {
        Ok(tool) => Some(ToolSpec::Given(Box::new(tool))),
        Err(error) => {
            let key = format!("tool.{}", error.key);
            checks.refuse(&key, error.to_string(), remedy(error.key));
            None
        }
    }
}

fn fixture(raw: &raw::Tool) -> Fixture {
    Fixture {
        shank_diameter: raw.shank_diameter,
        gauge_length: raw.gauge_length,
        holder: raw.holder.iter().map(meridian_point).collect(),
    }
}

/// What a tool that the planner is to find may be.
fn wish(checks: &mut Checks<'_>, raw: &raw::Tool) -> ToolWish {
    let mut range = |key: &str, value: Option<[f64; 2]>, all: (f64, f64)| {
        let Some([low, high]) = value else { return all };
        checks.all_within(&format!("tool.{key}"), &[low, high], &SIZE);
        if low > high {
            checks.refuse(
                &format!("tool.{key}"),
                format!("the least {key}, {low} mm, is larger than the largest, {high} mm"),
                format!("write {key} = [least, largest]"),
            );
        }
        (low, high)
    };
    let radius = range("radius", raw.radius, (0.1, 1e3));
    let length = range("length", raw.length, (0.0, raw.gauge_length));
    let ends = ends(checks, raw);
    if let Some(coefficients) = raw.coefficients {
        checks.within("tool.coefficients", f64::from(coefficients), &COEFFICIENTS);
    }
    let default = MeridianWeights::default();
    let given = raw.weights.unwrap_or_default();
    let mut weight = |key: &str, value: Option<f64>, default: f64| {
        let value = value.unwrap_or(default);
        checks.within(&format!("tool.weights.{key}"), value, &WEIGHT);
        value
    };
    ToolWish {
        number: raw.number,
        family: match raw.family.unwrap_or_default() {
            raw::MeridianFamily::Free => MeridianFamily::Free,
            raw::MeridianFamily::Cone => MeridianFamily::Cone,
            raw::MeridianFamily::Cylinder => MeridianFamily::Cylinder,
            raw::MeridianFamily::Barrel => MeridianFamily::Barrel,
        },
        coefficients: raw.coefficients.map(|count| count as usize),
        radius: ends.map_or(radius, |(r1, r2)| (r1.min(r2), r1.max(r2))),
        ends,
        seed: raw.start.map(|start| match start {
            raw::Seed::Line => Seed::Line,
            raw::Seed::Surface => Seed::Surface,
        }),
        length,
        weights: MeridianWeights {
            accuracy: weight("accuracy", given.accuracy, default.accuracy),
            rigidity: weight("rigidity", given.rigidity, default.rigidity),
            fairness: weight("fairness", given.fairness, default.fairness),
            proximity: weight("proximity", given.proximity, default.proximity),
        },
        fixture: fixture(raw),
    }
}

/// Radii of a cone's end spheres, where only its length is to be found.
fn ends(checks: &mut Checks<'_>, raw: &raw::Tool) -> Option<(f64, f64)> {
    let [r1, r2] = raw.ends?;
    checks.all_within("tool.ends", &[r1, r2], &SIZE);
    if !matches!(raw.family, Some(raw::MeridianFamily::Cone)) {
        let help = "write family = \"cone\", or radius = [least, largest] in place of `ends`";
        checks.refuse("tool.ends", "only a cone is given by the radii of its end spheres", help);
    }
    if raw.radius.is_some() {
        let message = "`ends` already gives the radii; `radius` contradicts it";
        checks.refuse("tool.radius", message, "leave out either `radius` or `ends`");
    }
    Some((r1, r2))
}

/// Points of a meridian: [height, radius], or [height, radius, bulge] where an arc follows.
fn profile_points(checks: &mut Checks<'_>, points: &[Vec<f64>]) -> Vec<ProfilePoint> {
    let mut profile = Vec::with_capacity(points.len());
    for (i, point) in points.iter().enumerate() {
        let key = format!("tool.points[{i}]");
        let (height, radius, bulge) = match *point.as_slice() {
            [height, radius] => (height, radius, 0.0),
            [height, radius, bulge] => (height, radius, bulge),
            _ => {
                checks.refuse(&key, format!("a point of {} numbers", point.len()), remedy("points"));
                continue;
            }
        };
        checks.all_within(&key, &[height, radius], &LENGTH);
        if !(-1.0..=1.0).contains(&bulge) {
            checks.refuse(&key, format!("a bulge of {bulge} is more than a half circle"), remedy("points"));
        }
        profile.push(ProfilePoint { point: MeridianPoint { height, radius }, bulge });
    }
    profile
}

fn meridian_point(&[height, radius]: &[f64; 2]) -> MeridianPoint {
    MeridianPoint { height, radius }
}

fn remedy(key: &str) -> &'static str {
    match key {
        "gauge_length" => "write the distance from the tip to the gauge line, at least the flute length",
        "holder" => "write [[height from tip, radius], …] in mm, heights increasing, the first above the flutes",
        "points" => {
            "write [[height from tip, radius], …] in mm, the first height 0, heights increasing; a third number, the \
             tangent of a quarter of its angle, makes the piece that follows an arc"
        }
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
            let Some(points) = &raw.points else {
                checks.refuse("tool", "a tool of kind \"meridian\" needs `points`", remedy("points"));
                return None;
            };
            Some(CutterShape::Meridian { points: profile_points(checks, points) })
        }
        ToolKind::Optimize => None,
    }
}
