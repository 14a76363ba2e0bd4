//! What is beyond the axes' limits in a timed path. Uses `machine`.

use super::TimedMove;
use crate::machine::Machine;

/// What an axis does too fast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExcessKind {
    /// Mean rate in a block.
    Speed,
    /// Change of rate between a block and the next.
    Acceleration,
    /// Change of acceleration about a block.
    Jerk,
}

/// An axis beyond its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excess {
    /// Index of the move; for accelerations and jerks that of the last one that they concern.
    pub index: usize,
    /// Letter of the axis.
    pub axis: char,
    /// What is too fast.
    pub kind: ExcessKind,
    /// Its value: mm or radians over the powers of seconds.
    pub value: f64,
    /// Its limit, same unit.
    pub limit: f64,
}

/// Every axis speed, acceleration and jerk beyond its limit in the model of this module, for feed moves that take
/// `seconds`, one for each move; `None` for rapids and for moves that the control does not make. Empty when all is well.
pub fn excesses(moves: &[TimedMove], seconds: &[Option<f64>], machine: &Machine) -> Vec<Excess> {
    let (letters, limits) = (machine.letters(), [machine.speeds(), machine.accelerations(), machine.jerks()]);
    let mut found = Vec::new();
    let mut history = History::default();
    let mut from = moves.first().map_or([0.0; 5], |step| step.axes.to.values());
    for (index, (step, seconds)) in moves.iter().zip(seconds).enumerate().skip(1) {
        let to = step.axes.to.values();
        if step.axes.kind.is_rapid() {
            (history, from) = (History::default(), to);
            continue;
        }
        // A move that the control does not make is part of the next one.
        let Some(seconds) = *seconds else { continue };
        let values = history.follow(std::array::from_fn(|k| to[k] - from[k]), seconds);
        from = to;
        for (kind, (values, limits)) in KINDS.into_iter().zip(values.iter().zip(&limits)) {
            for k in 0..5 {
                if values[k] > limits[k] {
                    found.push(Excess { index, axis: letters[k], kind, value: values[k], limit: limits[k] });
                }
            }
        }
    }
    found
}

const KINDS: [ExcessKind; 3] = [ExcessKind::Speed, ExcessKind::Acceleration, ExcessKind::Jerk];

/// Rates and accelerations so far in a run of feed moves.
#[derive(Default)]
struct History {
    /// Rates and duration of the last block.
    rates: Option<([f64; 5], f64)>,
    /// Accelerations before the last block, and the duration of the one before it.
    accelerations: Option<([f64; 5], f64)>,
}

impl History {
    /// Speeds, accelerations and jerks with a further block.
    fn follow(&mut self, travel: [f64; 5], duration: f64) -> [[f64; 5]; 3] {
        let rates = travel.map(|way| way / duration);
        let accelerations = self.rates.map(|(last, before)| {
            std::array::from_fn::<f64, 5, _>(|k| 2.0 * (rates[k] - last[k]) / (before + duration))
        });
        let before = self.rates.map_or(0.0, |(_, before)| before);
        let jerks = self.accelerations.zip(accelerations).map(|((last, earlier), now)| {
            std::array::from_fn::<f64, 5, _>(|k| 3.0 * (now[k] - last[k]) / (earlier + before + duration))
        });
        self.rates = Some((rates, duration));
        self.accelerations = accelerations.map(|now| (now, before));
        [rates, accelerations.unwrap_or_default(), jerks.unwrap_or_default()].map(|order| order.map(f64::abs))
    }
}
