//! What a sweep's envelope leaves of its band: largest errors of both signs, and which part of the band lies within a
//! limit. Sampled densely between the instants that the fit saw.

use super::problem::Band;
use super::radius::RadiusFunction;
use crate::envelope::envelope_point;
use crate::motion::RuledMotion;
use crate::plan::chart::Chart;

/// Cells along each side of the raster on which a band's coverage is seen.
const CELLS: usize = 96;

/// The envelope's error over one band.
#[derive(Clone, Debug)]
pub(super) struct Judgement {
    pub(super) overcut: f64,
    pub(super) undercut: f64,
    /// Deepest cut below the part outside the band, mm.
    pub(super) outside: f64,
    /// Chart coordinates of the largest error.
    pub(super) worst_at: (f64, f64),
    /// Root mean square error, mm.
    pub(super) rms: f64,
    /// Envelope points over the band.
    pub(super) samples: usize,
    /// Row by row along h, one row a step of g: largest error met in the cell, none where no envelope point fell.
    raster: Vec<Option<f64>>,
}

/// An envelope point over the chart.
#[derive(Clone, Copy)]
struct Touch {
    place: (f64, f64),
    error: f64,
}

impl Judgement {
    /// Largest error of either sign, mm.
    pub(super) fn worst(&self) -> f64 {
        self.overcut.max(self.undercut)
    }

    /// Share of the band that the envelope covers with an error up to `limit`.
    pub(super) fn share_within(&self, limit: f64) -> f64 {
        let within = self.raster.iter().flatten().filter(|error| **error <= limit).count();
        within as f64 / self.raster.len() as f64
    }

    /// Share of the band that the envelope covers at all.
    pub(super) fn covered(&self) -> f64 {
        self.share_within(f64::INFINITY)
    }

    /// The largest rectangle of the band, in chart coordinates, all of which is covered with an error up to `limit`.
    pub(super) fn largest_patch(&self, band: &Band, limit: f64) -> Option<Band> {
        let good = |row: usize, column: usize| self.raster[row * CELLS + column].is_some_and(|e| e <= limit);
        let (area, [top, bottom, left, right]) = largest_rectangle(CELLS, good)?;
        let g = |cell: usize| band.low + (band.high - band.low) * cell as f64 / CELLS as f64;
        let h = |cell: usize| band.start + (band.end - band.start) * cell as f64 / CELLS as f64;
        (area > 0).then(|| Band { low: g(top), high: g(bottom), start: h(left), end: h(right) })
    }
}

/// Largest rectangle of good cells: rows `top..bottom`, columns `left..right`. Under each row the heights of the good
/// columns above form a histogram; a stack of rising bars finds its largest rectangle.
fn largest_rectangle(size: usize, good: impl Fn(usize, usize) -> bool) -> Option<(usize, [usize; 4])> {
    let mut heights = vec![0usize; size + 1];
    let mut best: Option<(usize, [usize; 4])> = None;
    for row in 0..size {
        for (column, height) in heights.iter_mut().enumerate().take(size) {
            *height = if good(row, column) { *height + 1 } else { 0 };
        }
        let mut rising: Vec<(usize, usize)> = Vec::new();
        for (column, height) in heights.iter().enumerate() {
            let mut left = column;
            while let Some(&(from, bar)) = rising.last().filter(|(_, bar)| bar > height) {
                rising.pop();
                left = from;
                let area = bar * (column - from);
                if best.is_none_or(|(most, _)| area > most) {
                    best = Some((area, [row + 1 - bar, row + 1, from, column]));
                }
            }
            rising.push((left, *height));
        }
    }
    best
}

/// Samples the envelope at `instants` x `heights` over a band of the `whole`. None where the motion or the surface is
/// degenerate.
pub(super) fn judge(
    chart: &Chart<'_>,
    (motion, radius): (&RuledMotion, &RadiusFunction),
    (band, whole): (&Band, &Band),
    (instants, heights): (usize, usize),
) -> Option<Judgement> {
    let mut judged = Judgement {
        overcut: 0.0,
        undercut: 0.0,
        outside: 0.0,
        worst_at: (band.low, band.start),
        rms: 0.0,
        samples: 0,
        raster: vec![None; CELLS * CELLS],
    };
    let mut before: Vec<Option<Touch>> = vec![None; heights];
    let (start, end) = motion.domain();
    for j in 0..instants {
        let t = start + (end - start) * j as f64 / (instants - 1) as f64;
        let touches = touches(chart, (motion, radius), band, t, &before)?;
        for touch in touches.iter().flatten().filter(|touch| whole.holds(touch.place)) {
            if !band.holds(touch.place) {
                judged.outside = judged.outside.max(-touch.error);
                continue;
            }
            if touch.error.abs() > judged.worst() {
                judged.worst_at = touch.place;
            }
            judged.overcut = judged.overcut.max(-touch.error);
            judged.undercut = judged.undercut.max(touch.error);
            judged.rms += touch.error * touch.error;
            judged.samples += 1;
        }
        for k in 1..if j > 0 { heights } else { 0 } {
            if let (Some(a), Some(b), Some(c), Some(d)) = (before[k - 1], before[k], touches[k - 1], touches[k]) {
                fill(&mut judged.raster, band, [a, b, c]);
                fill(&mut judged.raster, band, [d, b, c]);
            }
        }
        before = touches;
    }
    judged.rms = (judged.rms / judged.samples.max(1) as f64).sqrt();
    Some(judged)
}

