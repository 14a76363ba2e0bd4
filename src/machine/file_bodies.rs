//! Bodies of a machine file, and fixtures of a job, as written and checked. Uses `diagnostic` and `geometry`.

use super::bodies::{Body, Form, Link, NEAR_MISS};
use super::file_reader::{LONGEST, Reader};
use super::model::{LinearAxis, RotaryAxis};
use crate::diagnostic::{Result, TomlText};

use serde::Deserialize;

/// A table `[[bodies]]`, or `[[fixtures]]` of a job, as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawBody {
    name: String,
    moves_with: Option<String>,
    #[serde(rename = "box")]
    cuboid: Option<RawBox>,
    cylinder: Option<RawCylinder>,
    file: Option<String>,
    near_miss: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBox {
    min: Option<[f64; 3]>,
    max: Option<[f64; 3]>,
    place: Option<[f64; 3]>,
    size: Option<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCylinder {
    base: [f64; 3],
    #[serde(default = "upward")]
    axis: [f64; 3],
    radius: f64,
    length: f64,
}

fn upward() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

impl RawBody {
    /// A fixture, at a path of keys of a job's text: it stands on the table, in the part frame.
    pub fn fixture(&self, text: &TomlText, path: &str) -> Result<Body> {
        let reader = Reader::new(text);
        if self.moves_with.is_some() {
            let help = "leave moves_with out; what moves otherwise is one of [[bodies]] in the machine file";
            return reader.bad(&format!("{path}.moves_with"), "a fixture stands on the table", help);
        }
        reader.body(path, self, Link::Table)
    }
}

impl Reader<'_> {
    /// The bodies of a machine with these axes.
    pub(super) fn bodies(
        &self,
        raw: &[RawBody],
        linear: &[LinearAxis; 3],
        rotary: &[RotaryAxis; 2],
    ) -> Result<Vec<Body>> {
        let mut bodies: Vec<Body> = Vec::with_capacity(raw.len());
        for (index, raw) in raw.iter().enumerate() {
            let path = format!("bodies[{index}]");
            let body = self.body(&path, raw, self.link(&path, raw, linear, rotary)?)?;
            if bodies.iter().any(|other| other.name == body.name) {
                let message = format!("a second body is called \"{}\"", body.name);
                return self.bad(&format!("{path}.name"), message, "give each body a name of its own");
            }
            bodies.push(body);
        }
        Ok(bodies)
    }

    fn link(&self, path: &str, raw: &RawBody, linear: &[LinearAxis; 3], rotary: &[RotaryAxis; 2]) -> Result<Link> {
        let path = format!("{path}.moves_with");
        let letters = || linear.iter().map(|axis| axis.letter).chain(rotaries(rotary).map(|(_, letter)| letter));
        let known = || letters().map(|letter| format!("\"{letter}\"")).collect::<Vec<_>>().join(", ");
        let help = || format!("write \"base\", \"table\", \"spindle\", or an axis of this machine: {}", known());
        let Some(with) = &raw.moves_with else {
            return self.bad(&path, format!("nothing says what {} moves with", raw.name), help());
        };
        let is = |letter: char| *with == letter.to_string();
        match with.as_str() {
            "base" => return Ok(Link::Base),
            "table" => return Ok(Link::Table),
            "spindle" => return Ok(Link::Spindle),
            _ => {}
        }
        let by_linear = linear.iter().position(|axis| is(axis.letter)).map(Link::Linear);
        let by_rotary = || rotaries(rotary).find(|(_, letter)| is(*letter)).map(|(index, _)| Link::Rotary(index));
        match by_linear.or_else(by_rotary) {
            Some(link) => Ok(link),
            None => self.bad(&path, format!("{} moves with \"{with}\", which this machine has not", raw.name), help()),
        }
    }

    fn body(&self, path: &str, raw: &RawBody, link: Link) -> Result<Body> {
        if raw.name.trim().is_empty() {
            return self.bad(&format!("{path}.name"), "a body has no name", "write the name that findings call it by");
        }
        let form = match (&raw.cuboid, &raw.cylinder, &raw.file) {
            (Some(cuboid), None, None) => self.cuboid(&format!("{path}.box"), cuboid)?,
            (None, Some(cylinder), None) => self.cylinder(&format!("{path}.cylinder"), cylinder)?,
            (None, None, Some(file)) if !file.trim().is_empty() => Form::File(file.clone()),
            _ => {
                let message = format!("{} is not one of box, cylinder and file", raw.name);
                let help = "write one of them, such as box = { min = [0, 0, 0], max = [60, 20, 40] }";
                return self.bad(path, message, help);
            }
        };
        let near_miss = raw.near_miss.unwrap_or(NEAR_MISS);
        if !(0.0..=LONGEST).contains(&near_miss) {
            let message = format!("{near_miss} mm is no distance at which to tell of a near miss");
            return self.bad(&format!("{path}.near_miss"), message, "write mm, 0 where only collisions count");
        }
        let line = self.text.blame(path, "").place.and_then(|place| place.line).unwrap_or(1);
        Ok(Body { name: raw.name.clone(), link, form, near_miss, file: self.text.file().to_owned(), line })
    }

    fn cuboid(&self, path: &str, raw: &RawBox) -> Result<Form> {
        let (low, high) = match (raw.min, raw.max, raw.place, raw.size) {
            (Some(min), Some(max), None, None) => (min, max),
            (None, None, Some(place), Some(size)) => (place, std::array::from_fn(|k| place[k] + size[k])),
            _ => {
                let help = "write { min = [x, y, z], max = [x, y, z] }, or { place = [x, y, z], size = [dx, dy, dz] } \
                            with the least coordinates as its place";
                return self.bad(path, "a box is two corners, or a place and a size", help);
            }
        };
        let [low, high] = [self.point(path, low)?, self.point(path, high)?];
        if (0..3).any(|k| low[k] >= high[k]) {
            let message = format!("a box from {:?} to {:?} is empty", low.coords.as_slice(), high.coords.as_slice());
            return self.bad(path, message, "write a size above zero along each axis");
        }
        Ok(Form::Box { low, high })
    }

    fn cylinder(&self, path: &str, raw: &RawCylinder) -> Result<Form> {
        let base = self.point(&format!("{path}.base"), raw.base)?;
        let axis = self.direction(&format!("{path}.axis"), raw.axis)?;
        for (key, value) in [("radius", raw.radius), ("length", raw.length)] {
            if !(value > 0.0 && value <= LONGEST) {
                let message = format!("a {key} of {value} mm is none");
                return self.bad(&format!("{path}.{key}"), message, "write mm, above zero");
            }
        }
        Ok(Form::Cylinder { base, axis, radius: raw.radius, length: raw.length })
    }

    /// The order of the linear axes from the base outward: an axis comes after the one that carries it, else X, Y, Z.
    pub(super) fn linear_order(
        &self,
        linear: &[LinearAxis; 3],
        carried_by: [Option<&String>; 3],
    ) -> Result<[usize; 3]> {
        let mut order = Vec::with_capacity(3);
        let mut carriers = [None; 3];
        for (index, carrier) in carried_by.iter().enumerate() {
            let Some(carrier) = carrier else { continue };
            let (own, path) = (&linear[index], format!("linear.{}.carried_by", linear[index].letter));
            let found = linear.iter().position(|axis| axis.letter.to_string() == **carrier);
            let Some(found) = found.filter(|found| *found != index && linear[*found].on == own.on) else {
                let message = format!("axis {} cannot sit on \"{carrier}\"", own.letter);
                return self.bad(&path, message, "name another linear axis that moves the same side, table or head");
            };
            carriers[index] = Some(found);
        }
        while order.len() < 3 {
            let ready = |index: &usize| !order.contains(index) && carriers[*index].is_none_or(|c| order.contains(&c));
            match (0..3).find(ready) {
                Some(index) => order.push(index),
                None => return self.bad("linear", "the linear axes carry each other", "leave one carried_by out"),
            }
        }
        Ok([order[0], order[1], order[2]])
    }
}

/// The rotary axes that there are, with index and letter.
fn rotaries(rotary: &[RotaryAxis; 2]) -> impl Iterator<Item = (usize, char)> {
    rotary.iter().enumerate().filter(|(_, axis)| axis.is_present()).map(|(index, axis)| (index, axis.letter))
}
