//! Base points on the guiding curves and the grid of points m that describes all strips at once (Rajain 2023, sections
//! 5 and 6, equations 7 to 10). Uses `diagnostic`, `geometry` and the rest of this method.
//!
//! Rows are guiding curves, from the tip's side to the spindle's side; columns are positions of the tool, cut by normal
//! planes. Strips may differ in length (Remarks 1 and 3): each has its own range of columns.

use super::guide::{Guide, GuidePoint};
use super::sheet::{Place, inside};
use super::spheres::Cone;
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Point, Vector};
use std::collections::BTreeMap;
use std::ops::Range;

/// Columns that each strip goes on past the surface at either end, so that its envelope leaves the surface.
const OVERRUN: i64 = 3;
/// Most positions of the tool in one strip.
const MOST_COLUMNS: i64 = 1500;
/// Places on a ruling that tell whether it lies over the surface.
const ACROSS: usize = 9;

/// How the guiding curves are laid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Laying {
    /// Distance of neighbouring curves, mm: `sqrt(L^2 - (r2 - r1)^2)`.
    pub(super) distance: f64,
    /// Number of strips; as many as cover the surface when left out.
    pub(super) strips: Option<usize>,
    /// Chord between neighbouring base points, mm.
    pub(super) step: f64,
    /// True: the cut runs so that it is climb milling.
    pub(super) forward: bool,
}

/// A point of the grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct GridPoint {
    /// m, mm.
    pub(super) m: Point,
    /// Place of its foot.
    pub(super) place: Place,
}

/// The grid.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// Grid points by row and column.
    pub(super) rows: Vec<BTreeMap<i64, GridPoint>>,
    /// Columns of each strip; strip i lies between rows i and i + 1.
    pub(super) strips: Vec<Range<i64>>,
}

type Row = BTreeMap<i64, GuidePoint>;

impl Grid {
    /// Lays the guiding curves, cuts them by normal planes, and lifts the base points to the offset of the mean radius.
    pub(super) fn new(guide: &Guide<'_>, laying: &Laying, cone: &Cone) -> Result<Self> {
        let levels = levels(guide.range(), laying);
        let rows = base_points(guide, &levels, laying)?;
        let strips: Vec<Range<i64>> = rows.windows(2).map(|pair| columns_over(&pair[0], &pair[1])).collect();
        if let Some(i) = strips.iter().position(|range| range.end - range.start < 4) {
            return Err(Diagnostic::error(format!(
                "strip {} of {} finds no room: its guiding curves do not run side by side over the surface",
                i + 1,
                strips.len()
            ))
            .help("use fewer strips, a smaller [strategy.rajain] step, or another direction"));
        }
        // Equations 7 to 9: on the normal, half way between the end spheres' centres.
        let lifted = |point: &GuidePoint| GridPoint {
            m: point.frame.point + point.frame.normal * (0.5 * (cone.r1 + cone.r2)),
            place: point.frame.place,
        };
        let used = |row: usize, column: i64| {
            let below = row.checked_sub(1).and_then(|i| strips.get(i));
            [below, strips.get(row)].into_iter().flatten().any(|range| range.contains(&column))
        };
        let rows = rows
            .iter()
            .enumerate()
            .map(|(i, row)| row.iter().filter(|(j, _)| used(i, **j)).map(|(j, point)| (*j, lifted(point))).collect());
        Ok(Self { rows: rows.collect(), strips })
    }
}

/// Levels of G for the guiding curves: `distance` apart, in the middle of the surface's range.
fn levels((low, high): (f64, f64), laying: &Laying) -> Vec<f64> {
    // A millionth less than a whole strip more is no reason for another one.
    let enough = ((high - low) / laying.distance - 1e-6).ceil().max(1.0) as usize;
    let count = laying.strips.unwrap_or(enough);
    let first = 0.5 * (low + high) - 0.5 * laying.distance * count as f64;
    (0..=count).map(|i| first + laying.distance * i as f64).collect()
}

