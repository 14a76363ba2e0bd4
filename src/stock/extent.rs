//! What a moving solid covers of a line: two ends with the moment and the face of the solid at each. Uses `geometry`.

use super::solid::Face;

/// An end of what is covered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct End {
    /// Place on the line, mm.
    pub(super) s: f64,
    /// Share of the stretch, 0 to 1.
    pub(super) t: f64,
    /// Face of the solid that reaches it.
    pub(super) face: Face,
}

/// The covered part of a line, lower end first.
pub(super) type Extent = [End; 2];

/// Gathers places that belong to a convex set on a line.
#[derive(Default)]
pub(super) struct Gather {
    extent: Option<Extent>,
}

impl Gather {
    pub(super) fn add(&mut self, s: f64, t: f64, face: Face) {
        let end = End { s, t, face };
        match &mut self.extent {
            None => self.extent = Some([end, end]),
            Some([low, high]) => {
                if s < low.s {
                    *low = end;
                }
                if s > high.s {
                    *high = end;
                }
            }
        }
    }

    pub(super) fn extent(self) -> Option<Extent> {
        self.extent
    }
}

/// Real roots of a x^2 + 2 b x + c, by the form that does not cancel; none where a and b vanish.
pub(super) fn roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return [None, None];
    }
    let q = -(b + discriminant.sqrt().copysign(b));
    let first = (a != 0.0).then(|| q / a).filter(|x| x.is_finite());
    let second = (q != 0.0).then(|| c / q).filter(|x| x.is_finite());
    [first, second.or(first)]
}
