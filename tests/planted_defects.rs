//! Defects of a known depth, planted into exact programs on every machine that comes along: each is found as deep as it is,
//! on its line.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use rayon::prelude::*;
use regulus::geometry::{Direction, Point, Vector};
use regulus::job::Job;
use regulus::machine::{BUILTIN, Machine};
use regulus::motion::{FeedReference, Pass, PassKind, PassMotion, Pose, ToolPath, ToolSummary};
use regulus::pipeline::{InputFile, Inputs, Judging, PartFiles, judge, post_job};
use regulus::verify::Verified;

/// Depth of every defect, mm, and how exactly it must be found.
const DEPTH: f64 = 0.05;
const EXACT: f64 = 0.0005;

/// Where the part is tried, mm above the machine file's place: tables stand low and high.
const HEIGHTS: [f64; 4] = [0.0, 60.0, 160.0, -70.0];

/// What is cut with what: rows along x over a plane, the tool tilted about x, its lowest point on the plane.
struct Work {
    tool: &'static str,
    /// Radius of the ball, mm; 0 for a point.
    radius: f64,
    /// Half the size of the plane, mm.
    half: [f64; 2],
    pitch: f64,
    step: f64,
    spacing: f64,
    /// Tilt and how far it swings, degrees.
    tilt: [f64; 2],
}

const BALL: Work = Work {
    tool: "kind = \"ball\"\ndiameter = 6.0",
    radius: 3.0,
    half: [5.0, 2.5],
    pitch: 0.5,
    step: 0.5,
    spacing: 0.37,
    tilt: [12.0, 3.0],
};

/// Its grooves are wide as they are deep: tan 37 + tan 13 degrees is 0.98.
const NEEDLE: Work = Work {
    tool: "kind = \"cone\"\ntip_diameter = 0.0\nhalf_angle_deg = 25.0",
    radius: 0.0,
    half: [1.5, 1.0],
    pitch: 0.25,
    step: 0.5,
    spacing: 0.07,
    tilt: [12.0, 0.0],
};

impl Work {
    /// With the part `height` mm above where the machine file has it.
    fn inputs(&self, machine: &str, height: f64) -> Inputs {
        let mut machine = Machine::named(machine).unwrap();
        machine.control.work_offsets[0].linear[2] += height;
        let options = &mut machine.control.options;
        options.linear_digits = options.linear_digits.max(5);
        options.rotary_digits = options.rotary_digits.max(5);
        let offset = machine.control.work_offsets[0].name.clone();
        let job = format!(
            "format = \"regulus-job\"\nversion = 1\nname = \"plane\"\n\
             [part]\nfile = \"plane.json\"\ntolerance = {{ overcut = 0.005, undercut = 0.4 }}\n\
             [tool]\nnumber = 1\n{}\nflute_length = 15.0\ngauge_length = 90.0\n\
             [strategy]\nkind = \"single-sweep\"\n\
             [machine]\nfile = \"{}\"\nwork_offset = \"{offset}\"\n\
             [feed]\ncut = 600.0\nspindle = 8000\n",
            self.tool, machine.name
        );
        let [x, y] = self.half;
        let plane = format!(
            "{{\"format\": \"regulus-bspline\", \"version\": 1, \"units\": \"mm\", \"degree\": [1, 1], \"flip\": false,\
             \"knots_u\": [0, 0, 1, 1], \"knots_v\": [0, 0, 1, 1],\
             \"control\": [[[-{x}, -{y}, 0], [-{x}, {y}, 0]], [[{x}, -{y}, 0], [{x}, {y}, 0]]]}}"
        );
        let job = Job::read(&job, "job.toml").unwrap();
        let part = InputFile { name: "plane.json", bytes: plane.as_bytes() };
        Inputs::read(job, &PartFiles::alone(part), &machine, "").unwrap()
    }

    /// The tool with its lowest point at a place.
    fn pose(&self, x: f64, y: f64, z: f64) -> Pose {
        let tilt = (self.tilt[0] + self.tilt[1] * (0.8 * x).sin()).to_radians();
        let axis = Direction::new_normalize(Vector::new(0.0, -tilt.sin(), tilt.cos()));
        let centre = Point::new(x, y, z + self.radius);
        Pose { tip: centre - axis.into_inner() * self.radius, axis }
    }