/// Base points on every curve: equal chords on the middle one, then normal planes from curve to curve (Fig. 10).
fn base_points(guide: &Guide<'_>, levels: &[f64], laying: &Laying) -> Result<Vec<Row>> {
    let seed = levels.len() / 2;
    let mut rows: Vec<Row> = vec![Row::new(); levels.len()];
    rows[seed] = seed_row(guide, levels[seed], laying)?;
    for i in seed + 1..levels.len() {
        spread(guide, levels, &mut rows, (i - 1, i), laying);
    }
    for i in (0..seed).rev() {
        spread(guide, levels, &mut rows, (i + 1, i), laying);
    }
    Ok(rows)
}

/// Base points of the first curve at equal chords, as far as G is known both ways.
fn seed_row(guide: &Guide<'_>, level: f64, laying: &Laying) -> Result<Row> {
    let steps = 40;
    let at = |k: i32| f64::from(k) / f64::from(steps);
    let places = (0..=steps).flat_map(|i| (0..=steps).map(move |j| (i, j))).map(|(i, j)| (at(i), at(j)));
    // The nearest to the level; among equals the nearest to the surface's middle.
    let rank = |p: &Place| (guide.level(*p) - level).abs() + 0.05 * laying.distance * (p.0 - 0.5).hypot(p.1 - 0.5);
    let start = places.min_by(|a, b| rank(a).total_cmp(&rank(b)));
    let Some(start) = start.and_then(|place| guide.onto(place, level, laying.forward)) else {
        return Err(Diagnostic::error("no guiding curve runs over the surface")
            .help("use another direction, or fewer strips with a longer tool"));
    };
    let mut row = Row::from([(0, start)]);
    extend(guide, level, &mut row, laying)?;
    Ok(row)
}

/// Goes on at both ends of a row by equal chords.
fn extend(guide: &Guide<'_>, level: f64, row: &mut Row, laying: &Laying) -> Result<()> {
    for sense in [1, -1] {
        loop {
            let end = if sense > 0 { row.last_key_value() } else { row.first_key_value() };
            let Some((column, point)) = end.map(|(j, p)| (*j, *p)) else { return Ok(()) };
            if column.abs() > MOST_COLUMNS {
                return Err(Diagnostic::error(format!(
                    "a strip needs more than {MOST_COLUMNS} positions at steps of {} mm",
                    laying.step
                ))
                .help("give a longer [strategy.rajain] step"));
            }
            match guide.next(&point, level, laying.step * sense as f64, laying.forward) {
                // A curve that comes back is closed or turns in the margin.
                Some(next) if next.tangent.dot(&point.tangent) > 0.0 => row.insert(column + sense, next),
                _ => break,
            };
        }
    }
    Ok(())
}

/// Carries the columns of one row to its neighbour by normal planes, goes on at the neighbour's ends where it is longer
/// (Remark 1), and carries what was added back.
fn spread(guide: &Guide<'_>, levels: &[f64], rows: &mut [Row], (from, to): (usize, usize), laying: &Laying) {
    let carried = |source: &Row, known: &Row, level: f64, across: f64| -> Row {
        let missing = source.iter().filter(|(j, _)| !known.contains_key(j));
        missing.filter_map(|(j, point)| Some((*j, carry(guide, point, level, across, laying)?))).collect()
    };
    let across = levels[to] - levels[from];
    let mut row = contiguous(carried(&rows[from], &Row::new(), levels[to], across));
    // More positions than allowed are cut off: the seed row refused them already where it matters.
    let _full = extend(guide, levels[to], &mut row, laying);
    let back = carried(&row, &rows[from], levels[from], -across);
    rows[from].extend(back);
    rows[from] = contiguous(std::mem::take(&mut rows[from]));
    rows[to] = row;
}

/// The base point on the neighbouring curve in the normal plane of `point`, `across` mm on.
fn carry(guide: &Guide<'_>, point: &GuidePoint, level: f64, across: f64, laying: &Laying) -> Option<GuidePoint> {
    // Toward growing G: n x tangent is against it when the cut runs forward.
    let side: Vector = point.tangent.cross(&point.frame.normal) * if laying.forward { 1.0 } else { -1.0 };
    let move_by = point.frame.components(&(side * across))?;
    let start = (point.frame.place.0 + move_by.x, point.frame.place.1 + move_by.y);
    let found = guide.crossing(start, level, &point.frame.point, &point.tangent, laying.forward)?;
    // Another branch of the curve is no neighbour.
    let near = (found.frame.point - point.frame.point).norm() < 3.0 * across.abs();
    (near && found.tangent.dot(&point.tangent) > 0.2).then_some(found)
}

