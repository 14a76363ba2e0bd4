//! The two scalar splines of a field, and the way back from their values to a place of the surface.
//!
//! G and H each solve a linear least-squares problem for their gradients: that of G across the strips' borders, of unit
//! length, so that G counts millimetres across the strips; that of H across the axis, so that H stays constant along it.

use super::axis::{AxisField, Wish};
use super::sheet::{Net, Sheet, Station};
use crate::geometry::{Point, SplineSurface};
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

/// Spline functions along each parameter.
const SIDE: usize = 9;
/// Weight of the gradient's length against its direction.
const LENGTH: f64 = 0.1;
/// Weight of second differences of the coefficients.
const FAIRNESS: f64 = 1e-6;
/// Least sine of the angle between the gradients of G and H.
const LEAST_SINE: f64 = 0.4;
/// Nodes of the table of the way back along each coordinate, and how far it goes beyond 0..1.
const NODES: usize = 41;
const BEYOND: f64 = 0.3;
/// Boundary points an edge.
const EDGE: usize = 120;

/// Two scalar splines over the normalized parameters, both scaled to 0..1 on the surface.
#[derive(Clone, Debug)]
pub(in crate::plan) struct Field {
    /// x is g, y is h.
    map: SplineSurface,
    /// Normalized parameters at the nodes.
    table: Vec<(f64, f64)>,
    /// (g, h) along the boundary, closed.
    boundary: Vec<(f64, f64)>,
}

/// Which way a gradient should point at a station, unit tangents in its frame: (across, along the level sets).
type Wanted<'a> = &'a dyn Fn(usize, &Station) -> ([f64; 2], [f64; 2]);

impl Field {
    /// Borders square to the axis, drawn toward a wish with its weight against 1; footprints along the axis. `None` where
    /// the two would meet at too sharp an angle, or fold.
    pub(in crate::plan) fn new(sheet: &Sheet, axis: &AxisField, wish: Option<Wish>) -> Option<Self> {
        let along_axis = |i: usize| [axis.angles[i].cos(), axis.angles[i].sin()];
        let square = |[x, y]: [f64; 2]| [-y, x];
        let g = levels(sheet, &|i, station| {
            let toward = along_axis(i);
            let Some(Wish { direction, weight }) = wish else { return (toward, square(toward)) };
            let along = [station.bending.e1.dot(&direction), station.bending.e2.dot(&direction)];
            let [x, y] = square(along);
            // Across the wanted direction, on the axis' side.
            let scale = weight * (x * toward[0] + y * toward[1]).signum() / x.hypot(y).max(1e-9);
            let across = [toward[0] + scale * x, toward[1] + scale * y];
            let across = across.map(|c| c / across[0].hypot(across[1]));
            (across, square(across))
        })?;
        let h = levels(sheet, &|i, _| (square(along_axis(i)), along_axis(i)))?;
        let net = Net::new(SIDE)?;
        let normalized = |values: Vec<f64>| -> Option<Vec<f64>> {
            let spots = (0..4 * EDGE).map(|k| net.at(rim(k)).value(&values)[0]);
            let (low, high) = spots.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            (high - low > 1e-9).then(|| values.iter().map(|x| (x - low) / (high - low)).collect())
        };
        let (g, h) = (normalized(g)?, normalized(h)?);
        apart(sheet, &net, &g, &h)?;
        let row = |i: usize| (0..SIDE).map(|j| Point::new(g[i * SIDE + j], h[i * SIDE + j], 0.0)).collect();
        let knots = || net.knots().values().to_vec();
        let map = SplineSurface::new([3, 3], [knots(), knots()], (0..SIDE).map(row).collect(), None).ok()?;
        let boundary = (0..4 * EDGE).map(|k| value(&map, rim(k))).collect();
        let mut field = Self { map, table: Vec::new(), boundary };
        field.table = field.tabulate();
        Some(field)
    }

