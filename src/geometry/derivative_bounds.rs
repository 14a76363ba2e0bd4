//! Guaranteed bounds on the derivatives of a B-spline surface over parameter rectangles. Uses `surface` and `knots`.
//!
//! A polynomial piece in Bernstein-Bezier form lies in the hull of its control points, and so do its derivatives in the
//! hulls of theirs (Piegl and Tiller, The NURBS Book, section 3.3). A rational piece is S = A / w with both polynomial;
//! the product rule for A = w S gives bounds of the derivatives of S from those of A and w.

use super::knots::Knots;
use super::surface::SplineSurface;
use super::{Point, Vector};

/// Bounds on the lengths of the derivatives of a surface, mm per unit of parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DerivativeBounds {
    /// Of Su.
    pub su: f64,
    /// Of Sv.
    pub sv: f64,
    /// Of Suu.
    pub suu: f64,
    /// Of Suv.
    pub suv: f64,
    /// Of Svv.
    pub svv: f64,
    /// A line on which the first derivatives may jump crosses the rectangle.
    pub crease: bool,
}

/// The bounds of every polynomial piece of a surface.
#[derive(Clone, Debug)]
pub struct DerivativeTable {
    breaks: [Vec<f64>; 2],
    /// Breaks at which first derivatives may jump.
    creases: [Vec<f64>; 2],
    /// Row by row along u.
    pieces: Vec<DerivativeBounds>,
}

impl DerivativeTable {
    /// Looks at every piece of a surface.
    pub fn new(surface: &SplineSurface) -> Self {
        let knots = [surface.knots_u(), surface.knots_v()];
        let breaks = knots.map(Knots::breaks);
        let mut pieces = Vec::new();
        for u in breaks[0].windows(2) {
            for v in breaks[1].windows(2) {
                pieces.push(Net::new(surface, [(u[0], u[1]), (v[0], v[1])]).bounds());
            }
        }
        Self { creases: knots.map(creases), breaks, pieces }
    }

    /// Bounds over a rectangle, `[(u low, u high), (v low, v high)]`, inside the domain.
    pub fn within(&self, [u, v]: [(f64, f64); 2]) -> DerivativeBounds {
        let columns = self.breaks[1].len() - 1;
        let mut all = DerivativeBounds { crease: self.creased([u, v]), ..DerivativeBounds::default() };
        for i in touched(&self.breaks[0], u) {
            for j in touched(&self.breaks[1], v) {
                let Some(one) = self.pieces.get(i * columns + j) else { continue };
                all.su = all.su.max(one.su);
                all.sv = all.sv.max(one.sv);
                all.suu = all.suu.max(one.suu);
                all.suv = all.suv.max(one.suv);
                all.svv = all.svv.max(one.svv);
            }
        }
        all
    }

    fn creased(&self, rectangle: [(f64, f64); 2]) -> bool {
        let crosses = |k: usize| self.creases[k].iter().any(|c| *c > rectangle[k].0 && *c < rectangle[k].1);
        crosses(0) || crosses(1)
    }
}

/// Inner knots as many times there as the degree, or more: only continuity is sure.
fn creases(knots: &Knots) -> Vec<f64> {
    let (low, high) = knots.domain();
    let times = |t: f64| knots.values().iter().filter(|k| **k == t).count();
    knots.breaks().into_iter().filter(|t| *t > low && *t < high && times(*t) >= knots.degree()).collect()
}

/// Indices of the intervals between breaks that a range touches.
fn touched(breaks: &[f64], (low, high): (f64, f64)) -> std::ops::Range<usize> {
    let last = breaks.len() - 2;
    let first = breaks.partition_point(|b| *b <= low).saturating_sub(1).min(last);
    let end = breaks.partition_point(|b| *b < high).saturating_sub(1).min(last);
    first..end + 1
}

/// Homogeneous Bezier net of a piece: weight times point, and weight, with points counted from the net's middle so that
/// weights that vary cost little.
struct Net {
    rows: usize,
    columns: usize,
    /// Row by row: w (P - middle).
    points: Vec<Vector>,
    weights: Vec<f64>,
    size: [f64; 2],
}

