//! How a control goes from rest to rest: through a rapid, and through a block that it stops at the end of. Uses
//! `geometry` and `machine`.

use super::segment::{Path, Segment, SegmentKind};
use crate::geometry::Vector;
use crate::machine::Setup;

/// How a move goes from its start, share 0, to its end, share 1, along the way of the program's own coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Traverse {
    /// Top rate of the share, 1/s.
    pub(super) speed: f64,
    /// And how fast it gets there, 1/s^2.
    acceleration: f64,
}

impl Traverse {
    /// For a rapid with TCP on where the control keeps the speeds and accelerations of the tip and of the rotary axes
    /// instead of those of the machine's axes; `None` for every other segment.
    pub(super) fn of(setup: &Setup, segment: &Segment) -> Option<Self> {
        let by_tip = matches!(segment.path, Path::Tip { .. } | Path::Vector { .. });
        (by_tip && !setup.machine().control.options.tcp_limits_axes).then(|| Self::along(setup, segment)).flatten()
    }

    /// With the speeds and accelerations that the axes of the program's own coordinates have; `None` where nothing moves.
    fn along(setup: &Setup, segment: &Segment) -> Option<Self> {
        let linear: Vector = match &segment.path {
            Path::Tip { from, to } => to - from,
            Path::Vector { from, to } => to.tip - from.tip,
            Path::Joints => Vector::from(segment.to.linear) - Vector::from(segment.from.linear),
            // Its direction goes through those of all axes of its plane.
            Path::JointArc(arc) | Path::TipArc(arc) => Vector::repeat(arc.length()),
        };
        let machine = setup.machine();
        let turned = |slot: usize| segment.to.rotary[slot] - segment.from.rotary[slot];
        let way = [linear.x, linear.y, linear.z, turned(0), turned(1)];
        let slowest = |limits: [f64; 5]| {
            let rates = limits.into_iter().zip(way).map(|(limit, way)| limit / way.abs());
            rates.fold(f64::INFINITY, f64::min)
        };
        let traverse = Self { speed: slowest(machine.speeds()), acceleration: slowest(machine.accelerations()) };
        traverse.speed.is_finite().then_some(traverse)
    }

    /// Highest rate of the share on the way, 1/s: short ways end before the top rate is reached.
    pub(super) fn peak(&self) -> f64 {
        self.speed.min(self.acceleration.sqrt())
    }

    /// Seconds from rest to rest.
    fn duration(&self) -> f64 {
        rest_to_rest(1.0, self.speed, self.acceleration)
    }
}

/// Whether a control may go from one rapid to the next without braking: rapids on one straight line, nothing turning.
pub(super) fn goes_on(first: &Segment, second: &Segment) -> bool {
    let way = |segment: &Segment| match segment.path {
        Path::Tip { from, to } if segment.kind == SegmentKind::Rapid && segment.from.rotary == segment.to.rotary => {
            (to - from).try_normalize(1e-9)
        }
        _ => None,
    };
    way(first).zip(way(second)).is_some_and(|(first, second)| (second - first).norm() < STRAIGHT)
}

/// Turn of the way, radians, that does not count.
const STRAIGHT: f64 = 1e-3;

/// Seconds for a feed move that begins and ends at rest and asks for `programmed` seconds; the control looks for the end
/// of a move once a cycle of `cycle` seconds.
pub(super) fn stopped_duration(setup: &Setup, segment: &Segment, programmed: f64, cycle: f64) -> f64 {
    let acceleration = Traverse::along(setup, segment).map_or(f64::INFINITY, |traverse| traverse.acceleration);
    let seconds = rest_to_rest(1.0, 1.0 / programmed, acceleration);
    if cycle > 0.0 { (seconds / cycle - CYCLE_ROUNDING).ceil() * cycle } else { seconds }
}

/// Share of a cycle by which rounding may pass it.
const CYCLE_ROUNDING: f64 = 1e-6;

/// Seconds for a rapid from rest to rest: that of the slowest axis with its own top speed and acceleration, judged by its
/// fastest piece where the axes do not move linearly; or as the control goes where it does not look at the axes.
pub(super) fn rapid_duration(setup: &Setup, segment: &Segment) -> f64 {
    if let Some(traverse) = Traverse::of(setup, segment) {
        return traverse.duration();
    }
    let pieces = if segment.path == Path::Joints { 1 } else { 8 };
    let place = |k: u32| segment.axes(setup, f64::from(k) / f64::from(pieces)).values();
    let mut ways = [0.0_f64; 5];
    for piece in 0..pieces {
        let (from, to) = (place(piece), place(piece + 1));
        for (index, way) in ways.iter_mut().enumerate() {
            *way = way.max((to[index] - from[index]).abs() * f64::from(pieces));
        }
    }
    let machine = setup.machine();
    let limits = machine.speeds().into_iter().zip(machine.accelerations());
    let seconds = |(way, (speed, acceleration)): (f64, (f64, f64))| rest_to_rest(way, speed, acceleration);
    ways.into_iter().zip(limits).map(seconds).fold(0.0, f64::max)
}

/// Seconds over a way from rest to rest.
fn rest_to_rest(way: f64, speed: f64, acceleration: f64) -> f64 {
    let ramp = speed / acceleration;
    if way >= speed * ramp { way / speed + ramp } else { 2.0 * (way / acceleration).sqrt() }
}
