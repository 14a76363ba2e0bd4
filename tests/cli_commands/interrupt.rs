//! Ctrl-C while a plan is being made.

use crate::workshop::{JOB, Workshop};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Interrupts `plan` after a while; its status and output.
#[cfg(unix)]
fn interrupted_after(shop: &Workshop, wait: Duration) -> (Option<i32>, String) {
    let child = Command::new(env!("CARGO_BIN_EXE_regulus"))
        .args(["plan", "job.toml", "--out", "p.cl"])
        .current_dir(shop.path(""))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(wait);
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.is_ok());
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
}

#[test]
#[cfg(unix)]
fn ctrl_c_keeps_the_best_plan_so_far_and_says_so() {
    let shop = Workshop::new();
    // Enough strips that planning lasts; how soon it starts depends on the machine, so several waits are tried.
    shop.write("job.toml", JOB.replace("kind = \"single-sweep\"", "kind = \"multi-strip\"\nstrips = 30"));
    for wait in [400, 1500, 4000, 100] {
        let (status, said) = interrupted_after(&shop, Duration::from_millis(wait));
        if said.contains("interrupted: this is the best found so far") {
            assert!(matches!(status, Some(0 | 1)), "{status:?} {said}");
            assert!(shop.read("p.cl").starts_with("{\"format\":\"regulus-cl\""));
            return;
        }
    }
    panic!("planning was never under way when the interrupt came");
}
