//! Tools that are found, and tools that are chosen.

use crate::workshop::Workshop;

const WISH: &str = "kind = \"optimize\"\nfamily = \"cone\"\nradius = [2.0, 6.0]";

fn shop_with_a_wish() -> Workshop {
    let shop = Workshop::new();
    shop.job_with("kind = \"cylinder\"\ndiameter = 8.0\nflute_length = 20.0", WISH);
    shop
}

#[test]
fn a_found_tool_is_written_and_judges_the_program() {
    let shop = shop_with_a_wish();
    let call = shop.call(&["run", "job.toml", "--out", "out"]);
    assert_eq!((call.status, call.err.as_str()), (0, ""), "{}", call.out);
    assert!(call.out.contains("Smallest radius of curvature"), "{}", call.out);
    for name in ["tool.toml", "tool.csv", "tool.dxf", "tool.stl"] {
        assert!(shop.files().contains(&format!("out/{name}")), "{name}");
    }
    // The program's text and the tool's file are enough: nothing is planned again.
    let verify = ["verify", "out/program.ngc", "--machine", "xyzac-trt", "--job", "job.toml", "--json", "v.json"];
    shop.call(&verify).refused("found by planning", "job.toml:11:8");
    let call = shop.call(&[verify.as_slice(), &["--tool", "out/tool.toml"]].concat());
    assert_eq!(call.status, 0, "{}{}", call.out, call.err);
    let figure = |name: &str, key: &str| {
        let record: serde_json::Value = serde_json::from_str(&shop.read(name)).unwrap();
        record["deviation"][key].as_f64().unwrap()
    };
    for key in ["overcut_max_mm", "undercut_max_mm"] {
        assert!((figure("v.json", key) - figure("out/verify.json", key)).abs() < 1e-9, "{key}");
    }
    // Its table is that of a job, too.
    let text = shop.read("out/tool.toml");
    let table = text.split("[tool]").nth(1).unwrap();
    shop.job_with("number = 7\nkind = \"cylinder\"\ndiameter = 8.0\nflute_length = 20.0\ngauge_length = 80.0\n", table);
    let call = shop.call(&["verify", "out/program.ngc", "--machine", "xyzac-trt", "--job", "job.toml"]);
    assert_eq!(call.status, 0, "{}{}", call.out, call.err);
}

#[test]
fn wishes_that_contradict_themselves_are_refused() {
    let shop = shop_with_a_wish();
    let job = shop.read("job.toml");
    for (to, message, place) in [
        ("radius = [6.0, 2.0]", "is larger than the largest", "job.toml:13:10"),
        ("radius = [0.0, 2.0]", "radius[0] = 0 is out of range", "job.toml:13:11"),
        ("radius = [2.0, 6.0]\ndiameter = 3", "has no `diameter`", "job.toml:14:12"),
        ("radius = [2.0, 6.0]\ncoefficients = 2", "coefficients = 2 is out of range", "job.toml:14:16"),
        ("radius = [2.0, 6.0]\nends = [2.0, 3.0]", "contradicts it", "job.toml:13:10"),
        ("ends = [0.0, 3.0]", "ends[0] = 0 is out of range", "job.toml:13:9"),
        ("radius = [2.0, 6.0]\nstart = \"lines\"", "lines", "job.toml:14:9"),
        ("radius = [2.0, 6.0]\nlength = [1.0, 5.0]", "no flank of at most 5 mm covers the part", "job.toml"),
    ] {
        shop.write("job.toml", job.replace("radius = [2.0, 6.0]", to));
        shop.call(&["plan", "job.toml", "--out", "path.cl"]).refused(message, place);
    }
}

#[test]
fn ends_belong_to_a_cone_whose_length_is_then_found() {
    let shop = shop_with_a_wish();
    let job = shop.read("job.toml");
    let ends = "ends = [3.9, 4.1]\nstart = \"line\"";
    shop.write("job.toml", job.replace("radius = [2.0, 6.0]", ends).replace("\"cone\"", "\"barrel\""));
    shop.call(&["plan", "job.toml", "--out", "path.cl"]).refused("only a cone is given by", "job.toml:13:8");
    shop.write("job.toml", job.replace("radius = [2.0, 6.0]", ends));
    let call = shop.call(&["plan", "job.toml", "--out", "path.cl"]);
    assert_eq!(call.status, 0, "{}{}", call.out, call.err);
    assert!(call.out.contains("found from a line that can move along the part"), "{}", call.out);
}

const CATALOGUE: &str = r#"format = "regulus-catalogue"
version = 1

[[tool]]
name = "thick"
number = 1
kind = "cylinder"
diameter = 60.0
flute_length = 20.0
gauge_length = 80.0

[[tool]]
name = "slim"
number = 2
kind = "cylinder"
diameter = 6.0
flute_length = 20.0
gauge_length = 80.0
"#;

#[test]
fn the_cutters_of_a_catalogue_are_ranked() {
    let shop = Workshop::new();
    shop.write("c.toml", CATALOGUE);
    let call = shop.call(&["tools", "job.toml", "--catalogue", "c.toml", "--json", "rank.json"]);
    assert_eq!((call.status, call.err.as_str()), (0, ""), "{}", call.out);
    assert!(call.out.contains("slim") && call.out.contains("thick"), "{}", call.out);
    let ranking: serde_json::Value = serde_json::from_str(&shop.read("rank.json")).unwrap();
    assert_eq!(ranking["format"], "regulus-tools");
    assert_eq!(ranking["tools"].as_array().unwrap().len(), 2);
    assert!(ranking["tools"][0]["time_s"].as_f64().unwrap() > 0.0);
    shop.write("c.toml", CATALOGUE.replace("diameter = 6.0", "diameter = 0.0"));
    shop.call(&["tools", "job.toml", "--catalogue", "c.toml"]).refused("diameter", "c.toml:16:12");
}
