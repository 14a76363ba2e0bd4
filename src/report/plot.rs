//! Axis positions and speeds over time as SVG, with limits and a cursor that the page's script moves.

use super::data::{AxisTrack, TrackKind};
use super::encode::{escape, number};
use std::fmt::Write;

/// Size of a plot and of the frame inside it, in SVG units. The page's script reads the frame from the cursor.
const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 128.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = WIDTH - 10.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = HEIGHT - 22.0;

/// A limit is drawn when the data fill at least this share of the way to it; otherwise it is only said in words, since
/// the curve would be a flat line.
const SHOW_LIMIT_FROM: f64 = 0.4;

/// One curve with its limits.
struct Curve<'a> {
    /// How the page's script calls it.
    key: &'static str,
    title: &'static str,
    unit: String,
    values: &'a [f64],
    limits: Option<(f64, f64)>,
}

/// Both plots of an axis as one `figure` element. `times` has one entry a sample.
pub(super) fn axis_figure(times: &[f64], track: &AxisTrack) -> String {
    let [(first, first_unit), (second, second_unit)] = match track.kind {
        TrackKind::Axis => [("position", track.unit.clone()), ("speed", format!("{}/min", track.unit))],
        TrackKind::Stock => [("removal rate", "cm³/min".to_owned()), ("engagement", "deg".to_owned())],
    };
    let position =
        Curve { key: "position", title: first, unit: first_unit, values: &track.position, limits: track.travel };
    let speed = Curve {
        key: "speed",
        title: second,
        unit: second_unit,
        values: &track.speed,
        limits: track.max_speed.map(|v| (-v, v)),
    };
    let name = escape(&track.name);
    let mut out = format!("<section class=\"axis\" data-axis=\"{name}\"><h3>{name}</h3>");
    for curve in [position, speed] {
        out.push_str(&plot(times, &curve, &name));
    }
    out + "</section>\n"
}

fn plot(times: &[f64], curve: &Curve<'_>, name: &str) -> String {
    let (low, high) = range(curve);
    let start = times.first().copied().unwrap_or(0.0);
    let span = (times.last().copied().unwrap_or(0.0) - start).max(1e-9);
    let x = |t: f64| LEFT + (t - start) / span * (RIGHT - LEFT);
    let y = |v: f64| BOTTOM - (v.clamp(low, high) - low) / (high - low) * (BOTTOM - TOP);
    let (title, key) = (curve.title, curve.key);
    let mut svg = format!(
        "<figure><figcaption><span>{title} <small>{}</small></span><output data-value=\"{key}\"></output><span \
         class=\"use\">{}</span></figcaption><svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{name} \
         {title} over time\">",
        escape(&curve.unit),
        use_of_limits(curve)
    );
    for (value, label) in ticks(low, high, 4) {
        let y = y(value);
        let _ = write!(
            svg,
            "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{RIGHT}\"/><text x=\"{:.0}\" y=\"{:.1}\" class=\"end\">{label}\
             </text>",
            LEFT - 6.0,
            y + 3.5
        );
    }
    for (value, label) in ticks(start, start + span, 6) {
        let x = x(value);
        let _ = write!(
            svg,
            "<path class=\"grid\" d=\"M{x:.1} {TOP}V{BOTTOM}\"/><text x=\"{x:.1}\" y=\"{:.0}\" class=\"mid\">{label} s\
             </text>",
            BOTTOM + 15.0
        );
    }
    if let Some((lower, upper)) = curve.limits {
        for (limit, edge) in [(lower, BOTTOM), (upper, TOP)] {
            if (low..=high).contains(&limit) {
                let y = y(limit);
                let _ = write!(
                    svg,
                    "<rect class=\"forbidden\" x=\"{LEFT}\" y=\"{:.1}\" width=\"{}\" height=\"{:.1}\"/><path \
                     class=\"limit\" d=\"M{LEFT} {y:.1}H{RIGHT}\"/>",
                    y.min(edge),
                    RIGHT - LEFT,
                    (edge - y).abs()
                );
            }
        }
    }
    let mut path = String::new();
    for (i, (t, v)) in thinned(times, curve.values, (RIGHT - LEFT) as usize).into_iter().enumerate() {
        let _ = write!(path, "{}{:.1} {:.1}", if i == 0 { 'M' } else { 'L' }, x(t), y(v));
    }
    let _ = write!(
        svg,
        "<path class=\"curve\" d=\"{path}\"/><path class=\"cursor\" data-left=\"{LEFT}\" data-right=\"{RIGHT}\" \
         d=\"M{LEFT} {TOP}V{BOTTOM}\"/></svg></figure>"
    );
    svg
}

