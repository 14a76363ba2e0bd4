//! How many strips: the search for the fewest that hold the tolerance, knowing nothing of strips.
//!
//! Strain is the largest error as a share of its limit: up to 1 the tolerance holds. Foreseeing costs far less than
//! trying.

use super::limits::UNCUT;
use crate::diagnostic::Result;

/// Strips tried when the number is free.
pub(super) const MOST_STRIPS: usize = 80;
/// Numbers of strips tried at most where the tolerance decides.
const TRIES: usize = 5;
/// Numbers of strips that leave part of the surface to none after which no other is tried.
const REFUSALS: usize = 3;
/// Error of one strip fewer, as a share of the limit, beyond which it is not tried.
const HOPELESS: f64 = 1.6;
/// Largest foreseen error, as a share of the limits, of a number of strips that is worth fitting.
const PROMISING: f64 = 1.6;
/// The same for fewer strips than hold already: what is foreseen before the fit is often too much.
const TEMPTING: f64 = 6.0;
/// Numbers of strips for which errors are foreseen at most.
const FORECASTS: usize = 6;
/// Share of the gain that narrower strips promise below which more of them no longer help.
const NO_BETTER: f64 = 0.5;

/// What came of a number of strips.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Trial<S> {
    /// All strips, and their strain.
    Whole(S, f64),
    /// Strips of which those that did not hold were divided, and what strain that leaves: more than 1 only where all but a
    /// few held, which more strips would not help either.
    Mended(S, f64),
    /// The strain of those fitted: enough to tell that this number does not hold.
    Missed(f64),
}

/// What the search asks.
pub(super) trait Counts {
    /// Strips of one number.
    type Strips;
    /// Strain foreseen for a number of strips.
    fn foreseen(&self, count: usize) -> Result<f64>;
    /// How many strips there are.
    fn size(strips: &Self::Strips) -> usize;
    /// Fits a number of strips, as far as need be.
    fn trial(&self, count: usize) -> Result<Trial<Self::Strips>>;
    /// Fits a number of strips to the end.
    fn whole(&self, count: usize) -> Result<Self::Strips>;
    /// True once the best so far has to do.
    fn stopped(&self) -> bool;
}

/// The numbers of strips searched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    /// Fewest strips that the flank is long enough for.
    pub(super) least: usize,
    /// Number of strips to begin with.
    pub(super) predicted: usize,
}

/// What a search knows.
struct Known<S> {
    /// The best of the whole, with its strain.
    best: Option<(f64, S)>,
    /// The least strain of what was given up, and the number of strips that had it.
    missed: Option<(f64, usize)>,
    /// The greatest number of strips that did not hold, 0 for none.
    failed: usize,
    /// The least strain of those, and their number.
    nearest: Option<(f64, usize)>,
}

/// The fewest strips within tolerance: from the number that promises to hold down while it does, or up until it does.
/// Where more strips no longer help, or after a few tries, the best so far stands.
pub(super) fn fewest<C: Counts>(counts: &C, range: Range) -> Result<C::Strips> {
    let mut count = promising(counts, range)?;
    let mut known = Known { best: None, missed: None, failed: 0, nearest: None };
    let (mut refused, mut uncut) = (None, 0);
    for _ in 0..TRIES {
        let strain = match counts.trial(count) {
            Ok(Trial::Whole(strips, strain)) => {
                if known.best.as_ref().is_none_or(|(least, _)| strain < least.max(1.0)) {
                    known.best = Some((strain, strips));
                }
                strain
            }
            Ok(Trial::Mended(strips, strain)) => {
                let better = |(least, best): &(f64, C::Strips)| match strain <= 1.0 {
                    true => *least > 1.0 || C::size(&strips) < C::size(best),
                    false => strain < *least,
                };
                if known.best.as_ref().is_none_or(better) {
                    known.best = Some((strain, strips));
                }
                break;
            }
            Ok(Trial::Missed(strain)) => {
                if known.missed.is_none_or(|(least, _)| strain < least) {
                    known.missed = Some((strain, count));
                }
                strain
            }
            Err(error) => {
                refused = Some(error);
                f64::INFINITY
            }
        };
        uncut += usize::from(strain >= UNCUT);
        let next = match strain <= 1.0 {
            true => fewer(counts, range, (count, strain), known.failed)?,
            false => known.more(range, (count, strain)),
        };
        if next == count || next > MOST_STRIPS || uncut >= REFUSALS || counts.stopped() {
            break;
        }
        count = next;
    }
    match (known.best, known.missed, refused) {
        (Some((_, strips)), ..) => Ok(strips),
        (None, Some((_, count)), _) => counts.whole(count),
        (None, None, Some(error)) => Err(error),
        (None, None, None) => counts.whole(range.predicted),
    }
}

