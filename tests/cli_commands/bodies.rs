//! Bodies of the machine and fixtures of the job: what runs into them, what comes near, and files that are wrong.

use crate::workshop::{JOB, Workshop};
use serde_json::Value;

/// A program that passes over the vise's jaw in line 8, `height` mm over the part's zero; the jaw ends at 40 mm.
fn passing(height: f64) -> String {
    format!(
        "G21 G90 G61 G54\nT7 M6\nS8000 M3\nG43 H7\nM428\nG0 X-300 Y5 Z60 A0 C0\nG0 Z{height}\nX300\nG0 Z60\nX0\nG1 Z55 F600\n\
         G0 Z60\nM429\nM30\n"
    )
}

/// A jaw as thin as a sheet, far from where any line of the program ends.
const JAW: &str = "\n[[fixtures]]\nname = \"jaw\"\nbox = { min = [123.4, -30, 0], max = [123.6, 30, 40] }\n";

fn shop(fixtures: &str) -> Workshop {
    let shop = Workshop::new();
    shop.write("job.toml", format!("{JOB}{fixtures}"));
    shop
}

/// The verdict on a program by the folder's job.
fn judged(shop: &Workshop, program: &str) -> Value {
    shop.write("p.ngc", program);
    let call = ["verify", "p.ngc", "--machine", "xyzac-trt", "--job", "job.toml", "--json", "v.json"];
    let call = shop.call(&[&call[..], &["--sarif", "v.sarif", "--junit", "v.xml"]].concat());
    assert_eq!((call.status, call.err.as_str()), (1, ""), "{}", call.out);
    serde_json::from_str(&shop.read("v.json")).unwrap()
}

fn of_rule<'a>(record: &'a Value, id: &str) -> Vec<&'a Value> {
    record["findings"].as_array().unwrap().iter().filter(|finding| finding["id"] == id).collect()
}

#[test]
fn a_rapid_into_a_fixture_is_found_between_its_ends_as_deep_as_it_is() {
    let shop = shop(JAW);
    let record = judged(&shop, &passing(38.0));
    let hits = record["collisions"].as_array().unwrap();
    let hit = hits.iter().find(|hit| hit["body_a"] == "flutes").unwrap();
    assert_eq!((hit["line"].as_u64(), hit["body_b"].as_str()), (Some(8), Some("jaw")));
    assert!((hit["depth_mm"].as_f64().unwrap() - 2.0).abs() < 0.004, "{hit}");
    let findings = of_rule(&record, "R705");
    assert!(findings.iter().any(|f| f["line"] == 8 && f["severity"] == "error"), "{findings:?}");
    let reasons = record["reasons"].as_array().unwrap();
    assert!(reasons.iter().any(|r| r.as_str().unwrap().starts_with("line 8: flutes")), "{reasons:?}");
    assert!(shop.read("v.sarif").contains("R705") && shop.read("v.xml").contains("into the jaw"));
}

#[test]
fn a_near_miss_is_told_with_its_distance_and_is_no_error() {
    let shop = shop(JAW);
    let record = judged(&shop, &passing(40.5));
    assert_eq!(record["collisions"].as_array().unwrap().len(), 0);
    let near = &record["near_misses"][0];
    assert_eq!(
        (near["line"].as_u64(), near["body_a"].as_str(), near["body_b"].as_str()),
        (Some(8), Some("flutes"), Some("jaw"))
    );
    assert!((near["distance_mm"].as_f64().unwrap() - 0.5).abs() <= 0.001, "{near}");
    let found = of_rule(&record, "R706");
    assert_eq!((found.len(), found[0]["severity"].as_str(), found[0]["line"].as_u64()), (1, Some("warning"), Some(8)));
    // What is near is said by the body.
    shop.write("job.toml", format!("{JOB}{JAW}near_miss = 0.3\n"));
    assert_eq!(judged(&shop, &passing(40.5))["near_misses"], serde_json::json!([]));
    let explained = shop.call(&["verify", "--explain", "near-miss"]);
    assert!(explained.out.starts_with("R706 near-miss, notice"), "{}", explained.out);
}

/// The machine file with its bodies replaced.
fn machine(shop: &Workshop, bodies: &str) -> String {
    let text = shop.call(&["machine", "show", "xyzac-trt"]).out;
    let (before, after) = (text.find("[[bodies]]").unwrap(), text.find("[control]").unwrap());
    format!("{}{bodies}\n{}", &text[..before], &text[after..])
}

