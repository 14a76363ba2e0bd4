//! What a motion asks of each axis, and where that is more than it can. Uses `machine`.

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
    /// Highest acceleration between two feed blocks: difference of their mean speeds over the time between their
    /// middles.
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
    statistics: AxisStatistics,
    /// Mean speed and duration of the feed block before.
    before: Option<(f64, f64)>,
}

impl ToolMotion {
    /// What the motion asks of each axis, and every limit it passes.
    pub fn axis_report(&self) -> AxisReport {
        let mut axes = self.limits_of_axes();
        let mut limits = Vec::new();
        let mut stops = Vec::new();
        for segment in self.segments() {
            stops.clear();
            self.stops(segment, &mut stops);
            for (index, axis) in axes.iter_mut().enumerate() {
                let positions = stops.iter().filter_map(|stop| stop.get(index).copied());
                axis.follow(segment, positions, &mut limits);
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
            Axis::new(axis.letter, Some([axis.min, axis.max]), axis.speed, axis.acceleration)
        };
        let rotary = |k: usize| {
            let axis = &machine.rotary[k];
            let range = match axis.travel {
                Travel::Limited { min, max } => Some([min.to_degrees(), max.to_degrees()]),
                Travel::Unlimited | Travel::Wrapped => None,
            };
            Axis::new(axis.letter, range, axis.speed.to_degrees(), axis.acceleration.to_degrees())
        };
        [linear(0), linear(1), linear(2), rotary(0), rotary(1)]
    }
}

impl Axis {
    fn new(letter: char, range: Option<[f64; 2]>, speed: f64, acceleration: f64) -> Self {
        let (min, max) = (f64::INFINITY, f64::NEG_INFINITY);
        let statistics = AxisStatistics { letter, min, max, travel: 0.0, max_rate: 0.0, max_acceleration: 0.0 };
        Self { range, speed, acceleration, statistics, before: None }
    }

    fn follow(&mut self, segment: &Segment, positions: impl Iterator<Item = f64>, limits: &mut Vec<LimitViolation>) {
        let (mut first, mut last) = (None, 0.0);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut pieces, mut busiest) = (0_u32, 0.0_f64);
        for position in positions {
            if first.is_some() {
                let way = (position - last).abs();
                self.statistics.travel += way;
                (pieces, busiest) = (pieces + 1, busiest.max(way));
            }
            first = first.or(Some(position));
            last = position;
            (low, high) = (low.min(position), high.max(position));
        }
        self.statistics.min = self.statistics.min.min(low);
        self.statistics.max = self.statistics.max.max(high);
        let mut pass = |kind, value: f64, limit: f64| {
            limits.push(LimitViolation { line: segment.line, axis: self.statistics.letter, kind, value, limit });
        };
        if let Some([min, max]) = self.range {
            if low < min - ROUNDING {
                pass(LimitKind::Travel, low, min);
            }
            if high > max + ROUNDING {
                pass(LimitKind::Travel, high, max);
            }
        }
        if segment.kind == SegmentKind::Rapid {
            self.before = None;
            return;
        }
        let way = last - first.unwrap_or(last);
        let rate = if way == 0.0 { 0.0 } else { way / segment.duration };
        let fastest = if busiest == 0.0 { 0.0 } else { busiest * f64::from(pieces) / segment.duration };
        if fastest > self.speed * (1.0 + ROUNDING) {
            pass(LimitKind::Speed, fastest, self.speed);
        }
        if let Some((rate_before, duration_before)) = self.before {
            let acceleration = 2.0 * (rate - rate_before).abs() / (segment.duration + duration_before);
            if acceleration > self.acceleration * (1.0 + ROUNDING) {
                pass(LimitKind::Acceleration, acceleration, self.acceleration);
            }
            self.statistics.max_acceleration = self.statistics.max_acceleration.max(acceleration);
        }
        self.statistics.max_rate = self.statistics.max_rate.max(fastest);
        self.before = Some((rate, segment.duration));
    }

    fn finish(self) -> AxisStatistics {
        if self.statistics.min > self.statistics.max {
            return AxisStatistics { min: 0.0, max: 0.0, ..self.statistics };
        }
        self.statistics
    }
}
