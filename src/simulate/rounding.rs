//! Corners that a program lets the control round: how far rotary axes and tool may leave the programmed way there. Uses
//! `geometry` and `machine`.
//!
//! The tolerance that a program gives (G64 P) bounds the linear axes. A control that begins a block before the one before
//! has ended moves every axis by the sum of both: overlapped by a length d of the way, a rotary axis is off by d times the
//! change of its turn per length. Blocks overlap by the whole of the shorter one at most, so that
//! `delta = min(La, Lb) |turn_b / Lb - turn_a / La|`. Where the program says how far the control lets them go (the third
//! argument of CYCLE832, TA of cycle 32), or the machine file does, that holds; the machine file first.

use super::segment::{Path, Segment};
use crate::geometry::Vector;
use crate::machine::{AxisPosition, Setup};
use crate::motion::Pose;
use rayon::prelude::*;

/// Where corners may be rounded, and by how much.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Rounding {
    /// Largest tolerance of the linear axes, mm.
    pub(super) tolerance: f64,
    /// The corners.
    pub(super) corners: Vec<Corner>,
}

/// A corner that may be rounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    /// Index of the segment that begins there.
    pub(super) segment: usize,
    /// How far the program lets each rotary axis leave its way, radians, where it says so.
    pub(super) rotary: Option<f64>,
}

/// The tool between two heights above its tip and within a radius, mm.
#[derive(Clone, Copy, Debug)]
pub struct ToolReach {
    /// Lowest and highest.
    pub heights: (f64, f64),
    /// Largest.
    pub radius: f64,
}

impl Rounding {
    /// How far a rotary axis may be off at most, radians.
    pub(super) fn rotary(&self, setup: &Setup, segments: &[Segment]) -> f64 {
        let most =
            |corner: &Corner, ends: [&Segment; 2]| departures(setup, corner, ends).into_iter().fold(0.0, f64::max);
        self.most(segments, most)
    }

    /// How far any point of the tool may be off because rotary axes are, mm; less by what is `clear` about it at the
    /// corner where a segment begins.
    pub(super) fn at_tool(
        &self,
        setup: &Setup,
        segments: &[Segment],
        reach: &ToolReach,
        clear: impl Fn(usize) -> f64 + Sync,
    ) -> f64 {
        let moved = |corner: &Corner, ends: [&Segment; 2]| {
            let [_, after] = ends;
            let off = departures(setup, corner, ends).into_iter().enumerate();
            let moved =
                off.map(|(slot, by)| if by > 0.0 { displacement(setup, after, (slot, by), reach) } else { 0.0 });
            moved.sum::<f64>() - clear(corner.segment)
        };
        self.most(segments, moved)
    }

    fn most(&self, segments: &[Segment], of: impl Fn(&Corner, [&Segment; 2]) -> f64 + Sync) -> f64 {
        let at = |corner: &Corner| {
            let before = segments.get(corner.segment.checked_sub(1)?)?;
            Some(of(corner, [before, segments.get(corner.segment)?]))
        };
        self.corners.par_iter().filter_map(at).reduce(|| 0.0, f64::max)
    }
}

/// How far each rotary axis may leave its way at the corner between two segments, radians.
fn departures(setup: &Setup, corner: &Corner, ends: [&Segment; 2]) -> [f64; 2] {
    let lengths = ends.map(length);
    let given = setup.machine().control.options.rounding_rotary.or(corner.rotary);
    std::array::from_fn(|slot| {
        let [a, b] = ends.map(|segment| segment.to.rotary[slot] - segment.from.rotary[slot]);
        match given {
            Some(most) => {
                if a == 0.0 && b == 0.0 {
                    0.0
                } else {
                    most
                }
            }
            None => departure([a, b], lengths),
        }
    })
}

/// The same of one axis, by its turns and the lengths of both blocks.
fn departure([a, b]: [f64; 2], [before, after]: [f64; 2]) -> f64 {
    match (before > 0.0, after > 0.0) {
        (true, true) => before.min(after) * (b / after - a / before).abs(),
        // A block that only turns may be over before the other one ends, or not begun.
        (true, false) => b.abs(),
        (false, true) => a.abs(),
        (false, false) => a.abs().max(b.abs()),
    }
}

/// Way of the linear words, mm.
fn length(segment: &Segment) -> f64 {
    match &segment.path {
        Path::Joints => (Vector::from(segment.to.linear) - Vector::from(segment.from.linear)).norm(),
        Path::JointArc(arc) | Path::TipArc(arc) => arc.length(),
        Path::Tip { from, to } => (to - from).norm(),
        Path::Vector { from, to } => (to.tip - from.tip).norm(),
    }
}