impl<S> Known<S> {
    /// The next greater number of strips worth trying after `count`, which do not hold; `count` where there is none.
    fn more(&mut self, range: Range, (count, strain): (usize, f64)) -> usize {
        let within = self.best.as_ref().is_some_and(|(strain, _)| *strain <= 1.0);
        // Errors fall with the square of the width.
        let promised = |(least, at): (f64, usize)| least * (1.0 - (at as f64 / count as f64).powi(2));
        let gains = self.nearest.is_none_or(|before| strain <= before.0 - NO_BETTER * promised(before));
        let helps = count < range.predicted || strain >= UNCUT || gains;
        // A first miss may be that of one strip alone.
        let careful = if self.nearest.is_none() { 0.95 } else { 1.0 };
        let factor = if strain < UNCUT { strain.sqrt().clamp(1.0, 1.4) } else { 1.1 };
        self.failed = self.failed.max(count);
        if strain < UNCUT && self.nearest.is_none_or(|(least, _)| strain < least) {
            self.nearest = Some((strain, count));
        }
        if within || !helps { count } else { (count + 1).max((count as f64 * factor * careful) as usize) }
    }
}

/// The next smaller number of strips worth trying after `count` that hold with `strain`; `count` where there is none.
fn fewer<C: Counts>(counts: &C, range: Range, (count, strain): (usize, f64), failed: usize) -> Result<usize> {
    // One strip fewer errs more, at least by the square of its width.
    let wider = strain * (count as f64 / (count as f64 - 1.0)).powi(2);
    if wider > HOPELESS {
        return Ok(count);
    }
    let fewer = (count - 1).min((count as f64 * strain.sqrt()) as usize + 1).max(range.least).max(failed + 1);
    Ok(if fewer >= count || counts.foreseen(fewer)? > TEMPTING { count } else { fewer })
}

