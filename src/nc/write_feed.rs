//! The F word of a block: from its duration, never faster than asked. Uses `machine`.

use super::code::FeedUnit;
use super::feed_rules::{FeedRules, Travelled};
use super::format::{steps_above, steps_below, value_of};
use crate::machine::{DialectOptions, FeedMode, InverseTimeUnit, LengthUnit};

/// An F word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FeedWord {
    /// What it counts.
    pub(super) unit: FeedUnit,
    /// Its value in steps of its last decimal.
    pub(super) steps: i64,
    /// How long the block takes with it, s.
    pub(super) seconds: f64,
}

/// Why a block has no F word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NoFeedWord {
    /// X, Y, Z move so little that only the rotary axes can be given a feed.
    TipStill,
    /// The slowest feed there is would be faster than asked.
    TooSlow,
}

/// The F word that makes a block take at least `seconds`, as little more as its digits and the control's ceilings allow.
pub(super) fn feed_word(
    options: &DialectOptions,
    rules: &FeedRules,
    way: Travelled,
    tcp: bool,
    seconds: f64,
) -> Result<FeedWord, NoFeedWord> {
    let word = match options.feed_mode {
        FeedMode::InverseTime => {
            inverse_time(options, rules, way, seconds).or_else(|| per_minute(options, rules, way, tcp, seconds))
        }
        FeedMode::PerMinute => per_minute(options, rules, way, tcp, seconds),
    };
    word.ok_or(if way.is_linear() && way.rotary > 0.0 { NoFeedWord::TipStill } else { NoFeedWord::TooSlow })
}

fn inverse_time(options: &DialectOptions, rules: &FeedRules, way: Travelled, seconds: f64) -> Option<FeedWord> {
    let digits = options.feed_digits;
    let [low, high] = options.inverse_time_range;
    let (steps, word) = match options.inverse_time_unit {
        InverseTimeUnit::Seconds => {
            let steps = steps_above(seconds.max(low), digits)?;
            (steps, value_of(steps, digits))
        }
        InverseTimeUnit::PerMinute => below((60.0 / seconds).min(high), digits)?,
        InverseTimeUnit::PerSecond => below((1.0 / seconds).min(high), digits)?,
    };
    let taken = match options.inverse_time_unit {
        InverseTimeUnit::PerMinute => 60.0 / word,
        InverseTimeUnit::PerSecond => 1.0 / word,
        InverseTimeUnit::Seconds => word,
    };
    // A word that the control does not keep is no use.
    let kept = steps > 0 && word >= low && word <= high && rules.inverse_time_floor(60.0 / taken, way).is_none();
    kept.then_some(FeedWord { unit: FeedUnit::InverseTime, steps, seconds: taken })
}

fn per_minute(
    options: &DialectOptions,
    rules: &FeedRules,
    way: Travelled,
    tcp: bool,
    seconds: f64,
) -> Option<FeedWord> {
    let unit = unit_mm(options);
    let length = rules.length(way, tcp, unit);
    let (steps, word) = below((60.0 * length / seconds).min(options.max_feed / unit), options.feed_digits)?;
    (steps > 0).then_some(FeedWord { unit: FeedUnit::PerMinute, steps, seconds: 60.0 * length / word })
}

fn below(value: f64, digits: u8) -> Option<(i64, f64)> {
    let steps = steps_below(value, digits)?;
    Some((steps, value_of(steps, digits)))
}

/// mm of a unit of length in written programs.
pub(super) fn unit_mm(options: &DialectOptions) -> f64 {
    match options.units {
        LengthUnit::Mm => 1.0,
        LengthUnit::Inch => 25.4,
    }
}
