//! Polynomials over a triangle in Bernstein-Bezier form, of degrees two and three, with values in space. Uses nothing
//! else of this module.
//!
//! Weights of the triangle's corners, three numbers with sum 1, are the parameters. A polynomial of degree d has one
//! symmetric affine form in d such parameters, its blossom; control points are its values at the corners, and so are
//! those of any part of the triangle at that part's corners (Farin, Curves and Surfaces for CAGD, chapter on Bezier
//! triangles).

use super::Vector;

/// Weights of a triangle's corners; their sum is 1.
pub type Barycentric = [f64; 3];

/// The polynomial of degree one through three corners.
type Linear = [Vector; 3];

/// A polynomial of degree two: control values at the corners, then between corners 0 and 1, 1 and 2, 2 and 0.
#[derive(Clone, Copy, Debug)]
pub struct QuadraticTriangle(pub [Vector; 6]);

/// A polynomial of degree three: control points at the corners, then two along each side (0 to 1, 1 to 2, 2 to 0, in the
/// order of the way round), then the one in the middle.
#[derive(Clone, Copy, Debug)]
pub struct CubicTriangle(pub [Vector; 10]);

/// Value and first derivatives of a cubic, and its second ones: along the way from corner 0 to corner 1 (u), and to
/// corner 2 (v).
#[derive(Clone, Copy, Debug)]
pub struct TriangleJet {
    /// The point.
    pub point: Vector,
    /// Along u.
    pub u: Vector,
    /// Along v.
    pub v: Vector,
    /// Twice along u.
    pub uu: Vector,
    /// Along both.
    pub uv: Vector,
    /// Twice along v.
    pub vv: Vector,
}

fn mean(values: [&Vector; 3], [a, b, c]: &Barycentric) -> Vector {
    values[0] * *a + values[1] * *b + values[2] * *c
}

fn on_line([a, b, c]: &Linear, w: &Barycentric) -> Vector {
    mean([a, b, c], w)
}

impl QuadraticTriangle {
    /// The blossom with one argument given.
    fn polar(&self, w: &Barycentric) -> Linear {
        let [a, b, c, ab, bc, ca] = &self.0;
        [mean([a, ab, ca], w), mean([ab, b, bc], w), mean([ca, bc, c], w)]
    }

    /// The value at some weights.
    pub fn at(&self, w: &Barycentric) -> Vector {
        on_line(&self.polar(w), w)
    }

    /// The same polynomial over the part between three corners.
    #[must_use]
    pub fn part(&self, [a, b, c]: &[Barycentric; 3]) -> Self {
        let [at_a, at_b, at_c] = [a, b, c].map(|w| self.polar(w));
        Self([
            on_line(&at_a, a),
            on_line(&at_b, b),
            on_line(&at_c, c),
            on_line(&at_a, b),
            on_line(&at_b, c),
            on_line(&at_c, a),
        ])
    }
}

impl CubicTriangle {
    fn polar(&self, w: &Barycentric) -> QuadraticTriangle {
        let [a, b, c, aab, abb, bbc, bcc, cca, caa, abc] = &self.0;
        QuadraticTriangle([
            mean([a, aab, caa], w),
            mean([abb, b, bbc], w),
            mean([cca, bcc, c], w),
            mean([aab, abb, abc], w),
            mean([abc, bbc, bcc], w),
            mean([caa, abc, cca], w),
        ])
    }

    /// The value at some weights.
    pub fn at(&self, w: &Barycentric) -> Vector {
        self.polar(w).at(w)
    }

    /// Value and derivatives.
    pub fn jet(&self, w: &Barycentric) -> TriangleJet {
        let quadratic = self.polar(w);
        let [a, b, c] = quadratic.polar(w);
        let [aa, bb, cc, ab, bc, ca] = &quadratic.0;
        TriangleJet {
            point: mean([&a, &b, &c], w),
            u: (b - a) * 3.0,
            v: (c - a) * 3.0,
            uu: (bb - ab * 2.0 + aa) * 6.0,
            uv: (bc - ab - ca + aa) * 6.0,
            vv: (cc - ca * 2.0 + aa) * 6.0,
        }
    }

    /// The same polynomial over the part between three corners.
    #[must_use]
    pub fn part(&self, [a, b, c]: &[Barycentric; 3]) -> Self {
        let [at_a, at_b, at_c] = [a, b, c].map(|w| self.polar(w));
        let [aa, bb, cc] = [at_a.polar(a), at_b.polar(b), at_c.polar(c)];
        Self([
            on_line(&aa, a),
            on_line(&bb, b),
            on_line(&cc, c),
            on_line(&aa, b),
            on_line(&bb, a),
            on_line(&bb, c),
            on_line(&cc, b),
            on_line(&cc, a),
            on_line(&aa, c),
            on_line(&at_a.polar(b), c),
        ])
    }

