//! A page on a made-up job: a twisted flank milled in two strips on a machine with A and C.

use super::*;
use crate::geometry::{Degrees, Point, RigidMotion, Vector};
use crate::tool::meridian::at;
use crate::tool::{CutterShape, Fixture, Tool};

const LENGTH: f64 = 70.0;
const HEIGHT: f64 = 36.0;
const STRIPS: u32 = 2;

/// The flank: a wave along x whose lean changes from end to end; its normal points to -y.
fn flank(x: f64, z: f64) -> (Point, Vector) {
    let twist = 0.9 * (x / LENGTH - 0.45);
    let lean = z - HEIGHT / 2.0;
    let point = Point::new(x, 5.0 * (x / 16.0).sin() + twist * lean * 0.5, z);
    let along = Vector::new(1.0, 5.0 / 16.0 * (x / 16.0).cos() + 0.45 * lean / LENGTH, 0.0);
    let up = Vector::new(0.0, twist * 0.5, 1.0);
    (point, along.cross(&up).normalize())
}

/// Hollow in each strip as a straight tool leaves it, with one gouge and a corner that no pass reaches.
fn deviation(x: f64, z: f64) -> Option<f64> {
    if x > 62.0 && z + 0.6 * (x - 62.0) > 34.0 {
        return None;
    }
    let across = (z / HEIGHT * f64::from(STRIPS)).fract() * 2.0 - 1.0;
    let wave = 0.0135 * (x / LENGTH * 5.0).sin() * (0.55 - across * across);
    let gouge = -0.0125 * (-((x - 21.0).powi(2) + (z - 27.0).powi(2)) / 9.0).exp();
    let rest = 0.030 * (-((x - 50.0).powi(2) + 2.0 * (z - 8.0).powi(2)) / 30.0).exp();
    Some(wave + gouge + rest)
}

fn part() -> PartView {
    let (columns, rows) = (140_u32, 72_u32);
    let mut part = PartView { overcut_tolerance: 0.005, undercut_tolerance: 0.020, ..PartView::default() };
    for j in 0..=rows {
        for i in 0..=columns {
            let (x, z) = (LENGTH * f64::from(i) / f64::from(columns), HEIGHT * f64::from(j) / f64::from(rows));
            let (point, normal) = flank(x, z);
            part.mesh.points.push(point);
            part.mesh.normals.push(normal);
            part.deviation.push(deviation(x, z));
            part.strip.push(deviation(x, z).map(|_| (j * STRIPS / (rows + 1)).min(STRIPS - 1)));
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let a = j * (columns + 1) + i;
            let b = a + columns + 1;
            part.mesh.triangles.extend([[a, a + 1, b], [b, a + 1, b + 1]]);
        }
    }
    part
}

