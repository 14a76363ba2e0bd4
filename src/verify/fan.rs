//! The normals of a whole cell of the part, or of a cluster of samples, seen from their middle one. Uses `part` and `ray`.

use super::ray::NormalRay;
use crate::geometry::{Direction, Point, Vector};
use crate::part::Cell;

/// Covers the rounding of a cluster's own figures, mm and radians.
const ROUNDING: f64 = 1e-12;

/// All rays of a cell or a cluster.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fan {
    /// From the middle along the middle normal.
    pub(super) ray: NormalRay,
    /// Corners, from the middle, between which the rays start.
    corners: [Vector; 4],
    radius: f64,
    bulge: f64,
    turn: f64,
}

impl Fan {
    pub(super) fn of(cell: &Cell) -> Self {
        let [a, b, c] = cell.corners.map(|corner| corner.point - cell.centre);
        Self {
            ray: NormalRay { origin: cell.centre, normal: Direction::new_unchecked(cell.normal) },
            corners: [a, b, c, c],
            radius: cell.radius(),
            bulge: cell.bulge,
            turn: cell.turn,
        }
    }

    /// The fan of a cluster of rays; `None` where their normals have no mean, or there are none.
    pub(super) fn around<'r>(rays: impl Iterator<Item = &'r NormalRay> + Clone) -> Option<Self> {
        let normals = rays.clone().map(|ray| ray.normal.into_inner());
        Self::about(rays.map(|ray| ray.origin), normals, (0.0, 0.0))
    }

    /// The fan of some cells; `None` where their normals have no mean, or there are none.
    pub(super) fn over(cells: &[Cell]) -> Option<Self> {
        let most = |of: fn(&Cell) -> f64| cells.iter().map(of).fold(0.0, f64::max);
        let corners = cells.iter().flat_map(|cell| cell.corners.map(|corner| corner.point));
        Self::about(corners, cells.iter().map(|cell| cell.normal), (most(|cell| cell.bulge), most(|cell| cell.turn)))
    }

    /// The fan of rays that start between some points, but for a bulge, with normals that are some directions, but for a
    /// turn: they start in a rectangle square to the mean direction, but for the bulge.
    fn about(
        points: impl Iterator<Item = Point> + Clone,
        normals: impl Iterator<Item = Vector> + Clone,
        (bulge, turn): (f64, f64),
    ) -> Option<Self> {
        let origin =
            Point::from(points.clone().map(|point| point.coords).sum::<Vector>() / points.clone().count() as f64);
        let sum = normals.clone().sum::<Vector>();
        let normal = Direction::try_new(sum, 1e-3 * normals.clone().count() as f64)?;
        let flat = |point: &Point| {
            let offset = point - origin;
            offset - normal.into_inner() * offset.dot(&normal)
        };
        let longer = |a: Vector, b: Vector| if b.norm_squared() > a.norm_squared() { b } else { a };
        let along = points.clone().map(|point| flat(&point)).fold(Vector::zeros(), longer);
        let along = along.try_normalize(1e-12).unwrap_or_default();
        let across = normal.cross(&along);
        let most = |of: &dyn Fn(&Point) -> f64| points.clone().map(|point| of(&point)).fold(0.0, f64::max);
        let along = along * most(&|point| flat(point).dot(&along).abs());
        let across = across * most(&|point| flat(point).dot(&across).abs());
        let turned = normals.map(|one| (one - normal.into_inner()).norm()).fold(0.0, f64::max);
        Some(Self {
            ray: NormalRay { origin, normal },
            corners: [along + across, along - across, across - along, -along - across],
            radius: (along + across).norm(),
            bulge: bulge + most(&|point| (point - origin).dot(&normal).abs()) + ROUNDING,
            turn: turn + turned + ROUNDING,
        })
    }

    /// How much farther against `direction` a ray's point at `lambda` can lie than the middle ray's.
    pub(super) fn spread(&self, direction: &Vector, lambda: f64) -> f64 {
        let flat = self.corners.iter().map(|corner| -direction.dot(corner)).fold(f64::NEG_INFINITY, f64::max);
        flat + self.bulge + lambda.abs() * self.turn
    }

    /// How far the rays start from the middle, mm, but for the bulge.
    pub(super) fn radius(&self) -> f64 {
        self.radius
    }

    /// How far a ray's point at `lambda` can lie from the middle ray's, mm.
    pub(super) fn reach(&self, lambda: f64) -> f64 {
        self.radius + self.bulge + lambda.abs() * self.turn
    }
}
