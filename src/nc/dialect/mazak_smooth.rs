//! Mazak Smooth, EIA programs: codes as Fanuc's, with its own modes for corners and high speed.

use super::style::Style;
use super::words::style_with_length_in_tcp;
use super::{Rules, fanuc_30i};
use crate::nc::code::{GCode, letters};

/// How a Mazak Smooth reads EIA programs.
pub(super) fn reading() -> Rules {
    let mut rules = fanuc_30i::reading();
    rules.set_g(&[50], GCode::Harmless(letters("P")));
    rules.set_g(&[611], GCode::ExactPath);
    rules.set_g(&[412, 425], GCode::Unsupported);
    rules
}

/// How EIA programs for a Mazak Smooth are written.
pub(super) fn writing() -> Style {
    style_with_length_in_tcp()
}
