//! What a strip's error will be, foreseen from its rulings alone: tens of times cheaper than a fit.

use super::assess::Borders;
use super::chart::Chart;
use super::fit::SphereFamily;
use super::start::{Band, StripStart, start_strip};
use crate::diagnostic::Result;
use rayon::prelude::*;
use std::ops::Range;

/// Instants at which a strip is looked at.
const INSTANTS: usize = 13;
/// Largest error over root mean square of the misfit of a straight flank, both two-sided: 720^0.5 / 16.
const PEAK: f64 = 1.68;
/// Rounds in which borders are moved.
const ROUNDS: usize = 3;
/// Ratio of the largest error to the mean below which errors count as alike.
const ALIKE: f64 = 1.1;
/// How strongly widths answer errors, and the least share of the largest error that a strip counts with.
const ANSWER: f64 = 0.25;
const LEAST_SHARE: f64 = 0.2;

/// What strips in place of others have to spare, and the largest strain that their number answers.
const ROOM: f64 = 1.05;
const MOST: f64 = 4.0;

/// Largest error, mm, of both signs alike, foreseen for the strip between g = `low` and g = `high` without overlaps; `None`
/// where no ruling fits.
pub(super) fn bare_error(chart: &Chart<'_>, family: &SphereFamily, between: (f64, f64)) -> Option<f64> {
    bare_start(chart, family, between).map(|start| PEAK * start.misfit)
}

/// The same error, and half of what the tool above the strip adds to it where it must not enter the part, which no
/// narrower strip spares.
pub(super) fn bare_errors(chart: &Chart<'_>, family: &SphereFamily, between: (f64, f64)) -> Option<[f64; 2]> {
    bare_start(chart, family, between).map(|start| [PEAK * start.misfit, 0.5 * start.crowded])
}

fn bare_start(chart: &Chart<'_>, family: &SphereFamily, (low, high): (f64, f64)) -> Option<StripStart> {
    let (first, last) = chart.span(low, high);
    let borders = Borders { low, high, first, last };
    let band = Band { borders, low, high, overrun: 0.0, instants: INSTANTS, slanted: true };
    start_strip(chart, family, family.lowest(), &band)
}

/// The same for a band with its overlaps: where these take what the flank has to spare, nothing is left for slants.
pub(super) fn strip_error(chart: &Chart<'_>, family: &SphereFamily, band: &Band) -> Option<f64> {
    let band = Band { overrun: 0.0, instants: INSTANTS, ..*band };
    Some(PEAK * start_strip(chart, family, family.lowest(), &band)?.misfit)
}

/// Borders moved until the strips' foreseen errors, in any unit, are alike, or all below `enough`, no strip wider than
/// `widest` tells; with these errors.
pub(super) fn evened_ahead(
    mut borders: Vec<f64>,
    enough: f64,
    error: impl Fn((f64, f64)) -> f64 + Sync,
    widest: impl Fn(&[f64]) -> Result<Vec<f64>>,
) -> Result<(Vec<f64>, Vec<f64>)> {
    let mut best: Option<(f64, Vec<f64>, Vec<f64>)> = None;
    for _ in 0..=ROUNDS {
        let errors: Vec<f64> = borders.par_windows(2).map(|pair| error((pair[0], pair[1]))).collect();
        let worst = errors.iter().copied().fold(0.0, f64::max);
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        if best.as_ref().is_none_or(|(least, ..)| worst < *least) {
            best = Some((worst, borders.clone(), errors.clone()));
        }
        if worst <= enough || worst <= ALIKE * mean || !worst.is_finite() {
            break;
        }
        borders = evened(&borders, &errors, &widest(&borders)?);
    }
    Ok(best.map_or((borders, Vec::new()), |(_, borders, errors)| (borders, errors)))
}

