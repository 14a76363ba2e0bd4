//! Symmetric positive definite matrices with a band, and their Cholesky factorization.
//!
//! Sequential on purpose: sums are taken in one order, so results do not depend on the number of threads.

/// Sum of the products of two vectors of one length, gathered in four parts: a single sum waits for each of its additions.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, end_a), (b, end_b)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for (sum, (x, y)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += x * y;
        }
    }
    let rest: f64 = end_a.iter().zip(end_b).map(|(x, y)| x * y).sum();
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}

/// The lower triangle of a symmetric matrix whose entries vanish farther than `half_bandwidth` from the diagonal.
#[derive(Clone, Debug)]
pub struct BandedMatrix {
    size: usize,
    half_bandwidth: usize,
    /// Row by row, `half_bandwidth + 1` entries each, the diagonal last.
    rows: Vec<f64>,
}

impl BandedMatrix {
    /// The zero matrix.
    pub fn zeros(size: usize, half_bandwidth: usize) -> Self {
        Self { size, half_bandwidth, rows: vec![0.0; size * (half_bandwidth + 1)] }
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        self.rows.fill(0.0);
    }

    fn row(&self, i: usize) -> &[f64] {
        let width = self.half_bandwidth + 1;
        &self.rows[i * width..(i + 1) * width]
    }

    /// Diagonal entry `i`.
    pub fn diagonal(&self, i: usize) -> f64 {
        self.row(i)[self.half_bandwidth]
    }

    /// Adds to diagonal entry `i`.
    pub fn add_diagonal(&mut self, i: usize, value: f64) {
        let width = self.half_bandwidth + 1;
        self.rows[i * width + self.half_bandwidth] += value;
    }

    /// Adds `weight * c c^T` for a vector `c` whose nonzero run `coefficients` starts at `first`.
    /// The run must not be longer than the band.
    pub fn add_outer(&mut self, first: usize, coefficients: &[f64], weight: f64) {
        let width = self.half_bandwidth + 1;
        for (r, value) in coefficients.iter().enumerate() {
            let scaled = weight * value;
            if scaled == 0.0 {
                continue;
            }
            let start = (first + r) * width + self.half_bandwidth - r;
            for (entry, other) in self.rows[start..=start + r].iter_mut().zip(coefficients) {
                *entry += scaled * other;
            }
        }
    }

    /// Adds `weight * c c^T` for several vectors as in [`Self::add_outer`] whose runs start at `first` and lie one behind
    /// the other, one a weight: four at a time, since what is added up costs more to fetch than to add to.
    pub fn add_outers(&mut self, first: usize, runs: &[f64], weights: &[f64]) {
        let Some(length) = runs.len().checked_div(weights.len()).filter(|length| *length > 0) else { return };
        let width = self.half_bandwidth + 1;
        for (runs, weights) in runs.chunks(4 * length).zip(weights.chunks(4)) {
            let &[wa, wb, wc, wd] = weights else {
                for (run, weight) in runs.chunks(length).zip(weights) {
                    self.add_outer(first, run, *weight);
                }
                continue;
            };
            let (ab, cd) = runs.split_at(2 * length);
            let ((a, b), (c, d)) = (ab.split_at(length), cd.split_at(length));
            for r in 0..length {
                let (sa, sb, sc, sd) = (wa * a[r], wb * b[r], wc * c[r], wd * d[r]);
                let start = (first + r) * width + self.half_bandwidth - r;
                let others = a.iter().zip(b).zip(c.iter().zip(d));
                for (entry, ((a, b), (c, d))) in self.rows[start..=start + r].iter_mut().zip(others) {
                    *entry += (sa * a + sb * b) + (sc * c + sd * d);
                }
            }
        }
    }

    /// Adds another matrix of the same size and band.
    pub fn add(&mut self, other: &Self) {
        for (entry, value) in self.rows.iter_mut().zip(&other.rows) {
            *entry += value;
        }
    }

