//! Knot vectors and B-spline basis functions. Source: Piegl and Tiller, The NURBS Book, algorithms A2.1 to A2.3.

/// Highest degree that the evaluators accept.
pub const MAX_DEGREE: usize = 9;

/// Why a knot vector is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KnotError {
    /// Degree zero, or above [`MAX_DEGREE`].
    #[error("degree {0} is outside 1..={MAX_DEGREE}")]
    Degree(usize),
    /// The three counts do not fit together.
    #[error("{knots} knots for degree {degree} and {controls} control points; there must be {}", controls + degree + 1)]
    Count {
        /// Knots given.
        knots: usize,
        /// Degree given.
        degree: usize,
        /// Control points given.
        controls: usize,
    },
    /// Fewer control points than degree + 1.
    #[error("{controls} control points are too few for degree {degree}")]
    TooFew {
        /// Degree given.
        degree: usize,
        /// Control points given.
        controls: usize,
    },
    /// A knot smaller than its predecessor, or not finite.
    #[error("knot {index} is {value}, which is not finite or smaller than the knot before it")]
    Order {
        /// Index of the offending knot, from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// An interior knot repeated more often than the degree, or an empty domain.
    #[error("knot {value} is repeated so often that the spline falls apart there")]
    Multiplicity {
        /// The offending value.
        value: f64,
    },
}

/// A valid knot vector with its degree: nondecreasing, finite, with a domain of positive length.
#[derive(Clone, Debug, PartialEq)]
pub struct Knots {
    degree: usize,
    values: Vec<f64>,
}

/// Nonzero basis functions and their first two derivatives at one parameter: row `k` holds derivative `k`.
#[derive(Clone, Copy, Debug)]
pub struct Basis {
    /// Index of the first control point that has influence.
    pub first: usize,
    /// `ders[k][j]`: derivative `k` of the basis function of control point `first + j`, `j <= degree`.
    pub ders: [[f64; MAX_DEGREE + 1]; 3],
}

impl Knots {
    /// Checks a knot vector for `controls` control points.
    pub fn new(degree: usize, values: Vec<f64>, controls: usize) -> Result<Self, KnotError> {
        if degree == 0 || degree > MAX_DEGREE {
            return Err(KnotError::Degree(degree));
        }
        if controls <= degree {
            return Err(KnotError::TooFew { degree, controls });
        }
        if values.len() != controls + degree + 1 {
            return Err(KnotError::Count { knots: values.len(), degree, controls });
        }
        for (index, value) in values.iter().enumerate() {
            if !value.is_finite() || (index > 0 && *value < values[index - 1]) {
                return Err(KnotError::Order { index, value: *value });
            }
        }
        for run in values[1..values.len() - 1].windows(degree + 1) {
            let interior = run[0] > values[degree] && run[0] < values[controls];
            if run[0] == run[degree] && interior {
                return Err(KnotError::Multiplicity { value: run[0] });
            }
        }
        if values[degree] >= values[controls] {
            return Err(KnotError::Multiplicity { value: values[degree] });
        }
        Ok(Self { degree, values })
    }

    /// Clamped knots over [0, 1] with equal spans.
    pub fn clamped_uniform(degree: usize, controls: usize) -> Result<Self, KnotError> {
        let spans = controls.saturating_sub(degree).max(1);
        let mut values = vec![0.0; degree + 1];
        values.extend((1..spans).map(|i| i as f64 / spans as f64));
        values.extend(std::iter::repeat_n(1.0, degree + 1));
        Self::new(degree, values, controls)
    }

    /// Degree of the spline.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The knot values.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Number of control points that belong to this vector.
    pub fn controls(&self) -> usize {
        self.values.len() - self.degree - 1
    }

    /// Parameter interval on which the basis is complete.
    pub fn domain(&self) -> (f64, f64) {
        (self.values[self.degree], self.values[self.controls()])
    }