/// A plane below the flank that the tool must stay clear of.
fn floor() -> Mesh {
    let corner = |x, y| Point::new(x, y, -5.0);
    Mesh {
        points: vec![corner(-12.0, -24.0), corner(82.0, -24.0), corner(82.0, 14.0), corner(-12.0, 14.0)],
        normals: vec![Vector::z(); 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

fn tool() -> Tool {
    let shape =
        CutterShape::Cone { tip_diameter: 8.0, half_angle: Degrees(3.0), corner_radius: 1.0, flute_length: 24.0 };
    let holder = vec![at(48.0, 11.0), at(58.0, 16.0), at(84.0, 16.0), at(84.0, 25.0)];
    Tool::new(7, &shape, &Fixture { shank_diameter: Some(10.0), gauge_length: 96.0, holder }).unwrap()
}

/// What the planner said of both strips.
fn strips() -> Vec<StripRow> {
    let strip = |kink| StripRow {
        overcut: 0.0125,
        undercut: 0.0301,
        kink,
        length: LENGTH,
        engagement: HEIGHT / f64::from(STRIPS),
        steps: 36,
        curvature_error: 0.0091,
        limited_by: "curvature along the flank".into(),
    };
    vec![strip(Some((2.345, 1.25))), strip(None)]
}

/// Both strips at a steady feed, between them a link clear of the flank.
fn timeline() -> (Timeline, Vec<Ruling>) {
    let (mut timeline, mut rulings) = (Timeline::default(), Vec::new());
    let steps = 120;
    for strip in 0..STRIPS {
        for i in 0..=steps {
            let along = f64::from(i) / f64::from(steps);
            let x = LENGTH * if strip % 2 == 0 { along } else { 1.0 - along };
            let low = f64::from(STRIPS - 1 - strip) * HEIGHT / f64::from(STRIPS);
            let (foot, normal) = flank(x, low);
            let (head, _) = flank(x, low + 18.0);
            let clear = 14.0 * (1.0 - (along * 12.0).min((1.0 - along) * 12.0).min(1.0));
            let tip = foot + normal * (4.3 + clear);
            let axis = (head + normal * (5.2 + clear) - tip).normalize();
            let time = f64::from(strip * (steps + 14) + i) * 0.12;
            let line = (strip * (steps + 3) + i) as usize + 9;
            timeline.samples.push(ToolSample { time, tip, axis, line });
            if i % 4 == 0 && clear == 0.0 {
                rulings.push(Ruling { strip, from: tip, to: tip + axis * 24.0 });
            }
        }
    }
    let samples = &timeline.samples;
    let track = |name: &str, unit: &str, travel: f64, top: f64, value: &dyn Fn(&ToolSample) -> f64| {
        let position: Vec<f64> = samples.iter().map(value).collect();
        let speed = (0..samples.len()).map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(samples.len() - 1));
            (position[b] - position[a]) / (samples[b].time - samples[a].time) * 60.0
        });
        AxisTrack {
            kind: TrackKind::Axis,
            name: name.into(),
            unit: unit.into(),
            speed: speed.collect(),
            position,
            travel: Some((-travel, travel)),
            max_speed: Some(top),
        }
    };
    timeline.axes = vec![
        track("X", "mm", 250.0, 10_000.0, &|s| s.tip.x - 35.0),
        track("Y", "mm", 200.0, 10_000.0, &|s| s.tip.y),
        track("Z", "mm", 150.0, 8_000.0, &|s| s.tip.z - 60.0),
        track("A", "deg", 30.0, 1_200.0, &|s| s.axis.z.acos().to_degrees()),
        track("C", "deg", 7_200.0, 2_400.0, &|s| (s.axis.y * 6.0).atan().to_degrees()),
    ];
    (timeline, rulings)
}

fn sample() -> ReportData {
    let (timeline, rulings) = timeline();
    let mut program = String::from(
        "(twisted flank, T7 cone D10.5, tolerance -0.005 +0.020)\nG21 G90 G94\nG54\nT7 M6\nS8000 M3\nM428\nG0 X-20 Y-30 Z80 A0 C0\nG93\n",
    );
    for s in &timeline.samples {
        while program.lines().count() + 1 < s.line {
            program += "G0 Z60.\n";
        }
        program += &format!(
            "G1 X{:.4} Y{:.4} Z{:.4} A{:.4} C{:.4} F500.\n",
            s.tip.x,
            s.tip.y,
            s.tip.z,
            s.axis.z.acos().to_degrees(),
            (s.axis.y * 6.0).atan().to_degrees()
        );
    }
    program += "M429\nM5\nM30\n";
    let figure = |label: &str, value, decimals, unit: &str, limit: Option<f64>| Figure {
        label: label.into(),
        value,
        decimals,
        unit: unit.into(),
        limit,
        ok: limit.map(|l| value <= l),
    };
    let samples = timeline.samples.len();
    ReportData {
        name: "Twisted flank <A & B>".into(),
        verdict: Verdict {
            pass: false,
            reasons: vec!["Overcut 0.0125 mm is above its tolerance of 0.005 mm, at line 46.".into()],
        },
        facts: [
            ("Part", "twisted-flank.json"),
            ("Tool", "T7 cone 8.0 mm, 3\u{b0}, flute 24"),
            ("Machine", "xyzac-trt"),
            ("Control", "LinuxCNC, TCP on"),
            ("Strategy", "multi-strip, 2 strips"),
            ("Program", "program.nc"),
        ]
        .map(|(l, v)| (l.to_owned(), v.to_owned()))
        .to_vec(),
        input_hash: "9f2c41d07be8a6c35d19".into(),
        part: Some(part()),
        surroundings: vec![floor()],
        bodies: vec![
            BodyView { name: "nose".into(), fixture: false, mesh: floor(), link: Some(0) },
            BodyView { name: "jaw".into(), fixture: true, mesh: floor(), link: None },
        ],
        links: vec![vec![RigidMotion::translation(0.0, 0.0, 40.0); samples]],
        rulings,
        tool: tool_outline(&tool()),
        timeline,
        figures: vec![
            figure("Overcut, largest", 0.0125, 4, "mm", Some(0.005)),
            figure("Undercut, largest", 0.0301, 4, "mm", Some(0.020)),
            figure("Kink between strips", 0.31, 2, "deg", Some(1.0)),
            figure("Block rate, peak", 8.3, 1, "Hz", Some(500.0)),
            figure("Within tolerance", 94.1, 1, "%", None),
            figure("Duration", 30.48, 2, "s", None),
            figure("Cut length", 151.7, 1, "mm", None),
            figure("Blocks", 251.0, 0, "", None),
        ],
        strips: strips(),
        slow: vec![SlowRow {
            lines: (31, 44),
            lost: 0.125,
            feed: 312.4,
            usual_feed: 600.0,
            cause: "C at 100 % of its speed".into(),
        }],
        advice: vec!["more strips, about 3".into()],
        findings: vec![
            Finding {
                line: Some(46),
                point: Some(flank(21.0, 27.0).0),
                code: "R701 overcut".into(),
                error: true,
                text: "Overcut of 0.0125 mm, tolerance 0.005 mm.".into(),
                help: "Correct the block.".into(),
            },
            Finding {
                line: Some(220),
                point: Some(flank(50.0, 8.0).0),
                text: "Undercut of 0.0301 mm, tolerance 0.020 mm.".into(),
                ..Finding::default()
            },
            Finding { text: "1.1 % of the part is not reached by any pass.".into(), ..Finding::default() },
        ],
        program,
    }
}

