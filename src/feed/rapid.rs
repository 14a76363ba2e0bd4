//! Rapids of controls that keep only the speeds of what the program names. Uses `geometry` and `machine`.

use super::block::Block;
use crate::geometry::Vector;
use crate::machine::{AxisPosition, Setup};

/// Whether a rapid with TCP on may make an axis faster than it can, because the control does not watch the axes then: it
/// goes the straight way of the tip with the speeds that X, Y and Z have, and turns the rotary axes along with theirs.
/// A short rapid may come to that speed, too, where its neighbours go on straight.
pub(super) fn passes_speeds(setup: &Setup, [from, to]: &[AxisPosition; 2], block: &Block) -> bool {
    let machine = setup.machine();
    if machine.control.options.tcp_limits_axes {
        return false;
    }
    let tip: Vector = setup.forward(to).tip - setup.forward(from).tip;
    let way = [tip.x, tip.y, tip.z, to.rotary[0] - from.rotary[0], to.rotary[1] - from.rotary[1]];
    // Top speed of the share of the way, which grows from 0 to 1.
    let shares = way.iter().zip(machine.speeds()).map(|(way, limit)| limit / way.abs());
    let top = shares.fold(f64::INFINITY, f64::min);
    let mut axes = block.busiest[0].iter().zip(machine.speeds());
    axes.any(|(busiest, limit)| *busiest > 0.0 && busiest * top > limit * (1.0 + ROUNDING))
}

/// How much of a limit may be passed by rounding.
const ROUNDING: f64 = 1e-6;
