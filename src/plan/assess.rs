//! What a strip's envelope does to the part, sampled densely between the instants that the fit saw.

use super::chart::{Chart, Frame};
use super::fit::{BODY_MARGIN, SphereFamily, side_foot};
use super::touch::{Hint, NoTouch, Probe};
use crate::envelope::NoContact;
use crate::geometry::{Point, SurfacePlace};

/// Deviation of one strip's envelope from the part, over the part of the surface that it covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Largest depth below the surface, mm, not negative.
    pub overcut: f64,
    /// Largest height above the surface, mm, not negative.
    pub undercut: f64,
    /// Deepest gouge by the flutes beside the strip, the shank or the holder, mm, not negative.
    pub outside: f64,
    /// Envelope points that lie over the surface, or hardly beside it.
    pub samples: usize,
    /// Where the flank stops farthest short of what the strip is to cover; none where it covers all of it.
    pub bare: Option<Bare>,
}

/// A place that a strip leaves uncut though it is to cover it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bare {
    /// How far the flank stops short of the strip's border, mm.
    pub width: f64,
    /// Where, on the part.
    pub at: Point,
}

impl Deviation {
    /// Nothing seen yet.
    pub(super) const NONE: Self = Self { overcut: 0.0, undercut: 0.0, outside: 0.0, samples: 0, bare: None };
}

/// Why a strip's envelope cannot be judged.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(super) enum AssessError {
    /// The tool touches no envelope there.
    #[error("at parameter {t:.3} and height {height:.2} mm: {cause}")]
    NoContact {
        /// Path parameter.
        t: f64,
        /// Height above the tip, mm.
        height: f64,
        /// What is wrong.
        cause: NoContact,
    },
    /// Rails meet, or the surface has no normal.
    #[error("at parameter {t:.3} the motion or the surface is degenerate")]
    Degenerate {
        /// Path parameter.
        t: f64,
    },
}

/// The lines between which a strip must cover the surface: g from `low` to `high`, h from `first` to `last`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Borders {
    /// Lower border.
    pub(super) low: f64,
    /// Upper border.
    pub(super) high: f64,
    /// Least h of the surface between them.
    pub(super) first: f64,
    /// Greatest h of the surface between them.
    pub(super) last: f64,
}

/// Share of the surface, across the cut, that only a single sweep covers.
const ALONE: f64 = 0.99;

impl Borders {
    /// True for a single sweep over the whole surface, whose flank may be only just long enough for it.
    pub(super) fn alone(&self) -> bool {
        self.high - self.low >= ALONE
    }

    /// How far, mm, an end of the flank, at share `k` of 0..=`top` and instant `j` of 0..=`end`, stops inside the band; none
    /// where it passes its borders.
    fn short_by(&self, frame: &Frame, (k, top): (usize, usize), (j, end): (usize, usize)) -> Option<f64> {
        if !frame.inside() {
            return None;
        }
        let (g, h) = frame.place;
        let across = |short: f64| frame.across_gauge().map_or(0.0, |(_, rate)| short / rate);
        let along = |short: f64| frame.along_gauge().map_or(0.0, |(_, rate)| short / rate);
        let ends = [
            (k == 0 && g > self.low).then(|| across(g - self.low)),
            (k == top && g < self.high).then(|| across(self.high - g)),
            (j == 0 && h > self.first).then(|| along(h - self.first)),
            (j == end && h < self.last).then(|| along(self.last - h)),
        ];
        ends.into_iter().flatten().reduce(f64::max)
    }
}

/// One point at which the envelope was judged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judged {
    /// Path parameter.
    pub(super) t: f64,
    /// Share of the flank between the rails.
    pub(super) share: f64,
    /// Signed deviation, mm, positive above the surface; none beside the surface and what goes on like it.
    pub(super) deviation: Option<f64>,
    /// An end of the flank, or of its motion, that stops inside the band.
    pub(super) short: bool,
    /// Where the search for its foot may start.
    pub(super) hint: Hint,
}

