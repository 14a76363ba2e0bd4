//! Line-driven starts: a straight line over the part is a good axis where it can move so that all its points keep their
//! distance from the part (tangential movability; Bo 2016, section 4.3). The best line is followed both ways as far as
//! its distances can be kept; what it sweeps is where a search starts.

use super::problem::{Band, Sweep};
use super::radius::MeridianFamily;
use crate::geometry::{Point, Vector};
use crate::plan::chart::Chart;
use nalgebra::{Matrix5, Vector5};

/// Points of the line that are looked at.
const POINTS: usize = 9;
/// Slants of the line against straight across, degrees.
const SLANTS: [f64; 11] = [0.0, -10.0, 10.0, -20.0, 20.0, -30.0, 30.0, -40.0, 40.0, -50.0, 50.0];
/// Rounds in which the slant of a seed is settled, from half the distance of those above.
const HALVINGS: usize = 6;
/// Slants that are followed.
const FOLLOWED: usize = 3;
/// Lines over the length of a band, at least, and most in all.
const STEPS: f64 = 40.0;
const MOST_STEPS: usize = 120;
/// How much more a point's speed along its normal counts than speed that differs from the line's before.
const NORMAL_WEIGHT: f64 = 1e3;
/// Weight of a correction's own size against the distances that it restores.
const CAUTION: f64 = 1e-4;
/// Largest change of a distance, as a share of the line's length, up to which the line is followed.
const LOST: f64 = 0.03;
/// Least share of the band's length that a sweep has to start with.
const LEAST_WAY: f64 = 0.5;

/// A line segment with its feet on the part.
#[derive(Clone, Debug)]
struct Line {
    low: Point,
    high: Point,
    /// Unit normals at the feet.
    normals: [Vector; POINTS],
    /// Distances from the feet, mm.
    distances: [f64; POINTS],
    /// Chart coordinates of the feet.
    places: [(f64, f64); POINTS],
}

/// Share of the line at which a point lies.
fn share(k: usize) -> f64 {
    k as f64 / (POINTS - 1) as f64
}

/// Velocities of a line's ends.
#[derive(Clone, Copy, Debug)]
struct Velocity {
    low: Vector,
    high: Vector,
}

impl Line {
    fn at(chart: &Chart<'_>, low: Point, high: Point, near: &[(f64, f64); POINTS]) -> Option<Self> {
        let mut line = Self { low, high, normals: [Vector::zeros(); POINTS], distances: [0.0; POINTS], places: *near };
        for (k, near) in near.iter().enumerate() {
            let foot = chart.foot(&(low + (high - low) * share(k)), *near)?;
            line.normals[k] = foot.frame.normal;
            line.distances[k] = foot.distance;
            line.places[k] = foot.frame.place;
        }
        Some(line)
    }

    fn length(&self) -> f64 {
        (self.high - self.low).norm()
    }

    fn axis(&self) -> Vector {
        (self.high - self.low) / self.length()
    }

    /// Two unit vectors square to the line and each other, the first sideways along the part at the line's middle.
    fn sideways(&self) -> Option<[Vector; 2]> {
        let axis = self.axis();
        let side = self.normals[POINTS / 2].cross(&axis).try_normalize(1e-6)?;
        Some([side, axis.cross(&side)])
    }

    /// How fast the points' distances change by the components of a velocity: both ends' along `sideways`, and the slide.
    fn rates(&self, sideways: &[Vector; 2]) -> [Vector5<f64>; POINTS] {
        let axis = self.axis();
        std::array::from_fn(|k| {
            let (n, f) = (self.normals[k], share(k));
            let [p, q] = sideways.map(|w| n.dot(&w));
            Vector5::new((1.0 - f) * p, (1.0 - f) * q, f * p, f * q, n.dot(&axis))
        })
    }

