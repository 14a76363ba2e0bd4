//! Sparse least squares and the least largest error, knowing nothing of tools. Uses nothing of the crate.
//!
//! Unknowns are ordered so that each residual touches a short contiguous run of them (the control points of one
//! B-spline span), which keeps the normal matrix banded: assembly and factorization are linear in the problem's size. A
//! few unknowns may be shared by all residuals ([`bordered`]).

pub mod banded;
pub mod bordered;
pub mod descent;
pub mod levenberg_marquardt;
pub mod minimax;

pub use banded::BandedMatrix;
pub use bordered::{BorderedEquations, BorderedLeastSquares, minimize_bordered};
pub use descent::{Outcome, Settings};
pub use levenberg_marquardt::{LeastSquares, NormalEquations, minimize};
