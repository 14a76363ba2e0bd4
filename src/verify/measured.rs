//! A sample of the part with what cut it. Uses `part` and the sweep.

use super::motion_tree::{BlockMotion, Instant};
use super::ray::NormalRay;
use super::sweep::Sweep;
use super::swept::Touch;
use crate::part::SurfaceSample;

/// A sample of the part and the lowest point that any cutting move reaches on its normal; `None` where it is uncut.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredSample {
    /// Where.
    pub sample: SurfaceSample,
    /// What cut it.
    pub touch: Option<Touch>,
}

impl MeasuredSample {
    /// Signed deviation, mm: positive where material is left.
    pub fn deviation(&self) -> Option<f64> {
        self.touch.map(|t| t.depth)
    }
}

/// Measures samples; `hint` gives of each by its index a time that is likely to be when it is cut.
pub(super) fn measure_samples<M: BlockMotion>(
    sweep: &Sweep<'_, M>,
    samples: Vec<SurfaceSample>,
    hint: impl Fn(usize) -> Option<Instant> + Sync + Send,
) -> Vec<MeasuredSample> {
    let rays: Vec<NormalRay> = samples.iter().map(ray_of).collect();
    let touches = sweep.lowest_all(&rays, |index| (hint(index), f64::INFINITY));
    samples.into_iter().zip(touches).map(|(sample, touch)| MeasuredSample { sample, touch }).collect()
}

/// The normal of the part at a sample.
pub(super) fn ray_of(sample: &SurfaceSample) -> NormalRay {
    NormalRay { origin: sample.point, normal: sample.normal.0 }
}

/// The sides of a triangle.
pub(super) fn edges(triangle: &[u32; 3]) -> [(u32, u32); 3] {
    let [a, b, c] = *triangle;
    [(a, b), (b, c), (c, a)]
}
