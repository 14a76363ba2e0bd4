//! Commands that run to their end.

use crate::workshop::{JOB, Workshop};
use std::process::{Command, Stdio};

#[test]
fn run_writes_path_program_figures_and_report() {
    let shop = Workshop::new();
    let call = shop.call(&["run", "job.toml", "--out", "made/here"]);
    assert_eq!((call.status, call.err.as_str()), (0, ""), "{}", call.out);
    assert!(call.out.contains("verdict     pass"), "{}", call.out);
    let wanted = [
        "made",
        "made/here",
        "made/here/path.cl",
        "made/here/plan.json",
        "made/here/post.json",
        "made/here/program.ngc",
        "made/here/report.html",
    ];
    let rest = ["made/here/verify.json", "job.toml", "patch.json"];
    let mut wanted: Vec<_> = wanted.iter().chain(&rest).map(ToString::to_string).collect();
    wanted.sort();
    assert_eq!(shop.files(), wanted);
    let verdict: serde_json::Value = serde_json::from_str(&shop.read("made/here/verify.json")).unwrap();
    assert_eq!(verdict["format"], "regulus-verify");
    assert_eq!(verdict["version"], 1);
    assert_eq!(verdict["verdict"], "pass");
    assert!(verdict["deviation"]["overcut_max_mm"].as_f64().unwrap() <= 0.01);
    // The program keeps within a tenth of the tolerance of the path, the flank's ends included.
    assert!(verdict["round_trip"]["tip_max_mm"].as_f64().unwrap() <= 0.001, "{}", verdict["round_trip"]);
    assert!(shop.read("made/here/report.html").starts_with("<!doctype html>"));
}

#[test]
fn the_same_job_gives_the_same_bytes_on_any_number_of_threads() {
    let shop = Workshop::new();
    for (threads, folder) in [("1", "one"), ("2", "two"), ("3", "three")] {
        let call = shop.call(&["run", "job.toml", "--out", folder, "--threads", threads]);
        assert_eq!(call.status, 0, "{}", call.err);
    }
    for name in ["path.cl", "program.ngc", "verify.json", "report.html"] {
        let one = shop.read(&format!("one/{name}"));
        assert!(one == shop.read(&format!("two/{name}")) && one == shop.read(&format!("three/{name}")), "{name}");
    }
}

#[test]
fn stage_by_stage_gives_the_same_path_and_verdict_as_run() {
    let shop = Workshop::new();
    assert_eq!(shop.call(&["run", "job.toml", "--out", "all"]).status, 0);
    assert_eq!(shop.call(&["plan", "job.toml", "--out", "path.cl"]).status, 0);
    assert_eq!(shop.read("path.cl"), shop.read("all/path.cl"));
    let call = shop.call(&["post", "path.cl", "--machine", "xyzac-trt", "--out", "p.ngc"]);
    assert_eq!(call.status, 0, "{}", call.err);
    // Only the hash of the inputs differs: the post knows path and machine, not the job.
    let blocks = |text: String| text.lines().filter(|l| !l.contains("input")).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(blocks(shop.read("p.ngc")), blocks(shop.read("all/program.ngc")));
    let verify = ["verify", "p.ngc", "--machine", "xyzac-trt", "--job", "job.toml", "--json", "v.json"];
    let call = shop.call(&verify);
    assert_eq!(call.status, 0, "{}{}", call.out, call.err);
    let figures = |name: &str| -> serde_json::Value {
        let whole: serde_json::Value = serde_json::from_str(&shop.read(name)).unwrap();
        whole["deviation"].clone()
    };
    assert_eq!(figures("v.json"), figures("all/verify.json"));
}

#[test]
fn a_program_out_of_tolerance_is_done_but_fails() {
    let shop = Workshop::new();
    assert_eq!(shop.call(&["run", "job.toml", "--out", "all"]).status, 0);
    let text = shop.read("all/program.ngc");
    let moved: Vec<_> = text.lines().map(shift_y).collect();
    shop.write("moved.ngc", moved.join("\n"));
    let call = shop.call(&["verify", "moved.ngc", "--machine", "xyzac-trt", "--job", "job.toml", "--json", "v.json"]);
    assert_eq!(call.status, 1, "{}{}", call.out, call.err);
    assert!(call.out.contains("verdict     fail") && call.out.contains("overcut is"), "{}", call.out);
    let verdict: serde_json::Value = serde_json::from_str(&shop.read("v.json")).unwrap();
    assert_eq!(verdict["verdict"], "fail");
    let overcut = verdict["deviation"]["overcut_max_mm"].as_f64().unwrap();
    assert!((overcut - 0.1).abs() < 0.02, "{overcut}");
}

/// The same block with its Y word 0.1 mm higher: toward the material of the patch.
fn shift_y(line: &str) -> String {
    let words = line.split(' ').map(|word| match word.strip_prefix('Y').map(str::parse::<f64>) {
        Some(Ok(y)) => format!("Y{:.5}", y + 0.1),
        _ => word.to_owned(),
    });
    words.collect::<Vec<_>>().join(" ")
}

