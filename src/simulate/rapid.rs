//! How a control goes through a rapid. Uses `geometry` and `machine`.

use super::segment::{Path, Segment};
use crate::geometry::Vector;
use crate::machine::Setup;

/// How a rapid goes from its start, share 0, to its end, share 1, along the way of the program's own coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Traverse {
    /// Top rate of the share, 1/s.
    speed: f64,
    /// And how fast it gets there, 1/s^2.
    acceleration: f64,
}

impl Traverse {
    /// For a rapid with TCP on where the control keeps the speeds and accelerations of the tip and of the rotary axes
    /// instead of those of the machine's axes; `None` for every other segment.
    pub(super) fn of(setup: &Setup, segment: &Segment) -> Option<Self> {
        let tip: Vector = match &segment.path {
            Path::Tip { from, to } => to - from,
            Path::Vector { from, to } => to.tip - from.tip,
            Path::Joints | Path::JointArc(_) | Path::TipArc(_) => return None,
        };
        let machine = setup.machine();
        if machine.control.options.tcp_limits_axes {
            return None;
        }
        let turned = |slot: usize| segment.to.rotary[slot] - segment.from.rotary[slot];
        let way = [tip.x, tip.y, tip.z, turned(0), turned(1)];
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
