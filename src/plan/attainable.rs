//! What a flank can reach at best on a surface, known before anything is planned.
//!
//! Over an engaged length d a straight flank leaves, two-sided, `d² |k| / (16 (1 + r k))` with k the surface's normal
//! curvature along the axis (counted positive where it is convex) and r the tool's mean radius: half the sagitta of the
//! surface's offset, on which the axis lies. A curved meridian takes its own bend off.

use crate::geometry::{Curvature, Direction, Point, SurfaceJet, Vector};
use crate::part::OrientedSpline;

/// A flank as the law of attainable errors sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlankLaw {
    /// Longest engagement, mm: the distance between the contacts of the flank's end spheres.
    pub reach: f64,
    /// Radius of the sphere at mid-flank, mm.
    pub radius: f64,
    /// Second derivative of the sphere radius along the axis, 1/mm: 0 for cones, negative for barrels.
    pub bend: f64,
}

impl FlankLaw {
    /// Curvature between the surface's offset and the flank, 1/mm, where the surface bends by `hollow` along the axis
    /// (positive where it is hollow, 1/mm). Infinite where the tool does not fit into the hollow.
    pub fn misfit(&self, hollow: f64) -> f64 {
        let room = 1.0 - self.radius * hollow;
        if room > 0.0 { hollow / room + self.bend } else { f64::INFINITY }
    }

    /// Least largest error, mm, of both signs alike, over an engaged length.
    pub fn error(&self, hollow: f64, engaged: f64) -> f64 {
        engaged * engaged * self.misfit(hollow).abs() / 16.0
    }

    /// Curvature of the surface that the flank follows without error.
    fn followed(&self) -> f64 {
        -self.bend / (1.0 - self.radius * self.bend)
    }
}

/// The shape of a surface at one place in an orthonormal frame of its tangent plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bending {
    /// First direction of the frame, along u.
    pub(super) e1: Vector,
    /// Second direction.
    pub(super) e2: Vector,
    /// Second form in the frame: (1,1), (1,2), (2,2), positive where the surface is hollow, 1/mm.
    pub(super) form: [f64; 3],
}

impl Bending {
    /// At a jet of `spline`.
    pub(super) fn at(spline: &OrientedSpline, jet: &SurfaceJet) -> Option<Self> {
        let curvature: Curvature = jet.curvature()?;
        let e1 = jet.su.normalize();
        let e2 = curvature.normal().cross(&e1);
        let along = |direction: &Vector| Some(curvature.normal_curvature(direction)? * spline.side());
        let (first, second, between) = (along(&e1)?, along(&e2)?, along(&(e1 + e2))?);
        Some(Self { e1, e2, form: [first, between - 0.5 * (first + second), second] })
    }

    /// Unit tangent at an angle from the first direction, rad.
    pub(super) fn direction(&self, angle: f64) -> Vector {
        self.e1 * angle.cos() + self.e2 * angle.sin()
    }

    /// Normal curvature and its derivative along an angle.
    pub(super) fn curvature(&self, angle: f64) -> (f64, f64) {
        let [a, b, c] = self.form;
        let (sin, cos) = (2.0 * angle).sin_cos();
        let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
        (mean + half * cos + b * sin, 2.0 * (b * cos - half * sin))
    }

    /// Half the difference of the principal curvatures.
    pub(super) fn contrast(&self) -> f64 {
        let [a, b, c] = self.form;
        (0.5 * (a - c)).hypot(b)
    }

    /// An angle along which the flank follows the surface best: asymptotic for a straight flank where the surface is
    /// saddle-shaped, flattest where it is not.
    pub(super) fn best(&self, flank: &FlankLaw) -> f64 {
        let [a, b, c] = self.form;
        let greatest = 0.5 * b.atan2(0.5 * (a - c));
        let (mean, contrast) = (0.5 * (a + c), self.contrast());
        let cosine = if contrast > 0.0 { (flank.followed() - mean) / contrast } else { 1.0 };
        greatest + 0.5 * cosine.clamp(-1.0, 1.0).acos()
    }
}

/// The least error that a flank can leave at one place, fully engaged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attainable {
    /// Surface parameters.
    pub place: (f64, f64),
    /// The surface point, mm, part frame.
    pub point: Point,
    /// Least largest error, of both signs alike, mm.
    pub error: f64,
    /// The tool axis that leaves it, in the tangent plane.
    pub axis: Direction,
}

