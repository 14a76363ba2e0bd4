//! A bicubic surface through a grid of points. Source: Piegl and Tiller, The NURBS Book, sections 9.2.1 and 9.2.5.

use super::knots::Knots;
use super::surface::{SplineSurface, SurfaceError};
use super::{Point, Vector};

/// Why a grid cannot be interpolated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// Fewer than two points one way.
    #[error("the grid has {rows} x {columns} points; at least 2 x 2 are needed")]
    TooSmall {
        /// Points along u.
        rows: usize,
        /// Points along v.
        columns: usize,
    },
    /// All points of neighbouring rows (or columns) coincide.
    #[error("{} {} and {} of the grid coincide", if *along_u { "rows" } else { "columns" }, index - 1, index)]
    Coincident {
        /// Rows i (true) or columns j.
        along_u: bool,
        /// The second of them, from 0.
        index: usize,
    },
    /// The points do not make a surface.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
}

/// The surface through all points: `points[i][j]`, i along u, j along v; cubic, or of the highest degree that fewer than
/// four points allow. Parameters are chord lengths, averaged over the grid, on [0, 1]; knots are averaged from them.
pub fn interpolate_grid(points: &[Vec<Point>]) -> Result<SplineSurface, GridError> {
    let (rows, columns) = (points.len(), points.first().map_or(0, Vec::len));
    if let Some((row, found)) = points.iter().map(Vec::len).enumerate().find(|(_, n)| *n != columns) {
        return Err(SurfaceError::Ragged { row, found, expected: columns }.into());
    }
    if rows < 2 || columns < 2 {
        return Err(GridError::TooSmall { rows, columns });
    }
    for (row, line) in points.iter().enumerate() {
        if let Some(column) = line.iter().position(|p| !p.coords.iter().all(|x| x.is_finite())) {
            return Err(SurfaceError::NotFinite { row, column }.into());
        }
    }
    let along_v: Vec<Vec<Vector>> = points.iter().map(|line| line.iter().map(|p| p.coords).collect()).collect();
    let along_u = transposed(&along_v);
    let us = chord_parameters(&along_u).map_err(|index| GridError::Coincident { along_u: true, index })?;
    let vs = chord_parameters(&along_v).map_err(|index| GridError::Coincident { along_u: false, index })?;
    let knots_u = averaged_knots(&us).map_err(SurfaceError::KnotsU)?;
    let knots_v = averaged_knots(&vs).map_err(SurfaceError::KnotsV)?;
    // First all columns of the grid along u, then all rows of the result along v.
    let half = transposed(&solved(&knots_u, &us, along_u));
    let control = solved(&knots_v, &vs, half);
    let control = control.into_iter().map(|line| line.into_iter().map(Point::from).collect()).collect();
    let degree = [knots_u.degree(), knots_v.degree()];
    Ok(SplineSurface::new(degree, [knots_u.values().to_vec(), knots_v.values().to_vec()], control, None)?)
}

fn transposed(lines: &[Vec<Vector>]) -> Vec<Vec<Vector>> {
    let count = lines.first().map_or(0, Vec::len);
    (0..count).map(|j| lines.iter().map(|line| line[j]).collect()).collect()
}

/// Mean over all lines of the chord length up to each point, as a share of the whole line (equations 9.4, 9.5 and
/// algorithm A9.3); lines of no length do not count. Fails with the index of a point that no line moves to.
fn chord_parameters(lines: &[Vec<Vector>]) -> Result<Vec<f64>, usize> {
    let count = lines.first().map_or(0, Vec::len);
    let mut steps = vec![0.0; count];
    let mut counted = 0.0;
    for line in lines {
        let chords: Vec<f64> = line.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect();
        let total: f64 = chords.iter().sum();
        if total > 0.0 {
            counted += 1.0;
            for (step, chord) in steps[1..].iter_mut().zip(chords) {
                *step += chord / total;
            }
        }
    }
    let mut sum = 0.0;
    let mut parameters = Vec::with_capacity(count);
    for (index, step) in steps.iter().enumerate() {
        let before = sum;
        sum += step / f64::max(counted, 1.0);
        if index > 0 && sum - before <= 1e-9 {
            return Err(index);
        }
        parameters.push(sum);
    }
    parameters[count - 1] = 1.0;
    Ok(parameters)
}

/// Clamped knots whose inner values are means of `degree` neighbouring parameters (equation 9.8), so that the
/// collocation matrix is banded and regular.
fn averaged_knots(parameters: &[f64]) -> Result<Knots, super::knots::KnotError> {
    let count = parameters.len();
    let degree = 3.min(count - 1);
    let mut values = vec![0.0; degree + 1];
    values.extend((1..count - degree).map(|j| parameters[j..j + degree].iter().sum::<f64>() / degree as f64));
    values.extend(vec![1.0; degree + 1]);
    Knots::new(degree, values, count)
}

