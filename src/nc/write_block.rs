//! One block of the path as text: words in the dialect's own form, those left out that stay as they were. Uses of
//! `machine` the control's options.

use super::code::FeedUnit;
use super::dialect::Style;
use super::format::{NumberStyle, push_steps, steps, value_of};
use super::write_feed::FeedWord;
use crate::machine::{Machine, Rollover, Travel};

/// Words of a block in steps of their last decimals: X, Y, Z, then the rotary axes in the machine's order, then the
/// components of the tool axis.
pub(super) type Words = [i64; 8];

/// Indices of the linear, rotary and vector words.
pub(super) const LINEAR: [usize; 3] = [0, 1, 2];
pub(super) const ROTARY: [usize; 2] = [3, 4];
const VECTOR: [usize; 3] = [5, 6, 7];

/// What a block begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    Rapid,
    Feed,
}

/// Puts blocks together.
pub(super) struct BlockWriter {
    style: Style,
    numbers: NumberStyle,
    digits: [u8; 8],
    feed_digits: u8,
    /// What stands before and behind the number of each word.
    before: [String; 8],
    behind: [&'static str; 8],
    /// Whether a rotary axis is wrapped, and whether its words say by their sign which way to turn.
    pub(super) wrapped: [bool; 2],
    signed: bool,
    /// Whether the machine has the axis of a word.
    present: [bool; 8],
    modal: bool,
    /// Words in force; `None` where a block must say them.
    said: [Option<i64>; 8],
    /// What the block in force began with, and whether it gave a tool vector.
    motion: Option<(Motion, bool)>,
    inverse: bool,
    feed: Option<i64>,
}

impl BlockWriter {
    pub(super) fn new(machine: &Machine, style: Style, modal: bool) -> Self {
        let options = &machine.control.options;
        let wrapped = machine.rotary.each_ref().map(|axis| axis.travel == Travel::Wrapped);
        let mut before = machine.letters().map(|letter| letter.to_string()).to_vec();
        let mut behind = [""; 8];
        for slot in ROTARY {
            if wrapped[slot - 3] {
                if let Some(before) = before.get_mut(slot) {
                    before.push_str(style.wrapped.before);
                }
                behind[slot] = style.wrapped.behind;
            }
        }
        before.extend(style.vector.map(str::to_owned));
        let [linear, rotary, vector] = [options.linear_digits, options.rotary_digits, options.vector_digits];
        let digits = [linear, linear, linear, rotary, rotary, vector, vector, vector];
        Self {
            numbers: NumberStyle { point: if options.decimal_comma { b',' } else { b'.' }, ..style.numbers },
            style,
            digits,
            feed_digits: options.feed_digits,
            before: std::array::from_fn(|index| before.get(index).cloned().unwrap_or_default()),
            behind,
            wrapped,
            signed: options.rollover == Rollover::Sign && style.wrapped.before.is_empty(),
            present: std::array::from_fn(|index| index >= 5 || machine.has_axis(index)),
            modal,
            said: [None; 8],
            motion: None,
            inverse: false,
            feed: None,
        }
    }

    /// One turn of a rotary axis in steps.
    pub(super) fn turn(&self) -> i64 {
        let digits = self.digits[ROTARY[0]];
        360 * 10_i64.pow(u32::from(digits.min(9)))
    }

    /// The words of these indices as a template may use them; `turned` says which way the rotary axes go.
    pub(super) fn text(&self, words: &Words, indices: &[usize]) -> String {
        let mut text = String::new();
        for index in indices.iter().filter(|index| self.present[**index]) {
            self.push_word(&mut text, *index, words[*index], 0);
        }
        text.truncate(text.trim_end().len());
        text
    }

    /// A number with some digits as a template may use it.
    pub(super) fn number(&self, value: f64, digits: u8) -> String {
        let mut text = String::new();
        if let Some(steps) = steps(value, digits) {
            push_steps(&mut text, steps, digits, NumberStyle { plus: false, point_always: false, ..self.numbers });
        }
        text
    }

    fn push_word(&self, out: &mut String, index: usize, steps: i64, turned: i64) {
        out.push_str(&self.before[index]);
        let negative = self.signed && turned < 0 && ROTARY.iter().any(|slot| *slot == index && self.wrapped[slot - 3]);
        if negative && steps == 0 {
            // The number has no sign of its own.
            out.push('-');
        }
        push_steps(out, if negative { -steps } else { steps }, self.digits[index], self.numbers);
        out.push_str(self.behind[index]);
        out.push(' ');
    }

    /// Adds a block to `out`, with the tool axis by its components where `vector`; `turned` is by how much the rotary axes
    /// turn, in steps.
    pub(super) fn push(
        &mut self,
        out: &mut String,
        motion: Motion,
        words: &Words,
        vector: bool,
        turned: [i64; 2],
        feed: Option<FeedWord>,
    ) {
        if let (Some(feed), Some([inverse, per_minute])) = (feed, self.style.feed_units) {
            let is_inverse = feed.unit == FeedUnit::InverseTime;
            if is_inverse != self.inverse {
                self.inverse = is_inverse;
                self.feed = None;
                out.push_str(if is_inverse { inverse } else { per_minute });
            }
        }
        if !(self.modal && self.style.motion_stays && self.motion == Some((motion, vector))) {
            self.motion = Some((motion, vector));
            out.push_str(match motion {
                _ if vector => self.style.vector_line(motion == Motion::Rapid),
                Motion::Rapid => self.style.rapid,
                Motion::Feed => self.style.line,
            });
        }
        if vector && self.style.whole_vectors {
            self.said = [None; 8];
        }
        self.push_words(out, words, vector, turned);
        match feed {
            Some(feed) if self.inverse || !self.modal || self.feed != Some(feed.steps) => {
                self.feed = Some(feed.steps);
                out.push('F');
                push_steps(out, feed.steps, self.feed_digits, NumberStyle { plus: false, ..self.numbers });
            }
            None => out.push_str(self.style.rapid_feed),
            Some(_) => {}
        }
        out.truncate(out.trim_end_matches(' ').len());
    }

    fn push_words(&mut self, out: &mut String, words: &Words, vector: bool, turned: [i64; 2]) {
        let chosen: &[usize] = if vector { &[0, 1, 2, 5, 6, 7] } else { &[0, 1, 2, 3, 4] };
        let vector_stays = VECTOR.iter().all(|index| self.said[*index] == Some(words[*index]));
        for index in chosen.iter().copied() {
            let steps = words[index];
            let stays = match index {
                5.. => vector_stays,
                _ => {
                    self.said[index] == Some(steps) && ROTARY.iter().all(|slot| *slot != index || turned[slot - 3] == 0)
                }
            };
            if (self.modal && stays) || !self.present[index] {
                continue;
            }
            self.said[index] = Some(steps);
            self.push_word(out, index, steps, if let 3 | 4 = index { turned[index - 3] } else { 0 });
        }
    }

    /// The value of a word, in the program's units or degrees.
    pub(super) fn value(&self, index: usize, steps: i64) -> f64 {
        value_of(steps, self.digits[index])
    }

    /// Steps of a word; `None` where a control reads no such number.
    pub(super) fn steps(&self, index: usize, value: f64) -> Option<i64> {
        steps(value, self.digits[index])
    }
}