/// Extent of the data, widened to a limit that is near.
fn range(curve: &Curve<'_>) -> (f64, f64) {
    let low = curve.values.iter().copied().fold(f64::INFINITY, f64::min).min(f64::MAX);
    let high = curve.values.iter().copied().fold(f64::NEG_INFINITY, f64::max).max(f64::MIN);
    let (mut bottom, mut top) = if low <= high { (low, high) } else { (0.0, 0.0) };
    if let Some((lower, upper)) = curve.limits {
        let middle = 0.5 * (lower + upper);
        if top - middle >= SHOW_LIMIT_FROM * (upper - middle) {
            top = top.max(upper);
        }
        if middle - bottom >= SHOW_LIMIT_FROM * (middle - lower) {
            bottom = bottom.min(lower);
        }
    }
    let margin = (0.06 * (top - bottom)).max(1e-6 * top.abs().max(bottom.abs())).max(1e-3);
    (bottom - margin, top + margin)
}

/// In words: the limits, and how much of them is used.
fn use_of_limits(curve: &Curve<'_>) -> String {
    let Some((lower, upper)) = curve.limits else { return "no limit given".to_owned() };
    let low = curve.values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = curve.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if curve.values.is_empty() {
        return String::new();
    }
    if high > upper || low < lower {
        return "<b class=\"bad\">passes the limit</b>".to_owned();
    }
    if curve.title == "speed" {
        let share = 100.0 * high.max(-low) / upper.max(f64::MIN_POSITIVE);
        return format!("peak {} % of {}", number(share, 0), number(upper, 0));
    }
    format!("{} … {} in {} … {}", number(low, 1), number(high, 1), number(lower, 0), number(upper, 0))
}

/// Round values inside a range, about `wanted` of them, with their labels.
fn ticks(low: f64, high: f64, wanted: usize) -> Vec<(f64, String)> {
    let raw = (high - low) / wanted as f64;
    let power = 10f64.powf(raw.log10().floor());
    let step = power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| m * power >= raw * 0.999).unwrap_or(10.0);
    let decimals = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    let first = (low / step).ceil();
    (0..=2 * wanted)
        .map(|i| (first + i as f64) * step)
        .take_while(|v| *v <= high)
        .map(|v| (v, number(v, decimals)))
        .collect()
}

/// First, lowest, highest and last sample of each column of the picture: looks the same, whatever the number of
/// samples.
fn thinned(times: &[f64], values: &[f64], columns: usize) -> Vec<(f64, f64)> {
    let pairs = || times.iter().copied().zip(values.iter().copied());
    let count = times.len().min(values.len());
    if count <= 4 * columns {
        return pairs().collect();
    }
    let (start, end) = (times[0], times[count - 1]);
    let column = |t: f64| ((t - start) / (end - start).max(1e-9) * columns as f64) as usize;
    let all: Vec<_> = pairs().collect();
    let mut kept = Vec::with_capacity(4 * columns);
    for group in all.chunk_by(|a, b| column(a.0) == column(b.0)) {
        let extreme = |wanted: fn(f64, f64) -> bool| {
            (1..group.len()).fold(0, |best, i| if wanted(group[i].1, group[best].1) { i } else { best })
        };
        let mut chosen = [0, extreme(|a, b| a < b), extreme(|a, b| a > b), group.len() - 1];
        chosen.sort_unstable();
        let mut last = None;
        for index in chosen.into_iter().filter(|i| last.replace(*i) != Some(*i)) {
            kept.push(group[index]);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let labels = |low, high| ticks(low, high, 4).into_iter().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(labels(-0.3, 9.7), ["0", "5"]);
        assert_eq!(labels(0.0, 0.4), ["0.0", "0.1", "0.2", "0.3", "0.4"]);
        assert_eq!(labels(-120.0, 130.0), ["\u{2212}100", "0", "100"]);
    }

    #[test]
    fn thinning_keeps_the_extremes_and_the_order() {
        let times: Vec<f64> = (0..50_000).map(|i| f64::from(i) * 0.01).collect();
        let mut values: Vec<f64> = times.iter().map(|t| (t * 0.05).sin()).collect();
        values[31_234] = 7.0;
        values[12] = -9.0;
        let kept = thinned(&times, &values, 500);
        assert!(kept.len() <= 2004);
        assert!(kept.contains(&(times[31_234], 7.0)) && kept.contains(&(times[12], -9.0)));
        assert!(kept.windows(2).all(|w| w[0].0 <= w[1].0));
    }

    #[test]
    fn a_near_limit_is_drawn_and_a_passed_one_is_named() {
        let track = |peak: f64| AxisTrack {
            kind: TrackKind::Axis,
            name: "A".into(),
            unit: "deg".into(),
            position: vec![0.0, peak],
            speed: vec![0.0, 1.0],
            travel: Some((-30.0, 30.0)),
            max_speed: Some(1000.0),
        };
        let near = axis_figure(&[0.0, 1.0], &track(20.0));
        assert_eq!(near.matches("class=\"limit\"").count(), 1);
        assert!(near.contains("peak 0 % of 1000"));
        assert!(axis_figure(&[0.0, 1.0], &track(31.0)).contains("passes the limit"));
        assert!(!axis_figure(&[], &AxisTrack::default()).contains("NaN"));
    }
}
