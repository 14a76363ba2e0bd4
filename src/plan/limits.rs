//! What a strip's errors are measured against.

use super::assess::Deviation;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_borne_holds_both_errors_and_never_lets_overcut_pass_its_limit() {
        let limits = Limits { overcut: 0.01, undercut: 0.03 };
        for (bearable, below) in [(0.5, 0.005), (1.0, 0.01), (3.0, 0.01)] {
            let sides = limits.sides_within(bearable);
            assert_eq!((sides.hard_above, sides.hard_below), (bearable * 0.03, below));
        }
    }
}
