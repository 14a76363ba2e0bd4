//! The weighted sum of squares of Rajain 2023, equation 18, over the grid of points m, with its analytic Jacobian. Uses
//! `geometry`, `optimize` and the rest of this method.
//!
//! Unknowns are the grid points, column by column so that every residual touches a short run of them, then those of L,
//! r1 and r2 that are free. Feet are exact closest points, found from the last known ones; normals at the feet of m move
//! with m (Weingarten), so the Jacobian is that of the residuals as they are evaluated.

use super::grid::Grid;
use super::sheet::{Place, Sheet, inside};
use super::spheres::Cone;
use super::{Free, Weights};
use crate::geometry::{Point, Vector};
use crate::optimize::{BorderedEquations, BorderedLeastSquares};
use nalgebra::Matrix3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Unknowns that stand beside the grid: L, r1, r2.
pub(super) const GLOBALS: usize = 3;
/// The free ones may at most halve or double.
const GLOBAL_RANGE: f64 = 2.0;

/// One point of the grid as an unknown.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Index of its first coordinate among the unknowns.
    first: usize,
    /// Where it started.
    initial: Point,
    /// Last place of its foot.
    place: Place,
}

/// One position of the tool.
#[derive(Clone, Debug)]
struct Ruling {
    /// Nodes below and above.
    nodes: [usize; 2],
    /// Ruling of the next strip in the same column, which shares the upper node.
    next: Option<usize>,
    /// Last feet of the K samples.
    feet: Vec<Place>,
}

/// Everything about one node at the present unknowns.
#[derive(Clone, Copy, Debug)]
struct NodeState {
    m: Point,
    normal: Vector,
    /// Derivative of the normal by m.
    rate: Matrix3<f64>,
    place: Place,
}

/// A residual with its gradient on a run of unknowns and on the globals.
#[derive(Clone, Copy, Debug)]
struct Row {
    first: usize,
    run: [f64; 9],
    globals: [f64; GLOBALS],
    residual: f64,
    weight: f64,
}

/// What one ruling adds, with its new feet and the least and greatest deviation of its samples.
struct RulingRows {
    rows: Vec<Row>,
    feet: Vec<Place>,
    spread: (f64, f64),
}

/// The sum of squares.
pub(super) struct Problem<'a> {
    sheet: Sheet<'a>,
    weights: Weights,
    free: Free,
    /// Where L, r1 and r2 started, and stay when not free.
    start: Cone,
    heights: usize,
    nodes: Vec<Node>,
    rulings: Vec<Ruling>,
    /// Strip of each ruling.
    pub(super) strip_of: Vec<usize>,
    strips: usize,
    /// Triples of nodes that follow one another along a guiding curve.
    triples: Vec<[usize; 3]>,
    half_bandwidth: usize,
    /// Deviations |y - foot| - r of all samples at the last assembly: least and greatest (R19, both signs).
    pub(super) spread: (f64, f64),
}

/// The tool at one position: ends of the engaged axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    /// Centre of the sphere toward the tip.
    pub(super) a: Point,
    /// Centre of the sphere toward the spindle.
    pub(super) b: Point,
    /// Normals of the part below both.
    pub(super) normals: [Vector; 2],
    /// Places of the part below both.
    pub(super) places: [Place; 2],
}

