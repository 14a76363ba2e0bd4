//! The body of a tool as a union of pieces, each one stack of meridian elements, in the half plane of height and radius.
//! Uses `tool`.
//!
//! A piece is solid: the slab between two heights, out to its profile. Within a piece the radius is a concave function
//! of the height, so the piece is convex, or it is one hollow arc. Of a convex piece every tangent plane is a support
//! plane; of a hollow one every tangent sphere of its arc's radius lies outside: [`Piece::clear_radius`] is that radius.

use crate::tool::meridian::{ArcSide, Element};

/// Joints whose normals turn the wrong way by less than this count as smooth, radians.
const SMOOTH: f64 = 1e-9;
/// Radial part of a normal below which the place where it meets the axis is too far away to be of use.
pub(super) const NEAR_POLE: f64 = 0.2;

/// One profile element that spans a positive height.
#[derive(Clone, Copy, Debug)]
pub(super) enum Profile {
    /// `radius + slope (h - low)`.
    Line { radius: f64, slope: f64 },
    /// Upper half of a circle about (centre height, centre radius).
    Bulge { height: f64, radius: f64, arc: f64 },
    /// Lower half of such a circle.
    Hollow { height: f64, radius: f64, arc: f64 },
}

/// A profile element with the heights and radii of its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) low_radius: f64,
    pub(super) high_radius: f64,
    pub(super) profile: Profile,
    /// Axial parts of the outward unit normals at both ends; infinite where the axis is reached and no normal goes on.
    normals: (f64, f64),
}

/// A round part of the surface, which planes that turn a little about the tool go on touching.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cap {
    /// By how much the axial part of the plane's unit normal may change.
    pub(super) freedom: f64,
    /// Height at which the normal meets the axis, mm.
    pub(super) pivot: f64,
}

/// A convex piece, or one hollow arc, with the flat ends that close it.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// From below, heights joining.
    pub(super) spans: Vec<Span>,
    /// Radius of a sphere that touches the piece from outside anywhere without entering it; infinite where convex.
    pub(super) clear_radius: f64,
}

/// The pieces of the flutes, or of shank and holder.
#[derive(Clone, Debug)]
pub(super) struct Body {
    pub(super) pieces: Vec<Piece>,
    /// Lowest and highest height, mm above the tip.
    pub(super) heights: (f64, f64),
    /// Largest radius, mm.
    pub(super) radius: f64,
}

/// The point of a piece nearest to a point outside it, with the unit normal there, both in the half plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub(super) height: f64,
    pub(super) radius: f64,
    pub(super) axial: f64,
    pub(super) radial: f64,
    /// The profile's own normal (axial, radial) where the point lies on the profile: at a rim it leans otherwise.
    pub(super) profile: Option<(f64, f64)>,
    /// The cap on which the point lies, if any.
    pub(super) cap: Option<Cap>,
}

/// The point of a piece that lies farthest along a direction, in the half plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Support {
    pub(super) height: f64,
    pub(super) radius: f64,
    /// The cap on which the point lies, if any.
    pub(super) cap: Option<Cap>,
}

impl Span {
    fn of(element: &Element) -> Option<Self> {
        let (start, end) = (element.start(), element.end());
        if end.height - start.height <= 1e-12 {
            return None;
        }
        let profile = match element {
            Element::Line { .. } => {
                let slope = (end.radius - start.radius) / (end.height - start.height);
                Profile::Line { radius: start.radius, slope }
            }
            Element::Arc { centre, radius, side: ArcSide::Convex, .. } => {
                // A ball's centre lies on the axis but for rounding.
                let off = if centre.radius.abs() > 1e-13 * radius { centre.radius } else { 0.0 };
                Profile::Bulge { height: centre.height, radius: off, arc: *radius }
            }
            Element::Arc { centre, radius, side: ArcSide::Concave, .. } => {
                Profile::Hollow { height: centre.height, radius: centre.radius, arc: *radius }
            }
        };
        let (low, high) = (start.height, end.height);
        let (low_radius, high_radius) = (start.radius.max(0.0), end.radius.max(0.0));
        let mut span = Self { low, high, low_radius, high_radius, profile, normals: (0.0, 0.0) };
        let beyond_pole = |axial: f64| if 1.0 - axial.abs() > SMOOTH { axial } else { axial * f64::INFINITY };
        span.normals =
            (beyond_pole(span.normal_at(low, low_radius).0), beyond_pole(span.normal_at(high, high_radius).0));
        Some(span)
    }

