//! Parts, directions and weights that no plan can be made of: status 2 with the place, and nothing written. Plans that
//! miss their tolerance: status 1 with the reason and what would help.

use crate::workshop::Workshop;
use serde_json::{Value, json};

/// Every way to plan.
const METHODS: [&str; 3] = ["regulus", "rulings", "rajain-2023"];

/// A bicubic Bezier patch through control points given as a function of row and column, 0..=3 each.
fn bezier(control: impl Fn(f64, f64) -> [f64; 3]) -> String {
    let row = |i: u32| -> Vec<[f64; 3]> { (0..4).map(|j| control(f64::from(i), f64::from(j))).collect() };
    let control: Vec<_> = (0..4).map(row).collect();
    json!({
        "format": "regulus-bspline", "version": 1, "units": "mm", "degree": [3, 3],
        "knots_u": [0, 0, 0, 0, 1, 1, 1, 1], "knots_v": [0, 0, 0, 0, 1, 1, 1, 1], "flip": false, "control": control,
    })
    .to_string()
}

/// The job's strategy for a method, its tool kept.
fn plan_by(shop: &Workshop, method: &str, direction: &str) {
    shop.job_with(
        "kind = \"single-sweep\"\ndirection = [1.0, 0.0, 0.0]",
        &format!("kind = \"multi-strip\"\nmethod = \"{method}\"\ndirection = {direction}"),
    );
}

/// Calls `plan`, which must be refused without a trace.
fn refused(shop: &Workshop, message: &str, place: &str) {
    let before = shop.files();
    shop.call(&["plan", "job.toml", "--out", "path.cl", "--json", "plan.json"]).refused(message, place);
    assert_eq!(shop.files(), before);
}

#[test]
fn surfaces_with_a_pole_a_fold_or_no_normal() {
    let shop = Workshop::new();
    let pole = bezier(|i, j| [10.0 * i * j / 9.0, 10.0 * j / 3.0, 0.0]);
    // Along u the points run forth, back and forth again: where they turn, the normal turns over.
    let fold = bezier(|i, j| [[0.0, 30.0, -10.0, 20.0][i as usize], 10.0 * j / 3.0, 0.0]);
    let line = bezier(|i, _| [20.0 * i / 3.0, 0.0, 0.0]);
    for (surface, message) in [
        (&pole, "the surface has no normal at (u, v) = (0.000000, 0.000000)"),
        (&fold, "the surface folds over at (u, v) = (0."),
        (&line, "the surface has no normal at (u, v) = ("),
    ] {
        shop.write("patch.json", surface);
        for method in METHODS {
            plan_by(&shop, method, "[1.0, 0.0, 0.0]");
            refused(&shop, message, "patch.json");
        }
        shop.job_with("kind = \"cylinder\"\ndiameter = 8.0\nflute_length = 20.0", "kind = \"optimize\"");
        refused(&shop, message, "patch.json");
    }
}

#[test]
fn directions_across_which_no_strip_fits() {
    let shop = Workshop::new();
    // The cut along the patch's 10 mm: two strips of 20 mm flank on its 40 mm do not meet.
    plan_by(&shop, "regulus", "[0.0, 0.0, 1.0]\nstrips = 2");
    refused(&shop, "the tool is too short by", "near (");
    refused(&shop, "or more strips", "job.toml");
    for (method, message) in [
        ("regulus", "the cutting direction stands square to the surface near ("),
        ("rulings", "the cutting direction stands square to the surface near ("),
        ("rajain-2023", "the direction stands on the surface near ("),
    ] {
        plan_by(&shop, method, "[0.0, 1.0, 0.0]");
        refused(&shop, message, "job.toml");
    }
}

#[test]
fn hollows_too_tight_for_the_tool() {
    let shop = Workshop::new();
    // A hollow quarter cylinder of radius 3 mm, 10 mm high, for a tool of radius 4 mm.
    let arc = [[3.0, 0.0], [3.0, 1.657], [1.657, 3.0], [0.0, 3.0]];
    let hollow = bezier(|i, j| [arc[i as usize][0], arc[i as usize][1], 10.0 * j / 3.0]);
    let mut turned: Value = serde_json::from_str(&hollow).expect("JSON");
    turned["flip"] = json!(true);
    shop.write("patch.json", turned.to_string());
    for method in METHODS {
        plan_by(&shop, method, "[-1.0, 1.0, 0.0]");
        refused(&shop, "the tool is too big for the part: near (", "hollow with radius 2.9");
        refused(&shop, "the slimmest part of the flank has 4.000 mm", "job.toml");
    }
}

#[test]
fn weights_that_are_negative() {
    let shop = Workshop::new();
    let weigh = |method: &str, key: &str| {
        plan_by(&shop, method, &format!("[1.0, 0.0, 0.0]\nweights = {{ {key} = -0.5 }}"));
        refused(&shop, &format!("strategy.weights.{key} = -0.5 is out of range"), "job.toml:20:");
    };
    ["accuracy", "fairness", "g1", "direction"].iter().for_each(|key| weigh("regulus", key));
    ["rigidity", "accuracy", "g1", "proximity", "fairness"].iter().for_each(|key| weigh("rajain-2023", key));
    for key in ["accuracy", "rigidity", "fairness", "proximity"] {
        let wish = format!("kind = \"optimize\"\nweights = {{ {key} = -0.5 }}");
        shop.job_with("kind = \"cylinder\"\ndiameter = 8.0\nflute_length = 20.0", &wish);
        refused(&shop, &format!("tool.weights.{key} = -0.5 is out of range"), "job.toml:12:");
    }
}

#[test]
fn a_miss_of_the_tolerance_is_status_1_with_reason_and_remedy_whatever_the_method() {
    let shop = Workshop::new();
    for method in METHODS {
        plan_by(&shop, method, "[1.0, 0.0, 0.0]\nstrips = 1");
        let job = shop.read("job.toml").replace("overcut = 0.01, undercut = 0.02", "overcut = 1e-9, undercut = 1e-9");
        shop.write("job.toml", job);
        let call = shop.call(&["plan", "job.toml", "--out", "path.cl", "--json", "plan.json"]);
        assert_eq!(call.status, 1, "{method}: {}{}", call.out, call.err);
        for words in ["misses the tolerance: strip 1", "limited by", "would help: "] {
            assert!(call.out.contains(words), "{method}, {words}: {}", call.out);
        }
        let plan: Value = serde_json::from_str(&shop.read("plan.json")).expect("JSON");
        assert_eq!(plan["within_tolerance"], false);
    }
}