    /// (g, h) and its derivatives by s (first column) and t (second column).
    pub(in crate::plan) fn jet(&self, (s, t): (f64, f64)) -> ((f64, f64), Matrix2<f64>) {
        let jet = self.map.extended_jet(s, t);
        ((jet.point.x, jet.point.y), Matrix2::new(jet.su.x, jet.sv.x, jet.su.y, jet.sv.y))
    }

    /// Normalized parameters near a place (g, h), from the table alone.
    pub(in crate::plan) fn near(&self, (g, h): (f64, f64)) -> (f64, f64) {
        let cell = |x: f64| {
            let x = (x + BEYOND) / (1.0 + 2.0 * BEYOND) * (NODES - 1) as f64;
            let i = x.clamp(0.0, (NODES - 2) as f64) as usize;
            (i, x - i as f64)
        };
        let ((i, a), (j, b)) = (cell(g), cell(h));
        let at = |i: usize, j: usize| self.table[i * NODES + j];
        let mix = |pick: &dyn Fn((f64, f64)) -> f64| {
            let low = pick(at(i, j)) * (1.0 - b) + pick(at(i, j + 1)) * b;
            let high = pick(at(i + 1, j)) * (1.0 - b) + pick(at(i + 1, j + 1)) * b;
            low * (1.0 - a) + high * a
        };
        (mix(&|p| p.0), mix(&|p| p.1))
    }

    /// Normalized parameters of a place (g, h).
    pub(in crate::plan) fn at(&self, place: (f64, f64)) -> (f64, f64) {
        let near = self.near(place);
        self.newton(place, near).unwrap_or(near)
    }

    fn newton(&self, (g, h): (f64, f64), mut at: (f64, f64)) -> Option<(f64, f64)> {
        for _ in 0..20 {
            let ((g0, h0), by) = self.jet(at);
            let step = by.try_inverse()? * Vector2::new(g - g0, h - h0);
            // No farther in one step than the extension can be trusted.
            let factor = (0.3 / step.amax()).min(1.0);
            at = (at.0 + factor * step.x, at.1 + factor * step.y);
            if step.amax() < 1e-12 {
                return Some(at);
            }
        }
        None
    }

    /// Least and greatest h on the surface between two borders. Both functions have no extremum inside the surface, so
    /// its boundary tells.
    pub(in crate::plan) fn span(&self, low: f64, high: f64) -> Option<(f64, f64)> {
        let mut range: Option<(f64, f64)> = None;
        let mut take = |h: f64| {
            let (least, most) = range.unwrap_or((h, h));
            range = Some((least.min(h), most.max(h)));
        };
        for (k, (g, h)) in self.boundary.iter().enumerate() {
            let (next_g, next_h) = self.boundary[(k + 1) % self.boundary.len()];
            if (low..=high).contains(g) {
                take(*h);
            }
            for level in [low, high] {
                if (g - level) * (next_g - level) < 0.0 {
                    take(h + (next_h - h) * (level - g) / (next_g - g));
                }
            }
        }
        range
    }

    /// The way back, node by node outward from the surface's middle.
    fn tabulate(&self) -> Vec<(f64, f64)> {
        let coordinate = |i: usize| (1.0 + 2.0 * BEYOND) * i as f64 / (NODES - 1) as f64 - BEYOND;
        let middle = self.jet((0.5, 0.5)).0;
        let home = |x: f64| ((x + BEYOND) / (1.0 + 2.0 * BEYOND) * (NODES - 1) as f64).round() as usize;
        let (i0, j0) = (home(middle.0).min(NODES - 1), home(middle.1).min(NODES - 1));
        let mut table: Vec<Option<(f64, f64)>> = vec![None; NODES * NODES];
        let node = |i: usize, j: usize| (coordinate(i), coordinate(j));
        let settle = |from: (f64, f64), i: usize, j: usize| {
            self.newton(node(i, j), from)
                .filter(|(s, t)| (-2.0..=3.0).contains(s) && (-2.0..=3.0).contains(t))
                .unwrap_or_else(|| {
                    // Where the extension folds: straight on.
                    let (here, by) = self.jet(from);
                    let off = Vector2::new(node(i, j).0 - here.0, node(i, j).1 - here.1);
                    let step = by.try_inverse().map_or(Vector2::zeros(), |inverse| inverse * off);
                    let factor = (0.1 / step.amax()).min(1.0);
                    (from.0 + factor * step.x, from.1 + factor * step.y)
                })
        };
        let order = |home: usize| {
            (home..NODES).map(move |k| (k, k.max(home + 1) - 1)).chain((0..home).rev().map(|k| (k, k + 1)))
        };
        for (i, i_before) in order(i0) {
            for (j, j_before) in order(j0) {
                let from = match (i == i0, j == j0) {
                    (true, true) => Some((0.5, 0.5)),
                    (_, false) => table[i * NODES + j_before],
                    (false, true) => table[i_before * NODES + j],
                };
                table[i * NODES + j] = Some(settle(from.unwrap_or((0.5, 0.5)), i, j));
            }
        }
        table.into_iter().map(|node| node.unwrap_or((0.5, 0.5))).collect()
    }
}

