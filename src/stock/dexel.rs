//! Lines of material: sorted pieces with the outward normal at each end. Uses `geometry`.

use crate::geometry::Vector;

/// Pieces shorter than this are none, mm.
const SHORTEST: f64 = 1e-9;

/// A unit vector in four bytes, as places on an octahedron laid flat; within 0.005 degrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Normal(pub(super) [i16; 2]);

/// A piece of material on a line, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Run {
    pub(super) low: f64,
    pub(super) high: f64,
    /// Outward normals of the material at both ends.
    pub(super) normals: [Normal; 2],
}

/// The material on one line. Nearly every line has one piece, which costs no allocation.
#[derive(Clone, Debug, Default)]
pub(super) struct Dexel {
    first: Option<Run>,
    more: Vec<Run>,
}

/// What a cut took from a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Taken {
    /// Sum of what was taken, mm.
    pub(super) length: f64,
    /// About how deep the deepest piece reached, across the surface that it left, mm.
    pub(super) depth: f64,
}

impl Normal {
    pub(super) fn new(v: &Vector) -> Self {
        let sum = v.x.abs() + v.y.abs() + v.z.abs();
        let (x, y) = if sum > 0.0 { (v.x / sum, v.y / sum) } else { (0.0, 0.0) };
        let (x, y) = if v.z < 0.0 { ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)) } else { (x, y) };
        let whole = |a: f64| (a * f64::from(i16::MAX)).round() as i16;
        Self([whole(x), whole(y)])
    }

    pub(super) fn vector(self) -> Vector {
        let [x, y] = self.0.map(|a| f64::from(a) / f64::from(i16::MAX));
        let z = 1.0 - x.abs() - y.abs();
        let v = if z < 0.0 {
            Vector::new((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y), z)
        } else {
            Vector::new(x, y, z)
        };
        v.normalize()
    }
}

impl Dexel {
    pub(super) fn of(runs: Vec<Run>) -> Self {
        let mut runs = runs.into_iter();
        let first = runs.next();
        Self { first, more: runs.collect() }
    }

    pub(super) fn runs(&self) -> impl Iterator<Item = &Run> {
        self.first.iter().chain(&self.more)
    }

    pub(super) fn length(&self) -> f64 {
        self.runs().map(|run| run.high - run.low).sum()
    }

    /// Whether a piece reaches into the interval between two places.
    pub(super) fn meets(&self, low: f64, high: f64) -> bool {
        self.runs().any(|run| run.high > low && run.low < high)
    }

    /// Takes away what lies between two places on a line along coordinate `along`; `normals` gives the outward normals
    /// that the material gets there.
    pub(super) fn cut(
        &mut self,
        (low, high): (f64, f64),
        along: usize,
        normals: impl Fn() -> [Vector; 2],
    ) -> Option<Taken> {
        if !self.meets(low + SHORTEST, high - SHORTEST) {
            return None;
        }
        let new = normals();
        let packed = [Normal::new(&new[0]), Normal::new(&new[1])];
        let mut taken = Taken::default();
        let mut left = Vec::new();
        for run in self.first.take().into_iter().chain(self.more.drain(..)) {
            let (from, to) = (run.low.max(low), run.high.min(high));
            if to - from <= SHORTEST {
                left.push(run);
                continue;
            }
            taken.length += to - from;
            // A long thin shaving lies along the line: its ends are steep to it.
            let at_low = if low > run.low { new[0][along] } else { run.normals[0].vector()[along] };
            let at_high = if high < run.high { new[1][along] } else { run.normals[1].vector()[along] };
            taken.depth = taken.depth.max((to - from) * at_low.abs().min(at_high.abs()));
            if low - run.low > SHORTEST {
                left.push(Run { high: low, normals: [run.normals[0], packed[0]], ..run });
            }
            if run.high - high > SHORTEST {
                left.push(Run { low: high, normals: [packed[1], run.normals[1]], ..run });
            }
        }
        *self = Self::of(left);
        Some(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn normals_keep_their_direction(v in prop::array::uniform3(-1.0..1.0f64)) {
            let v = Vector::from(v);
            prop_assume!(v.norm() > 0.1);
            let v = v.normalize();
            prop_assert!((Normal::new(&v).vector() - v).norm() < 1e-4);
        }

        #[test]
        fn cuts_take_what_a_bitmap_takes(cuts in prop::collection::vec((0..40u32, 0..40u32), 1..12)) {
            let z = Normal::new(&Vector::z());
            let mut dexel = Dexel::of(vec![Run { low: 0.0, high: 40.0, normals: [z, z] }]);
            let mut cells = [true; 40];
            for (a, b) in cuts {
                let (low, high) = (a.min(b), a.max(b));
                let before = cells.iter().filter(|c| **c).count();
                cells[low as usize..high as usize].fill(false);
                let gone = before - cells.iter().filter(|c| **c).count();
                let taken = dexel.cut((f64::from(low), f64::from(high)), 2, || [Vector::z(), Vector::z()]);
                prop_assert!((taken.unwrap_or_default().length - gone as f64).abs() < 1e-9);
            }
            let left = cells.iter().filter(|c| **c).count();
            prop_assert!((dexel.length() - left as f64).abs() < 1e-9);
            let ordered: Vec<f64> = dexel.runs().flat_map(|r| [r.low, r.high]).collect();
            prop_assert!(ordered.windows(2).all(|w| w[0] <= w[1]));
        }
    }

    #[test]
    fn a_shaving_along_the_line_is_thin() {
        let (up, side) = (Normal::new(&Vector::z()), Vector::new(1.0, 0.0, 1e-3).normalize());
        let mut dexel = Dexel::of(vec![Run { low: 0.0, high: 10.0, normals: [up, up] }]);
        let taken = dexel.cut((2.0, 12.0), 2, || [side, side]).unwrap();
        assert!((taken.length - 8.0).abs() < 1e-12 && (taken.depth - 0.008).abs() < 1e-6, "{taken:?}");
    }
}
