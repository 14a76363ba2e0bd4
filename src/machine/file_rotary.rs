//! The rotary axes of a machine file: none, one or two, and their order from the part to the tool. Uses `diagnostic` and
//! `geometry`.

use super::file_reader::Reader;
use super::model::{Carrier, RotaryAxis, RotaryMotion, Sense, Travel};
use super::rotaries::Rotaries;
use crate::diagnostic::Result;
use crate::geometry::{Direction, Point, Vector};
use serde::Deserialize;
use std::f64::consts::TAU;

/// Widest rotary limit that is taken seriously, degrees.
const WIDEST: f64 = 1e6;
/// How far below a full turn the words of an axis that counts within one turn end, degrees.
const LAST_WORD: f64 = 1e-6;
/// Letters of rotary axes.
const LETTERS: [char; 3] = ['A', 'B', 'C'];

/// A table `[[rotary]]` as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawRotary {
    letter: String,
    on: Carrier,
    carried_by: Option<String>,
    direction: [f64; 3],
    pivot: [f64; 3],
    #[serde(default)]
    sense: Sense,
    limits: RawTravel,
    index_step: Option<f64>,
    speed: f64,
    acceleration: f64,
    jerk: Option<f64>,
    error: Option<RawError>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawError {
    rotation: [f64; 3],
    shift: [f64; 3],
}

#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "limits must be two numbers in square brackets, degrees, or text")]
enum RawTravel {
    Limits([f64; 2]),
    Endless(String),
}

/// Two axes, and their indices in the order of the chain from the part to the tool.
type Chained = ([RotaryAxis; 2], [usize; 2]);

impl Reader<'_> {
    /// The rotary axes, locked ones put in where the machine has fewer than two.
    pub(super) fn rotaries(&self, raw: &[RawRotary], spindle: Direction) -> Result<Chained> {
        match raw {
            [] => Ok(locked_both(spindle)),
            [only] => Ok(locked_beside(self.rotary(0, only)?, spindle)),
            [first, second] => self.pair(first, second, spindle),
            _ => {
                let message = format!("{} rotary axes; there can be two at most", raw.len());
                self.bad("rotary[2]", message, "leave out the axes that programs do not move")
            }
        }
    }

    fn pair(&self, first: &RawRotary, second: &RawRotary, spindle: Direction) -> Result<Chained> {
        let rotary = [self.rotary(0, first)?, self.rotary(1, second)?];
        if rotary[0].letter == rotary[1].letter {
            let message = format!("axis {} is named twice", rotary[0].letter);
            return self.bad("rotary[1].letter", message, "give the second rotary axis its own letter, A, B or C");
        }
        let chain = self.chain([first, second], &rotary)?;
        if let Err(reason) = Rotaries::new(rotary[chain[0]].direction, rotary[chain[1]].direction, spindle) {
            return self.bad(
                &format!("rotary[{}].direction", chain[1]),
                reason,
                "check the directions of both rotary axes and of the spindle; the tool must tilt in two ways; leave out \
                 an axis that programs do not move",
            );
        }
        Ok((rotary, chain))
    }

    fn rotary(&self, index: usize, raw: &RawRotary) -> Result<RotaryAxis> {
        let path = format!("rotary[{index}]");
        let mut letters = raw.letter.chars();
        let letter = match (letters.next(), letters.next()) {
            (Some(letter), None) if LETTERS.contains(&letter) => letter,
            _ => {
                let message = format!("\"{}\" is not the letter of a rotary axis", raw.letter);
                return self.bad(&format!("{path}.letter"), message, "write \"A\", \"B\" or \"C\"");
            }
        };
        let nominal = self.direction(&format!("{path}.direction"), raw.direction)?;
        let pivot = self.point(&format!("{path}.pivot"), raw.pivot)?;
        let rotation = raw.error.as_ref().map(|error| error.rotation);
        let shift = raw.error.as_ref().map_or([0.0; 3], |error| error.shift);
        Ok(RotaryAxis {
            letter,
            on: raw.on,
            direction: self.measured(&format!("{path}.error"), nominal, rotation)?,
            pivot: pivot + self.point(&format!("{path}.error.shift"), shift)?.coords,
            sense: raw.sense,
            travel: self.travel(&path, &raw.limits)?,
            motion: self.motion(&path, raw.index_step)?,
            speed: self.positive(&format!("{path}.speed"), raw.speed, "degrees/min")?.to_radians() / 60.0,
            acceleration: self.positive(&format!("{path}.acceleration"), raw.acceleration, "degrees/s^2")?.to_radians(),
            jerk: self.jerk(&path, raw.jerk, "degrees/s^3")?.map(f64::to_radians),
        })
    }

    fn travel(&self, path: &str, raw: &RawTravel) -> Result<Travel> {
        let limited = |[min, max]: [f64; 2]| Travel::Limited { min: min.to_radians(), max: max.to_radians() };
        match raw {
            RawTravel::Limits(limits) => Ok(limited(self.limits(path, *limits, WIDEST, "degrees")?)),
            RawTravel::Endless(how) => match how.as_str() {
                "unlimited" => Ok(Travel::Unlimited),
                "wrapped" => Ok(Travel::Wrapped),
                "modulo" => Ok(limited([0.0, 360.0 - LAST_WORD])),
                other => self.bad(
                    &format!("{path}.limits"),
                    format!("\"{other}\" is not a travel"),
                    "write [lower, upper] in degrees, or \"unlimited\", \"wrapped\" or \"modulo\"",
                ),
            },
        }
    }

    fn motion(&self, path: &str, step: Option<f64>) -> Result<RotaryMotion> {
        match step {
            None => Ok(RotaryMotion::Continuous),
            Some(step) if (0.0..360.0).contains(&step) => Ok(RotaryMotion::Indexed { step: step.to_radians() }),
            Some(step) => self.bad(
                &format!("{path}.index_step"),
                format!("{step} degrees is not a step between the angles at which an axis is clamped"),
                "write degrees from 0 to below 360, 0 where it is clamped at any angle",
            ),
        }
    }

    /// Order of the rotary axes from the part to the tool.
    fn chain(&self, raw: [&RawRotary; 2], rotary: &[RotaryAxis; 2]) -> Result<[usize; 2]> {
        for (index, axis) in raw.iter().enumerate() {
            let Some(carrier) = &axis.carried_by else { continue };
            let path = format!("rotary[{index}].carried_by");
            let other = &rotary[1 - index];
            if *carrier != other.letter.to_string() {
                let message =
                    format!("axis {} is carried by \"{carrier}\", which is not the other rotary axis", axis.letter);
                return self.bad(&path, message, format!("write \"{}\", or leave the key out", other.letter));
            }
            if other.on != axis.on {
                let message = format!("axis {} and axis {carrier} are not on the same side", axis.letter);
                return self.bad(&path, message, "leave carried_by out when one axis turns the table and one the head");
            }
        }
        let carried = raw.map(|axis| axis.carried_by.is_some());
        match (rotary[0].on, rotary[1].on, carried) {
            (Carrier::Table, Carrier::Head, _) => Ok([0, 1]),
            (Carrier::Head, Carrier::Table, _) => Ok([1, 0]),
            (Carrier::Table, Carrier::Table, [true, false]) | (Carrier::Head, Carrier::Head, [false, true]) => {
                Ok([0, 1])
            }
            (Carrier::Table, Carrier::Table, [false, true]) | (Carrier::Head, Carrier::Head, [true, false]) => {
                Ok([1, 0])
            }
            (_, _, [true, true]) => self.bad(
                "rotary[1].carried_by",
                "the two rotary axes carry each other",
                "keep carried_by only on the axis that sits on the other one",
            ),
            (_, _, [false, false]) => self.bad(
                "rotary[1]",
                "both rotary axes are on the same side, and neither says that the other carries it",
                format!("write carried_by = \"{}\" on the axis that sits on axis {0}", rotary[0].letter),
            ),
        }
    }
}

