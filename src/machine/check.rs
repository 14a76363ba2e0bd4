//! What `machine check` says about a machine: contradictions, agreement of forward and inverse, reach, poles. Uses
//! `diagnostic`, `geometry` and `motion`.

use super::model::{Machine, Travel};
use super::setup::{Setup, unwind};
use crate::diagnostic::Result;
use crate::geometry::{Direction, Point, Vector};
use crate::motion::Pose;
use std::f64::consts::{PI, TAU};

/// Poses tried for agreement, and directions tried for reach.
const POSES: usize = 20_000;
/// What forward after inverse may be off, mm and radians.
const AGREEMENT: (f64, f64) = (1e-9, 1e-10);

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckReport {
    /// For people, one finding a line.
    pub lines: Vec<String>,
    /// Contradictions; none for a sound machine.
    pub contradictions: Vec<String>,
    /// Largest distance of tips after inverse and forward, mm.
    pub tip_error: f64,
    /// Largest angle of axes after inverse and forward, radians.
    pub axis_error: f64,
    /// Smallest and largest angle between the pole and the axes that geometry allows, radians.
    pub reach: [f64; 2],
    /// Share of all directions that the rotary axes make within their limits.
    pub reachable_share: f64,
    /// Tool axes, part frame, at which the rotary axis nearer the part does not matter.
    pub poles: Vec<Direction>,
}

impl CheckReport {
    /// Whether the machine can be used.
    pub fn is_sound(&self) -> bool {
        self.contradictions.is_empty()
    }
}

/// Examines a machine with a tool of 100 mm at its first work offset.
pub fn check(machine: &Machine) -> Result<CheckReport> {
    let offset = machine.control.work_offsets.first().map_or([0.0; 3], |o| o.linear);
    let setup = Setup::at(machine, offset, 100.0)?;
    let (tip_error, axis_error) = agreement(&setup);
    let reach = setup.reach();
    let reachable_share = reachable_share(&setup);
    let poles = poles(&setup);
    let mut contradictions = contradictions(machine);
    if tip_error > AGREEMENT.0 || axis_error > AGREEMENT.1 {
        contradictions.push(format!("forward does not undo inverse: {tip_error:.2e} mm, {axis_error:.2e} rad"));
    }
    if reachable_share == 0.0 {
        contradictions.push("no tool axis direction lies within the rotary limits".into());
    }
    let first = &machine.rotary[machine.chain[0]];
    let mut lines = vec![
        format!("{}: {}", machine.name, machine.description),
        format!("chain from part to tool: {}", chain(machine)),
        format!("forward after inverse on {POSES} poses: {tip_error:.1e} mm, {axis_error:.1e} rad"),
        format!(
            "tool axes {:.3} to {:.3} degrees from axis {}; {:.1} % of all directions lie within the limits",
            reach[0].to_degrees(),
            reach[1].to_degrees(),
            first.letter,
            100.0 * reachable_share
        ),
    ];
    lines.extend(poles.iter().map(|pole| {
        format!(
            "singular at tool axis [{:.6}, {:.6}, {:.6}]: axis {} may stand anywhere",
            pole.x, pole.y, pole.z, first.letter
        )
    }));
    lines.extend(contradictions.iter().map(|c| format!("contradiction: {c}")));
    Ok(CheckReport { lines, contradictions, tip_error, axis_error, reach, reachable_share, poles })
}

fn chain(machine: &Machine) -> String {
    let names = machine.chain.map(|k| {
        let axis = &machine.rotary[k];
        format!("{} ({:?})", axis.letter, axis.on).to_lowercase().replacen(
            axis.letter.to_ascii_lowercase(),
            &axis.letter.to_string(),
            1,
        )
    });
    names.join(", ")
}

/// The `index`-th point of a sequence that fills the unit interval evenly, for a prime `base` (Halton).
fn halton(mut index: usize, base: usize) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0);
    while index > 0 {
        digit /= base as f64;
        value += digit * (index % base) as f64;
        index /= base;
    }
    value
}

/// Directions spread evenly over the sphere.
fn direction(index: usize) -> Direction {
    let z = 1.0 - 2.0 * (index as f64 + 0.5) / POSES as f64;
    let (sin, cos) = (TAU * halton(index + 1, 2)).sin_cos();
    let radius = (1.0 - z * z).max(0.0).sqrt();
    Direction::new_normalize(Vector::new(radius * cos, radius * sin, z))
}

fn agreement(setup: &Setup) -> (f64, f64) {
    let (mut tip, mut axis): (f64, f64) = (0.0, 0.0);
    for index in 0..POSES {
        let place = [3, 5, 7].map(|base| 500.0 * (2.0 * halton(index + 1, base) - 1.0));
        let pose = Pose { tip: Point::from(place), axis: direction(index) };
        let Ok(solutions) = setup.inverse(&pose) else { continue };
        for axes in solutions.branches {
            let back = setup.forward(&axes);
            tip = tip.max((back.tip - pose.tip).norm());
            axis = axis.max(back.axis_angle(&pose));
        }
    }
    (tip, axis)
}

