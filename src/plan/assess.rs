//! What a strip's envelope does to the part, sampled densely between the instants that the fit saw.

use super::chart::Chart;
use super::fit::{BODY_MARGIN, SphereFamily, side_foot};
use crate::envelope::{NoContact, envelope_point};
use crate::motion::RuledMotion;
use crate::tool::Tool;

/// Deviation of one strip's envelope from the part, over the part of the surface that it covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Largest depth below the surface, mm, not negative.
    pub overcut: f64,
    /// Largest height above the surface, mm, not negative.
    pub undercut: f64,
    /// Deepest gouge by the flutes beside the strip, the shank or the holder, mm, not negative.
    pub outside: f64,
    /// Envelope points that lie over the surface.
    pub samples: usize,
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
    /// The strip leaves part of its band to nobody.
    #[error("at parameter {t:.3} the flank does not reach the strip's border")]
    Uncovered {
        /// Path parameter.
        t: f64,
    },
    /// Rails meet, or the surface has no normal.
    #[error("at parameter {t:.3} the motion or the surface is degenerate")]
    Degenerate {
        /// Path parameter.
        t: f64,
    },
}

/// The lines between which a strip must cover the surface: g from `low` to `high`, all h.
#[derive(Clone, Copy, Debug)]
pub(super) struct Borders {
    /// Lower border.
    pub(super) low: f64,
    /// Upper border.
    pub(super) high: f64,
}

impl Borders {
    /// False where an end of the flank, at share `k` of 0..=`top` and instant `j` of 0..=`end`, stops inside the band.
    fn passed(&self, (g, h): (f64, f64), (k, top): (usize, usize), (j, end): (usize, usize)) -> bool {
        let over = (0.0..=1.0).contains(&h);
        !(k == 0 && over && g > self.low
            || k == top && over && g < self.high
            || j == 0 && h > 0.0
            || j == end && h < 1.0)
    }
}

/// Samples the envelope at `instants` x `heights` points between the rails.
pub(super) fn assess(
    chart: &Chart<'_>,
    tool: &Tool,
    family: &SphereFamily,
    (motion, borders): (&RuledMotion, &Borders),
    (instants, heights): (usize, usize),
) -> Result<Deviation, AssessError> {
    let (start, end) = motion.domain();
    let mut worst = Deviation { overcut: 0.0, undercut: 0.0, outside: 0.0, samples: 0 };
    let mut near: Vec<Option<(f64, f64)>> = vec![None; heights];
    for j in 0..instants {
        let t = start + (end - start) * j as f64 / (instants - 1) as f64;
        let degenerate = AssessError::Degenerate { t };
        let rate = motion.pose_rate(t).ok_or(degenerate)?;
        let length = (motion.upper.point(t) - motion.lower.point(t)).norm();
        for (k, near) in near.iter_mut().enumerate() {
            let share = k as f64 / (heights - 1) as f64;
            let height = family.contact_height((motion.lower_height + share * length).min(family.highest()));
            let contact = tool.contact_at(height).ok_or(degenerate)?;
            let centre = rate.pose.at_height(contact.sphere_height());
            let guess = near.unwrap_or((share, j as f64 / (instants - 1) as f64));
            let below = chart.foot(&centre, guess).ok_or(degenerate)?;
            if !borders.passed(below.frame.place, (k, heights - 1), (j, instants - 1)) {
                return Err(AssessError::Uncovered { t });
            }
            let touch = match envelope_point(&rate, &contact, &-below.frame.normal) {
                Ok(touch) => touch,
                // Off the surface the motion may do as it likes.
                Err(_) if !below.frame.inside() => continue,
                Err(cause) => return Err(AssessError::NoContact { t, height, cause }),
            };
            let foot = chart.foot(&touch.point, below.frame.place).ok_or(degenerate)?;
            *near = Some(foot.frame.place);
            if foot.frame.inside() {
                worst.overcut = worst.overcut.max(-foot.distance);
                worst.undercut = worst.undercut.max(foot.distance);
                worst.samples += 1;
            }
        }
        worst.outside = worst.outside.max(gouge_beside(chart, family, motion, t).ok_or(degenerate)?);
    }
    Ok(worst)
}

/// Spans of the flutes above the strip at which their clearance is judged.
const SPANS_ABOVE: usize = 8;

/// Deepest gouge, mm, at `t` by the tool's spheres above and below the rails.
fn gouge_beside(chart: &Chart<'_>, family: &SphereFamily, motion: &RuledMotion, t: f64) -> Option<f64> {
    let (lower, upper) = (motion.lower.point(t), motion.upper.point(t));
    let length = (upper - lower).norm();
    let axis = (upper - lower) / length;
    let top = motion.lower_height + length;
    let above = (0..=SPANS_ABOVE).map(|i| {
        let height = top + (family.highest() - top).max(0.0) * i as f64 / SPANS_ABOVE as f64;
        (height, family.radius(height).0)
    });
    let mut near = chart.foot(&upper, (1.0, t))?.frame.place;
    let mut deepest: f64 = 0.0;
    let flutes = above.chain(family.below().iter().copied()).map(|sphere| (sphere, false));
    let body = family.body().iter().map(|sphere| (*sphere, true));
    for ((height, radius), straight) in flutes.chain(body) {
        if (motion.lower_height..top).contains(&height) {
            continue;
        }
        let centre = lower + axis * (height - motion.lower_height);
        let foot = chart.foot(&centre, near)?;
        near = foot.frame.place;
        let (foot, depth, margin) = if straight {
            let side = side_foot(chart, &centre, &axis, radius, &foot)?;
            (side, -side.distance, BODY_MARGIN)
        } else {
            (foot, radius - foot.distance, 0.0)
        };
        if foot.frame.within(margin) {
            deepest = deepest.max(depth);
        }
    }
    Some(deepest)
}
