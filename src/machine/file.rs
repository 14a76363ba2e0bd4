//! The machine file: raw tables as written, then checked values. Uses `diagnostic` and `geometry`.

use super::control::{
    Control, Dialect, DialectOptions, FeedMode, InverseTimeUnit, LengthUnit, OrientationWords, PointRule, Rollover,
    ShortestWay, TcpInterpolation, WorkOffset,
};
use super::file_bodies::RawBody;
use super::file_reader::{LONGEST, Reader};
use super::file_rotary::RawRotary;
use super::model::{AxisZero, Carrier, LinearAxis, Machine, Spindle, Tolerances};
use super::templates::{self, Template, Templates};
use crate::diagnostic::{Diagnostic, Result, TomlText};
use crate::geometry::{Direction, Vector};
use serde::Deserialize;
use std::collections::BTreeMap;

/// Largest tolerance of a machine's own numbers, mm or degrees: to first order must be near enough.
const LARGEST_TOLERANCE: f64 = 1.0;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMachine {
    format: String,
    version: u32,
    name: String,
    description: String,
    source: String,
    #[serde(default)]
    spindle: RawSpindle,
    linear: RawLinearAxes,
    #[serde(default)]
    rotary: Vec<RawRotary>,
    #[serde(default)]
    bodies: Vec<RawBody>,
    tolerances: Option<RawTolerances>,
    control: RawControl,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawTolerances {
    pivot: f64,
    direction: f64,
    angle: f64,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawSpindle {
    axis: Option<[f64; 3]>,
    gauge_point: [f64; 3],
    axis_zero: AxisZero,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLinearAxes {
    #[serde(rename = "X")]
    x: RawLinear,
    #[serde(rename = "Y")]
    y: RawLinear,
    #[serde(rename = "Z")]
    z: RawLinear,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLinear {
    limits: [f64; 2],
    speed: f64,
    acceleration: f64,
    jerk: Option<f64>,
    direction: Option<[f64; 3]>,
    on: Option<Carrier>,
    carried_by: Option<String>,
    error: Option<RawLinearError>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLinearError {
    rotation: [f64; 3],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawControl {
    dialect: Dialect,
    #[serde(default = "yes")]
    tcp: bool,
    work_offsets: BTreeMap<String, [f64; 3]>,
    #[serde(default)]
    reference_positions: Vec<[f64; 5]>,
    #[serde(default)]
    options: RawOptions,
    #[serde(default)]
    templates: RawTemplates,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawTemplates {
    header: Option<String>,
    retract: Option<String>,
    tool_call: Option<String>,
    approach: Option<String>,
    end: Option<String>,
}

fn yes() -> bool {
    true
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawOptions {
    linear_digits: Option<u8>,
    rotary_digits: Option<u8>,
    vector_digits: Option<u8>,
    feed_digits: Option<u8>,
    units: Option<LengthUnit>,
    orientation: Option<OrientationWords>,
    feed_mode: Option<FeedMode>,
    max_feed: Option<f64>,
    inverse_time_range: Option<[f64; 2]>,
    inverse_time_unit: Option<InverseTimeUnit>,
    feed_radius: Option<f64>,
    max_block_rate: Option<f64>,
    max_block_length: Option<usize>,
    length_codes: Option<[String; 2]>,
    tcp_on: Option<String>,
    tcp_on_vectors: Option<String>,
    tcp_off: Option<String>,
    tcp_at_start: Option<bool>,
    tcp_interpolation: Option<TcpInterpolation>,
    tcp_limits_axes: Option<bool>,
    vector_interpolation: Option<TcpInterpolation>,
    exact_stop: Option<bool>,
    rounding_rotary_deg: Option<f64>,
    cycle: Option<f64>,
    rollover: Option<Rollover>,
    shortest_way: Option<ShortestWay>,
    number_without_point: Option<PointRule>,
    least_increment: Option<f64>,
    decimal_comma: Option<bool>,
    length_offset_without_tcp: Option<bool>,
    start_lines: Option<Vec<String>>,
    retract_lines: Option<Vec<String>>,
    end_lines: Option<Vec<String>>,
}

impl Machine {
    /// Reads a machine file. `file` is its name for messages. Everything wrong is located by line and column.
    pub fn read(file: &str, text: &str) -> Result<Self> {
        let text = TomlText::new(file, text);
        Reader::new(&text).machine(&text.parse()?)
    }
}

impl Reader<'_> {
    fn machine(&self, raw: &RawMachine) -> Result<Machine> {
        if raw.format != "regulus-machine" {
            let message = format!("format \"{}\" is not a machine file", raw.format);
            return self.bad("format", message, "write format = \"regulus-machine\"");
        }
        if raw.version != 1 {
            return self.bad("version", format!("version {} is not known", raw.version), "write version = 1");
        }
        if raw.name.trim().is_empty() {
            return self.bad("name", "the machine has no name", "write the name that job files call it by");
        }
        let linear = [
            self.linear('X', &raw.linear.x, Vector::x())?,
            self.linear('Y', &raw.linear.y, Vector::y())?,
            self.linear('Z', &raw.linear.z, Vector::z())?,
        ];
        let [x, y, z] = linear.each_ref().map(|axis| axis.direction.into_inner());
        if x.dot(&y.cross(&z)).abs() < 0.1 {
            return self.bad(
                "linear",
                "the directions of X, Y and Z lie nearly in one plane",
                "give each its own direction in space, at least a few degrees out of the plane of the others",
            );
        }
        let spindle = Spindle {
            axis: self.direction("spindle.axis", raw.spindle.axis.unwrap_or([0.0, 0.0, 1.0]))?,
            gauge_point: self.point("spindle.gauge_point", raw.spindle.gauge_point)?,
            axis_zero: raw.spindle.axis_zero,
        };
        let (rotary, chain) = self.rotaries(&raw.rotary, spindle.axis)?;
        let carried_by = [&raw.linear.x, &raw.linear.y, &raw.linear.z].map(|axis| axis.carried_by.as_ref());
        let linear_order = self.linear_order(&linear, carried_by)?;
        let bodies = self.bodies(&raw.bodies, &linear, &rotary)?;
        Ok(Machine {
            name: raw.name.clone(),
            description: raw.description.clone(),
            source: raw.source.clone(),
            linear,
            linear_order,
            rotary,
            chain,
            bodies,
            spindle,
            tolerances: raw.tolerances.as_ref().map(|raw| self.tolerances(raw)).transpose()?,
            control: self.control(&raw.control)?,
        })
    }

    fn tolerances(&self, raw: &RawTolerances) -> Result<Tolerances> {
        for (key, value) in [("pivot", raw.pivot), ("direction", raw.direction), ("angle", raw.angle)] {
            if !(0.0..=LARGEST_TOLERANCE).contains(&value) {
                let message = format!("{value} is no tolerance");
                let help = format!("write mm, or degrees, from 0 to {LARGEST_TOLERANCE}");
                return self.bad(&format!("tolerances.{key}"), message, help);
            }
        }
        let (direction, angle) = (raw.direction.to_radians(), raw.angle.to_radians());
        Ok(Tolerances { pivot: raw.pivot, direction, angle })
    }

    fn linear(&self, letter: char, raw: &RawLinear, default: Vector) -> Result<LinearAxis> {
        let path = format!("linear.{letter}");
        let [min, max] = self.limits(&path, raw.limits, LONGEST, "mm")?;
        let nominal = match raw.direction {
            Some(direction) => self.direction(&format!("{path}.direction"), direction)?,
            None => Direction::new_unchecked(default),
        };
        let rotation = raw.error.as_ref().map(|error| error.rotation);
        Ok(LinearAxis {
            letter,
            on: raw.on.unwrap_or(Carrier::Head),
            direction: self.measured(&format!("{path}.error"), nominal, rotation)?,
            min,
            max,
            speed: self.positive(&format!("{path}.speed"), raw.speed, "mm/min")? / 60.0,
            acceleration: self.positive(&format!("{path}.acceleration"), raw.acceleration, "mm/s^2")?,
            jerk: self.jerk(&path, raw.jerk, "mm/s^3")?,
        })
    }

    fn control(&self, raw: &RawControl) -> Result<Control> {
        if raw.work_offsets.is_empty() {
            return self.bad(
                "control.work_offsets",
                "the control has no work offset",
                "write G54 = [0, 0, 0] with the part's zero in the machine frame, mm",
            );
        }
        let mut work_offsets = Vec::with_capacity(raw.work_offsets.len());
        for (name, linear) in &raw.work_offsets {
            self.point(&format!("control.work_offsets.{name}"), *linear)?;
            work_offsets.push(WorkOffset { name: name.clone(), linear: *linear });
        }
        Ok(Control {
            dialect: raw.dialect,
            tcp: raw.tcp,
            options: self.options(raw.dialect, &raw.options)?,
            templates: self.templates(&raw.templates)?,
            work_offsets,
            reference_positions: self.reference_positions(&raw.reference_positions)?,
        })
    }

    fn reference_positions(&self, raw: &[[f64; 5]]) -> Result<Vec<[f64; 5]>> {
        let far = raw.iter().position(|position| position.iter().any(|value| value.abs() > LONGEST));
        match far {
            None => Ok(raw.to_vec()),
            Some(index) => self.bad(
                &format!("control.reference_positions[{index}]"),
                format!("a reference position beyond {LONGEST} mm or degrees"),
                "write [X, Y, Z, first rotary axis, second] in mm and degrees",
            ),
        }
    }

    fn templates(&self, raw: &RawTemplates) -> Result<Templates> {
        let template = |key: &str, text: &Option<String>| {
            let Some(text) = text.clone() else { return Ok(None) };
            let path = format!("control.templates.{key}");
            let place = self.text.blame(&path, "").place.and_then(|place| place.line).unwrap_or(1);
            // The text of a multi-line string begins on the line after its quotes.
            let line = place + usize::from(text.contains('\n'));
            if let Err(fault) = templates::check(&text) {
                let error = Diagnostic::error(fault.message).in_file(self.text.file()).help(fault.help);
                return Err(error.at(line + fault.line - 1, 1));
            }
            Ok(Some(Template { text, file: self.text.file().to_owned(), line: place }))
        };
        Ok(Templates {
            header: template("header", &raw.header)?,
            retract: template("retract", &raw.retract)?,
            tool_call: template("tool_call", &raw.tool_call)?,
            approach: template("approach", &raw.approach)?,
            end: template("end", &raw.end)?,
        })
    }

    /// Radians.
    fn rounding_rotary(&self, degrees: Option<f64>) -> Result<Option<f64>> {
        match degrees {
            Some(degrees) if !(0.0..=180.0).contains(&degrees) => {
                let message = format!("rotary axes that leave their way by {degrees} degrees round no corner");
                self.bad("control.options.rounding_rotary_deg", message, "write degrees, such as 0.01, or leave it out")
            }
            given => Ok(given.map(f64::to_radians)),
        }
    }

    fn cycle(&self, seconds: f64) -> Result<f64> {
        if (0.0..=1.0).contains(&seconds) {
            return Ok(seconds);
        }
        let message = format!("a cycle of {seconds} s is not one that a control interpolates by");
        self.bad("control.options.cycle", message, "write seconds, such as 0.001, or 0 where it is not known")
    }

    fn options(&self, dialect: Dialect, raw: &RawOptions) -> Result<DialectOptions> {
        let default = DialectOptions::of(dialect);
        let path = |key: &str| format!("control.options.{key}");
        let digits = |key: &str, given: Option<u8>, default: u8| match given {
            Some(digits) if digits > 9 => {
                self.bad(&path(key), format!("{digits} decimals are too many"), "write a number from 0 to 9")
            }
            given => Ok(given.unwrap_or(default)),
        };
        // An empty code says that the control has none.
        let code = |given: &Option<String>, default: Option<String>| match given.as_deref().map(str::trim) {
            None => default,
            Some("") => None,
            Some(code) => Some(code.to_owned()),
        };
        let inverse_time_range = raw.inverse_time_range.unwrap_or(default.inverse_time_range);
        if !(inverse_time_range[0] > 0.0 && inverse_time_range[0] < inverse_time_range[1]) {
            let message = format!("inverse-time range {inverse_time_range:?} is not an increasing pair above zero");
            return self.bad(&path("inverse_time_range"), message, "write [smallest F, largest F] in 1/min");
        }
        let max_block_length = raw.max_block_length.unwrap_or(default.max_block_length);
        if max_block_length < 60 {
            let message = format!("a block of {max_block_length} characters holds no five-axis move");
            return self.bad(&path("max_block_length"), message, "write 60 or more");
        }
        let feed_radius = raw.feed_radius.unwrap_or(default.feed_radius);
        if !(0.0..=LONGEST).contains(&feed_radius) {
            let message = format!("feed radius {feed_radius} mm is not a radius");
            return self.bad(&path("feed_radius"), message, "write mm, or 0 where rotary axes do not count");
        }
        let least_increment = raw.least_increment.unwrap_or(default.least_increment);
        if !(1e-9..=1.0).contains(&least_increment) {
            let message = format!("a least increment of {least_increment} mm is not one that a control counts");
            return self.bad(&path("least_increment"), message, "write mm and degrees, such as 0.001");
        }
        Ok(DialectOptions {
            linear_digits: digits("linear_digits", raw.linear_digits, default.linear_digits)?,
            rotary_digits: digits("rotary_digits", raw.rotary_digits, default.rotary_digits)?,
            vector_digits: digits("vector_digits", raw.vector_digits, default.vector_digits)?,
            feed_digits: digits("feed_digits", raw.feed_digits, default.feed_digits)?,
            units: raw.units.unwrap_or(default.units),
            orientation: raw.orientation.unwrap_or(default.orientation),
            feed_mode: raw.feed_mode.unwrap_or(default.feed_mode),
            max_feed: self.positive(&path("max_feed"), raw.max_feed.unwrap_or(default.max_feed), "mm/min")?,
            inverse_time_range,
            inverse_time_unit: raw.inverse_time_unit.unwrap_or(default.inverse_time_unit),
            feed_radius,
            max_block_rate: self.positive(
                &path("max_block_rate"),
                raw.max_block_rate.unwrap_or(default.max_block_rate),
                "blocks a second",
            )?,
            max_block_length,
            length_codes: raw.length_codes.clone().unwrap_or(default.length_codes),
            tcp_on: code(&raw.tcp_on, default.tcp_on),
            tcp_on_vectors: code(&raw.tcp_on_vectors, default.tcp_on_vectors),
            tcp_off: code(&raw.tcp_off, default.tcp_off),
            tcp_at_start: raw.tcp_at_start.unwrap_or(default.tcp_at_start),
            tcp_interpolation: raw.tcp_interpolation.unwrap_or(default.tcp_interpolation),
            tcp_limits_axes: raw.tcp_limits_axes.unwrap_or(default.tcp_limits_axes),
            vector_interpolation: raw.vector_interpolation.unwrap_or(default.vector_interpolation),
            exact_stop: raw.exact_stop.unwrap_or(default.exact_stop),
            rounding_rotary: self.rounding_rotary(raw.rounding_rotary_deg)?.or(default.rounding_rotary),
            cycle: self.cycle(raw.cycle.unwrap_or(default.cycle))?,
            rollover: raw.rollover.unwrap_or(default.rollover),
            shortest_way: raw.shortest_way.unwrap_or(default.shortest_way),
            number_without_point: raw.number_without_point.unwrap_or(default.number_without_point),
            least_increment,
            decimal_comma: raw.decimal_comma.unwrap_or(default.decimal_comma),
            length_offset_without_tcp: raw.length_offset_without_tcp.unwrap_or(default.length_offset_without_tcp),
            start_lines: raw.start_lines.clone().unwrap_or(default.start_lines),
            retract_lines: raw.retract_lines.clone().unwrap_or(default.retract_lines),
            end_lines: raw.end_lines.clone().unwrap_or(default.end_lines),
        })
    }
}
