//! The colours of a signed deviation: two hues that colour-blind readers tell apart, pale inside the tolerance,
//! saturated at once outside it.
//!
//! Each side has [`STEPS`] equal steps from zero to its tolerance and as many from there to the largest deviation, so
//! the map is symmetric in units of the tolerance even where overcut and undercut are allowed differently.

use super::data::PartView;

/// Steps of one side inside the tolerance, and again outside it.
pub(super) const STEPS: usize = 4;

/// Overcut, from zero outward: pale inside the tolerance, then vermilion to dark red.
pub(super) const OVERCUT: [u32; 2 * STEPS] =
    [0xfbf8f3, 0xf9ecdb, 0xf5dcbf, 0xefc9a0, 0xe8592b, 0xc63a22, 0x9a201e, 0x64101a];

/// Undercut, from zero outward: pale inside the tolerance, then blue to navy.
pub(super) const UNDERCUT: [u32; 2 * STEPS] =
    [0xf5f9fa, 0xe0eef4, 0xc8e1ec, 0xabd1e2, 0x2a86c4, 0x1d64a8, 0x16458a, 0x10295c];

/// Ground and stripes of a place that no pass reaches.
pub(super) const UNCUT: [u32; 2] = [0xd3cfda, 0x7a7288];

/// Strips in turn: Okabe and Ito's colour-blind safe hues, lightened.
pub(super) const STRIPS: [u32; 7] = [0x8cc5ea, 0xf2c25b, 0x76c9ae, 0xe59a6b, 0xd7a3c3, 0xf3ea93, 0x7ba4cf];

/// Where the colour map ends on either side.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub(super) struct Scale {
    /// Allowed overcut, mm.
    pub(super) overcut_tolerance: f64,
    /// Allowed undercut, mm.
    pub(super) undercut_tolerance: f64,
    /// Overcut at the last step, mm.
    pub(super) overcut_end: f64,
    /// Undercut at the last step, mm.
    pub(super) undercut_end: f64,
}

impl Scale {
    /// Reaches twice the tolerance, or farther to the largest deviation on that side.
    pub(super) fn of(part: &PartView) -> Self {
        let (overcut, undercut) = part.extremes();
        let (over_tolerance, under_tolerance) = (part.overcut_tolerance.max(0.0), part.undercut_tolerance.max(0.0));
        // A side without tolerance borrows a length so that its steps are not empty.
        let least = (0.1 * over_tolerance.max(under_tolerance)).max(1e-3);
        Self {
            overcut_tolerance: over_tolerance,
            undercut_tolerance: under_tolerance,
            overcut_end: overcut.max(2.0 * over_tolerance).max(least),
            undercut_end: undercut.max(2.0 * under_tolerance).max(least),
        }
    }

    /// Share of the colour bar at a deviation: -1 at the largest overcut, 0 at zero, 1 at the largest undercut.
    pub(super) fn share(&self, deviation: f64) -> f64 {
        let (size, tolerance, end) = if deviation < 0.0 {
            (-deviation, self.overcut_tolerance, self.overcut_end)
        } else {
            (deviation, self.undercut_tolerance, self.undercut_end)
        };
        let share = if size > tolerance {
            0.5 + 0.5 * ((size - tolerance) / (end - tolerance)).min(1.0)
        } else if tolerance > 0.0 {
            0.5 * size / tolerance
        } else {
            0.0
        };
        share.copysign(deviation)
    }
}

/// `#rrggbb`.
pub(super) fn css(rgb: u32) -> String {
    format!("#{rgb:06x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(overcut: f64, undercut: f64, deviations: &[f64]) -> Scale {
        Scale::of(&PartView {
            deviation: deviations.iter().map(|d| Some(*d)).collect(),
            overcut_tolerance: overcut,
            undercut_tolerance: undercut,
            ..PartView::default()
        })
    }

    #[test]
    fn tolerances_stand_half_way_and_extremes_at_the_ends() {
        let scale = scale(0.005, 0.020, &[-0.002, 0.110]);
        assert_eq!((scale.overcut_end, scale.undercut_end), (0.010, 0.110));
        for (deviation, share) in
            [(-0.010, -1.0), (-0.005, -0.5), (0.0, 0.0), (0.010, 0.25), (0.020, 0.5), (0.110, 1.0)]
        {
            assert!((scale.share(deviation) - share).abs() < 1e-12, "{deviation}");
        }
        assert_eq!(scale.share(5.0), 1.0);
    }

    #[test]
    fn without_tolerance_any_overcut_is_beyond_it() {
        let scale = scale(0.0, 0.020, &[]);
        assert!(scale.share(-1e-6) < -0.5);
        assert_eq!(scale.share(0.0), 0.0);
    }
}