/// Envelope points at one instant; none where the tool touches no envelope.
fn touches(
    chart: &Chart<'_>,
    (motion, radius): (&RuledMotion, &RadiusFunction),
    band: &Band,
    t: f64,
    before: &[Option<Touch>],
) -> Option<Vec<Option<Touch>>> {
    let rate = motion.pose_rate(t)?;
    let (start, end) = motion.domain();
    let length = (motion.upper.point(t) - motion.lower.point(t)).norm();
    let heights = before.len();
    let mut near: Option<(f64, f64)> = None;
    let mut touches = Vec::with_capacity(heights);
    for (k, before) in before.iter().enumerate() {
        let share = k as f64 / (heights - 1) as f64;
        let s = share * length.min(radius.length());
        let jet = radius.jet(s);
        let mut contact = jet.contact(s);
        contact.point.height += motion.lower_height;
        let centre = rate.pose.at_height(s + motion.lower_height);
        let time = (t - start) / (end - start);
        let guess = before
            .map(|touch| touch.place)
            .or(near)
            .unwrap_or((band.low + share * (band.high - band.low), band.start + time * (band.end - band.start)));
        let below = chart.foot(&centre, guess)?;
        near = Some(below.frame.place);
        touches.push(match envelope_point(&rate, &contact, &-below.frame.normal) {
            Ok(touch) => {
                let foot = chart.foot(&touch.point, below.frame.place)?;
                Some(Touch { place: foot.frame.place, error: foot.distance })
            }
            Err(_) => None,
        });
    }
    Some(touches)
}

/// Notes the largest of three errors in every cell whose centre lies in their triangle.
fn fill(raster: &mut [Option<f64>], band: &Band, touches: [Touch; 3]) {
    let error = touches.iter().map(|touch| touch.error.abs()).fold(0.0, f64::max);
    let size = CELLS as f64;
    let cell = |place: (f64, f64)| {
        let g = (place.0 - band.low) / (band.high - band.low);
        let h = (place.1 - band.start) / (band.end - band.start);
        (g * size - 0.5, h * size - 0.5)
    };
    let [a, b, c] = touches.map(|touch| cell(touch.place));
    let range = |x: [f64; 3]| {
        let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        (low.ceil().max(0.0) as usize, (high.floor() + 1.0).clamp(0.0, size) as usize)
    };
    let (rows, columns) = (range([a.0, b.0, c.0]), range([a.1, b.1, c.1]));
    let turn = |p: (f64, f64), q: (f64, f64), r: (f64, f64)| (q.0 - p.0) * (r.1 - p.1) - (q.1 - p.1) * (r.0 - p.0);
    for row in rows.0..rows.1 {
        for column in columns.0..columns.1 {
            let at = (row as f64, column as f64);
            let turns = [turn(a, b, at), turn(b, c, at), turn(c, a, at)];
            if turns.iter().all(|t| *t >= -1e-9) || turns.iter().all(|t| *t <= 1e-9) {
                let entry = &mut raster[row * CELLS + column];
                *entry = Some(entry.map_or(error, |known| known.max(error)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn largest_rectangle_is_found_beside_a_hole() {
        // A hole of 3 x 3 in a square of 10 x 10 from (2, 4): below it lie 5 full rows.
        let good = |row: usize, column: usize| !((2..5).contains(&row) && (4..7).contains(&column));
        assert_eq!(largest_rectangle(10, good), Some((50, [5, 10, 0, 10])));
        assert_eq!(largest_rectangle(4, |_, _| true), Some((16, [0, 4, 0, 4])));
        assert_eq!(largest_rectangle(4, |_, _| false), None);
    }

    #[test]
    fn triangles_fill_the_cells_they_cover() {
        let mut raster = vec![None; CELLS * CELLS];
        let touch = |g: f64, h: f64| Touch { place: (g, h), error: -0.5 };
        fill(&mut raster, &Band::inside(0.0), [touch(0.0, 0.0), touch(1.0, 0.0), touch(0.0, 1.0)]);
        let filled = raster.iter().flatten().count() as f64;
        let half = (CELLS * (CELLS + 1) / 2) as f64;
        assert!((filled - half).abs() < 1.0, "{filled} {half}");
        fill(&mut raster, &Band::inside(0.0), [touch(2.0, 2.0), touch(1.5, 2.0), touch(2.0, 1.5)]);
        assert_eq!(raster.iter().flatten().count() as f64, filled);
    }
}