    /// The motion nearest to `wanted` that keeps the points' distances, and what that costs: the mean square speed by
    /// which it differs, with what speed along the normals is left, over the wanted one. Along its own rulings any line
    /// moves freely, so that speed along the normals alone says nothing.
    fn movability(&self, wanted: &Velocity) -> Option<(f64, Velocity)> {
        let sideways = self.sideways()?;
        let mut normal = Matrix5::zeros();
        for rate in self.rates(&sideways) {
            normal += rate * rate.transpose() / POINTS as f64;
        }
        let speed = speed_form();
        let components = |v: &Vector| [v.dot(&sideways[0]), v.dot(&sideways[1])];
        let ([a, b], [c, d]) = (components(&wanted.low), components(&wanted.high));
        let wanted = Vector5::new(a, b, c, d, 0.0);
        let motion = (speed + normal * NORMAL_WEIGHT).try_inverse()? * speed * wanted;
        let mean_square = |v: &Vector5<f64>| v.dot(&(speed * v));
        let lost =
            (mean_square(&(motion - wanted)) + NORMAL_WEIGHT * motion.dot(&(normal * motion))) / mean_square(&wanted);
        let scale = 1.0 / mean_square(&motion).sqrt();
        let slide = self.axis() * motion[4];
        let velocity = |i: usize| (sideways[0] * motion[i] + sideways[1] * motion[i + 1] + slide) * scale;
        lost.is_finite().then(|| (lost, Velocity { low: velocity(0), high: velocity(2) }))
    }

    /// The line a step on, moved back to where its points have the distances of `seed`.
    fn next(&self, chart: &Chart<'_>, velocity: &Velocity, step: f64, seed: &Self) -> Option<Self> {
        let length = self.length();
        let mut line = self.moved(chart, &(velocity.low * step), &(velocity.high * step), length)?;
        for _ in 0..2 {
            let sideways = line.sideways()?;
            let (mut matrix, mut right) = (Matrix5::identity() * CAUTION, Vector5::zeros());
            for (k, rate) in line.rates(&sideways).iter().enumerate() {
                matrix += rate * rate.transpose() / POINTS as f64;
                right -= rate * (line.distances[k] - seed.distances[k]) / POINTS as f64;
            }
            let by = matrix.cholesky()?.solve(&right);
            let slide = line.axis() * by[4];
            let end = |i: usize| sideways[0] * by[i] + sideways[1] * by[i + 1] + slide;
            line = line.moved(chart, &end(0), &end(2), length)?;
        }
        Some(line)
    }

    /// The line with its ends moved, its length kept.
    fn moved(&self, chart: &Chart<'_>, low: &Vector, high: &Vector, length: f64) -> Option<Self> {
        let (low, high) = (self.low + low, self.high + high);
        let half = (high - low).try_normalize(1e-9)? * (0.5 * length);
        let middle = nalgebra::center(&low, &high);
        Self::at(chart, middle - half, middle + half, &self.places)
    }

    /// Largest difference of its distances from those of `seed`, as a share of its length, where it is over `band`.
    fn lost(&self, seed: &Self, band: &Band) -> f64 {
        let over = (0..POINTS).filter(|k| band.holds(self.places[*k]));
        over.map(|k| (self.distances[k] - seed.distances[k]).abs()).fold(0.0, f64::max) / self.length()
    }

    /// How far its distances are from the radii of a tool of a family, as a share of its length: a straight flank's are
    /// linear; a free or a round one follows most.
    fn misfit(&self, family: MeridianFamily) -> f64 {
        let (first, last) = (self.distances[0], self.distances[POINTS - 1]);
        let off = |k: usize| match family {
            MeridianFamily::Free | MeridianFamily::Barrel => 0.0,
            MeridianFamily::Cone => self.distances[k] - (first + (last - first) * share(k)),
            MeridianFamily::Cylinder => self.distances[k] - first,
        };
        (0..POINTS).map(|k| off(k).abs()).fold(0.0, f64::max) / self.length()
    }

    fn is_over(&self, band: &Band) -> bool {
        self.places.iter().any(|place| band.holds(*place))
    }
}

/// Mean square speed of a line's points as a form of the four components of its ends' velocities and of its slide.
fn speed_form() -> Matrix5<f64> {
    let (own, shared) = (1.0 / 3.0, 1.0 / 6.0);
    let mut form = Matrix5::from_diagonal(&Vector5::new(own, own, own, own, 1.0));
    for (i, j) in [(0, 2), (1, 3)] {
        (form[(i, j)], form[(j, i)]) = (shared, shared);
    }
    form
}

