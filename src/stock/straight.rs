//! What a quadric solid that is only shifted covers of a line, in closed form. Uses `geometry`.
//!
//! The solid moves by v over shares t of 0 to 1; the line is o + s u, from the tip at its start. Covered are the s with
//! o + s u - t v in the solid for some t: the shadow of a convex set of the (s, t) plane, bounded by one conic
//!
//! `A s^2 - 2 B s t + C t^2 + 2 D s - 2 E t + F <= 0`
//!
//! and four straight lines (t = 0, t = 1, both end discs). The shadow's ends are corners of that set, or where the conic
//! turns back. A and B, C depend on the motion only, D, E and F on the line.

use super::extent::{Extent, Gather, roots};
use super::solid::{Face, Side, Solid};
use crate::geometry::Vector;

/// Rounding of heights, mm, and of the conic, mm^2: far below any resolution, so that no corner is lost between two
/// borders that meet in it.
const HEIGHT_SLACK: f64 = 1e-9;
const CONIC_SLACK: f64 = 1e-9;

/// A quadric solid with its shift, for lines of one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shifted {
    low: f64,
    high: f64,
    alpha: f64,
    beta: f64,
    gamma: f64,
    axis: Vector,
    shift: Vector,
    /// Coordinate that the lines run along.
    along: usize,
    du: f64,
    dv: f64,
    a: f64,
    b: f64,
    c: f64,
}

impl Shifted {
    /// A solid about `axis`, shifted by `shift` mm, for lines along coordinate `along`; `None` for tori.
    pub(super) fn new(solid: &Solid, axis: Vector, shift: Vector, along: usize) -> Option<Self> {
        let Side::Quadric { alpha, beta, gamma } = solid.side else { return None };
        let (du, dv) = (axis[along], axis.dot(&shift));
        Some(Self {
            low: solid.low,
            high: solid.high,
            alpha,
            beta,
            gamma,
            axis,
            shift,
            along,
            du,
            dv,
            a: 1.0 - alpha * du * du,
            b: shift[along] - alpha * du * dv,
            c: shift.norm_squared() - alpha * dv * dv,
        })
    }

    /// What is covered of the line through `o`, from the tip at the start.
    pub(super) fn extent(&self, o: &Vector) -> Option<Extent> {
        let line = OnLine::new(self, o);
        let mut gather = Gather::default();
        if line.turning_points(&mut gather) {
            return gather.extent();
        }
        line.standing(0.0, &mut gather);
        if self.c != 0.0 {
            line.standing(1.0, &mut gather);
            line.discs(&mut gather);
        }
        gather.extent()
    }
}

/// The conic of one line.
struct OnLine<'a> {
    of: &'a Shifted,
    height: f64,
    d: f64,
    e: f64,
    f: f64,
}

impl<'a> OnLine<'a> {
    fn new(of: &'a Shifted, o: &Vector) -> Self {
        let height = of.axis.dot(o);
        let lever = of.alpha * height + of.beta;
        Self {
            of,
            height,
            d: o[of.along] - lever * of.du,
            e: o.dot(&of.shift) - lever * of.dv,
            f: o.norm_squared() - (lever + of.beta) * height - of.gamma,
        }
    }

    fn in_slab(&self, s: f64, t: f64) -> bool {
        let height = self.height + s * self.of.du - t * self.of.dv;
        height >= self.of.low - HEIGHT_SLACK && height <= self.of.high + HEIGHT_SLACK
    }

    /// Where the conic turns back: its derivative by t vanishes. True where it is an ellipse and both places count: then
    /// nothing lies beyond them.
    fn turning_points(&self, gather: &mut Gather) -> bool {
        let Shifted { a, b, c, .. } = *self.of;
        if c <= 0.0 {
            return false;
        }
        let inverse = 1.0 / c;
        let share = b * inverse;
        let mut counted = 0;
        for s in roots(a - b * share, self.d - self.e * share, self.f - self.e * self.e * inverse).into_iter().flatten()
        {
            let t = (b * s + self.e) * inverse;
            if (0.0..=1.0).contains(&t) && self.in_slab(s, t) {
                gather.add(s, t, Face::Side);
                counted += 1;
            }
        }
        counted == 2 && a - b * share > 0.0
    }

    /// The solid standing still at one of both ends of its way.
    fn standing(&self, t: f64, gather: &mut Gather) {
        let Shifted { a, b, c, du, dv, low, high, .. } = *self.of;
        let (linear, constant) = (self.d - b * t, self.f + (c * t - 2.0 * self.e) * t);
        for s in roots(a, linear, constant).into_iter().flatten() {
            if self.in_slab(s, t) {
                gather.add(s, t, Face::Side);
            }
        }
        if du.abs() < 1e-12 {
            return;
        }
        for (limit, face) in [(low, Face::Low), (high, Face::High)] {
            let s = (limit - self.height + t * dv) / du;
            if (a * s + 2.0 * linear) * s + constant <= CONIC_SLACK {
                gather.add(s, t, face);
            }
        }
    }

    /// Where the rims of the end discs pass the line on the way.
    fn discs(&self, gather: &mut Gather) {
        let Shifted { a, b, c, du, dv, low, high, .. } = *self.of;
        for (limit, face) in [(low, Face::Low), (high, Face::High)] {
            let off = limit - self.height;
            if du.abs() > dv.abs() {
                let (s0, m) = (off / du, dv / du);
                let (square, linear) = ((a * m - 2.0 * b) * m + c, (a * m - b) * s0 + self.d * m - self.e);
                for t in roots(square, linear, (a * s0 + 2.0 * self.d) * s0 + self.f).into_iter().flatten() {
                    if (0.0..=1.0).contains(&t) {
                        gather.add(s0 + m * t, t, face);
                    }
                }
            } else if dv != 0.0 {
                let (t0, m) = (-off / dv, du / dv);
                let (square, linear) = ((c * m - 2.0 * b) * m + a, (c * m - b) * t0 + self.d - self.e * m);
                for s in roots(square, linear, (c * t0 - 2.0 * self.e) * t0 + self.f).into_iter().flatten() {
                    let t = t0 + m * s;
                    if (0.0..=1.0).contains(&t) {
                        gather.add(s, t, face);
                    }
                }
            }
        }
    }
}
