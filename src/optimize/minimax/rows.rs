//! Rows of a minimax problem: values with their gradients, kept one behind the other. Uses nothing of the crate.

/// What a row's value may be, tau being the common factor that is made as small as possible:
///
/// `-min(allowance + below * tau, hard_below) <= value <= min(allowance + above * tau, hard_above)`
///
/// Infinite figures leave a side free. Hard figures may be negative: they then keep the value off zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sides {
    /// Share of tau above zero, positive.
    pub above: f64,
    /// Share of tau below zero, positive.
    pub below: f64,
    /// What is allowed on both sides beside their share of tau.
    pub allowance: f64,
    /// Largest value, whatever tau is.
    pub hard_above: f64,
    /// Least value with its sign turned, whatever tau is.
    pub hard_below: f64,
}

impl Sides {
    /// Both signs count alike: `|value| <= share * tau`.
    pub fn even(share: f64) -> Self {
        Self { above: share, below: share, ..Self::FREE }
    }

    /// `value >= least`, whatever tau is.
    pub fn at_least(least: f64) -> Self {
        Self { hard_below: -least, ..Self::FREE }
    }

    /// No limit at all.
    pub const FREE: Self = Self {
        above: f64::INFINITY,
        below: f64::INFINITY,
        allowance: 0.0,
        hard_above: f64::INFINITY,
        hard_below: f64::INFINITY,
    };
}

/// One side of one row as an inequality `sign * value <= constant + share * tau`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    /// 1 above, -1 below.
    pub(super) sign: f64,
    pub(super) constant: f64,
    /// 0 for hard sides.
    pub(super) share: f64,
}

/// Sides of a row, in the order of [`Sides::side`].
pub(super) const SIDES: usize = 4;

impl Sides {
    /// Side `which` of 0..[`SIDES`]; none where it is free.
    pub(super) fn side(&self, which: usize) -> Option<Side> {
        let (sign, constant, share) = match which {
            0 => (1.0, self.allowance, self.above),
            1 => (-1.0, self.allowance, self.below),
            2 => (1.0, self.hard_above, 0.0),
            _ => (-1.0, self.hard_below, 0.0),
        };
        (constant + share).is_finite().then_some(Side { sign, constant, share })
    }
}

/// A list of sparse gradients, each with its value.
#[derive(Clone, Debug, Default)]
struct Sparse {
    values: Vec<f64>,
    ends: Vec<usize>,
    entries: Vec<(usize, f64)>,
}

impl Sparse {
    fn clear(&mut self) {
        self.values.clear();
        self.ends.clear();
        self.entries.clear();
    }

    fn push(&mut self, value: f64, gradient: impl IntoIterator<Item = (usize, f64)>) {
        self.values.push(value);
        self.entries.extend(gradient);
        self.ends.push(self.entries.len());
    }

    fn gradient(&self, row: usize) -> &[(usize, f64)] {
        let start = if row == 0 { 0 } else { self.ends[row - 1] };
        &self.entries[start..self.ends[row]]
    }

    /// Value of row `row` after `step`, to first order.
    fn moved(&self, row: usize, step: &[f64]) -> f64 {
        self.values[row] + self.gradient(row).iter().map(|(i, g)| g * step[*i]).sum::<f64>()
    }
}

/// Every row of a problem at one place: those that are bounded, and those whose squares are kept small.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    bounded: Sparse,
    sides: Vec<Sides>,
    squared: Sparse,
    weights: Vec<f64>,
}

impl Rows {
    /// Forgets all rows, keeping the memory.
    pub fn clear(&mut self) {
        self.bounded.clear();
        self.sides.clear();
        self.squared.clear();
        self.weights.clear();
    }

    /// Adds a bounded row. `gradient` lists the unknowns that it depends on, each at most once.
    pub fn bound(&mut self, value: f64, sides: Sides, gradient: impl IntoIterator<Item = (usize, f64)>) {
        self.bounded.push(value, gradient);
        self.sides.push(sides);
    }

