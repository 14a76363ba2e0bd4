//! A job's stock on its way through a program.

use super::{InputFile, Inputs};
use crate::diagnostic::{Diagnostic, Result};
use crate::job::BlankSpec;
use crate::part::{DesignSurface, ReadOptions, read, require_closed};
use crate::simulate::ToolMotion;
use crate::stock::{Blank, Moves, Stock};
use crate::verify::{Milled, StockRecord, removal_rate};
use serde::Serialize;

/// Lines of a stock whose job gives no cell, about.
const LINES: f64 = 400_000.0;

/// What a program does to the stock, move by move.
#[derive(Clone, Debug, Serialize)]
pub struct StockReport {
    format: &'static str,
    version: u32,
    #[serde(flatten)]
    figures: StockRecord,
    findings: Vec<crate::verify::FindingRecord>,
    moves: Vec<MoveRecord>,
    engagement: Vec<EngagementRecord>,
}

#[derive(Clone, Debug, Serialize)]
struct MoveRecord {
    line: usize,
    rapid: bool,
    start_s: f64,
    duration_s: f64,
    removed_mm3: f64,
    removal_cm3_min: f64,
    thickness_mm: f64,
}

#[derive(Clone, Debug, Serialize)]
struct EngagementRecord {
    line: usize,
    time_s: f64,
    angle_deg: f64,
}

impl Inputs {
    /// Reads the closed mesh that the job's stock names.
    pub fn with_stock_file(self, file: InputFile<'_>) -> Result<Self> {
        let placed = ReadOptions { flip: false, ..ReadOptions::default() };
        let surface = read(file.bytes, file.name, &placed)?;
        require_closed(&surface).map_err(|e| e.in_file(file.name))?;
        let DesignSurface::Mesh(mesh) = surface else {
            return Err(Diagnostic::error("a stock is a closed mesh").in_file(file.name).help("give an .stl file"));
        };
        Ok(self.with_blank(Blank::Mesh(Box::new(mesh)), file.bytes))
    }
}

/// Takes the program's motion through the job's stock; `None` where the job has none.
pub(super) fn mill(inputs: &Inputs, motion: &ToolMotion) -> Result<Option<Milled>> {
    let Some(spec) = &inputs.job.stock else { return Ok(None) };
    let blank = match (&spec.blank, inputs.blank()) {
        (BlankSpec::Given(blank), _) | (BlankSpec::File(_), Some(blank)) => blank,
        (BlankSpec::File(file), None) => {
            let message = format!("the stock's file {file} has not been read");
            return Err(inputs.job.blame("stock.file", message).help("give its content with the job"));
        }
    };
    let tool = inputs.tool()?;
    let size = blank.bounds().high - blank.bounds().low;
    let area = size.x * size.y + size.y * size.z + size.z * size.x;
    let cell = spec.cell.unwrap_or((area / LINES).sqrt());
    let mut stock = Stock::new(blank, cell).map_err(|e| {
        let key = if spec.cell.is_some() { "stock.cell" } else { "stock" };
        inputs.job.blame(key, e.to_string()).help("write a larger `cell`, mm, or a stock with a volume")
    })?;
    let volume = stock.volume();
    let moves = Moves::of(motion, tool.flute_length());
    let cut = stock.cut(&moves, tool);
    Ok(Some(Milled::new(stock, moves, cut, volume, &spec.limits)))
}

/// Figures, findings, and the course over time.
pub fn stock_report(milled: &Milled) -> StockReport {
    let moves = milled.moves.blocks.iter().zip(&milled.cut.removals).map(|(block, removal)| MoveRecord {
        line: block.line,
        rapid: block.rapid,
        start_s: block.start,
        duration_s: block.duration,
        removed_mm3: removal.volume,
        removal_cm3_min: removal_rate(block, removal),
        thickness_mm: removal.depth,
    });
    let engagement = milled.cut.engagements.iter().map(|engagement| EngagementRecord {
        line: milled.moves.blocks.get(engagement.block).map_or(0, |block| block.line),
        time_s: engagement.time,
        angle_deg: engagement.angle.to_degrees(),
    });
    StockReport {
        format: "regulus-stock",
        version: 1,
        figures: milled.record,
        findings: milled.findings.clone(),
        moves: moves.collect(),
        engagement: engagement.collect(),
    }
}
