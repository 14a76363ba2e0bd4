//! What a motion asks of each axis, and where that is more than it can. Uses `machine`.
//!
//! Accelerations and jerks are divided differences over the ends of two and three feed blocks in a row, and inside a block
//! over its pieces where the axes do not move evenly: means of the derivatives between, so what is found is there, however
//! the control rounds the joints. Rapids are looked at where the control does not keep the axes' speeds itself.

use super::rapid::{Traverse, goes_on};
use super::segment::{Path, Segment, SegmentKind};
use super::tool_motion::ToolMotion;
use crate::machine::Travel;

/// What kind of limit is passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LimitKind {
    /// End of travel, mm or degrees.
    Travel,
    /// Speed, mm/s or degrees/s.
    Speed,
    /// Acceleration, mm/s^2 or degrees/s^2.
    Acceleration,
    /// Jerk, mm/s^3 or degrees/s^3.
    Jerk,
}

/// A limit that a block passes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct LimitViolation {
    /// Line of the program, from 1.
    pub line: usize,
    /// Letter of the axis.
    pub axis: char,
    /// Kind of limit.
    pub kind: LimitKind,
    /// What the block asks for.
    pub value: f64,
    /// What the axis can.
    pub limit: f64,
}

/// What one axis does. Linear axes mm and s, rotary axes degrees and s.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct AxisStatistics {
    /// Letter of the axis.
    pub letter: char,
    /// Lowest position.
    pub min: f64,
    /// Highest position.
    pub max: f64,
    /// Length of its way there and back.
    pub travel: f64,
    /// Highest mean speed of a feed block, or of a piece of it where the axis does not move evenly.
    pub max_rate: f64,
    /// Highest acceleration at feed: between two blocks the difference of their mean speeds over the time between their
    /// middles; or inside a block where the axis does not move evenly.
    pub max_acceleration: f64,
}

/// What all axes do.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisReport {
    /// In the order of the machine's letters, of the axes that it has; all zero for a program without motion.
    pub axes: Vec<AxisStatistics>,
    /// In the order of the program.
    pub limits: Vec<LimitViolation>,
}

/// How much of a limit may be passed by rounding.
const ROUNDING: f64 = 1e-6;

/// Rotary way, radians, after which the linear axes are looked at again inside a block with TCP on.
const PIECE: f64 = 0.05;

/// Limits and position of one axis in degrees where it turns.
struct Axis {
    range: Option<[f64; 2]>,
    speed: f64,
    acceleration: f64,
    jerk: f64,
    statistics: AxisStatistics,
    before: Before,
}

/// What came before in a run of feed blocks.
#[derive(Clone, Copy, Default)]
struct Before {
    /// Mean speed and duration of the block before.
    rate: Option<(f64, f64)>,
    /// Acceleration between the two blocks before, and the duration of the first of them.
    acceleration: Option<(f64, f64)>,
}

/// One axis in one block.
#[derive(Clone, Copy, Default)]
struct Trace {
    low: f64,
    high: f64,
    /// Length of its way there and back.
    length: f64,
    /// From end to end.
    travel: f64,
    /// Largest first, second and third difference over the pieces, as derivatives by the share of the block.
    derivatives: [f64; 3],
}

impl Trace {
    fn of(stops: &[[f64; 5]], axis: usize) -> Self {
        let positions: Vec<f64> = stops.iter().filter_map(|stop| stop.get(axis).copied()).collect();
        let (Some(first), Some(last)) = (positions.first(), positions.last()) else { return Self::default() };
        let pieces = (positions.len() - 1) as f64;
        let mut trace = Self { low: f64::INFINITY, high: f64::NEG_INFINITY, ..Self::default() };
        trace.travel = last - first;
        for position in &positions {
            (trace.low, trace.high) = (trace.low.min(*position), trace.high.max(*position));
        }
        let mut differences = positions;
        for (order, derivative) in trace.derivatives.iter_mut().enumerate() {
            differences = differences.windows(2).map(|pair| pair[1] - pair[0]).collect();
            if order == 0 {
                trace.length = differences.iter().map(|way| way.abs()).sum();
            }
            let largest = differences.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
            *derivative = largest * pieces.powi(order as i32 + 1);
        }
        trace
    }
}

impl ToolMotion {
    /// What the motion asks of each axis, and every limit it passes.
    pub fn axis_report(&self) -> AxisReport {
        let mut axes = self.limits_of_axes();
        let mut limits = Vec::new();
        let mut stops = Vec::new();
        let segments = self.segments();
        for (place, segment) in segments.iter().enumerate() {
            stops.clear();
            self.stops(segment, &mut stops);
            let rapid = segment.kind == SegmentKind::Rapid;
            let before = place.checked_sub(1).and_then(|before| segments.get(before));
            let in_one_go = before.is_some_and(|before| goes_on(before, segment))
                || segments.get(place + 1).is_some_and(|after| goes_on(segment, after));
            let peak = Traverse::of(self.setup(), segment)
                .filter(|_| rapid)
                .map(|traverse| if in_one_go { traverse.speed } else { traverse.peak() });
            for (index, axis) in axes.iter_mut().enumerate() {
                axis.follow(segment, peak, &Trace::of(&stops, index), &mut limits);
            }
        }
        let machine = self.setup().machine();
        let present = axes.into_iter().enumerate().filter(|(index, _)| machine.has_axis(*index));
        AxisReport { axes: present.map(|(_, axis)| axis.finish()).collect(), limits }
    }

