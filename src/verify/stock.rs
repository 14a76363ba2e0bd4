//! What a program does to the stock, as figures and findings. Uses `stock` and the other files of this module.

use super::findings::sorted;
use super::judge::Verified;
use super::record::{FindingRecord, StockRecord, Verdict};
use crate::nc::FindingCode;
use crate::stock::{Block, Cut, Engagement, Moves, Removal, Stock};

/// Stretches of one kind that are listed one by one.
const LISTED: usize = 50;

/// What is asked of a program's way through the stock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StockLimits {
    /// Fastest feed of the tip in material, mm/min.
    pub feed: Option<f64>,
    /// Highest removal rate of a move, cm^3/min.
    pub removal: Option<f64>,
    /// Widest engagement of the flutes, degrees.
    pub engagement_deg: Option<f64>,
    /// How deep a rapid, the shank or the holder may be in material, mm: rubbing, as rounding and springing back leave it.
    pub rubbing: f64,
    /// Material thinner than this is none to a move at a feed, mm.
    pub contact: f64,
}

/// A program's way through the stock.
#[derive(Clone, Debug)]
pub struct Milled {
    /// What is left.
    pub stock: Stock,
    /// The moves.
    pub moves: Moves,
    /// What they took.
    pub cut: Cut,
    /// The figures.
    pub record: StockRecord,
    /// What is wrong.
    pub findings: Vec<FindingRecord>,
}

/// Removal rate of a move, cm^3/min.
pub fn removal_rate(block: &Block, removal: &Removal) -> f64 {
    // mm^3/s to cm^3/min.
    if block.duration > 0.0 { removal.volume / block.duration * 0.06 } else { 0.0 }
}

/// Feed of the tip, mm/min.
fn feed(block: &Block) -> f64 {
    if block.duration > 0.0 { block.length / block.duration * 60.0 } else { 0.0 }
}

impl Milled {
    /// Judges a cut: `volume` is that of the stock before it, mm^3.
    pub fn new(stock: Stock, moves: Moves, cut: Cut, volume: f64, limits: &StockLimits) -> Self {
        let record = record(&stock, &moves, &cut, volume, limits);
        let findings = findings(&moves.blocks, &cut, limits);
        Self { stock, moves, cut, record, findings }
    }
}

impl Verified {
    /// Takes the way through the stock into record and verdict.
    #[must_use]
    pub fn with_stock(mut self, milled: &Milled) -> Self {
        let record = &mut self.record;
        record.stock = Some(milled.record);
        let mut said = Vec::new();
        for finding in milled.findings.iter().filter(|finding| finding.is_error()) {
            if !said.contains(&finding.id) {
                said.push(finding.id);
                let line = finding.line.map_or(String::new(), |line| format!("line {line}: "));
                record.reasons.push(format!("{line}{}", finding.message));
                record.verdict = Verdict::Fail;
            }
        }
        let mut all = std::mem::take(&mut record.findings);
        all.extend(milled.findings.iter().cloned());
        record.findings = sorted(all);
        self
    }
}

