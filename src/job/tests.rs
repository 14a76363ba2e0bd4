use super::*;
use crate::geometry::Point;

const GOOD: &str = r#"format = "regulus-job"
version = 1
name = "blade"

[part]
file = "blade.json"
tolerance = { overcut = 0.005, undercut = 0.020 }

[tool]
number = 1
kind = "cone"
tip_diameter = 6.0
half_angle_deg = 4.0
flute_length = 40.0
shank_diameter = 12.0
gauge_length = 120.0
holder = [[45.0, 12.0], [60.0, 25.0]]

[strategy]
kind = "multi-strip"
direction = [1.0, 0.0, 0.0]
weights = { accuracy = 1.0, g1 = 0.001, fairness = 1e-6 }

[machine]
file = "xyzac-trt"
work_offset = "G54"

[feed]
cut = 600.0
reference = "mid"
spindle = 8000
"#;

fn complaints(text: &str) -> String {
    let findings = Job::read(text, "job.toml").expect_err("must be refused");
    findings.iter().map(|f| format!("{f}\n")).collect()
}

/// The complaints after one replacement in the good job.
fn after(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "{from} is not in the job");
    complaints(&GOOD.replacen(from, to, 1))
}

/// The good job with another `[tool]` table.
fn with_tool(keys: &str) -> String {
    let (head, rest) = GOOD.split_once("[tool]").unwrap();
    let (_, tail) = rest.split_once("[strategy]").unwrap();
    format!("{head}[tool]\nnumber = 7\ngauge_length = 120.0\n{keys}\n[strategy]{tail}")
}

#[test]
fn good_job_is_read() {
    let job = Job::read(GOOD, "job.toml").unwrap();
    assert_eq!(job.name, "blade");
    assert_eq!(job.part.file, "blade.json");
    assert_eq!((job.part.overcut_tolerance, job.part.undercut_tolerance), (0.005, 0.020));
    assert_eq!(job.tool.given().unwrap().flute_length(), 40.0);
    assert_eq!(job.strategy.kind, StrategyKind::MultiStrip);
    assert_eq!(job.strategy.direction, Some(Vector::x()));
    assert_eq!(job.strategy.fairness, 1.0);
    assert_eq!(job.machine.work_offset, "G54");
    assert_eq!(job.feed, Feed { cut: 600.0, reference: FeedReference::Mid, spindle_rpm: 8000.0 });
    assert_eq!(job.output, Output { linearization: 0.005 * LINEARIZATION_SHARE, program_number: 1 });
    assert!(job.warnings.is_empty(), "{:?}", job.warnings);
}

#[test]
fn the_weight_of_kinks_reaches_the_planner() {
    let read = |g1: &str, kind: &str| {
        Job::read(&GOOD.replacen("g1 = 0.001", g1, 1).replacen("\"multi-strip\"", kind, 1), "job.toml").unwrap()
    };
    let smoothness = |g1: &str| read(g1, "\"multi-strip\"").strategy.smoothness;
    assert!((smoothness("g1 = 0.001") - 1.0).abs() < 1e-12 && (smoothness("g1 = 0.02") - 20.0).abs() < 1e-12);
    assert_eq!((smoothness("g1 = 0"), smoothness("direction = 1.0")), (0.0, 1.0));
    let warned: Vec<_> = read("g1 = 0.001", "\"single-sweep\"").warnings.iter().map(ToString::to_string).collect();
    assert!(matches!(&warned[..], [one] if one.starts_with("warning: a single sweep has no seams")), "{warned:?}");
}

#[test]
fn placement_turns_about_x_then_y_then_z_and_then_shifts() {
    let text = GOOD.replacen(
        "[part]\n",
        "[part]\nplacement = { origin = [1, 2, 3], rotate_deg = [90, 0, 90] }\nflip = true\nunits = \"inch\"\n",
        1,
    );
    let job = Job::read(&text, "job.toml").unwrap();
    let moved = job.part.reading.placement * Point::new(0.0, 1.0, 0.0);
    // About x by 90: (0, 0, 1); about z it stays.
    assert!((moved - Point::new(1.0, 2.0, 4.0)).norm() < 1e-12, "{moved}");
    assert!(job.part.reading.flip);
    assert_eq!(job.part.reading.units, Some(Units::Inches));
}

