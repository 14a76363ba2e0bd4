//! Links against the kinematics of the tip, and the bound on accelerations against samples.

use super::*;
use crate::machine::BUILTIN;
use proptest::prelude::*;

fn axes() -> impl Strategy<Value = AxisPosition> {
    (prop::array::uniform3(-200.0..200.0), prop::array::uniform2(-2.0..2.0))
        .prop_map(|(linear, rotary)| AxisPosition { linear, rotary })
}

/// Axes that the machine does not have stand at zero.
fn standing(setup: &Setup, axes: AxisPosition) -> AxisPosition {
    let present = setup.machine().rotary.each_ref().map(|axis| axis.is_present());
    AxisPosition { rotary: [0, 1].map(|k: usize| if present[k] { axes.rotary[k] } else { 0.0 }), ..axes }
}

fn setup(index: usize, on: [Carrier; 3]) -> Setup {
    let mut machine = Machine::named(BUILTIN[index].0).unwrap();
    for (axis, on) in machine.linear.iter_mut().zip(on) {
        axis.on = on;
    }
    machine.linear_order = [1, 0, 2];
    Setup::at(&machine, [30.0, -20.0, 10.0], 120.0).unwrap()
}

fn carriers() -> impl Strategy<Value = [Carrier; 3]> {
    prop::array::uniform3(prop_oneof![Just(Carrier::Table), Just(Carrier::Head)])
}

proptest! {
    /// Whatever the linear axes carry, the spindle's link brings the tip where the kinematics say.
    #[test]
    fn spindle_and_table_agree_with_the_tip(index in 0..BUILTIN.len(), on in carriers(), axes in axes()) {
        let setup = setup(index, on);
        let axes = standing(&setup, axes);
        let motion = setup.seen_from_part(Link::Spindle, &axes);
        let pose = setup.forward(&axes);
        let tip = motion * Point::from(setup.tip_at_zero());
        prop_assert!((tip - pose.tip).norm() < 1e-9);
        prop_assert!((motion * setup.machine().spindle.axis.into_inner() - pose.axis.into_inner()).norm() < 1e-12);
    }

    /// Between any two links every point of the ball keeps to its chords within the bound.
    #[test]
    fn points_of_links_stay_within_the_bound(
        index in 0..BUILTIN.len(), on in carriers(), from in axes(), to in axes(), tip in any::<bool>(),
        links in prop::array::uniform2(0_usize..7), point in prop::array::uniform3(-50.0..50.0), shrink in 0.01..1.0
    ) {
        let setup = setup(index, on);
        let (from, to) = (standing(&setup, from), standing(&setup, from.interpolate(&to, shrink)));
        let poses = [from, to].map(|axes| setup.forward(&axes));
        let course = Hop { setup: &setup, ends: [from, to], tips: tip.then_some(poses.map(|pose| pose.tip)) };
        let link = |k: usize| match k {
            0..3 => Link::Linear(k),
            3 if setup.machine().rotary[0].is_present() => Link::Rotary(0),
            4 if setup.machine().rotary[1].is_present() => Link::Rotary(1),
            5 => Link::Table,
            6 => Link::Spindle,
            _ => Link::Base,
        };
        let places = links.map(|k| Place::of(setup.machine(), link(k)));
        let centre = Point::new(10.0, 20.0, 30.0);
        let bound = setup.acceleration([&places[0], &places[1]], (centre, 87.0), &course);
        let at = |share: f64| {
            let axes = course.axes(share);
            setup.placed(&places[1], &axes).inverse() * setup.placed(&places[0], &axes) * (centre + Vector::from(point))
        };
        let (start, end) = (at(0.0), at(1.0));
        for k in 1..10 {
            let share = f64::from(k) / 10.0;
            let off = (at(share) - (start + (end - start) * share)).norm();
            prop_assert!(off <= bound / 8.0 + 1e-9, "{off} {bound}");
        }
    }
}
