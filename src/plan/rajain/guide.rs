//! Guiding curves: level sets of a scalar function G on the design surface whose gradient is as near as can be to the
//! unit vectors across the wanted machining direction (Rajain 2023, section 5). Uses `diagnostic`, `geometry`,
//! `optimize` and the rest of this method.

use super::field::Wish;
use super::sheet::{Frame, Place, Sheet, inside};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Knots, Point, Vector};
use crate::optimize::NormalEquations;
use nalgebra::{Matrix2, Vector2};

/// Control coefficients of G along each parameter.
const CONTROLS: usize = 18;
/// Samples along each parameter at which the gradient is asked for.
const SAMPLES: usize = 52;
/// Weight of second differences of the coefficients against the gradient's error: what makes G fair.
const FAIRNESS: f64 = 1e-3;
/// Least share of the wanted gradient that must come out; less is a direction field with a zero or a whirl.
const LEAST_GRADIENT: f64 = 0.25;

/// The scalar function G, mm: nearly the distance across the machining direction, growing from tip to spindle.
#[derive(Clone, Debug)]
pub(super) struct Guide<'a> {
    sheet: Sheet<'a>,
    /// How far G is known past the edges, in scaled parameters.
    margin: Place,
    knots: [Knots; 2],
    coefficients: Vec<f64>,
}

/// G at a place.
#[derive(Clone, Copy, Debug)]
struct Value {
    /// G, mm.
    g: f64,
    /// Derivatives by the scaled parameters.
    slope: Vector2<f64>,
}

/// A point of a guiding curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct GuidePoint {
    /// The surface there.
    pub(super) frame: Frame,
    /// Unit tangent of the curve, in the sense of the cut.
    pub(super) tangent: Vector,
}

impl<'a> Guide<'a> {
    /// Solves for G, over the surface and `reach` mm around it. `across` is asked once a place, in rows: it gives the
    /// unit tangent across the machining direction, toward the spindle.
    pub(super) fn new(sheet: Sheet<'a>, wish: &Wish<'_>, reach: f64) -> Result<Self> {
        let degenerate = || {
            Diagnostic::error("the surface has no normal somewhere").help("repair the surface: it has a fold or a pole")
        };
        let (length_u, length_v) = sheet.lengths().ok_or_else(degenerate)?;
        let knots = Knots::clamped_uniform(3, CONTROLS).map_err(|e| Diagnostic::error(e.to_string()))?;
        let margin = (reach / length_u, reach / length_v);
        let mut guide =
            Self { sheet, margin, knots: [knots.clone(), knots], coefficients: vec![0.0; CONTROLS * CONTROLS] };
        let mut equations = NormalEquations::new(CONTROLS * CONTROLS, 3 * CONTROLS + 3);
        let frames = guide.frames();
        let across = wish.across(&frames, SAMPLES)?;
        for (frame, across) in frames.iter().zip(&across) {
            let (Some(frame), Some(across)) = (frame, across) else { continue };
            guide.ask(frame, across, &mut equations);
        }
        guide.make_fair(&mut equations);
        let mut solution: Vec<f64> = equations.gradient.iter().map(|g| -g).collect();
        let factor = equations.matrix.factor().ok_or_else(degenerate)?;
        factor.solve(&mut solution);
        guide.coefficients = solution;
        guide.check(&frames, &across)?;
        Ok(guide)
    }

    /// The sheet on a grid over surface and margin, in rows of [`SAMPLES`].
    fn frames(&self) -> Vec<Option<Frame>> {
        let at = |k: usize, margin: f64| -margin + (1.0 + 2.0 * margin) * k as f64 / (SAMPLES - 1) as f64;
        let places = (0..SAMPLES)
            .flat_map(|i| (0..SAMPLES).map(move |j| (i, j)))
            .map(|(i, j)| (at(i, self.margin.0), at(j, self.margin.1)));
        places.map(|place| self.sheet.frame(place)).collect()
    }

    /// Where the splines of G are evaluated for a place, and the factor of derivatives.
    fn spline_place(&self, place: Place) -> (Place, Place) {
        let width = (1.0 + 2.0 * self.margin.0, 1.0 + 2.0 * self.margin.1);
        (((place.0 + self.margin.0) / width.0, (place.1 + self.margin.1) / width.1), (1.0 / width.0, 1.0 / width.1))
    }

    /// Two rows: the gradient along `across` is 1, along the machining direction 0 (level sets run along it).
    fn ask(&self, frame: &Frame, across: &Vector, equations: &mut NormalEquations) {
        let ((s, t), scale) = self.spline_place(frame.place);
        let (u, v) = (self.knots[0].basis(s), self.knots[1].basis(t));
        let along = frame.normal.cross(across);
        // On the surface every sample counts the same; past its edges G is only to go on smoothly.
        let weight = if inside(frame.place) { 1.0 } else { 0.05 } / (SAMPLES * SAMPLES) as f64;
        for (direction, wanted) in [(across, 1.0), (&along, 0.0)] {
            let Some(components) = frame.components(direction) else { continue };
            let mut run = vec![0.0; 3 * CONTROLS + 4];
            for i in 0..4 {
                for j in 0..4 {
                    run[i * CONTROLS + j] = components.x * u.ders[1][i] * v.ders[0][j] * scale.0
                        + components.y * u.ders[0][i] * v.ders[1][j] * scale.1;
                }
            }
            equations.add(u.first * CONTROLS + v.first, &run, -wanted, weight);
        }
    }