impl<'a> Problem<'a> {
    /// The problem of a grid, with K = `heights` samples a ruling, and the unknowns to start from.
    pub(super) fn new(
        sheet: Sheet<'a>,
        grid: &Grid,
        cone: Cone,
        heights: usize,
        (weights, free): (Weights, Free),
    ) -> (Self, Vec<f64>) {
        let mut order: BTreeMap<(i64, usize), (Point, Place)> = BTreeMap::new();
        for (i, row) in grid.rows.iter().enumerate() {
            order.extend(row.iter().map(|(j, point)| ((*j, i), (point.m, point.place))));
        }
        let index: BTreeMap<(i64, usize), usize> = order.keys().enumerate().map(|(k, key)| (*key, k)).collect();
        let nodes: Vec<Node> = order
            .values()
            .enumerate()
            .map(|(k, (m, place))| Node { first: 3 * k, initial: *m, place: *place })
            .collect();
        let (mut rulings, mut strip_of, mut at) = (Vec::new(), Vec::new(), BTreeMap::new());
        for (i, range) in grid.strips.iter().enumerate() {
            for j in range.clone() {
                let (Some(low), Some(high)) = (index.get(&(j, i)), index.get(&(j, i + 1))) else { continue };
                at.insert((i, j), rulings.len());
                let (from, to) = (nodes[*low].place, nodes[*high].place);
                let mix = |s: f64| (from.0 + (to.0 - from.0) * s, from.1 + (to.1 - from.1) * s);
                let feet = (0..heights).map(|k| mix(share(k, heights))).collect();
                rulings.push(Ruling { nodes: [*low, *high], next: None, feet });
                strip_of.push(i);
            }
        }
        for ((i, j), k) in &at {
            rulings[*k].next = at.get(&(i + 1, *j)).copied();
        }
        let triples: Vec<[usize; 3]> = index
            .iter()
            .filter_map(|((j, i), k)| Some([*index.get(&(j - 1, *i))?, *k, *index.get(&(j + 1, *i))?]))
            .collect();
        let widest = triples.iter().map(|[a, _, c]| 3 * (c - a) + 2).max().unwrap_or(0);
        let mut x: Vec<f64> = nodes.iter().flat_map(|node| [node.initial.x, node.initial.y, node.initial.z]).collect();
        x.extend([cone.length, cone.r1, cone.r2]);
        let problem = Self {
            sheet,
            weights,
            free,
            start: cone,
            heights,
            nodes,
            rulings,
            strip_of,
            strips: grid.strips.len(),
            triples,
            half_bandwidth: widest.max(8),
            spread: (0.0, 0.0),
        };
        (problem, x)
    }

    /// Weighs rigidity anew.
    pub(super) fn weigh_rigidity(&mut self, weight: f64) {
        self.weights.rigidity = weight;
    }

    /// L, r1 and r2 of unknowns.
    pub(super) fn cone(&self, x: &[f64]) -> Cone {
        let at = 3 * self.nodes.len();
        Cone { length: x[at], r1: x[at + 1], r2: x[at + 2] }
    }

    fn cone_is_possible(&self, cone: &Cone) -> bool {
        let near = |value: f64, start: f64| value > start / GLOBAL_RANGE && value < start * GLOBAL_RANGE;
        near(cone.length, self.start.length)
            && near(cone.r1, self.start.r1)
            && near(cone.r2, self.start.r2)
            && (cone.r2 - cone.r1).abs() < 0.98 * cone.length
    }

    fn node_states(&mut self, x: &[f64]) -> Option<Vec<NodeState>> {
        let sheet = self.sheet;
        let states: Vec<Option<NodeState>> = self
            .nodes
            .par_iter()
            .map(|node| {
                let m = Point::new(x[node.first], x[node.first + 1], x[node.first + 2]);
                let foot = sheet.foot(&m, node.place)?;
                let rate = sheet.normal_rate(foot.frame.place, foot.distance)?;
                Some(NodeState { m, normal: foot.frame.normal, rate, place: foot.frame.place })
            })
            .collect();
        let states: Vec<NodeState> = states.into_iter().collect::<Option<_>>()?;
        for (node, state) in self.nodes.iter_mut().zip(&states) {
            node.place = state.place;
        }
        Some(states)
    }

    /// The positions of the tool at unknowns, ruling by ruling (equation 10).
    pub(super) fn axes(&mut self, x: &[f64]) -> Option<Vec<Axis>> {
        let cone = self.cone(x);
        let states = self.node_states(x)?;
        Some(self.rulings.iter().map(|ruling| axis_of(&ruling.nodes.map(|n| states[n]), &cone)).collect())
    }

