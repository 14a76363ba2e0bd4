//! Programs and tool paths of others, through the binary: posted, carried to other machines, compared, inspected; and
//! what is wrong with them, said with its place.

use crate::workshop::Workshop;

/// A program for xyzac-trt with tip, tilt and table turning together.
fn program() -> String {
    let mut text =
        "G21 G90 G61\nT3 M6\nS8000 M3\nG43 H3\nM428\nG0 X0 Y0 Z60 A0 C0\nG0 X10 Y5 Z40 A-50 C-20\nG93\n".to_owned();
    for k in 1..=12 {
        let t = f64::from(k) / 12.0;
        let (x, y, a, c) = (10.0 - 30.0 * t, 5.0 - 9.0 * t * t, -50.0 - 12.0 * (3.0 * t).sin(), -20.0 + 20.0 * t);
        text += &format!("G1 X{x:.3} Y{y:.3} Z{:.3} A{a:.3} C{c:.3} F60\n", 40.0 - 25.0 * t);
    }
    text + "G0 Z60\nM5\nM30\n"
}

/// What the choice of branches costs, and what none can be below, in text and JSON alike.
fn assert_choice_is_told(out: &str, json: &str) {
    let record: serde_json::Value = serde_json::from_str(json).expect("JSON");
    assert_eq!((record["format"].as_str(), record["version"].as_u64()), (Some("regulus-post"), Some(1)));
    let figure = |key: &str| record["rotary_choice"][key].as_f64().expect("a number");
    let (seconds, least) = (figure("seconds"), figure("least_seconds"));
    assert!(0.0 < least && least <= seconds, "{record}");
    let told = format!(
        "rotary choice: {seconds:.2} s of ways at the axes' top speeds, no choice can need less than {least:.2} s (proved)"
    );
    assert!(out.contains(&told), "no \"{told}\" in {out}");
}

const APT: &str = "PARTNO/demo\nUNITS/MM\nLOADTL/5,LENGTH,100\nCUTTER/8,0,0,0,0,0,30\nSPINDL/RPM,9000,CLW\n\
                   FROM/0,0,60,0,0,1\nRAPID\nGOTO/0,0,5,0,0.6,0.8\nFEDRAT/600,MMPM\nGOTO/20,4,5,0.1,0.6,0.8\n\
                   CIRCLE/20,14,5,0,0,1,10\nGOTO/30,14,5,0.1,0.6,0.8\nRAPID\nGOTO/30,14,60,0.1,0.6,0.8\nFINI\n";

#[test]
fn a_program_goes_to_other_machines_and_comes_back_the_same() {
    let shop = Workshop::new();
    shop.write("a.ngc", program());
    for machine in ["xyzbc-trt", "head-b-table-c", "bridgemill", "trunnion-ac-30i"] {
        let there = ["retarget", "a.ngc", "--from", "xyzac-trt", "--to", machine, "--out", "b.nc", "--json", "b.json"];
        let call = shop.call(&there);
        assert_eq!(call.status, 0, "{machine}: {}{}", call.out, call.err);
        assert_choice_is_told(&call.out, &shop.read("b.json"));
        let call = shop.call(&["retarget", "b.nc", "--from", machine, "--to", "xyzac-trt", "--out", "c.ngc"]);
        assert_eq!(call.status, 0, "{machine}: {}{}", call.out, call.err);
        let call = shop.call(&[
            "diff",
            "a.ngc",
            "c.ngc",
            "--machine",
            "xyzac-trt",
            "--tolerance",
            "0.001",
            "--json",
            "d.json",
        ]);
        assert_eq!(call.status, 0, "{machine}: {}{}", call.out, call.err);
        let record: serde_json::Value = serde_json::from_str(&shop.read("d.json")).expect("JSON");
        assert_eq!((record["format"].as_str(), record["version"].as_u64()), (Some("regulus-diff"), Some(1)));
        assert!(record["feed"]["flank_mm"]["value"].as_f64().expect("a number") <= 0.001, "{record}");
    }
}