/// An axis that the machine does not have, with a letter that none of the others has.
fn locked(taken: &[char], on: Carrier, direction: Direction) -> RotaryAxis {
    let letter = LETTERS.into_iter().find(|letter| !taken.contains(letter)).unwrap_or('A');
    RotaryAxis {
        letter,
        on,
        direction,
        pivot: Point::origin(),
        sense: Sense::Iso,
        travel: Travel::Limited { min: 0.0, max: 0.0 },
        motion: RotaryMotion::Absent,
        // It never moves; any rates will do.
        speed: TAU,
        acceleration: TAU,
        jerk: None,
    }
}

/// A direction square to two others, or to the one if they are parallel.
fn square_to(a: Direction, b: Direction) -> Direction {
    let some = if a.x.abs() < 0.6 { Vector::x() } else { Vector::y() };
    let other = a.cross(&b);
    Direction::try_new(other, 1e-6).unwrap_or_else(|| Direction::new_normalize(a.cross(&some)))
}

/// No rotary axis: two locked ones, square to the spindle and to each other.
fn locked_both(spindle: Direction) -> Chained {
    let first = square_to(spindle, spindle);
    let table = locked(&[], Carrier::Table, first);
    let head = locked(&[table.letter], Carrier::Head, square_to(spindle, first));
    ([table, head], [0, 1])
}

/// One rotary axis: a locked one where it completes the chain, square to it and to the spindle.
fn locked_beside(axis: RotaryAxis, spindle: Direction) -> Chained {
    let direction = square_to(axis.direction, spindle);
    // The axis nearer the tool must tilt it; one along the spindle comes first.
    let along_spindle = axis.direction.cross(&spindle).norm() < 1e-6;
    match axis.on {
        Carrier::Head if !along_spindle => ([axis, locked(&[axis.letter], Carrier::Table, direction)], [1, 0]),
        _ => ([axis, locked(&[axis.letter], Carrier::Head, direction)], [0, 1]),
    }
}
