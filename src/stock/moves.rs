//! A program's motion as short stretches in each of which tip and axis move evenly. Uses `geometry`, `motion` and
//! `simulate`.

use crate::motion::Pose;
use crate::simulate::{SegmentKind, ToolMotion};

/// Points of the axis leave the chords of their stretches by less than this, mm.
const SAG: f64 = 5e-5;
/// Stretches that one block is cut into at most: a whole turn of a tool 100 mm long takes fewer.
const MOST_STRETCHES: f64 = 10_000.0;

/// One block as the stock sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Line of the program, from 1.
    pub line: usize,
    /// Moves as fast as the machine can.
    pub rapid: bool,
    /// When it begins, s.
    pub start: f64,
    /// How long it takes, s.
    pub duration: f64,
    /// Way of the tip, mm.
    pub length: f64,
}

/// A stretch of a block: tip and axis points move along their chords.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Index of the block.
    pub block: usize,
    /// Pose at its beginning, part frame.
    pub from: Pose,
    /// Pose at its end.
    pub to: Pose,
}

/// Blocks with their stretches, both in order of time.
#[derive(Clone, Debug, Default)]
pub struct Moves {
    /// The blocks.
    pub blocks: Vec<Block>,
    /// Their stretches.
    pub stretches: Vec<Stretch>,
}

impl Moves {
    /// What a program makes a tool do whose flutes are `flute_length` mm long.
    pub fn of(motion: &ToolMotion, flute_length: f64) -> Self {
        let mut moves = Self::default();
        for segment in motion.segments() {
            let block = Block {
                line: segment.line,
                rapid: segment.kind == SegmentKind::Rapid,
                start: segment.start,
                duration: segment.duration,
                length: motion.tip_length(segment),
            };
            let bend = [0.0, flute_length].map(|h| motion.chord_bound(segment, 0.0, 1.0, h));
            let parts = (bend[0].max(bend[1]) / SAG).sqrt().ceil().clamp(1.0, MOST_STRETCHES);
            let mut from = motion.pose(segment, 0.0);
            for part in 1..=parts as usize {
                let to = motion.pose(segment, part as f64 / parts);
                moves.stretches.push(Stretch { block: moves.blocks.len(), from, to });
                from = to;
            }
            moves.blocks.push(block);
        }
        moves
    }

    /// Straight blocks through poses, one stretch each, all at one feed in mm/s. No two neighbours may be turned against
    /// each other by more than a degree or so.
    pub fn through(poses: &[Pose], feed: f64) -> Self {
        let mut moves = Self::default();
        let mut start = 0.0;
        for (index, pair) in poses.windows(2).enumerate() {
            let length = (pair[1].tip - pair[0].tip).norm();
            let duration = length / feed;
            moves.blocks.push(Block { line: index + 1, rapid: false, start, duration, length });
            moves.stretches.push(Stretch { block: index, from: pair[0], to: pair[1] });
            start += duration;
        }
        moves
    }
}
