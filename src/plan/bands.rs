//! The surface as bands between lines g = const: what a flank must reach to cut along one, and how finely it is looked at.

use super::assess::Borders;
use super::chart::{Chart, Frame};
use super::fit::SphereFamily;
use super::fitted::Resolution;
use super::start::{Band, ruling};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::Point;

/// Least overlap of strips over each other and over the surface's borders, mm, and as a share of a short flank.
const OVERLAP: f64 = 0.25;
const OVERLAP_SHARE: f64 = 0.03;
/// How far strips run past the surface's ends before they lead out, mm: far enough for the fit's free ends.
const OVERRUN: f64 = 3.0;
/// Share of the flank's spare length that overlap may take: slanted rulings need some too.
const SPARED: f64 = 0.8;
/// Share of the overlap that must be there in the end.
const MUST_OVERLAP: f64 = 0.33;
/// Share of its length by which a flank that is only just long enough may miss the borders.
const SLACK: f64 = 4e-4;
/// How far beyond the surface, as a share of its size, a ruling no longer tells what the flank must reach.
const ASIDE: f64 = 0.1;
/// Share of the flank that a strip may be widened to.
const WIDEST: f64 = 0.95;

/// A surface and a flank that is to cut it.
pub(super) struct Bands<'a> {
    pub(super) chart: Chart<'a>,
    pub(super) family: SphereFamily,
    /// False: rulings stand straight across the bands.
    pub(super) slanted: bool,
}

