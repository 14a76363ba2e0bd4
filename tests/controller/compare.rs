//! The controller's samples against this project's kinematics and its motion of the same program.

use crate::rig::{Kind, Sample};
use regulus::geometry::Vector;
use regulus::machine::{AxisPosition, AxisZero, ProgramWords, Setup};
use regulus::motion::Pose;
use regulus::nc::Findings;
use regulus::simulate::{Path, Segment, SegmentKind, ToolMotion};

/// Cycles after which a change of tool length or kinematics has reached the joints.
const SETTLED: usize = 6;
/// Cycles over which the joints follow a jump of the world position.
const SPREAD: usize = 3;

/// Seconds between samples.
const CYCLE: f64 = 1e-3;

/// A difference of lengths, mm, and one of angles, degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Difference {
    pub(crate) mm: f64,
    pub(crate) degrees: f64,
}

/// Nothing to compare with.
const NOWHERE: Difference = Difference { mm: f64::INFINITY, degrees: f64::INFINITY };

impl Difference {
    fn raise(&mut self, mm: f64, radians: f64) {
        assert!(!mm.is_nan() && !radians.is_nan());
        self.mm = self.mm.max(mm);
        self.degrees = self.degrees.max(radians.to_degrees());
    }

    /// One number to choose the nearest by.
    fn sum(&self) -> f64 {
        self.mm + self.degrees
    }

    /// Whether both are at most `limit`.
    pub(crate) fn within(&self, limit: f64) -> bool {
        self.mm <= limit && self.degrees <= limit
    }
}

/// Where the axes stand, by our inverse kinematics, at a sample's world position.
fn axes(setup: &Setup, sample: &Sample) -> AxisPosition {
    if !sample.tcp {
        return sample.world;
    }
    let ([x, y, z], offset) = (sample.world.linear, setup.work_offset());
    let words = ProgramWords {
        linear: [x - offset[0], y - offset[1], z - sample.tool - offset[2]],
        rotary: sample.world.rotary.map(f64::to_degrees),
    };
    setup.axes_from_tcp_words(&words, &sample.world)
}

/// Largest difference between the joints that the controller commands and those that our inverse kinematics makes of its
/// world positions, and the number of samples compared. Its joints are a cubic spline through them: a joint is the mean
/// of the last three world positions but one, each brought through the inverse kinematics, in the ratio 1 : 4 : 1.
pub(crate) fn joints(setup: &Setup, samples: &[Sample]) -> (Difference, usize) {
    let ours: Vec<[f64; 5]> = samples.iter().map(|sample| axes(setup, sample).values()).collect();
    let called = match setup.machine().spindle.axis_zero {
        AxisZero::GaugePoint => setup.tool_length(),
        AxisZero::Tip => 0.0,
    };
    let (mut worst, mut compared) = (Difference::default(), 0);
    for index in SETTLED..samples.len() {
        let state = |sample: &Sample| (sample.tool, sample.tcp);
        let (tool, tcp) = state(&samples[index]);
        // Where tool length or kinematics change, world positions jump and joints stay; and our setup holds the tool.
        let changed = samples[index - SETTLED..index].iter().any(|before| state(before) != (tool, tcp));
        if changed || (tcp && tool != called) {
            continue;
        }
        compared += 1;
        let mean = |k: usize| (ours[index - 1][k] + 4.0 * ours[index - 2][k] + ours[index - 3][k]) / 6.0;
        let theirs = samples[index].joints.values();
        let [x, y, z, a, b] = std::array::from_fn(|k| theirs[k] - mean(k));
        worst.raise(Vector::new(x, y, z).norm(), a.abs().max(b.abs()));
    }
    (worst, compared)
}

/// Largest speed of any joint in moves of a kind, from sample to sample, over its top speed. Nobody but the program keeps
/// it: this controller watches the speeds of its world axes.
pub(crate) fn fastest(setup: &Setup, samples: &[Sample], kind: Kind) -> f64 {
    let speeds = setup.machine().speeds();
    let moving = samples.windows(2).filter(|pair| pair.iter().all(|sample| sample.kind == kind));
    let shares = moving.flat_map(|pair| {
        let (from, to) = (pair[0].joints.values(), pair[1].joints.values());
        std::array::from_fn::<f64, 5, _>(|k| (to[k] - from[k]).abs() / CYCLE / speeds[k])
    });
    shares.fold(0.0, f64::max)
}

/// Seconds of all feed moves from our first segment on.
pub(crate) fn at_feed(ours: &ToolMotion, samples: &[Sample]) -> f64 {
    let first = ours.segments().first().map_or(0, |segment| segment.line);
    let feeding = samples.iter().filter(|sample| sample.line >= first && sample.kind == Kind::Feed);
    feeding.count() as f64 * CYCLE
}

