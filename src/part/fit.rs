//! A bicubic spline fitted to a mesh, because planning needs a spline. What the fit loses is measured and said; what is
//! verified is the mesh itself.

use super::oriented_spline::OrientedSpline;
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{
    FitPoint, ParametrizeError, Point, SplineSurface, SquareMap, TriangleMesh, fit_surface, map_to_square,
};

/// Share of the mesh's size that counts as met.
const GOOD_ENOUGH: f64 = 1e-6;
/// Smoothing first, and least, see [`fit_surface`].
const SMOOTHING: f64 = 1e-7;
/// Weight of a boundary vertex, which has data on one side only.
const BOUNDARY_WEIGHT: f64 = 4.0;
/// Times the parameters are moved to the feet of their points.
const CORRECTIONS: usize = 3;
/// Control points along one side at most.
const MOST_CONTROLS: usize = 60;

/// The fitted spline and its largest distance from the mesh's vertices and the middles of its edges and triangles, mm.
pub(super) fn spline_of_mesh(mesh: &TriangleMesh) -> Result<(OrientedSpline, f64)> {
    let map = map_to_square(mesh).map_err(|error| refused(&error))?;
    let scale = mesh.bounds().diagonal();
    let broken = || {
        Diagnostic::error("no smooth surface can be laid through the mesh for planning")
            .help("give the surface as a .json spline or a .csv grid, or remesh it with even triangles")
    };
    let mut best: Option<(SplineSurface, f64)> = None;
    for controls in ladder(mesh, &map) {
        let Some((surface, error)) = fitted(mesh, &map, controls) else {
            continue;
        };
        let better = best.as_ref().is_none_or(|(_, least)| error < *least);
        if better {
            best = Some((surface, error));
        }
        if error <= GOOD_ENOUGH * scale {
            break;
        }
    }
    let (surface, _) = best.ok_or_else(broken)?;
    let error = largest_distance(mesh, &surface);
    let spline = OrientedSpline::new(surface, false).map_err(|_| broken())?;
    Ok((spline, error))
}

fn refused(error: &ParametrizeError) -> Box<Diagnostic> {
    let help = match error {
        ParametrizeError::Pieces(_) => {
            "give one connected surface a file; where pieces only seem to meet, merge close vertices"
        }
        ParametrizeError::Closed => "give the flank alone, cut out of the body along its four edges",
        ParametrizeError::NotADisc { .. } => "fill its holes, or cut out a patch with four edges",
        ParametrizeError::FewBoundaryVertices(_) => "give a patch with four edges",
        ParametrizeError::Singular => "remesh the surface with even triangles, or give a .json spline or .csv grid",
    };
    Diagnostic::error(format!("the mesh cannot be planned on: {error}; a patch with four edges is needed")).help(help)
}

/// Numbers of control points to try, coarse to fine, in proportion to the sides, fewer than there are vertices.
fn ladder(mesh: &TriangleMesh, map: &SquareMap) -> Vec<[usize; 2]> {
    let [long, short] = map.side_lengths;
    let aspect = (long / short).clamp(1.0, 8.0);
    let vertices = mesh.vertices().len() as f64;
    let mut steps: Vec<[usize; 2]> = Vec::new();
    let mut across = 4.0f64;
    loop {
        let along = (across * aspect.sqrt()).min(MOST_CONTROLS as f64);
        let controls = [along.round() as usize, across.round() as usize];
        let too_many = (controls[0] * controls[1]) as f64 > 0.6 * vertices || across > MOST_CONTROLS as f64;
        if too_many && !steps.is_empty() {
            return steps;
        }
        steps.push(controls);
        across *= 1.4;
    }
}

