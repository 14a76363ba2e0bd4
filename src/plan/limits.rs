//! What a strip's errors are measured against.

use super::assess::{Deviation, Survey};
use crate::optimize::minimax::Sides;

/// What a strip's deviation should stay below, mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Below the surface.
    pub(super) overcut: f64,
    /// Above the surface.
    pub(super) undercut: f64,
}

impl Limits {
    /// Largest of both errors, each as a share of its limit; what leaves part of its band uncut is worth less than any error.
    pub(super) fn strain(&self, deviation: &Deviation) -> f64 {
        let uncut = deviation.bare.map_or(0.0, |bare| UNCUT * (1.0 + bare.width));
        uncut + self.strain_of(-deviation.overcut.max(deviation.outside)).max(self.strain_of(deviation.undercut))
    }

    /// A signed deviation as a share of its limit, not negative. Where no overcut at all is allowed it counts as a share
    /// of what resolution calls none.
    pub(super) fn strain_of(&self, deviation: f64) -> f64 {
        if deviation > 0.0 { deviation / self.undercut } else { -deviation / self.overcut.max(NO_OVERCUT) }
    }

    /// Mean of both, mm.
    pub(super) fn mean(&self) -> f64 {
        0.5 * (self.overcut + self.undercut)
    }

    /// The same as [`Self::sides`] with neither limit strained more than `bearable`.
    pub(super) fn sides_within(&self, bearable: f64) -> Sides {
        let hard_below = bearable.min(1.0) * self.overcut;
        Sides { hard_above: bearable * self.undercut, hard_below, ..self.sides() }
    }

    /// Both errors strain their limits alike; overcut never more than wholly.
    pub(super) fn sides(&self) -> Sides {
        let below = if self.overcut > 0.0 { self.overcut } else { f64::INFINITY };
        Sides { above: self.undercut, below, hard_below: self.overcut, ..Sides::FREE }
    }
}

/// Least strain of what leaves part of its band uncut.
pub(super) const UNCUT: f64 = 1e3;
/// Overcut that counts as none, mm.
const NO_OVERCUT: f64 = 1e-6;

/// How many times as far as a parabola's a deviation may rise between two points.
const RISE: f64 = 2.0;

impl Limits {
    /// The largest error, as a share of its limit, that is to be feared at the points looked at and between them: between two
    /// of them the deviation may rise beyond both like a parabola of the same second difference, and more; at the edge of
    /// what counts it goes on as it came.
    pub(super) fn feared(&self, survey: &Survey) -> f64 {
        let mut feared = self.strain(&survey.worst);
        for (i, point) in survey.points.iter().enumerate() {
            let Some(here) = point.deviation else { continue };
            let (column, heights) = ((i % survey.heights) as isize, survey.heights as isize);
            let deviation =
                |by: isize| i.checked_add_signed(by).and_then(|i| survey.points.get(i)).map(|p| p.deviation);
            let across = |by: isize| if (0..heights).contains(&(column + by)) { deviation(by) } else { None };
            let rise = rise(here, across) + rise(here, |by| deviation(by * heights));
            feared = feared.max(self.strain_of(here + rise)).max(self.strain_of(here - rise));
        }
        feared
    }
}

/// How far a deviation may rise beyond one of its points up to the two next to it. `next` gives those so many points away,
/// if there are any, and if they count.
fn rise(here: f64, next: impl Fn(isize) -> Option<Option<f64>>) -> f64 {
    let counted = |by: isize| next(by).flatten();
    let bend = |a: f64, b: f64| RISE * (here - 2.0 * a + b).abs();
    let end = |toward: isize, a: f64| {
        let bend = counted(2 * toward).map_or(0.0, |b| bend(a, b));
        if next(-toward).is_some() { (here - a).abs() + bend } else { bend / 8.0 }
    };
    match (counted(-1), counted(1)) {
        (Some(a), Some(b)) => RISE * (a - 2.0 * here + b).abs() / 8.0,
        (Some(a), None) => end(-1, a),
        (None, Some(a)) => end(1, a),
        (None, None) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::super::assess::Judged;
    use super::super::touch::Hint;
    use super::*;
    use crate::geometry::{Point, SurfaceJet, SurfacePlace, Vector};
    use proptest::prelude::*;

    #[test]
    fn what_is_borne_holds_both_errors_and_never_lets_overcut_pass_its_limit() {
        let limits = Limits { overcut: 0.01, undercut: 0.03 };
        for (bearable, below) in [(0.5, 0.005), (1.0, 0.01), (3.0, 0.01)] {
            let sides = limits.sides_within(bearable);
            assert_eq!((sides.hard_above, sides.hard_below), (bearable * 0.03, below));
        }
    }

    /// `deviation` at 40 instants and 9 heights, none where it is.
    fn surveyed(deviation: impl Fn(f64, f64) -> Option<f64>) -> Survey {
        let zero = Vector::zeros();
        let jet = SurfaceJet { point: Point::origin(), su: zero, sv: zero, suu: zero, suv: zero, svv: zero };
        let hint = Hint { place: (0.0, 0.0), normal: zero, at: SurfacePlace { u: 0.0, v: 0.0, jet } };
        let (mut points, mut worst) = (Vec::new(), Deviation::NONE);
        for (j, k) in (0..40).flat_map(|j| (0..9).map(move |k| (j, k))) {
            let (t, share) = (f64::from(j) / 39.0, f64::from(k) / 8.0);
            let deviation = deviation(t, share);
            worst.undercut = worst.undercut.max(deviation.unwrap_or(0.0));
            worst.overcut = worst.overcut.max(-deviation.unwrap_or(0.0));
            points.push(Judged { t, share, deviation, short: false, hint });
        }
        Survey { points, heights: 9, gouges: Vec::new(), worst }
    }

    proptest! {
        /// Waves of at least five points each, and an edge from which on nothing counts.
        #[test]
        fn nothing_between_the_points_looked_at_is_worse_than_feared(
            sizes in [0.0..1.0_f64, 0.0..1.0], waves in [0.0..7.0_f64, 0.0..1.5], starts in [0.0..7.0_f64, 0.0..7.0],
            edge in 0.2..1.2_f64,
        ) {
            let wave = |i: usize, x: f64| sizes[i] * (std::f64::consts::TAU * waves[i] * x + starts[i]).sin();
            let deviation = |t: f64, share: f64| (t <= edge).then(|| wave(0, t) + wave(1, share));
            let limits = Limits { overcut: 0.3, undercut: 0.7 };
            let feared = limits.feared(&surveyed(deviation));
            for (i, k) in (0..=400).flat_map(|i| (0..=90).map(move |k| (i, k))) {
                let worst = deviation(f64::from(i) / 400.0, f64::from(k) / 90.0).map_or(0.0, |e| limits.strain_of(e));
                prop_assert!(worst <= feared, "{worst} {feared}");
            }
        }
    }

    #[test]
    fn what_hardly_varies_is_feared_to_be_hardly_more() {
        let limits = Limits { overcut: 1.0, undercut: 1.0 };
        let feared = limits.feared(&surveyed(|t, share| Some(0.4 + 0.01 * (9.0 * t).sin() + 0.1 * share)));
        assert!((0.5..0.52).contains(&feared), "{feared}");
    }
}
