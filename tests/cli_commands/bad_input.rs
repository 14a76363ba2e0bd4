//! Bad input: status 2, a message with place and remedy, and nothing written.

use crate::workshop::{JOB, Workshop, patch};

/// Calls `run` on the folder's job, which must be refused without a trace.
fn run_refused(shop: &Workshop, message: &str, place: &str) {
    let before = shop.files();
    shop.call(&["run", "job.toml", "--out", "made"]).refused(message, place);
    assert_eq!(shop.files(), before);
}

#[test]
fn files_that_are_missing() {
    let shop = Workshop::new();
    shop.call(&["run", "no.toml"]).refused("no.toml cannot be read", "no.toml");
    shop.call(&["run", "."]).refused(". is a folder, not a file", "");
    shop.job_with("patch.json", "no.json");
    run_refused(&shop, "no.json cannot be read", "job.toml:6:8");
    run_refused(&shop, "no.json", "relative names start at the folder of the job file");
    shop.job_with("file = \"patch.json\"", "file = \"patch.json\"\ncheck = [\"patch.json\", \"hub.stl\"]");
    run_refused(&shop, "hub.stl cannot be read", "job.toml:7:24");
    shop.job_with("\"xyzac-trt\"", "\"mine.toml\"");
    run_refused(&shop, "mine.toml cannot be read", "job.toml:21:8");
    shop.job_with("\"xyzac-trt\"", "\"xyzac-trr\"");
    run_refused(&shop, "no machine is called \"xyzac-trr\"", "did you mean xyzac-trt?");
    shop.write("job.toml", JOB);
    shop.call(&["verify", "no.ngc", "--machine", "xyzac-trt", "--job", "job.toml"])
        .refused("no.ngc cannot be read", "");
    shop.call(&["post", "no.cl", "--machine", "xyzac-trt", "--out", "p.ngc"]).refused("no.cl cannot be read", "");
    shop.call(&["inspect", "no.ngc"]).refused("no.ngc cannot be read", "");
}

#[test]
fn several_missing_files_are_named_at_once() {
    let shop = Workshop::new();
    shop.write("job.toml", JOB.replace("patch.json", "no.json").replace("xyzac-trt", "no.toml"));
    let call = shop.call(&["run", "job.toml"]);
    call.refused("no.json cannot be read", "job.toml:6:8");
    call.refused("no.toml cannot be read", "job.toml:21:8");
}

/// A flat plate, 20 by 10 mm, and the block under it as ASCII STL.
fn plate_on_block() -> (String, String) {
    let plate = serde_json::json!({
        "format": "regulus-bspline", "version": 1, "units": "mm", "degree": [1, 1],
        "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1], "flip": false,
        "control": [[[0, 0, 0], [0, 10, 0]], [[20, 0, 0], [20, 10, 0]]],
    });
    let corner = |i: usize| [20 * (i & 1), 10 * (i >> 1 & 1), i >> 2 & 1];
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut stl = "solid block\n".to_owned();
    for face in faces {
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            stl += "facet normal 0 0 0\nouter loop\n";
            for i in [a, b, c] {
                let [x, y, z] = corner(face[i]);
                stl += &format!("vertex {x} {y} {}\n", if z == 1 { 0 } else { -5 });
            }
            stl += "endloop\nendfacet\n";
        }
    }
    (plate.to_string(), stl + "endsolid block\n")
}

#[test]
fn normals_into_the_material_that_a_body_gives_away() {
    let shop = Workshop::new();
    let (plate, block) = plate_on_block();
    shop.write("patch.json", plate);
    shop.write("block.stl", block);
    shop.job_with("file = \"patch.json\"", "file = \"patch.json\"\nflip = true\ncheck = [\"block.stl\"]");
    run_refused(&shop, "point into the material", "job.toml:6:8");
    run_refused(&shop, "flip = true under [part]", "");
}

