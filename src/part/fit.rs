//! A bicubic spline fitted to a mesh, because planning needs a spline. What the fit loses is measured and said; what is
//! verified is the mesh itself.

use super::mesh_sampling::{self, Joined};
use super::oriented_spline::OrientedSpline;
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{
    CurvedMesh, FitPoint, ParametrizeError, Point, SplineSurface, SquareMap, TriangleMesh, Vector, fit_surface,
    map_to_square,
};

/// Edges across a curved mesh, about, by whose ends a spline is fitted to it.
const FINE_EDGES: f64 = 50.0;
/// Weights of the middles of a triangle's edges, and of its own.
const MIDDLES: [[f64; 3]; 4] = [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0]];
/// Share of the mesh's size that counts as met.
const GOOD_ENOUGH: f64 = 1e-6;
/// Smoothing first, and least, see [`fit_surface`].
const SMOOTHING: f64 = 1e-7;
/// Weight of a boundary vertex, which has data on one side only.
const BOUNDARY_WEIGHT: f64 = 4.0;
/// Control points along one side at most.
const MOST_CONTROLS: usize = 60;
/// Share of the number of vertices that the number of control points does not pass, so that the fit stays smooth.
const CONTROLS_PER_VERTEX: f64 = 0.6;
/// Refinements of the net at most; from 4 to 60 control points both ways takes fewer.
const MOST_REFINEMENTS: usize = 40;

/// The fitted spline and its largest distance from the mesh's vertices and the middles of its edges and triangles, mm.
pub(super) fn spline_of_mesh(mesh: &TriangleMesh) -> Result<(OrientedSpline, f64)> {
    let middle = |face: usize, weights| mesh.point(face, weights);
    fitted_and_measured(mesh, (0..mesh.triangles().len()).flat_map(|face| MIDDLES.map(|w| middle(face, w))))
}

/// The same of a curved mesh, by the points of its patches between which short edges run.
pub(super) fn spline_of_curved(mesh: &CurvedMesh) -> Result<(OrientedSpline, f64)> {
    let grid = mesh_sampling::sample(&Joined(mesh), mesh.bounds().diagonal() / FINE_EDGES);
    let points = grid.samples.iter().map(|sample| sample.point).collect();
    let fine = TriangleMesh::new(points, grid.triangles.clone()).map_err(|_| broken())?;
    let sample = |vertex: u32| grid.samples.get(vertex as usize);
    let middles = grid.triangles.iter().flat_map(|[a, b, c]| match [a, b, c].map(|v| sample(*v)) {
        [Some(a), Some(b), Some(c)] => MIDDLES.map(|w| Some(mesh_sampling::between_curved(mesh, [a, b, c], w).point)),
        _ => [None; 4],
    });
    fitted_and_measured(&fine, middles.flatten())
}

/// A spline through a mesh, and its largest distance from vertices and from other places, mm.
fn fitted_and_measured(mesh: &TriangleMesh, places: impl Iterator<Item = Point>) -> Result<(OrientedSpline, f64)> {
    let map = map_to_square(mesh).map_err(|error| refused(&error))?;
    let surface = fitted(mesh, &map).ok_or_else(broken)?;
    let places = mesh.vertices().iter().copied().chain(places);
    let error = places.map(|p| surface.closest(&p).distance).fold(0.0, f64::max);
    let spline = OrientedSpline::new(surface, false).map_err(|_| broken())?;
    Ok((spline, error))
}

fn broken() -> Box<Diagnostic> {
    Diagnostic::error("no smooth surface can be laid through the mesh for planning")
        .help("give the surface as a .json spline or a .csv grid, or remesh it with even triangles")
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

/// Fits coarse to fine until the vertices are met or the vertices do not carry more control points. After each fit the
/// parameters move to the feet of their points, which makes the next one closer at the same size.
fn fitted(mesh: &TriangleMesh, map: &SquareMap) -> Option<SplineSurface> {
    let good_enough = GOOD_ENOUGH * mesh.bounds().diagonal();
    let most = (CONTROLS_PER_VERTEX * mesh.vertices().len() as f64) as usize;
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
    let mut controls = [4, 4];
    for _ in 0..MOST_REFINEMENTS {
        let surface = fit_surface(&points, controls, SMOOTHING)?;
        let (moved, error) = moved_to_feet(&surface, &points, map);
        // Fitted again where the parameters belong, which is kept when it is closer.
        let again = fit_surface(&moved, controls, SMOOTHING)?;
        let (moved_again, less) = moved_to_feet(&again, &moved, map);
        let (surface, error) = if less < error {
            points = moved_again;
            (again, less)
        } else {
            (surface, error)
        };
        let next = refined(controls, &surface);
        if best.as_ref().is_none_or(|(_, least)| error < *least) {
            best = Some((surface, error));
        }
        match next {
            Some(next) if error > good_enough && next[0] * next[1] <= most => controls = next,
            _ => break,
        }
    }
    best.map(|(surface, _)| surface)
}

/// The points with each parameter moved toward the foot of its point, by half a span at most; a boundary vertex keeps to
/// its edge, a corner stays. And the largest distance of a point from the surface there.
fn moved_to_feet(surface: &SplineSurface, points: &[FitPoint], map: &SquareMap) -> (Vec<FitPoint>, f64) {
    let mut largest = 0.0f64;
    let spans = [surface.knots_u(), surface.knots_v()].map(|knots| (knots.controls() - 3) as f64);
    let moved = points
        .iter()
        .zip(&map.parameters)
        .map(|(point, mapped)| {
            let [u, v] = point.parameters;
            let foot = surface.closest_from(&point.point, (u, v));
            let toward = |mapped: f64, from: f64, to: f64, spans: f64| {
                let on_edge = mapped == 0.0 || mapped == 1.0;
                if on_edge { mapped } else { to.clamp(from - 0.5 / spans, from + 0.5 / spans).clamp(0.0, 1.0) }
            };
            let parameters = [toward(mapped[0], u, foot.u, spans[0]), toward(mapped[1], v, foot.v, spans[1])];
            largest = largest.max((surface.point(parameters[0], parameters[1]) - point.point).norm());
            FitPoint { parameters, ..*point }
        })
        .collect();
    (moved, largest)
}

/// A third more control points where the net is rougher: along u, along v, or both when they are alike (fourth
/// differences of the net are what a cubic cannot follow); none when that side is at its limit.
fn refined([rows, columns]: [usize; 2], surface: &SplineSurface) -> Option<[usize; 2]> {
    let (net_rows, net_columns) = (surface.knots_u().controls(), surface.knots_v().controls());
    let at = |i: usize, j: usize| surface.control()[i * net_columns + j].coords;
    let rough = |count: usize, lines: usize, point: &dyn Fn(usize, usize) -> Vector| {
        let mut most = 0.0f64;
        for line in 0..lines {
            for k in 4..count {
                let [a, b, c, d, e] = [4, 3, 2, 1, 0].map(|back| point(k - back, line));
                most = most.max((a - b * 4.0 + c * 6.0 - d * 4.0 + e).norm());
            }
        }
        most
    };
    let along_u = rough(net_rows, net_columns, &|k, line| at(k, line));
    let along_v = rough(net_columns, net_rows, &|k, line| at(line, k));
    let more = |count: usize| (count + count.div_ceil(3)).min(MOST_CONTROLS);
    let next = [
        if 2.0 * along_u >= along_v { more(rows) } else { rows },
        if 2.0 * along_v >= along_u { more(columns) } else { columns },
    ];
    (next != [rows, columns]).then_some(next)
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
