//! A regular B-spline surface that knows its material side.

use super::sample::{Foot, OutwardNormal, SampleGrid, SurfacePlace, SurfaceSample};
use crate::geometry::{Direction, Knots, Point, RigidMotion, SplineSurface, SurfaceJet, Vector};

/// A B-spline surface with a normal everywhere, and the side on which the tool is.
#[derive(Clone, Debug)]
pub struct OrientedSpline {
    surface: SplineSurface,
    flip: bool,
}

/// A place where a surface has no proper normal.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum IrregularSurface {
    /// The derivatives vanish or are parallel.
    #[error(
        "the surface has no normal at (u, v) = ({u:.6}, {v:.6}): an edge shrinks to a point or the parameter lines are tangent there"
    )]
    Pole {
        /// Parameter.
        u: f64,
        /// Parameter.
        v: f64,
    },
    /// The normal turns over within no distance.
    #[error("the surface folds over at (u, v) = ({u:.6}, {v:.6}): its normal turns to the other side there")]
    Fold {
        /// Parameter.
        u: f64,
        /// Parameter.
        v: f64,
    },
}

/// Steps per polynomial piece in which regularity is looked at.
const STEPS_PER_PIECE: usize = 4;
/// Share of the mean length of a derivative below which it counts as vanished.
const VANISHED: f64 = 1e-6;
/// Sine of the angle between Su and Sv below which they count as parallel.
const PARALLEL: f64 = 1e-5;

/// Abscissae and weights of Gauss-Legendre quadrature with four points on [0, 1].
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273_1),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_1),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

impl OrientedSpline {
    /// Joins a surface and its side: the outward normal is Su × Sv, or its opposite with `flip`. Poles and folds are
    /// refused.
    pub fn new(surface: SplineSurface, flip: bool) -> Result<Self, IrregularSurface> {
        check_regular(&surface)?;
        Ok(Self { surface, flip })
    }

    /// The surface.
    pub fn surface(&self) -> &SplineSurface {
        &self.surface
    }

    /// Whether the outward normal is opposite to Su × Sv.
    pub fn flip(&self) -> bool {
        self.flip
    }

    /// 1, or -1 with flip: the factor that turns Su × Sv, and curvatures counted with it, outward.
    pub fn side(&self) -> f64 {
        if self.flip { -1.0 } else { 1.0 }
    }

    /// The same surface with the material on the other side.
    #[must_use]
    pub fn turned_over(self) -> Self {
        Self { flip: !self.flip, ..self }
    }

    /// The surface moved.
    #[must_use]
    pub fn transformed(&self, motion: &RigidMotion) -> Self {
        Self { surface: self.surface.transformed(motion), flip: self.flip }
    }

    /// Outward normal of a jet of this surface.
    pub fn outward(&self, jet: &SurfaceJet) -> OutwardNormal {
        // Construction checked that there is a normal on a grid; between its lines the cross product is taken as it is.
        let normal = jet.normal().unwrap_or_else(|| {
            let cross = jet.su.cross(&jet.sv);
            Direction::try_new(cross, 0.0).unwrap_or_else(Vector::z_axis)
        });
        OutwardNormal(if self.flip { -normal } else { normal })
    }

    /// Point and outward normal at (u, v).
    pub fn at(&self, u: f64, v: f64) -> SurfaceSample {
        let jet = self.surface.jet(u, v);
        SurfaceSample { point: jet.point, normal: self.outward(&jet), place: SurfacePlace::Parameters { u, v } }
    }

    /// The closest point and on which side of it `p` lies.
    pub fn foot(&self, p: &Point) -> Foot {
        let foot = self.surface.closest(p);
        let SurfaceSample { point, normal, place } = self.at(foot.u, foot.v);
        let side = (p - point).dot(&normal.0);
        Foot {
            point,
            normal,
            signed_distance: foot.distance.copysign(side),
            past_edge: foot.past_edge.is_some(),
            place,
        }
    }

    /// Area, mm², by Gauss quadrature over each polynomial piece.
    pub fn area(&self) -> f64 {
        let mut area = 0.0;
        for u in self.surface.knots_u().breaks().windows(2) {
            for v in self.surface.knots_v().breaks().windows(2) {
                let (du, dv) = (u[1] - u[0], v[1] - v[0]);
                for (a, wa) in GAUSS {
                    for (b, wb) in GAUSS {
                        let jet = self.surface.jet(u[0] + du * a, v[0] + dv * b);
                        area += jet.su.cross(&jet.sv).norm() * du * dv * wa * wb;
                    }
                }
            }
        }
        area
    }

    /// A grid over the whole domain, neighbours along the parameter lines at most about `spacing` mm apart.
    pub(super) fn sample(&self, spacing: f64) -> SampleGrid {
        let (us, vs) = (self.lines(true, spacing), self.lines(false, spacing));
        let samples = us.iter().flat_map(|u| vs.iter().map(|v| self.at(*u, *v))).collect();
        let columns = vs.len() as u32;
        let mut triangles = Vec::with_capacity(2 * us.len() * vs.len());
        for i in 1..us.len() as u32 {
            for j in 1..columns {
                let (a, b) = ((i - 1) * columns + j - 1, i * columns + j - 1);
                for [x, y, z] in [[a, b, b + 1], [a, b + 1, a + 1]] {
                    triangles.push(if self.flip { [x, z, y] } else { [x, y, z] });
                }
            }
        }
        SampleGrid { samples, triangles }
    }

