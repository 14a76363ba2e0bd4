//! Puts the page together: the fixed template, style and script of `page/` with the data's text, plots and numbers.

use super::data::{Figure, ReportData, SlowRow, StripRow};
use super::encode::{escape, number};
use super::legend::legend;
use super::payload::payload;
use super::plot::axis_figure;

const TEMPLATE: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");
const SCRIPT: [&str; 8] = [
    include_str!("page/vectors.js"),
    include_str!("page/shaders.js"),
    include_str!("page/bodies.js"),
    include_str!("page/scene.js"),
    include_str!("page/camera.js"),
    include_str!("page/pick.js"),
    include_str!("page/timeline.js"),
    include_str!("page/main.js"),
];

/// Figures shown large above the view, at most.
const TILES: usize = 4;

/// The page. The data are checked already.
pub(super) fn page(data: &ReportData) -> String {
    let (word, class, mark) = if data.verdict.pass {
        ("Pass", "pass", "M3 8.5l3.5 3.5L13 4.5")
    } else {
        ("Fail", "fail", "M4 4l8 8M12 4l-8 8")
    };
    let hidden = |hide: bool| if hide { " hidden" } else { "" }.to_owned();
    fill(TEMPLATE, |key| match key {
        "name" => escape(&data.name),
        "verdict_word" => word.to_owned(),
        "verdict_class" => class.to_owned(),
        "verdict_mark" => mark.to_owned(),
        "style" => STYLE.to_owned(),
        "script" => SCRIPT.concat(),
        "data" => payload(data),
        "reasons" => list("<ul class=\"reasons\">", data.verdict.reasons.iter().map(|r| escape(r)), "</ul>"),
        "facts" => data
            .facts
            .iter()
            .map(|(label, value)| format!("<div><dt>{}</dt><dd>{}</dd></div>", escape(label), escape(value)))
            .collect(),
        "tiles" => data.figures.iter().filter(|f| f.limit.is_some()).take(TILES).map(tile).collect(),
        "part_hidden" => hidden(data.part.is_none()),
        "surroundings_hidden" => hidden(data.surroundings.is_empty()),
        "fixtures_hidden" => hidden(!data.bodies.iter().any(|body| body.fixture)),
        "machine_hidden" => hidden(!data.bodies.iter().any(|body| !body.fixture)),
        "all_hidden" => hidden(data.bodies.is_empty()),
        "legend" => data.part.as_ref().map(legend).unwrap_or_default(),
        "findings" => findings(data),
        "axes" => axes(data),
        "strips" => strips(data),
        "slow" => slow(data),
        "figures" => data.figures.iter().map(row).collect(),
        "hash" if data.input_hash.is_empty() => String::new(),
        "hash" => format!(" Input {}.", escape(&data.input_hash)),
        _ => String::new(),
    })
}

/// Replaces each `{{key}}` of the template in one pass, so that inserted text is never expanded again.
fn fill(template: &str, value: impl Fn(&str) -> String) -> String {
    let mut out = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let Some((key, tail)) = after.split_once("}}") else { break };
        out.push_str(before);
        out.push_str(&value(key));
        rest = tail;
    }
    out + rest
}

/// List items between an opening and a closing tag; nothing where there are no items.
fn list(open: &str, items: impl Iterator<Item = String>, close: &str) -> String {
    let items: String = items.map(|item| format!("<li>{item}</li>")).collect();
    if items.is_empty() { items } else { format!("{open}{items}{close}") }
}

fn tile(figure: &Figure) -> String {
    let limit = figure.limit.unwrap_or_default();
    let share = if limit == 0.0 { f64::from(u8::from(figure.value != 0.0)) } else { figure.value / limit };
    format!(
        "<article class=\"tile{}\"><h3>{}</h3><p>{} <small>{}</small></p><span class=\"gauge\"><i style=\"width:{:.1}%\">\
         </i></span><div>limit {} {}</div></article>",
        if figure.ok == Some(false) { " failed" } else { "" },
        escape(&figure.label),
        number(figure.value, figure.decimals),
        escape(&figure.unit),
        100.0 * share.clamp(0.0, 1.0),
        number(limit, figure.decimals),
        escape(&figure.unit),
    )
}

fn row(figure: &Figure) -> String {
    let judged = match figure.ok {
        Some(true) => "<span class=\"kept\">\u{2713} kept</span>",
        Some(false) => "<span class=\"missed\">\u{2717} missed</span>",
        None => "",
    };
    format!(
        "<tr><td>{}</td><td class=\"num\">{}</td><td class=\"num\">{}</td><td class=\"unit\">{}</td><td>{judged}</td></tr>",
        escape(&figure.label),
        number(figure.value, figure.decimals),
        figure.limit.map_or(String::new(), |l| number(l, figure.decimals)),
        escape(&figure.unit),
    )
}