/// A strip's envelope, judged on a grid.
#[derive(Clone, Debug)]
pub(super) struct Survey {
    /// Instant by instant, `heights` points each from the lower rail.
    pub(super) points: Vec<Judged>,
    /// Points an instant.
    pub(super) heights: usize,
    /// Deepest gouge beside the strip at each instant, mm, not negative.
    pub(super) gouges: Vec<f64>,
    /// The worst of them, and of the flutes, shank and holder beside the strip.
    pub(super) worst: Deviation,
}

/// Judges the envelope at `instants` x `heights` points between the rails.
pub(super) fn survey(
    probe: &Probe<'_>,
    borders: &Borders,
    (instants, heights): (usize, usize),
) -> Result<Survey, AssessError> {
    let (start, end) = probe.motion.domain();
    let mut worst = Deviation::NONE;
    let (mut points, mut gouges) = (Vec::with_capacity(instants * heights), Vec::with_capacity(instants));
    let mut near: Vec<Option<Hint>> = vec![None; heights];
    for j in 0..instants {
        let t = start + (end - start) * j as f64 / (instants - 1) as f64;
        let degenerate = AssessError::Degenerate { t };
        let at = probe.instant(t).ok_or(degenerate)?;
        for (k, near) in near.iter_mut().enumerate() {
            let share = k as f64 / (heights - 1) as f64;
            let guess = (borders.low + share * (borders.high - borders.low), borders.first);
            let hint = near.or_else(|| probe.hint(&at, share, guess)).ok_or(degenerate)?;
            let touch = match probe.touch(&at, share, &hint) {
                Ok(touch) => touch,
                // Off the surface the motion may do as it likes.
                Err(NoTouch::Envelope { over: false, .. }) => {
                    points.push(Judged { t, share, deviation: None, short: false, hint });
                    continue;
                }
                Err(NoTouch::Envelope { height, cause, .. }) => {
                    return Err(AssessError::NoContact { t, height, cause });
                }
                Err(NoTouch::Degenerate) => return Err(degenerate),
            };
            let frame = &touch.foot.frame;
            let short = borders.short_by(frame, (k, heights - 1), (j, instants - 1));
            if let Some(width) = short.filter(|width| worst.bare.is_none_or(|bare| bare.width < *width)) {
                worst.bare = Some(Bare { width, at: frame.point });
            }
            // A little beyond the edge counts too: the edge itself comes to lie between two instants.
            let counted = if borders.alone() { frame.inside() } else { frame.within(probe.chart.continued()) };
            let deviation = counted.then_some(touch.foot.distance);
            if let Some(distance) = deviation {
                worst.overcut = worst.overcut.max(-distance);
                worst.undercut = worst.undercut.max(distance);
                worst.samples += 1;
            }
            *near = Some(touch.hint());
            points.push(Judged { t, share, deviation, short: short.is_some(), hint: touch.hint() });
        }
        let ends = [near.first(), near.last()].map(|end| end.copied().flatten().map(|hint| hint.place));
        let [low, high] =
            [ends[0].unwrap_or((borders.low, borders.first)), ends[1].unwrap_or((borders.high, borders.first))];
        let (lower, upper) = (probe.motion.lower.point(t), probe.motion.upper.point(t));
        let stance = Stance { lower, upper, lower_height: probe.motion.lower_height, feet: [low, high] };
        let gouge = gouge_beside(probe.chart, probe.family, &stance).ok_or(degenerate)?.depth;
        worst.outside = worst.outside.max(gouge);
        gouges.push(gouge);
    }
    Ok(Survey { points, heights, gouges, worst })
}

/// Spans of the flutes above the strip at which their clearance is judged.
const SPANS_ABOVE: usize = 8;

/// The tool at one instant, its axis through two rail points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stance {
    /// Point on the lower rail, mm.
    pub(super) lower: Point,
    /// Point on the upper rail, mm.
    pub(super) upper: Point,
    /// Height above the tip of the point on the lower rail, mm.
    pub(super) lower_height: f64,
    /// Chart coordinates of their feet, about.
    pub(super) feet: [(f64, f64); 2],
}