    /// Parameters along u (or v) from end to end, equal steps of the length that the longest of several parameter lines
    /// has there, each at most `spacing`.
    fn lines(&self, along_u: bool, spacing: f64) -> Vec<f64> {
        const FINE: usize = 8;
        let (knots, across) = if along_u {
            (self.surface.knots_u(), self.surface.knots_v())
        } else {
            (self.surface.knots_v(), self.surface.knots_u())
        };
        let others = divided(across, 2);
        let speed = |t: f64| {
            others.iter().fold(0.0f64, |most, s| {
                let jet = if along_u { self.surface.jet(t, *s) } else { self.surface.jet(*s, t) };
                most.max(if along_u { jet.su.norm() } else { jet.sv.norm() })
            })
        };
        let fine = divided(knots, FINE);
        let mut length = vec![0.0];
        let mut total = 0.0;
        for pair in fine.windows(2) {
            total += speed((pair[0] + pair[1]) / 2.0) * (pair[1] - pair[0]);
            length.push(total);
        }
        let count = (total / spacing).ceil().max(1.0) as usize;
        let (low, high) = knots.domain();
        let mut lines = vec![low];
        for k in 1..count {
            let want = total * k as f64 / count as f64;
            let cell = length.partition_point(|l| *l <= want).clamp(1, fine.len() - 1);
            let share = (want - length[cell - 1]) / (length[cell] - length[cell - 1]);
            lines.push(fine[cell - 1] + (fine[cell] - fine[cell - 1]) * share);
        }
        lines.push(high);
        lines
    }

    /// The surface point at the mean of the corners' parameters.
    pub(super) fn between(&self, corners: [&SurfaceSample; 3], weights: [f64; 3]) -> SurfaceSample {
        let (mut u, mut v) = (0.0, 0.0);
        for (corner, weight) in corners.iter().zip(weights) {
            // A sample of another surface is brought onto this one.
            let (corner_u, corner_v) = match corner.place {
                SurfacePlace::Parameters { u, v } => (u, v),
                SurfacePlace::Face { .. } => {
                    let foot = self.surface.closest(&corner.point);
                    (foot.u, foot.v)
                }
            };
            u += weight * corner_u;
            v += weight * corner_v;
        }
        let [(u0, u1), (v0, v1)] = self.surface.domain();
        self.at(u.clamp(u0, u1), v.clamp(v0, v1))
    }
}

/// Each polynomial piece cut into `steps` equal steps, all ends included.
fn divided(knots: &Knots, steps: usize) -> Vec<f64> {
    let breaks = knots.breaks();
    let mut values = Vec::with_capacity((breaks.len() - 1) * steps + 1);
    for pair in breaks.windows(2) {
        values.extend((0..steps).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / steps as f64));
    }
    values.push(knots.domain().1);
    values
}

fn check_regular(surface: &SplineSurface) -> Result<(), IrregularSurface> {
    let (us, vs) = (divided(surface.knots_u(), STEPS_PER_PIECE), divided(surface.knots_v(), STEPS_PER_PIECE));
    let jets: Vec<SurfaceJet> = us.iter().flat_map(|u| vs.iter().map(|v| surface.jet(*u, *v))).collect();
    let count = jets.len() as f64;
    let mean_u = jets.iter().map(|jet| jet.su.norm()).sum::<f64>() / count;
    let mean_v = jets.iter().map(|jet| jet.sv.norm()).sum::<f64>() / count;
    let columns = vs.len();
    for (index, jet) in jets.iter().enumerate() {
        let (i, j) = (index / columns, index % columns);
        let (u, v) = (us[i], vs[j]);
        let lengths = jet.su.norm() * jet.sv.norm();
        let vanished = jet.su.norm() <= VANISHED * mean_u || jet.sv.norm() <= VANISHED * mean_v;
        if vanished || jet.su.cross(&jet.sv).norm() <= PARALLEL * lengths {
            return Err(IrregularSurface::Pole { u, v });
        }
        let cross = jet.su.cross(&jet.sv);
        let before = |step: usize, place: (f64, f64)| {
            let other = &jets[index - step];
            check_fold(surface, (place, other.su.cross(&other.sv)), ((u, v), cross))
        };
        if i > 0 {
            before(columns, (us[i - 1], v))?;
        }
        if j > 0 {
            before(1, (u, vs[j - 1]))?;
        }
    }
    Ok(())
}

/// Parameters and Su × Sv there.
type Place = ((f64, f64), Vector);

/// Follows the normal between neighbours: where it turns to the other side within any distance, the surface folds; where
/// it only turns fast, halving finds it turning less.
fn check_fold(surface: &SplineSurface, mut a: Place, mut b: Place) -> Result<(), IrregularSurface> {
    for _ in 0..30 {
        if a.1.dot(&b.1) > 0.0 {
            return Ok(());
        }
        let middle = ((a.0.0 + b.0.0) / 2.0, (a.0.1 + b.0.1) / 2.0);
        let jet = surface.jet(middle.0, middle.1);
        let normal = jet.su.cross(&jet.sv);
        if a.1.dot(&normal) > 0.0 {
            a = (middle, normal);
        } else {
            b = (middle, normal);
        }
    }
    Err(IrregularSurface::Fold { u: b.0.0, v: b.0.1 })
}

#[cfg(test)]
#[path = "oriented_spline_tests.rs"]
mod tests;
