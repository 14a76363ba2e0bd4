//! What came of the bands: their strips, or why there is none, and how far all of them are from holding the limits.
//! Uses `diagnostic` and `geometry`.

use super::fitted::FittedStrip;
use super::limits::Limits;
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::Point;

/// A band between two lines g = const, and what came of it.
#[derive(Clone, Debug)]
pub(super) struct Laid {
    /// g of its lower line, without overlap.
    pub(super) low: f64,
    /// g of its upper line, without overlap.
    pub(super) high: f64,
    /// Its strip, or why none could be laid.
    pub(super) strip: Result<FittedStrip>,
}

impl Laid {
    /// The largest error as a share of its limit; beyond all bounds where nothing is cut.
    pub(super) fn strain(&self, limits: &Limits) -> f64 {
        self.strip.as_ref().map_or(f64::INFINITY, |strip| limits.strain(&strip.deviation))
    }
}

/// What lies uncut between two strips, or beside the outermost.
#[derive(Clone, Debug, PartialEq)]
pub struct Gap {
    /// Number of strips before it.
    pub before: usize,
    /// A place in its middle.
    pub at: Point,
    /// Why no strip could be laid along its first band.
    pub why: String,
}

/// How far strips are from holding: the width in g of what is left to none, then the largest strain of the rest. Compared
/// in this order.
pub(super) type Worth = (f64, f64);

/// How far these are.
pub(super) fn worth(laid: &[Laid], limits: &Limits) -> Worth {
    let (mut missing, mut largest) = (0.0, 0.0_f64);
    for band in laid {
        match &band.strip {
            Ok(strip) => largest = largest.max(limits.strain(&strip.deviation)),
            Err(_) => missing += band.high - band.low,
        }
    }
    (missing, largest)
}

/// The largest strain.
pub(super) fn strain(laid: &[Laid], limits: &Limits) -> f64 {
    laid.iter().map(|band| band.strain(limits)).fold(0.0, f64::max)
}

/// The lines g = const between bands, and the surface's ends.
pub(super) fn borders_of(laid: &[Laid]) -> Vec<f64> {
    laid.first().map(|band| band.low).into_iter().chain(laid.iter().map(|band| band.high)).collect()
}

/// The strips, and what lies between them; refused where there is none at all. `middle` gives the middle of the band
/// between two lines.
pub(super) fn parted(
    laid: Vec<Laid>,
    middle: impl Fn((f64, f64)) -> Result<Point>,
) -> Result<(Vec<FittedStrip>, Vec<Gap>)> {
    let (mut strips, mut gaps, mut refused) = (Vec::with_capacity(laid.len()), Vec::<Gap>::new(), None);
    let count = laid.len();
    // Neighbouring bands without strips are one gap.
    let mut begun: Option<f64> = None;
    for (index, Laid { low, high, strip }) in laid.into_iter().enumerate() {
        match strip {
            Ok(strip) => {
                strips.push(strip);
                begun = None;
            }
            Err(error) => {
                let from = *begun.get_or_insert(low);
                let at = middle((from, high))?;
                match gaps.last_mut().filter(|_| from < low) {
                    Some(gap) => gap.at = at,
                    None => gaps.push(Gap { before: strips.len(), at, why: error.message.clone() }),
                }
                refused = refused.or(Some(named(error, index, count)));
            }
        }
    }
    match refused.filter(|_| strips.is_empty()) {
        Some(error) => Err(error),
        None => Ok((strips, gaps)),
    }
}

/// Says which strip an error is about.
fn named(mut error: Box<Diagnostic>, index: usize, count: usize) -> Box<Diagnostic> {
    error.message = format!("strip {} of {count}: {}", index + 1, error.message);
    error
}

#[cfg(test)]
mod tests {
    use super::super::assess::{Borders, Deviation};
    use super::super::fitted::{Look, Resolution};
    use super::*;
    use crate::geometry::{Knots, SplineCurve};
    use crate::motion::RuledMotion;

    fn none(low: f64, high: f64) -> Laid {
        Laid { low, high, strip: Err(Diagnostic::error("no")) }
    }

    fn some(low: f64, high: f64) -> Laid {
        let rail = |y: f64| {
            let control = (0..4).map(|i| Point::new(f64::from(i), y, 0.0)).collect();
            SplineCurve::from_knots(Knots::clamped_uniform(3, 4).unwrap(), control).unwrap()
        };
        let strip = FittedStrip {
            motion: RuledMotion { lower: rail(low), upper: rail(high), lower_height: 0.0 },
            deviation: Deviation::NONE,
            steps: 0,
            borders: Borders { low, high, first: 0.0, last: 1.0 },
            resolution: Resolution { controls: 4, instants: 9, heights: 5 },
            look: Look::Dense,
        };
        Laid { low, high, strip: Ok(strip) }
    }

    #[test]
    fn neighbouring_bands_without_strips_are_one_gap() {
        let middle = |(low, high): (f64, f64)| Ok(Point::new(0.5 * (low + high), 0.0, 0.0));
        let laid = vec![none(0.0, 0.1), some(0.1, 0.3), none(0.3, 0.4), none(0.4, 0.5), none(0.5, 0.7), some(0.7, 1.0)];
        let (strips, gaps) = parted(laid, middle).unwrap();
        assert_eq!(strips.len(), 2);
        let places: Vec<(usize, f64)> = gaps.iter().map(|gap| (gap.before, gap.at.x)).collect();
        assert_eq!(places, [(0, 0.05), (1, 0.5)]);
    }

    #[test]
    fn where_nothing_at_all_is_laid_the_first_refusal_stands_with_its_strip() {
        let middle = |(low, high): (f64, f64)| Ok(Point::new(0.5 * (low + high), 0.0, 0.0));
        let refused = parted(vec![none(0.0, 0.5), none(0.5, 1.0)], middle).unwrap_err();
        assert_eq!(refused.message, "strip 1 of 2: no");
        let limits = Limits { overcut: 0.01, undercut: 0.01 };
        assert!(worth(&[none(0.0, 0.5)], &limits) < worth(&[none(0.0, 0.5), none(0.5, 1.0)], &limits));
        assert_eq!(strain(&[none(0.0, 1.0)], &limits), f64::INFINITY);
        assert_eq!(borders_of(&[none(0.0, 0.5), none(0.5, 1.0)]), [0.0, 0.5, 1.0]);
    }
}