#[test]
fn a_machine_alone_is_followed_with_its_bodies() {
    let shop = Workshop::new();
    let bodies = "[[bodies]]\nname = \"plate\"\nmoves_with = \"table\"\n\
                  box = { place = [-200, -200, -120], size = [400, 400, 20] }\n\
                  [[bodies]]\nname = \"nose\"\nmoves_with = \"spindle\"\ncylinder = { base = [0, 0, 0], radius = 30, length = 90 }\n";
    shop.write("m.toml", machine(&shop, bodies));
    // A tool of 80 mm: its nose stands 80 mm over the tip; the plate's top lies at -100.
    let low = "G21 G90 G61 G54\nT1 M6\nS8000 M3\nG43 H1\nM428\nG0 X0 Y0 Z60 A0 C0\nG1 Z-98 F6000\nG1 Z-101\nG0 Z60\nM429\nM30\n";
    shop.write("p.ngc", low);
    let call =
        |more: &[&str]| shop.call(&[&["verify", "p.ngc", "--machine", "m.toml", "--json", "v.json"], more].concat());
    let judged = call(&["--gauge-length", "80"]);
    assert_eq!(judged.status, 1, "{}{}", judged.out, judged.err);
    assert!(judged.out.contains("error R705 line 8: axis of the tool"), "{}", judged.out);
    let record: Value = serde_json::from_str(&shop.read("v.json")).unwrap();
    assert!((record["collisions"][0]["depth_mm"].as_f64().unwrap() - 1.0).abs() < 0.003, "{record}");
    // Nobody knows where the spindle stands with a tool of unknown length.
    assert_eq!(call(&[]).status, 0);
}

#[test]
fn a_head_that_comes_down_beside_the_tool_hits_the_part() {
    let shop = Workshop::new();
    let nose = "[[bodies]]\nname = \"nose\"\nmoves_with = \"spindle\"\ncylinder = { base = [0, 0, 0], radius = 30, length = 90 }\n";
    shop.write("m.toml", machine(&shop, nose));
    // The part stands 10 mm high at Y0 to Y0.6; the nose, 80 mm over the tip, covers it from a tool that passes it 25 mm
    // away.
    let program = |low: f64| passing(40.0).replace("X300\nG0 Z60\nX0", &format!("X20 Y-25\nZ{low}\nG0 Z60\nX0"));
    let judged = |low: f64| {
        shop.write("p.ngc", program(low));
        shop.call(&["verify", "p.ngc", "--machine", "m.toml", "--job", "job.toml", "--json", "v.json"]);
        serde_json::from_str::<Value>(&shop.read("v.json")).unwrap()
    };
    let hits = judged(-74.0)["collisions"].clone();
    let hit = hits.as_array().unwrap().iter().find(|hit| hit["body_a"] == "nose").unwrap().clone();
    assert_eq!((hit["line"].as_u64(), hit["body_b"].as_str()), (Some(9), Some("part")), "{hits}");
    let near = judged(-68.5)["near_misses"].clone();
    assert_eq!((near[0]["body_a"].as_str(), near[0]["body_b"].as_str()), (Some("nose"), Some("part")), "{near}");
    assert!((near[0]["distance_mm"].as_f64().unwrap() - 1.5).abs() < 0.02, "{near}");
    let clear = judged(-60.0);
    assert_eq!((&clear["near_misses"], &clear["collisions"]), (&serde_json::json!([]), &serde_json::json!([])));
}

/// A closed block as STL, from the origin to a corner.
fn block(size: [f64; 3], faces: usize) -> String {
    let corner = |i: usize| [0, 1, 2].map(|k| if i >> k & 1 == 1 { size[k] } else { 0.0 });
    let all = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut stl = "solid block\n".to_owned();
    for face in all.iter().take(faces) {
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            stl += "facet normal 0 0 0\nouter loop\n";
            for i in [a, b, c] {
                let [x, y, z] = corner(face[i]);
                stl += &format!("vertex {x} {y} {z}\n");
            }
            stl += "endloop\nendfacet\n";
        }
    }
    stl + "endsolid block\n"
}

