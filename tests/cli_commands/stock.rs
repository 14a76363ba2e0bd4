//! A program's way through the stock: command, verdict, what is left as the next stock.

use crate::workshop::{JOB, Workshop};
use serde_json::Value;

/// A block of material about the patch, from which it is to be milled.
const STOCK: &str = "\n[stock]\nbox = { min = [0, 0, 0], max = [40, 20, 10] }\ncell = 0.25\n";

/// Two rows along the block, 1 mm deep each; line 8 is the first, line 11 the way to the second.
const ROWS: &str = "G21 G90 G61 G54\nT7 M6\nS8000 M3\nG43 H7\nM428\nG0 X-10 Y5 Z30 A0 C0\nZ9\nG1 X50 F600\n\
                    G0 Z30\nX-10 Y11\nZ9\nG1 X50\nG0 Z50\nM429\nM30\n";

fn shop() -> Workshop {
    let shop = Workshop::new();
    shop.write("job.toml", format!("{JOB}{STOCK}"));
    shop.write("rows.ngc", ROWS);
    shop
}

#[test]
fn a_program_takes_its_rows_and_leaves_the_next_stock() {
    let shop = shop();
    let call = |program: &str, job: &str| {
        let common = ["stock", program, "--machine", "xyzac-trt", "--job", job];
        shop.call(&[&common[..], &["--stl", "left.stl", "--json", "s.json"]].concat())
    };
    let first = call("rows.ngc", "job.toml");
    assert_eq!((first.status, first.err.as_str()), (0, ""), "{}", first.out);
    let record: Value = serde_json::from_str(&shop.read("s.json")).unwrap();
    let figure = |key: &str| record[key].as_f64().unwrap();
    // 14 mm of width, 1 mm deep, 40 mm long, in moves of 60 mm at 600 mm/min.
    assert!((figure("removed_mm3") - 560.0).abs() < 6.0, "{}", first.out);
    assert_eq!((figure("removed_by_rapids_mm3"), figure("air_share")), (0.0, 0.0));
    assert!((figure("removal_max_cm3_min") - 320.0 / 6.0 * 0.06).abs() < 0.05, "{}", first.out);
    assert!((figure("engagement_max_deg") - 180.0).abs() < 8.0, "{}", first.out);
    // The same again finds air only.
    shop.write("next.toml", format!("{JOB}\n[stock]\nfile = \"left.stl\"\ncell = 0.25\n"));
    let second = call("rows.ngc", "next.toml");
    assert_eq!(second.status, 0, "{}{}", second.out, second.err);
    let record: Value = serde_json::from_str(&shop.read("s.json")).unwrap();
    assert!(record["removed_mm3"].as_f64().unwrap() < 1.0, "{}", second.out);
    assert!((record["volume_before_mm3"].as_f64().unwrap() - 7440.0).abs() < 15.0, "{}", second.out);
}

#[test]
fn a_rapid_through_material_fails_with_its_line() {
    let shop = shop();
    shop.write("low.ngc", ROWS.replace("G0 Z30\nX-10 Y11", "G0 X-10 Y11"));
    let call = shop.call(&["stock", "low.ngc", "--machine", "xyzac-trt", "--job", "job.toml"]);
    assert_eq!(call.status, 1);
    assert!(call.out.contains("error R801 line 9: a rapid goes 1.0000 mm through the stock"), "{}", call.out);
    let judged = ["verify", "low.ngc", "--machine", "xyzac-trt", "--job", "job.toml", "--json", "v.json"];
    assert_eq!(shop.call(&judged).status, 1);
    let record: Value = serde_json::from_str(&shop.read("v.json")).unwrap();
    assert!(record["stock"]["removed_by_rapids_mm3"].as_f64().unwrap() > 50.0);
    let found = record["findings"].as_array().unwrap();
    assert!(found.iter().any(|finding| finding["id"] == "R801" && finding["line"] == 9));
    assert!(
        record["reasons"].as_array().unwrap().iter().any(|r| r.as_str().unwrap().starts_with("line 9: a rapid goes"))
    );
}

#[test]
fn limits_of_the_job_are_kept() {
    let shop = shop();
    for (limit, says) in [
        ("feed_limit = 500", "error R803 line 8: the tip feeds through material at 600 mm/min, 500 are allowed"),
        ("removal_limit = 1.5", "error R804 line 8: 3."),
        ("engagement_limit_deg = 90", "error R805 line 8: the flutes are engaged over"),
    ] {
        shop.write("limited.toml", format!("{JOB}{STOCK}{limit}\n"));
        let call = shop.call(&["stock", "rows.ngc", "--machine", "xyzac-trt", "--job", "limited.toml"]);
        assert_eq!(call.status, 1, "{}", call.err);
        assert!(call.out.contains(says), "{says}: {}", call.out);
    }
}

#[test]
fn a_rapid_may_rub_as_deep_as_the_job_says() {
    let shop = shop();
    // The way back over the first row, 5 micrometres deeper than it was milled.
    shop.write("rub.ngc", ROWS.replace("G0 Z30\nX-10 Y11", "G0 Z8.995\nX-10\nZ30\nY11"));
    for (rubbing, status) in [("", 0), ("rubbing = 0.002\n", 1)] {
        shop.write("rub.toml", format!("{JOB}{STOCK}{rubbing}"));
        let call = shop.call(&["stock", "rub.ngc", "--machine", "xyzac-trt", "--job", "rub.toml"]);
        assert_eq!(call.status, status, "{}{}", call.out, call.err);
        assert_eq!(call.out.matches("R801").count(), usize::from(status == 1), "{}", call.out);
        assert!(status == 0 || call.out.contains("R801 line 10: a rapid goes 0.0050 mm through"), "{}", call.out);
    }
    shop.write("bad.toml", format!("{JOB}{STOCK}rubbing = -1\n"));
    let call = shop.call(&["stock", "rub.ngc", "--machine", "xyzac-trt", "--job", "bad.toml"]);
    call.refused("-1", "bad.toml:32:");
}

#[test]
fn stocks_that_are_none_are_refused_with_their_place() {
    let shop = shop();
    let call = |job: &str| {
        shop.write("bad.toml", job);
        shop.call(&["stock", "rows.ngc", "--machine", "xyzac-trt", "--job", "bad.toml"])
    };
    call(JOB).refused("the job has no stock", "bad.toml");
    call(&format!("{JOB}\n[stock]\nfile = \"none.stl\"\n")).refused("none.stl cannot be read", "bad.toml");
    shop.write("open.stl", "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n");
    call(&format!("{JOB}\n[stock]\nfile = \"open.stl\"\n")).refused("closed body is required", "open.stl");
    call(&format!("{JOB}{}", STOCK.replace("0.25", "0.0001"))).refused("make", "bad.toml");
}