/// Control points of the curves through each of `lines`. The matrix is totally positive and banded with `degree` side
/// diagonals, so elimination needs no pivoting (de Boor and Pinkus 1977).
fn solved(knots: &Knots, parameters: &[f64], mut lines: Vec<Vec<Vector>>) -> Vec<Vec<Vector>> {
    let (count, degree) = (parameters.len(), knots.degree());
    // band[i][k] is the entry in row i and column i + k - degree.
    let mut band = vec![[0.0; 7]; count];
    for (i, t) in parameters.iter().enumerate() {
        let basis = knots.basis(*t);
        for j in 0..=degree {
            // Outside the band all values are zero (Schoenberg and Whitney).
            if let Some(entry) = (basis.first + j + degree).checked_sub(i).and_then(|k| band[i].get_mut(k)) {
                *entry = basis.ders[0][j];
            }
        }
    }
    for i in 0..count {
        let pivot = band[i];
        for below in i + 1..count.min(i + degree + 1) {
            let back = below - i;
            let factor = band[below][degree - back] / pivot[degree];
            for k in 1..=degree {
                band[below][degree - back + k] -= factor * pivot[degree + k];
            }
            for line in &mut lines {
                let upper = line[i];
                line[below] -= upper * factor;
            }
        }
    }
    for line in &mut lines {
        for i in (0..count).rev() {
            for k in 1..=degree.min(count - 1 - i) {
                let known = line[i + k];
                line[i] -= known * band[i][degree + k];
            }
            line[i] /= band[i][degree];
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid(rows: usize, columns: usize, point: impl Fn(f64, f64) -> [f64; 3]) -> Vec<Vec<Point>> {
        (0..rows).map(|i| (0..columns).map(|j| Point::from(point(i as f64, j as f64))).collect()).collect()
    }

    proptest! {
        #[test]
        fn passes_through_every_point(
            rows in 2usize..9, columns in 2usize..9, bumps in prop::collection::vec(-1.0..1.0f64, 81),
        ) {
            let bump = |x: f64, y: f64, k: usize| bumps[(x as usize * 9 + y as usize + 7 * k) % 81] * 0.4;
            let points = grid(rows, columns, |x, y| [x + bump(x, y, 1), 2.0 * y + bump(x, y, 2), bump(x, y, 3)]);
            let surface = interpolate_grid(&points).unwrap();
            prop_assert_eq!([surface.knots_u().degree(), surface.knots_v().degree()], [3.min(rows - 1), 3.min(columns - 1)]);
            for p in points.iter().flatten() {
                prop_assert!(surface.closest(p).distance < 1e-9);
            }
        }
    }

    #[test]
    fn a_plane_with_equal_steps_keeps_its_parameters() {
        let surface = interpolate_grid(&grid(8, 7, |x, y| [x, y, 0.5 * x - y])).unwrap();
        for (u, v) in [(0.13, 0.57), (0.5, 0.91), (0.99, 0.02)] {
            assert!((surface.point(u, v) - Point::new(7.0 * u, 6.0 * v, 3.5 * u - 6.0 * v)).norm() < 1e-12);
        }
    }

    #[test]
    fn a_finer_grid_of_a_cylinder_is_closer_by_the_fourth_power() {
        let error = |n: usize| {
            let angle = |x: f64| x / (n - 1) as f64;
            let surface =
                interpolate_grid(&grid(n, 3, |x, y| [10.0 * angle(x).cos(), 10.0 * angle(x).sin(), y])).unwrap();
            (0..=1000)
                .map(|i| (surface.point(f64::from(i) / 1000.0, 0.3).coords.xy().norm() - 10.0).abs())
                .fold(0.0, f64::max)
        };
        assert!(error(11) < 1e-4 && error(21) < error(11) / 12.0, "{} {}", error(11), error(21));
    }

    #[test]
    fn bad_grids_are_refused() {
        let ones = grid(1, 5, |x, y| [x, y, 0.0]);
        assert_eq!(interpolate_grid(&ones).unwrap_err(), GridError::TooSmall { rows: 1, columns: 5 });
        let doubled = grid(4, 4, |x, y| [x, y.min(2.0), 0.0]);
        assert_eq!(interpolate_grid(&doubled).unwrap_err(), GridError::Coincident { along_u: false, index: 3 });
        let mut ragged = grid(4, 4, |x, y| [x, y, 0.0]);
        ragged[2].pop();
        assert!(matches!(interpolate_grid(&ragged), Err(GridError::Surface(SurfaceError::Ragged { row: 2, .. }))));
    }
}