#[test]
fn a_body_that_is_open_inside_out_or_no_mesh() {
    let shop = Workshop::new();
    let (plate, block) = plate_on_block();
    shop.write("patch.json", plate);
    shop.job_with("file = \"patch.json\"", "file = \"patch.json\"\nbody = \"block.stl\"");
    let facet = block.find("facet").expect("facets");
    let second = facet + block[facet + 1..].find("facet normal").expect("another facet") + 1;
    shop.write("block.stl", block.replacen(&block[facet..second], "", 1));
    run_refused(&shop, "the mesh is open where a closed body is required: it has 1 boundary loop", "block.stl");
    run_refused(&shop, "close its holes", "");
    let turned: Vec<&str> = block.split("outer loop\n").collect();
    let turn = |corners: &str| {
        let lines: Vec<&str> = corners.lines().collect();
        [&[lines[1], lines[0]], &lines[2..]].concat().join("\n") + "\n"
    };
    let inside_out =
        turned[0].to_owned() + &turned[1..].iter().map(|t| format!("outer loop\n{}", turn(t))).collect::<String>();
    shop.write("block.stl", inside_out);
    run_refused(&shop, "point inward", "block.stl");
    shop.job_with("file = \"patch.json\"", "file = \"patch.json\"\nbody = \"patch.json\"");
    run_refused(&shop, "a spline patch is given where a closed body is required", "patch.json");
}

#[test]
fn wrong_keys_types_and_sizes_in_a_job() {
    let shop = Workshop::new();
    for (from, to, message, place) in [
        ("flute_length = 20.0", "flut_length = 20.0", "unknown key `flut_length`", "job.toml:13:1"),
        ("diameter = 8.0", "diameter = \"8\"", "wrong type: string \"8\"", "job.toml:12:12"),
        ("diameter = 8.0", "diameter = -8.0", "tool.diameter = -8 is out of range", "job.toml:12:12"),
        ("diameter = 8.0", "diameter = 8e9", "tool.diameter = 8000000000 is out of range", "job.toml:12:12"),
        ("diameter = 8.0", "diameter = nan", "nan is not a finite number", "job.toml:12:12"),
        ("cut = 600.0", "cut = inf", "inf is not a finite number", "job.toml:25:7"),
        ("overcut = 0.01", "overcut = -0.01", "part.tolerance.overcut = -0.01 is out of range", "job.toml:7:25"),
        ("gauge_length = 80.0", "gauge_length = 8.0", "8 mm is shorter than the flutes", "job.toml:14:16"),
        ("kind = \"single-sweep\"", "kind = \"cavity\"", "unknown value \"cavity\"", "job.toml:17:8"),
        ("\"G54\"", "\"G57\"", "has no work offset G57", "job.toml:22:15"),
        ("[feed]", "[feed", "", "job.toml:2"),
        ("version = 1", "version = 2", "version 2 of the regulus-job format", "job.toml:2:11"),
    ] {
        shop.job_with(from, to);
        run_refused(&shop, message, place);
    }
}

#[test]
fn text_that_is_not_utf8() {
    let shop = Workshop::new();
    shop.write("job.toml", b"format = \"regulus-job\"\nname = \"\xff\"\n");
    run_refused(&shop, "no text in UTF-8", "job.toml:2:9");
}

#[test]
fn wrong_keys_and_sizes_in_a_machine() {
    let shop = Workshop::new();
    let machine = shop.call(&["machine", "show", "xyzac-trt"]).out;
    shop.job_with("\"xyzac-trt\"", "\"mine.toml\"");
    for (from, to, message) in [
        ("speed = 30000", "sped = 30000", "unknown key `sped`"),
        ("speed = 30000", "speed = -1", "-1 mm/min is not a positive rate"),
        ("speed = 30000", "speed = nan", "nan is not a finite number"),
        ("limits = [-1000, 1000]", "limits = [1000, -1000]", "is not below"),
        ("direction = [1, 0, 0]", "direction = [0, 0, 0]", "has no length"),
        ("direction = [1, 0, 0]", "direction = [0, 0, 1]", "the two rotary axes are parallel"),
        ("letter = \"C\"", "letter = \"A\"", "axis A is named twice"),
        ("limits = [-360, 360]", "limits = [30, -30]", "is not below"),
        ("limits = [-360, 360]", "limits = [-9e9, 9e9]", "limits"),
        ("carried_by = \"A\"", "carried_by = \"B\"", "which is not the other rotary axis"),
        ("tcp_at_start = true", "cycle = 5", "a cycle of 5 s"),
        (
            "tcp_at_start = true",
            "[control.templates]\nend = \"\"\"M5\nT{{ tool_numbr }}\"\"\"",
            "template field tool_numbr is not known",
        ),
    ] {
        assert!(machine.contains(from), "{from}");
        shop.write("mine.toml", machine.replacen(from, to, 1));
        run_refused(&shop, message, "mine.toml:");
        shop.call(&["machine", "check", "mine.toml"]).refused(message, "mine.toml:");
    }
}

