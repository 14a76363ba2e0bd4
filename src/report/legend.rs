//! The colour bar beside the 3D view, as SVG.

use super::colour::{OVERCUT, STEPS, Scale, UNCUT, UNDERCUT, css};
use super::data::PartView;
use super::encode::number;
use std::fmt::Write;

/// Height of a colour step, place and width of the bar, in SVG units; the page's script moves a needle beside it.
const STEP: f64 = 17.0;
const TOP: f64 = 18.0;
const LEFT: f64 = 14.0;
const WIDTH: f64 = 20.0;
const HALF: f64 = 2.0 * STEPS as f64 * STEP;
const MIDDLE: f64 = TOP + HALF;
const LABEL: f64 = LEFT + WIDTH + 10.0;

/// Undercut above, overcut below; both tolerances marked, and how far the part really goes.
pub(super) fn legend(part: &PartView) -> String {
    let scale = Scale::of(part);
    let bracket = LABEL + 52.0;
    let (overcut, undercut) = part.extremes();
    let extremes = extreme(&scale, undercut) + &extreme(&scale, -overcut);
    let uncut = if part.deviation.iter().any(Option::is_none) { uncut() } else { String::new() };
    format!(
        "<div class=\"legend\"><svg viewBox=\"0 0 142 318\" role=\"img\" aria-label=\"Colour bar of the deviation in \
         millimetres\"><text x=\"0\" y=\"10\" class=\"quiet\">undercut, mm</text>{}{}{extremes}<path class=\"bracket\" \
         d=\"M{bracket} {}h5v{HALF}h-5\"/><text class=\"quiet mid\" transform=\"translate({} {MIDDLE}) \
         rotate(-90)\">in tolerance</text><path id=\"needle\" d=\"M0 -5L9 0L0 5z\" visibility=\"hidden\"/><text x=\"0\" \
         y=\"{}\" class=\"quiet\">overcut, mm</text></svg>{uncut}</div>",
        steps(),
        labels(&scale),
        MIDDLE - HALF / 2.0,
        bracket + 17.0,
        MIDDLE + HALF + 14.0,
    )
}

fn steps() -> String {
    let mut out = String::new();
    for (i, colour) in UNDERCUT.iter().rev().chain(&OVERCUT).enumerate() {
        let (y, colour) = (TOP + i as f64 * STEP, css(*colour));
        let _ = write!(out, "<rect x=\"{LEFT}\" y=\"{y}\" width=\"{WIDTH}\" height=\"{STEP}\" fill=\"{colour}\"/>");
    }
    out
}

/// Ends, tolerances and zero with their values.
fn labels(scale: &Scale) -> String {
    let places = [
        (1.0, scale.undercut_end, "end-tick"),
        (0.5, scale.undercut_tolerance, "tick"),
        (0.0, 0.0, "end-tick"),
        (-0.5, -scale.overcut_tolerance, "tick"),
        (-1.0, -scale.overcut_end, "end-tick"),
    ];
    let mut out = String::new();
    for (share, value, class) in places {
        let y = MIDDLE - share * HALF;
        let _ = write!(
            out,
            "<path d=\"M{LEFT} {y}h{}\" class=\"{class}\"/><text x=\"{LABEL}\" y=\"{}\">{}{}</text>",
            WIDTH + 6.0,
            (y + 4.0).clamp(TOP + 8.0, MIDDLE + HALF),
            if value > 0.0 { "+" } else { "" },
            number(value, 4)
        );
    }
    out
}

/// A hollow mark at a measured extreme.
fn extreme(scale: &Scale, deviation: f64) -> String {
    let top = MIDDLE - scale.share(deviation) * HALF - 5.0;
    format!("<path class=\"extreme\" d=\"M2 {top:.1}l9 5l-9 5z\"/>")
}

fn uncut() -> String {
    let [ground, stripe] = UNCUT.map(css);
    format!(
        "<p><i style=\"background:repeating-linear-gradient(-45deg,{ground} 0 4px,{stripe} 4px 6px)\"></i>not cut</p>"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_tolerances_and_the_uncut_are_marked() {
        let mut part = PartView {
            overcut_tolerance: 0.005,
            undercut_tolerance: 0.020,
            deviation: vec![Some(-0.001), Some(0.1)],
            ..PartView::default()
        };
        let bar = legend(&part);
        assert!(bar.contains(">\u{2212}0.0050<") && bar.contains(">+0.0200<") && bar.contains(">+0.1000<"));
        assert_eq!(bar.matches("class=\"tick\"").count(), 2);
        assert!(!bar.contains("not cut"));
        part.deviation[0] = None;
        assert!(legend(&part).contains("not cut"));
    }
}