/// The fewest strips, counted from the predicted number up or down, whose foreseen errors leave hope.
fn promising<C: Counts>(counts: &C, range: Range) -> Result<usize> {
    let mut count = range.predicted.clamp(range.least, range.least.max(MOST_STRIPS));
    let mut foreseen = counts.foreseen(count)?;
    let falls = foreseen <= PROMISING;
    for _ in 0..FORECASTS {
        let next = if falls { count - 1 } else { count + 1 };
        if next < range.least || next > MOST_STRIPS {
            break;
        }
        foreseen = counts.foreseen(next)?;
        match (falls, foreseen <= PROMISING) {
            (true, false) => break,
            (false, true) => return Ok(next),
            _ => count = next,
        }
    }
    Ok(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Diagnostic;
    use proptest::prelude::*;
    use std::cell::RefCell;

    /// Strips whose strain is 1 at `holds` of them and falls with the square of their number, down to `floor`; foreseen
    /// `bias` times as large. Fewer than `refused` are refused.
    #[derive(Default)]
    struct Law {
        holds: f64,
        floor: f64,
        bias: f64,
        refused: usize,
        /// Largest strain that dividing strips mends, with a tenth more of them.
        mended: f64,
        tried: RefCell<Vec<usize>>,
    }

    impl Law {
        fn strain(&self, count: usize) -> f64 {
            (self.holds / count as f64).powi(2).max(self.floor)
        }

        fn tried(&self) -> Vec<usize> {
            self.tried.borrow().clone()
        }
    }

    impl Counts for Law {
        type Strips = usize;

        fn foreseen(&self, count: usize) -> Result<f64> {
            Ok(self.bias * self.strain(count))
        }

        fn trial(&self, count: usize) -> Result<Trial<usize>> {
            self.tried.borrow_mut().push(count);
            match self.strain(count) {
                _ if count < self.refused => Err(Diagnostic::error("no")),
                strain if strain > 1.0 && strain <= self.mended => Ok(Trial::Mended(count + count.div_ceil(10), 1.0)),
                strain if strain > 1.5 => Ok(Trial::Missed(strain)),
                strain => Ok(Trial::Whole(count, strain)),
            }
        }

        fn size(strips: &usize) -> usize {
            *strips
        }

        fn whole(&self, count: usize) -> Result<usize> {
            Ok(count)
        }

        fn stopped(&self) -> bool {
            false
        }
    }

    fn range(least: usize, predicted: usize) -> Range {
        Range { least, predicted }
    }

    proptest! {
        /// However far off the prediction: with a fair forecast what comes out holds, and one strip fewer hardly would.
        #[test]
        fn the_fewest_strips_that_hold_are_found(holds in 2.0..40.0f64, off in 0.75..1.3f64, bias in 0.8..1.5f64) {
            let law = Law { holds, bias, ..Law::default() };
            let found = fewest(&law, range(1, (holds * off).ceil() as usize)).unwrap();
            prop_assert!(law.strain(found) <= 1.0, "{found} strips strain {}, tried {:?}", law.strain(found), law.tried());
            prop_assert!(found as f64 <= 1.1 * holds + 2.0, "{found} strips, {holds} would do, tried {:?}", law.tried());
        }

        #[test]
        fn no_number_is_tried_twice_nor_one_that_the_flank_is_too_short_for(
            holds in 2.0..60.0f64, predicted in 1..70usize, least in 1..40usize, bias in 0.3..4.0f64, floor in 0.0..3.0f64,
        ) {
            let law = Law { holds, bias, floor, ..Law::default() };
            fewest(&law, range(least, predicted)).unwrap();
            let mut tried = law.tried();
            prop_assert!(tried.len() <= TRIES && tried.iter().all(|count| (least..=MOST_STRIPS).contains(count)));
            tried.sort_unstable();
            prop_assert!(tried.windows(2).all(|pair| pair[0] < pair[1]), "{tried:?}");
        }
    }

    #[test]
    fn where_more_strips_do_not_help_the_best_of_them_stands() {
        let law = Law { holds: 3.0, floor: 2.0, bias: 1.0, ..Law::default() };
        fewest(&law, range(1, 4)).unwrap();
        assert!(law.tried().len() <= 2, "{:?}", law.tried());
    }

    #[test]
    fn what_is_refused_again_and_again_is_given_up() {
        let law = Law { holds: 3.0, bias: 1.0, refused: 70, ..Law::default() };
        assert_eq!(fewest(&law, range(1, 4)).unwrap_err().message, "no");
        assert_eq!(law.tried().len(), REFUSALS);
    }

    #[test]
    fn strips_divided_where_they_miss_end_the_search_unless_fewer_hold_undivided() {
        let divided = Law { holds: 21.0, bias: 1.45, mended: 1.3, ..Law::default() };
        assert_eq!(fewest(&divided, range(1, 20)).unwrap(), 22);
        assert_eq!(divided.tried(), [20]);
        let undivided = Law { holds: 19.5, bias: 1.6, ..divided };
        assert_eq!(fewest(&undivided, range(1, 20)).unwrap(), 20);
    }

    #[test]
    fn refused_numbers_are_passed() {
        let law = Law { holds: 3.0, bias: 1.0, refused: 5, ..Law::default() };
        assert_eq!(fewest(&law, range(1, 4)).unwrap(), 5);
    }
}