    /// Distinct knot values inside the domain, ends included: the joints between polynomial pieces.
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.values[self.degree..=self.controls()].to_vec();
        breaks.dedup();
        breaks
    }

    /// Index i of the span with `values[i] <= t < values[i + 1]`; the last span holds its right end.
    pub fn span(&self, t: f64) -> usize {
        let (low, high) = (self.degree, self.controls());
        if t >= self.values[high] {
            let mut span = high - 1;
            while self.values[span] >= self.values[high] {
                span -= 1;
            }
            return span;
        }
        let inside = &self.values[low..=high];
        (low + inside.partition_point(|k| *k <= t)).saturating_sub(1).max(low)
    }

    /// Greville abscissa of control point `index`: the mean of its `degree` inner knots.
    pub fn greville(&self, index: usize) -> f64 {
        self.values[index + 1..=index + self.degree].iter().sum::<f64>() / self.degree as f64
    }

    /// Basis functions and first two derivatives at `t`. Outside the domain the end polynomials are continued.
    pub fn basis(&self, t: f64) -> Basis {
        let (p, span, knots) = (self.degree, self.span(t), &self.values);
        let mut left = [0.0; MAX_DEGREE + 1];
        let mut right = [0.0; MAX_DEGREE + 1];
        // ndu[j][r]: upper triangle basis functions, lower triangle knot differences (A2.3).
        let mut ndu = [[0.0; MAX_DEGREE + 1]; MAX_DEGREE + 1];
        ndu[0][0] = 1.0;
        for j in 1..=p {
            left[j] = t - knots[span + 1 - j];
            right[j] = knots[span + j] - t;
            let mut saved = 0.0;
            for r in 0..j {
                ndu[j][r] = right[r + 1] + left[j - r];
                let quotient = ndu[r][j - 1] / ndu[j][r];
                ndu[r][j] = saved + right[r + 1] * quotient;
                saved = left[j - r] * quotient;
            }
            ndu[j][j] = saved;
        }
        let mut ders = [[0.0; MAX_DEGREE + 1]; 3];
        for (j, column) in ndu.iter().take(p + 1).enumerate() {
            ders[0][j] = column[p];
        }
        let degree = p as f64;
        for r in 0..=p {
            let below = |k: usize, i: isize| -> f64 {
                // Basis function of degree p - k with local index i, over its knot difference.
                let d = p - k;
                if i < 0 || i as usize > d { 0.0 } else { ndu[i as usize][d] }
            };
            let i = r as isize;
            let difference = |d: usize, at: isize| -> f64 { ndu[d][at as usize] };
            // First derivative: p (N_{i-1,p-1} / (u_{i+p-1} - u_{i-1}) - N_{i,p-1} / (u_{i+p} - u_i)), local indices.
            let slope = |d: usize, i: isize, lower: &dyn Fn(isize) -> f64| -> f64 {
                let mut sum = 0.0;
                if i >= 1 {
                    sum += lower(i - 1) / difference(d, i - 1);
                }
                if i < d as isize {
                    sum -= lower(i) / difference(d, i);
                }
                sum
            };
            ders[1][r] = degree * slope(p, i, &|k| below(1, k));
            if p >= 2 {
                let first = |k: isize| (degree - 1.0) * slope(p - 1, k, &|m| below(2, m));
                ders[2][r] = degree * slope(p, i, &first);
            }
        }
        Basis { first: span - p, ders }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Knots {
        Knots::new(3, vec![0.0, 0.0, 0.0, 0.0, 0.2, 0.45, 0.45, 1.0, 1.0, 1.0, 1.0], 7).unwrap()
    }

    #[test]
    fn basis_sums_to_one_and_derivatives_to_zero() {
        for i in 0..=100 {
            let basis = sample().basis(i as f64 / 100.0);
            for (k, want) in [(0, 1.0), (1, 0.0), (2, 0.0)] {
                let sum: f64 = basis.ders[k][..=3].iter().sum();
                assert!((sum - want).abs() < 1e-11, "derivative {k} at {i}: {sum}");
            }
        }
    }

    #[test]
    fn derivatives_match_central_differences() {
        let knots = sample();
        let dense = |t: f64, k: usize| {
            let basis = knots.basis(t);
            let mut all = [0.0; 7];
            all[basis.first..basis.first + 4].copy_from_slice(&basis.ders[k][..4]);
            all
        };
        let step = 1e-6;
        for t in [0.05, 0.19, 0.33, 0.7, 0.93] {
            for k in 0..2 {
                let (before, after, here) = (dense(t - step, k), dense(t + step, k), dense(t, k + 1));
                for c in 0..7 {
                    let difference = (after[c] - before[c]) / (2.0 * step);
                    assert!((difference - here[c]).abs() < 1e-6 * (1.0 + here[c].abs()), "{t} {k} {c}");
                }
            }
        }
    }

    #[test]
    fn bad_knots_are_refused_by_kind() {
        assert_eq!(Knots::new(0, vec![], 0), Err(KnotError::Degree(0)));
        assert!(matches!(Knots::new(3, vec![0.0; 7], 4), Err(KnotError::Count { .. })));
        assert!(matches!(Knots::new(1, vec![0.0, 0.0, 1.0, 0.5], 2), Err(KnotError::Order { index: 3, .. })));
        assert!(matches!(Knots::new(1, vec![0.0, 0.0, f64::NAN, 1.0], 2), Err(KnotError::Order { index: 2, .. })));
        assert!(matches!(
            Knots::new(1, vec![0.0, 0.0, 0.5, 0.5, 1.0, 1.0], 4),
            Err(KnotError::Multiplicity { value: 0.5 })
        ));
    }
}