#[test]
fn parts_that_are_no_surface() {
    let shop = Workshop::new();
    let good = patch(false);
    for (name, content, message) in [
        ("patch.json", "{".to_owned(), "cannot be read as regulus-bspline"),
        ("patch.json", good.replace("[3,3]", "[0,3]"), "degree 0 is outside"),
        ("patch.json", good.replacen("[0,0,0,0,1,1,1,1]", "[0,0,0,0,1,1,1]", 1), "7 knots for degree 3"),
        ("patch.json", good.replacen("40.0", "1e999", 1), "number out of range"),
        ("part.stl", String::new(), "too short for an STL file"),
        ("part.stl", "solid x\nendsolid x\n".to_owned(), "the mesh has no triangles"),
        ("part.obj", triangles("f 1 2 6\n"), "has no area"),
        ("part.obj", triangles("f 1 2 3\nf 1 2 4\nf 1 2 5\n"), "3 triangles share the edge"),
        ("part.csv", "i,j,x,y,z\n0,0,0,0,0\n".to_owned(), "the grid has 1 x 1 points"),
        ("part.step", "ISO-10303-21;\n".to_owned(), "\".step\" is not a kind of part file"),
    ] {
        shop.write(name, &content);
        shop.job_with("patch.json", name);
        run_refused(&shop, message, name);
    }
}

/// An OBJ file with six vertices and some faces.
fn triangles(faces: &str) -> String {
    format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 2 0 0\n{faces}")
}

#[test]
fn tools_too_short_for_the_part() {
    let shop = Workshop::new();
    shop.job_with("flute_length = 20.0", "flute_length = 6.0");
    run_refused(&shop, "the tool is too short by", "job.toml");
}

#[test]
fn tools_too_big_for_a_hollow() {
    let shop = Workshop::new();
    // A hollow quarter cylinder of radius 3 mm for a tool of radius 4 mm.
    shop.write("job.toml", JOB.replace("direction = [1.0, 0.0, 0.0]", "direction = [-1.0, 1.0, 0.0]"));
    let arc = [[3.0, 0.0], [3.0, 1.657], [1.657, 3.0], [0.0, 3.0]];
    let control = arc.map(|[x, y]| [[x, y, 0.0], [x, y, 10.0]]);
    let hollow = serde_json::json!({
        "format": "regulus-bspline", "version": 1, "units": "mm", "degree": [3, 1],
        "knots_u": [0, 0, 0, 0, 1, 1, 1, 1], "knots_v": [0, 0, 1, 1], "flip": true, "control": control,
    });
    shop.write("patch.json", hollow.to_string());
    run_refused(&shop, "the tool is too big for the part: near (", "hollow with radius 2.9");
}

#[test]
fn poses_out_of_reach() {
    let shop = Workshop::new();
    shop.job_with("work_offset = \"G54\"", "work_offset = \"G54\"\noffset = [5000, 0, 0]");
    run_refused(&shop, "axis X would have to stand at", "beyond its limit -1000");
}

