//! From positions of the tool to a motion: rigid whatever the optimizer left, smooth between the positions. Uses
//! `geometry`, `motion`, `optimize` and the rest of this method.

use super::problem::Axis;
use crate::geometry::{Knots, Point, SplineCurve};
use crate::motion::RuledMotion;
use crate::optimize::BandedMatrix;

/// The motion of a tool through all positions of a strip. At every position the axis is exactly `length` mm long, its
/// middle that of the position, so rigidity (equation 4) holds by construction; the penalty only made it cheap.
/// `height` is that of the first sphere's centre above the tip.
pub(super) fn motion(axes: &[Axis], length: f64, height: f64) -> Option<RuledMotion> {
    let (mut lower, mut upper) = (Vec::with_capacity(axes.len()), Vec::with_capacity(axes.len()));
    for axis in axes {
        let half = (axis.b - axis.a).try_normalize(1e-9)? * (0.5 * length);
        let middle = nalgebra::center(&axis.a, &axis.b);
        lower.push(middle - half);
        upper.push(middle + half);
    }
    let middles: Vec<Point> = axes.iter().map(|axis| nalgebra::center(&axis.a, &axis.b)).collect();
    let parameters = chord_parameters(&middles)?;
    let knots = averaged_knots(&parameters)?;
    let rail = |points: &[Point]| SplineCurve::from_knots(knots.clone(), through(&knots, &parameters, points)?).ok();
    Some(RuledMotion { lower: rail(&lower)?, upper: rail(&upper)?, lower_height: height })
}

/// Chord lengths along the points, scaled to 0..1.
fn chord_parameters(points: &[Point]) -> Option<Vec<f64>> {
    let mut sums = vec![0.0];
    for pair in points.windows(2) {
        let step = (pair[1] - pair[0]).norm();
        sums.push(sums.last()? + step);
    }
    let total = *sums.last()?;
    let increasing = sums.windows(2).all(|pair| pair[1] - pair[0] > 1e-9 * total);
    (increasing && total > 0.0).then(|| sums.iter().map(|s| s / total).collect())
}

/// Cubic knots averaged from the parameters. Source: Piegl and Tiller, The NURBS Book, equation 9.8.
fn averaged_knots(parameters: &[f64]) -> Option<Knots> {
    let count = parameters.len();
    let inner = parameters.get(1..count.checked_sub(1)?)?.windows(3).map(|w| w.iter().sum::<f64>() / 3.0);
    let values: Vec<f64> = [0.0; 4].into_iter().chain(inner).chain([1.0; 4]).collect();
    Knots::new(3, values, count).ok()
}

/// Control points of the curve through all points: the normal equations of the interpolation, which is well conditioned.
fn through(knots: &Knots, parameters: &[f64], points: &[Point]) -> Option<Vec<Point>> {
    let mut matrix = BandedMatrix::zeros(points.len(), 3);
    let mut right = vec![vec![0.0; points.len()]; 3];
    for (t, point) in parameters.iter().zip(points) {
        let basis = knots.basis(*t);
        let values = basis.ders[0].get(..4)?;
        matrix.add_outer(basis.first, values, 1.0);
        for (axis, right) in right.iter_mut().enumerate() {
            for (entry, value) in right[basis.first..].iter_mut().zip(values) {
                *entry += value * point[axis];
            }
        }
    }
    let factor = matrix.factor()?;
    right.iter_mut().for_each(|right| factor.solve(right));
    Some((0..points.len()).map(|i| Point::new(right[0][i], right[1][i], right[2][i])).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector;

    #[test]
    fn the_motion_passes_through_every_position_with_its_own_length() {
        let axes: Vec<Axis> = (0..12)
            .map(|i| {
                let t = f64::from(i) * 0.7;
                let a = Point::new(t, t.sin(), 0.3 * t);
                // Lengths vary by a hundredth, as an optimizer may leave them.
                let d = Vector::new(0.1 * t.cos(), 0.2, 1.0).normalize() * (2.0 + 0.02 * t.sin());
                Axis { a, b: a + d, normals: [Vector::y(); 2], places: [(0.0, 0.0); 2] }
            })
            .collect();
        let motion = motion(&axes, 2.0, 0.4).unwrap();
        let middles: Vec<Point> = axes.iter().map(|axis| nalgebra::center(&axis.a, &axis.b)).collect();
        for (t, axis) in chord_parameters(&middles).unwrap().iter().zip(&axes) {
            let (lower, upper) = (motion.lower.point(*t), motion.upper.point(*t));
            assert!(((upper - lower).norm() - 2.0).abs() < 1e-9);
            assert!((nalgebra::center(&lower, &upper) - nalgebra::center(&axis.a, &axis.b)).norm() < 1e-9);
            assert!((upper - lower).normalize().dot(&(axis.b - axis.a).normalize()) > 1.0 - 1e-12);
        }
    }

    #[test]
    fn positions_that_coincide_have_no_motion() {
        let axis = Axis {
            a: Point::origin(),
            b: Point::new(0.0, 0.0, 1.0),
            normals: [Vector::y(); 2],
            places: [(0.0, 0.0); 2],
        };
        assert!(motion(&[axis; 6], 1.0, 0.0).is_none());
    }
}
