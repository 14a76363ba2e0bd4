//! A temporary folder with a small job that is good: a gently twisted patch, a cylinder, a table-table machine.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The job; tests replace pieces of it.
pub(crate) const JOB: &str = r#"format = "regulus-job"
version = 1
name = "patch"

[part]
file = "patch.json"
tolerance = { overcut = 0.01, undercut = 0.02 }

[tool]
number = 7
kind = "cylinder"
diameter = 8.0
flute_length = 20.0
gauge_length = 80.0

[strategy]
kind = "single-sweep"
direction = [1.0, 0.0, 0.0]

[machine]
file = "xyzac-trt"
work_offset = "G54"

[feed]
cut = 600.0
reference = "mid"
spindle = 8000
"#;

/// A folder of its own, removed afterwards.
pub(crate) struct Workshop {
    folder: tempfile::TempDir,
}

/// What a call of the program gave.
pub(crate) struct Call {
    pub(crate) status: i32,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Workshop {
    /// With `job.toml` and `patch.json`.
    pub(crate) fn new() -> Self {
        let workshop = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        workshop.write("job.toml", JOB);
        workshop.write("patch.json", patch(false));
        workshop
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).expect("a file that can be written");
    }

    pub(crate) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// The job with a piece replaced.
    pub(crate) fn job_with(&self, from: &str, to: &str) {
        assert!(JOB.contains(from), "{from} is not in the job");
        self.write("job.toml", JOB.replacen(from, to, 1));
    }

    /// Runs the program in the folder.
    pub(crate) fn call(&self, arguments: &[&str]) -> Call {
        let mut command = Command::new(env!("CARGO_BIN_EXE_regulus"));
        let output = command.args(arguments).current_dir(self.folder.path()).output().expect("the program starts");
        Call {
            status: output.status.code().unwrap_or(-1),
            out: String::from_utf8(output.stdout).expect("text"),
            err: String::from_utf8(output.stderr).expect("text"),
        }
    }

    /// Every file and folder below the folder, in order of name.
    pub(crate) fn files(&self) -> Vec<String> {
        let mut names = Vec::new();
        collect(self.folder.path(), self.folder.path(), &mut names);
        names.sort();
        names
    }
}

fn collect(root: &Path, folder: &Path, names: &mut Vec<String>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        names.push(path.strip_prefix(root).unwrap_or(&path).display().to_string());
        if path.is_dir() {
            collect(root, &path, names);
        }
    }
}

impl Call {
    /// The call was refused: status 2, the message and its place, a remedy, nothing on standard output.
    pub(crate) fn refused(&self, message: &str, place: &str) {
        assert_eq!(self.status, 2, "{}{}", self.out, self.err);
        assert!(self.err.contains(message), "no \"{message}\" in:\n{}", self.err);
        assert!(self.err.contains(place), "no \"{place}\" in:\n{}", self.err);
        assert!(self.err.contains("  help: "), "no remedy in:\n{}", self.err);
        assert_eq!(self.out, "");
    }
}

/// A bicubic patch of 40 mm x 10 mm that twists by 3 degrees along x; its normal points to -y, or to +y when turned.
pub(crate) fn patch(turned: bool) -> String {
    let control: Vec<Vec<[f64; 3]>> = (0..4)
        .map(|i| {
            let x = 40.0 * f64::from(i) / 3.0;
            let (sin, cos) = (3f64.to_radians() * f64::from(i) / 3.0).sin_cos();
            (0..4).map(|j| 10.0 * f64::from(j) / 3.0).map(|h| [x, h * sin, h * cos]).collect()
        })
        .collect();
    serde_json::json!({
        "format": "regulus-bspline", "version": 1, "units": "mm", "degree": [3, 3],
        "knots_u": [0, 0, 0, 0, 1, 1, 1, 1], "knots_v": [0, 0, 0, 0, 1, 1, 1, 1],
        "flip": turned, "control": control,
    })
    .to_string()
}
