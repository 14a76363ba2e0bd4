//! A strip's envelope as a function of the place on the part, over all of the flank from rim to rim: what its neighbours
//! meet.

use super::touch::{Hint, Probe};
use crate::tool::Tool;

/// Instants and heights at which an envelope is looked up.
const INSTANTS: usize = 121;
const HEIGHTS: usize = 11;
/// How far inside the ends of the flank its rims are taken, as a share of it.
const INSIDE: f64 = 1e-6;
/// How far beyond its rims an envelope is continued, as a share of the distance of its outermost lines.
const CONTINUED: f64 = 1.0;

/// An envelope point over the part.
#[derive(Clone, Copy, Debug)]
struct Mark {
    g: f64,
    h: f64,
    /// Signed deviation, mm.
    deviation: f64,
}

/// What lies under one contact height of the flank, along the motion.
#[derive(Clone, Debug)]
struct Line {
    height: f64,
    /// With h growing.
    marks: Vec<Mark>,
}

/// A strip's envelope.
#[derive(Clone, Debug)]
pub(super) struct Trace {
    lines: Vec<Line>,
}

/// An envelope over one line h = const, from rim to rim: contact height, g, deviation.
#[derive(Clone, Debug)]
pub(super) struct Section {
    points: Vec<[f64; 3]>,
}

/// Contact heights of the ends of the flank, mm: above the corner, and where the flutes end.
pub(super) fn rims(tool: &Tool) -> (f64, f64) {
    let (low, high) = (tool.flutes().last().map_or(0.0, |e| e.start().height), tool.flute_length());
    let inside = INSIDE * (high - low);
    (low + inside, high - inside)
}

impl Trace {
    /// Looks along all of a motion; `near` is where its first foot is about.
    pub(super) fn new(probe: &Probe<'_>, near: (f64, f64)) -> Self {
        let (low, high) = rims(probe.tool);
        let mut lines: Vec<Line> = (0..HEIGHTS)
            .map(|k| {
                let share = 0.5 - 0.5 * (std::f64::consts::PI * k as f64 / (HEIGHTS - 1) as f64).cos();
                Line { height: low + (high - low) * share, marks: Vec::with_capacity(INSTANTS) }
            })
            .collect();
        let (start, end) = probe.motion.domain();
        let mut hints: Vec<Option<Hint>> = vec![None; HEIGHTS];
        for j in 0..INSTANTS {
            let Some(at) = probe.instant(start + (end - start) * j as f64 / (INSTANTS - 1) as f64) else { continue };
            let mut last = near;
            for (line, known) in lines.iter_mut().zip(&mut hints) {
                let share = (line.height - probe.motion.lower_height) / at.length;
                let Some(hint) = known.or_else(|| probe.hint(&at, share, last)) else { continue };
                let Ok(touch) = probe.touch_at(&at, line.height, &hint) else { continue };
                let (g, h) = touch.foot.frame.place;
                (*known, last) = (Some(touch.hint()), (g, h));
                if line.marks.last().is_none_or(|mark| mark.h < h) {
                    line.marks.push(Mark { g, h, deviation: touch.foot.distance });
                }
            }
        }
        Self { lines }
    }

    /// The envelope over the line at `h`, as far as the motion passes it.
    pub(super) fn section(&self, h: f64) -> Section {
        let points = self.lines.iter().filter_map(|line| {
            let nodes = around(&line.marks, |mark| mark.h, h)?;
            let mark = |of: fn(&Mark) -> f64| lagrange(&nodes.map(|m| (m.h, of(m))), h).0;
            Some([line.height, mark(|m| m.g), mark(|m| m.deviation)])
        });
        Section { points: points.collect() }
    }
}

impl Section {
    /// g under the lowest and the highest point of the flank.
    pub(super) fn rims(&self) -> Option<(f64, f64)> {
        Some((self.points.first()?[1], self.points.last()?[1]))
    }

    /// Deviation over `g`, mm, and its rate of change with g; none far beyond the rims.
    pub(super) fn deviation(&self, g: f64) -> Option<(f64, f64)> {
        let nodes = around(&self.points, |point| point[1], g)?;
        Some(lagrange(&nodes.map(|point| (point[1], point[2])), g))
    }

    /// Contact height over `g`.
    pub(super) fn height(&self, g: f64) -> Option<f64> {
        let nodes = around(&self.points, |point| point[1], g)?;
        Some(lagrange(&nodes.map(|point| (point[1], point[0])), g).0)
    }
}

/// The four of `sorted` that lie around `at` by their key; none far outside all.
fn around<T>(sorted: &[T], key: impl Fn(&T) -> f64, at: f64) -> Option<[&T; 4]> {
    let after = sorted.partition_point(|item| key(item) < at);
    let first = after.saturating_sub(2).min(sorted.len().checked_sub(4)?);
    let [a, b, c, d] = sorted.get(first..first + 4)? else { return None };
    let keys = [a, b, c, d].map(&key);
    let (before, beyond) = (keys[0] - CONTINUED * (keys[1] - keys[0]), keys[3] + CONTINUED * (keys[3] - keys[2]));
    let grows = keys.windows(2).all(|pair| pair[0] < pair[1]);
    (grows && (before..=beyond).contains(&at)).then_some([a, b, c, d])
}

/// Value and derivative at `x` of the cubic through four points.
fn lagrange(nodes: &[(f64, f64); 4], x: f64) -> (f64, f64) {
    let (mut value, mut slope) = (0.0, 0.0);
    for (i, (xi, yi)) in nodes.iter().enumerate() {
        let others = || nodes.iter().enumerate().filter(move |(j, _)| *j != i).map(|(_, node)| node.0);
        let bottom: f64 = others().map(|xj| xi - xj).product();
        value += yi * others().map(|xj| x - xj).product::<f64>() / bottom;
        let [a, b, c] = {
            let mut rest = others();
            [(); 3].map(|()| rest.next().map_or(0.0, |xj| x - xj))
        };
        slope += yi * (a * b + b * c + c * a) / bottom;
    }
    (value, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_carried_exactly() {
        let of = |x: f64| (2.0 * x.powi(3) - x + 4.0, 6.0 * x * x - 1.0);
        let nodes = [0.0, 0.3, 1.0, 1.4].map(|x| (x, of(x).0));
        for x in [-0.2, 0.5, 1.4, 1.7] {
            let (value, slope) = lagrange(&nodes, x);
            assert!((value - of(x).0).abs() < 1e-12 && (slope - of(x).1).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn nothing_is_told_far_outside() {
        let keys = [0.0, 1.0, 2.0, 3.0, 4.0];
        let first = |at: f64| around(&keys, |k| *k, at).map(|nodes| *nodes[0]);
        assert_eq!([first(2.5), first(-0.5), first(4.5)], [Some(1.0), Some(0.0), Some(1.0)]);
        assert_eq!([first(-1.5), first(5.5)], [None, None]);
        assert!(around(&keys[..3], |k| *k, 1.0).is_none());
    }
}