    /// Adds `weight / 2 * value^2` to what is minimized beside tau. A value of 0 with a gradient makes steps along that
    /// gradient dear without preferring any place.
    pub fn square(&mut self, value: f64, weight: f64, gradient: impl IntoIterator<Item = (usize, f64)>) {
        self.squared.push(value, gradient);
        self.weights.push(weight);
    }

    /// Number of bounded rows.
    pub fn len(&self) -> usize {
        self.sides.len()
    }

    /// True without bounded rows.
    pub fn is_empty(&self) -> bool {
        self.sides.is_empty()
    }

    /// Limits of bounded row `row`.
    pub(super) fn sides(&self, row: usize) -> &Sides {
        &self.sides[row]
    }

    /// Value of bounded row `row`.
    pub(super) fn value(&self, row: usize) -> f64 {
        self.bounded.values[row]
    }

    /// Gradient of bounded row `row`.
    pub(super) fn gradient(&self, row: usize) -> &[(usize, f64)] {
        self.bounded.gradient(row)
    }

    /// Value of bounded row `row` after `step`, to first order.
    pub(super) fn moved(&self, row: usize, step: &[f64]) -> f64 {
        self.bounded.moved(row, step)
    }

    /// Length of the gradient of bounded row `row`.
    pub(super) fn steepness(&self, row: usize) -> f64 {
        self.gradient(row).iter().map(|(_, g)| g * g).sum::<f64>().sqrt()
    }

    /// The way that explains how the bounded rows changed from `before`, the same rows at another place: the largest change
    /// of a value over the length of its gradient. Infinite where the rows are not the same.
    pub(super) fn way_from(&self, before: &Self) -> f64 {
        if self.len() != before.len() {
            return f64::INFINITY;
        }
        let changed = (0..self.len()).map(|row| ((self.value(row) - before.value(row)).abs(), self.steepness(row)));
        changed
            .filter(|(_, steepness)| *steepness > 0.0)
            .map(|(change, steepness)| change / steepness)
            .fold(0.0, f64::max)
    }

    /// Squared rows: value, weight, gradient.
    pub(super) fn squares(&self) -> impl Iterator<Item = (f64, f64, &[(usize, f64)])> {
        (0..self.weights.len()).map(|r| (self.squared.values[r], self.weights[r], self.squared.gradient(r)))
    }

    /// Half the weighted sum of squares after `step`, to first order; at the place itself without one.
    pub fn soft(&self, step: Option<&[f64]>) -> f64 {
        (0..self.weights.len())
            .map(|r| {
                let value = step.map_or(self.squared.values[r], |step| self.squared.moved(r, step));
                0.5 * self.weights[r] * value * value
            })
            .sum()
    }

    /// Largest share of tau of any row: what one unit of tau is in the rows' unit; 1 when none depends on tau.
    pub(super) fn unit(&self) -> f64 {
        let shares = self.sides.iter().flat_map(|s| [s.above, s.below]).filter(|s| s.is_finite());
        let largest = shares.fold(0.0, f64::max);
        if largest > 0.0 { largest } else { 1.0 }
    }

    /// Least tau that the rows allow, and the largest trespass of a hard side in the rows' unit, both not negative. `None`
    /// where a value is not finite.
    pub fn largest_error(&self) -> Option<(f64, f64)> {
        self.largest(None)
    }

    /// Least tau that the rows allow, and the largest trespass of a hard side in the rows' unit, both not negative;
    /// after `step` to first order when there is one. `None` where a value is not finite.
    pub(super) fn largest(&self, step: Option<&[f64]>) -> Option<(f64, f64)> {
        let (mut tau, mut trespass) = (0.0_f64, 0.0_f64);
        for (row, sides) in self.sides.iter().enumerate() {
            let value = step.map_or(self.value(row), |step| self.moved(row, step));
            if !value.is_finite() {
                return None;
            }
            tau = tau.max((value - sides.allowance) / sides.above).max((-value - sides.allowance) / sides.below);
            trespass = trespass.max(value - sides.hard_above).max(-value - sides.hard_below);
        }
        Some((tau, trespass))
    }
}