#[test]
fn a_fanuc_program_without_tcp_is_judged_the_same() {
    let shop = Workshop::new();
    // Tilted out of the pole of the rotary axes, where a program without TCP would have to turn C by half a turn.
    let placement = "placement = { origin = [0, 0, 0], rotate_deg = [30, 0, 0] }";
    let job = JOB.replace("[part]\n", &format!("[part]\n{placement}\n")).replace("xyzac-trt", "trunnion-ac-30i");
    shop.write("job.toml", job.replace("work_offset = \"G54\"", "work_offset = \"G54\"\ntcp = false"));
    let call = shop.call(&["run", "job.toml"]);
    assert_eq!(call.status, 0, "{}{}", call.out, call.err);
    assert!(shop.read("out/program.nc").starts_with("%\nO"), "{}", shop.read("out/program.nc"));
}

#[test]
fn inspect_tells_programs_and_parts_apart() {
    let shop = Workshop::new();
    let call = shop.call(&["inspect", "patch.json", "--json", "i.json"]);
    assert_eq!(call.status, 0, "{}", call.err);
    assert!(call.out.contains("degree 3 x 3, 4 x 4 control points"), "{}", call.out);
    let summary: serde_json::Value = serde_json::from_str(&shop.read("i.json")).unwrap();
    assert_eq!((&summary["format"], &summary["kind"]), (&"regulus-inspect".into(), &"part".into()));
    shop.write("p.ngc", "G21 G90 G94\nG1 X10 F600\nG777\nM30\n");
    let call = shop.call(&["inspect", "p.ngc", "--machine", "xyzac-trt"]);
    assert_eq!(call.status, 0);
    assert!(call.err.contains("warning: ") && call.err.contains("p.ngc:3:1\n    3 | G777"), "{}", call.err);
}

#[test]
fn machines_are_listed_shown_checked_and_described() {
    let shop = Workshop::new();
    let list = shop.call(&["machine", "list"]).out;
    for name in ["xyzac-trt", "xyzbc-trt", "bridgemill", "head-b-table-c"] {
        assert!(list.contains(name), "{list}");
        assert_eq!(shop.call(&["machine", "check", name]).status, 0);
    }
    let check = shop.call(&["machine", "check", "tr-35", "--picture", "reach.svg"]).out;
    assert!(
        check.contains("# both branches") && check.contains("singular at tool axis [0.000000, 0.000000, 1.000000]"),
        "{check}"
    );
    assert!(shop.read("reach.svg").starts_with("<svg") && shop.read("reach.svg").contains("<title>tr-35</title>"));
    shop.write("mine.toml", shop.call(&["machine", "show", "xyzbc-trt"]).out);
    assert_eq!(shop.call(&["machine", "check", "mine.toml"]).status, 0);
    let schema = shop.call(&["machine", "schema"]).out;
    assert!(serde_json::from_str::<serde_json::Value>(&schema).unwrap()["properties"]["rotary"].is_object());
}

#[test]
fn a_machine_of_ones_own_is_found_beside_the_job() {
    let shop = Workshop::new();
    std::fs::create_dir(shop.path("jobs")).unwrap();
    shop.write("jobs/mine.toml", shop.call(&["machine", "show", "xyzac-trt"]).out);
    shop.write("jobs/patch.json", shop.read("patch.json"));
    shop.write("jobs/job.toml", JOB.replace("\"xyzac-trt\"", "\"mine.toml\""));
    let call = shop.call(&["plan", "jobs/job.toml", "--out", "p.cl"]);
    assert_eq!(call.status, 0, "{}", call.err);
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_regulus"))
        .args(["machine", "schema"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""));
}

#[test]
fn the_job_of_the_readme_is_good() {
    let readme = include_str!("../../README.md");
    let (_, rest) = readme.split_once("```toml\n").unwrap();
    let (job, _) = rest.split_once("```").unwrap();
    let shop = Workshop::new();
    shop.write("job.toml", job);
    shop.write("blade.json", shop.read("patch.json"));
    let call = shop.call(&["plan", "job.toml", "--out", "p.cl"]);
    assert_eq!((call.status, call.err.as_str()), (0, ""));
    // Every key that is commented out is known too.
    let every_key: String = job.lines().filter(|l| !l.starts_with("# engage_from")).map(uncommented).collect();
    for name in ["hub.stl", "finished.stl"] {
        shop.write(name, "");
    }
    shop.write("job.toml", every_key);
    let call = shop.call(&["plan", "job.toml", "--out", "p.cl"]);
    assert!(!call.err.contains("unknown"), "{}", call.err);
    assert!(call.err.contains("too short for an STL file"), "{}", call.err);
}

fn uncommented(line: &str) -> String {
    format!("{}\n", line.strip_prefix("# ").unwrap_or(line))
}
