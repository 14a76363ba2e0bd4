//! The stock of a job: its blank and what is asked of the way through it. Uses `geometry`, `stock` and `verify`.

use super::limits::{self, Checks};
use super::raw;
use crate::geometry::{Direction, Point};
use crate::stock::Blank;
use crate::verify::StockLimits;

/// Material that is no thicker than this is none to a move at a feed, mm.
const CONTACT: f64 = 1e-3;
/// How deep a rapid, the shank or the holder may rub when the job does not say, mm: what rounded words, cells and the
/// facets of a stock's mesh leave of a surface that the tool follows.
const RUBBING: f64 = 0.01;

/// The material before the program.
#[derive(Clone, Debug)]
pub struct StockSpec {
    /// What it is.
    pub blank: BlankSpec,
    /// Distance of the lines on which the material is kept, mm; from its size when left out.
    pub cell: Option<f64>,
    /// What is asked of the way through it.
    pub limits: StockLimits,
}

/// Where the blank comes from.
#[derive(Clone, Debug)]
pub enum BlankSpec {
    /// A box or a cylinder.
    Given(Blank),
    /// File of a closed mesh, relative to the job file's folder: a body, or what another program left.
    File(String),
}

/// Checks the keys of `[stock]`.
pub(super) fn stock(checks: &mut Checks<'_>, raw: raw::Stock) -> Option<StockSpec> {
    for (key, value, limit) in [
        ("cell", raw.cell, &limits::SIZE),
        ("feed_limit", raw.feed_limit, &limits::FEED),
        ("removal_limit", raw.removal_limit, &limits::WEIGHT),
        ("engagement_limit_deg", raw.engagement_limit_deg, &limits::ANGLE),
    ] {
        if let Some(value) = value {
            checks.within(&format!("stock.{key}"), value, limit);
        }
    }
    if let Some(rubbing) = raw.rubbing {
        checks.within("stock.rubbing", rubbing, &limits::TOLERANCE);
    }
    let limits = StockLimits {
        feed: raw.feed_limit,
        removal: raw.removal_limit,
        engagement_deg: raw.engagement_limit_deg,
        rubbing: raw.rubbing.unwrap_or(RUBBING),
        contact: CONTACT,
    };
    let blank = match (raw.cuboid, raw.cylinder, raw.file) {
        (Some(given), None, None) => cuboid(checks, &given).map(BlankSpec::Given),
        (None, Some(given), None) => cylinder(checks, &given).map(BlankSpec::Given),
        (None, None, Some(file)) => Some(BlankSpec::File(checks.path("stock.file", file))),
        _ => {
            checks.refuse(
                "stock",
                "the stock is not one of box, cylinder and file",
                "write one of them, such as box = { min = [0, 0, 0], max = [60, 20, 40] }",
            );
            None
        }
    };
    Some(StockSpec { blank: blank?, cell: raw.cell, limits })
}

fn cuboid(checks: &mut Checks<'_>, raw: &raw::StockBox) -> Option<Blank> {
    checks.all_within("stock.box.min", &raw.min, &limits::COORDINATE);
    checks.all_within("stock.box.max", &raw.max, &limits::COORDINATE);
    if raw.min.iter().zip(&raw.max).any(|(min, max)| min >= max) {
        let message = format!("a box from {:?} to {:?} is empty", raw.min, raw.max);
        checks.refuse("stock.box.max", message, "write larger coordinates in `max` than in `min`");
        return None;
    }
    Some(Blank::Box { min: Point::from(raw.min), max: Point::from(raw.max) })
}

fn cylinder(checks: &mut Checks<'_>, raw: &raw::StockCylinder) -> Option<Blank> {
    checks.all_within("stock.cylinder.base", &raw.base, &limits::COORDINATE);
    checks.within("stock.cylinder.diameter", raw.diameter, &limits::SIZE);
    checks.within("stock.cylinder.height", raw.height, &limits::SIZE);
    let axis = checks.vector("stock.cylinder.axis", Some(raw.axis))?;
    let (base, axis) = (Point::from(raw.base), Direction::new_normalize(axis));
    Some(Blank::Cylinder { base, axis, radius: 0.5 * raw.diameter, height: raw.height })
}