    /// The quarters between corners and middles of the sides: which corners each has, as weights.
    pub fn quarters() -> [[Barycentric; 3]; 4] {
        let [a, b, c] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let [ab, bc, ca] = [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    }

    /// No point of the polynomial is farther from the flat triangle's point of the same weights.
    ///
    /// Their difference is a cubic, too, whose control points at the corners are zero; the Bernstein polynomials of the
    /// others sum to 1 - a³ - b³ - c³ <= 8/9.
    pub fn bulge(&self) -> f64 {
        let [a, b, c, ..] = &self.0;
        let third = 1.0 / 3.0;
        let (near, far) = (2.0 * third, third);
        let flat = [
            a * near + b * far,
            a * far + b * near,
            b * near + c * far,
            b * far + c * near,
            c * near + a * far,
            c * far + a * near,
            (a + b + c) * third,
        ];
        let off = |(control, flat): (&Vector, &Vector)| (control - flat).norm_squared();
        8.0 / 9.0 * self.0[3..].iter().zip(&flat).map(off).fold(0.0, f64::max).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cubic() -> impl Strategy<Value = CubicTriangle> {
        prop::collection::vec(-3.0..3.0f64, 30)
            .prop_map(|x| CubicTriangle(std::array::from_fn(|k| Vector::new(x[3 * k], x[3 * k + 1], x[3 * k + 2]))))
    }

    fn weights() -> impl Strategy<Value = Barycentric> {
        (0.0..1.0f64, 0.0..1.0f64).prop_map(|(a, b)| {
            let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
            [1.0 - a - b, a, b]
        })
    }

    /// The Bernstein sum, term by term.
    fn bernstein(cubic: &CubicTriangle, [a, b, c]: Barycentric) -> Vector {
        let terms = [
            a * a * a,
            b * b * b,
            c * c * c,
            3.0 * a * a * b,
            3.0 * a * b * b,
            3.0 * b * b * c,
            3.0 * b * c * c,
            3.0 * c * c * a,
            3.0 * c * a * a,
            6.0 * a * b * c,
        ];
        cubic.0.iter().zip(terms).map(|(control, term)| control * term).sum()
    }

    proptest! {
        #[test]
        fn values_are_the_bernstein_sum_and_derivatives_its_slopes(cubic in cubic(), w in weights()) {
            let jet = cubic.jet(&w);
            prop_assert!((jet.point - bernstein(&cubic, w)).norm() < 1e-13);
            prop_assert!((cubic.at(&w) - jet.point).norm() < 1e-13);
            let h = 1e-5;
            let at = |u: f64, v: f64| cubic.jet(&[w[0] - u - v, w[1] + u, w[2] + v]);
            let slope = |a: TriangleJet, b: TriangleJet, of: fn(&TriangleJet) -> Vector| (of(&a) - of(&b)) / (2.0 * h);
            prop_assert!((slope(at(h, 0.0), at(-h, 0.0), |j| j.point) - jet.u).norm() < 1e-7);
            prop_assert!((slope(at(0.0, h), at(0.0, -h), |j| j.point) - jet.v).norm() < 1e-7);
            prop_assert!((slope(at(h, 0.0), at(-h, 0.0), |j| j.u) - jet.uu).norm() < 1e-7);
            prop_assert!((slope(at(0.0, h), at(0.0, -h), |j| j.u) - jet.uv).norm() < 1e-7);
            prop_assert!((slope(at(0.0, h), at(0.0, -h), |j| j.v) - jet.vv).norm() < 1e-7);
        }

        #[test]
        fn a_part_is_the_same_polynomial_and_no_point_leaves_it_beyond_the_bulge(
            cubic in cubic(), corners in prop::array::uniform3(weights()), w in weights(),
        ) {
            let part = cubic.part(&corners);
            let place = std::array::from_fn(|k| (0..3).map(|i| w[i] * corners[i][k]).sum());
            prop_assert!((part.at(&w) - cubic.at(&place)).norm() < 1e-12);
            let [a, b, c, ..] = &part.0;
            prop_assert!((part.at(&w) - mean([a, b, c], &w)).norm() <= part.bulge() + 1e-12);
            let [a, b, c, aab, _, bbc, _, cca, ..] = cubic.0;
            let quadratic = QuadraticTriangle([a, b, c, aab, bbc, cca]);
            prop_assert!((quadratic.part(&corners).at(&w) - quadratic.at(&place)).norm() < 1e-12);
        }
    }

    #[test]
    fn quarters_cover_the_triangle() {
        let area = |[a, b, c]: &[Barycentric; 3]| (b[1] - a[1]) * (c[2] - a[2]) - (c[1] - a[1]) * (b[2] - a[2]);
        assert_eq!(CubicTriangle::quarters().iter().map(area).collect::<Vec<_>>(), [0.25; 4]);
    }
}