    /// Differences of slopes between neighbouring coefficients both ways, which vanish where G is linear, and G = 0 in the
    /// middle.
    fn make_fair(&self, equations: &mut NormalEquations) {
        let weight = FAIRNESS / (CONTROLS * CONTROLS) as f64;
        let bend = |knots: &Knots, i: usize| {
            let rate = |k: usize| 1.0 / (CONTROLS as f64 * (knots.greville(k + 1) - knots.greville(k)));
            [rate(i), -rate(i) - rate(i + 1), rate(i + 1)]
        };
        for i in 0..CONTROLS {
            for j in 0..CONTROLS {
                let first = i * CONTROLS + j;
                if j + 2 < CONTROLS {
                    equations.add(first, &bend(&self.knots[1], j), 0.0, weight);
                }
                if i + 2 < CONTROLS {
                    let mut run = vec![0.0; 2 * CONTROLS + 1];
                    [run[0], run[CONTROLS], run[2 * CONTROLS]] = bend(&self.knots[0], i);
                    equations.add(first, &run, 0.0, weight);
                }
            }
        }
        equations.add(CONTROLS / 2 * (CONTROLS + 1), &[1.0], 0.0, 1e-3);
    }

    /// The gradient must follow the wish everywhere on the surface.
    fn check(&self, frames: &[Option<Frame>], across: &[Option<Vector>]) -> Result<()> {
        let mut worst: Option<(f64, Point)> = None;
        for (frame, across) in frames.iter().zip(across) {
            let (Some(frame), Some(across)) = (frame, across) else { continue };
            let Some(components) = frame.components(across) else { continue };
            let gained = self.value(frame.place).slope.dot(&components);
            if inside(frame.place) && worst.is_none_or(|(least, _)| gained < least) {
                worst = Some((gained, frame.point));
            }
        }
        let Some((_, at)) = worst.filter(|(gained, _)| *gained < LEAST_GRADIENT) else { return Ok(()) };
        Err(Diagnostic::error(format!(
            "no family of guiding curves follows the given directions near ({:.3}, {:.3}, {:.3}): they turn round a point or end in it",
            at.x, at.y, at.z
        ))
        .help("give directions that run side by side over the whole surface"))
    }

    fn value(&self, place: Place) -> Value {
        let ((s, t), scale) = self.spline_place(place);
        let (u, v) = (self.knots[0].basis(s), self.knots[1].basis(t));
        let mut value = Value { g: 0.0, slope: Vector2::zeros() };
        for i in 0..4 {
            for j in 0..4 {
                let c = self.coefficients[(u.first + i) * CONTROLS + v.first + j];
                value.g += c * u.ders[0][i] * v.ders[0][j];
                value.slope.x += c * u.ders[1][i] * v.ders[0][j] * scale.0;
                value.slope.y += c * u.ders[0][i] * v.ders[1][j] * scale.1;
            }
        }
        value
    }

    /// The sharpest hollow of the surface along the guiding curves: curvature, 1/mm, and where; none where all bulges.
    pub(super) fn sharpest_hollow(&self) -> Option<(f64, Point)> {
        let at = |k: usize| k as f64 / (SAMPLES - 1) as f64;
        let places = (0..SAMPLES).flat_map(|i| (0..SAMPLES).map(move |j| (at(i), at(j))));
        let hollows = places.filter_map(|place| {
            let GuidePoint { frame, tangent } = self.point(place, true)?;
            Some((self.sheet.curvature(place, &tangent)?, frame.point))
        });
        hollows.filter(|(hollow, _)| *hollow > 0.0).max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The surface it is on.
    pub(super) fn sheet(&self) -> Sheet<'a> {
        self.sheet
    }

    /// G at a place, mm.
    pub(super) fn level(&self, place: Place) -> f64 {
        self.value(place).g
    }