    /// Residuals of one ruling: rigidity (R12), accuracy (R13) and the kink to the next strip (R16).
    fn ruling_rows(&self, index: usize, states: &[NodeState], cone: &Cone) -> Option<RulingRows> {
        let ruling = &self.rulings[index];
        let ends = ruling.nodes.map(|n| states[n]);
        let first = self.nodes[ruling.nodes[0]].first;
        let half = 0.5 * (cone.r2 - cone.r1);
        let Axis { a, b, .. } = axis_of(&ends, cone);
        let (da, db) = (Matrix3::identity() - ends[0].rate * half, Matrix3::identity() + ends[1].rate * half);
        // Derivatives of a and b by r2; those by r1 are the opposite.
        let (a_by_r2, b_by_r2) = (ends[0].normal * -0.5, ends[1].normal * 0.5);
        let span = b - a;
        let count = self.rulings.len() as f64;
        let mut rows = Vec::with_capacity(self.heights + 2);
        let row = |by_a: Vector, by_b: Vector, globals: [f64; GLOBALS], residual: f64, weight: f64| {
            let (low, high) = (da.transpose() * by_a, db.transpose() * by_b);
            let run = [low.x, low.y, low.z, high.x, high.y, high.z, 0.0, 0.0, 0.0];
            let by_r2 = by_a.dot(&a_by_r2) + by_b.dot(&b_by_r2);
            Row { first, run, globals: [globals[0], globals[1] - by_r2, globals[2] + by_r2], residual, weight }
        };
        let rigid = span.norm_squared() - cone.length * cone.length;
        rows.push(row(span * -2.0, span * 2.0, [-2.0 * cone.length, 0.0, 0.0], rigid, self.weights.rigidity / count));
        let weight = self.weights.accuracy / (3.0 * count * self.heights as f64);
        let (mut feet, mut spread) = (Vec::with_capacity(self.heights), (f64::INFINITY, f64::NEG_INFINITY));
        for (k, near) in ruling.feet.iter().enumerate() {
            let s = share(k, self.heights);
            let foot = self.sheet.foot(&(a + span * s), *near)?;
            let n = foot.frame.normal;
            let residual = foot.distance - cone.radius(s);
            feet.push(foot.frame.place);
            spread = (f64::min(spread.0, residual), f64::max(spread.1, residual));
            rows.push(row(n * (1.0 - s), n * s, [0.0, -(1.0 - s), -s], residual, weight));
        }
        if let Some(next) = ruling.next {
            rows.push(self.kink_row(&self.rulings[next], states, cone, (first, &span, (da, db), b_by_r2 - a_by_r2)));
        }
        Some(RulingRows { rows, feet, spread })
    }

    /// Equation 16: both axes that meet over a guiding curve make the same angle with the part's normal there.
    fn kink_row(
        &self,
        next: &Ruling,
        states: &[NodeState],
        cone: &Cone,
        (first, span, (da, db), span_by_r2): (usize, &Vector, (Matrix3<f64>, Matrix3<f64>), Vector),
    ) -> Row {
        let ends = next.nodes.map(|n| states[n]);
        let half = 0.5 * (cone.r2 - cone.r1);
        let Axis { a, b, .. } = axis_of(&ends, cone);
        let shared = &ends[0];
        let (da_next, db_next) = (Matrix3::identity() - shared.rate * half, Matrix3::identity() + ends[1].rate * half);
        let n = shared.normal;
        let unit = |v: &Vector| (v / v.norm(), v.norm());
        let ((d1, l1), (d2, l2)) = (unit(span), unit(&(b - a)));
        // Derivatives of n.d1 by the first span, and of n.d2 by the second.
        let (g1, g2) = ((n - d1 * n.dot(&d1)) / l1, (n - d2 * n.dot(&d2)) / l2);
        let low = -(da.transpose() * g1);
        let middle = db.transpose() * g1 + da_next.transpose() * g2 + shared.rate.transpose() * (d1 - d2);
        let high = -(db_next.transpose() * g2);
        let by_r2 = g1.dot(&span_by_r2) - g2.dot(&((ends[1].normal + n) * 0.5));
        let joints = self.rulings.iter().filter(|r| r.next.is_some()).count().max(1) as f64;
        Row {
            first,
            run: [low.x, low.y, low.z, middle.x, middle.y, middle.z, high.x, high.y, high.z],
            globals: [0.0, -by_r2, by_r2],
            residual: n.dot(&(d1 - d2)),
            weight: self.weights.g1 / joints,
        }
    }