#[test]
fn every_kind_of_tool_can_be_asked_for() {
    for (keys, kind) in [
        ("kind = \"cylinder\"\ndiameter = 10\nflute_length = 30", "cylinder"),
        ("kind = \"cylinder\"\ndiameter = 10\ncorner_radius = 1\nflute_length = 30", "bull"),
        ("kind = \"ball\"\ndiameter = 10\nflute_length = 30", "ball"),
        ("kind = \"bull\"\ndiameter = 10\ncorner_radius = 2\nflute_length = 30", "bull"),
        ("kind = \"cone\"\ntip_diameter = 5\nhalf_angle_deg = 3\nflute_length = 30", "cone"),
        ("kind = \"cone\"\nspheres = { r1 = 0.3, r2 = 1.0, length = 1.717 }", "cone"),
        ("kind = \"tapered-ball\"\nball_diameter = 4\nhalf_angle_deg = 3\nflute_length = 30", "tapered-ball"),
        ("kind = \"barrel\"\ndiameter = 10\nbarrel_radius = 85\nflute_length = 20", "barrel"),
        ("kind = \"meridian\"\npoints = [[0, 1], [10, 2], [30, 2.5]]", "meridian"),
    ] {
        let job = Job::read(&with_tool(keys), "job.toml").unwrap_or_else(|e| panic!("{keys}: {e:?}"));
        assert_eq!((job.tool.given().unwrap().kind.as_str(), job.tool.number()), (kind, 7), "{keys}");
    }
}

#[test]
fn keys_of_another_kind_of_tool_are_refused_by_name() {
    let said = complaints(&with_tool("kind = \"ball\"\ndiameter = 10\nflute_length = 30\ntip_diameter = 2"));
    assert!(said.contains("a tool of kind \"ball\" has no `tip_diameter`\n  --> job.toml:15:16"), "{said}");
    assert!(said.contains("the sizes of this kind are: diameter, flute_length"), "{said}");
    let said =
        complaints(&with_tool("kind = \"cone\"\nspheres = { r1 = 0.3, r2 = 1.0, length = 1.717 }\ntip_diameter = 2"));
    assert!(said.contains("`tip_diameter` contradicts it"), "{said}");
}

#[test]
fn missing_sizes_of_a_kind_are_all_named_at_once() {
    let said = complaints(&with_tool("kind = \"barrel\""));
    for key in ["diameter", "barrel_radius", "flute_length"] {
        assert!(said.contains(&format!("needs `{key}`\n  --> job.toml:9:1")), "{key}: {said}");
    }
    assert!(complaints(&with_tool("kind = \"meridian\"")).contains("needs `points`"));
}

#[test]
fn impossible_tools_point_to_the_size_to_blame() {
    let said = after("half_angle_deg = 4.0", "half_angle_deg = 4.0\ncorner_radius = 30.0");
    assert!(said.contains("does not fit; this tip takes at most") && said.contains("job.toml:14:17"), "{said}");
    let said = after("gauge_length = 120.0", "gauge_length = 12.0");
    assert!(said.contains("gauge_length: 12 mm is shorter than the flutes") && said.contains(":16:16"), "{said}");
    let said = after("[[45.0, 12.0]", "[[35.0, 12.0]");
    assert!(said.contains("inside the flutes") && said.contains("job.toml:17:10"), "{said}");
}

