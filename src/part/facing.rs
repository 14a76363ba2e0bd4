//! Do the normals point toward the tool? Answered from something that is known to be on one side.

use super::design_surface::DesignSurface;
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::Point;

/// Which way the normals of a design surface point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// Out of the material, as they must.
    Outward,
    /// Into the material.
    Inward,
    /// What is known does not decide it.
    Undecided,
}

/// Share of the surface's size that a point must be away from it to be on a side.
const CLEAR: f64 = 1e-6;
/// Share of the surface's size at which both sides are probed.
const PROBE: f64 = 1e-4;
/// Probes along the size of the surface.
const PROBES: f64 = 20.0;

impl Facing {
    /// Refuses normals into the material, and says what to write; undecided ones pass.
    pub fn require(self) -> Result<()> {
        match self {
            Self::Outward | Self::Undecided => Ok(()),
            Self::Inward => Err(Diagnostic::error(
                "the normals of the part's surface point into the material, away from the tool's side",
            )
            .help("write flip = true under [part] (or flip = false where it is true now)")),
        }
    }
}

impl DesignSurface {
    /// Judges by a point on the tool's side, for example of a given tool path: it must lie straight above the surface.
    pub fn facing(&self, tool_side: &Point) -> Facing {
        let foot = self.foot(tool_side);
        if foot.past_edge || foot.signed_distance.abs() <= CLEAR * self.bounds().diagonal() {
            return Facing::Undecided;
        }
        if foot.signed_distance > 0.0 { Facing::Outward } else { Facing::Inward }
    }

    /// Judges by a closed body, triangles outward, of whose skin the surface is a part: probes on both sides of the
    /// surface, of which one lies inside and one outside the body; the majority decides.
    pub fn facing_of_body(&self, body: &Self) -> Facing {
        if !body.mesh().is_some_and(|mesh| mesh.topology().is_closed()) {
            return Facing::Undecided;
        }
        let size = self.bounds().diagonal();
        let (mut outward, mut inward) = (0, 0);
        for sample in self.sample(size / PROBES).samples {
            let step = sample.normal.0.into_inner() * (PROBE * size);
            let above = body.signed_distance(&(sample.point + step)) > 0.0;
            let below = body.signed_distance(&(sample.point - step)) > 0.0;
            outward += usize::from(above && !below);
            inward += usize::from(below && !above);
        }
        match outward.cmp(&inward) {
            std::cmp::Ordering::Greater => Facing::Outward,
            std::cmp::Ordering::Less => Facing::Inward,
            std::cmp::Ordering::Equal => Facing::Undecided,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{SplineSurface, TriangleMesh};
    use crate::part::OrientedSpline;

    /// The unit square at z = 1, normal up unless flipped.
    fn lid(flip: bool) -> DesignSurface {
        let row = |x: f64| vec![Point::new(x, 0.0, 1.0), Point::new(x, 1.0, 1.0)];
        let knots = vec![0.0, 0.0, 1.0, 1.0];
        let surface = SplineSurface::new([1, 1], [knots.clone(), knots], vec![row(0.0), row(1.0)], None).unwrap();
        DesignSurface::Spline(OrientedSpline::new(surface, flip).unwrap())
    }

    fn cube() -> DesignSurface {
        let corner = |k: u8| Point::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        DesignSurface::Mesh(TriangleMesh::new((0..8).map(corner).collect(), triangles).unwrap())
    }

    #[test]
    fn a_point_on_the_tool_side_tells() {
        let above = Point::new(0.5, 0.5, 3.0);
        assert_eq!(lid(false).facing(&above), Facing::Outward);
        assert_eq!(lid(true).facing(&above), Facing::Inward);
        assert_eq!(lid(false).facing(&Point::new(4.0, 0.5, 3.0)), Facing::Undecided);
        assert_eq!(lid(false).facing(&Point::new(0.5, 0.5, 1.0)), Facing::Undecided);
        assert!(Facing::Inward.require().unwrap_err().help.unwrap().contains("flip"));
        assert!(Facing::Outward.require().is_ok());
    }

    #[test]
    fn the_body_that_it_bounds_tells() {
        assert_eq!(lid(false).facing_of_body(&cube()), Facing::Outward);
        assert_eq!(lid(true).facing_of_body(&cube()), Facing::Inward);
        let far = lid(false).transformed(&crate::geometry::RigidMotion::translation(0.0, 0.0, 9.0));
        assert_eq!(far.facing_of_body(&cube()), Facing::Undecided);
    }
}