impl Bands<'_> {
    /// The widest that each strip may become, in g, with the flank that there is.
    pub(super) fn widest(&self, borders: &[f64]) -> Result<Vec<f64>> {
        let reach = WIDEST * (self.family.highest() - self.family.lowest());
        let width = |pair: &[f64]| {
            let (low, high) = (pair[0], pair[1]);
            let (first, last) = self.chart.span(low, high);
            let (needed, _) = self.longest_ruling(&Borders { low, high, first, last })?;
            Ok((high - low) * (reach / needed).max(1.0))
        };
        borders.windows(2).map(width).collect()
    }

    /// The longest flank, mm, that rulings straight across between two borders need, and where.
    fn longest_ruling(&self, borders: &Borders) -> Result<(f64, Point)> {
        let Borders { low, high, first, last } = *borders;
        let mut worst = (0.0, self.frame((low, first))?.point);
        for j in 0..=20 {
            let h = first + (last - first) * f64::from(j) / 20.0;
            let foot = self.frame((low, h))?;
            let [middle, head] = [0.5 * (low + high), high].map(|g| self.frame((g, h)));
            if foot.beyond.min(middle?.beyond).min(head?.beyond) > ASIDE {
                continue;
            }
            let found = ruling(&self.chart, &self.family, self.family.lowest(), (low, high), (h, h));
            let Some(needed) = found.map(|found| (found.upper - found.lower).norm()) else { continue };
            if needed > worst.0 {
                worst = (needed, foot.point);
            }
        }
        Ok(worst)
    }

    /// The tool must fit into the hollows of the part, across its axis.
    pub(super) fn check_concavity(&self) -> Result<()> {
        let radius = self.family.radius(self.family.lowest()).0.min(self.family.radius(self.family.highest()).0);
        let mut worst: Option<(f64, Point)> = None;
        for i in 0..=40 {
            for j in 0..=40 {
                let place = (f64::from(i) / 40.0, f64::from(j) / 40.0);
                let frame = self.frame(place)?;
                let Some((tangent, _)) = frame.along_gauge().filter(|_| frame.inside()) else { continue };
                let hollow = self.chart.curvature(place, &tangent).unwrap_or(0.0);
                if hollow * radius >= 1.0 && worst.is_none_or(|(w, _)| hollow > w) {
                    worst = Some((hollow, frame.point));
                }
            }
        }
        let Some((hollow, at)) = worst else { return Ok(()) };
        Err(Diagnostic::error(format!(
            "the tool is too big for the part: near ({:.3}, {:.3}, {:.3}) the surface is hollow with radius {:.3} mm across the axis, the slimmest part of the flank has {radius:.3} mm",
            at.x, at.y, at.z, 1.0 / hollow
        ))
        .help("use a tool with a smaller diameter, or another cutting direction"))
    }

    /// Values of g that divide the surface into `count` bands of equal mean width.
    pub(super) fn equal_borders(&self, count: usize) -> Result<Vec<f64>> {
        let fine = 200;
        let mut lengths = vec![0.0];
        for i in 0..fine {
            let mut step = 0.0;
            for j in 0..=8 {
                let g = |i: u32| f64::from(i) / f64::from(fine);
                let (first, last) = self.chart.span(g(i), g(i + 1));
                let at = |i: u32| self.frame((g(i), first + (last - first) * f64::from(j) / 8.0));
                step += (at(i + 1)?.point - at(i)?.point).norm();
            }
            lengths.push(lengths[i as usize] + step);
        }
        let total = lengths[fine as usize];
        let mut borders = vec![0.0];
        for i in 1..count {
            let wanted = total * i as f64 / count as f64;
            let at = lengths.partition_point(|l| *l < wanted).clamp(1, fine as usize);
            let share = (wanted - lengths[at - 1]) / (lengths[at] - lengths[at - 1]);
            borders.push((at as f64 - 1.0 + share) / f64::from(fine));
        }
        borders.push(1.0);
        Ok(borders)
    }

    /// The middle of the band between two lines.
    pub(super) fn middle(&self, (low, high): (f64, f64)) -> Result<Point> {
        let (first, last) = self.chart.span(low, high);
        Ok(self.frame((0.5 * (low + high), 0.5 * (first + last)))?.point)
    }

    fn frame(&self, place: (f64, f64)) -> Result<Frame> {
        self.chart.frame(place).ok_or_else(|| {
            Diagnostic::error(format!("the surface has no normal near {place:?} of its parameters"))
                .help("repair the surface: it has a fold or a pole there")
        })
    }

    pub(super) fn band(&self, low: f64, high: f64) -> Result<(Band, Resolution)> {
        let (mut narrow, mut wide, mut long) = (f64::INFINITY, 0.0_f64, 0.0);
        let (first, last) = self.chart.span(low, high);
        let mut before = self.frame((0.5 * (low + high), first))?.point;
        for j in 0..=8 {
            let h = first + (last - first) * f64::from(j) / 8.0;
            let (lower, upper) = (self.frame((low, h))?, self.frame((high, h))?);
            if lower.beyond.min(upper.beyond) <= ASIDE || narrow.is_infinite() {
                let width = (upper.point - lower.point).norm();
                (narrow, wide) = (narrow.min(width), wide.max(width));
            }
            let middle = self.frame((0.5 * (low + high), h))?.point;
            long += (middle - before).norm();
            before = middle;
        }
        let reach = self.family.highest() - self.family.lowest();
        let (needed, at) = self.longest_ruling(&Borders { low, high, first, last })?;
        if needed > reach * (1.0 + SLACK) {
            return Err(too_short(needed, reach, &at));
        }
        // A flank that is only just long enough has nothing left to overlap with.
        let spare = 0.5 * (reach - needed).max(0.0);
        let wanted = OVERLAP.min(OVERLAP_SHARE * reach).max(0.03 * narrow);
        let per_mm = (high - low) / narrow;
        let overlap = wanted.min(SPARED * spare) * per_mm;
        let margin = if spare < MUST_OVERLAP * wanted { -SLACK * reach * per_mm } else { MUST_OVERLAP * overlap };
        // A control point about every two millimetres; looked at twice as densely, so that nodes hide no overshoot.
        let controls = ((long / 2.0).ceil() as usize).clamp(24, 160);
        let heights = ((wide / 2.0).ceil() as usize + 6).clamp(8, 15);
        let resolution = Resolution { controls, instants: 2 * controls + 1, heights };
        let band = Band {
            // Neighbours overlap; each must cover a little more than its own band.
            borders: Borders { low: low - margin, high: high + margin, first, last },
            low: low - overlap,
            high: high + overlap,
            overrun: OVERRUN.min(reach) / long * (last - first),
            instants: resolution.instants,
            slanted: self.slanted,
        };
        Ok((band, resolution))
    }
}

fn too_short(needed: f64, reach: f64, at: &Point) -> Box<Diagnostic> {
    Diagnostic::error(format!(
        "the tool is too short by {:.3} mm: near ({:.2}, {:.2}, {:.2}) the strip needs {needed:.3} mm of flank, the tool has {reach:.3} mm",
        needed - reach, at.x, at.y, at.z
    ))
    .help("give a longer [tool] flute_length, a smaller [strategy] engage_from, or more strips")
}