    /// What a plane that touches the body here, with this unit normal, may turn by without leaving a round part of it;
    /// `None` where the body is straight, where its arc bends about a point beyond the axis, and near the pole of a torus.
    ///
    /// The support of a torus of centre (h, r) and arc a in a direction with axial part mu is
    /// `mu h + sqrt(1 - mu^2) r + a`: concave in mu for r >= 0, so never above its tangent, whose slope is the height at
    /// which the normal meets the axis.
    fn cap(&self, (axial, radial): (f64, f64)) -> Option<Cap> {
        let Profile::Bulge { height, radius, .. } = self.profile else { return None };
        let freedom = (axial - self.normals.0).min(self.normals.1 - axial);
        let pivot = match radius {
            0.0 => height,
            r if r > 0.0 && radial > NEAR_POLE => height - r * axial / radial,
            _ => return None,
        };
        (freedom > 0.0).then_some(Cap { freedom, pivot })
    }

    /// Radius of the body at a height of this span.
    pub(super) fn radius_at(&self, height: f64) -> f64 {
        match self.profile {
            Profile::Line { radius, slope } => radius + slope * (height - self.low),
            Profile::Bulge { height: centre, radius, arc } => {
                radius + (arc * arc - (height - centre).powi(2)).max(0.0).sqrt()
            }
            Profile::Hollow { height: centre, radius, arc } => {
                radius - (arc * arc - (height - centre).powi(2)).max(0.0).sqrt()
            }
        }
    }

    /// Outward unit normal (axial, radial) at a point of this span's surface.
    pub(super) fn normal_at(&self, height: f64, rho: f64) -> (f64, f64) {
        match self.profile {
            Profile::Line { slope, .. } => {
                let length = (slope * slope + 1.0).sqrt();
                (-slope / length, 1.0 / length)
            }
            Profile::Bulge { height: centre, radius, .. } => unit(height - centre, rho - radius),
            Profile::Hollow { height: centre, radius, .. } => unit(centre - height, radius - rho),
        }
    }

    /// Nearest point of the profile itself, ends included.
    fn nearest(&self, height: f64, rho: f64) -> (f64, f64) {
        match self.profile {
            Profile::Line { .. } => {
                nearest_on_segment((self.low, self.low_radius), (self.high, self.high_radius), (height, rho))
            }
            Profile::Bulge { height: centre, radius, arc } => {
                let (axial, radial) = unit(height - centre, rho - radius);
                self.on_arc_or_end((centre + arc * axial, radius + arc * radial), radial > 0.0, (height, rho))
            }
            Profile::Hollow { height: centre, radius, arc } => {
                let (axial, radial) = unit(height - centre, rho - radius);
                self.on_arc_or_end((centre + arc * axial, radius + arc * radial), radial < 0.0, (height, rho))
            }
        }
    }

    fn on_arc_or_end(&self, foot: (f64, f64), right_half: bool, from: (f64, f64)) -> (f64, f64) {
        if right_half && (self.low..=self.high).contains(&foot.0) {
            return foot;
        }
        let ends = [(self.low, self.low_radius), (self.high, self.high_radius)];
        let square = |end: (f64, f64)| (end.0 - from.0).powi(2) + (end.1 - from.1).powi(2);
        if square(ends[0]) <= square(ends[1]) { ends[0] } else { ends[1] }
    }
}

fn unit(axial: f64, radial: f64) -> (f64, f64) {
    let length = (axial * axial + radial * radial).sqrt();
    if length > 0.0 { (axial / length, radial / length) } else { (0.0, 1.0) }
}

fn nearest_on_segment(a: (f64, f64), b: (f64, f64), p: (f64, f64)) -> (f64, f64) {
    let (dh, dr) = (b.0 - a.0, b.1 - a.1);
    let square = dh * dh + dr * dr;
    let share = if square > 0.0 { (((p.0 - a.0) * dh + (p.1 - a.1) * dr) / square).clamp(0.0, 1.0) } else { 0.0 };
    (a.0 + share * dh, a.1 + share * dr)
}

impl Piece {
    fn low(&self) -> Option<&Span> {
        self.spans.first()
    }

    fn high(&self) -> Option<&Span> {
        self.spans.last()
    }

    /// The nearest point of the surface; `None` when (height, rho) lies in the piece.
    pub(super) fn nearest(&self, height: f64, rho: f64) -> Option<Nearest> {
        let (low, high) = (self.low()?, self.high()?);
        if let Some(span) = self.spans.iter().find(|s| (s.low..=s.high).contains(&height))
            && rho <= span.radius_at(height)
        {
            return None;
        }
        let from = (height, rho);
        let square = |p: (f64, f64)| (p.0 - height).powi(2) + (p.1 - rho).powi(2);
        let (mut foot, mut best, mut owner) = ((0.0, 0.0), f64::INFINITY, low);
        let mut consider = |point: (f64, f64), span| {
            let square = square(point);
            if square < best {
                (foot, best, owner) = (point, square, span);
            }
        };
        // Below or above the slab the end discs count, beside it the profile; the corners belong to both.
        if height < low.low {
            consider(nearest_on_segment((low.low, 0.0), (low.low, low.low_radius), from), low);
        } else if height > high.high {
            consider(nearest_on_segment((high.high, 0.0), (high.high, high.high_radius), from), high);
        }
        for span in &self.spans {
            consider(span.nearest(height, rho), span);
        }
        let distance = best.sqrt();
        let (axial, radial) = if distance > 1e-9 {
            ((height - foot.0) / distance, (rho - foot.1) / distance)
        } else {
            owner.normal_at(foot.0, foot.1)
        };
        let on_profile = (owner.low..=owner.high).contains(&foot.0) && foot.1 >= owner.radius_at(foot.0) - 1e-12;
        let profile = on_profile.then(|| owner.normal_at(foot.0, foot.1));
        let cap = owner.cap((axial, radial));
        Some(Nearest { height: foot.0, radius: foot.1, axial, radial, profile, cap })
    }
}