    /// Proximity (R17) and fairness (R14).
    fn add_regularity(&self, x: &[f64], equations: &mut BorderedEquations) {
        let none = [0.0; GLOBALS];
        // The paper's sums are means over N (M + 1) points; with unequal strips, over all there are.
        let proximity = self.weights.proximity / (3.0 * self.nodes.len() as f64);
        for node in &self.nodes {
            for c in 0..3 {
                equations.add(node.first + c, &[1.0], &none, x[node.first + c] - node.initial[c], proximity);
            }
        }
        let fairness = self.weights.fairness / (3.0 * self.triples.len().max(1) as f64);
        for triple in &self.triples {
            let [a, b, c] = triple.map(|n| self.nodes[n].first);
            let mut run = vec![0.0; c - a + 1];
            (run[0], run[b - a], run[c - a]) = (1.0, -2.0, 1.0);
            for k in 0..3 {
                equations.add(a + k, &run, &none, x[a + k] - 2.0 * x[b + k] + x[c + k], fairness);
            }
        }
    }

    /// Greatest deviations |y - foot| - r below and above zero over all samples on the surface itself, mm, not negative
    /// (equation 19, its two signs apart).
    pub(super) fn distance_errors(&mut self, x: &[f64]) -> Option<(f64, f64)> {
        let cone = self.cone(x);
        let axes = self.axes(x)?;
        let (mut below, mut above) = (0.0_f64, 0.0_f64);
        for (axis, ruling) in axes.iter().zip(&self.rulings) {
            for (k, near) in ruling.feet.iter().enumerate() {
                let s = share(k, self.heights);
                let foot = self.sheet.foot(&(axis.a + (axis.b - axis.a) * s), *near)?;
                if inside(foot.frame.place) {
                    let error = foot.distance - cone.radius(s);
                    (below, above) = (below.max(-error), above.max(error));
                }
            }
        }
        Some((below, above))
    }

    /// Greatest and mean difference of the angles of equation 15 at the joints over the surface, degrees.
    pub(super) fn kinks(&mut self, x: &[f64]) -> Option<(f64, f64)> {
        let axes = self.axes(x)?;
        let (mut most, mut sum, mut count) = (0.0_f64, 0.0, 0);
        for (axis, ruling) in axes.iter().zip(&self.rulings) {
            let Some(next) = ruling.next.map(|next| axes[next]).filter(|next| inside(next.places[0])) else { continue };
            let angle = |axis: &Axis| next.normals[0].dot(&(axis.b - axis.a).normalize()).clamp(-1.0, 1.0).acos();
            let kink = (angle(axis) - angle(&next)).abs().to_degrees();
            (most, sum, count) = (most.max(kink), sum + kink, count + 1);
        }
        Some((most, sum / f64::from(count.max(1))))
    }

    /// Number of strips, and of positions and heights: the paper's M, N x M and K.
    pub(super) fn size(&self) -> (usize, usize, usize) {
        (self.strips, self.rulings.len(), self.heights)
    }
}

/// Share of the axis of sample `k` of `count` (equation 11).
pub(super) fn share(k: usize, count: usize) -> f64 {
    k as f64 / (count - 1) as f64
}

fn axis_of(ends: &[NodeState; 2], cone: &Cone) -> Axis {
    let half = 0.5 * (cone.r2 - cone.r1);
    Axis {
        a: ends[0].m - ends[0].normal * half,
        b: ends[1].m + ends[1].normal * half,
        normals: ends.map(|end| end.normal),
        places: ends.map(|end| end.place),
    }
}