/// Borders with the strips' widths changed against their errors, in any unit, none wider than it may be.
pub(super) fn evened(borders: &[f64], errors: &[f64], widest: &[f64]) -> Vec<f64> {
    let worst = errors.iter().copied().fold(0.0, f64::max);
    if !(worst > 0.0 && worst.is_finite()) {
        return borders.to_vec();
    }
    let answer = |error: &f64| (error / worst).max(LEAST_SHARE).powf(-ANSWER);
    let aims: Vec<f64> = borders.windows(2).zip(errors).map(|(pair, e)| (pair[1] - pair[0]) * answer(e)).collect();
    // Widths in proportion to the aims; what the widest may not take goes to the others.
    let mut held = vec![false; aims.len()];
    let widths = loop {
        let (mut room, mut aim) = (1.0, 0.0);
        for ((aimed, most), held) in aims.iter().zip(widest).zip(&held) {
            if *held { room -= most } else { aim += aimed }
        }
        if aim <= 0.0 || room <= 0.0 {
            return borders.to_vec();
        }
        let width = |i: usize| if held[i] { widest[i] } else { aims[i] * room / aim };
        let widths: Vec<f64> = (0..aims.len()).map(width).collect();
        let Some(over) = (0..aims.len()).find(|i| !held[*i] && widths[*i] > widest[*i]) else { break widths };
        held[over] = true;
    };
    let mut moved = borders.to_vec();
    for (i, width) in widths.iter().enumerate().take(aims.len() - 1) {
        moved[i + 1] = moved[i] + width;
    }
    moved
}

/// Neighbouring strips, and the borders of those that are to stand in their place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Run {
    /// Their places among all strips.
    pub(super) old: Range<usize>,
    /// Borders of the new ones.
    pub(super) borders: Vec<f64>,
}

/// More and narrower strips for every run of those whose strain is more than 1: as many as their errors ask for, which grow
/// with the square of the width, and `more` of them.
pub(super) fn narrowed(borders: &[f64], strains: &[f64], more: usize) -> Vec<Run> {
    let misses = |i: &usize| strains.get(*i).is_some_and(|strain| *strain > 1.0);
    let mut runs = Vec::new();
    let mut next = 0;
    while let Some(first) = (next..strains.len()).find(misses) {
        next = (first..strains.len()).find(|i| !misses(i)).unwrap_or(strains.len());
        let needed: Vec<f64> = strains[first..next].iter().map(|strain| ROOM * strain.min(MOST).sqrt()).collect();
        let all: f64 = needed.iter().sum();
        let count = (all.ceil() as usize).max(needed.len() + 1) + more;
        let mut new = vec![borders[first]];
        for k in 1..count {
            let mut share = all * k as f64 / count as f64;
            let inside = needed.iter().position(|need| {
                let here = share <= *need;
                share -= if here { 0.0 } else { *need };
                here
            });
            if let Some(i) = inside {
                let (low, high) = (borders[first + i], borders[first + i + 1]);
                new.push(low + (high - low) * share / needed[i]);
            }
        }
        new.push(borders[next]);
        runs.push(Run { old: first..next, borders: new });
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_strips_that_miss_are_divided_the_more_the_farther_they_miss() {
        let borders = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0];
        let runs = narrowed(&borders, &[1.05, 0.9, 1.0, 2.0, 9e9], 0);
        assert_eq!(runs.iter().map(|run| run.old.clone()).collect::<Vec<_>>(), [0..1, 3..5]);
        assert!(runs[0].borders.len() == 3 && (runs[0].borders[1] - 0.1).abs() < 1e-12, "{runs:?}");
        let widths: Vec<f64> = runs[1].borders.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert_eq!((runs[1].borders[0], runs[1].borders[widths.len()]), (0.6, 1.0));
        assert!(widths.len() > 3 && widths.windows(2).all(|pair| pair[0] > pair[1] - 1e-12), "{widths:?}");
        assert!(narrowed(&borders, &[1.0; 5], 0).is_empty());
        assert_eq!(narrowed(&borders, &[1.05, 0.9, 1.0, 1.0, 1.0], 1)[0].borders.len(), 4);
    }

    #[test]
    fn strips_with_larger_errors_become_narrower_and_none_wider_than_it_may_be() {
        let borders = [0.0, 0.25, 0.5, 0.75, 1.0];
        let moved = evened(&borders, &[4.0, 1.0, 1.0, 1.0], &[0.5, 0.5, 0.26, 0.5]);
        let widths: Vec<f64> = moved.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!((widths.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(widths[0] < 0.25 && widths[1] > 0.26 && (widths[2] - 0.26).abs() < 1e-12, "{widths:?}");
        assert!((widths[1] - widths[3]).abs() < 1e-12);
    }
}
