//! The tool as convex solids of revolution with their surfaces as one inequality each. Uses `geometry` and `tool`.

use crate::geometry::Vector;
use crate::tool::meridian::ArcSide;
use crate::tool::{Element, Section, Tool};

/// Hollow arcs are filled to chords that leave them by less than this, mm.
const HOLLOW_SAG: f64 = 5e-5;

/// A convex solid of revolution between two heights above the tip. With x from the tip, h = d.x and rho the distance
/// from the axis d, it is low <= h <= high and what [`Side`] says. Lengths mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Solid {
    pub(super) section: Section,
    pub(super) low: f64,
    pub(super) high: f64,
    /// Largest radius.
    pub(super) radius: f64,
    pub(super) side: Side,
}

/// The surface of revolution between both ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Side {
    /// Cylinder, cone or sphere: x.x - alpha h^2 - 2 beta h - gamma <= 0.
    Quadric { alpha: f64, beta: f64, gamma: f64 },
    /// Bulging arc about a circle: hypot(max(rho - radius, 0), h - height) <= arc.
    Torus { height: f64, radius: f64, arc: f64 },
}

/// Which of a solid's surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Face {
    Side,
    Low,
    High,
}

impl Solid {
    /// The solids of flutes, shank and holder, in order from the tip.
    pub(super) fn of_tool(tool: &Tool) -> Vec<Self> {
        let flutes = tool.flutes().iter().map(|element| (Section::Flute, element));
        flutes.chain(tool.body()).flat_map(|(section, element)| Self::of(section, element)).collect()
    }

    fn of(section: Section, element: &Element) -> Vec<Self> {
        let (from, to) = (element.start(), element.end());
        match element {
            Element::Line { .. } => Self::frustum(section, (from.height, from.radius), (to.height, to.radius)),
            Element::Arc { centre, radius: arc, side: ArcSide::Convex, .. } => {
                let side = if centre.radius.abs() < 1e-12 {
                    Side::Quadric { alpha: 0.0, beta: centre.height, gamma: arc * arc - centre.height.powi(2) }
                } else {
                    Side::Torus { height: centre.height, radius: centre.radius, arc: *arc }
                };
                let solid = Self { section, low: from.height, high: to.height, radius: element.max_radius(), side };
                Some(solid).filter(Self::has_volume).into_iter().collect()
            }
            Element::Arc { radius, from, to, side: ArcSide::Concave, .. } => {
                // A chord over the angle w leaves the arc by radius w^2 / 8.
                let count = ((to - from).abs() / (8.0 * HOLLOW_SAG / radius).sqrt()).ceil().max(1.0) as usize;
                let corner = |i: usize| {
                    let point = element.contact(i as f64 / count as f64).point;
                    (point.height, point.radius)
                };
                (0..count).flat_map(|i| Self::frustum(section, corner(i), corner(i + 1))).collect()
            }
        }
    }

    /// Below a straight profile: rho <= r0 + k h gives alpha = 1 + k^2, beta = r0 k, gamma = r0^2.
    fn frustum(section: Section, low: (f64, f64), high: (f64, f64)) -> Vec<Self> {
        if high.0 - low.0 <= 1e-12 {
            return Vec::new();
        }
        let slope = (high.1 - low.1) / (high.0 - low.0);
        let base = low.1 - slope * low.0;
        let side = Side::Quadric { alpha: 1.0 + slope * slope, beta: base * slope, gamma: base * base };
        vec![Self { section, low: low.0, high: high.0, radius: low.1.max(high.1), side }]
    }

    fn has_volume(&self) -> bool {
        self.high - self.low > 1e-12
    }

    /// Outward unit normal at a point `x` from the tip that lies on a face, axis `d`.
    pub(super) fn normal(&self, face: Face, x: &Vector, d: &Vector) -> Vector {
        let height = d.dot(x);
        let gradient = match (face, self.side) {
            (Face::Low, _) => return -d,
            (Face::High, _) => return *d,
            (Face::Side, Side::Quadric { alpha, beta, .. }) => x - d * (alpha * height + beta),
            (Face::Side, Side::Torus { height: centre, radius, .. }) => {
                let across = x - d * height;
                let rho = across.norm().max(f64::MIN_POSITIVE);
                d * (height - centre) + across * ((rho - radius).max(0.0) / rho)
            }
        };
        gradient.try_normalize(1e-12).unwrap_or(*d)
    }

    /// Whether a point at a height and a distance from the axis lies in the solid grown by `margin` mm along the radius.
    #[cfg(test)]
    pub(super) fn holds(&self, height: f64, rho: f64, margin: f64) -> bool {
        let beside = match self.side {
            Side::Quadric { alpha, beta, gamma } => {
                let inner = (rho - margin).max(0.0);
                inner * inner + height * height - alpha * height * height - 2.0 * beta * height - gamma <= 0.0
            }
            Side::Torus { height: centre, radius, arc } => {
                (rho - radius).max(0.0).hypot(height - centre) <= arc + margin
            }
        };
        beside && height >= self.low - margin.min(0.0).abs().max(margin) && height <= self.high + margin
    }
}
