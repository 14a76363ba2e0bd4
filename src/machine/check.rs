//! What `machine check` says about a machine: contradictions, agreement of forward and inverse, reach, poles. Uses
//! `diagnostic`, `geometry` and `motion`.

use super::axes::AxisPosition;
use super::model::{Carrier, Machine, RotaryMotion, Travel};
use super::reach::{ReachMap, Ways, fits, poles, ways};
use super::scene::Scene;
use super::setup::Setup;
use crate::diagnostic::Result;
use crate::geometry::{Direction, Point, Vector};
use crate::motion::Pose;
use std::f64::consts::{PI, TAU};

/// Poses tried for agreement, and directions tried for reach.
const POSES: usize = 20_000;
/// Tool lengths and directions tried to reach the part's zero, mm.
const LENGTHS: [f64; 9] = [0.0, 50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 350.0, 400.0];
const DIRECTIONS: usize = 500;
/// Positions of the axes tried to find bodies apart.
const STANDS: usize = 200;
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
    /// The directions that the machine makes.
    pub map: ReachMap,
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
    contradictions.extend(overlaps(&setup)?);
    if tip_error > AGREEMENT.0 || axis_error > AGREEMENT.1 {
        contradictions.push(format!("forward does not undo inverse: {tip_error:.2e} mm, {axis_error:.2e} rad"));
    }
    if reachable_share == 0.0 && machine.rotary.iter().all(|axis| axis.is_present()) {
        contradictions.push("no tool axis direction lies within the rotary limits".into());
    }
    let first = &machine.rotary[machine.chain[0]];
    let map = ReachMap::new(&setup);
    let mut lines = vec![
        format!("{}: {}", machine.name, machine.description),
        format!("chain from part to tool: {}", chain(machine)),
        format!("forward after inverse on {POSES} poses: {tip_error:.1e} mm, {axis_error:.1e} rad"),
        reach_in_words(&setup, reachable_share),
    ];
    if machine.rotary.iter().all(|axis| axis.is_present()) {
        let [all, any] = map.tilts();
        lines.push(format!(
            "within the limits: every tool axis up to {all} degrees from the spindle's, some up to {any}, to 5 degrees"
        ));
    }
    lines.extend(poles.iter().map(|pole| {
        format!(
            "singular at tool axis [{:.6}, {:.6}, {:.6}]: axis {} may stand anywhere",
            pole.x + 0.0,
            pole.y + 0.0,
            pole.z + 0.0,
            first.letter
        )
    }));
    if !machine.bodies.is_empty() {
        let names: Vec<&str> = machine.bodies.iter().map(|body| body.name.as_str()).collect();
        lines.push(format!("bodies: {}", names.join(", ")));
    }
    lines.extend(homes(machine));
    lines.extend(contradictions.iter().map(|c| format!("contradiction: {c}")));
    Ok(CheckReport { lines, contradictions, tip_error, axis_error, reach, reachable_share, poles, map })
}

