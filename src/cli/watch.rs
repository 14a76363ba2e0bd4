//! Watching a plan from the terminal: the current error on one line, and Ctrl-C, which keeps the best found so far.

use super::Terminal;
use crate::diagnostic::Result;
use crate::pipeline::{Inputs, plan_observed};
use crate::plan::{Observer, Plan, Progress, Stage};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Nothing is being planned: an interrupt ends the program.
const IDLE: u8 = 0;
/// A plan is being made: the first interrupt ends it early.
const PLANNING: u8 = 1;
/// A plan is being ended: a second interrupt ends the program.
const ENDING: u8 = 2;
/// What an interrupt does now; one for the process, as its signals are.
static STATE: AtomicU8 = AtomicU8::new(IDLE);

/// Exit status of a program that an interrupt ended, as shells have it.
const INTERRUPTED: i32 = 130;
/// People read no faster.
const BETWEEN_NOTES: Duration = Duration::from_millis(80);

/// Plans a job, shows the error of what is being fitted, and lets Ctrl-C end it with the best found so far.
pub(super) fn plan(inputs: &Inputs, terminal: &mut Terminal) -> Result<Plan> {
    terminal.progress("planning");
    // Where signals cannot be caught, an interrupt ends the program at once, as ever.
    let _uncaught = ctrlc::set_handler(on_interrupt);
    STATE.store(PLANNING, Ordering::SeqCst);
    let watch = Watch { line: Mutex::new(Line { terminal, last: None }) };
    let plan = plan_observed(inputs, &watch);
    STATE.store(IDLE, Ordering::SeqCst);
    plan
}

fn on_interrupt() {
    if STATE.compare_exchange(PLANNING, ENDING, Ordering::SeqCst, Ordering::SeqCst).is_err() {
        std::process::exit(INTERRUPTED);
    }
}

/// The line that shows progress.
#[derive(Debug)]
struct Line<'a> {
    terminal: &'a mut Terminal,
    last: Option<Instant>,
}

#[derive(Debug)]
struct Watch<'a> {
    line: Mutex<Line<'a>>,
}

impl Observer for Watch<'_> {
    fn note(&self, progress: &Progress) {
        let mut line = self.line.lock().unwrap_or_else(PoisonError::into_inner);
        if line.last.is_some_and(|last| last.elapsed() < BETWEEN_NOTES) {
            return;
        }
        line.last = Some(Instant::now());
        let end = if self.stopped() { ", ending" } else { "" };
        line.terminal.progress(&format!("planning {}{end}", said(progress)));
    }

    fn stopped(&self) -> bool {
        STATE.load(Ordering::SeqCst) == ENDING
    }
}

fn said(progress: &Progress) -> String {
    let stage = match progress.stage {
        Stage::Strip(index) => format!("strip {} of {}", index + 1, progress.strips),
        Stage::Step(step) => format!("{} strips, step {step}", progress.strips),
    };
    format!("{stage}: overcut {:.5}, undercut {:.5} mm", progress.overcut, progress.undercut)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_names_strip_or_step_with_both_errors() {
        let progress = Progress { strips: 5, stage: Stage::Strip(0), overcut: 0.0012, undercut: 0.02 };
        assert_eq!(said(&progress), "strip 1 of 5: overcut 0.00120, undercut 0.02000 mm");
        assert!(said(&Progress { stage: Stage::Step(7), ..progress }).starts_with("5 strips, step 7: "));
    }
}
