//! Between axis positions and the words of a program, both ways, with TCP on and off. Uses nothing beyond the machine.

use super::axes::{AxisPosition, ProgramWords};
use super::model::{RotaryAxis, Travel};
use super::setup::{Setup, unwind};
use crate::geometry::Point;

/// The rotary word, degrees, for an angle in radians: literal, or from 0 to below 360 on a wrapped axis.
fn rotary_word(axis: &RotaryAxis, angle: f64) -> f64 {
    match axis.travel {
        Travel::Wrapped => angle.to_degrees().rem_euclid(360.0),
        Travel::Limited { .. } | Travel::Unlimited => angle.to_degrees(),
    }
}

impl Setup {
    /// The words of a block with TCP on: tip in the part frame, mm, and rotary angles, degrees.
    pub fn tcp_words(&self, axes: &AxisPosition) -> ProgramWords {
        ProgramWords { linear: self.forward(axes).tip.coords.into(), rotary: self.rotary_words(axes) }
    }

    /// The words of a block with TCP off: axes less work offset, and less tool length where the control adds it, mm;
    /// rotary angles, degrees.
    pub fn joint_words(&self, axes: &AxisPosition) -> ProgramWords {
        let zero = self.joint_zero();
        ProgramWords { linear: std::array::from_fn(|k| axes.linear[k] - zero[k]), rotary: self.rotary_words(axes) }
    }

    /// Words with TCP on or off.
    pub fn words(&self, axes: &AxisPosition, tcp: bool) -> ProgramWords {
        if tcp { self.tcp_words(axes) } else { self.joint_words(axes) }
    }

    /// The axis positions that a block's words command with TCP on; `before` is where the axes stood, which decides the
    /// turn of a wrapped axis.
    pub fn axes_from_tcp_words(&self, words: &ProgramWords, before: &AxisPosition) -> AxisPosition {
        self.with_rotary(&Point::from(words.linear), self.rotary_from_words(words, before))
    }

    /// The axis positions that a block's words command with TCP off; `before` as in [`Self::axes_from_tcp_words`].
    pub fn axes_from_joint_words(&self, words: &ProgramWords, before: &AxisPosition) -> AxisPosition {
        let zero = self.joint_zero();
        AxisPosition {
            linear: std::array::from_fn(|k| words.linear[k] + zero[k]),
            rotary: self.rotary_from_words(words, before),
        }
    }

    /// The axis positions that a block's words command with TCP on or off.
    pub fn axes_from_words(&self, words: &ProgramWords, before: &AxisPosition, tcp: bool) -> AxisPosition {
        if tcp { self.axes_from_tcp_words(words, before) } else { self.axes_from_joint_words(words, before) }
    }

    /// What the control adds to the linear words with TCP off, mm.
    fn joint_zero(&self) -> [f64; 3] {
        let [x, y, z] = self.work_offset();
        let length = self.machine().control.options.length_offset_without_tcp;
        [x, y, if length { z + self.tool_length() } else { z }]
    }

    fn rotary_words(&self, axes: &AxisPosition) -> [f64; 2] {
        let machine = &self.machine().rotary;
        std::array::from_fn(|k| rotary_word(&machine[k], axes.rotary[k]))
    }

    fn rotary_from_words(&self, words: &ProgramWords, before: &AxisPosition) -> [f64; 2] {
        std::array::from_fn(|k| {
            let angle = words.rotary[k].to_radians();
            match self.machine().rotary[k].travel {
                Travel::Wrapped => unwind(angle, before.rotary[k]),
                Travel::Limited { .. } | Travel::Unlimited => angle,
            }
        })
    }
}
