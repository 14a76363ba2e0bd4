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

/// Nonzero basis functions and their first two derivatives at one parameter: row `k` holds derivative `k`. There is room
/// for `N` of them.
#[derive(Clone, Copy, Debug)]
pub struct Basis<const N: usize = { MAX_DEGREE + 1 }> {
    /// Index of the first control point that has influence.
    pub first: usize,
    /// `ders[k][j]`: derivative `k` of the basis function of control point `first + j`, `j <= degree`.
    pub ders: [[f64; N]; 3],
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

    /// Index i of the span with `values[i] <= t < values[i + 1]`; the last span holds its right end, and the end spans
    /// hold what lies outside the domain.
    pub fn span(&self, t: f64) -> usize {
        let (low, high) = (self.degree, self.controls());
        let (start, end) = self.domain();
        // Guessed as if the knots were evenly spaced, then walked to: most knots nearly are.
        let share = ((t - start) / (end - start)).clamp(0.0, 1.0);
        let mut span = (low + (share * (high - low) as f64) as usize).min(high - 1);
        while span > low && (self.values[span] > t || self.values[span] >= end) {
            span -= 1;
        }
        while span + 1 < high && self.values[span + 1] <= t && self.values[span + 1] < end {
            span += 1;
        }
        // Repeated knots at the left end make spans of no length.
        while self.values[span] >= self.values[span + 1] {
            span += 1;
        }
        span
    }

    /// Greville abscissa of control point `index`: the mean of its `degree` inner knots.
    pub fn greville(&self, index: usize) -> f64 {
        self.values[index + 1..=index + self.degree].iter().sum::<f64>() / self.degree as f64
    }

    /// Basis functions and first two derivatives at `t`. Outside the domain the end polynomials are continued.
    pub fn basis(&self, t: f64) -> Basis {
        let (p, span) = (self.degree, self.span(t));
        Basis { first: span - p, ders: derivatives(p, &self.values[span + 1 - p..=span + p], t) }
    }

    /// The same for cubics, to the last bit but in less than half the time, since all lengths are known; none for other
    /// degrees.
    #[inline]
    pub fn cubic_basis(&self, t: f64) -> Option<Basis<4>> {
        if self.degree != 3 {
            return None;
        }
        let span = self.span(t);
        let knots: &[f64; 6] = self.values.get(span - 2..)?.first_chunk()?;
        Some(Basis { first: span - 3, ders: derivatives(3, knots, t) })
    }

    /// Bernstein-Bezier form of the polynomial piece on knot span `span`, restricted to `[a, b]`: control point j of the
    /// piece is the sum over i of `row[j][i]` times control point `span - degree + i` of the spline. Row j is the blossom
    /// at (a, …, a, b, …, b) with j times b.
    pub fn bezier_rows(&self, span: usize, a: f64, b: f64) -> [[f64; MAX_DEGREE + 1]; MAX_DEGREE + 1] {
        let p = self.degree;
        let mut rows = [[0.0; MAX_DEGREE + 1]; MAX_DEGREE + 1];
        for (j, row) in rows.iter_mut().enumerate().take(p + 1) {
            // Transposed de Boor recursion: start from the blossom's value and spread its weight down to the controls.
            row[p] = 1.0;
            for level in (1..=p).rev() {
                let t = if p - level < j { b } else { a };
                let mut spread = [0.0; MAX_DEGREE + 1];
                for i in level..=p {
                    let (low, high) = (self.values[span - p + i], self.values[span + i + 1 - level]);
                    let share = (t - low) / (high - low);
                    spread[i] += share * row[i];
                    spread[i - 1] += (1.0 - share) * row[i];
                }
                *row = spread;
            }
        }
        rows
    }
}

/// The basis functions of degree `p` between the middle two of `knots`, which are 2 p, and their first two derivatives.
///
/// With N(r,d) the local functions of degree d and D(r,d) their knot differences (A2.2), the quotients
/// Q(r,d) = N(r,d-1) / D(r,d) that the recursion forms anyway give the derivatives: N'(r,d) = d (Q(r-1,d) - Q(r,d)),
/// and the second derivatives the same way from N'(r,p-1) / D(r,p) (equation 2.7).
#[inline(always)]
fn derivatives<const N: usize>(p: usize, knots: &[f64], t: f64) -> [[f64; N]; 3] {
    let mut ders = [[0.0; N]; 3];
    let mut quotients = [0.0; N];
    let mut lower_quotients = [0.0; N];
    let mut inverse = [0.0; N];
    let values = &mut ders[0];
    values[0] = 1.0;
    for d in 1..=p {
        if d == p {
            lower_quotients = quotients;
        }
        let mut saved = 0.0;
        for r in 0..d {
            let (left, right) = (knots[p + r - d], knots[p + r]);
            inverse[r] = 1.0 / (right - left);
            quotients[r] = values[r] * inverse[r];
            values[r] = saved + (right - t) * quotients[r];
            saved = (t - left) * quotients[r];
        }
        values[d] = saved;
    }
    let degree = p as f64;
    let (mut quotient_before, mut slope_before, mut lower_before) = (0.0, 0.0, 0.0);
    for r in 0..=p {
        // The last function has no right neighbour.
        let (quotient, lower) = if r < p { (quotients[r], lower_quotients[r]) } else { (0.0, 0.0) };
        ders[1][r] = degree * (quotient_before - quotient);
        quotient_before = quotient;
        if p >= 2 {
            let lower = if r + 1 < p { lower } else { 0.0 };
            let slope = if r < p { (degree - 1.0) * (lower_before - lower) * inverse[r] } else { 0.0 };
            ders[2][r] = degree * (slope_before - slope);
            (slope_before, lower_before) = (slope, lower);
        }
    }
    ders
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
    fn cubics_have_the_same_basis_to_the_last_bit_and_other_degrees_none_of_their_own() {
        for i in -10..=110 {
            let t = f64::from(i) / 100.0;
            let (any, cubic) = (sample().basis(t), sample().cubic_basis(t).unwrap());
            assert_eq!(any.first, cubic.first);
            for k in 0..3 {
                assert_eq!(any.ders[k][..4], cubic.ders[k]);
            }
        }
        assert!(Knots::clamped_uniform(2, 5).unwrap().cubic_basis(0.5).is_none());
    }

    #[test]
    fn bezier_rows_reproduce_the_spline_on_a_part_of_a_span() {
        let knots = sample();
        let control: Vec<f64> = (0..7).map(|i| ((i * i * 7) % 5) as f64).collect();
        let (a, b) = (0.25, 0.4);
        let span = knots.span(0.3);
        let rows = knots.bezier_rows(span, a, b);
        for i in 0..=10 {
            let s = f64::from(i) / 10.0;
            let bernstein = [(1.0 - s).powi(3), 3.0 * s * (1.0 - s).powi(2), 3.0 * s * s * (1.0 - s), s.powi(3)];
            let mut bezier = 0.0;
            for j in 0..4 {
                bezier += bernstein[j] * (0..4).map(|i| rows[j][i] * control[span - 3 + i]).sum::<f64>();
            }
            let basis = knots.basis(a + s * (b - a));
            let direct: f64 = (0..4).map(|i| basis.ders[0][i] * control[basis.first + i]).sum();
            assert!((bezier - direct).abs() < 1e-13, "{s}: {bezier} {direct}");
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