/// A tool path of one cut through poses.
fn cut(poses: &str) -> String {
    let tool = r#"{"number":1,"description":"t","gauge_length":100.0,"flute_length":40.0}"#;
    let rest = r#""cut_feed":600.0,"feed_reference":"mid","spindle_rpm":8000.0,"linearization":0.001"#;
    let head = format!(r#"{{"format":"regulus-cl","version":1,"name":"t","tool":{tool},{rest}"#);
    let tolerance = r#""tolerance":{"overcut":0.01,"undercut":0.02}"#;
    format!(r#"{head},{tolerance},"passes":[{{"kind":"cut","strip":0,"poses":[{poses}]}}]}}"#)
}

#[test]
fn paths_that_a_machine_cannot_follow() {
    let shop = Workshop::new();
    let post = |machine: &str| shop.call(&["post", "path.cl", "--machine", machine, "--out", "p.nc"]);
    shop.write("path.cl", cut("[0,0,10,0,0,1],[10,0,10,0.6,0,0.8]"));
    post("four-axis-a").refused("for which the machine has no axis", "mount the part tilted");
    // Five turns of the axis, on a C axis that has 380 degrees and a Z axis with no room above.
    let spiral = (0..=100).map(|i| {
        let (sin, cos) = (f64::from(i) * 0.314).sin_cos();
        format!("[{},{},{},{},{},0.8]", 60.0 * cos, 60.0 * sin, 20.0, 0.6 * cos, 0.6 * sin)
    });
    shop.write("path.cl", cut(&spiral.collect::<Vec<_>>().join(",")));
    let huron = shop.call(&["machine", "show", "huron-kx100"]).out;
    shop.write("low.toml", huron.replacen("[-1000, 0]", "[-1000, -840]", 1));
    post("low.toml").refused("no room to leave the part, turn back and come again: axis Z", "beyond its limit -840");
    // With room it is left and turned back as often as it takes.
    assert_eq!(post("huron-kx100").status, 0);
    assert!(post("huron-kx100").out.contains("rewinds"));
}

#[test]
fn programs_with_unknown_words_get_no_verdict_unless_told() {
    let shop = Workshop::new();
    assert_eq!(shop.call(&["run", "job.toml", "--out", "all"]).status, 0);
    let odd = shop.read("all/program.ngc").replacen("G61\n", "G61\nG777\n", 1);
    shop.write("odd.ngc", &odd);
    let line = odd.lines().position(|l| l == "G777").unwrap() + 1;
    let before = shop.files();
    let verify = ["verify", "odd.ngc", "--machine", "xyzac-trt", "--job", "job.toml", "--json", "v.json"];
    let call = shop.call(&verify);
    call.refused("no verdict", &format!("odd.ngc:{line}:1\n{line:>5} | G777\n      | ^"));
    assert_eq!(shop.files(), before);
    let call = shop.call(&[&verify[..], &["--despite-unknown"]].concat());
    assert_eq!(call.status, 0, "{}{}", call.out, call.err);
    assert!(shop.path("v.json").exists());
}

#[test]
fn tool_paths_that_cannot_be_posted() {
    let shop = Workshop::new();
    shop.write("bad.cl", "{\"format\":\"regulus-cl\"}");
    let before = shop.files();
    let post = ["post", "bad.cl", "--machine", "xyzac-trt", "--out", "p.ngc"];
    shop.call(&post).refused("not a tool path: missing field", "bad.cl:1:");
    assert_eq!(shop.call(&["plan", "job.toml", "--out", "bad.cl"]).status, 0);
    shop.call(&[&post[..], &["--work-offset", "G59"]].concat()).refused("has no work offset \"G59\"", "");
    assert_eq!(shop.files(), before);
}

#[test]
fn outputs_that_cannot_be_written_leave_nothing_behind() {
    let shop = Workshop::new();
    shop.write("made", "a file where the folder should be");
    run_refused(&shop, "cannot be written", "");
    std::fs::create_dir_all(shop.path("other/verify.json")).unwrap();
    let before = shop.files();
    shop.call(&["run", "job.toml", "--out", "other"]).refused("verify.json cannot be written", "");
    assert_eq!(shop.files(), before);
}

#[test]
fn wrong_arguments() {
    let shop = Workshop::new();
    for arguments in [
        &["run"][..],
        &["nonsense"],
        &["run", "job.toml", "--threads", "0"],
        &["run", "job.toml", "--nonsense"],
        &["plan", "job.toml"],
        &[],
    ] {
        let call = shop.call(arguments);
        assert_eq!(call.status, 2, "{arguments:?}");
        assert!(call.err.contains("Usage") || call.err.contains("--help"), "{arguments:?}: {}", call.err);
    }
    let call = shop.call(&["inspect", "job.toml", "--machine", "xyzac-trt", "--gauge-length", "nan"]);
    call.refused("tool length NaN mm is not a length", "");
}