/// The rotary axes that there are, in the order of the chain.
fn chain(machine: &Machine) -> String {
    let names = machine.chain.iter().filter_map(|k| {
        let axis = machine.rotary.get(*k).filter(|axis| axis.is_present())?;
        let carrier = match axis.on {
            Carrier::Table => "table",
            Carrier::Head => "head",
        };
        let when = match axis.motion {
            RotaryMotion::Indexed { step } if step > 0.0 => format!(", indexed by {} degrees", step.to_degrees()),
            RotaryMotion::Indexed { .. } => ", indexed".to_owned(),
            RotaryMotion::Continuous | RotaryMotion::Absent => String::new(),
        };
        Some(format!("{} ({carrier}{when})", axis.letter))
    });
    let names: Vec<String> = names.collect();
    if names.is_empty() { "no rotary axis".to_owned() } else { names.join(", ") }
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

/// Where the axes stand in the `index`-th of positions that fill their travels evenly.
fn position(machine: &Machine, index: usize) -> AxisPosition {
    let share = |base: usize| halton(index + 1, base);
    let linear = |k: usize, base| machine.linear[k].min + (machine.linear[k].max - machine.linear[k].min) * share(base);
    let rotary = |k: usize, base| match machine.rotary[k].travel {
        Travel::Limited { min, max } => min + (max - min) * share(base),
        Travel::Unlimited | Travel::Wrapped => TAU * share(base),
    };
    AxisPosition { linear: [linear(0, 2), linear(1, 3), linear(2, 5)], rotary: [rotary(0, 7), rotary(1, 11)] }
}

/// Poses that the machine takes up with its axes anywhere within their limits, through inverse and forward again.
fn agreement(setup: &Setup) -> (f64, f64) {
    let machine = setup.machine();
    let (mut tip, mut axis): (f64, f64) = (0.0, 0.0);
    for index in 0..POSES {
        let axes = position(machine, index);
        let pose = setup.forward(&axes);
        let Ok(solutions) = setup.inverse(&pose) else { return (f64::INFINITY, f64::INFINITY) };
        for axes in solutions.branches {
            let back = setup.forward(&axes);
            tip = tip.max((back.tip - pose.tip).norm());
            axis = axis.max(back.axis_angle(&pose));
        }
    }
    (tip, axis)
}

fn reachable_share(setup: &Setup) -> f64 {
    (0..POSES).filter(|index| ways(setup, direction(*index)) != Ways::None).count() as f64 / POSES as f64
}

/// What the rotary axes do for the tool, in words.
fn reach_in_words(setup: &Setup, share: f64) -> String {
    let machine = setup.machine();
    let present: Vec<_> = machine.rotary.iter().filter(|axis| axis.is_present()).collect();
    match present[..] {
        [] => "the tool axis stands still".into(),
        [only] => {
            let angle = only.direction.angle(&machine.spindle.axis).to_degrees();
            format!("the tool axis stays {angle:.3} degrees from axis {} and turns about it", only.letter)
        }
        _ => {
            let [low, high] = setup.reach().map(f64::to_degrees);
            format!(
                "tool axes {low:.3} to {high:.3} degrees from axis {}; {:.1} % of all directions lie within the limits",
                machine.rotary[machine.chain[0]].letter,
                100.0 * share
            )
        }
    }
}

/// Whether a tool of some length comes to the part's zero from some direction with every axis within its limits.
fn reaches(machine: &Machine, offset: [f64; 3]) -> bool {
    let zero = |axis: Direction| Pose { tip: Point::origin(), axis };
    let around = (0..POSES).step_by(POSES / DIRECTIONS).map(direction);
    let directions: Vec<Direction> = std::iter::once(machine.spindle.axis).chain(around).collect();
    let inside = |axes: &AxisPosition| {
        let linear = machine.linear.iter().zip(axes.linear).all(|(axis, at)| (axis.min..=axis.max).contains(&at));
        linear && machine.rotary.iter().zip(axes.rotary).all(|(axis, angle)| fits(axis.travel, angle))
    };
    LENGTHS.iter().any(|length| {
        Setup::at(machine, offset, *length).is_ok_and(|setup| {
            let made =
                |axis: &Direction| setup.inverse(&zero(*axis)).is_ok_and(|found| found.branches.iter().any(inside));
            directions.iter().any(made)
        })
    })
}

/// Bodies that overlap wherever the axes stand within their limits.
fn overlaps(setup: &Setup) -> Result<Vec<String>> {
    let scene = Scene::new(setup)?;
    let positions: Vec<AxisPosition> = (0..STANDS).map(|index| position(setup.machine(), index)).collect();
    let bodies = &setup.machine().bodies;
    let told = |pair: usize| {
        let [a, b] = scene.names(pair);
        let places = [a, b].map(|name| bodies.iter().find(|body| body.name == name).map_or(0, |body| body.line));
        let file = bodies.first().map_or("", |body| body.file.as_str());
        format!(
            "bodies {a} ({file}:{}) and {b} ({file}:{}) overlap wherever the axes stand: place them with every axis at \
             zero, or let them move with one axis or with neighbours",
            places[0], places[1]
        )
    };
    Ok(scene.always_overlapping(&positions).into_iter().map(told).collect())
}

/// A warning where programs written for the machine go home to places that its file does not give: they are followed to
/// zero then, wherever the machine goes.
fn homes(machine: &Machine) -> Option<String> {
    const HOMING: [(&str, usize); 2] = [("G28", 1), ("G30", 2)];
    let (control, templates) = (&machine.control, &machine.control.templates);
    let texts = [&templates.header, &templates.retract, &templates.tool_call, &templates.approach, &templates.end];
    let texts = texts.into_iter().flatten().map(|template| &template.text);
    let lines: Vec<&String> = control.options.retract_lines.iter().chain(texts).collect();
    let written = |code: &str| {
        let goes_on =
            |text: &str, at: usize| text.get(at..).is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
        lines.iter().any(|text| text.match_indices(code).any(|(at, _)| !goes_on(text, at + code.len())))
    };
    let missing = |(code, needed): &&(&str, usize)| control.reference_positions.len() < *needed && written(code);
    let (code, needed) = HOMING.iter().find(missing)?;
    Some(format!(
        "warning: programs go home by {code}, and control.reference_positions does not say where that is: it is taken for \
         zero. Give {needed} of X, Y, Z, mm, and the rotary axes, degrees, such as [[0, 0, 500, 0, 0]]"
    ))
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
    for offset in &control.work_offsets {
        if !reaches(machine, offset.linear) {
            found.push(format!(
                "{} puts the part's zero where no tool of up to {} mm reaches it within the limits",
                offset.name,
                LENGTHS[LENGTHS.len() - 1]
            ));
        }
    }
    for axis in machine.rotary.iter().filter(|axis| axis.is_present()) {
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
            assert!(report.is_sound(), "{name}: {:?}", report.contradictions);
            assert!(report.tip_error <= AGREEMENT.0 && report.axis_error <= AGREEMENT.1);
        }
    }

    /// Programs begin there and end there: a spindle that stood lower could go through the part on the first way.
    #[test]
    fn spindles_of_machines_that_come_along_go_home_to_their_upper_end() {
        for (name, _) in super::super::BUILTIN {
            let machine = Machine::named(name).unwrap();
            if machine.control.options.retract_lines.iter().any(|line| line.contains("G28")) {
                let home = machine.control.reference_positions.first().map_or(0.0, |position| position[2]);
                assert_eq!(home, machine.linear[2].max, "{name}");
            }
        }
    }

    #[test]
    fn homes_that_the_file_does_not_give_are_warned_of() {
        let warned = |lines: &[&str], positions: usize| {
            let mut machine = Machine::named("trunnion-ac-30i").unwrap();
            machine.control.options.retract_lines = lines.iter().map(|line| (*line).to_owned()).collect();
            machine.control.reference_positions.resize(positions, [0.0; 5]);
            let report = check(&machine).unwrap();
            assert!(report.is_sound());
            report.lines.iter().any(|line| line.starts_with("warning: programs go home"))
        };
        assert!(warned(&["G91 G28 Z0."], 0) && warned(&["G91G28Z0"], 0) && warned(&["G91 G30 Z0."], 1));
        assert!(!warned(&["G91 G28 Z0."], 1) && !warned(&["G91 G30 Z0."], 2));
        assert!(!warned(&["G53 G0 Z0."], 0) && !warned(&["G281"], 0) && !warned(&[], 0));
        for (name, _) in super::super::BUILTIN {
            assert_eq!(homes(&Machine::named(name).unwrap()), None, "{name}");
        }
    }

    #[test]
    fn poles_lie_along_the_axis_nearer_the_part() {
        let poles = |name: &str| check(&Machine::named(name).unwrap()).unwrap().poles;
        for name in ["xyzac-trt", "bridgemill", "head-b-table-c", "dmg-dmu80p-duoblock", "tr-35", "haas-umc-750"] {
            assert!((poles(name)[0].z - 1.0).abs() < 1e-12, "{name}");
        }
        assert!((poles("pocket-nc-v2")[0].y - 1.0).abs() < 1e-12);
        assert!(poles("four-axis-a").is_empty());
    }

    #[test]
    fn machines_with_fewer_axes_are_sound_too() {
        let report = check(&Machine::named("four-axis-a").unwrap()).unwrap();
        assert!(report.lines.iter().any(|line| line == "chain from part to tool: A (table)"), "{:?}", report.lines);
        assert!(report.lines.iter().any(|line| line.contains("stays 90.000 degrees from axis A")));
        // A great circle runs through two columns of every row.
        let rows = |row| (0..72).filter(|column| report.map.at(row, *column) != Ways::None).count();
        assert!((1..35).all(|row| (2..=4).contains(&rows(row))), "{}", report.map.text());
        let mut plain = Machine::named("four-axis-a").unwrap();
        plain.rotary[0].motion = RotaryMotion::Absent;
        plain.rotary[0].travel = Travel::Limited { min: 0.0, max: 0.0 };
        let report = check(&plain).unwrap();
        assert!(report.is_sound() && report.lines.iter().any(|line| line.contains("stands still")));
    }

    #[test]
    fn pictures_show_the_map() {
        // A from -120 to 30 degrees: both branches within 30 degrees of the pole, one up to 120, none beyond.
        let map = check(&Machine::named("mazak-variaxis-630").unwrap()).unwrap().map;
        for row in 0..36 {
            let expected = match row {
                0..6 => Ways::Both,
                6..24 => Ways::One,
                _ => Ways::None,
            };
            assert!((0..72).all(|column| map.at(row, column) == expected), "{row}");
        }
        let text = map.text();
        assert_eq!(map.tilts(), [120.0, 120.0]);
        let rows: Vec<&str> = text.lines().skip(2).collect();
        assert!(rows[2].ends_with(&"#".repeat(72)) && rows[3].ends_with(&"+".repeat(72)), "{text}");
        assert!(rows[0].contains('O') && rows[17].ends_with(&".".repeat(72)));
        let svg = map.svg("a < b & c");
        assert_eq!(svg.matches("<polygon").count(), 36 * 72);
        assert!(svg.contains("a &lt; b &amp; c") && svg.matches("<circle").count() == 1);
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
        // Inside the travels, but below where the longest tool ends.
        let mut machine = Machine::named("dmg-dmu50-evolution").unwrap();
        machine.control.work_offsets[0].linear = [0.0, 0.0, -350.0];
        let report = check(&machine).unwrap();
        let said = "G54 puts the part's zero where no tool of up to 400 mm reaches it";
        assert!(report.contradictions.iter().any(|c| c.contains(said)), "{:?}", report.contradictions);
    }
}