/// A line over the middle of a band.
#[derive(Clone, Debug)]
struct Seed {
    /// Against straight across, radians.
    slant: f64,
    line: Line,
    /// How it moves best, toward growing h.
    velocity: Velocity,
    /// What it costs to move so, against a move straight ahead.
    lost: f64,
    /// How far its distances are from the radii of a tool of the family, as a share of its length.
    misfit: f64,
}

impl Seed {
    /// What speaks against it.
    fn cost(&self) -> f64 {
        self.lost.sqrt() + self.misfit
    }

    /// The best seed at slants ever closer around its own.
    fn refined(self, chart: &Chart<'_>, band: &Band, wanted: Wanted) -> Self {
        let mut best = self;
        let mut by = 5f64.to_radians();
        for _ in 0..HALVINGS {
            for slant in [best.slant - by, best.slant + by] {
                if let Some(seed) = seed(chart, band, wanted, slant).filter(|seed| seed.cost() < best.cost()) {
                    best = seed;
                }
            }
            by *= 0.5;
        }
        best
    }
}

/// What a line is to be the axis of: radii at its ends, length, mm, and family.
type Wanted = ((f64, f64), f64, MeridianFamily);

/// The line-driven start over a band: of lines over its middle the one that can be followed farthest and best.
pub(super) fn line_driven(chart: &Chart<'_>, band: Band, wanted: Wanted, instants: usize) -> Option<Sweep> {
    let mut seeds: Vec<Seed> =
        SLANTS.iter().filter_map(|slant| seed(chart, &band, wanted, slant.to_radians())).collect();
    seeds.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    let step = step(chart, &band)?;
    let mut best: Option<(f64, Vec<Line>)> = None;
    for seed in seeds.into_iter().take(FOLLOWED) {
        let seed = seed.refined(chart, &band, wanted);
        let lines = followed(chart, &band, &seed, step);
        let lost = lines.iter().map(|line| line.lost(&seed.line, &band)).fold(0.0, f64::max);
        let reached = way(&lines, &band);
        // What is followed farther is better; then what keeps its distances, and those of the family, better.
        let score = (1.0 - reached) + lost + seed.misfit;
        if reached > LEAST_WAY && best.as_ref().is_none_or(|(least, _)| score < *least) {
            best = Some((score, lines));
        }
    }
    sweep(band, best?.1, instants)
}

/// Way from line to line, mm.
fn step(chart: &Chart<'_>, band: &Band) -> Option<f64> {
    let middle = chart.frame((0.5 * (band.low + band.high), 0.5 * (band.start + band.end)))?;
    Some(middle.along.norm() * (band.end - band.start) / STEPS)
}

/// A line over the middle of a band at a slant.
fn seed(chart: &Chart<'_>, band: &Band, (radii, length, family): Wanted, slant: f64) -> Option<Seed> {
    let middle = (0.5 * (band.low + band.high), 0.5 * (band.start + band.end));
    let frame = chart.frame(middle)?;
    let (across, _) = frame.across_gauge()?;
    let sideways = frame.normal.cross(&across);
    let along = if sideways.dot(&frame.along) < 0.0 { -sideways } else { sideways };
    let axis = across * slant.cos() + along * slant.sin();
    let half = 0.5 * length / slant.cos();
    let low = frame.point - axis * half + frame.normal * radii.0;
    let high = frame.point + axis * half + frame.normal * radii.1;
    let near = std::array::from_fn(|k| (band.low + (band.high - band.low) * share(k), middle.1));
    let line = Line::at(chart, low, high, &near)?;
    let ahead = along * slant.cos() - across * slant.sin();
    let (lost, velocity) = line.movability(&Velocity { low: ahead, high: ahead })?;
    let misfit = line.misfit(family);
    Some(Seed { slant, line, velocity, lost, misfit })
}

/// The lines that a seed comes to both ways, in the sense of growing h.
fn followed(chart: &Chart<'_>, band: &Band, seed: &Seed, step: f64) -> Vec<Line> {
    let Seed { line: seed, velocity, .. } = seed;
    let mut lines = Vec::new();
    for sense in [-1.0, 1.0] {
        let (mut line, mut velocity) = (seed.clone(), *velocity);
        let mut run = Vec::new();
        while run.len() < MOST_STEPS && line.is_over(band) {
            let Some(next) = line.next(chart, &velocity, sense * step, seed) else { break };
            let Some((_, ahead)) = next.movability(&velocity).filter(|_| next.lost(seed, band) < LOST) else { break };
            run.push(next.clone());
            (line, velocity) = (next, ahead);
        }
        if sense < 0.0 {
            run.reverse();
            run.push(seed.clone());
        }
        lines.extend(run);
    }
    lines
}