#[test]
fn triangles_are_curved_where_the_job_says_so() {
    let read = |keys: &str| {
        let text = GOOD.replace("file = \"blade.json\"", &format!("file = \"blade.STL\"\n{keys}"));
        Job::read(&text, "job.toml").unwrap().part.reading.triangles
    };
    assert_eq!(read(""), Triangles::Flat);
    assert_eq!(read("triangles = \"flat\""), Triangles::Flat);
    assert_eq!(read("triangles = \"curved\""), Triangles::Curved { crease: Degrees(30.0).into() });
    assert_eq!(read("triangles = \"curved\"\ncrease_deg = 12"), Triangles::Curved { crease: Degrees(12.0).into() });
    let part = "file = \"blade.json\"";
    // Body and check surfaces may be meshes where the part's own file is none.
    for others in ["body = \"blade.stl\"", "check = [\"floor.json\", \"hub.OBJ\"]"] {
        let text = GOOD.replace(part, &format!("{part}\n{others}\ntriangles = \"curved\""));
        assert!(matches!(Job::read(&text, "job.toml").unwrap().part.reading.triangles, Triangles::Curved { .. }));
    }
    for (keys, words, place) in [
        ("file = \"blade.json\"\ntriangles = \"curved\"", "blade.json holds no triangles", "job.toml:7:13"),
        (
            "file = \"blade.json\"\nbody = \"body.json\"\ntriangles = \"curved\"",
            "none of blade.json, body.json holds triangles",
            "job.toml:8:13",
        ),
        ("file = \"blade.obj\"\ncrease_deg = 20", "flat triangles need no crease_deg", "job.toml:7:14"),
        (
            "file = \"blade.obj\"\ntriangles = \"curved\"\ncrease_deg = 0",
            "crease_deg = 0 is out of range",
            "job.toml:8:14",
        ),
        ("file = \"blade.obj\"\ntriangles = \"round\"", "round", "job.toml:7:"),
    ] {
        let said = after(part, keys);
        assert!(said.contains(words) && said.contains(place), "{said}");
    }
}

#[test]
fn negative_and_absurd_sizes_name_the_limits() {
    for (from, to, key) in [
        ("tip_diameter = 6.0", "tip_diameter = -6.0", "tool.tip_diameter = -6"),
        ("flute_length = 40.0", "flute_length = 4e7", "tool.flute_length = 40000000"),
        ("number = 1", "number = 0", "tool.number = 0"),
        ("overcut = 0.005", "overcut = -0.005", "part.tolerance.overcut = -0.005"),
        ("undercut = 0.020", "undercut = 200", "part.tolerance.undercut = 200"),
        ("cut = 600.0", "cut = 0", "feed.cut = 0"),
        ("spindle = 8000", "spindle = -1", "feed.spindle = -1"),
        ("g1 = 0.001", "g1 = -1", "strategy.weights.g1 = -1"),
        ("kind = \"multi-strip\"", "kind = \"multi-strip\"\nstrips = 0", "strategy.strips = 0"),
        ("work_offset = \"G54\"", "offset = [0, 0, 1e9]", "machine.offset[2] = 1000000000"),
    ] {
        let said = after(from, to);
        assert!(said.contains(&format!("{key} is out of range")), "{to}: {said}");
        assert!(said.contains("help: write a number"), "{to}: {said}");
    }
}

#[test]
fn several_findings_come_together_in_order_of_place() {
    let text = GOOD.replacen("overcut = 0.005", "overcut = -1", 1).replacen("cut = 600.0", "cut = -5", 1);
    let findings = Job::read(&text, "job.toml").unwrap_err();
    let lines: Vec<_> = findings.iter().map(|f| f.place.as_ref().unwrap().line.unwrap()).collect();
    assert_eq!(lines, [7, 29]);
}

#[test]
fn keys_and_kinds_that_do_not_exist_are_refused() {
    assert!(after("flute_length", "flut_length").contains("did you mean `flute_length`?"));
    assert!(after("kind = \"cone\"", "kind = \"cube\"").contains("the values known here: cylinder, ball, bull"));
    assert!(after("kind = \"multi-strip\"", "kind = \"multistrip\"").contains("did you mean `multi-strip`?"));
    assert!(after("name = \"blade\"", "").contains("key `name` is missing"));
    assert!(after("file = \"blade.json\"", "").contains("key `file` is missing"));
    assert!(after("format = \"regulus-job\"", "format = \"job\"").contains("write format = \"regulus-job\""));
    assert!(after("version = 1", "version = 2").contains("write version = 1"));
    assert!(after("version = 1", "version = -1").contains("job.toml:2:11"));
    assert!(after("\"G54\"", "\"G60\"").contains("\"G60\" is not a work offset"));
    assert!(after("direction = [1.0, 0.0, 0.0]", "direction = [0, 0, 0]").contains("gives no direction"));
    assert!(after("file = \"blade.json\"", "sides = [\"a\", \"b\"]").contains("job.toml:6:9"));
    assert!(after("file = \"blade.json\"", "file = \"blade.json\"\nface = \"#12\"").contains("leave `face` out"));
    assert!(after("name = \"blade\"", "name = \"\"").contains("write 1 to 60 characters"));
    assert!(after("cut = 600.0", "cut = nan").contains("nan is not a finite number"));
}

