//! Programs that are none, or broken on their way: refused, or failed with their place, never passed.

use crate::workshop::{Call, Workshop};

/// A workshop with its job's own good program.
fn shop() -> (Workshop, String) {
    let shop = Workshop::new();
    assert_eq!(shop.call(&["run", "job.toml", "--out", "all"]).status, 0);
    let good = shop.read("all/program.ngc");
    (shop, good)
}

fn verified(shop: &Workshop, content: impl AsRef<[u8]>) -> Call {
    shop.write("p.ngc", content);
    shop.call(&["verify", "p.ngc", "--machine", "xyzac-trt", "--job", "job.toml", "--spacing", "1"])
}

fn refused(shop: &Workshop, content: impl AsRef<[u8]>, message: &str, place: &str) {
    verified(shop, &content).refused(message, place);
    // Without a part, too.
    shop.call(&["verify", "p.ngc", "--machine", "xyzac-trt"]).refused("", place);
}

#[test]
fn what_is_no_program_gets_no_verdict() {
    let (shop, good) = shop();
    refused(&shop, "", "the program holds no block", "p.ngc:1");
    refused(&shop, "(a comment alone)\n", "the program holds no block", "p.ngc");
    refused(&shop, [0x7f, b'E', b'L', b'F', 0, 1, 2, 0xff, b'\n', 0xfe], "no verdict", "p.ngc:1");
    refused(&shop, "X1 ".repeat(200_000), "no verdict", "p.ngc:1");
    refused(&shop, good.replacen("G61\n", "G61\n(side (lower))\n", 1), "a comment inside a comment", "p.ngc:");
    refused(&shop, good.replacen("G61\n", "G61\nO<side> call\n", 1), "program flow, which is not followed", "p.ngc:");
    refused(&shop, good.replacen("G61\n", "G61\nM98 P100\n", 1), "M98", "p.ngc:");
    refused(&shop, good.replacen(" A", " B", 3), "the machine has no axis B; it has XYZAC", "p.ngc:");
}

#[test]
fn what_is_cut_off_fails() {
    let (shop, good) = shop();
    let half: String = good.lines().take(good.lines().count() / 2).map(|line| format!("{line}\n")).collect();
    let call = verified(&shop, half);
    assert_eq!(call.status, 1, "{}{}", call.out, call.err);
    assert!(call.out.contains("error R108") && call.out.contains("error R703"), "{}", call.out);
}

#[test]
fn line_ends_and_byte_order_marks_do_not_matter() {
    let (shop, good) = shop();
    for text in [good.replace('\n', "\r\n"), format!("\u{feff}{good}"), good.to_lowercase()] {
        let call = verified(&shop, text);
        assert_eq!((call.status, call.err.as_str()), (0, ""), "{}", call.out);
    }
}

#[test]
fn a_program_of_a_gibibyte_is_refused_before_it_is_read() {
    let (shop, _) = shop();
    // A file of holes: it takes no room on the disk.
    std::fs::File::create(shop.path("p.ngc")).unwrap().set_len(1 << 30).unwrap();
    let call = shop.call(&["verify", "p.ngc", "--machine", "xyzac-trt", "--job", "job.toml"]);
    call.refused("p.ngc is larger than 128 MiB", "");
}

#[test]
fn the_machine_tolerances_are_told_or_asked_for() {
    let (shop, good) = shop();
    shop.write("p.ngc", good);
    let machine = shop.call(&["machine", "show", "xyzac-trt"]).out;
    shop.write("m.toml", machine.replace("[control]\n", "[tolerances]\npivot = 0.01\nangle = 0.002\n\n[control]\n"));
    let verify = |machine: &str| {
        shop.call(&[
            "verify",
            "p.ngc",
            "--machine",
            machine,
            "--job",
            "job.toml",
            "--uncertainty",
            "--json",
            "v.json",
            "--spacing",
            "1",
        ])
    };
    verify("xyzac-trt").refused("gives no tolerances", "");
    let call = verify("m.toml");
    assert_eq!(call.status, 0, "{}{}", call.out, call.err);
    assert!(call.out.contains("by its tolerances"), "{}", call.out);
    let record: serde_json::Value = serde_json::from_str(&shop.read("v.json")).unwrap();
    let (worst, rss) = (&record["uncertainty"]["worst_case_mm"], &record["uncertainty"]["rss_mm"]);
    assert!(worst.as_f64().unwrap() >= rss.as_f64().unwrap() && rss.as_f64().unwrap() > 0.0, "{record:#}");
    // Two pivots with two directions each, and two angles.
    assert_eq!(record["uncertainty"]["parameters"].as_array().unwrap().len(), 6);
    shop.write("bad.toml", machine.replace("[control]\n", "[tolerances]\npivot = -1\n\n[control]\n"));
    verify("bad.toml").refused("-1 is no tolerance", "bad.toml:");
}
