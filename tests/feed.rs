//! Programs keep the limits of the axes: whatever path, machine, control and feed they are written for, the simulation of
//! their text finds none passed.

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use regulus::geometry::{Direction, Point, Vector};
    use regulus::machine::{FeedMode, Machine, Setup};
    use regulus::motion::{FeedReference, Pass, PassKind, PassMotion, Pose, ToolPath, ToolSummary};
    use regulus::nc::{Rules, read};
    use regulus::pipeline::{PostRequest, Posted, post};
    use regulus::simulate::{LimitKind, LimitViolation, simulate};

    const LENGTH: f64 = 90.0;
    /// Machines that reach every pose tried here: tables, heads and both, on two controls.
    const MACHINES: [&str; 5] = ["bridgemill", "head-b-table-c", "trunnion-ac-30i", "xyzac-trt", "xyzbc-trt"];

    fn path(passes: Vec<Pass>, feed: f64) -> ToolPath {
        ToolPath {
            name: "feed".into(),
            tool: ToolSummary { number: 1, description: "test".into(), gauge_length: LENGTH, flute_length: 30.0 },
            cut_feed: feed,
            feed_reference: FeedReference::Mean,
            spindle_rpm: 8000.0,
            linearization: 0.005,
            overcut_tolerance: 0.01,
            undercut_tolerance: 0.01,
            passes,
        }
    }

    fn pose([x, y, z]: [f64; 3], [a, b]: [f64; 2]) -> Pose {
        Pose { tip: Point::new(x, y, z), axis: Direction::new_normalize(Vector::new(a, b, 1.0)) }
    }

    fn pass(kind: PassKind, poses: &[Pose]) -> Pass {
        Pass { kind, strip: Some(0), motion: PassMotion::Poses(poses.to_vec()) }
    }

    /// A program, and the limits that it passes, ends of travel left out.
    fn passed(path: &ToolPath, machine: &Machine) -> (Posted, Vec<LimitViolation>) {
        let work_offset = &machine.control.work_offsets[0];
        let name = &work_offset.name;
        let posted = post(&PostRequest { path, machine, work_offset: name, number: 1, input_hash: "" }).unwrap();
        let setup = Setup::new(machine, name, LENGTH).unwrap();
        let motion = simulate(&read(posted.text.as_bytes(), &Rules::of(machine)), &setup, Some(1.into()));
        assert!(!motion.findings().any_error(), "{:?}", motion.findings());
        let limits = motion.axis_report().limits;
        (posted, limits.into_iter().filter(|l| l.kind != LimitKind::Travel).collect())
    }

    fn with_jerk(machine: &mut Machine, factor: f64) {
        machine.linear.iter_mut().for_each(|axis| axis.jerk = Some(axis.acceleration * factor));
        machine.rotary.iter_mut().for_each(|axis| axis.jerk = Some(axis.acceleration * factor));
    }

    fn poses() -> impl Strategy<Value = Vec<Pose>> {
        let one = (prop::array::uniform3(-40.0..40.0), prop::array::uniform2(-0.6..0.6));
        prop::collection::vec(one.prop_map(|(tip, axis)| pose(tip, axis)), 2..7)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn no_program_passes_a_limit(
            poses in poses(), split in 0.0..1.0, machine in prop::sample::select(MACHINES.to_vec()), tcp: bool, per_minute: bool,
            feed in prop::sample::select(vec![300.0, 3000.0, 30_000.0]),
            jerk in prop::option::of(prop::sample::select(vec![10.0, 100.0])),
        ) {
            let mut machine = Machine::named(machine).unwrap();
            let options = &machine.control.options;
            machine.control.tcp = tcp || (options.tcp_at_start && options.tcp_off.is_none());
            if per_minute {
                machine.control.options.feed_mode = FeedMode::PerMinute;
            }
            if let Some(factor) = jerk {
                with_jerk(&mut machine, factor);
            }
            let split = (split * (poses.len() - 1) as f64) as usize;
            let path = path(vec![pass(PassKind::Rapid, &poses[..=split]), pass(PassKind::Cut, &poses[split..])], feed);
            let (_, limits) = passed(&path, &machine);
            prop_assert!(limits.is_empty(), "{limits:?}");
        }
    }

    /// A tool that turns with its tip nearly still makes the linear axes swing: the control watches only the tip.
    #[test]
    fn rapid_that_would_whirl_the_axes_is_fed() {
        let poses = [pose([0.0; 3], [0.1, 0.5]), pose([1.0, 0.0, 0.0], [-0.9, 0.5])];
        let cut = [poses[1], pose([20.0, 0.0, 0.0], [-0.9, 0.5])];
        let path = path(vec![pass(PassKind::Rapid, &poses), pass(PassKind::Cut, &cut)], 600.0);
        let mut machine = Machine::named("bridgemill").unwrap();
        machine.control.options.tcp_limits_axes = false;
        let (posted, limits) = passed(&path, &machine);
        assert_eq!(limits, []);
        let mut watchful = machine.clone();
        watchful.control.options.tcp_limits_axes = true;
        let (trusting, _) = passed(&path, &watchful);
        let fed = |posted: &Posted| posted.text.lines().filter(|line| line.contains(" F")).count();
        assert!(fed(&posted) > fed(&trusting), "{}", posted.text);
        // The same program on a control that does not watch is found out.
        let setup = Setup::new(&machine, "G54", LENGTH).unwrap();
        let motion = simulate(&read(trusting.text.as_bytes(), &Rules::of(&machine)), &setup, Some(1.into()));
        let limits = motion.axis_report().limits;
        assert!(limits.iter().any(|l| l.kind == LimitKind::Speed && l.value > 1.01 * l.limit), "{limits:?}");
    }

    /// Blocks so short that the largest feed word is too slow for them brake their neighbours, too.
    #[test]
    fn ceiling_of_the_feed_word_is_reckoned_with() {
        let mut machine = Machine::named("trunnion-ac-30i").unwrap();
        machine.control.tcp = false;
        machine.control.options.inverse_time_range = [0.001, 600.0];
        let at = |x: f64| pose([x, 0.0, 0.0], [0.2, 0.3]);
        let poses = [at(0.0), at(30.0), at(30.001), at(60.0)];
        let path = path(vec![pass(PassKind::Cut, &poses)], 20_000.0);
        let (posted, limits) = passed(&path, &machine);
        assert_eq!(limits, []);
        assert!(!posted.slowed.is_empty() && posted.losses.iter().any(|loss| loss.seconds > 0.0), "{posted:?}");
    }
}
