//! Which tool axis directions a machine makes, as a map of the sphere and as pictures of it. Uses `geometry` and
//! `motion`.
//!
//! The map has rows of equal angle from the spindle's axis, 0 to 180 degrees, and columns of equal azimuth about it, -180
//! to 180 degrees from the machine's X (Y for a spindle along X).

use super::axes::AxisPosition;
use super::model::Travel;
use super::setup::{Setup, Unreachable, unwind};
use crate::geometry::{Direction, Point, Vector};
use crate::motion::Pose;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// Rows and columns of the map.
const SIZE: (usize, usize) = (36, 72);
/// Angles tried along the one rotary axis of a four-axis machine.
const ALONG: usize = 3600;

/// How many ways lead to a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ways {
    /// The machine does not make it.
    #[default]
    None,
    /// One branch of the inverse kinematics has room for it within the limits.
    One,
    /// Both branches.
    Both,
}

/// The directions of the tool axis, part frame, that a machine makes with the rotary axes within their limits.
#[derive(Clone, Debug, PartialEq)]
pub struct ReachMap {
    /// By row, then column.
    cells: Vec<Ways>,
    /// Frame of the map: azimuth zero, azimuth 90 degrees, pole.
    frame: [Vector; 3],
    /// Directions at which the rotary axis nearer the part may stand anywhere.
    poles: Vec<Direction>,
}

/// Whether an angle fits a travel with some number of whole turns.
pub(super) fn fits(travel: Travel, angle: f64) -> bool {
    match travel {
        Travel::Unlimited | Travel::Wrapped => true,
        Travel::Limited { min, max } => travel.excess(unwind(angle, (min + max) / 2.0)) <= 1e-9,
    }
}

/// Branches of the inverse kinematics whose rotary angles fit the limits.
pub(super) fn ways(setup: &Setup, axis: Direction) -> Ways {
    let rotary = &setup.machine().rotary;
    let Ok(solutions) = setup.inverse(&Pose { tip: Point::origin(), axis }) else { return Ways::None };
    let free = |k: usize| solutions.free == Some(k);
    let within = |axes: &&AxisPosition| (0..2).all(|k| free(k) || fits(rotary[k].travel, axes.rotary[k]));
    match solutions.branches.iter().filter(within).count() {
        0 => Ways::None,
        1 => Ways::One,
        _ => Ways::Both,
    }
}

/// How far a direction of the tool axis, part frame, lies beyond what the rotary axes make within their limits, radians, and
/// which axis would have to go where; none for directions that the machine makes.
pub fn beyond(setup: &Setup, axis: Direction) -> Option<(f64, String)> {
    let rotary = &setup.machine().rotary;
    let solutions = match setup.inverse(&Pose { tip: Point::origin(), axis }) {
        Ok(solutions) => solutions,
        Err(Unreachable { axis, by }) => {
            let words = format!("axis {axis} would have to tilt it {:.2} degrees farther", by.to_degrees());
            return Some((by, words));
        }
    };
    let excess = |axes: &AxisPosition| {
        let of = |k: usize| match rotary[k].travel {
            Travel::Limited { min, max } if solutions.free != Some(k) => {
                let angle = unwind(axes.rotary[k], (min + max) / 2.0);
                let limit = angle.clamp(min, max);
                ((angle - limit).abs(), rotary[k].letter, angle, limit)
            }
            _ => (0.0, rotary[k].letter, 0.0, 0.0),
        };
        let (first, second) = (of(0), of(1));
        if first.0 >= second.0 { first } else { second }
    };
    let least = solutions.branches.iter().map(excess).min_by(|a, b| a.0.total_cmp(&b.0));
    least.filter(|(by, ..)| *by > 1e-9).map(|(by, letter, angle, limit)| {
        let [angle, limit] = [angle, limit].map(f64::to_degrees);
        (by, format!("axis {letter} would have to stand at {angle:.2} degrees, beyond its limit {limit:.2}"))
    })
}

/// The direction of the first axis of the chain and its opposite, as far as the machine makes them.
pub(super) fn poles(setup: &Setup) -> Vec<Direction> {
    let machine = setup.machine();
    let axis = &machine.rotary[machine.chain[0]];
    if !axis.is_present() {
        return Vec::new();
    }
    [axis.direction, -axis.direction].into_iter().filter(|pole| ways(setup, *pole) != Ways::None).collect()
}

impl ReachMap {
    /// Tries the middle of every cell.
    pub fn new(setup: &Setup) -> Self {
        let pole = setup.machine().spindle.axis.into_inner();
        let start = if pole.x.abs() < 0.9 { Vector::x() } else { Vector::y() };
        let side = pole.cross(&start).normalize();
        let mut map = Self {
            cells: vec![Ways::None; SIZE.0 * SIZE.1],
            frame: [side.cross(&pole), side, pole],
            poles: poles(setup),
        };
        match setup.machine().rotary.iter().position(|axis| !axis.is_present()) {
            None => map.cells = (0..SIZE.0 * SIZE.1).map(|cell| ways(setup, map.middle(cell))).collect(),
            Some(locked) => map.follow(setup, 1 - locked),
        }
        map
    }

    /// Marks the cells that the one rotary axis goes through.
    fn follow(&mut self, setup: &Setup, slot: usize) {
        let (low, high) = match setup.machine().rotary[slot].travel {
            Travel::Limited { min, max } => (min, max),
            Travel::Unlimited | Travel::Wrapped => (0.0, TAU),
        };
        for step in 0..=ALONG {
            let mut rotary = [0.0; 2];
            rotary[slot] = low + (high - low) * step as f64 / ALONG as f64;
            let cell = self.cell(&setup.axis(rotary));
            if let Some(ways) = self.cells.get_mut(cell) {
                *ways = Ways::One;
            }
        }
    }