/// Whether an angle fits a travel with some number of whole turns.
fn fits(travel: Travel, angle: f64) -> bool {
    match travel {
        Travel::Unlimited | Travel::Wrapped => true,
        Travel::Limited { min, max } => travel.excess(unwind(angle, (min + max) / 2.0)) <= 1e-9,
    }
}

fn reachable_share(setup: &Setup) -> f64 {
    let rotary = &setup.machine().rotary;
    let reachable = |index: &usize| {
        let pose = Pose { tip: Point::origin(), axis: direction(*index) };
        setup.inverse(&pose).is_ok_and(|solutions| {
            let within = |axes: &super::AxisPosition| (0..2).all(|k| fits(rotary[k].travel, axes.rotary[k]));
            solutions.branches.iter().any(within)
        })
    };
    (0..POSES).filter(reachable).count() as f64 / POSES as f64
}

/// The direction of the first axis of the chain and its opposite, as far as the machine makes them.
fn poles(setup: &Setup) -> Vec<Direction> {
    let machine = setup.machine();
    let first = machine.rotary[machine.chain[0]].direction;
    let second = machine.chain[1];
    let made = |pole: &Direction| {
        setup.inverse(&Pose { tip: Point::origin(), axis: *pole }).is_ok_and(|solutions| {
            solutions.branches.iter().any(|b| fits(machine.rotary[second].travel, b.rotary[second]))
        })
    };
    [first, -first].into_iter().filter(made).collect()
}

/// What a machine file says that cannot all be true or of use.
fn contradictions(machine: &Machine) -> Vec<String> {
    let mut found = Vec::new();
    let (control, options) = (&machine.control, &machine.control.options);
    if options.tcp_on.is_some() != options.tcp_off.is_some() {
        found.push("only one of tcp_on and tcp_off is given: TCP could be switched one way only".into());
    }
    if options.tcp_on.is_none() && control.tcp != options.tcp_at_start {
        found.push(format!(
            "programs are to be written with TCP {}, but the control starts with TCP {} and has no code to switch it",
            if control.tcp { "on" } else { "off" },
            if options.tcp_at_start { "on" } else { "off" },
        ));
    }
    for offset in &control.work_offsets {
        for (axis, value) in machine.linear.iter().zip(offset.linear) {
            // The part may stand below the travel of the spindle's gauge point, never far beyond its width.
            let width = axis.max - axis.min;
            if value < axis.min - width || value > axis.max + width {
                found.push(format!(
                    "{} puts the part's zero at {} {value}, far outside its travel",
                    offset.name, axis.letter
                ));
            }
        }
    }
    for axis in &machine.rotary {
        let step = 10f64.powi(-i32::from(options.rotary_digits)).to_radians();
        if let Travel::Limited { min, max } = axis.travel
            && max - min < step
        {
            found.push(format!("axis {} has less travel than one step of its words", axis.letter));
        }
        if axis.speed > 100.0 * PI {
            found.push(format!("axis {} turns at more than 3000 1/min: is the speed in degrees/min?", axis.letter));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn machines_that_come_along_are_sound() {
        for (name, _) in super::super::BUILTIN {
            let report = check(&Machine::named(name).unwrap()).unwrap();
            assert!(report.is_sound(), "{:?}", report.contradictions);
            assert!(report.tip_error <= AGREEMENT.0 && report.axis_error <= AGREEMENT.1);
            assert!((report.poles[0].z - 1.0).abs() < 1e-12, "{:?}", report.lines);
        }
    }

    #[test]
    fn reach_is_what_geometry_and_limits_leave() {
        // A from -120 to 30 degrees turns the axis up to 120 degrees from the pole in one branch: the share of the
        // sphere within 120 degrees of the pole is (1 - cos 120) / 2 = 3/4.
        let report = check(&Machine::named("trunnion-ac-30i").unwrap()).unwrap();
        assert!((report.reachable_share - 0.75).abs() < 1e-3, "{}", report.reachable_share);
        assert_eq!(report.poles.len(), 1);
        // A nutating axis at 45 degrees reaches the upper half.
        let mut nutating = Machine::named("xyzbc-trt").unwrap();
        nutating.rotary[0].direction = Direction::new_normalize(Vector::new(0.0, 1.0, 1.0));
        let report = check(&nutating).unwrap();
        assert!((report.reach[1] - PI / 2.0).abs() < 1e-12 && report.reach[0].abs() < 1e-12);
        assert!((report.reachable_share - 0.5).abs() < 1e-3, "{}", report.reachable_share);
    }

    #[test]
    fn contradictions_are_named() {
        let mut machine = Machine::named("head-b-table-c").unwrap();
        machine.control.tcp = false;
        machine.control.work_offsets[0].linear[0] = 90_000.0;
        let report = check(&machine).unwrap();
        assert!(!report.is_sound());
        assert!(report.contradictions.iter().any(|c| c.contains("no code to switch it")));
        assert!(report.contradictions.iter().any(|c| c.contains("G54 puts the part's zero at X 90000")));
    }
}