impl Net {
    fn new(surface: &SplineSurface, rectangle: [(f64, f64); 2]) -> Self {
        let [(u0, u1), (v0, v1)] = rectangle;
        let (knots_u, knots_v) = (surface.knots_u(), surface.knots_v());
        let (p, q) = (knots_u.degree(), knots_v.degree());
        let spans = [knots_u.span(0.5 * (u0 + u1)), knots_v.span(0.5 * (v0 + v1))];
        let (rows_u, rows_v) = (knots_u.bezier_rows(spans[0], u0, u1), knots_v.bezier_rows(spans[1], v0, v1));
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for row in rows_u.iter().take(p + 1) {
            for column in rows_v.iter().take(q + 1) {
                let (mut sum, mut weight) = (Vector::zeros(), 0.0);
                for (a, row_share) in row.iter().enumerate().take(p + 1) {
                    for (b, column_share) in column.iter().enumerate().take(q + 1) {
                        let index = (spans[0] - p + a) * knots_v.controls() + spans[1] - q + b;
                        let w = surface.weights().map_or(1.0, |w| w[index]) * row_share * column_share;
                        sum += surface.control()[index].coords * w;
                        weight += w;
                    }
                }
                points.push(sum);
                weights.push(weight);
            }
        }
        let mean = points.iter().zip(&weights).map(|(p, w)| p / *w).sum::<Vector>() / points.len() as f64;
        let middle = Point::from(mean);
        for (point, weight) in points.iter_mut().zip(&weights) {
            *point -= middle.coords * *weight;
        }
        Self { rows: p + 1, columns: q + 1, points, weights, size: [u1 - u0, v1 - v0] }
    }

    /// The net of the derivative along u (side 0) or v (side 1): differences of neighbours, times the degree, over the
    /// length of the interval.
    fn derivative(&self, side: usize) -> Self {
        let (rows, columns) = if side == 0 { (self.rows - 1, self.columns) } else { (self.rows, self.columns - 1) };
        let degree = if side == 0 { rows } else { columns };
        let scale = degree as f64 / self.size[side];
        let step = if side == 0 { self.columns } else { 1 };
        let at = |i: usize, j: usize| i * self.columns + j;
        let places = || (0..rows).flat_map(move |i| (0..columns).map(move |j| at(i, j)));
        Self {
            rows,
            columns,
            points: places().map(|k| (self.points[k + step] - self.points[k]) * scale).collect(),
            weights: places().map(|k| (self.weights[k + step] - self.weights[k]) * scale).collect(),
            size: self.size,
        }
    }

    /// Longest point and largest weight, by value; zero for the empty net of what has no such derivative.
    fn most(&self) -> (f64, f64) {
        let point = self.points.iter().map(|p| p.norm()).fold(0.0, f64::max);
        (point, self.weights.iter().map(|w| w.abs()).fold(0.0, f64::max))
    }

    fn bounds(&self) -> DerivativeBounds {
        let least = self.weights.iter().copied().fold(f64::INFINITY, f64::min);
        let s = self.points.iter().zip(&self.weights).map(|(p, w)| (p / *w).norm()).fold(0.0, f64::max);
        let (by_u, by_v) = (self.derivative(0), self.derivative(1));
        let ((au, wu), (av, wv)) = (by_u.most(), by_v.most());
        let (auu, wuu) = by_u.second(0).most();
        let (auv, wuv) = by_u.second(1).most();
        let (avv, wvv) = by_v.second(1).most();
        let (su, sv) = ((au + wu * s) / least, (av + wv * s) / least);
        DerivativeBounds {
            su,
            sv,
            suu: (auu + 2.0 * wu * su + wuu * s) / least,
            suv: (auv + wu * sv + wv * su + wuv * s) / least,
            svv: (avv + 2.0 * wv * sv + wvv * s) / least,
            crease: false,
        }
    }