/// How far the tool goes when a rotary axis is off by an angle, either way, where a segment begins, mm. With TCP on the
/// control keeps the tip.
fn displacement(setup: &Setup, segment: &Segment, (slot, by): (usize, f64), reach: &ToolReach) -> f64 {
    let pose = segment.pose(setup, 0.0);
    let moved = |angle: f64| {
        let mut axes: AxisPosition = segment.from;
        axes.rotary[slot] += angle;
        let off = match &segment.path {
            Path::Joints | Path::JointArc(_) => setup.forward(&axes),
            Path::Tip { .. } | Path::TipArc(_) | Path::Vector { .. } => {
                Pose { tip: pose.tip, axis: setup.axis(axes.rotary) }
            }
        };
        let apart = |height: f64| (off.at_height(height) - pose.at_height(height)).norm();
        let turned = (off.axis.into_inner() - pose.axis.into_inner()).norm();
        apart(reach.heights.0).max(apart(reach.heights.1)) + reach.radius * turned
    };
    // Beyond half a turn it comes back.
    let most = by.min(std::f64::consts::PI);
    moved(most).max(moved(-most))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::machine::Machine;
    use crate::simulate::SegmentKind;
    use proptest::prelude::*;

    fn setup(given: Option<f64>) -> Setup {
        let mut machine = Machine::named("xyzac-trt").unwrap();
        machine.control.options.rounding_rotary = given;
        Setup::at(&machine, [3.0, -4.0, 5.0], 100.0).unwrap()
    }

    fn segment(from: AxisPosition, to: AxisPosition) -> Segment {
        Segment {
            line: 1,
            kind: SegmentKind::Feed,
            start: 0.0,
            duration: 1.0,
            programmed: 1.0,
            from,
            to,
            path: Path::Joints,
        }
    }

    fn axes(x: f64, tilt: f64, turn: f64) -> AxisPosition {
        AxisPosition { linear: [x, 0.0, 0.0], rotary: [tilt, turn] }
    }

    fn path(places: &[AxisPosition]) -> (Vec<Segment>, Rounding) {
        let segments: Vec<Segment> = places.windows(2).map(|pair| segment(pair[0], pair[1])).collect();
        let corners = (1..segments.len()).map(|segment| Corner { segment, rotary: None }).collect();
        (segments, Rounding { tolerance: 0.01, corners })
    }

    #[test]
    fn turns_in_step_with_the_way_leave_nothing_to_round() {
        let (segments, rounding) = path(&[axes(0.0, 0.1, 0.0), axes(2.0, 0.1, 0.02), axes(3.0, 0.1, 0.03)]);
        assert!(rounding.rotary(&setup(None), &segments) < 1e-15);
        let reach = ToolReach { heights: (0.0, 30.0), radius: 5.0 };
        assert!(rounding.at_tool(&setup(None), &segments, &reach, |_| 0.0) < 1e-12);
        assert!(rounding.at_tool(&setup(Some(0.001)), &segments, &reach, |_| 0.0) > 1e-3);
        assert_eq!(rounding.at_tool(&setup(Some(0.001)), &segments, &reach, |_| 1.0), 0.0);
    }

    #[test]
    fn a_bend_of_the_turn_counts_with_the_shorter_block() {
        assert_eq!(departure([0.25, 0.75], [1.0, 1.0]), 0.5);
        assert_eq!(departure([0.25, 1.5], [1.0, 2.0]), 0.5);
        // Only turning, before or after a way.
        assert_eq!((departure([0.2, 0.1], [0.0, 1.0]), departure([0.2, 0.1], [1.0, 0.0])), (0.2, 0.1));
        assert_eq!(departure([0.2, -0.1], [0.0, 0.0]), 0.2);
    }

    #[test]
    fn the_machine_file_has_the_last_word_on_axes_that_turn() {
        let (segments, rounding) = path(&[axes(0.0, 0.0, 0.0), axes(1.0, 0.0, 0.0), axes(2.0, 0.0, 0.5)]);
        assert!((rounding.rotary(&setup(None), &segments) - 0.5).abs() < 1e-15);
        assert_eq!(rounding.rotary(&setup(Some(0.001)), &segments), 0.001);
        assert_eq!(rounding.rotary(&setup(Some(0.0)), &segments), 0.0);
        let said = Corner { segment: 1, rotary: Some(0.02) };
        let ends = [&segments[0], &segments[1]];
        assert_eq!(departures(&setup(None), &said, ends), [0.0, 0.02]);
        assert_eq!(departures(&setup(Some(0.001)), &said, ends), [0.0, 0.001]);
    }

    proptest! {
        /// Two blocks laid over each other, by any share of either: no axis, and no point of the tool, is farther from the
        /// way at the same length than what is said.
        #[test]
        fn blocks_laid_over_each_other_stay_within_the_band(
            (first, second) in (0.1..3.0, 0.1..3.0), turns in prop::array::uniform4(-0.02..0.02),
            (left, tcp) in (0.0..1.0, any::<bool>()), height in 0.0..30.0,
        ) {
            let setup = setup(None);
            let places = [axes(0.0, 0.3, 0.1), axes(first, 0.3 + turns[0], 0.1 + turns[1])];
            let end = axes(first + second, places[1].rotary[0] + turns[2], places[1].rotary[1] + turns[3]);
            let (mut segments, rounding) = path(&[places[0], places[1], end]);
            let tip = |x: f64| Point::new(x, 0.0, 0.0);
            if tcp {
                segments[0].path = Path::Tip { from: tip(0.0), to: tip(first) };
                segments[1].path = Path::Tip { from: tip(first), to: tip(first + second) };
            }
            // As much of the first is left as the second has gone ahead: the linear axes are where the way bends.
            let overlap = left * f64::min(first, second);
            let rotary = std::array::from_fn(|k| {
                places[1].rotary[k] - turns[k] * overlap / first + turns[k + 2] * overlap / second
            });
            let off = AxisPosition { linear: places[1].linear, rotary };
            let pose = |axes: &AxisPosition| if tcp { Pose { tip: tip(first), axis: setup.axis(axes.rotary) } } else { setup.forward(axes) };
            let most = rounding.rotary(&setup, &segments);
            for (off, place) in rotary.iter().zip(places[1].rotary) {
                prop_assert!((off - place).abs() <= most + 1e-12);
            }
            let reach = ToolReach { heights: (0.0, 30.0), radius: 0.0 };
            let apart = (pose(&off).at_height(height) - pose(&places[1]).at_height(height)).norm();
            // The displacement of both axes together is that of each to first order.
            let band = rounding.at_tool(&setup, &segments, &reach, |_| 0.0);
            prop_assert!(apart <= band * 1.05 + 1e-9, "{apart} {band}");
        }
    }
}
