//! The F word of a block: from its duration, never faster than asked. Uses `diagnostic` and `machine`.

use super::code::FeedUnit;
use super::feed_rules::{FeedRules, Travelled};
use super::format::{steps_below, value_of};
use crate::machine::{DialectOptions, FeedMode};

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
    let digits = options.feed_digits;
    let inverse = || {
        let [low, high] = options.inverse_time_range;
        let steps = steps_below((60.0 / seconds).min(high), digits)?;
        let word = value_of(steps, digits);
        // A word that the control does not keep is no use.
        let kept = steps > 0 && word >= low && rules.inverse_time_floor(word, way).is_none();
        kept.then(|| FeedWord { unit: FeedUnit::InverseTime, steps, seconds: 60.0 / word })
    };
    let per_minute = || {
        let length = rules.length(way, tcp);
        let steps = steps_below((60.0 * length / seconds).min(options.max_feed), digits)?;
        let word = value_of(steps, digits);
        (steps > 0).then(|| FeedWord { unit: FeedUnit::PerMinute, steps, seconds: 60.0 * length / word })
    };
    let word = match options.feed_mode {
        FeedMode::InverseTime => inverse().or_else(per_minute),
        FeedMode::PerMinute => per_minute(),
    };
    word.ok_or(if way.is_linear() && way.rotary > 0.0 { NoFeedWord::TipStill } else { NoFeedWord::TooSlow })
}