/// Attainable errors over a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct AttainableMap {
    /// The flank.
    pub flank: FlankLaw,
    /// Places in rows along v.
    pub samples: Vec<Attainable>,
}

/// Places along each parameter.
const PLACES: u32 = 41;

impl AttainableMap {
    pub(super) fn new(spline: &OrientedSpline, flank: FlankLaw) -> Self {
        let [(u0, u1), (v0, v1)] = spline.surface().domain();
        let share = |i: u32| f64::from(i) / f64::from(PLACES - 1);
        let places = (0..PLACES).flat_map(|i| (0..PLACES).map(move |j| (share(i), share(j))));
        let samples = places.filter_map(|(a, b)| {
            let place = (u0 + a * (u1 - u0), v0 + b * (v1 - v0));
            let jet = spline.surface().jet(place.0, place.1);
            let bending = Bending::at(spline, &jet)?;
            let angle = bending.best(&flank);
            let error = flank.error(bending.curvature(angle).0, flank.reach);
            Some(Attainable {
                place,
                point: jet.point,
                error,
                axis: Direction::new_normalize(bending.direction(angle)),
            })
        });
        Self { flank, samples: samples.collect() }
    }

    /// Largest attainable error, mm.
    pub fn worst(&self) -> f64 {
        self.samples.iter().map(|s| s.error).fold(0.0, f64::max)
    }

    /// Mean of the attainable errors, mm.
    pub fn mean(&self) -> f64 {
        self.samples.iter().map(|s| s.error).sum::<f64>() / self.samples.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::SplineSurface;
    use proptest::prelude::*;

    /// z = x y / 40: asymptotic along both parameters, curvature ±1/40 at 45 degrees.
    fn saddle() -> OrientedSpline {
        let at = |x: f64, y: f64| Point::new(x, y, x * y / 40.0);
        let control = vec![vec![at(-5.0, -5.0), at(-5.0, 5.0)], vec![at(5.0, -5.0), at(5.0, 5.0)]];
        let knots = || vec![0.0, 0.0, 1.0, 1.0];
        OrientedSpline::new(SplineSurface::new([1, 1], [knots(), knots()], control, None).unwrap(), false).unwrap()
    }

    #[test]
    fn no_flank_fits_into_a_hollow_smaller_than_itself() {
        assert_eq!(FlankLaw { reach: 10.0, radius: 5.0, bend: 0.0 }.error(0.2, 1.0), f64::INFINITY);
    }

    #[test]
    fn a_saddle_can_be_cut_without_error_everywhere() {
        let law = FlankLaw { reach: 8.0, radius: 3.0, bend: 0.0 };
        let map = AttainableMap::new(&saddle(), law);
        assert!(map.worst() < 1e-12 && map.mean() <= map.worst(), "{}", map.worst());
        // At the apex the asymptotic directions are x and y.
        let apex = map.samples.iter().find(|s| s.point.coords.norm() < 1e-9).unwrap();
        assert!(apex.axis.x.abs().max(apex.axis.y.abs()) > 1.0 - 1e-9, "{apex:?}");
    }

    proptest! {
        #[test]
        fn the_best_angle_beats_every_other(a in -0.2..0.1f64, b in -0.1..0.1f64, c in -0.2..0.1f64, other in 0.0..3.2f64) {
            let law = FlankLaw { reach: 10.0, radius: 3.0, bend: -0.004 };
            let bending = Bending { e1: Vector::x(), e2: Vector::y(), form: [a, b, c] };
            let error = |angle: f64| law.error(bending.curvature(angle).0, law.reach);
            prop_assert!(error(bending.best(&law)) <= error(other) + 1e-12);
        }

        #[test]
        fn curvature_along_an_angle_is_that_of_its_direction(u in 0.05..0.95f64, v in 0.05..0.95f64, angle in 0.0..3.2f64) {
            let spline = saddle();
            let jet = spline.surface().jet(u, v);
            let bending = Bending::at(&spline, &jet).unwrap();
            let direct = jet.curvature().unwrap().normal_curvature(&bending.direction(angle)).unwrap();
            prop_assert!((bending.curvature(angle).0 - direct).abs() < 1e-12);
            let turned = |by: f64| bending.curvature(angle + by).0;
            let slope = (turned(1e-5) - turned(-1e-5)) / 2e-5;
            prop_assert!((bending.curvature(angle).1 - slope).abs() < 1e-8);
        }
    }
}
