//! A smooth global field of axis directions on the surface, and two scalar splines made from it: level sets of G are
//! the strips' borders, level sets of H the footprints of the axis.

mod axis;
mod levels;
mod sheet;

#[cfg(test)]
mod tests;

pub(super) use axis::{AxisField, Wish};
pub(super) use levels::Field;
pub(super) use sheet::Sheet;