#[test]
fn programs_that_differ_end_with_status_1_and_both_lines() {
    let shop = Workshop::new();
    let text = program();
    let line = text.lines().nth(13).expect("a block").to_owned();
    shop.write("a.ngc", &text);
    shop.write("b.ngc", text.replace(&line, &line.replacen("Z2", "Z3", 1)));
    let call = shop.call(&["diff", "a.ngc", "b.ngc", "--machine", "xyzac-trt", "--tolerance", "0.01"]);
    assert_eq!(call.status, 1, "{}{}", call.out, call.err);
    // The peak may lie on the block to it in one program and on the block from it in the other.
    let lines = ["14 and 14", "14 and 15", "15 and 14"].map(|lines| format!("mm, lines {lines}\n"));
    assert!(lines.iter().any(|lines| call.out.contains(lines)), "{}", call.out);
    assert_eq!(shop.call(&["diff", "a.ngc", "b.ngc", "--machine", "xyzac-trt"]).status, 0);
}

#[test]
fn apt_is_posted_carried_and_inspected() {
    let shop = Workshop::new();
    shop.write("p.apt", APT);
    let call = shop.call(&["post", "p.apt", "--machine", "xyzac-trt", "--out", "p.ngc", "--json", "p.json"]);
    assert_eq!(call.status, 0, "{}{}", call.out, call.err);
    assert!(shop.read("p.ngc").contains("T5 M6"));
    assert_choice_is_told(&call.out, &shop.read("p.json"));
    // Back into APT, posted again: the same motion.
    let call = shop.call(&["retarget", "p.ngc", "--from", "xyzac-trt", "--gauge-length", "100", "--out", "q.apt"]);
    assert_eq!(call.status, 0, "{}{}", call.out, call.err);
    let call = shop.call(&["post", "q.apt", "--machine", "xyzbc-trt", "--flank", "40", "--out", "q.ngc"]);
    assert_eq!(call.status, 0, "{}{}", call.out, call.err);
    let diff = ["diff", "p.ngc", "q.ngc", "--machine", "xyzac-trt", "--machine-b", "xyzbc-trt", "--flank", "30"];
    let call = shop.call(&[&diff[..], &["--gauge-length", "100", "--tolerance", "0.005"]].concat());
    assert_eq!(call.status, 0, "{}{}", call.out, call.err);
    let call = shop.call(&["inspect", "p.apt", "--json", "i.json"]);
    assert_eq!(call.status, 0, "{}{}", call.out, call.err);
    let record: serde_json::Value = serde_json::from_str(&shop.read("i.json")).expect("JSON");
    assert_eq!((record["kind"].as_str(), record["operations"][0]["tool"].as_u64()), (Some("path"), Some(5)));
}

#[test]
fn inspect_tells_where_the_time_goes() {
    let shop = Workshop::new();
    shop.write("a.ngc", program());
    let call = shop.call(&["inspect", "a.ngc", "--machine", "xyzac-trt", "--json", "i.json"]);
    assert!(call.status == 0 && call.out.contains("lines 9 to 20: 12."), "{}{}", call.out, call.err);
    let record: serde_json::Value = serde_json::from_str(&shop.read("i.json")).expect("JSON");
    assert_eq!(record["motion"]["pace"]["passages"][0]["blocks"].as_u64(), Some(12));
}