    /// Least and greatest G over the surface, mm.
    pub(super) fn range(&self) -> (f64, f64) {
        let steps = 100;
        let at = |k: i32| f64::from(k) / f64::from(steps);
        let values =
            (0..=steps).flat_map(|i| (0..=steps).map(move |j| (i, j))).map(|(i, j)| self.level((at(i), at(j))));
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), g| (low.min(g), high.max(g)))
    }

    /// True where G is known.
    fn knows(&self, (u, v): Place) -> bool {
        let within = |x: f64, margin: f64| (-margin..=1.0 + margin).contains(&x);
        within(u, self.margin.0) && within(v, self.margin.1)
    }

    /// The guiding curve's point at a place, its tangent in the sense of `n x grad G` (climb milling with the tip below)
    /// or against it.
    fn point(&self, place: Place, forward: bool) -> Option<GuidePoint> {
        let frame = self.sheet.frame(place)?;
        let slope = self.value(place).slope;
        // Along the level set: G_u du + G_v dv = 0.
        let along = frame.tangents * Vector2::new(-slope.y, slope.x);
        let tangent = along.try_normalize(1e-12)?;
        // The rate of G along n x tangent tells on which side G grows.
        let side = frame.components(&frame.normal.cross(&tangent))?.dot(&slope);
        let sense = if (side < 0.0) == forward { 1.0 } else { -1.0 };
        Some(GuidePoint { frame, tangent: tangent * sense })
    }

    /// The point nearest `start` at which G is `level`.
    pub(super) fn onto(&self, start: Place, level: f64, forward: bool) -> Option<GuidePoint> {
        let anchor = self.point(start, forward)?;
        self.crossing(start, level, &anchor.frame.point, &anchor.tangent, forward)
    }

    /// Where the plane through `at` across `normal` meets the guiding curve of `level`, found from `start`: a base point
    /// (Rajain 2023, Fig. 10). `None` where they do not meet in what is known of G (Remark 1).
    pub(super) fn crossing(
        &self,
        start: Place,
        level: f64,
        at: &Point,
        normal: &Vector,
        forward: bool,
    ) -> Option<GuidePoint> {
        self.solve(start, level, forward, |frame| {
            let off = (frame.point - at).dot(normal);
            (off, frame.tangents.transpose() * normal)
        })
    }

    /// The point of the same guiding curve at chord `step` mm from `from`, along its tangent, or against it when
    /// negative.
    pub(super) fn next(&self, from: &GuidePoint, level: f64, step: f64, forward: bool) -> Option<GuidePoint> {
        let move_by = from.frame.components(&(from.tangent * step))?;
        let start = (from.frame.place.0 + move_by.x, from.frame.place.1 + move_by.y);
        let at = from.frame.point;
        self.solve(start, level, forward, |frame| {
            let chord = frame.point - at;
            let length = chord.norm();
            (length - step.abs(), frame.tangents.transpose() * chord / length.max(1e-12))
        })
    }

    /// Newton's method for G = level together with one more equation, in mm.
    fn solve(
        &self,
        start: Place,
        level: f64,
        forward: bool,
        other: impl Fn(&Frame) -> (f64, Vector2<f64>),
    ) -> Option<GuidePoint> {
        let mut place = start;
        for _ in 0..40 {
            let frame = self.sheet.frame(place)?;
            let value = self.value(place);
            let (off, slope) = other(&frame);
            let matrix = Matrix2::new(value.slope.x, value.slope.y, slope.x, slope.y);
            let step = matrix.try_inverse()? * Vector2::new(level - value.g, -off);
            // No farther at once than a quarter of the surface.
            let most = step.amax();
            let factor = if most > 0.25 { 0.25 / most } else { 1.0 };
            place = (place.0 + factor * step.x, place.1 + factor * step.y);
            if !self.knows(place) {
                return None;
            }
            if most < 1e-11 {
                return self.point(place, forward);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::field::{Source, Wish};
    use super::super::fixtures::{graph, saddle};
    use super::*;

    fn guide(spline: &crate::part::OrientedSpline, direction: Vector) -> Guide<'_> {
        let sheet = Sheet::new(spline);
        let wish = Wish { source: Source::Vector(direction), toward: Vector::y() };
        Guide::new(sheet, &wish, 2.0).unwrap()
    }

    #[test]
    fn on_a_plane_the_levels_are_straight_lines_at_their_distance() {
        let plane = graph(20.0, 10.0, |x, y| 0.3 * x + 0.1 * y);
        let guide = guide(&plane, Vector::new(1.0, 0.2, 0.0));
        let first = guide.onto((0.5, 0.5), 1.0, true).unwrap();
        let second = guide.next(&first, 1.0, 3.0, true).unwrap();
        assert!((first.tangent - second.tangent).norm() < 1e-6);
        assert!(((second.frame.point - first.frame.point).norm() - 3.0).abs() < 1e-9);
        let across = guide.crossing((0.5, 0.5), 3.0, &first.frame.point, &first.tangent, true).unwrap();
        assert!(((across.frame.point - first.frame.point).norm() - 2.0).abs() < 1e-5);
    }

    #[test]
    fn levels_follow_the_direction_in_the_sense_of_the_cut() {
        let spline = saddle();
        let guide = guide(&spline, Vector::x());
        for place in [(0.1, 0.2), (0.5, 0.5), (0.9, 0.7)] {
            let level = guide.level(place);
            let forward = guide.onto(place, level, true).unwrap();
            let backward = guide.onto(place, level, false).unwrap();
            // n x e with e = +y and n = +z is -x.
            assert!(forward.tangent.x < -0.97 && backward.tangent.x > 0.97, "{forward:?}");
        }
        let (low, high) = guide.range();
        assert!((7.9..8.6).contains(&(high - low)), "{low} {high}");
    }
}