/// The longest run of columns without a gap.
fn contiguous(row: Row) -> Row {
    let (mut best, mut run): (Row, Row) = (Row::new(), Row::new());
    for (j, point) in row {
        if run.last_key_value().is_some_and(|(last, _)| last + 1 != j) {
            if run.len() > best.len() {
                best = std::mem::take(&mut run);
            } else {
                run.clear();
            }
        }
        run.insert(j, point);
    }
    if run.len() > best.len() { run } else { best }
}

/// Columns whose ruling lies over the surface somewhere, and a few more at both ends.
fn columns_over(low: &Row, high: &Row) -> Range<i64> {
    let over = |j: &i64| -> bool {
        let (Some(a), Some(b)) = (low.get(j), high.get(j)) else { return false };
        (0..ACROSS).any(|k| {
            let s = k as f64 / (ACROSS - 1) as f64;
            let mix = |a: f64, b: f64| a + (b - a) * s;
            inside((mix(a.frame.place.0, b.frame.place.0), mix(a.frame.place.1, b.frame.place.1)))
        })
    };
    let both = |j: &i64| low.contains_key(j) && high.contains_key(j);
    let touching: Vec<i64> = low.keys().copied().filter(over).collect();
    let (Some(first), Some(last)) = (touching.first(), touching.last()) else { return 0..0 };
    let start = (1..=OVERRUN).map(|k| first - k).take_while(both).last().unwrap_or(*first);
    let end = (1..=OVERRUN).map(|k| last + k).take_while(both).last().unwrap_or(*last);
    start..end + 1
}

#[cfg(test)]
mod tests {
    use super::super::field::{Source, Wish};
    use super::super::fixtures::{graph, saddle};
    use super::super::sheet::Sheet;
    use super::*;

    const CONE: Cone = Cone { r1: 0.3, r2: 1.0, length: 1.717 };

    fn grid(spline: &crate::part::OrientedSpline, direction: Vector, strips: Option<usize>) -> (Grid, f64) {
        let wish = Wish { source: Source::Vector(direction), toward: Vector::y() };
        let guide = Guide::new(Sheet::new(spline), &wish, 5.0).unwrap();
        let distance = CONE.distance();
        let laying = Laying { distance, strips, step: 0.3, forward: true };
        (Grid::new(&guide, &laying, &CONE).unwrap(), distance)
    }

    #[test]
    fn on_a_plane_the_grid_is_square_and_lies_on_the_offset_of_the_mean_radius() {
        let plane = graph(20.0, 6.0, |_, _| 0.0);
        let (grid, distance) = grid(&plane, Vector::x(), None);
        assert_eq!(grid.strips.len(), (6.0 / distance).ceil() as usize);
        for (i, range) in grid.strips.iter().enumerate() {
            for j in range.clone() {
                let (a, b) = (grid.rows[i][&j].m, grid.rows[i + 1][&j].m);
                assert!((a.x - b.x).abs() < 1e-6 && (b.y - a.y - distance).abs() < 1e-5, "{a} {b}");
                assert!((a.z - 0.65).abs() < 1e-12);
            }
            // Past both ends of the surface.
            assert!(grid.rows[i][&range.start].m.x.abs() > 10.0 && grid.rows[i][&(range.end - 1)].m.x.abs() > 10.0);
        }
    }

    #[test]
    fn neighbouring_base_points_lie_in_normal_planes_and_strips_differ_in_length() {
        let spline = saddle();
        let (grid, _) = grid(&spline, Vector::new(1.0, 0.6, 0.0), None);
        let lengths: Vec<i64> = grid.strips.iter().map(|r| r.end - r.start).collect();
        assert!(lengths.iter().max() > lengths.iter().min(), "{lengths:?}");
        for (i, range) in grid.strips.iter().enumerate() {
            for j in range.start + 1..range.end - 1 {
                let row = &grid.rows[i];
                let tangent = (row[&(j + 1)].m - row[&(j - 1)].m).normalize();
                let across = (grid.rows[i + 1][&j].m - row[&j].m).normalize();
                assert!(tangent.dot(&across).abs() < 0.05, "{i} {j}");
            }
        }
    }
}
