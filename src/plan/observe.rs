//! Watching a plan being made, and ending it early. Uses nothing of the crate.
//!
//! Whoever plans knows neither clocks nor signals: it tells an [`Observer`] how far it is, and asks it whether to go on.
//! An observer that never stops anything changes nothing: the plan is the same bytes with and without it.

/// How far planning is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Strips of the division at hand.
    pub strips: usize,
    /// What the planner works on.
    pub stage: Stage,
    /// Largest overcut of what was fitted last, mm.
    pub overcut: f64,
    /// Largest undercut of what was fitted last, mm.
    pub undercut: f64,
}

/// What a planner works on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// A strip by itself, from 0.
    Strip(usize),
    /// All strips together, at a step of the optimizer, from 1.
    Step(usize),
}

/// Follows a plan and may end it. Called from several threads.
pub trait Observer: Sync + std::fmt::Debug {
    /// Takes note of the progress.
    fn note(&self, progress: &Progress);

    /// True once planning should end with the best found so far. Must not become false again.
    fn stopped(&self) -> bool;
}

/// Looks away and never stops anything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unobserved;

impl Observer for Unobserved {
    fn note(&self, _progress: &Progress) {}

    fn stopped(&self) -> bool {
        false
    }
}
