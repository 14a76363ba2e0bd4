//! How long a control takes for a feed move. Uses the reading half of `nc`.

use crate::nc::program::Feed;
use crate::nc::{FeedRules, Travelled};

/// Seconds for a feed move; `None` with no feed, or none that means anything. `tcp`: whether the linear way is the tip's;
/// `rpm` of the spindle, for feeds per revolution.
pub(super) fn feed_duration(rules: &FeedRules, feed: Feed, way: Travelled, tcp: bool, rpm: f64) -> Option<f64> {
    let minutes = match feed {
        Feed::InverseTime(word) => match rules.inverse_time_floor(word, way) {
            Some(seconds) => seconds / 60.0,
            None => 1.0 / word,
        },
        Feed::Duration(seconds) => seconds / 60.0,
        // mm of the program's unit of length.
        Feed::PerMinute { linear, rotary } => rules.length(way, tcp, linear / rotary) / rotary,
        Feed::PerRevolution(advance) => rules.length(way, tcp, 1.0) / (advance * rpm),
        Feed::Missing => return None,
    };
    Some(minutes * 60.0).filter(|seconds| seconds.is_finite() && *seconds >= 0.0)
}
