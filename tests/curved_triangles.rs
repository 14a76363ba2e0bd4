//! Coarse meshes of surfaces that a tool sweeps exactly, judged against the exact program: flat triangles show their own
//! sag, curved ones next to none of it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use regulus::job::Job;
use regulus::machine::Machine;
use regulus::part::{DesignSurface, ReadOptions, SampleGrid, SurfacePlace, read};
use regulus::pipeline::{InputFile, Inputs, Judging, PartFiles, judge, plan, post_job};
use regulus::verify::DeviationRecord;
use std::fmt::Write;

const SAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/exact-cone/");
const FILE: &str = "file = \"surface.json\"";

fn inputs(job: &str, name: &str, bytes: &[u8]) -> Inputs {
    let job = Job::read(job, "job.toml").unwrap();
    let machine = Machine::named("xyzac-trt").unwrap();
    Inputs::read(job, &PartFiles::alone(InputFile { name, bytes }), &machine, "").unwrap()
}

/// The grid as an OBJ file, with the surface's own normals at the corners or without any.
fn obj(grid: &SampleGrid, with_normals: bool) -> String {
    let mut text = String::new();
    for sample in &grid.samples {
        let (p, n) = (sample.point, sample.normal.0);
        writeln!(text, "v {} {} {}\nvn {} {} {}", p.x, p.y, p.z, n.x, n.y, n.z).unwrap();
    }
    for [a, b, c] in grid.triangles.iter().map(|t| t.map(|k| k + 1)) {
        let line = if with_normals { format!("f {a}//{a} {b}//{b} {c}//{c}") } else { format!("f {a} {b} {c}") };
        writeln!(text, "{line}").unwrap();
    }
    text
}

/// Largest distance of the flat triangles from the surface, by their sides.
fn sag(surface: &DesignSurface, grid: &SampleGrid) -> f64 {
    let sides = grid.triangles.iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
    let middles = sides.map(|ends| ends.map(|k| grid.samples[*k as usize].point));
    middles.map(|[a, b]| surface.signed_distance(&nalgebra::center(&a, &b)).abs()).fold(0.0, f64::max)
}

fn extremes(deviation: &DeviationRecord) -> f64 {
    deviation.overcut_max_mm.max(deviation.undercut_max_mm)
}

#[test]
fn a_coarse_mesh_of_the_exact_cone_is_judged_by_its_patches() {
    let job = std::fs::read_to_string(format!("{SAMPLE}job.toml")).unwrap();
    let bytes = std::fs::read(format!("{SAMPLE}surface.json")).unwrap();
    let exact = inputs(&job, "surface.json", &bytes);
    let planned = plan(&exact).unwrap();
    let program = post_job(&exact, &planned.path).unwrap().text;
    let text = InputFile { name: "program.ngc", bytes: program.as_bytes() };

    let surface = read(&bytes, "surface.json", &ReadOptions::default()).unwrap();
    let grid = surface.sample(4.0);
    assert!(matches!(grid.samples[0].place, SurfacePlace::Parameters { .. }));
    let sag = sag(&surface, &grid);
    let judged = |triangles: &str, with_normals: bool, judging: &Judging| {
        let job = job.replace(FILE, &format!("file = \"surface.obj\"\ntriangles = \"{triangles}\""));
        let inputs = inputs(&job, "surface.obj", obj(&grid, with_normals).as_bytes());
        judge(&inputs, text, None, judging).unwrap().verified.record.deviation
    };
    let plain = Judging { spacing: Some(1.2), ..Judging::default() };
    let flat = extremes(&judged("flat", false, &plain));
    let found = extremes(&judged("curved", false, &plain));
    let given = judged("curved", true, &Judging { bounds: true, ..plain });
    assert!(flat > 0.9 * sag && sag > 0.02, "{flat} {sag}");
    assert!(found < 0.05 * flat, "{found} {flat}");
    assert!(extremes(&given) < 0.02 * flat, "{given:?} {flat}");
    let near = |bound: Option<f64>, sampled: f64| bound.is_some_and(|b| b >= sampled && b <= sampled + 1.01e-3);
    assert!(near(given.overcut_bound_mm, given.overcut_max_mm), "{given:?}");
    assert!(near(given.undercut_bound_mm, given.undercut_max_mm), "{given:?}");
}