    /// Rows at the given y over the plane and a little beyond; `depth` is how deep the tool is at x and y.
    fn path(&self, rows: &[f64], depth: impl Fn(f64, f64) -> f64) -> ToolPath {
        let count = (2.0 * self.half[0] / self.step).round() as i32 + 2;
        let mut cut = Vec::new();
        for (k, y) in rows.iter().enumerate() {
            let row = (0..=count).map(|i| self.step * (f64::from(i) - 0.5 * f64::from(count)));
            let side = if k % 2 == 0 { 1.0 } else { -1.0 };
            cut.extend(row.map(|x| x * side).map(|x| self.pose(x, *y, -depth(x, *y))));
        }
        let above = |pose: &Pose, height: f64| Pose { tip: pose.tip + Vector::z() * height, ..*pose };
        let (first, last) = (*cut.first().unwrap(), *cut.last().unwrap());
        let pass = |kind, poses| Pass { kind, strip: Some(0), motion: PassMotion::Poses(poses) };
        ToolPath {
            name: "plane".to_owned(),
            tool: ToolSummary { number: 1, description: String::new(), gauge_length: 90.0, flute_length: 15.0 },
            cut_feed: 600.0,
            feed_reference: FeedReference::Tip,
            spindle_rpm: 8000.0,
            linearization: 1e-4,
            overcut_tolerance: 0.005,
            undercut_tolerance: 0.4,
            passes: vec![
                pass(PassKind::Rapid, vec![above(&first, 50.0), above(&first, 5.0)]),
                pass(PassKind::Approach, vec![above(&first, 5.0), first]),
                pass(PassKind::Cut, cut),
                pass(PassKind::Retract, vec![last, above(&last, 5.0)]),
                pass(PassKind::Rapid, vec![above(&last, 5.0), above(&last, 50.0)]),
            ],
        }
    }

    fn rows(&self) -> Vec<f64> {
        let count = (2.0 * self.half[1] / self.pitch).round() as i32;
        (0..=count).map(|k| self.pitch * f64::from(k) - self.half[1]).collect()
    }

    fn judged(&self, inputs: &Inputs, text: &str) -> Verified {
        let program = InputFile { name: "program.nc", bytes: text.as_bytes() };
        let how = Judging { spacing: Some(self.spacing), ..Judging::default() };
        judge(inputs, program, None, &how).unwrap().verified
    }
}

fn posted(inputs: &Inputs, path: &ToolPath) -> Result<String, String> {
    post_job(inputs, path).map(|posted| posted.text).map_err(|e| e.to_string())
}

/// What is wrong with what is said of a defect, on one machine.
fn complaint(work: &Work, machine: &str, good: &ToolPath, spoiled: &ToolPath) -> Option<String> {
    let placed = |height: f64| {
        let inputs = work.inputs(machine, height);
        let texts = posted(&inputs, good).and_then(|good| Ok((good, posted(&inputs, spoiled)?)));
        texts.map(|texts| (inputs, texts))
    };
    let (inputs, (good, spoiled)) = match HEIGHTS.map(placed).into_iter().reduce(Result::or)? {
        Ok(placed) => placed,
        Err(e) => return Some(format!("{machine}: {e}")),
    };
    let before = work.judged(&inputs, &good).record.deviation.overcut_max_mm;
    let record = work.judged(&inputs, &spoiled).record;
    let found = record.deviation.overcut_max_mm;
    // The lines that the defect has changed, and the next, whose block begins in it.
    let changed: Vec<usize> =
        spoiled.lines().zip(good.lines()).enumerate().filter(|(_, (a, b))| a != b).map(|(k, _)| k + 1).collect();
    let (Some(first), Some(last)) = (changed.first(), changed.last()) else {
        return Some(format!("{machine}: nothing is planted"));
    };
    let stretch = *first..=last + 1;
    let line = record.findings.iter().filter(|finding| finding.is_error()).find_map(|finding| finding.line);
    let right = before < EXACT && (found - DEPTH).abs() <= EXACT && line.is_some_and(|line| stretch.contains(&line));
    (!right).then(|| format!("{machine}: {before} before, {found}, line {line:?}, planted in {stretch:?}"))
}

fn assert_found(work: &Work, good: &ToolPath, spoiled: &ToolPath) {
    let wrong: Vec<String> =
        BUILTIN.par_iter().filter_map(|(machine, _)| complaint(work, machine, good, spoiled)).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_gouge_along_some_blocks_is_as_deep_as_it_is_on_every_machine() {
    let good = BALL.path(&BALL.rows(), |_, _| 0.0);
    let gouge = |x: f64, y: f64| if y == 0.5 && (-1.1..=1.1).contains(&x) { DEPTH } else { 0.0 };
    assert_found(&BALL, &good, &BALL.path(&BALL.rows(), gouge));
}

#[test]
fn a_dip_at_one_pose_between_samples_is_as_deep_as_it_is_on_every_machine() {
    let good = BALL.path(&BALL.rows(), |_, _| 0.0);
    let dip = |x: f64, y: f64| if y == -1.0 && (x - 1.5).abs() < 0.1 { DEPTH } else { 0.0 };
    assert_found(&BALL, &good, &BALL.path(&BALL.rows(), dip));
}

#[test]
fn a_scratch_as_narrow_as_it_is_deep_is_found_on_every_machine() {
    let mut rows = NEEDLE.rows();
    rows.insert(rows.len() / 2, 0.111);
    let scratch = |_: f64, y: f64| if y == 0.111 { DEPTH } else { 0.0 };
    assert_found(&NEEDLE, &NEEDLE.path(&rows, |_, _| 0.0), &NEEDLE.path(&rows, scratch));
}
