//! How long a control takes for a move. Uses `machine` and the reading half of `nc`.

use crate::machine::{Dialect, Setup};
use crate::nc::program::Feed;

/// What a feed word is applied to: the way of a move in the program's own coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Travelled {
    /// Of X, Y, Z, mm, along the arc where it is one.
    pub(super) linear: f64,
    /// Of the rotary axes, root of the sum of squares, degrees.
    pub(super) rotary: f64,
}

/// Shorter ways of X, Y, Z count as none, mm.
const NO_LENGTH: f64 = 1e-7;

/// Slowest feed that LinuxCNC makes of an inverse-time word, mm/min or degrees/min.
const SLOWEST: f64 = 0.1;

/// Seconds for a feed move; `None` with no feed, or none that means anything. `tcp`: whether the linear way is the tip's.
pub(super) fn feed_duration(setup: &Setup, feed: Feed, way: Travelled, tcp: bool, rpm: f64) -> Option<f64> {
    let moves = way.linear > NO_LENGTH;
    let per_minute = |linear: f64, rotary: f64| match setup.machine().control.dialect {
        // With TCP off the word is the speed along all axes together, a degree counting as a millimetre.
        Dialect::Fanuc30i if !tcp && moves => 60.0 * way.linear.hypot(way.rotary) / linear,
        Dialect::Fanuc30i | Dialect::LinuxCnc if moves => 60.0 * way.linear / linear,
        Dialect::Fanuc30i | Dialect::LinuxCnc => 60.0 * way.rotary / rotary,
    };
    let seconds = match feed {
        Feed::InverseTime(per_minute) => inverse_time(setup, per_minute, way),
        Feed::PerMinute { linear, rotary } => per_minute(linear, rotary),
        Feed::PerRevolution(advance) => per_minute(advance * rpm, advance * rpm),
        Feed::Missing => return None,
    };
    Some(seconds).filter(|seconds| seconds.is_finite() && *seconds >= 0.0)
}

/// Seconds for an inverse-time word.
fn inverse_time(setup: &Setup, per_minute: f64, way: Travelled) -> f64 {
    inverse_time_floor(setup, per_minute, way).unwrap_or(60.0 / per_minute)
}

/// Seconds for an inverse-time word that LinuxCNC does not keep: it makes a speed of it, and that has a floor.
pub(super) fn inverse_time_floor(setup: &Setup, per_minute: f64, way: Travelled) -> Option<f64> {
    let length = if way.linear > NO_LENGTH { way.linear } else { way.rotary };
    let too_slow = setup.machine().control.dialect == Dialect::LinuxCnc && per_minute * length < SLOWEST;
    too_slow.then(|| 60.0 * length / SLOWEST)
}
