//! A strip moved out of the material or into it as a whole, so that both its errors strain their limits alike: what makes
//! room where hardly any overcut is allowed, and costs next to nothing.
//!
//! A tool moved by l along the part's normals changes every deviation by l. With overcut o, undercut u and their limits O
//! and U, (o - l) / O = (u + l) / U where l = (o U - u O) / (O + U).

use super::assess::Deviation;
use super::chart::Chart;
use super::limits::Limits;
use super::rails::BLOCK;
use crate::geometry::Point;

/// How far, mm, out of the material a strip should be moved.
pub(super) fn lift(deviation: &Deviation, limits: &Limits) -> f64 {
    let (deep, high) = (deviation.overcut.max(deviation.outside), deviation.undercut);
    (deep * limits.undercut - high * limits.overcut) / (limits.overcut + limits.undercut)
}

/// What a lift makes of a deviation.
pub(super) fn after(deviation: &Deviation, by: f64) -> Deviation {
    let Deviation { overcut, undercut, outside, .. } = *deviation;
    let [overcut, undercut, outside] = [overcut - by, undercut + by, outside - by].map(|error| error.max(0.0));
    Deviation { overcut, undercut, outside, ..*deviation }
}

/// Rails with every control point moved by `by` mm along the part's normal at its foot; `None` where there is none.
pub(super) fn lifted(chart: &Chart<'_>, x: &[f64], by: f64) -> Option<Vec<f64>> {
    let mut moved = x.to_vec();
    let mut near = [None; 2];
    for block in moved.chunks_exact_mut(BLOCK) {
        for (near, point) in near.iter_mut().zip(block.chunks_exact_mut(3)) {
            let at = Point::from_slice(point);
            let foot = match *near {
                Some(place) => chart.foot(&at, place)?,
                None => chart.nearest(&at)?,
            };
            *near = Some(foot.frame.place);
            point.iter_mut().zip(foot.frame.normal.iter()).for_each(|(c, n)| *c += by * n);
        }
    }
    Some(moved)
}

#[cfg(test)]
mod tests {
    use super::super::chart::{Layout, Lines};
    use super::*;
    use crate::geometry::{SplineSurface, Vector};
    use crate::part::OrientedSpline;

    #[test]
    fn a_lift_leaves_both_errors_the_same_share_of_their_limits() {
        let limits = Limits { overcut: 1e-4, undercut: 5e-3 };
        let found = Deviation { overcut: 0.002, undercut: 0.001, outside: 0.0021, ..Deviation::NONE };
        let after = after(&found, lift(&found, &limits));
        let shares = [after.outside / limits.overcut, after.undercut / limits.undercut];
        assert!((shares[0] - shares[1]).abs() < 1e-12 && limits.strain(&after) < 0.62, "{after:?}");
        assert!(after.overcut < 1e-15, "{after:?}");
    }

    #[test]
    fn rails_move_along_the_normals_under_them() {
        let knots = || vec![0.0, 0.0, 1.0, 1.0];
        let row = |x: f64| vec![Point::new(x, 0.0, 0.0), Point::new(x, 6.0, 0.0)];
        let surface = SplineSurface::new([1, 1], [knots(), knots()], vec![row(0.0), row(9.0)], None).unwrap();
        let plane = OrientedSpline::new(surface, false).unwrap();
        let normal: Vector = plane.at(0.5, 0.5).normal.0.into_inner();
        let chart = Chart::new(&plane, Layout { lines: Lines::AlongU, tip_high: false, backward: false });
        let x: Vec<f64> = (0..4).flat_map(|i| [3.0 * f64::from(i), 1.0, 2.0, 3.0 * f64::from(i), 5.0, 2.5]).collect();
        let moved = lifted(&chart, &x, 0.25).unwrap();
        for (from, to) in x.chunks(3).zip(moved.chunks(3)) {
            let way = Vector::new(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
            assert!((way - normal * 0.25).norm() < 1e-12, "{way}");
        }
    }
}
