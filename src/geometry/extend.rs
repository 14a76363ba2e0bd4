//! B-spline surfaces on a larger parameter rectangle: the end polynomials go on, now as part of the surface.
//! Uses the rest of `geometry`.

use super::knots::Knots;
use super::{Point, SplineSurface, Vector};

/// The surface whose domain reaches farther by `share` of its length at each of its four sides; the same points where
/// it was defined before. None for rational surfaces, and where the knots leave no room.
///
/// Control point i of a spline of degree p is the blossom of any piece it has influence on, at its p inner knots
/// (Piegl, Tiller, The NURBS Book, section 5.2 by another name): moving the end knots outward asks for new values of the
/// first and last p blossoms only.
pub fn extended(surface: &SplineSurface, share: f64) -> Option<SplineSurface> {
    if surface.weights().is_some() {
        return None;
    }
    let (knots_u, knots_v) = (surface.knots_u(), surface.knots_v());
    let (rows, columns) = (knots_u.controls(), knots_v.controls());
    let (longer_u, longer_v) = (longer(knots_u, share), longer(knots_v, share));
    let control = surface.control();
    let along_u: Vec<Vec<Vector>> = (0..columns)
        .map(|j| {
            let column: Vec<Vector> = (0..rows).map(|i| control[i * columns + j].coords).collect();
            moved(knots_u, &longer_u, &column)
        })
        .collect();
    let control = (0..rows)
        .map(|i| {
            let row: Vec<Vector> = along_u.iter().map(|column| column[i]).collect();
            moved(knots_v, &longer_v, &row).into_iter().map(Point::from).collect()
        })
        .collect();
    SplineSurface::new([knots_u.degree(), knots_v.degree()], [longer_u, longer_v], control, None).ok()
}

/// The knots with both ends moved outward.
fn longer(knots: &Knots, share: f64) -> Vec<f64> {
    let (low, high) = knots.domain();
    let by = share * (high - low);
    let (degree, controls) = (knots.degree(), knots.controls());
    let mut values = knots.values().to_vec();
    values[..=degree].fill(low - by);
    values[controls..].fill(high + by);
    values
}

/// The control values that belong to the longer knots.
fn moved(knots: &Knots, longer: &[f64], control: &[Vector]) -> Vec<Vector> {
    let (degree, controls) = (knots.degree(), knots.controls());
    let mut moved = control.to_vec();
    for (i, value) in moved.iter_mut().enumerate() {
        let arguments = &longer[i + 1..=i + degree];
        if i < degree {
            *value = blossom(knots, degree, control, arguments);
        } else if i + degree >= controls {
            *value = blossom(knots, controls - 1, control, arguments);
        }
    }
    moved
}

/// Blossom of the polynomial piece on knot span `span` at as many arguments as its degree (de Boor's recursion with one
/// argument a level).
fn blossom(knots: &Knots, span: usize, control: &[Vector], arguments: &[f64]) -> Vector {
    let (degree, values) = (knots.degree(), knots.values());
    let mut points: Vec<Vector> = control[span - degree..=span].to_vec();
    for (level, argument) in arguments.iter().enumerate() {
        for j in (level + 1..=degree).rev() {
            let (left, right) = (values[j + span - degree], values[j + span - level]);
            let share = (argument - left) / (right - left);
            points[j] = points[j - 1] * (1.0 - share) + points[j] * share;
        }
    }
    points[degree]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bumpy(degree: usize, rows: usize, columns: usize) -> SplineSurface {
        let control = (0..rows)
            .map(|i| {
                let at = |j: usize| Point::new(i as f64, j as f64, ((i * 5 + j * 3) % 7) as f64 * 0.3);
                (0..columns).map(at).collect()
            })
            .collect();
        let knots = |count| Knots::clamped_uniform(degree, count).unwrap().values().to_vec();
        SplineSurface::new([degree, degree], [knots(rows), knots(columns)], control, None).unwrap()
    }

    #[test]
    fn the_surface_goes_on_as_its_end_polynomials_do() {
        for (degree, rows, columns) in [(3, 9, 7), (3, 4, 5), (2, 5, 3), (1, 2, 4)] {
            let surface = bumpy(degree, rows, columns);
            let longer = extended(&surface, 0.1).unwrap();
            assert_eq!(longer.domain().map(|(low, _)| (low * 1e6).round() / 1e6), [-0.1, -0.1]);
            for i in -2..=22 {
                for j in -2..=22 {
                    let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                    let off = (surface.point(u, v) - longer.point(u, v)).norm();
                    assert!(off < 1e-11, "degree {degree}, {rows} x {columns}, ({u}, {v}): {off}");
                }
            }
        }
    }
}