fn record(stock: &Stock, moves: &Moves, cut: &Cut, volume: f64, limits: &StockLimits) -> StockRecord {
    let moved = || moves.blocks.iter().zip(&cut.removals);
    // Not `sum`, which makes -0 of nothing.
    let sum = |wanted: bool| moved().filter(|(b, _)| b.rapid == wanted).fold(0.0, |sum, (_, r)| sum + r.volume);
    let time = |wanted: &dyn Fn(&Removal) -> bool| {
        moved().filter(|(b, r)| !b.rapid && wanted(r)).fold(0.0, |sum, (b, _)| sum + b.duration)
    };
    let (all, air) = (time(&|_| true), time(&|r| r.depth <= limits.contact));
    let rated = moved().filter(|(b, _)| !b.rapid).map(|(b, r)| (removal_rate(b, r), b.line));
    let fastest = rated.reduce(|a, b| if b.0 > a.0 { b } else { a }).filter(|(rate, _)| *rate > 0.0);
    let widest = cut.engagements.iter().reduce(|a, b| if b.angle > a.angle { b } else { a }).filter(|e| e.angle > 0.0);
    StockRecord {
        cell_mm: stock.cell(),
        lines: stock.lines(),
        volume_before_mm3: volume,
        volume_after_mm3: stock.volume(),
        removed_mm3: sum(false),
        removed_by_rapids_mm3: sum(true),
        removed_by_body_mm3: cut.removals.iter().fold(0.0, |sum, r| sum + r.body_volume),
        air_share: if all > 0.0 { air / all } else { 0.0 },
        removal_max_cm3_min: fastest.map_or(0.0, |(rate, _)| rate),
        removal_max_line: fastest.map(|(_, line)| line),
        engagement_max_deg: widest.map_or(0.0, |e| e.angle.to_degrees()),
        engagement_max_line: widest.and_then(|e| moves.blocks.get(e.block)).map(|block| block.line),
    }
}

/// Moves in which blocks do what they must not, each by the first line that does, with the worst of the move.
fn findings(blocks: &[Block], cut: &Cut, limits: &StockLimits) -> Vec<FindingRecord> {
    let in_material = |r: &Removal| r.depth > limits.contact;
    let moves = moves(blocks);
    let of_blocks = |value: &dyn Fn(&Block, &Removal) -> f64, limit: f64| {
        let values = blocks.iter().zip(&cut.removals).map(|(b, r)| value(b, r));
        rows(&moves, values.enumerate().filter(|(_, value)| *value > limit))
    };
    let line = |block: usize| blocks.get(block).map_or(0, |block| block.line);
    let mut found = Vec::new();
    let mut say = |code: FindingCode, row: &Row, text: String| {
        let worst = line(row.worst);
        let at = if row.first == row.last {
            String::new()
        } else {
            format!(" on line {worst}, the worst of lines {} to {}", line(row.first), line(row.last))
        };
        found.push(FindingRecord::new(code, Some(line(row.first)), text + &at));
    };
    for row in of_blocks(&|b, r| if b.rapid { r.depth } else { 0.0 }, limits.rubbing) {
        say(FindingCode::RapidInStock, &row, format!("a rapid goes {:.4} mm through the stock", row.value));
    }
    for row in of_blocks(&|_, r| r.body_depth, limits.rubbing) {
        let holder = cut.removals.get(row.worst).is_some_and(|r| r.holder);
        let body = if holder { "holder" } else { "shank" };
        say(FindingCode::BodyInStock, &row, format!("the {body} is {:.4} mm in the stock", row.value));
    }
    if let Some(limit) = limits.feed {
        for row in of_blocks(&|b, r| if !b.rapid && in_material(r) { feed(b) } else { 0.0 }, limit) {
            let text = format!("the tip feeds through material at {:.0} mm/min, {limit} are allowed", row.value);
            say(FindingCode::FeedInStock, &row, text);
        }
    }
    if let Some(limit) = limits.removal {
        for row in of_blocks(&|b, r| if b.rapid { 0.0 } else { removal_rate(b, r) }, limit) {
            let text = format!("{:.3} cm³/min are removed, {limit} are allowed", row.value);
            say(FindingCode::RemovalRate, &row, text);
        }
    }
    if let Some(limit) = limits.engagement_deg {
        let wide = |e: &&Engagement| e.angle.to_degrees() > limit;
        for row in rows(&moves, cut.engagements.iter().filter(wide).map(|e| (e.block, e.angle.to_degrees()))) {
            let text = format!("the flutes are engaged over {:.0} degrees, {limit} are allowed", row.value);
            say(FindingCode::Engagement, &row, text);
        }
    }
    found
}

/// The number of the move that each block belongs to: rapids without a feed between them, or the other way round.
fn moves(blocks: &[Block]) -> Vec<usize> {
    let runs = blocks.chunk_by(|a, b| a.rapid == b.rapid).enumerate();
    runs.flat_map(|(index, run)| std::iter::repeat_n(index, run.len())).collect()
}