    /// The product with a vector.
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        let w = self.half_bandwidth;
        let mut product = vec![0.0; self.size];
        for i in 0..self.size {
            let (row, reach) = (self.row(i), i.min(w));
            product[i] += row[w] * x[i];
            for (k, entry) in row[w - reach..w].iter().enumerate() {
                let j = i - reach + k;
                product[i] += entry * x[j];
                product[j] += entry * x[i];
            }
        }
        product
    }

    /// Factors in place into `L L^T`; `None` when a pivot is not positive.
    pub fn factor(mut self) -> Option<Factor> {
        let (n, w) = (self.size, self.half_bandwidth);
        let width = w + 1;
        for i in 0..n {
            let reach = i.min(w);
            for j in i - reach..=i {
                // Entries k of rows i and j with k < j, both inside the band.
                let low = (i - reach).max(j.saturating_sub(w));
                let a = i * width + w + low - i;
                let b = j * width + w + low - j;
                let count = j - low;
                let at = i * width + w + j - i;
                let value = self.rows[at] - dot(&self.rows[a..a + count], &self.rows[b..b + count]);
                if j == i {
                    if !(value > 0.0 && value.is_finite()) {
                        return None;
                    }
                    self.rows[at] = value.sqrt();
                } else {
                    self.rows[at] = value / self.rows[j * width + w];
                }
            }
        }
        Some(Factor { lower: self })
    }
}

/// A Cholesky factor, ready to solve.
#[derive(Clone, Debug)]
pub struct Factor {
    lower: BandedMatrix,
}

impl Factor {
    /// Solves `A x = b` in place.
    pub fn solve(&self, b: &mut [f64]) {
        let (n, w) = (self.lower.size, self.lower.half_bandwidth);
        for i in 0..n {
            let (row, reach) = (self.lower.row(i), i.min(w));
            b[i] = (b[i] - dot(&row[w - reach..w], &b[i - reach..i])) / row[w];
        }
        for i in (0..n).rev() {
            let (row, reach) = (self.lower.row(i), i.min(w));
            b[i] /= row[w];
            let value = b[i];
            for (entry, x) in row[w - reach..w].iter().zip(&mut b[i - reach..i]) {
                *x -= entry * value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_what_it_was_made_from() {
        let (n, w) = (40, 5);
        let mut matrix = BandedMatrix::zeros(n, w);
        let mut dense = vec![vec![0.0; n]; n];
        for first in 0..n - w {
            let run: Vec<f64> = (0..=w).map(|k| ((first * 7 + k * 13) % 11) as f64 - 4.5).collect();
            matrix.add_outer(first, &run, 0.3);
            for r in 0..=w {
                for c in 0..=w {
                    dense[first + r][first + c] += 0.3 * run[r] * run[c];
                }
            }
        }
        for (i, row) in dense.iter_mut().enumerate() {
            matrix.add_diagonal(i, 1e-3);
            row[i] += 1e-3;
        }
        let want: Vec<f64> = (0..n).map(|i| (i as f64 * 0.37).sin()).collect();
        let mut b: Vec<f64> = dense.iter().map(|row| row.iter().zip(&want).map(|(a, x)| a * x).sum()).collect();
        matrix.factor().unwrap().solve(&mut b);
        for (got, want) in b.iter().zip(&want) {
            assert!((got - want).abs() < 1e-8, "{got} {want}");
        }
    }

    #[test]
    fn many_outer_products_are_the_sum_of_each() {
        let (n, w) = (12, 4);
        let runs: Vec<f64> = (0..7 * 5).map(|k| ((k * 13) % 11) as f64 - 4.5).collect();
        let weights: Vec<f64> = (0..7).map(|k| 0.2 + f64::from(k)).collect();
        let (mut one_by_one, mut at_once) = (BandedMatrix::zeros(n, w), BandedMatrix::zeros(n, w));
        for (run, weight) in runs.chunks(5).zip(&weights) {
            one_by_one.add_outer(3, run, *weight);
        }
        at_once.add_outers(3, &runs, &weights);
        for (a, b) in one_by_one.rows.iter().zip(&at_once.rows) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    }

    #[test]
    fn indefinite_matrices_are_refused() {
        let mut matrix = BandedMatrix::zeros(3, 1);
        matrix.add_outer(0, &[1.0, 1.0], 1.0);
        assert!(matrix.factor().is_none());
    }
}
