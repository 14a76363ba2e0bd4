//! The samples, whole: each job runs with one command, passes, and comes to its figures.

#[cfg(test)]
mod tests {
    use serde_json::Value;
    use std::path::{Path, PathBuf};
    use std::process::{Command, Output};

    /// The largest error of the tool laid on the impeller's rulings, over that of the fitted motion.
    const BETTER_THAN_RULINGS: f64 = 5.0;

    fn folder(sample: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("samples").join(sample)
    }

    fn regulus(job: &Path, out: &Path, threads: usize) -> Output {
        Command::new(env!("CARGO_BIN_EXE_regulus"))
            .args(["--threads", &threads.to_string(), "run"])
            .arg(job)
            .arg("--out")
            .arg(out)
            .output()
            .unwrap()
    }

    /// Runs a sample; its record and the folder it wrote.
    fn run(sample: &str) -> (Value, tempfile::TempDir) {
        let out = tempfile::tempdir().unwrap();
        let output = regulus(&folder(sample).join("job.toml"), out.path(), 2);
        assert!(output.status.success(), "{sample}: {}{}", text(&output.stdout), text(&output.stderr));
        (record(out.path()), out)
    }

    fn record(out: &Path) -> Value {
        serde_json::from_slice(&std::fs::read(out.join("verify.json")).unwrap()).unwrap()
    }

    fn text(bytes: &[u8]) -> String {
        String::from_utf8_lossy(bytes).into_owned()
    }

    fn figure(record: &Value, key: &str) -> f64 {
        record["deviation"][key].as_f64().unwrap()
    }

    fn assert_within(record: &Value, overcut: f64, undercut: f64) {
        assert_eq!(record["verdict"], "pass");
        assert!(figure(record, "overcut_max_mm") <= overcut, "{record:#}");
        assert!(figure(record, "undercut_max_mm") <= undercut, "{record:#}");
    }

    /// What is proved to hold everywhere must be within a micrometre of what was sampled.
    fn assert_bounded(sample: &str, machine: &str, out: &Path) {
        let output = Command::new(env!("CARGO_BIN_EXE_regulus"))
            .arg("verify")
            .arg(out.join("program.ngc"))
            .args(["--machine", machine, "--bounds", "--job"])
            .arg(folder(sample).join("job.toml"))
            .arg("--json")
            .arg(out.join("bounds.json"))
            .output()
            .unwrap();
        assert!(output.status.success(), "{sample}: {}{}", text(&output.stdout), text(&output.stderr));
        let record: Value = serde_json::from_slice(&std::fs::read(out.join("bounds.json")).unwrap()).unwrap();
        for side in ["overcut", "undercut"] {
            let [sampled, bound] = ["max", "bound"].map(|kind| figure(&record, &format!("{side}_{kind}_mm")));
            assert!((sampled..=sampled + 0.001).contains(&bound), "{sample}: {side} {sampled} mm, bound {bound} mm");
        }
    }

    /// The program's flank must come back to the tool path within the allowance for blocks.
    fn assert_comes_back(record: &Value, allowance: f64) {
        let tip = record["round_trip"]["tip_max_mm"].as_f64().unwrap();
        assert!(tip <= 1.5 * allowance, "tip {tip} mm off the tool path");
    }

    #[test]
    fn exact_cone_is_cut_within_a_micron_with_the_same_bytes_on_any_number_of_threads() {
        let (record, first) = run("exact-cone");
        assert_within(&record, 0.001, 0.001);
        assert_comes_back(&record, 0.0003);
        let second = tempfile::tempdir().unwrap();
        assert!(regulus(&folder("exact-cone").join("job.toml"), second.path(), 1).status.success());
        for name in ["path.cl", "program.ngc", "verify.json", "report.html"] {
            let read = |out: &tempfile::TempDir| std::fs::read(out.path().join(name)).unwrap();
            assert!(read(&first) == read(&second), "{name} differs between 1 and 2 threads");
        }
    }

    #[test]
    fn ruled_impeller_is_five_times_better_than_the_tool_on_its_rulings() {
        let (record, _out) = run("ruled-impeller");
        assert_within(&record, 0.005, 0.030);
        assert_comes_back(&record, 0.0005);
        let (status, rulings) = impeller_with("method = \"rulings\"");
        assert_eq!(status, Some(1));
        let worst = |r: &Value| figure(r, "overcut_max_mm").max(figure(r, "undercut_max_mm"));
        let gain = worst(&rulings) / worst(&record);
        assert!(gain >= BETTER_THAN_RULINGS, "only {gain} times better");
    }

    /// Exit status and record of the impeller with one more line in its `[strategy]`.
    fn impeller_with(line: &str) -> (Option<i32>, Value) {
        let scratch = tempfile::tempdir().unwrap();
        let job = std::fs::read_to_string(folder("ruled-impeller").join("job.toml")).unwrap();
        std::fs::write(scratch.path().join("job.toml"), job.replace("[strategy]", &format!("[strategy]\n{line}")))
            .unwrap();
        std::fs::copy(folder("ruled-impeller").join("pressure-side.json"), scratch.path().join("pressure-side.json"))
            .unwrap();
        let out = scratch.path().join("out");
        let status = regulus(&scratch.path().join("job.toml"), &out, 2).status.code();
        (status, record(&out))
    }

    #[test]
    fn strips_that_are_joined_meet_far_more_smoothly_than_strips_fitted_alone() {
        let kinks = |weight: &str| {
            let (status, record) = impeller_with(&format!("weights = {{ g1 = {weight} }}"));
            assert_eq!(status, Some(0), "{record:#}");
            ["kink_max_deg", "kink_mean_deg"].map(|key| record["strips"][key].as_f64().unwrap())
        };
        let ([most_alone, mean_alone], [most, mean]) = (kinks("0.0"), kinks("0.001"));
        assert!(2.0 * most < most_alone && 5.0 * mean < mean_alone, "{most} of {most_alone}, {mean} of {mean_alone}");
    }

    #[test]
    fn rotor_37_is_cut_within_tolerance_over_its_whole_pressure_side() {
        let (record, out) = run("rotor37");
        assert_bounded("rotor37", "head-b-table-c", out.path());
        assert_within(&record, 0.010, 0.030);
        assert_comes_back(&record, 0.001);
        assert_eq!(record["strips"]["count"], 25);
        assert_eq!(record["deviation"]["uncut_share"], 0.0);
    }
}