/// Blocks of one move.
struct Row {
    first: usize,
    last: usize,
    worst: usize,
    value: f64,
}

/// Joins blocks of one move, with gaps or without: what rubs comes and goes. Of many rows, the first ones.
fn rows(moves: &[usize], values: impl Iterator<Item = (usize, f64)>) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for (block, value) in values {
        match rows.last_mut().filter(|row| moves.get(row.last) == moves.get(block)) {
            Some(row) => {
                row.last = block;
                if value > row.value {
                    (row.worst, row.value) = (block, value);
                }
            }
            None => rows.push(Row { first: block, last: block, worst: block, value }),
        }
    }
    rows.truncate(LISTED);
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(line: usize, rapid: bool, length: f64) -> Block {
        Block { line, rapid, start: 0.0, duration: 1.0, length }
    }

    fn took(volume: f64, depth: f64) -> Removal {
        Removal { volume, depth, ..Removal::default() }
    }

    const LIMITS: StockLimits = StockLimits {
        feed: Some(1200.0),
        removal: Some(1.0),
        engagement_deg: Some(90.0),
        rubbing: 0.01,
        contact: 1e-3,
    };

    fn codes(blocks: &[Block], cut: &Cut) -> Vec<(&'static str, Option<usize>)> {
        findings(blocks, cut, &LIMITS).iter().map(|f| (f.code, f.line)).collect()
    }

    #[test]
    fn every_limit_has_its_finding_with_its_line() {
        let blocks = [block(3, true, 9.0), block(5, false, 30.0), block(7, false, 10.0), block(8, false, 30.0)];
        let removals = vec![took(1.0, 0.5), took(2.0, 0.5), took(20.0, 0.5), took(0.0, 0.0)];
        let wide = Engagement { block: 2, time: 2.5, angle: 2.0 };
        let cut = Cut { removals, engagements: vec![wide] };
        assert_eq!(
            codes(&blocks, &cut),
            [
                ("rapid-in-stock", Some(3)),
                ("feed-in-stock", Some(5)),
                ("removal-rate", Some(7)),
                ("engagement", Some(7))
            ]
        );
        // 20 mm^3 in a second are 1.2 cm^3/min.
        assert!((removal_rate(&blocks[2], &cut.removals[2]) - 1.2).abs() < 1e-12);
    }

    #[test]
    fn rubbing_is_nothing_and_a_move_is_one_row() {
        let rapid = |line: usize| block(line, line != 7, 5.0);
        let blocks: Vec<Block> = (1..=9).map(rapid).collect();
        // Lines 2 to 5 belong to one move although line 4 is clear; the feed on line 7 parts it from line 8.
        let depths = [0.009, 0.1, 0.3, 0.0, 0.2, 0.009, 0.4, 0.1, 0.0];
        let cut = Cut { removals: depths.map(|depth| took(1.0, depth)).to_vec(), engagements: Vec::new() };
        let found = findings(&blocks, &cut, &LIMITS);
        assert_eq!(found.iter().map(|f| f.line).collect::<Vec<_>>(), [Some(2), Some(8)]);
        assert_eq!(found[0].message, "a rapid goes 0.3000 mm through the stock on line 3, the worst of lines 2 to 5");
        // What may rub is said by the job, for shank and holder, too.
        let rubs = |depth| Removal { body_depth: depth, ..Removal::default() };
        let cut = Cut { removals: depths.map(rubs).to_vec(), engagements: Vec::new() };
        let lines = |rubbing| {
            let found = findings(&blocks, &cut, &StockLimits { rubbing, ..LIMITS });
            found.iter().map(|f| (f.code, f.line)).collect::<Vec<_>>()
        };
        let at = |line| ("body-in-stock", Some(line));
        assert_eq!(lines(0.01), [at(2), at(7), at(8)]);
        assert_eq!(lines(0.001), [at(1), at(7), at(8)]);
        assert_eq!(lines(0.35), [at(7)]);
    }
}
