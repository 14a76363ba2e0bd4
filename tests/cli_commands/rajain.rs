//! The method of Rajain 2023 and the explanation of plans, as users meet them.

use crate::workshop::{JOB, Workshop};
use serde_json::Value;

/// The job's cylinder is too long for the patch in one strip of this method: half of its flank makes two.
const STRATEGY: &str = "kind = \"multi-strip\"\nmethod = \"rajain-2023\"";
const TABLE: &str = "[strategy.rajain]\nengagement = [0.2, 0.6]\nstep = 1.0\n\n[machine]";

fn rajain_job() -> String {
    JOB.replacen("kind = \"single-sweep\"", STRATEGY, 1).replacen("[machine]", TABLE, 1)
}

fn json(shop: &Workshop, name: &str) -> Value {
    serde_json::from_str(&shop.read(name)).unwrap()
}

/// Directions along x at points of the patch, with one line replaced.
fn field(line: usize, by: &str) -> String {
    let mut lines = vec!["x,y,z,dx,dy,dz".to_owned()];
    for i in 0..=8 {
        for j in 0..=2 {
            let (x, h) = (5.0 * f64::from(i), 5.0 * f64::from(j));
            let (sin, cos) = (3f64.to_radians() * f64::from(i) / 8.0).sin_cos();
            lines.push(format!("{x},{:.6},{:.6},1,0,0", h * sin, h * cos));
        }
    }
    lines[line] = by.to_owned();
    lines.join("\n") + "\n"
}

#[test]
fn the_method_runs_the_whole_way_to_a_verdict() {
    let shop = Workshop::new();
    shop.write("job.toml", rajain_job());
    let call = shop.call(&["run", "job.toml"]);
    assert!(matches!(call.status, 0 | 1), "{}{}", call.out, call.err);
    assert!(call.out.contains("distance error (R19)"), "{}", call.out);
    let (plan, verified) = (json(&shop, "out/plan.json"), json(&shop, "out/verify.json"));
    assert_eq!((&plan["format"], &plan["version"]), (&"regulus-plan".into(), &1.into()));
    assert_eq!(plan["method"], "rajain-2023");
    assert_eq!(plan["strips"].as_array().unwrap().len(), 2);
    assert_eq!(verified["format"], "regulus-verify");
    // What is verified from the text is what was planned, but for blocks and rounding.
    let planned = plan["strips"].as_array().unwrap().iter().map(|s| s["overcut_mm"].as_f64().unwrap());
    let (planned, overcut) = (planned.fold(0.0, f64::max), verified["deviation"]["overcut_max_mm"].as_f64().unwrap());
    assert!(overcut < planned + 0.0015, "{overcut} {planned}");
    let lengths = &plan["rajain_2023"]["lengths_mm"];
    assert!(lengths[1].as_f64().unwrap() - lengths[0].as_f64().unwrap() < 0.01, "{lengths}");
    assert!(shop.read("out/report.html").contains("Strips as planned"));
}

#[test]
fn what_is_found_of_the_tool_is_what_is_judged() {
    let shop = Workshop::new();
    shop.write("job.toml", rajain_job().replacen("step = 1.0", "step = 1.0\nfree = [\"length\", \"r1\"]", 1));
    let call = shop.call(&["run", "job.toml"]);
    assert!(matches!(call.status, 0 | 1), "{}{}", call.out, call.err);
    let plan = json(&shop, "out/plan.json");
    let found = &plan["found_tool"];
    assert!(found["length"].as_f64().unwrap() > 1.0 && found["r2"].as_f64().unwrap() > 1.0, "{found}");
    assert!(call.out.contains("found tool"), "{}", call.out);
}