    /// Positions of all axes at both ends of a segment and between, degrees where they turn.
    fn stops(&self, segment: &Segment, stops: &mut Vec<[f64; 5]>) {
        let turned = (0..2).map(|k| (segment.to.rotary[k] - segment.from.rotary[k]).abs()).fold(0.0, f64::max);
        let pieces = match segment.path {
            Path::Joints => 1.0,
            Path::JointArc(arc) | Path::TipArc(arc) => (arc.angle.abs().max(turned) / PIECE).ceil().clamp(1.0, 256.0),
            Path::Tip { .. } | Path::Vector { .. } => (turned / PIECE).ceil().clamp(1.0, 256.0),
        };
        let place = |share: f64| {
            let [x, y, z, first, second] = match share {
                0.0 => segment.from.values(),
                1.0 => segment.to.values(),
                _ => self.axes(segment, share).values(),
            };
            [x, y, z, first.to_degrees(), second.to_degrees()]
        };
        stops.extend((0..=pieces as u32).map(|k| place(f64::from(k) / pieces)));
    }

    fn limits_of_axes(&self) -> [Axis; 5] {
        let machine = self.setup().machine();
        let linear = |k: usize| {
            let axis = &machine.linear[k];
            let jerk = axis.jerk.unwrap_or(f64::INFINITY);
            Axis::new(axis.letter, Some([axis.min, axis.max]), [axis.speed, axis.acceleration, jerk])
        };
        let rotary = |k: usize| {
            let axis = &machine.rotary[k];
            let range = match axis.travel {
                Travel::Limited { min, max } => Some([min.to_degrees(), max.to_degrees()]),
                Travel::Unlimited | Travel::Wrapped => None,
            };
            let jerk = axis.jerk.unwrap_or(f64::INFINITY);
            Axis::new(axis.letter, range, [axis.speed, axis.acceleration, jerk].map(f64::to_degrees))
        };
        [linear(0), linear(1), linear(2), rotary(0), rotary(1)]
    }
}

impl Axis {
    fn new(letter: char, range: Option<[f64; 2]>, [speed, acceleration, jerk]: [f64; 3]) -> Self {
        let (min, max) = (f64::INFINITY, f64::NEG_INFINITY);
        let statistics = AxisStatistics { letter, min, max, travel: 0.0, max_rate: 0.0, max_acceleration: 0.0 };
        Self { range, speed, acceleration, jerk, statistics, before: Before::default() }
    }

    /// Adds a segment; `peak` is the highest rate of the share on a rapid whose speed nobody else watches, 1/s.
    fn follow(&mut self, segment: &Segment, peak: Option<f64>, trace: &Trace, limits: &mut Vec<LimitViolation>) {
        let letter = self.statistics.letter;
        let mut pass = |kind, value: f64, limit: f64| {
            limits.push(LimitViolation { line: segment.line, axis: letter, kind, value, limit });
        };
        self.statistics.travel += trace.length;
        self.statistics.min = self.statistics.min.min(trace.low);
        self.statistics.max = self.statistics.max.max(trace.high);
        if let Some([min, max]) = self.range {
            if trace.low < min - ROUNDING {
                pass(LimitKind::Travel, trace.low, min);
            }
            if trace.high > max + ROUNDING {
                pass(LimitKind::Travel, trace.high, max);
            }
        }
        let values = if segment.kind == SegmentKind::Rapid {
            self.before = Before::default();
            [peak.map_or(0.0, |peak| trace.derivatives[0] * peak), 0.0, 0.0]
        } else {
            let values = self.at_feed(segment.programmed, trace);
            self.statistics.max_rate = self.statistics.max_rate.max(values[0]);
            self.statistics.max_acceleration = self.statistics.max_acceleration.max(values[1]);
            values
        };
        let kinds = [LimitKind::Speed, LimitKind::Acceleration, LimitKind::Jerk];
        let most = [self.speed, self.acceleration, self.jerk];
        for (kind, (value, limit)) in kinds.into_iter().zip(values.into_iter().zip(most)) {
            if value > limit * (1.0 + ROUNDING) {
                pass(kind, value, limit);
            }
        }
    }

    /// Speed, acceleration and jerk of a feed block after those before it.
    fn at_feed(&mut self, duration: f64, trace: &Trace) -> [f64; 3] {
        let over = |difference: f64, time: f64| if difference == 0.0 { 0.0 } else { difference / time };
        let rate = over(trace.travel, duration);
        let before = self.before;
        let acceleration = before.rate.map(|(last, time)| over(2.0 * (rate - last), duration + time));
        let time_before = before.rate.map_or(0.0, |(_, time)| time);
        let jerk = before
            .acceleration
            .zip(acceleration)
            .map(|((last, earlier), now)| over(3.0 * (now - last), earlier + time_before + duration));
        self.before = Before { rate: Some((rate, duration)), acceleration: acceleration.map(|now| (now, time_before)) };
        let [speed, bend, twist] = trace.derivatives;
        [
            over(speed, duration),
            acceleration.unwrap_or(0.0).abs().max(over(bend, duration.powi(2))),
            jerk.unwrap_or(0.0).abs().max(over(twist, duration.powi(3))),
        ]
    }

    fn finish(self) -> AxisStatistics {
        if self.statistics.min > self.statistics.max {
            return AxisStatistics { min: 0.0, max: 0.0, ..self.statistics };
        }
        self.statistics
    }
}