/// The strips as planned, with what limits each; nothing where no plan is known.
fn strips(data: &ReportData) -> String {
    if data.strips.is_empty() {
        return String::new();
    }
    let heads: String =
        ["Strip", "Overcut", "Undercut", "Kink, largest", "mean", "Length", "Engaged", "Steps", "Curvature alone"]
            .iter()
            .map(|head| format!("<th scope=\"col\" class=\"num\">{head}</th>"))
            .collect();
    let rows: String = data.strips.iter().enumerate().map(|(i, strip)| strip_row(i, strip)).collect();
    let advice = list("<p>Would help:</p><ul class=\"advice\">", data.advice.iter().map(|a| escape(a)), "</ul>");
    format!(
        "<section class=\"card\"><h2>Strips as planned <small>mm, degrees</small></h2><div class=\"scroll\"><table class=\"strips\"><thead><tr>{heads}\
         <th scope=\"col\">Limited by</th></tr></thead><tbody>{rows}</tbody></table></div>{advice}</section>"
    )
}

fn strip_row(index: usize, strip: &StripRow) -> String {
    let cell = |text: String| format!("<td class=\"num\">{text}</td>");
    let kink = |value: Option<f64>| cell(value.map_or("\u{2013}".to_owned(), |k| number(k, 3)));
    let cells = [
        cell(index.to_string()),
        cell(number(strip.overcut, 5)),
        cell(number(strip.undercut, 5)),
        kink(strip.kink.map(|k| k.0)),
        kink(strip.kink.map(|k| k.1)),
        cell(number(strip.length, 1)),
        cell(number(strip.engagement, 2)),
        cell(strip.steps.to_string()),
        cell(number(strip.curvature_error, 5)),
    ];
    format!("<tr>{}<td>{}</td></tr>", cells.concat(), escape(&strip.limited_by))
}

/// Where the feed is lost, and to what; nothing where it is kept.
fn slow(data: &ReportData) -> String {
    if data.slow.is_empty() {
        return String::new();
    }
    let row = |row: &SlowRow| {
        let cell = |text: String| format!("<td class=\"num\">{text}</td>");
        let line = |line: usize| format!("<button type=\"button\" data-line=\"{line}\">{line}</button>");
        let numbers = [
            cell(format!("{} \u{2013} {}", line(row.lines.0), line(row.lines.1))),
            cell(number(row.lost, 3)),
            cell(number(row.feed, 0)),
            cell(number(row.usual_feed, 0)),
        ];
        format!("<tr>{}<td>{}</td></tr>", numbers.concat(), escape(&row.cause))
    };
    let rows: String = data.slow.iter().map(row).collect();
    let heads = ["Lines", "Lost", "Lowest feed", "Usual feed"]
        .map(|head| format!("<th scope=\"col\" class=\"num\">{head}</th>"))
        .concat();
    format!(
        "<section class=\"card\"><h2>Where feed is lost <small>s, mm/min at the tip</small></h2><div class=\"scroll\">\
         <table class=\"strips\"><thead><tr>{heads}<th scope=\"col\">Nearest limit</th></tr></thead><tbody>{rows}</tbody>\
         </table></div></section>"
    )
}

fn findings(data: &ReportData) -> String {
    let items = data.findings.iter().map(|finding| {
        let place =
            finding.line.map_or(String::new(), |l| format!("<button type=\"button\" data-line=\"{l}\">{l}</button>"));
        let code = match (finding.code.as_str(), finding.error) {
            ("", _) => String::new(),
            (code, true) => format!("<b class=\"error\">{}</b> ", escape(code)),
            (code, false) => format!("<b>{}</b> ", escape(code)),
        };
        let help =
            if finding.help.is_empty() { String::new() } else { format!("<small>{}</small>", escape(&finding.help)) };
        place + &code + &escape(&finding.text) + &help
    });
    let list = list("<ol>", items, "</ol>");
    let body = if list.is_empty() { "<p class=\"none\">Nothing found.</p>".to_owned() } else { list };
    format!("<section class=\"card findings\"><h2>Findings <small>{}</small></h2>{body}</section>", data.findings.len())
}

fn axes(data: &ReportData) -> String {
    if data.timeline.axes.is_empty() {
        return String::new();
    }
    let times: Vec<f64> = data.timeline.samples.iter().map(|s| s.time).collect();
    let plots: String = data.timeline.axes.iter().map(|track| axis_figure(&times, track)).collect();
    format!("<section class=\"card\"><h2>Axes over time</h2><div class=\"axes\">{plots}</div></section>")
}