fn value(map: &SplineSurface, (s, t): (f64, f64)) -> (f64, f64) {
    let point = map.point(s, t);
    (point.x, point.y)
}

/// Point `k` of the boundary of the unit square.
fn rim(k: usize) -> (f64, f64) {
    let share = (k % EDGE) as f64 / EDGE as f64;
    match k / EDGE {
        0 => (share, 0.0),
        1 => (1.0, share),
        2 => (1.0 - share, 1.0),
        _ => (0.0, 1.0 - share),
    }
}

/// The spline whose gradient is nearest the wanted one, by least squares.
fn levels(sheet: &Sheet, wanted: Wanted<'_>) -> Option<Vec<f64>> {
    let net = Net::new(SIDE)?;
    let size = net.size();
    let mut matrix = DMatrix::<f64>::zeros(size, size);
    let mut right = DVector::<f64>::zeros(size);
    let mut add = |run: &[(usize, f64)], value: f64, weight: f64| {
        for (i, a) in run {
            right[*i] += weight * value * a;
            for (j, b) in run {
                matrix[(*i, *j)] += weight * a * b;
            }
        }
    };
    for (i, station) in sheet.stations.iter().enumerate() {
        let local = net.at(station.place);
        let (across, along) = wanted(i, station);
        for (direction, value, weight) in [(across, 1.0, LENGTH), (along, 0.0, 1.0)] {
            let run: Vec<(usize, f64)> = local
                .functions()
                .map(|(index, [_, by_s, by_t])| {
                    let [x, y] = station.gradient((by_s, by_t));
                    (index, x * direction[0] + y * direction[1])
                })
                .collect();
            add(&run, value, weight * station.area);
        }
    }
    for i in 0..SIDE {
        for j in 0..SIDE - 2 {
            for (first, step) in [(i * SIDE + j, 1), (j * SIDE + i, SIDE)] {
                add(&[(first, 1.0), (first + step, -2.0), (first + 2 * step, 1.0)], 0.0, FAIRNESS);
            }
        }
    }
    // The constant is free; it is set where it does no harm.
    add(&[(size / 2, 1.0)], 0.0, 1e-6);
    Some(matrix.cholesky()?.solve(&right).iter().copied().collect())
}

/// Checks that the level sets of both splines cross at a fair angle everywhere, in one sense.
fn apart(sheet: &Sheet, net: &Net, g: &[f64], h: &[f64]) -> Option<()> {
    let mut sense = 0.0;
    for station in &sheet.stations {
        let local = net.at(station.place);
        let gradient = |coefficients: &[f64]| {
            let [_, by_s, by_t] = local.value(coefficients);
            station.gradient((by_s, by_t))
        };
        let (a, b) = (gradient(g), gradient(h));
        let sine = (a[0] * b[1] - a[1] * b[0]) / (a[0].hypot(a[1]) * b[0].hypot(b[1]));
        if sine.is_nan() || sine.abs() < LEAST_SINE || sine * sense < 0.0 {
            return None;
        }
        sense = sine;
    }
    Some(())
}