#[test]
fn directions_may_come_from_a_file_and_count_in_the_hash() {
    let shop = Workshop::new();
    let with_field = rajain_job().replacen("direction = [1.0, 0.0, 0.0]\n", "", 1).replacen(
        "step = 1.0",
        "step = 1.0\nfield = \"directions.csv\"",
        1,
    );
    shop.write("job.toml", with_field);
    shop.call(&["plan", "job.toml", "--out", "p.cl"]).refused("directions.csv cannot be read", "job.toml:");
    shop.write("directions.csv", field(0, "x,y,z,dx,dy,dz"));
    let call = shop.call(&["plan", "job.toml", "--out", "p.cl", "--json", "p.json"]);
    assert!(matches!(call.status, 0 | 1), "{}{}", call.out, call.err);
    assert_eq!(json(&shop, "p.json")["strips"].as_array().unwrap().len(), 2);
    let before = shop.files();
    for (by, message) in [
        ("5,0,5,0,0,0", "the direction has no length"),
        ("5,9,5,1,0,0", "mm off the part: the field does not match it"),
        ("5,0,5,0,1,0", "stands on the surface"),
        ("5,0,5,1,0", "5 values where 6 are needed"),
    ] {
        shop.write("directions.csv", field(5, by));
        shop.call(&["plan", "job.toml", "--out", "q.cl"]).refused(message, "directions.csv:6:1");
    }
    let half: String = field(0, "x").lines().take(10).map(|l| format!("{l}\n")).collect();
    shop.write("directions.csv", half);
    shop.call(&["plan", "job.toml", "--out", "q.cl"]).refused("the field does not match it", "directions.csv");
    assert_eq!(shop.files(), before);
}

#[test]
fn bad_weights_and_directions_are_refused_with_their_place() {
    let shop = Workshop::new();
    let with = |from: &str, to: &str| {
        let job = rajain_job();
        assert!(job.contains(from), "{from}");
        shop.write("job.toml", job.replacen(from, to, 1));
        shop.call(&["plan", "job.toml", "--out", "p.cl"])
    };
    let direction = "direction = [1.0, 0.0, 0.0]";
    let negative = format!("{direction}\nweights = {{ g1 = -0.5 }}");
    with(direction, &negative).refused("strategy.weights.g1 = -0.5 is out of range", "job.toml:20:18");
    with(direction, "").refused("needs the machining direction", "job.toml:18:10");
    with(direction, "direction = [0.0, 0.0, 0.0]").refused("gives no direction", "job.toml:19:13");
    with(direction, "direction = [0.0, 1.0, 0.0]").refused("stands on the surface near (", "job.toml");
    with("rajain-2023", "regulus").refused("belong to the method \"rajain-2023\"", "job.toml:");
    with("engagement = [0.2, 0.6]", "engagement = [0.6, 0.2]").refused("no part of the flank", "job.toml:");
}

#[test]
fn a_plan_that_misses_its_tolerance_is_no_success() {
    let shop = Workshop::new();
    shop.write(
        "job.toml",
        rajain_job().replacen("overcut = 0.01, undercut = 0.02", "overcut = 0.0, undercut = 0.0", 1),
    );
    let call = shop.call(&["plan", "job.toml", "--out", "p.cl", "--json", "p.json"]);
    assert_eq!(call.status, 1, "{}{}", call.out, call.err);
    assert!(call.out.contains("misses the tolerance: strip ") && call.out.contains("would help: "), "{}", call.out);
    let plan = json(&shop, "p.json");
    assert_eq!(plan["within_tolerance"], false);
    assert!(plan["reasons"][0].as_str().unwrap().contains("limited by"), "{plan}");
    for key in ["overcut_mm", "undercut_mm", "outside_mm", "length_mm", "engagement_mm", "steps", "curvature_error_mm"]
    {
        assert!(plan["strips"][0][key].is_number(), "{key}");
    }
    assert!(plan["strips"][0]["seam"]["kink_max_deg"].is_number() && plan["strips"][1]["seam"].is_null(), "{plan}");
    // The path is written all the same: it is what the method found.
    assert!(shop.read("p.cl").starts_with("{\"format\":\"regulus-cl\""));
}
