//! What a fit of one strip starts from and comes to.

use super::Observer;
use super::assess::{AssessError, Borders, Deviation, Gouge};
use crate::motion::RuledMotion;

/// Control points that rails are not refined beyond.
const MOST_CONTROLS: usize = 150;

/// How finely a strip is modelled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resolution {
    /// Control points a rail.
    pub(super) controls: usize,
    /// Instants at which the fit looks, at least twice the control points.
    pub(super) instants: usize,
    /// Heights at which it looks.
    pub(super) heights: usize,
}

impl Resolution {
    /// Rails of `times` as many pieces, or as many times as is affordable.
    pub(super) fn finer(self, times: usize) -> Self {
        let pieces = self.controls - 3;
        let controls = pieces * times.min((MOST_CONTROLS - 3) / pieces).max(1) + 3;
        Self { controls, instants: 2 * controls + 1, ..self }
    }
}

/// A fitted strip.
#[derive(Clone, Debug)]
pub(super) struct FittedStrip {
    /// The tool's motion.
    pub(super) motion: RuledMotion,
    /// Its envelope's deviation, sampled densely.
    pub(super) deviation: Deviation,
    /// Steps of the optimizer.
    pub(super) steps: usize,
    /// What it covers.
    pub(super) borders: Borders,
    /// How finely it is modelled.
    pub(super) resolution: Resolution,
    /// What is known of its deviation.
    pub(super) look: Look,
}

/// How closely a strip was looked at.
#[derive(Clone, Debug)]
pub(super) enum Look {
    /// As densely as while it was fitted: between two points its deviation may be larger.
    Coarse,
    /// As densely as in the end, or a denser look would tell nothing that matters.
    Dense,
    /// As while it was fitted; a denser look has led to this strip.
    Followed(Box<FittedStrip>),
}

/// Why a strip could not be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(super) enum StripError {
    /// No rulings to start from.
    #[error("no ruling of the tool touches the part along the whole strip without its rails turning back")]
    NoStart,
    /// The fit broke down.
    #[error("the fit broke down; the part is too curved for this tool at this strip width")]
    BrokeDown,
    /// What is above the flutes stands in the part, and the flank cannot turn so far.
    #[error("what is above the flutes would cut {:.3} mm into the part near ({:.2}, {:.2}, {:.2}) while the flank touches it", .0.depth, .0.at.x, .0.at.y, .0.at.z)]
    Body(Gouge),
    /// The fitted motion has no proper envelope.
    #[error("the fitted motion has no envelope: {0}")]
    Envelope(#[from] AssessError),
}

impl StripError {
    /// True where firmer rails will hardly help.
    pub(super) fn is_hopeless(&self) -> bool {
        matches!(self, Self::Body(_) | Self::Envelope(AssessError::NoContact { .. }))
    }
}

/// How the optimizer works on a strip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort<'a> {
    /// Weight of second differences.
    pub(super) fairness: f64,
    /// Most linearizations toward the least largest error.
    pub(super) rounds: usize,
    /// Share of the limits below which errors are small enough.
    pub(super) enough: f64,
    /// The tolerance is to be held, not the least error to be found.
    pub(super) tolerant: bool,
    /// May end the work early.
    pub(super) observer: &'a dyn Observer,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finer_rails_hold_the_knots_of_the_coarse_ones_up_to_what_is_affordable() {
        let coarse = Resolution { controls: 38, instants: 77, heights: 9 };
        for times in 1..=9 {
            let fine = coarse.finer(times);
            assert_eq!((fine.controls - 3) % (coarse.controls - 3), 0);
            assert!(fine.controls <= MOST_CONTROLS && fine.instants > 2 * fine.controls, "{fine:?}");
            assert!(times > 4 || fine.controls - 3 == times * (coarse.controls - 3));
        }
    }
}
