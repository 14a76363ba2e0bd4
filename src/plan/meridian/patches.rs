//! A surface that one sweep cannot make within the limit: the largest patch that one can is found together with the
//! tool, and what that leaves is planned on its own with the same tool, until all is covered or nothing is gained.

use super::problem::Band;
use super::radius::RadiusFunction;
use super::search::{Fitted, Search};
use crate::plan::chart::Chart;
use rayon::prelude::*;

/// Most sweeps.
const MOST: usize = 12;
/// Least share of a rectangle that a patch of it must have to count as gained.
const LEAST_GAIN: f64 = 0.1;
/// Rounds in which a patch may grow, and by how much at least.
const ROUNDS: usize = 4;
const GROWTH: f64 = 1.03;

impl Search<'_> {
    /// The sweeps that one tool makes patch by patch, from a single sweep that misses the limit; none where not even the
    /// first patch is worth it.
    pub(super) fn patches(&self, chart: &Chart<'_>, single: &Fitted) -> Option<Fitted> {
        let mut sweeps = self.largest_patch(chart, single)?;
        let radius = sweeps.radius.held();
        let mut rest = self.whole.without(sweeps.bands.first()?);
        while let Some(band) = widest(&mut rest) {
            if self.observer.stopped() || sweeps.bands.len() >= MOST {
                break;
            }
            let Some((sweep, left)) = self.patch_of(chart, &radius, band) else { continue };
            sweeps.motions.extend(sweep.motions);
            sweeps.bands.extend(sweep.bands);
            sweeps.judged.extend(sweep.judged);
            sweeps.steps += sweep.steps;
            rest.extend(left);
        }
        sweeps.seed = single.seed;
        Some(sweeps)
    }

    /// The largest patch within the limit, with its tool: grown from what the single sweep makes, and from halves and
    /// quarters of the surface.
    fn largest_patch(&self, chart: &Chart<'_>, single: &Fitted) -> Option<Fitted> {
        let least = LEAST_GAIN * self.whole.area();
        let mut starts: Vec<(Band, bool)> = self.whole.parts().into_iter().map(|part| (part, false)).collect();
        starts.extend(self.reached(chart, single).filter(|patch| patch.area() > least).map(|patch| (patch, true)));
        let grown: Vec<Fitted> = starts
            .into_par_iter()
            .filter_map(|(start, follow)| {
                let motion = single.motions.first().filter(|_| follow);
                self.grown(chart, self.sweep_over(chart, (single.radius.clone(), motion), start)?)
            })
            .collect();
        let grown = grown.into_iter().filter(|patch| area(patch) > least);
        grown.reduce(|best, next| if area(&next) > area(&best) { next } else { best })
    }

    /// The largest patch within the limit that a sweep over a smaller one leads to.
    fn grown(&self, chart: &Chart<'_>, start: Fitted) -> Option<Fitted> {
        let mut best: Option<Fitted> = None;
        let mut tried = start;
        for _ in 0..=ROUNDS {
            let patch = self.reached(chart, &tried);
            let known = best.as_ref().map_or(0.0, area);
            if tried.worst() <= self.limit && area(&tried) > known {
                best = Some(tried.clone());
            }
            let Some(patch) = patch.filter(|patch| patch.area() > GROWTH * known) else { break };
            let Some(next) = self.sweep_over(chart, (tried.radius.clone(), tried.motions.first()), patch) else {
                break;
            };
            tried = next;
        }
        best
    }

    /// The best sweep of a rectangle by a known tool, whole or its largest patch, and what that leaves of it.
    fn patch_of(&self, chart: &Chart<'_>, radius: &RadiusFunction, band: Band) -> Option<(Fitted, Vec<Band>)> {
        let whole = self.sweep_over(chart, (radius.clone(), None), band)?;
        let patch = whole.judged.first()?.largest_patch(&band, self.limit);
        let gained = patch.filter(|patch| patch.area() > LEAST_GAIN * band.area() && whole.worst() > self.limit);
        if let Some(patch) = gained
            && let Some(sweep) = self.sweep_over(chart, (radius.clone(), whole.motions.first()), patch)
            && sweep.share_within(self.limit) > whole.share_within(self.limit)
        {
            return Some((sweep, band.without(&patch)));
        }
        Some((whole, Vec::new()))
    }
}

/// Area of a single sweep's rectangle.
fn area(fitted: &Fitted) -> f64 {
    fitted.bands.first().map_or(0.0, Band::area)
}

/// Takes the largest rectangle out.
fn widest(rest: &mut Vec<Band>) -> Option<Band> {
    let areas = rest.iter().map(Band::area).enumerate();
    let (index, _) = areas.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))?;
    Some(rest.swap_remove(index))
}
