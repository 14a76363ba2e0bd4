//! The normals of a whole cell of the part, seen from its middle one. Uses `part` and `ray`.

use super::ray::NormalRay;
use crate::geometry::{Direction, Vector};
use crate::part::Cell;

/// All rays of a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fan {
    /// From the mean of the corners along the middle normal.
    pub(super) ray: NormalRay,
    /// The corners from that mean.
    corners: [Vector; 3],
    radius: f64,
    bulge: f64,
    turn: f64,
}

impl Fan {
    pub(super) fn of(cell: &Cell) -> Self {
        Self {
            ray: NormalRay { origin: cell.centre, normal: Direction::new_unchecked(cell.normal) },
            corners: cell.corners.map(|corner| corner.point - cell.centre),
            radius: cell.radius(),
            bulge: cell.bulge,
            turn: cell.turn,
        }
    }

    /// How much farther against `direction` a ray's point at `lambda` can lie than the middle ray's.
    pub(super) fn spread(&self, direction: &Vector, lambda: f64) -> f64 {
        let flat = self.corners.iter().map(|corner| -direction.dot(corner)).fold(f64::NEG_INFINITY, f64::max);
        flat + self.bulge + lambda.abs() * self.turn
    }

    /// How far a ray's point at `lambda` can lie from the middle ray's, mm.
    pub(super) fn reach(&self, lambda: f64) -> f64 {
        self.radius + self.bulge + lambda.abs() * self.turn
    }
}