    /// Like `derivative`; empty where the degree is used up.
    fn second(&self, side: usize) -> Self {
        let used_up = if side == 0 { self.rows < 2 } else { self.columns < 2 };
        if used_up {
            return Self { rows: 0, columns: 0, points: Vec::new(), weights: Vec::new(), size: self.size };
        }
        self.derivative(side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn surface(values: &[f64], rational: bool) -> SplineSurface {
        let knots_u = vec![0.0, 0.0, 0.0, 0.4, 1.0, 1.0, 1.0];
        let knots_v = vec![0.0, 0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 2.0];
        let control = (0..4).map(|i| (0..4).map(|j| point(values, i, j)).collect()).collect();
        let weight = |i: usize, j: usize| 1.0 + 0.4 * values[(7 * i + 3 * j) % values.len()];
        let weights = rational.then(|| (0..4).map(|i| (0..4).map(|j| weight(i, j)).collect()).collect());
        SplineSurface::new([2, 3], [knots_u, knots_v], control, weights).unwrap()
    }

    fn point(values: &[f64], i: usize, j: usize) -> Point {
        let off = |k: usize| values[(3 * (4 * i + j) + k) % values.len()];
        Point::new(10.0 * i as f64 + off(0), 5.0 * j as f64 + off(1), 3.0 * off(2))
    }

    proptest! {
        #[test]
        fn no_place_of_a_rectangle_is_beyond_its_bounds(
            values in prop::collection::vec(-1.0..1.0f64, 48), rational: bool,
            (a, b) in (0.0..1.0f64, 0.0..1.0f64), (c, d) in (0.0..1.0f64, 0.0..1.0f64), size in 0.01..1.0f64,
        ) {
            let surface = surface(&values, rational);
            let (u0, v0) = (a * (1.0 - size), 2.0 * c * (1.0 - size));
            let bounds = DerivativeTable::new(&surface).within([(u0, u0 + size), (v0, v0 + 2.0 * size)]);
            let jet = surface.jet(u0 + b * size, v0 + 2.0 * d * size);
            let pairs = [
                (jet.su, bounds.su), (jet.sv, bounds.sv), (jet.suu, bounds.suu), (jet.suv, bounds.suv), (jet.svv, bounds.svv),
            ];
            for (derivative, bound) in pairs {
                prop_assert!(derivative.norm() <= bound * (1.0 + 1e-12) + 1e-9);
            }
        }
    }

    #[test]
    fn bounds_are_near_what_they_bound() {
        // z = x² / 2 over 4 mm: the second derivative is 1 everywhere, times 16 for the unit parameter.
        let knots = || vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        let line = |y: f64| vec![Point::new(0.0, y, 0.0), Point::new(2.0, y, 0.0), Point::new(4.0, y, 8.0)];
        let rows: Vec<Vec<Point>> = (0..3).map(|i| (0..3).map(|j| line(f64::from(j))[i as usize]).collect()).collect();
        let surface = SplineSurface::new([2, 2], [knots(), knots()], rows, None).unwrap();
        let bounds = DerivativeTable::new(&surface).within([(0.0, 1.0), (0.0, 1.0)]);
        assert!((bounds.suu - 16.0).abs() < 1e-9 && bounds.suv < 1e-9 && bounds.svv < 1e-9, "{bounds:?}");
        assert!((bounds.sv - 2.0).abs() < 1e-9 && !bounds.crease);
    }

    #[test]
    fn creases_are_seen() {
        let knots = vec![0.0, 0.0, 0.5, 1.0, 1.0];
        let rows: Vec<Vec<Point>> = (0..3)
            .map(|i| (0..2).map(|j| Point::new(f64::from(i), f64::from(j), f64::from(i % 2))).collect())
            .collect();
        let surface = SplineSurface::new([1, 1], [knots, vec![0.0, 0.0, 1.0, 1.0]], rows, None).unwrap();
        let table = DerivativeTable::new(&surface);
        assert!(table.within([(0.4, 0.6), (0.0, 1.0)]).crease);
        assert!(!table.within([(0.5, 0.6), (0.0, 1.0)]).crease);
    }
}