impl Piece {
    /// Distance of a point inside a convex piece from its surface; `None` outside, and in hollow pieces.
    pub(super) fn depth(&self, height: f64, rho: f64) -> Option<f64> {
        let (low, high) = (self.low()?, self.high()?);
        let own = self.spans.iter().find(|s| (s.low..=s.high).contains(&height))?;
        if self.clear_radius.is_finite() || rho > own.radius_at(height) {
            return None;
        }
        let discs = (height - low.low).min(high.high - height);
        let to = |(h, r): (f64, f64)| (h - height).hypot(r - rho);
        Some(self.spans.iter().map(|span| to(span.nearest(height, rho))).fold(discs, f64::min))
    }

    /// Height and radius of the point that lies farthest along a direction with a radial part of 0 or more; of a hollow
    /// piece, of its hull.
    pub(super) fn support(&self, axial: f64, radial: f64) -> Support {
        let along = |p: (f64, f64)| axial * p.0 + radial * p.1;
        let mut best = self.low().map_or((0.0, 0.0), |span| (span.low, span.low_radius));
        let mut cap = None;
        for span in &self.spans {
            let on_arc = match span.profile {
                Profile::Bulge { height, radius, arc } => Some((height + arc * axial, radius + arc * radial)),
                Profile::Line { .. } | Profile::Hollow { .. } => None,
            };
            let on_arc = on_arc.filter(|p| (span.low..=span.high).contains(&p.0));
            for end in [(span.low, span.low_radius), (span.high, span.high_radius)] {
                if along(end) > along(best) {
                    (best, cap) = (end, None);
                }
            }
            if let Some(point) = on_arc.filter(|p| along(*p) >= along(best)) {
                (best, cap) = (point, span.cap((axial, radial)));
            }
        }
        Support { height: best.0, radius: best.1, cap }
    }
}

impl Body {
    /// Gathers elements into pieces; flat elements only close them.
    pub(super) fn of<'a>(elements: impl Iterator<Item = &'a Element>) -> Self {
        let mut pieces: Vec<Piece> = Vec::new();
        let mut open: Option<Span> = None;
        for element in elements {
            let Some(span) = Span::of(element) else {
                open = None;
                continue;
            };
            let hollow = matches!(span.profile, Profile::Hollow { .. });
            let joins = open.is_some_and(|last| !hollow && turns_outward(&last, &span));
            match pieces.last_mut().filter(|_| joins) {
                Some(piece) => piece.spans.push(span),
                None => pieces.push(Piece { spans: vec![span], clear_radius: clear_radius(&span) }),
            }
            open = Some(span).filter(|_| !hollow);
        }
        let spans = || pieces.iter().flat_map(|p| &p.spans);
        let heights =
            spans().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s| (s.low.min(low), s.high.max(high)));
        let radius = spans().map(widest).fold(0.0, f64::max);
        Self { pieces, heights, radius }
    }
}

fn widest(span: &Span) -> f64 {
    let ends = span.low_radius.max(span.high_radius);
    match span.profile {
        Profile::Bulge { height, radius, arc } if (span.low..=span.high).contains(&height) => ends.max(radius + arc),
        _ => ends,
    }
}

/// True where the body stays convex across the joint of two spans.
fn turns_outward(below: &Span, above: &Span) -> bool {
    let gap = (below.high - above.low).hypot(below.high_radius - above.low_radius);
    let (a, b) = (below.normal_at(below.high, below.high_radius), above.normal_at(above.low, above.low_radius));
    gap < 1e-9 && b.0.atan2(b.1) >= a.0.atan2(a.1) - SMOOTH
}

/// At the rim of a hollow span the normals fan out between arc and end disc; the sphere shrinks with the sine of the
/// angle between them.
fn clear_radius(span: &Span) -> f64 {
    let Profile::Hollow { arc, .. } = span.profile else { return f64::INFINITY };
    let low = span.normal_at(span.low, span.low_radius).1;
    let high = span.normal_at(span.high, span.high_radius).1;
    arc * low.min(high).max(0.0)
}
