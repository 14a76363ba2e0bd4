//! What others see of a judged program. One self-contained HTML page on a job: verdict, 3D view of part and tool, plots of
//! the axes, figures, findings; and the findings alone for other programs, as SARIF and JUnit.
//!
//! The page needs no network and no library. Uses `geometry`, `tool`, `nc` and `verify`.

mod body;
mod colour;
mod data;
mod encode;
mod legend;
mod page;
mod payload;
mod plot;
mod sarif;

pub use data::{
    AxisTrack, BodyView, Figure, Finding, LinkTrack, Mesh, PartView, ProfileSection, ReportData, ReportError, Ruling,
    SlowRow, StripRow, Timeline, ToolSample, TrackKind, Verdict, tool_outline,
};

pub use sarif::{junit, sarif};

/// The page as text; the same data give the same bytes. Refuses data that are not finite or do not fit together.
pub fn html(data: &ReportData) -> Result<String, ReportError> {
    data.check()?;
    Ok(page::page(data))
}

#[cfg(test)]
mod tests;