#[test]
fn strategy_keys_reach_the_planner() {
    let more = "kind = \"single-sweep\"\nmethod = \"rulings\"\nstrips = 3\ntip = \"high\"\nspindle = [0, 0, 2]\n\
                climb = false\nengage_from = 1.5\nlead = 4\nstand_off = 3";
    let text = GOOD.replacen("kind = \"multi-strip\"", more, 1).replacen("1e-6", "3e-6, direction = 5.0", 1);
    let strategy = Job::read(&text, "job.toml").unwrap().strategy;
    let wanted = Strategy {
        kind: StrategyKind::SingleSweep,
        method: Method::Rulings,
        direction: Some(Vector::x()),
        direction_weight: 5.0,
        strips: Some(3),
        tip: Some(TipSide::High),
        spindle: Some(Vector::new(0.0, 0.0, 2.0)),
        climb: false,
        fairness: 3.0,
        smoothness: 1.0,
        engage_from: Some(1.5),
        lead: Some(4.0),
        stand_off: Some(3.0),
        reach: None,
        rajain: crate::plan::RajainSettings::default(),
    };
    assert!((strategy.fairness - 3.0).abs() < 1e-12);
    assert_eq!(Strategy { fairness: 3.0, ..strategy }, wanted);
    assert!(after("kind = \"multi-strip\"", "kind = \"multi-strip\"\nlead = -1").contains("strategy.lead = -1"));
}

#[test]
fn a_job_may_overrule_the_machine_file() {
    let more = "work_offset = \"G55\"\noffset = [1, 2, 3.5]\ntcp = false\ndialect = \"fanuc-30i\"";
    let job = Job::read(&GOOD.replacen("work_offset = \"G54\"", more, 1), "job.toml").unwrap();
    let machine = MachineSpec {
        file: "xyzac-trt".to_owned(),
        work_offset: "G55".to_owned(),
        offset: Some([1.0, 2.0, 3.5]),
        tcp: Some(false),
        dialect: Some(Dialect::Fanuc30i),
    };
    assert_eq!(job.machine, machine);
    assert!(after("\"G54\"", "\"G54\"\ndialect = \"fanuc\"").contains("the values known here: linuxcnc, fanuc-30i"));
}

#[test]
fn work_offsets_beyond_the_first_six_are_known() {
    for word in ["G55", "G59.3", "G54.1 P48"] {
        let job = Job::read(&GOOD.replacen("G54", word, 1), "job.toml").unwrap();
        assert_eq!(job.machine.work_offset, word);
    }
    assert!(after("G54", "G54.1 P0").contains("is not a work offset"));
}

proptest::proptest! {
    #[test]
    fn no_text_makes_the_reader_panic(cut in 0usize..GOOD.len(), length in 0usize..12, insert in "[\\PC]{0,6}") {
        let broken: String = GOOD.chars().take(cut).chain(insert.chars()).chain(GOOD.chars().skip(cut + length)).collect();
        for finding in Job::read(&broken, "job.toml").err().unwrap_or_default() {
            proptest::prop_assert!(finding.place.is_some_and(|place| place.line.is_some()), "{}", finding.message);
            proptest::prop_assert!(finding.help.is_some(), "{}", finding.message);
        }
    }
}

const RAJAIN: &str = "kind = \"multi-strip\"\nmethod = \"rajain-2023\"";

#[test]
fn settings_of_rajain_2023_reach_the_planner() {
    let more = "\n[strategy.rajain]\nfree = [\"length\", \"r2\"]\nengagement = [0.5, 1.0]\nstep = 0.4\nsamples = 20\n[machine]";
    let text = GOOD.replacen("kind = \"multi-strip\"", RAJAIN, 1).replacen("[machine]", more, 1);
    let weights = "g1 = 0.0, rigidity = 2.0, proximity = 0.5";
    let job = Job::read(&text.replacen("g1 = 0.001", weights, 1), "job.toml").unwrap();
    let rajain = job.strategy.rajain;
    assert_eq!(job.strategy.method, Method::Rajain2023);
    assert_eq!(rajain.free, crate::plan::Free { length: true, r1: false, r2: true });
    assert_eq!((rajain.engagement, rajain.step, rajain.heights), ((0.5, 1.0), Some(0.4), 20));
    let weights = crate::plan::Weights { rigidity: 2.0, accuracy: 1.0, g1: 0.0, proximity: 0.5, fairness: 1e-6 };
    assert_eq!(rajain.weights, weights);
}