    fn middle(&self, cell: usize) -> Direction {
        let (row, column) = (cell / SIZE.1, cell % SIZE.1);
        let (sin, cos) = ((row as f64 + 0.5) / SIZE.0 as f64 * PI).sin_cos();
        let (across, along) = ((column as f64 + 0.5) / SIZE.1 as f64 * TAU - PI).sin_cos();
        let [x, y, z] = self.frame;
        Direction::new_normalize((x * along + y * across) * sin + z * cos)
    }

    fn cell(&self, direction: &Direction) -> usize {
        let [x, y, z] = self.frame.map(|axis| axis.dot(direction));
        let row = (z.clamp(-1.0, 1.0).acos() / PI * SIZE.0 as f64) as usize;
        let column = ((y.atan2(x) + PI) / TAU * SIZE.1 as f64) as usize;
        row.min(SIZE.0 - 1) * SIZE.1 + column.min(SIZE.1 - 1)
    }

    /// Ways to the middle of a cell of the map, or along its one rotary axis to some place in it; rows from the spindle's
    /// axis down.
    pub fn at(&self, row: usize, column: usize) -> Ways {
        self.cells.get(row * SIZE.1 + column).copied().unwrap_or_default()
    }

    /// Degrees from the spindle's axis up to which every direction is made, and beyond which none is: to the height of a
    /// row.
    pub fn tilts(&self) -> [f64; 2] {
        let row = |row: usize| (0..SIZE.1).map(move |column| self.at(row, column) != Ways::None);
        let all = (0..SIZE.0).find(|index| row(*index).any(|made| !made)).unwrap_or(SIZE.0);
        let any = (0..SIZE.0).rev().find(|index| row(*index).any(|made| made)).map_or(0, |last| last + 1);
        [all, any].map(|rows| rows as f64 * 180.0 / SIZE.0 as f64)
    }

    /// The map in letters: `#` both branches, `+` one, `.` none, `O` a singular direction; two rows of the map a line.
    pub fn text(&self) -> String {
        let poles: Vec<usize> = self.poles.iter().map(|pole| self.cell(pole)).collect();
        let mut text =
            String::from("reach: tilt from the spindle's axis down, azimuth from -180 across to 180 degrees\n");
        let ticks = [-180, -90, 0, 90, 180].map(|azimuth| format!("{azimuth:<18}")).concat();
        let _ = writeln!(text, "      {}", ticks.trim_end());
        for line in 0..SIZE.0 / 2 {
            let _ = write!(text, "{:>5} ", line * 360 / SIZE.0);
            for column in 0..SIZE.1 {
                let rows = [2 * line, 2 * line + 1];
                let pole = rows.iter().any(|row| poles.contains(&(row * SIZE.1 + column)));
                let letter = match rows.map(|row| self.at(row, column)) {
                    _ if pole => 'O',
                    [Ways::None, Ways::None] => '.',
                    [Ways::Both, Ways::Both] => '#',
                    _ => '+',
                };
                text.push(letter);
            }
            text.push('\n');
        }
        text.push_str("      # both branches, + one, . none, O singular\n");
        text
    }

    /// The map as two discs of equal area (Lambert's azimuthal projection), the sphere seen from the spindle and from the
    /// other side.
    pub fn svg(&self, title: &str) -> String {
        let escaped = title.replace('&', "&amp;").replace('<', "&lt;");
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 440 250\" font-family=\"sans-serif\" \
             font-size=\"10\">\n<title>{escaped}</title>\n<rect width=\"440\" height=\"250\" fill=\"white\"/>\n"
        );
        for cell in 0..self.cells.len() {
            let colour = match self.cells[cell] {
                Ways::None => "#e4e4e4",
                Ways::One => "#8fbfe0",
                Ways::Both => "#2f6ea5",
            };
            let (row, column) = (cell / SIZE.1, cell % SIZE.1);
            let corners = [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(down, right)| {
                let tilt = (row + down) as f64 / SIZE.0 as f64 * PI;
                let azimuth = (column + right) as f64 / SIZE.1 as f64 * TAU - PI;
                place(tilt, azimuth, row < SIZE.0 / 2)
            });
            let corners = corners.map(|(x, y)| format!("{x:.2},{y:.2}"));
            let _ = writeln!(svg, "<polygon points=\"{}\" fill=\"{colour}\"/>", corners.join(" "));
        }
        for pole in &self.poles {
            let [x, y, z] = self.frame.map(|axis| axis.dot(pole));
            let (x, y) = place(z.clamp(-1.0, 1.0).acos(), y.atan2(x), z >= 0.0);
            let _ = writeln!(
                svg,
                "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"4\" fill=\"none\" stroke=\"#c0392b\" stroke-width=\"2\"/>"
            );
        }
        for (x, words) in [(110, "tilt 0 to 90 degrees"), (330, "tilt 180 to 90 degrees")] {
            let _ = writeln!(svg, "<text x=\"{x}\" y=\"228\" text-anchor=\"middle\">{words}</text>");
        }
        let _ = writeln!(
            svg,
            "<text x=\"220\" y=\"244\" text-anchor=\"middle\">{escaped}: dark both branches, light one, grey none, ring \
             singular; azimuth 0 to the right</text>\n</svg>"
        );
        svg
    }
}

/// Where a direction lies in the picture; the upper half of the sphere on the left.
fn place(tilt: f64, azimuth: f64, upper: bool) -> (f64, f64) {
    let (from, centre) = if upper { (tilt, 110.0) } else { (PI - tilt, 330.0) };
    let radius = 100.0 * std::f64::consts::SQRT_2 * (from / 2.0).sin();
    let (sin, cos) = azimuth.sin_cos();
    (centre + radius * cos, 110.0 - radius * sin)
}
