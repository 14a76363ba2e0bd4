//! Findings as users and other programs get them: rules explained, programs judged by their machine alone, SARIF, JUnit.

use crate::workshop::Workshop;
use serde_json::Value;

/// A program that its machine can run.
const PLAIN: &str = "G21 G90 G61 G54\nT7 M6\nS8000 M3\nG43 H7\nM428\nG0 X0 Y0 Z50 A0 C0\nG1 Z20 F600\nX10 A1\nX20 A2\n\
                     G0 Z50\nM429\nM30\n";

#[test]
fn rules_are_listed_and_explained() {
    let shop = Workshop::new();
    let list = shop.call(&["verify", "--explain"]);
    assert_eq!((list.status, list.err.as_str()), (0, ""));
    assert!(list.out.contains("R7xx the part") && list.out.contains("R701 overcut"), "{}", list.out);
    for name in ["R407", "r407", "unwinding"] {
        assert!(shop.call(&["verify", "--explain", name]).out.starts_with("R407 unwinding, fault\n"), "{name}");
    }
    shop.call(&["verify", "--explain", "R999"]).refused("no rule is called \"R999\"", "");
}

#[test]
fn a_program_alone_is_judged_by_its_machine() {
    let shop = Workshop::new();
    shop.write("good.ngc", PLAIN);
    let alone = |program: &str| shop.call(&["verify", program, "--machine", "xyzac-trt", "--json", "v.json"]);
    let call = alone("good.ngc");
    assert_eq!((call.status, call.err.as_str()), (0, ""), "{}", call.out);
    assert!(call.out.ends_with("verdict     pass\n"), "{}", call.out);
    let record: Value = serde_json::from_str(&shop.read("v.json")).unwrap();
    assert_eq!((&record["format"], &record["verdict"]), (&"regulus-verify".into(), &"pass".into()));
    assert!(record["deviation"].is_null() && record["axes"]["A"]["max"] == 2.0);
    shop.write("far.ngc", PLAIN.replace("X20 A2", "X20000 A2"));
    let call = alone("far.ngc");
    assert_eq!(call.status, 1);
    assert!(call.out.contains("error R501 line 9: travel of X is 20000.0000"), "{}", call.out);
    let record: Value = serde_json::from_str(&shop.read("v.json")).unwrap();
    assert_eq!((&record["findings"][0]["id"], &record["findings"][0]["line"]), (&"R501".into(), &9.into()));
}

#[test]
fn findings_go_to_other_programs_with_and_without_a_verdict() {
    let shop = Workshop::new();
    assert_eq!(shop.call(&["run", "job.toml", "--out", "all"]).status, 0);
    let good = shop.read("all/program.ngc");
    let lists = |program: &str, text: String| {
        shop.write(program, text);
        let files = ["--sarif", "f.sarif", "--junit", "f.xml", "--json", "f.json"];
        let call =
            shop.call(&[&["verify", program, "--machine", "xyzac-trt", "--job", "job.toml"][..], &files].concat());
        let log: Value = serde_json::from_str(&shop.read("f.sarif")).unwrap();
        let results = log["runs"][0]["results"].as_array().unwrap().clone();
        (call.status, results, shop.read("f.xml"))
    };
    let (status, results, junit) = lists("good.ngc", good.clone());
    assert_eq!((status, results.len()), (0, 0));
    assert!(junit.contains("failures=\"0\""));
    let (status, results, junit) = lists("other.ngc", good.replace("T7 M6", "T8 M6"));
    assert_eq!((status, &results[0]["ruleId"]), (1, &"R301".into()));
    assert!(junit.contains("<failure type=\"R301\""));
    std::fs::remove_file(shop.path("f.json")).unwrap();
    let (status, results, _) = lists("odd.ngc", good.replacen("G61\n", "G61\nG777\n", 1));
    let region = &results[0]["locations"][0]["physicalLocation"]["region"];
    assert_eq!((status, &results[0]["ruleId"], &region["snippet"]["text"]), (2, &"R201".into(), &"G777".into()));
    assert!(!shop.path("f.json").exists());
}