/// Reading goes on at the next block behind each error; fifty are shown.
#[test]
fn every_syntax_error_is_located_up_to_fifty_at_once() {
    let shop = Workshop::new();
    let errors = [
        ("G1 X1.2.3", 8),
        ("G1 X F100", 4),
        ("G1 X1 X2 F9", 7),
        ("G0 G1 X1 F9", 4),
        ("(open", 1),
        ("G1 X1 F9 *55", 10),
        ("TRAORI", 1),
        ("G1 U1 F9", 4),
        ("G1 X1 F-9", 7),
    ];
    let good: Vec<String> = program().lines().map(str::to_owned).collect();
    let (head, tail) = good.split_at(9);
    let mut lines = head.to_vec();
    for (error, _) in errors {
        lines.extend([error.to_owned(), "G1 X0 F60".to_owned()]);
    }
    lines.extend_from_slice(tail);
    shop.write("bad.ngc", lines.join("\n"));
    let before = shop.files();
    let retarget = ["retarget", "bad.ngc", "--from", "xyzac-trt", "--to", "xyzbc-trt", "--out", "out.nc"];
    let call = shop.call(&retarget);
    for (index, (error, column)) in errors.into_iter().enumerate() {
        call.refused(error, &format!("bad.ngc:{}:{column}\n", 10 + 2 * index));
    }
    shop.write("bad.ngc", program().replace("M5\n", &"G777\n".repeat(60)));
    let call = shop.call(&retarget);
    call.refused("10 more are not shown", "bad.ngc:71:1");
    assert_eq!(call.err.matches("G777 is no code of this control").count(), 50, "{}", call.err);
    assert_eq!(shop.files(), before);
}

/// Each call is refused with the message and the place, and leaves no file behind.
#[test]
fn bad_programs_and_paths_are_refused_with_their_place() {
    let shop = Workshop::new();
    shop.write("good.ngc", program());
    shop.write("code.ngc", program().replace("M5\n", "G777 X1\nG888\n"));
    shop.write("tools.ngc", program().replace("M5\n", "T9 M6\nG1 X0 F9\n"));
    shop.write("still.ngc", "G21 G90 G61\nM30\n");
    shop.write("words.apt", APT.replace("RAPID\n", "TRANS/1,2\nRAPID\n"));
    shop.write("silent.apt", APT.replace(",LENGTH,100", "").replace("CUTTER/8,0,0,0,0,0,30\n", ""));
    shop.write("two.apt", APT.replace("FINI\n", "LOADTL/6\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n"));
    shop.write("axis.apt", APT.replace("GOTO/20,4,5,0.1,0.6,0.8", "GOTO/20,4,5,0,0,0"));
    shop.write("empty.apt", "");
    shop.write("under.ngc", program().replace("A-50 C-20", "A-170 C-20"));
    let retarget = |file| ["retarget", file, "--from", "xyzac-trt", "--to", "head-b-table-c", "--out", "out.nc"];
    let post = |file| ["post", file, "--machine", "xyzac-trt", "--out", "out.nc"];
    let diff = |file| ["diff", "good.ngc", file, "--machine", "xyzac-trt"];
    let before = shop.files();
    for (call, message, place) in [
        (&retarget("code.ngc")[..], "G777", "code.ngc:22:1"),
        (&retarget("code.ngc")[..], "G888", "code.ngc:23:1"),
        (&retarget("tools.ngc")[..], "tool 9 is called", "tools.ngc:22"),
        (&retarget("still.ngc")[..], "the program moves nothing", "still.ngc"),
        (&retarget("under.ngc")[..], "machine head-b-table-c cannot go here: axis B", "under.ngc:7"),
        (&retarget("no.ngc")[..], "no.ngc cannot be read", ""),
        (&["retarget", "good.ngc", "--from", "xyzac-trt", "--out", "out.nc"][..], "no machine is given", "--to N.toml"),
        (&["retarget", "good.ngc", "--from", "nowhere", "--out", "x.cl"][..], "no machine is called", ""),
        (&diff("code.ngc")[..], "G777", "code.ngc:22:1"),
        (&diff("still.ngc")[..], "the program moves nothing", "still.ngc"),
        (&post("words.apt")[..], "TRANS", "words.apt:7:1"),
        (&post("silent.apt")[..], "does not say how long the tool is", "silent.apt:3"),
        (&post("silent.apt")[..], "does not say how long the flutes are", "give --flank MM"),
        (&post("two.apt")[..], "2 operations", "--operation N"),
        (&post("axis.apt")[..], "GOTO: write x, y, z", "axis.apt:10:1"),
        (&post("empty.apt")[..], "moves no tool", "empty.apt:1:1"),
    ] {
        shop.call(call).refused(message, place);
        assert_eq!(shop.files(), before, "{call:?}");
    }
}
