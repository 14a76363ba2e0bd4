//! Tool files: one tool as TOML, whose `[tool]` table is that of a job. What the planner finds is written so, and read
//! back when a program is judged. Format `regulus-tool`, version 1.

use super::limits::Checks;
use super::{raw, tool};
use crate::diagnostic::{Diagnostic, TomlText};
use crate::tool::export::{facts, profile};
use crate::tool::{Fixture, ProfilePoint, Tool};
use serde::Deserialize;
use std::fmt::Write;

const FORMAT: &str = "regulus-tool";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u32,
    tool: raw::Tool,
}

/// Reads a tool file; all findings at once.
pub fn read_tool(text: &str, file: &str) -> Result<Tool, Vec<Diagnostic>> {
    let text = TomlText::new(file, text);
    let raw: File = text.parse().map_err(|e| vec![*e])?;
    let mut checks = Checks::new(&text);
    checks.header((&raw.format, raw.version), (FORMAT, "a tool file"));
    let optimize = matches!(raw.tool.kind, raw::ToolKind::Optimize);
    if optimize {
        checks.refuse("tool.kind", "a tool file holds a tool, not the wish for one", "write the sizes of a tool");
    }
    let built = tool::build(&mut checks, raw.tool);
    match (checks.finish(), built) {
        ((findings, _), Some(tool::ToolSpec::Given(tool))) if findings.is_empty() => Ok(*tool),
        ((findings, _), _) => Err(findings),
    }
}

/// The text of a tool file: the flank of `tool` as points and arcs, exact to the last bit, under the facts that its
/// maker needs.
pub fn write_tool(tool: &Tool, fixture: &Fixture, name: &str) -> String {
    let mut text = format!("format = \"{FORMAT}\"\nversion = 1\n\n# Tool found for job \"{}\".\n", one_line(name));
    for line in fact_lines(tool) {
        let _ = writeln!(text, "# {line}");
    }
    let _ = writeln!(text, "\n[tool]\nnumber = {}\nkind = \"meridian\"", tool.number);
    let _ =
        writeln!(text, "# [height from tip, radius, tangent of a quarter of the following arc's angle]\npoints = [");
    for ProfilePoint { point, bulge } in profile(tool) {
        let _ = writeln!(text, "    [{:?}, {:?}, {bulge:?}],", point.height, point.radius);
    }
    let _ = writeln!(text, "]\ngauge_length = {:?}", fixture.gauge_length);
    if let Some(diameter) = fixture.shank_diameter {
        let _ = writeln!(text, "shank_diameter = {diameter:?}");
    }
    if !fixture.holder.is_empty() {
        let points: Vec<_> = fixture.holder.iter().map(|p| format!("[{:?}, {:?}]", p.height, p.radius)).collect();
        let _ = writeln!(text, "holder = [{}]", points.join(", "));
    }
    text
}

/// The facts of a flank in words, one a line.
pub fn fact_lines(tool: &Tool) -> Vec<String> {
    let facts = facts(tool);
    let place = |found: Option<[f64; 2]>| {
        found.map_or("none".to_owned(), |[radius, height]| format!("{radius:.3} mm, at height {height:.3} mm"))
    };
    let hollows: Vec<_> = facts.hollows_mm.iter().map(|[low, high]| format!("{low:.3} to {high:.3}")).collect();
    let hollows = if hollows.is_empty() { "nowhere".to_owned() } else { format!("{} mm", hollows.join(", ")) };
    let course = if facts.monotone { "the radius never turns" } else { "the radius rises and falls" };
    vec![
        format!(
            "Flank {:.3} mm high, radius {:.3} to {:.3} mm; {course}.",
            facts.flute_length_mm, facts.radius_mm[0], facts.radius_mm[1]
        ),
        format!("Smallest radius of curvature of a bulge: {}.", place(facts.smallest_bulge_mm)),
        format!("Smallest radius of curvature of a hollow: {}.", place(facts.smallest_hollow_mm)),
        format!("Hollow at heights: {hollows}."),
        format!("Sharpest joint of its arcs: {:.2e} degrees.", facts.sharpest_joint_deg),
    ]
}

fn one_line(name: &str) -> String {
    name.chars().filter(|c| !c.is_control()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tool::{CutterShape, MeridianPoint};

    fn waisted() -> (Tool, Fixture) {
        let point = |height, radius, bulge| ProfilePoint { point: MeridianPoint { height, radius }, bulge };
        let points = vec![point(0.0, 4.1, 0.03), point(9.7, 4.8, -0.02), point(20.3, 4.9 / 3.0, 0.0)];
        let fixture = Fixture {
            shank_diameter: Some(12.0),
            gauge_length: 90.0,
            holder: vec![MeridianPoint { height: 50.0, radius: 16.0 }],
        };
        (Tool::new(4, &CutterShape::Meridian { points }, &fixture).unwrap(), fixture)
    }

    #[test]
    fn what_is_written_is_read_back_and_fits_a_job() {
        let (tool, fixture) = waisted();
        let text = write_tool(&tool, &fixture, "blade \"x\"");
        let again = read_tool(&text, "tool.toml").unwrap();
        assert_eq!(again.body_radius(), tool.body_radius());
        for i in 0..=200 {
            let height = tool.flute_length() * f64::from(i) / 200.0;
            let (a, b) = (tool.contact_at(height).unwrap(), again.contact_at(height).unwrap());
            assert!((a.point.radius - b.point.radius).abs() < 1e-12 && (a.normal_axial - b.normal_axial).abs() < 1e-12);
        }
        assert!(text.contains("# Hollow at heights: 9.700 to 20.300 mm"), "{text}");
    }

    #[test]
    fn wishes_and_other_files_are_refused_with_their_place() {
        let (tool, fixture) = waisted();
        let text = write_tool(&tool, &fixture, "x");
        let said = |text: &str| read_tool(text, "t.toml").unwrap_err()[0].to_string();
        assert!(said(&text.replace("regulus-tool", "regulus-job")).contains("t.toml:1:10"));
        assert!(said(&text.replace("kind = \"meridian\"", "kind = \"optimize\"")).contains("not the wish for one"));
        let longer = text.replacen("    [", "    [0.0, 1.0, ", 1);
        assert!(said(&longer).contains("a point of 5 numbers"), "{}", said(&longer));
        assert!(said(&text.replacen(", 0.0],", ", 3.0],", 1)).contains("a bulge of"));
        assert!(said("format = \"regulus-tool\"\nversion = 1").contains("tool"));
    }
}
