//! The numbers that the page's script draws: one JSON object, long lists as base64.

use super::colour::{OVERCUT, STEPS, STRIPS, Scale, UNCUT, UNDERCUT};
use super::data::{Mesh, ReportData};
use super::encode::{floats, integers, script_json};
use crate::geometry::Vector;
use crate::tool::Section;
use serde_json::{Value, json};

/// Everything the script needs. Strips count from 0, -1 where there is none; deviations are 0 where `uncut` is 1.
pub(super) fn payload(data: &ReportData) -> String {
    let samples = &data.timeline.samples;
    let mut value = json!({
        "colours": {"overcut": OVERCUT, "undercut": UNDERCUT, "uncut": UNCUT, "strips": STRIPS, "steps": STEPS},
        "surroundings": data.surroundings.iter().map(mesh).collect::<Vec<_>>(),
        "bodies": data.bodies.iter().map(|body| {
            let mut view = mesh(&body.mesh);
            view["name"] = json!(body.name);
            view["fixture"] = json!(body.fixture);
            view["link"] = json!(body.link.map_or(-1, |link| i64::try_from(link).unwrap_or(-1)));
            view
        }).collect::<Vec<_>>(),
        "links": data.links.iter().map(|track| json!({
            "turns": floats(track.iter().flat_map(|m| <[f64; 4]>::from(m.rotation.coords))),
            "ways": floats(track.iter().flat_map(|m| <[f64; 3]>::from(m.translation.vector))),
        })).collect::<Vec<_>>(),
        "rulings": {
            "ends": floats(data.rulings.iter().flat_map(|r| [r.from, r.to]).flat_map(|p| [p.x, p.y, p.z])),
            "strips": integers(data.rulings.iter().map(|r| r.strip)),
        },
        "tool": data.tool.iter().map(|s| json!({
            "section": match s.section {
                Section::Flute => "flute",
                Section::Shank => "shank",
                Section::Holder => "holder",
            },
            "outline": floats(s.outline.iter().flatten().copied()),
        })).collect::<Vec<_>>(),
        "time": floats(samples.iter().map(|s| s.time)),
        "tip": floats(samples.iter().flat_map(|s| [s.tip.x, s.tip.y, s.tip.z])),
        "axis": floats(samples.iter().flat_map(|s| [s.axis.x, s.axis.y, s.axis.z])),
        "line": integers(samples.iter().map(|s| u32::try_from(s.line).unwrap_or(u32::MAX))),
        "axes": data.timeline.axes.iter().map(|a| json!({
            "unit": a.unit,
            "position": floats(a.position.iter().copied()),
            "speed": floats(a.speed.iter().copied()),
        })).collect::<Vec<_>>(),
        "findings": data.findings.iter().filter_map(|f| f.point.map(|p| json!({
            "line": f.line, "text": f.text, "point": [p.x as f32, p.y as f32, p.z as f32],
        }))).collect::<Vec<_>>(),
        "program": data.program,
    });
    if let (Some(part), Value::Object(fields)) = (&data.part, &mut value) {
        let mut view = mesh(&part.mesh);
        view["scale"] = json!(Scale::of(part));
        view["deviation"] = json!(floats(part.deviation.iter().map(|d| d.unwrap_or(0.0))));
        view["uncut"] = json!(floats(part.deviation.iter().map(|d| f64::from(u8::from(d.is_none())))));
        view["strip"] = json!(floats(part.strip.iter().map(|s| s.map_or(-1.0, f64::from))));
        fields.insert("part".to_owned(), view);
    }
    script_json(&value)
}

fn mesh(mesh: &Mesh) -> Value {
    let unit = |n: &Vector| n.try_normalize(0.0).unwrap_or_else(Vector::z);
    json!({
        "points": floats(mesh.points.iter().flat_map(|p| [p.x, p.y, p.z])),
        "normals": floats(mesh.normals.iter().map(unit).flat_map(|n| [n.x, n.y, n.z])),
        "triangles": integers(mesh.triangles.iter().flatten().copied()),
    })
}