impl Problem<'_> {
    /// Derivatives by L, r1 and r2: none by those that are not free, so that they stay.
    fn freed(&self, globals: [f64; GLOBALS]) -> [f64; GLOBALS] {
        let free = [self.free.length, self.free.r1, self.free.r2];
        std::array::from_fn(|k| if free[k] { globals[k] } else { 0.0 })
    }
}

impl BorderedLeastSquares for Problem<'_> {
    fn unknowns(&self) -> usize {
        3 * self.nodes.len()
    }

    fn half_bandwidth(&self) -> usize {
        self.half_bandwidth
    }

    fn shared(&self) -> usize {
        GLOBALS
    }

    fn assemble(&mut self, x: &[f64], equations: &mut BorderedEquations) -> Option<()> {
        let cone = self.cone(x);
        if !self.cone_is_possible(&cone) {
            return None;
        }
        let states = self.node_states(x)?;
        let gathered: Vec<_> =
            (0..self.rulings.len()).into_par_iter().map(|index| self.ruling_rows(index, &states, &cone)).collect();
        let mut spread = (f64::INFINITY, f64::NEG_INFINITY);
        for (index, gathered) in gathered.into_iter().enumerate() {
            let RulingRows { rows, feet, spread: (low, high) } = gathered?;
            self.rulings[index].feet = feet;
            spread = (spread.0.min(low), spread.1.max(high));
            for row in rows {
                equations.add(row.first, trimmed(&row.run), &self.freed(row.globals), row.residual, row.weight);
            }
        }
        self.spread = spread;
        self.add_regularity(x, equations);
        Some(())
    }
}

/// Rows of one ruling touch two points only, those of a kink three.
fn trimmed(run: &[f64; 9]) -> &[f64] {
    if run[6..].iter().all(|v| *v == 0.0) { &run[..6] } else { run }
}

#[cfg(test)]
mod tests {
    use super::super::field::{Source, Wish};
    use super::super::fixtures::saddle;
    use super::super::grid::Laying;
    use super::super::guide::Guide;
    use super::*;

    /// Costs along random directions against the gradient that the Jacobian gives.
    #[test]
    fn the_gradient_is_the_derivative_of_the_cost() {
        let spline = saddle();
        let sheet = Sheet::new(&spline);
        let wish = Wish { source: Source::Vector(Vector::new(1.0, 0.3, 0.0)), toward: Vector::y() };
        let guide = Guide::new(sheet, &wish, 5.0).unwrap();
        let cone = Cone { r1: 0.3, r2: 1.0, length: 1.717 };
        let laying = Laying { distance: cone.distance(), strips: Some(3), step: 1.5, forward: true };
        let grid = Grid::new(&guide, &laying, &cone).unwrap();
        let free = Free { length: true, r1: true, r2: true };
        for only in 0..5 {
            let on = |k: usize| if k == only { 1.0 } else { 0.0 };
            let weights = Weights { rigidity: on(0), accuracy: on(1), g1: on(2), proximity: on(3), fairness: on(4) };
            let (mut problem, mut x) = Problem::new(sheet, &grid, cone, 7, (weights, free));
            let mut random = 0.37;
            let mut next = || {
                random = (random * 997.13_f64 + 0.711).fract();
                random - 0.5
            };
            x.iter_mut().for_each(|v| *v += 0.02 * next());
            let direction: Vec<f64> = x.iter().map(|_| next()).collect();
            let mut cost_at = |h: f64| {
                let moved: Vec<f64> = x.iter().zip(&direction).map(|(x, d)| x + h * d).collect();
                let mut equations = BorderedEquations::new(problem.unknowns(), problem.half_bandwidth(), GLOBALS);
                problem.assemble(&moved, &mut equations).unwrap();
                let (cost, gradient) = equations.cost_and_gradient();
                let slope: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
                (cost, slope)
            };
            let (h, slope) = (1e-5, cost_at(0.0).1);
            let difference = (cost_at(h).0 - cost_at(-h).0) / (2.0 * h);
            assert!((slope - difference).abs() < 1e-5 * slope.abs().max(1e-6), "{only}: {slope} {difference}");
        }
    }
}
