//! How far axis points leave their chords inside a block. Uses `geometry` and `machine`.
//!
//! A curve leaves its chord over a parameter interval w by at most max|p''| w^2 / 8. The axis point is a sum of vectors,
//! each turned by some of the joints. Joints of total rate W turn a vector of length r that itself moves with speed v
//! and acceleration a; the sum's second derivative is then at most W^2 r + 2 W v + a.

use super::segment::{Path, Segment};
use crate::geometry::{Point, Vector};
use crate::machine::{AxisZero, Carrier, Machine, RotaryAxis, Setup};
use nalgebra::Matrix3;

/// Bound on how far the axis point at `height` leaves its chord between two shares, mm.
pub(super) fn chord_bound(setup: &Setup, segment: &Segment, shares: (f64, f64), height: f64) -> f64 {
    let rate = |index: usize| (segment.to.rotary[index] - segment.from.rotary[index]).abs();
    let tilt = (rate(0) + rate(1)).powi(2) * height.abs();
    let second_derivative = match &segment.path {
        Path::Tip { .. } => tilt,
        Path::TipArc(arc) => tilt + arc.derivative_bounds().1,
        Path::Vector { from, to } => from.axis_angle(to).powi(2) * height.abs(),
        Path::Joints => {
            let way = Vector::from(segment.to.linear) - Vector::from(segment.from.linear);
            let columns = directions(setup.machine());
            let place = |share: f64| columns * (Vector::from(segment.from.linear) + way * share);
            let linear = Linear {
                places: [place(shares.0), place(shares.1)],
                slack: 0.0,
                speed: (columns * way).norm(),
                acceleration: 0.0,
            };
            joint_bend(setup, &linear, height, rate)
        }
        Path::JointArc(arc) => {
            let (speed, acceleration) = arc.derivative_bounds();
            let columns = directions(setup.machine());
            let place = |share: f64| columns * arc.point(share).coords;
            let slack = acceleration * (shares.1 - shares.0).powi(2) / 8.0;
            let linear = Linear { places: [place(shares.0), place(shares.1)], slack, speed, acceleration };
            joint_bend(setup, &linear, height, rate)
        }
    };
    second_derivative * (shares.1 - shares.0).powi(2) / 8.0
}

/// What the linear axes do in a stretch of a segment, machine frame, per share.
struct Linear {
    /// At both ends.
    places: [Vector; 2],
    /// How far it leaves the chord between them.
    slack: f64,
    speed: f64,
    acceleration: f64,
}

fn directions(machine: &Machine) -> Matrix3<f64> {
    Matrix3::from_columns(&machine.linear.each_ref().map(|axis| axis.direction.into_inner()))
}

/// Bound on the second derivative of the axis point at `height` with TCP off.
fn joint_bend(setup: &Setup, linear: &Linear, height: f64, rate: impl Fn(usize) -> f64) -> f64 {
    let machine = setup.machine();
    let spindle = &machine.spindle;
    let lever = setup.tool_length() - height;
    let tool_point = spindle.gauge_point - spindle.axis.into_inner() * lever;
    let shift = match spindle.axis_zero {
        AxisZero::GaugePoint => Vector::zeros(),
        AxisZero::Tip => spindle.axis.into_inner() * setup.tool_length(),
    };
    let on = |carrier: Carrier| {
        let chain = machine.chain.iter().filter_map(|index| Some((*index, machine.rotary.get(*index)?)));
        chain.filter(move |(_, axis)| axis.on == carrier).collect::<Vec<(usize, &RotaryAxis)>>()
    };
    // In the order of the chain from the part to the tool.
    let (tables, heads) = (on(Carrier::Table), on(Carrier::Head));
    let mut bend = 0.0;
    // Part side: p = c_1 + R_1(c_2 - c_1) + ... + R_1 ... R_n (u - c_n).
    let mut total = 0.0;
    for pair in tables.windows(2) {
        if let [(outer, first), (_, second)] = pair {
            total += rate(*outer);
            bend += total * total * (second.pivot - first.pivot).norm();
        }
    }
    total += tables.last().map_or(0.0, |(index, _)| rate(*index));
    // Linear axes, and what stands still beside them.
    let base = heads.first().map_or(tool_point, |(_, axis)| axis.pivot) + shift;
    let origin = tables.last().map_or(Point::from(base.coords), |(_, axis)| axis.pivot);
    let reach = linear.places.map(|place| (place + (base - origin)).norm());
    let farthest = reach[0].max(reach[1]) + linear.slack;
    bend += total * (total * farthest + 2.0 * linear.speed) + linear.acceleration;
    // Tool side: u = c_1 + K_1(c_2 - c_1) + ... + K_1 ... K_m (tool point - c_m).
    for (position, (index, axis)) in heads.iter().enumerate() {
        let end = heads.get(position + 1).map_or(tool_point, |(_, next)| next.pivot);
        total += rate(*index);
        bend += total * total * (end - axis.pivot).norm();
    }
    bend
}