/// Share of the band's length that the middles of lines pass.
fn way(lines: &[Line], band: &Band) -> f64 {
    let h = lines.iter().map(|line| line.places[POINTS / 2].1);
    let (low, high) = h.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    (high.min(band.end) - low.max(band.start)) / (band.end - band.start)
}

/// Lines as the start of a search, `instants` of them.
fn sweep(band: Band, lines: Vec<Line>, instants: usize) -> Option<Sweep> {
    let last = lines.len().checked_sub(2)?;
    let (mut rulings, mut feet) = (Vec::with_capacity(instants), Vec::with_capacity(instants));
    for j in 0..instants {
        let at = (last + 1) as f64 * j as f64 / (instants - 1) as f64;
        let i = (at as usize).min(last);
        let f = at - i as f64;
        let (a, b) = (&lines[i], &lines[i + 1]);
        let mix = |p: (f64, f64), q: (f64, f64)| (p.0 + f * (q.0 - p.0), p.1 + f * (q.1 - p.1));
        rulings.push((a.low + (b.low - a.low) * f, a.high + (b.high - a.high) * f));
        feet.push((mix(a.places[0], b.places[0]), mix(a.places[POINTS - 1], b.places[POINTS - 1])));
    }
    Some(Sweep { band, rulings, feet })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::interpolate::interpolate_grid;
    use crate::part::OrientedSpline;
    use crate::plan::chart::{Layout, Lines};

    /// A wavy wall, 40 mm by 20 mm, whose straight lines lean by `lean` along the cut: u runs along it, v up.
    fn wall(lean: f64) -> OrientedSpline {
        let point = |i: i32, j: i32| {
            let (x, z) = (f64::from(i), f64::from(j));
            Point::new(x, 4.0 * ((x - lean * z) / 9.0).sin(), z)
        };
        let rows: Vec<Vec<Point>> = (0..=40).map(|i| (0..=20).map(|j| point(i, j)).collect()).collect();
        let surface = interpolate_grid(&rows).unwrap();
        let flip = surface.jet(0.5, 0.5).normal().unwrap().y > 0.0;
        OrientedSpline::new(surface, flip).unwrap()
    }

    fn chart(spline: &OrientedSpline) -> Chart<'_> {
        Chart::new(spline, Layout { lines: Lines::AlongU, tip_high: false, backward: false })
    }

    #[test]
    fn a_line_along_the_rulings_can_move_and_a_slanted_one_cannot() {
        let spline = wall(0.0);
        let chart = chart(&spline);
        let movable = |slant: f64| {
            seed(&chart, &Band::inside(0.0), ((5.0, 5.0), 20.0, MeridianFamily::Free), slant).unwrap().lost
        };
        assert!(movable(0.0) < 1e-6, "{}", movable(0.0));
        assert!(movable(0.5) > 0.05, "{}", movable(0.5));
    }

    /// Of a wall whose straight lines lean, a cylinder's axis has to lean with them.
    #[test]
    fn a_seed_takes_the_slant_that_the_part_asks_for() {
        let spline = wall(20f64.to_radians().tan());
        let chart = chart(&spline);
        let (band, wanted) = (Band::inside(0.0), ((3.0, 3.0), 20.0, MeridianFamily::Cylinder));
        let costs: Vec<(f64, f64, f64)> = SLANTS
            .iter()
            .filter_map(|slant| seed(&chart, &band, wanted, slant.to_radians()))
            .map(|seed| (seed.slant.to_degrees(), seed.lost, seed.misfit))
            .collect();
        let best = costs.iter().min_by(|a, b| (a.1.sqrt() + a.2).total_cmp(&(b.1.sqrt() + b.2))).unwrap();
        let best = seed(&chart, &band, wanted, best.0.to_radians()).unwrap().refined(&chart, &band, wanted);
        let slant = best.line.axis().z.acos().to_degrees();
        assert!((slant - 20.0).abs() < 0.5 && best.misfit < 1e-3, "{slant} {} {costs:?}", best.misfit);
    }
}
