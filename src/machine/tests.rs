//! Kinematics against the published closed forms of the controls, and against themselves.

use super::*;
use crate::geometry::{Direction, Point, Vector};
use crate::motion::Pose;
use nalgebra::Matrix3;
use proptest::prelude::*;

/// A small repeatable random sequence (Weyl sequence with a mixing step), uniform in 0..1.
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(super) fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(super) fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    fn direction(&mut self) -> Direction {
        let z = self.within(-1.0, 1.0);
        let (sin, cos) = self.within(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Direction::new_normalize(Vector::new(r * cos, r * sin, z))
    }

    fn point(&mut self, size: f64) -> Point {
        Point::new(self.within(-size, size), self.within(-size, size), self.within(-size, size))
    }
}

fn about_x(degrees: f64) -> Matrix3<f64> {
    let (s, c) = degrees.to_radians().sin_cos();
    Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c)
}

fn about_y(degrees: f64) -> Matrix3<f64> {
    let (s, c) = degrees.to_radians().sin_cos();
    Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
}

fn about_z(degrees: f64) -> Matrix3<f64> {
    let (s, c) = degrees.to_radians().sin_cos();
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

/// Joints from the tip in machine coordinates (world less tool length), rotary words and tool length, and the tool axis
/// in work coordinates, as each LinuxCNC module computes them.
type Formula = fn(Vector, [f64; 2], f64) -> (Vector, Vector);

fn xyzac(tip: Vector, [a, c]: [f64; 2], length: f64) -> (Vector, Vector) {
    let (rot, off) = (Vector::new(5.0, -7.0, 30.0), Vector::new(0.0, 20.0, 10.0));
    let nose = about_x(a) * (about_z(c) * (tip - rot) - off) + off + rot + Vector::z() * length;
    let (a, c) = (a.to_radians(), c.to_radians());
    (nose, Vector::new(a.sin() * c.sin(), a.sin() * c.cos(), a.cos()))
}

fn xyzbc(tip: Vector, [b, c]: [f64; 2], length: f64) -> (Vector, Vector) {
    let (rot, off) = (Vector::new(5.0, -7.0, 30.0), Vector::new(20.0, 0.0, 10.0));
    let nose = about_y(b) * (about_z(c) * (tip - rot) - off) + off + rot + Vector::z() * length;
    let (b, c) = (b.to_radians(), c.to_radians());
    (nose, Vector::new(-b.sin() * c.cos(), b.sin() * c.sin(), b.cos()))
}

fn five_axis(tip: Vector, [b, c]: [f64; 2], length: f64) -> (Vector, Vector) {
    let pivot = 250.0;
    let nose = tip + about_z(c) * about_y(-b) * Vector::z() * (pivot + length) - Vector::z() * pivot;
    let (b, c) = (b.to_radians(), c.to_radians());
    (nose, Vector::new(-b.sin() * c.cos(), -b.sin() * c.sin(), b.cos()))
}

/// World and tip are the same here: the tool length is part of the pivot length, and no G43 is in force.
fn maxkins(tip: Vector, [b, c]: [f64; 2], length: f64) -> (Vector, Vector) {
    let pivot = 100.0 + length;
    let nose = about_z(-c) * tip + about_y(-b) * Vector::z() * pivot - Vector::z() * pivot;
    (nose, about_z(c) * about_y(-b) * Vector::z())
}

const MACHINES: [(&str, Formula); 4] =
    [("xyzac-trt", xyzac), ("xyzbc-trt", xyzbc), ("bridgemill", five_axis), ("head-b-table-c", maxkins)];

#[test]
fn machines_that_come_along_are_valid_and_named_as_their_files() {
    for (name, _) in BUILTIN {
        assert_eq!(Machine::named(name).unwrap().name, name);
    }
}

#[test]
fn four_machines_match_the_formulas_of_their_control() {
    let mut random = Random::new(1);
    for (name, formula) in MACHINES {
        let machine = Machine::named(name).unwrap();
        for _ in 0..2000 {
            let offset = random.point(100.0).coords;
            let length = random.within(0.0, 150.0);
            let words = ProgramWords {
                linear: random.point(300.0).coords.into(),
                rotary: [random.within(-120.0, 120.0), random.within(-720.0, 720.0)],
            };
            let setup = Setup::at(&machine, offset.into(), length).unwrap();
            let (nose, axis) = formula(Vector::from(words.linear) + offset, words.rotary, length);
            let axes = setup.axes_from_tcp_words(&words, &AxisPosition::default());
            let pose = setup.forward(&axes);
            // 1e-12 relative to the machine's size of 1 m.
            assert!((Vector::from(axes.linear) - nose).norm() < 1e-12 * 1e3, "{name} {words:?}");
            assert!((pose.axis.into_inner() - axis).norm() < 1e-12, "{name} {words:?}");
            assert!((pose.tip.coords - Vector::from(words.linear)).norm() < 1e-12 * 1e3, "{name} {words:?}");
        }
    }
}

#[test]
fn words_without_tcp_are_axes_less_offset_and_length() {
    let machine = Machine::named("xyzac-trt").unwrap();
    let setup = Setup::at(&machine, [1.0, 2.0, 3.0], 100.0).unwrap();
    let axes = AxisPosition { linear: [11.0, 22.0, 133.0], rotary: [0.5, -7.0] };
    let words = setup.joint_words(&axes);
    assert_eq!(words.linear, [10.0, 20.0, 30.0]);
    let back = setup.axes_from_joint_words(&words, &AxisPosition::default());
    assert!((back.rotary[1] + 7.0).abs() < 1e-14 && back.linear == axes.linear);
}

/// Worst distance of tips, mm, and angle of axes, radians, after inverse and forward.
fn round_trip(setup: &Setup, pose: &Pose) -> Option<(f64, f64)> {
    let solutions = setup.inverse(pose).ok()?;
    let errors = solutions.branches.map(|axes| {
        let back = setup.forward(&axes);
        ((back.tip - pose.tip).norm(), back.axis_angle(pose))
    });
    Some((errors[0].0.max(errors[1].0), errors[0].1.max(errors[1].1)))
}

#[test]
fn forward_undoes_inverse_on_a_hundred_thousand_poses_a_machine() {
    let mut random = Random::new(2);
    for (name, _) in MACHINES {
        let setup = Setup::new(&Machine::named(name).unwrap(), "G54", 120.0).unwrap();
        let (mut tip, mut angle): (f64, f64) = (0.0, 0.0);
        for i in 0..100_000 {
            // One pose in four lies within 10^-1 ... 10^-13 of a pole.
            let mut axis = random.direction();
            if i % 4 == 0 {
                let pole = if i % 8 == 0 { Vector::z() } else { -Vector::z() };
                axis = Direction::new_normalize(pole + axis.into_inner() * 10f64.powf(random.within(-13.0, -1.0)));
            }
            let pose = Pose { tip: random.point(300.0), axis };
            let (tip_error, angle_error) = round_trip(&setup, &pose).unwrap();
            tip = tip.max(tip_error);
            angle = angle.max(angle_error);
        }
        println!("{name}: round trip {tip:.2e} mm, {angle:.2e} rad");
        assert!(tip <= 1e-9 && angle <= 1e-10, "{name}: {tip} mm, {angle} rad");
    }
}

fn vector() -> impl Strategy<Value = Vector> {
    (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64)
        .prop_map(|(x, y, z)| Vector::new(x, y, z))
        .prop_filter("needs a length", |v| v.norm() > 0.1)
}

prop_compose! {
    /// Any machine: two rotary axes in any directions, on either side, with any pivots, and skewed linear axes.
    fn any_machine()(
        first in vector(),
        second in vector(),
        skew in vector(),
        pivots in [vector(), vector()],
        sides in 0..4usize,
        reversed in 0..4usize,
        tip in any::<bool>(),
    ) -> Option<Machine> {
        let mut machine = Machine::named("xyzac-trt").ok()?;
        let spindle = machine.spindle.axis.into_inner();
        for (k, (direction, pivot)) in [first, second].into_iter().zip(pivots).enumerate() {
            machine.rotary[k].direction = Direction::new_normalize(direction);
            machine.rotary[k].pivot = Point::from(pivot * 300.0);
            machine.rotary[k].on = if sides >> k & 1 == 0 { Carrier::Table } else { Carrier::Head };
            machine.rotary[k].sense = if reversed >> k & 1 == 0 { Sense::Iso } else { Sense::Reversed };
        }
        machine.chain = if sides == 1 { [1, 0] } else { [0, 1] };
        machine.linear[0].direction = Direction::new_normalize(Vector::x() + skew * 0.05);
        machine.spindle.axis_zero = if tip { AxisZero::Tip } else { AxisZero::GaugePoint };
        let [e1, e2] = machine.chain.map(|k| machine.rotary[k].direction.into_inner());
        (e1.cross(&e2).norm() > 0.1 && e2.cross(&spindle).norm() > 0.1).then_some(machine)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Poses made by forward are reachable, one of the branches is where they came from, and both come back.
    #[test]
    fn any_two_rotary_axes_are_solved(machine in any_machine(), seed in any::<u64>()) {
        prop_assume!(machine.is_some());
        let setup = Setup::at(&machine.unwrap(), [10.0, 20.0, 30.0], 80.0).unwrap();
        let mut random = Random::new(seed);
        for _ in 0..50 {
            let axes = AxisPosition {
                linear: random.point(300.0).coords.into(),
                rotary: [random.within(-3.1, 3.1), random.within(-3.1, 3.1)],
            };
            let pose = setup.forward(&axes);
            let (tip, angle) = round_trip(&setup, &pose).unwrap();
            prop_assert!(tip <= 1e-9 && angle <= 1e-10, "{} mm {} rad at {:?}", tip, angle, axes);
            let near = setup.inverse_near(&pose, axes.rotary).unwrap();
            let distance = (0..2).map(|k| (near.rotary[k] - axes.rotary[k]).abs()).fold(0.0, f64::max);
            // Angles themselves are lost where the branches meet; elsewhere they come back.
            let both = setup.inverse(&pose).unwrap().branches.map(|b| b.rotary);
            let apart = (0..2).map(|k| (setup::unwind(both[0][k], both[1][k]) - both[1][k]).abs()).fold(0.0, f64::max);
            prop_assert!(distance < 1e-9 || distance * apart < 1e-9, "{} apart {}", distance, apart);
        }
    }

    /// A direction outside the reachable zone is refused with the angle by which it misses.
    #[test]
    fn unreachable_directions_say_by_how_much(machine in any_machine(), seed in any::<u64>()) {
        prop_assume!(machine.is_some());
        let machine = machine.unwrap();
        let setup = Setup::at(&machine, [0.0; 3], 0.0).unwrap();
        let [low, high] = setup.reach();
        let first = machine.rotary[machine.chain[0]].direction;
        let mut random = Random::new(seed);
        for _ in 0..50 {
            let pose = Pose { tip: Point::origin(), axis: random.direction() };
            let alpha = pose.axis.angle(&first);
            let miss = (low - alpha).max(alpha - high);
            match setup.inverse(&pose) {
                Ok(_) => prop_assert!(miss < 1e-9),
                Err(e) => prop_assert!((e.by - miss).abs() < 1e-6, "{} for {}", e.by, miss),
            }
        }
    }
}

#[test]
fn pole_leaves_the_first_axis_free() {
    let setup = Setup::new(&Machine::named("xyzac-trt").unwrap(), "G54", 100.0).unwrap();
    let pose = Pose { tip: Point::new(40.0, 0.0, 10.0), axis: Vector::z_axis() };
    assert_eq!(setup.inverse(&pose).unwrap().free, Some(1));
    for c in [0.0, 1.0, -4.0] {
        let back = setup.forward(&setup.with_rotary(&pose.tip, [0.0, c]));
        assert!((back.tip - pose.tip).norm() < 1e-12 && back.axis_angle(&pose) < 1e-15);
    }
}
