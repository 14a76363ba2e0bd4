//! Strips in the number that the tolerance needs, as the search over numbers asks for them: fitted as far as tells whether
//! a number holds, those that miss the limits divided.

use super::Method;
use super::counts::{Counts, MOST_STRIPS, Trial};
use super::forecast::{Run, narrowed};
use super::laid::{Laid, borders_of, strain, worth};
use super::planner::Planner;
use crate::diagnostic::Result;

/// Strips fitted first where the number may still change: those foreseen to err most.
const PROBED: usize = 8;
/// Share of the limits from which on their errors miss them so clearly that the rest is not fitted.
const MISSED: f64 = 1.5;
/// One strip in so many may miss the limits whatever their number: it is divided.
const OUTLYING: usize = 5;
/// Rounds in which strips that miss the limits are divided.
const MENDINGS: usize = 4;
/// Share of their strain that strips must be left with for those that still miss to be divided once more: what is in the way
/// beside the flank stays in the way of narrower ones.
const HELPED: f64 = 0.5;

impl Planner<'_> {
    /// Strips that miss the limits divided into more and narrower ones, those that hold left as they are.
    pub(super) fn mended(&self, mut laid: Vec<Laid>) -> Vec<Laid> {
        let limits = self.limits();
        let (mut once, mut left) = (Vec::<(f64, f64)>::new(), Vec::<(f64, f64)>::new());
        for more in 0..MENDINGS {
            let given_up = |band: &Laid| left.iter().any(|(low, high)| band.low < *high && band.high > *low);
            let strain = |band: &Laid| if given_up(band) { 0.0 } else { band.strain(&limits) };
            let strains: Vec<f64> = laid.iter().map(strain).collect();
            let runs = narrowed(&borders_of(&laid), &strains, more);
            let most = runs.iter().map(|run| run.borders.len() - 1).sum::<usize>() + laid.len();
            if runs.is_empty() || most > MOST_STRIPS || self.observer().stopped() {
                break;
            }
            // From the last on, so that the places of those before stay.
            for Run { old, borders } in runs.into_iter().rev() {
                let found = self.fit(&borders);
                let Some(before) = laid.get(old.clone()).map(|before| worth(before, &limits)) else { continue };
                let after = worth(&found, &limits);
                if after.0 >= before.0 && after.1 > (HELPED * before.1).max(1.0) {
                    let failed = found.first().zip(found.last()).map(|(first, last)| (first.low, last.high));
                    // Once more of them may still do.
                    let known = |(low, high): &(f64, f64)| once.iter().any(|(a, b)| low < b && high > a);
                    left.extend(failed.filter(known));
                    once.extend(failed);
                }
                if after < before {
                    laid.splice(old, found);
                }
            }
        }
        laid
    }

    /// What came of strips that are as many as the search asked for, divided where they miss the limits.
    fn whole_of(&self, laid: Vec<Laid>) -> Trial<Vec<Laid>> {
        let limits = self.limits();
        let undivided = strain(&laid, &limits);
        if undivided <= 1.0 {
            return Trial::Whole(laid, undivided);
        }
        let usual = self.usual_strain(&laid, laid.len());
        let laid = self.mended(laid);
        let strain = strain(&laid, &limits);
        if strain <= 1.0 || usual <= 1.0 { Trial::Mended(laid, strain) } else { Trial::Whole(laid, strain) }
    }

    /// Largest strain of strips fitted of `count` in all, but for the few that are divided in the end.
    fn usual_strain(&self, laid: &[Laid], count: usize) -> f64 {
        let limits = self.limits();
        let mut strains: Vec<f64> = laid.iter().map(|band| band.strain(&limits)).collect();
        strains.sort_by(|a, b| b.total_cmp(a));
        strains.get(count / OUTLYING).copied().unwrap_or(0.0)
    }
}

impl Counts for Planner<'_> {
    type Strips = Vec<Laid>;

    fn foreseen(&self, count: usize) -> Result<f64> {
        Ok(self.ahead(count, true)?.1.into_iter().fold(0.0, f64::max))
    }

    /// Strips as [`Planner::even`] fits them, unless those that are foreseen to err most clearly miss the limits.
    fn trial(&self, count: usize) -> Result<Trial<Vec<Laid>>> {
        if count <= PROBED || self.method() == Method::Rulings {
            return self.even(count).map(|laid| self.whole_of(laid));
        }
        let (borders, foreseen) = self.ahead(count, true)?;
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| foreseen[*b].total_cmp(&foreseen[*a]));
        let (mut laid, mut rest) = (Vec::with_capacity(count), order.as_slice());
        while !rest.is_empty() {
            let (next, later) = rest.split_at(rest.len().min(laid.len().max(PROBED)));
            laid.extend(self.fit_some(&borders, next));
            let strain = self.usual_strain(&laid, count);
            if strain > MISSED && !self.observer().stopped() {
                return Ok(Trial::Missed(strain));
            }
            rest = later;
        }
        let mut placed: Vec<(usize, Laid)> = order.into_iter().zip(laid).collect();
        placed.sort_by_key(|(index, _)| *index);
        Ok(self.whole_of(placed.into_iter().map(|(_, band)| band).collect()))
    }

    fn size(laid: &Vec<Laid>) -> usize {
        laid.len()
    }

    fn whole(&self, count: usize) -> Result<Vec<Laid>> {
        self.even(count).map(|laid| self.mended(laid))
    }

    fn stopped(&self) -> bool {
        self.observer().stopped()
    }
}