/// Where the tool beside the strip cuts deepest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gouge {
    /// Depth, mm; not positive where all is clear.
    pub(super) depth: f64,
    /// Height above the tip, mm.
    pub(super) height: f64,
    /// Place on the part.
    pub(super) at: Point,
}

/// How far beyond the edge, as a share of the way that the surface goes on like itself, what is beside a strip counts: the
/// edge itself comes to lie between two instants.
const OVER_EDGE: f64 = 0.5;

/// The deepest gouge by the tool's spheres above and below the rails, by its shank and its holder. `None` where the
/// surface has no normal.
pub(super) fn gouge_beside(chart: &Chart<'_>, family: &SphereFamily, stance: &Stance) -> Option<Gouge> {
    let Stance { lower, upper, lower_height, feet: [low, high] } = *stance;
    let length = (upper - lower).norm();
    let axis = (upper - lower) / length;
    let top = lower_height + length;
    let above = (0..=SPANS_ABOVE).map(|i| {
        let height = top + (family.highest() - top).max(0.0) * i as f64 / SPANS_ABOVE as f64;
        (height, family.radius(height).0)
    });
    let mut deepest = Gouge { depth: 0.0, height: top, at: upper };
    let flutes = above.chain(family.below().iter().copied()).map(|sphere| (sphere, false));
    let body = family.body().iter().map(|sphere| (*sphere, true));
    let low = chart.seat(low);
    let (mut near, mut inside) = (chart.seat(high), None);
    for ((height, radius), straight) in flutes.chain(body) {
        if (lower_height..top).contains(&height) {
            continue;
        }
        let centre = lower + axis * (height - lower_height);
        // Each foot is looked for from its neighbour's: farther away another one may be found.
        let from = if height < lower_height { low } else { near };
        let foot = chart.foot_from(&centre, &from)?;
        if height >= top {
            near = foot.at;
        }
        let (foot, depth, margin) = if straight {
            let side = side_foot(chart, &centre, &axis, radius, &foot)?;
            (side, -side.distance, BODY_MARGIN)
        } else {
            (foot, radius - foot.distance, OVER_EDGE * chart.continued())
        };
        if foot.frame.within(margin) {
            if depth > deepest.depth {
                deepest = Gouge { depth, height, at: foot.frame.point };
            }
            inside = (height >= top && !straight).then_some((height, foot.at));
        } else if let Some((last, near)) = inside.take().filter(|_| height >= top && !straight) {
            // The surface ends between two spheres: the flank is often deepest at its edge.
            let of = |height: f64| (lower + axis * (height - lower_height), family.radius(height).0);
            let edge = gouge_at_edge(chart, of, (last, height), near)?;
            if edge.depth > deepest.depth {
                deepest = edge;
            }
        }
    }
    Some(deepest)
}

/// Halvings of the way between two spheres towards the surface's edge.
const HALVINGS: usize = 5;

/// The deepest gouge by spheres between a height at which they lie over the surface and one at which they no longer do;
/// `of` gives centre and radius.
fn gouge_at_edge(
    chart: &Chart<'_>,
    of: impl Fn(f64) -> (Point, f64),
    (mut from, mut to): (f64, f64),
    mut near: SurfacePlace,
) -> Option<Gouge> {
    let mut deepest = Gouge { depth: 0.0, height: from, at: of(from).0 };
    for _ in 0..HALVINGS {
        let height = 0.5 * (from + to);
        let (centre, radius) = of(height);
        let foot = chart.foot_from(&centre, &near)?;
        if foot.frame.within(OVER_EDGE * chart.continued()) {
            (from, near) = (height, foot.at);
            if radius - foot.distance > deepest.depth {
                deepest = Gouge { depth: radius - foot.distance, height, at: foot.frame.point };
            }
        } else {
            to = height;
        }
    }
    Some(deepest)
}