#[test]
fn the_page_needs_nothing_from_outside() {
    let page = html(&sample()).unwrap();
    for word in ["http://", "https://", "src=", "href=", "@import", "url(", "import ", "fetch("] {
        assert!(!page.contains(word), "{word}");
    }
    assert!(page.contains("default-src 'none'"));
    assert!(!page.contains("{{"), "a placeholder is left");
}

#[test]
fn the_same_data_give_the_same_bytes() {
    assert_eq!(html(&sample()), html(&sample()));
}

#[test]
fn names_from_files_stay_text() {
    let bad = "</script><img onerror=\"x()\"> {{data}} & 'q'";
    let mut data = ReportData { name: bad.into(), program: bad.into(), input_hash: bad.into(), ..sample() };
    data.facts.push((bad.into(), bad.into()));
    data.verdict.reasons.push(bad.into());
    data.findings[0].text = bad.into();
    data.findings[0].code = bad.into();
    data.findings[0].help = bad.into();
    data.figures[0].label = bad.into();
    data.figures[0].unit = bad.into();
    data.timeline.axes[0].name = bad.into();
    data.timeline.axes[0].unit = bad.into();
    let page = html(&data).unwrap();
    assert!(!page.contains("<img"));
    assert_eq!(page.matches("</script>").count(), 2);
    assert!(page.contains("&lt;img onerror=&quot;x()&quot;&gt; {{data}} &amp; &#39;q&#39;"));
}

#[test]
fn what_is_not_finite_or_does_not_fit_is_refused_by_name() {
    let refusal = |spoil: &dyn Fn(&mut ReportData)| {
        let mut data = sample();
        spoil(&mut data);
        html(&data).unwrap_err()
    };
    let not_finite = |what, index| ReportError::NotFinite { what, index };
    assert_eq!(refusal(&|d| d.figures[2].value = f64::NAN), not_finite("figure", 4));
    assert_eq!(refusal(&|d| d.part.as_mut().unwrap().deviation[5] = Some(1e300)), not_finite("deviation", 5));
    assert_eq!(refusal(&|d| d.timeline.axes[1].speed[3] = f64::INFINITY), not_finite("axis speed", 3));
    assert_eq!(refusal(&|d| d.timeline.samples[7].time = -1.0), ReportError::TimeOrder { index: 7 });
    let count = refusal(&|d| d.part.as_mut().unwrap().mesh.triangles[0][1] = 99_999_999);
    assert!(matches!(count, ReportError::Count { what: "corner of a triangle", found: 99_999_999, .. }));
    assert!(matches!(refusal(&|d| d.timeline.axes[0].position.truncate(3)), ReportError::Count { .. }));
}