/// Largest way of the linear joints while a change of the world position reaches them.
pub(crate) fn largest_step(samples: &[Sample]) -> f64 {
    let place = |sample: &Sample| Vector::from(sample.joints.linear);
    let steps = samples.windows(SPREAD + 1).map(|window| (place(&window[SPREAD]) - place(&window[0])).norm());
    steps.fold(0.0, f64::max)
}

/// How the controller's way through the program compares with ours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Way {
    /// Largest distance of a sampled pose from our motion: tip and tool axis.
    pub(crate) off: Difference,
    /// Largest distance of the end of a block from the chords between samples: the control stops there, or goes straight
    /// through.
    pub(crate) missed: Difference,
}

/// Compares every sample from our first segment on with the nearest place in the block that the controller says it is in,
/// or in one of its neighbours: the line changes some cycles before or after the position passes the corner.
pub(crate) fn way(motion: &ToolMotion, samples: &[Sample]) -> Way {
    let (setup, segments) = (motion.setup(), motion.segments());
    let mut way = Way::default();
    let mut missed = vec![NOWHERE; segments.len()];
    let first = segments.first().map_or(0, |segment| segment.line);
    let mut before = None;
    for sample in samples.iter().filter(|s| s.line >= first && s.kind != Kind::Standing) {
        let stands = axes(setup, sample);
        let pose = setup.forward(&stands);
        let at = segments.partition_point(|segment| segment.line < sample.line);
        let near = at.saturating_sub(1)..(at + 2).min(segments.len());
        let off = near.clone().map(|index| distance(motion, &segments[index], &stands, &pose));
        let off = off.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(NOWHERE, |(_, off)| off);
        way.off.raise(off.mm, off.degrees.to_radians());
        for index in near {
            let end = motion.pose(&segments[index], 1.0);
            let passed = from_chord(&end, before.as_ref().unwrap_or(&pose), &pose);
            if passed.sum() < missed[index].sum() {
                missed[index] = passed;
            }
        }
        before = Some(pose);
    }
    for end in missed {
        way.missed.raise(end.mm, end.degrees.to_radians());
    }
    way
}

/// Distance of a pose from the nearest place between two samples.
fn from_chord(pose: &Pose, from: &Pose, to: &Pose) -> Difference {
    let chord = to.tip - from.tip;
    let nearest = (pose.tip - from.tip).dot(&chord) / chord.norm_squared().max(f64::MIN_POSITIVE);
    let places = [0.0, nearest.clamp(0.0, 1.0), 1.0].map(|share| {
        let place = from.interpolate(to, share);
        Difference { mm: (pose.tip - place.tip).norm(), degrees: pose.axis_angle(&place).to_degrees() }
    });
    places.into_iter().min_by(|a, b| a.sum().total_cmp(&b.sum())).unwrap_or(NOWHERE)
}

/// Distance of axis positions and their pose from the nearest place of a segment: one number to choose by, and the
/// pose's difference there.
fn distance(motion: &ToolMotion, segment: &Segment, stands: &AxisPosition, pose: &Pose) -> (f64, Difference) {
    // Along a block the control moves these evenly.
    let even = |axes: &AxisPosition, pose: &Pose| {
        let linear = if segment.path == Path::Joints { axes.linear.into() } else { pose.tip.coords };
        let [a, b] = axes.rotary.map(f64::to_degrees);
        nalgebra::Vector5::new(linear.x, linear.y, linear.z, a, b)
    };
    let at = |share: f64| even(&motion.axes(segment, share), &motion.pose(segment, share));
    let (from, to, here) = (at(0.0), at(1.0), even(stands, pose));
    let share = ((here - from).dot(&(to - from)) / (to - from).norm_squared()).clamp(0.0, 1.0);
    let place = motion.pose(segment, share);
    let off = Difference { mm: (place.tip - pose.tip).norm(), degrees: place.axis_angle(pose).to_degrees() };
    ((at(share) - here).norm(), off)
}

/// The motion of the joints themselves, from sample to sample, from our first segment on.
pub(crate) fn joint_motion(ours: &ToolMotion, samples: &[Sample]) -> ToolMotion {
    let first = ours.segments().first().map_or(0, |segment| segment.line);
    let played: Vec<&Sample> = samples.iter().filter(|sample| sample.line >= first).collect();
    let segments = played.windows(2).enumerate().filter(|(_, pair)| pair[0].joints != pair[1].joints);
    let segments = segments.map(|(cycle, pair)| Segment {
        line: pair[1].line,
        kind: if pair[1].kind == Kind::Rapid { SegmentKind::Rapid } else { SegmentKind::Feed },
        start: cycle as f64 * CYCLE,
        duration: CYCLE,
        programmed: CYCLE,
        from: pair[0].joints,
        to: pair[1].joints,
        path: Path::Joints,
    });
    ToolMotion::new(ours.setup().clone(), segments.collect(), Findings::default())
}