#[test]
fn bad_settings_of_rajain_2023_are_refused() {
    let of = |from: &str, to: &str| {
        let text = GOOD.replacen("kind = \"multi-strip\"", RAJAIN, 1);
        assert!(text.contains(from), "{from}");
        let findings = Job::read(&text.replacen(from, to, 1), "job.toml").unwrap_err();
        assert!(findings.iter().all(|f| f.place.as_ref().is_some_and(|p| p.line.is_some()) && f.help.is_some()));
        findings.iter().map(ToString::to_string).collect::<String>()
    };
    let table = |keys: &str| of("[machine]", &format!("[strategy.rajain]\n{keys}\n[machine]"));
    assert!(of("g1 = 0.001", "g1 = -0.001").contains("strategy.weights.g1 = -0.001 is out of range"));
    assert!(of("fairness = 1e-6", "proximity = -1").contains("strategy.weights.proximity = -1 is out of range"));
    assert!(table("engagement = [0.6, 0.6]").contains("no part of the flank"));
    assert!(table("engagement = [-0.1, 0.6]").contains("strategy.rajain.engagement[0] = -0.1"));
    assert!(table("step = 0").contains("too short"));
    assert!(table("samples = 1").contains("samples = 1 is out of range"));
    assert!(table("free = [\"r3\"]").contains("r3"));
    assert!(table("field = \"f.csv\"").contains("given twice"));
    assert!(of("direction = [1.0, 0.0, 0.0]\n", "").contains("needs the machining direction"));
    assert!(of("method = \"rajain-2023\"", "rajain = { step = 1.0 }").contains("belong to the method"));
    assert!(after("fairness = 1e-6", "rigidity = 1.0").contains("only the method \"rajain-2023\" weighs rigidity"));
}

#[test]
fn a_stock_is_one_of_box_cylinder_and_file() {
    let with = |stock: &str| format!("{GOOD}\n[stock]\n{stock}\n");
    let job = Job::read(&with("box = { min = [0, 0, 0], max = [60, 20, 40] }\ncell = 0.2"), "job.toml").unwrap();
    let stock = job.stock.unwrap();
    assert_eq!((stock.cell, stock.limits.feed), (Some(0.2), None));
    let BlankSpec::Given(blank) = stock.blank else { panic!("a box is given") };
    assert_eq!(blank.bounds().high, Point::new(60.0, 20.0, 40.0));
    let bar = "cylinder = { base = [0, 0, 0], axis = [1, 0, 0], diameter = 20, height = 50 }\nfeed_limit = 900";
    let stock = Job::read(&with(bar), "job.toml").unwrap().stock.unwrap();
    let BlankSpec::Given(blank) = stock.blank else { panic!("a cylinder is given") };
    assert!((blank.bounds().high - Point::new(50.0, 10.0, 10.0)).norm() < 1e-12 && stock.limits.feed == Some(900.0));
    let file = Job::read(&with("file = \"left.stl\""), "job.toml").unwrap().stock.unwrap();
    assert!(matches!(file.blank, BlankSpec::File(name) if name == "left.stl"));
    let said = |stock: &str| complaints(&with(stock));
    assert!(said("cell = 0.1").contains("not one of box, cylinder and file"));
    assert!(said("file = \"a.stl\"\nbox = { min = [0,0,0], max = [1,1,1] }").contains("not one of"));
    assert!(said("box = { min = [0, 0, 0], max = [1, 0, 1] }").contains("is empty"));
    assert!(said("file = \"a.stl\"\ncell = 0.0").contains("stock.cell = 0 is out of range"));
    assert!(said("cylinder = { base = [0,0,0], axis = [0,0,0], diameter = 1, height = 1 }").contains("no direction"));
    assert!(said("file = \"a.stl\"\nlines = 3").contains("lines"));
}
