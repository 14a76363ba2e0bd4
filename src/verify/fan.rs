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

    /// The fan of a cluster of rays: they start in a rectangle square to their mean normal, but for the bulge. `None`
    /// where their normals have no mean, or there are none.
    pub(super) fn around<'r>(rays: impl ExactSizeIterator<Item = &'r NormalRay> + Clone) -> Option<Self> {
        let count = rays.len() as f64;
        let sum = |of: fn(&NormalRay) -> Vector| rays.clone().map(of).sum::<Vector>();
        let origin = Point::from(sum(|ray| ray.origin.coords) / count);
        let normal = Direction::try_new(sum(|ray| ray.normal.into_inner()), 1e-3 * count)?;
        let flat = |ray: &NormalRay| {
            let offset = ray.origin - origin;
            offset - normal.into_inner() * offset.dot(&normal)
        };
        let farthest = rays.clone().map(flat).fold(Vector::zeros(), |a, b| if b.norm() > a.norm() { b } else { a });
        let along = farthest.try_normalize(1e-12).unwrap_or_default();
        let across = normal.cross(&along);
        let most = |of: &dyn Fn(&NormalRay) -> f64| rays.clone().map(of).fold(0.0, f64::max);
        let along = along * most(&|ray| flat(ray).dot(&along).abs());
        let across = across * most(&|ray| flat(ray).dot(&across).abs());
        Some(Self {
            ray: NormalRay { origin, normal },
            corners: [along + across, along - across, across - along, -along - across],
            radius: (along + across).norm(),
            bulge: most(&|ray| (ray.origin - origin).dot(&normal).abs()) + ROUNDING,
            turn: most(&|ray| (ray.normal.into_inner() - normal.into_inner()).norm()) + ROUNDING,
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
