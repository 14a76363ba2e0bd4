//! A cutter as a surface of revolution: flutes, shank and holder. Uses `diagnostic` and `geometry`.

pub mod cutter;
pub mod export;
pub mod meridian;
pub mod profile;

pub use cutter::CutterShape;
pub use meridian::{Contact, Element, MeridianPoint};
pub use profile::ProfilePoint;

use meridian::{ArcSide, at};

/// Which part of a tool an element belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Section {
    /// Cuts.
    Flute,
    /// Must not touch anything.
    Shank,
    /// Must not touch anything.
    Holder,
}

/// A whole tool. Heights run from the tip.
#[derive(Clone, Debug, PartialEq)]
pub struct Tool {
    /// Number in the control's tool table.
    pub number: u32,
    /// The kind as the user named it, for headers and reports.
    pub kind: String,
    flutes: Vec<Element>,
    shank: Vec<Element>,
    holder: Vec<Element>,
    flute_length: f64,
    gauge_length: f64,
}

/// What is above the flutes. Lengths mm, heights from the tip.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fixture {
    /// Diameter of the shank; the flute's last diameter when left out.
    pub shank_diameter: Option<f64>,
    /// Tip to gauge line.
    pub gauge_length: f64,
    /// Profile of the holder, from below, heights increasing.
    pub holder: Vec<MeridianPoint>,
}

/// Why a tool is refused; `key` is the job key to blame.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: {message}")]
pub struct ToolError {
    /// Key of the job's tool table.
    pub key: &'static str,
    /// What is wrong, with value and limit.
    pub message: String,
}

impl ToolError {
    pub(crate) fn new(key: &'static str, message: impl Into<String>) -> Self {
        Self { key, message: message.into() }
    }
}

impl Tool {
    /// Joins the cutting shape with what carries it.
    pub fn new(number: u32, shape: &CutterShape, fixture: &Fixture) -> Result<Self, ToolError> {
        let flutes = shape.flutes()?;
        let top = flutes.last().map_or(at(0.0, 0.0), Element::end);
        let flute_length = top.height;
        let gauge_length = fixture.gauge_length;
        if !(gauge_length.is_finite() && gauge_length >= flute_length) {
            return Err(ToolError::new(
                "gauge_length",
                format!("{gauge_length} mm is shorter than the flutes, {flute_length} mm"),
            ));
        }
        let shank_radius = match fixture.shank_diameter {
            None => top.radius,
            Some(d) if d.is_finite() && d > 0.0 => d / 2.0,
            Some(d) => return Err(ToolError::new("shank_diameter", format!("{d} mm is not a positive diameter"))),
        };
        let holder = holder_elements(&fixture.holder, flute_length, gauge_length)?;
        let shank_end = fixture.holder.first().map_or(gauge_length, |p| p.height);
        let mut shank = Vec::new();
        if shank_radius != top.radius {
            shank.push(Element::Line { from: top, to: at(flute_length, shank_radius) });
        }
        if shank_end > flute_length {
            shank.push(Element::Line { from: at(flute_length, shank_radius), to: at(shank_end, shank_radius) });
        }
        Ok(Self { number, kind: shape.kind().to_owned(), flutes, shank, holder, flute_length, gauge_length })
    }

    /// What is above the flutes, as it was given.
    pub fn fixture(&self) -> Fixture {
        let top = self.flutes.last().map_or(at(0.0, 0.0), Element::end);
        let shank = self.shank.last().map(|element| element.end().radius).filter(|radius| *radius != top.radius);
        let profile = self.holder.iter().filter(|element| element.start().radius > 0.0);
        let first = profile.clone().next().map(Element::start);
        Fixture {
            shank_diameter: shank.map(|radius| 2.0 * radius),
            gauge_length: self.gauge_length,
            holder: first.into_iter().chain(profile.map(Element::end)).collect(),
        }
    }

    /// The same shank and holder on other flutes. Where the flutes had the shank's diameter, it follows theirs.
    pub fn with_flutes(&self, shape: &CutterShape) -> Result<Self, ToolError> {
        Self::new(self.number, shape, &self.fixture())
    }

    /// The cutting profile, from the axis at the tip upward.
    pub fn flutes(&self) -> &[Element] {
        &self.flutes
    }

    /// The profile of shank and holder, from the end of the flutes upward.
    pub fn body(&self) -> impl Iterator<Item = (Section, &Element)> {
        let shank = self.shank.iter().map(|e| (Section::Shank, e));
        shank.chain(self.holder.iter().map(|e| (Section::Holder, e)))
    }

    /// Height of the end of the flutes above the tip, mm.
    pub fn flute_length(&self) -> f64 {
        self.flute_length
    }

    /// Distance from tip to gauge line, mm.
    pub fn gauge_length(&self) -> f64 {
        self.gauge_length
    }

    /// Largest cutting radius, mm.
    pub fn max_radius(&self) -> f64 {
        self.flutes.iter().map(Element::max_radius).fold(0.0, f64::max)
    }

    /// Largest radius of flutes, shank and holder, mm.
    pub fn body_radius(&self) -> f64 {
        self.body().map(|(_, e)| e.max_radius()).fold(self.max_radius(), f64::max)
    }

    /// The contact of the flank at `height` above the tip: the last element that reaches it and does not lie flat.
    pub fn contact_at(&self, height: f64) -> Option<Contact> {
        self.flutes.iter().rev().find_map(|element| {
            let (low, high) = (element.start().height, element.end().height);
            if high - low < 1e-12 || !(low - 1e-9..=high + 1e-9).contains(&height) {
                return None;
            }
            let share = match element {
                Element::Line { .. } => (height - low) / (high - low),
                Element::Arc { centre, radius, from, to, side } => {
                    let phi = ((centre.height - height) / radius).clamp(-1.0, 1.0).acos();
                    // A hollow is the lower half of its circle.
                    let phi = if *side == ArcSide::Convex { phi } else { std::f64::consts::TAU - phi };
                    (phi - from) / (to - from)
                }
            };
            Some(element.contact(share.clamp(0.0, 1.0)))
        })
    }
}

fn holder_elements(points: &[MeridianPoint], above: f64, gauge_length: f64) -> Result<Vec<Element>, ToolError> {
    let bad = |message: String| Err(ToolError::new("holder", message));
    let Some(first) = points.first() else { return Ok(Vec::new()) };
    for (i, p) in points.iter().enumerate() {
        if !(p.height.is_finite() && p.radius.is_finite() && p.radius > 0.0) {
            return bad(format!("point {} is [{}, {}]; heights and radii must be positive", i + 1, p.height, p.radius));
        }
        if i > 0 && p.height < points[i - 1].height {
            return bad(format!("point {} at height {} lies below the point before it", i + 1, p.height));
        }
    }
    if first.height < above {
        return bad(format!("starts at {} mm, inside the flutes that end at {above} mm", first.height));
    }
    let mut elements = vec![Element::Line { from: at(first.height, 0.0), to: *first }];
    elements.extend(points.windows(2).map(|w| Element::Line { from: w[0], to: w[1] }));
    if let Some(last) = points.last().filter(|p| p.height < gauge_length) {
        elements.push(Element::Line { from: *last, to: at(gauge_length, last.radius) });
    }
    elements.retain(|e| e.length() > 0.0);
    Ok(elements)
}
