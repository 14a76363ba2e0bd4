//! Which way a rotary axis turns to the angle of a word. Uses `machine` and the reading half of `nc`.

use crate::machine::{DialectOptions, Rollover, ShortestWay, Travel, unwind};
use crate::nc::program::Turn;
use std::f64::consts::TAU;

/// Turns by less are none, radians: rounding of words must not become a whole turn.
const STILL: f64 = 1e-9;

/// The angle, radians, at which an axis ends that stands at `start`, for an absolute word in degrees.
pub(super) fn turn_to(word: f64, start: f64, turn: Turn, travel: Travel, options: &DialectOptions) -> f64 {
    let angle = word.to_radians();
    match (turn, travel, options.rollover) {
        (Turn::Positive, ..) => at_or_after(angle, start),
        (Turn::Negative, ..) => at_or_before(angle, start),
        (Turn::Shortest | Turn::Plain, Travel::Wrapped, Rollover::Shortest) | (Turn::Shortest, Travel::Wrapped, _) => {
            unwind(angle, start)
        }
        (Turn::Shortest, ..) if options.shortest_way == ShortestWay::WithinTravel => {
            let shorter = unwind(angle, start);
            if travel.excess(shorter) <= STILL { shorter } else { angle }
        }
        (Turn::Plain, Travel::Wrapped, Rollover::Sign) if word.is_sign_negative() => at_or_before(-angle, start),
        (Turn::Plain, Travel::Wrapped, Rollover::Sign) => at_or_after(angle, start),
        // Within the turn from zero in which the axis stands.
        (Turn::Plain, Travel::Wrapped, Rollover::Within) => {
            angle.rem_euclid(TAU) + ((start + STILL) / TAU).floor() * TAU
        }
        (Turn::Plain | Turn::Shortest, Travel::Limited { .. } | Travel::Unlimited, _) => angle,
    }
}

/// The first of the angles that differ by whole turns that is not before `start`.
fn at_or_after(angle: f64, start: f64) -> f64 {
    angle + ((start - STILL - angle) / TAU).ceil() * TAU
}

/// The last that is not after it.
fn at_or_before(angle: f64, start: f64) -> f64 {
    angle + ((start + STILL - angle) / TAU).floor() * TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Dialect;

    fn degrees(word: f64, start: f64, turn: Turn, travel: Travel, rollover: Rollover) -> f64 {
        let options = DialectOptions { rollover, ..DialectOptions::of(Dialect::Iso) };
        turn_to(word, start.to_radians(), turn, travel, &options).to_degrees()
    }

    #[test]
    fn axes_that_do_not_wrap_turn_the_shorter_way_only_where_told_and_within_their_travel() {
        let limited = Travel::Limited { min: 0.0, max: 357.5_f64.to_radians() };
        let end = |word: f64, start: f64, travel, shortest_way| {
            let options = DialectOptions { shortest_way, ..DialectOptions::of(Dialect::HeidenhainTnc) };
            turn_to(word, f64::to_radians(start), Turn::Shortest, travel, &options).to_degrees()
        };
        for (word, start, travel, way, expected) in [
            (10.0, 350.0, limited, ShortestWay::Wrapped, 10.0),
            (10.0, 350.0, Travel::Unlimited, ShortestWay::Wrapped, 10.0),
            (10.0, 350.0, Travel::Wrapped, ShortestWay::Wrapped, 370.0),
            (10.0, 350.0, limited, ShortestWay::WithinTravel, 10.0),
            (-340.0, 10.0, limited, ShortestWay::WithinTravel, 20.0),
            (10.0, 350.0, Travel::Unlimited, ShortestWay::WithinTravel, 370.0),
        ] {
            let reached = end(word, start, travel, way);
            assert!((reached - expected).abs() < 1e-9, "{word} from {start}, {travel:?}, {way:?}: {reached}");
        }
    }

    #[test]
    fn words_turn_the_way_they_say() {
        let wrapped = Travel::Wrapped;
        for (word, start, turn, rollover, end) in [
            (10.0, 350.0, Turn::Plain, Rollover::Shortest, 370.0),
            (10.0, 350.0, Turn::Plain, Rollover::Sign, 370.0),
            (350.0, 370.0, Turn::Plain, Rollover::Sign, 710.0),
            (-350.0, 370.0, Turn::Plain, Rollover::Sign, 350.0),
            (-0.0, 10.0, Turn::Plain, Rollover::Sign, 0.0),
            (-340.0, 0.0, Turn::Plain, Rollover::Sign, -20.0),
            (30.0, 30.0, Turn::Plain, Rollover::Sign, 30.0),
            // 350 to 10 turns back by 340, 10 to 340 on by 330.
            (10.0, 350.0, Turn::Plain, Rollover::Within, 10.0),
            (340.0, 10.0, Turn::Plain, Rollover::Within, 340.0),
            (10.0, 350.0, Turn::Shortest, Rollover::Within, 370.0),
            (340.0, 10.0, Turn::Shortest, Rollover::Within, -20.0),
            (10.0, 350.0, Turn::Negative, Rollover::Shortest, 10.0),
            (10.0, 5.0, Turn::Negative, Rollover::Shortest, -350.0),
            (10.0, 350.0, Turn::Positive, Rollover::Within, 370.0),
        ] {
            let reached = degrees(word, start, turn, wrapped, rollover);
            assert!((reached - end).abs() < 1e-9, "{word} from {start}, {turn:?}, {rollover:?}: {reached}");
        }
        assert_eq!(degrees(-340.0, 0.0, Turn::Plain, Travel::Unlimited, Rollover::Sign), -340.0);
    }
}
