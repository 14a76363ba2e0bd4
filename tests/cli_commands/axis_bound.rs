//! The directions that the machine makes, as a bound of the plan.

use crate::workshop::{JOB, Workshop};

#[test]
fn a_plan_keeps_to_the_directions_that_the_machine_makes() {
    let shop = Workshop::new();
    let machine = shop.call(&["machine", "show", "xyzac-trt"]).out;
    let tilt = machine.find("letter = \"A\"").expect("an A axis");
    let limits = tilt + machine[tilt..].find("limits = ").expect("limits");
    let end = limits + machine[limits..].find('\n').expect("a line");
    // The wall leans from 0 to 3 degrees.
    shop.write("mine.toml", format!("{}limits = [-2, 2]{}", &machine[..limits], &machine[end..]));
    let job = JOB.replace("\"xyzac-trt\"", "\"mine.toml\"");
    shop.write("job.toml", job.replace("direction = [", "method = \"rulings\"\ndirection = ["));
    let before = shop.files();
    let call = shop.call(&["plan", "job.toml", "--out", "path.cl"]);
    call.refused("strip 1 of 1: with the tip at (", "job.toml");
    call.refused("axis A would have to stand at", "beyond its limit");
    assert_eq!(shop.files(), before);
    shop.write("job.toml", job);
    let call = shop.call(&["run", "job.toml", "--out", "out"]);
    assert_eq!(call.status, 1, "{}{}", call.out, call.err);
    assert!(call.out.contains("limited by the tool axis directions that the machine makes"), "{}", call.out);
    // What is written can be followed: the program stays within the limits.
    assert!(shop.path("out/program.ngc").exists());
}