#[test]
fn fixtures_and_bodies_come_from_files_too() {
    let shop = shop("\n[[fixtures]]\nname = \"block\"\nfile = \"block.stl\"\n");
    shop.write("block.stl", block([20.0, 20.0, 40.0], 6));
    let record = judged(&shop, &passing(39.0));
    let hit = record["collisions"].as_array().unwrap().iter().find(|hit| hit["body_b"] == "block").unwrap();
    assert!((hit["depth_mm"].as_f64().unwrap() - 1.0).abs() < 0.003, "{hit}");
    // The same as a body of the machine, which lies beside its file.
    std::fs::create_dir(shop.path("shop")).unwrap();
    shop.write("shop/block.stl", block([20.0, 20.0, 40.0], 6));
    shop.write(
        "shop/m.toml",
        machine(&shop, "[[bodies]]\nname = \"block\"\nmoves_with = \"C\"\nfile = \"block.stl\"\n"),
    );
    shop.write("job.toml", JOB);
    let call = ["verify", "p.ngc", "--machine", "shop/m.toml", "--job", "job.toml", "--json", "v.json"];
    assert_eq!(shop.call(&call).status, 1);
    let other: Value = serde_json::from_str(&shop.read("v.json")).unwrap();
    assert_eq!(other["collisions"], record["collisions"]);
}

#[test]
fn bodies_that_cannot_be_are_refused_with_their_place() {
    let shop = Workshop::new();
    let body = |rest: &str| format!("[[bodies]]\nname = \"thing\"\n{rest}\n");
    let check = |bodies: &str| {
        shop.write("m.toml", machine(&shop, bodies));
        shop.call(&["machine", "check", "m.toml"])
    };
    shop.write("open.stl", block([9.0, 9.0, 9.0], 5));
    let cube = "box = { min = [0, 0, 0], max = [9, 9, 9] }";
    for (rest, message) in [
        (format!("moves_with = \"B\"\n{cube}"), "thing moves with \"B\", which this machine has not"),
        (cube.to_owned(), "nothing says what thing moves with"),
        ("moves_with = \"Z\"\nbox = { min = [0, 0, 0], max = [9, 0, 9] }".to_owned(), "is empty"),
        (
            "moves_with = \"Z\"\nbox = { min = [0, 0, 0], size = [9, 1, 9] }".to_owned(),
            "two corners, or a place and a size",
        ),
        ("moves_with = \"Z\"\ncylinder = { base = [0, 0, 0], radius = 0, length = 5 }".to_owned(), "a radius of 0 mm"),
        (
            "moves_with = \"Z\"\ncylinder = { base = [0, 0, 0], axis = [0, 0, 0], radius = 3, length = 5 }".to_owned(),
            "has no length",
        ),
        ("moves_with = \"Z\"".to_owned(), "thing is not one of box, cylinder and file"),
        (format!("moves_with = \"Z\"\n{cube}\nnear_miss = -1"), "-1 mm is no distance"),
        ("moves_with = \"Z\"\nfile = \"none.stl\"".to_owned(), "none.stl cannot be read"),
        (format!("moves_with = \"Z\"\n{cube}\ncolour = 1"), "colour"),
        (
            format!("moves_with = \"Z\"\n{cube}\n\n{}", body(&format!("moves_with = \"Z\"\n{cube}"))),
            "a second body is called",
        ),
    ] {
        check(&body(&rest)).refused(message, "m.toml:");
    }
    check(&body("moves_with = \"Z\"\nfile = \"open.stl\"")).refused("closed body is required", "open.stl");
    let far = "[[bodies]]\nname = \"hall\"\nmoves_with = \"base\"\nbox = { min = [-5000, -5000, -5000], max = [5000, 5000, 5000] }\n\n";
    let call = check(&(far.to_owned() + &body(&format!("moves_with = \"Z\"\n{cube}"))));
    assert_eq!(call.status, 1, "{}{}", call.out, call.err);
    assert!(
        call.out.contains("contradiction: bodies thing (m.toml:") && call.out.contains("overlap wherever"),
        "{}",
        call.out
    );
    // And fixtures.
    for (fixture, message, place) in [
        ("box = { min = [0, 0, 0], max = [1, 1, 0] }", "is empty", "job.toml:31:"),
        ("moves_with = \"C\"\nfile = \"x.stl\"", "a fixture stands on the table", "job.toml:31:"),
        ("file = \"none.stl\"", "none.stl cannot be read", "job.toml:31:"),
    ] {
        shop.write("job.toml", format!("{JOB}\n[[fixtures]]\nname = \"clamp\"\n{fixture}\n"));
        shop.call(&["run", "job.toml"]).refused(message, place);
    }
    assert!(shop.call(&["machine", "schema"]).out.contains("near_miss"));
}