#[test]
fn a_page_without_part_motion_or_figures_is_still_a_page() {
    let page = html(&ReportData { name: "empty".into(), ..ReportData::default() }).unwrap();
    assert!(page.contains("Nothing found.") && !page.contains("NaN") && !page.contains("inf"));
}

#[test]
fn bodies_have_their_switches_where_there_are_any() {
    let page = html(&sample()).unwrap();
    assert!(page.contains("\"name\":\"nose\"") && page.contains("<label><input type=\"checkbox\" id=\"machine\""));
    let mut data = sample();
    data.bodies.remove(0);
    let page = html(&data).unwrap();
    assert!(page.contains("<label hidden><input type=\"checkbox\" id=\"machine\""));
    assert!(page.contains("<label><input type=\"checkbox\" id=\"fixtures\""));
    data.bodies[0].link = Some(1);
    let refused = html(&data).unwrap_err();
    assert!(matches!(refused, ReportError::Count { what: "link of a body", found: 1, wanted: 1 }), "{refused}");
    data.links[0].pop();
    let refused = html(&data).unwrap_err();
    assert!(matches!(refused, ReportError::Count { what: "places of a link", .. }), "{refused}");
}

#[test]
fn outline_follows_the_tool_from_the_tip_to_the_gauge_line() {
    let tool = tool();
    let outline = tool_outline(&tool);
    let sections: Vec<_> = outline.iter().map(|s| s.section).collect();
    use crate::tool::Section::{Flute, Holder, Shank};
    assert_eq!(sections, [Flute, Shank, Holder]);
    assert_eq!(outline[0].outline[0], [0.0, 0.0]);
    assert_eq!(outline[0].outline.last().unwrap()[0], tool.flute_length());
    assert_eq!(outline[2].outline.last().unwrap()[0], tool.gauge_length());
    // The corner's arc keeps its distance from its centre.
    let corner = tool.flutes().iter().find_map(|e| match e {
        crate::tool::Element::Arc { centre, radius, .. } => Some((*centre, *radius)),
        crate::tool::Element::Line { .. } => None,
    });
    let (centre, radius) = corner.unwrap();
    let on_arc = outline[0]
        .outline
        .iter()
        .filter(|[h, r]| ((h - centre.height).hypot(r - centre.radius) - radius).abs() < 1e-12);
    assert!(on_arc.count() >= 10);
}

#[test]
fn findings_stand_with_code_remedy_and_a_button_to_their_block() {
    let page = html(&sample()).unwrap();
    let wanted = "<button type=\"button\" data-line=\"46\">46</button><b class=\"error\">R701 overcut</b> Overcut of 0.0125 mm, \
                  tolerance 0.005 mm.<small>Correct the block.</small>";
    assert!(page.contains(wanted));
}

#[test]
fn strips_as_planned_are_listed_with_what_limits_them() {
    let page = html(&sample()).unwrap();
    assert!(page.contains("Strips as planned"));
    assert!(page.contains("<td class=\"num\">2.345</td><td class=\"num\">1.250</td>"));
    assert_eq!(page.matches("<td>curvature along the flank</td>").count(), 2);
    assert!(page.contains("<li>more strips, about 3</li>"));
    assert!(!html(&ReportData { strips: Vec::new(), ..sample() }).unwrap().contains("Strips as planned"));
}

#[test]
fn slow_stretches_are_listed_with_their_lines_and_cause() {
    let page = html(&sample()).unwrap();
    assert!(page.contains("Where feed is lost") && page.contains("data-line=\"44\""));
    assert!(page.contains("<td class=\"num\">312</td><td class=\"num\">600</td><td>C at 100 % of its speed</td>"));
    assert!(!html(&ReportData { slow: Vec::new(), ..sample() }).unwrap().contains("Where feed is lost"));
    let bad = SlowRow { lost: f64::NAN, ..SlowRow::default() };
    assert!(html(&ReportData { slow: vec![bad], ..sample() }).is_err());
}