/// Fits, moves the parameters to the feet, and fits again; the error is the largest distance of a vertex.
fn fitted(mesh: &TriangleMesh, map: &SquareMap, controls: [usize; 2]) -> Option<(SplineSurface, f64)> {
    let mut points: Vec<FitPoint> = mesh
        .vertices()
        .iter()
        .zip(&map.parameters)
        .map(|(point, parameters)| FitPoint { parameters: *parameters, point: *point, weight: 1.0 })
        .collect();
    for vertex in &map.boundary {
        points[*vertex as usize].weight = BOUNDARY_WEIGHT;
    }
    let mut best: Option<(SplineSurface, f64)> = None;
    for _ in 0..=CORRECTIONS {
        let surface = fit_surface(&points, controls, SMOOTHING)?;
        let mut error = 0.0f64;
        for point in &mut points {
            let foot = surface.closest(&point.point);
            error = error.max(foot.distance);
            let [u, v] = point.parameters;
            // A boundary vertex keeps to its edge, a corner stays.
            let on_edge = |x: f64| x == 0.0 || x == 1.0;
            point.parameters = [if on_edge(u) { u } else { foot.u }, if on_edge(v) { v } else { foot.v }];
        }
        if best.as_ref().is_some_and(|(_, least)| error >= *least) {
            break;
        }
        best = Some((surface, error));
    }
    best
}

/// Distance of the spline from the mesh: at its vertices, and in the middles of its edges and triangles.
fn largest_distance(mesh: &TriangleMesh, surface: &SplineSurface) -> f64 {
    let mut largest = 0.0f64;
    let mut measure = |p: Point| largest = largest.max(surface.closest(&p).distance);
    mesh.vertices().iter().for_each(|p| measure(*p));
    for face in 0..mesh.triangles().len() {
        let [a, b, c] = mesh.corners(face);
        measure(Point::from((a.coords + b.coords + c.coords) / 3.0));
        for (from, to) in [(a, b), (b, c), (c, a)] {
            measure(nalgebra::center(&from, &to));
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Knots;
    use crate::part::DesignSurface;

    /// A blade-like twisted patch.
    fn blade() -> OrientedSpline {
        let control = (0..7)
            .map(|i| {
                let x = f64::from(i) * 6.0;
                (0..6)
                    .map(|j| {
                        let (y, twist) = (f64::from(j) * 4.0, 0.1 * f64::from(i));
                        Point::new(x, y * twist.cos(), y * twist.sin() + 0.02 * x * (36.0 - x))
                    })
                    .collect()
            })
            .collect();
        let knots = |n| Knots::clamped_uniform(3, n).unwrap().values().to_vec();
        OrientedSpline::new(SplineSurface::new([3, 3], [knots(7), knots(6)], control, None).unwrap(), true).unwrap()
    }

    fn mesh_of(spline: &OrientedSpline, spacing: f64) -> TriangleMesh {
        let grid = DesignSurface::Spline(spline.clone()).sample(spacing);
        TriangleMesh::new(grid.samples.iter().map(|s| s.point).collect(), grid.triangles).unwrap()
    }

    #[test]
    fn a_mesh_of_a_spline_gives_nearly_that_spline_with_its_side() {
        let original = blade();
        let mesh = mesh_of(&original, 0.8);
        let (spline, error) = spline_of_mesh(&mesh).unwrap();
        // What the middles of flat triangles miss of the true surface counts as error too: h² k / 8.
        assert!(error < 0.02, "{error}");
        for (u, v) in [(0.05, 0.05), (0.5, 0.5), (0.3, 0.9), (0.97, 0.4)] {
            let sample = original.at(u, v);
            let foot = spline.foot(&sample.point);
            assert!(foot.signed_distance.abs() < 2e-3, "{} at {u} {v}", foot.signed_distance);
            assert!(foot.normal.0.dot(&sample.normal.0) > 0.999);
        }
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            assert!(mesh.closest(&spline.at(u, v).point).signed_distance.abs() < 1e-2);
        }
    }

    #[test]
    fn a_bare_rectangle_is_fitted_exactly() {
        let points = [[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [0.0, 10.0]].map(|[x, y]| Point::new(x, y, 0.1 * x));
        let mesh = TriangleMesh::new(points.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let (spline, error) = spline_of_mesh(&mesh).unwrap();
        assert!(error < 1e-4, "{error}");
        assert!((spline.area() - mesh.area()).abs() < 0.01);
    }

    #[test]
    fn a_closed_body_is_refused_with_a_remedy() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Point::from).to_vec();
        let body = TriangleMesh::new(points, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]).unwrap();
        let error = DesignSurface::Mesh(body).spline().unwrap_err();
        assert!(error.message.contains("closed") && error.help.is_some());
    }
}
