//! What errors of the machine would do to the part: each pivot, axis direction and angle is off by its tolerance while the
//! control goes on reckoning with the nominal machine. Uses `geometry`, `machine`, `simulate` and the deviation measured.
//!
//! To first order the change of the deviation at a sample is that of the tool's point which touches there, along the
//! part's normal: `s = n . dp`, since at a touch the depth is stationary in time. For a tool pose `(t, a)` that becomes
//! `(t', a')` the point at height `h` and radial offset `r` moves by
//!
//! ```text
//! dp = (t' - t) + h (a' - a) - a ((a' - a) . r)
//! ```

use super::deviation::PartDeviation;
use super::measured::MeasuredSample;
use super::record::{ParameterRecord, UncertaintyRecord};
use crate::geometry::Vector;
use crate::machine::{AxisPosition, Machine, Setup, Tolerances};
use crate::motion::Pose;
use crate::simulate::ToolMotion;
use nalgebra::Rotation3;
use rayon::prelude::*;

/// One number of the machine, off by its tolerance.
struct Parameter {
    name: String,
    tolerance: f64,
    unit: &'static str,
    /// The machine as it then is.
    setup: Setup,
    /// By how much its rotary axes then stand further on, radians.
    further: [f64; 2],
}

/// The machine's tolerances as they show on the part; `None` where the machine file gives none.
pub(super) fn uncertainty(motion: &ToolMotion, part: &PartDeviation) -> Option<UncertaintyRecord> {
    let parameters = parameters(motion.setup(), motion.setup().machine().tolerances?);
    let touched: Vec<&MeasuredSample> = part.samples.iter().filter(|sample| sample.touch.is_some()).collect();
    let changes: Vec<Vec<f64>> = touched.par_iter().map(|sample| changes(motion, sample, &parameters)).collect();
    let largest = |of: &dyn Fn(&[f64]) -> f64| {
        let one = |(index, row): (usize, &Vec<f64>)| (of(row), index);
        let later = |a: (f64, usize), b: (f64, usize)| if b.0 > a.0 { b } else { a };
        changes.iter().enumerate().map(one).fold((0.0, 0), later)
    };
    let place = |index: usize| touched.get(index).map(|sample| sample.sample.point.into()).unwrap_or_default();
    let line = |index: usize| {
        let touch = touched.get(index).and_then(|sample| sample.touch);
        touch.and_then(|touch| motion.segments().get(touch.when.block)).map_or(0, |segment| segment.line)
    };
    let one = |(k, parameter): (usize, &Parameter)| {
        let (change, at) = largest(&|row| row.get(k).map_or(0.0, |change| change.abs()));
        ParameterRecord {
            name: parameter.name.clone(),
            tolerance: parameter.tolerance,
            unit: parameter.unit,
            change_max_mm: change,
            point_mm: place(at),
            line: line(at),
        }
    };
    let mut list: Vec<ParameterRecord> = parameters.iter().enumerate().map(one).collect();
    list.sort_by(|a, b| b.change_max_mm.total_cmp(&a.change_max_mm));
    let (worst, worst_at) = largest(&|row| row.iter().fold(0.0, |sum, change| sum + change.abs()));
    let (rss, rss_at) = largest(&|row| row.iter().fold(0.0, |sum, change| sum + change * change).sqrt());
    Some(UncertaintyRecord {
        worst_case_mm: worst,
        worst_case_point_mm: place(worst_at),
        rss_mm: rss,
        rss_point_mm: place(rss_at),
        parameters: list,
    })
}

/// Change of the deviation at a sample by each parameter, mm.
fn changes(motion: &ToolMotion, sample: &MeasuredSample, parameters: &[Parameter]) -> Vec<f64> {
    let Some(touch) = sample.touch else { return Vec::new() };
    let Some(segment) = motion.segments().get(touch.when.block) else { return Vec::new() };
    let axes = motion.axes(segment, touch.when.share);
    let nominal = motion.setup().forward(&axes);
    let normal = sample.sample.normal.0;
    let point = sample.sample.point + normal.into_inner() * touch.depth;
    let change = |parameter: &Parameter| {
        let [first, second] = axes.rotary;
        let rotary = [first + parameter.further[0], second + parameter.further[1]];
        let pose = parameter.setup.forward(&AxisPosition { rotary, ..axes });
        normal.dot(&moved(&nominal, &pose, &(point - nominal.tip)))
    };
    parameters.iter().map(change).collect()
}

/// How far a point of the tool, given from the nominal tip, goes from one pose to another nearby.
fn moved(from: &Pose, to: &Pose, point: &Vector) -> Vector {
    let axis = from.axis.into_inner();
    let height = point.dot(&axis);
    let radial = point - axis * height;
    let turned = to.axis.into_inner() - axis;
    (to.tip - from.tip) + turned * height - axis * turned.dot(&radial)
}

/// Length of what is left of a unit vector across an axis below which it counts as along it.
const ALONG: f64 = 1e-6;

/// Every number of the machine that has a tolerance.
fn parameters(setup: &Setup, tolerances: Tolerances) -> Vec<Parameter> {
    let mut list = Vec::new();
    let mut add =
        |name: String, tolerance: f64, unit: &'static str, further: [f64; 2], change: &dyn Fn(&mut Machine)| {
            let mut machine = setup.machine().clone();
            change(&mut machine);
            if tolerance > 0.0
                && let Ok(setup) = Setup::at(&machine, setup.work_offset(), setup.tool_length())
            {
                list.push(Parameter { name, tolerance, unit, setup, further });
            }
        };
    const STILL: [f64; 2] = [0.0; 2];
    for (slot, axis) in setup.machine().rotary.iter().enumerate().filter(|(_, axis)| axis.is_present()) {
        let letter = axis.letter;
        let direction = axis.direction.into_inner();
        for (name, unit) in [('X', Vector::x()), ('Y', Vector::y()), ('Z', Vector::z())] {
            // Along itself an axis has no pivot, and about itself no direction.
            let across = unit - direction * direction.dot(&unit);
            if across.norm() < ALONG {
                continue;
            }
            add(format!("pivot of {letter} along {name}"), tolerances.pivot, "mm", STILL, &|machine| {
                if let Some(axis) = machine.rotary.get_mut(slot) {
                    axis.pivot += unit * tolerances.pivot;
                }
            });
            add(format!("{letter} tilted about {name}"), tolerances.direction.to_degrees(), "deg", STILL, &|machine| {
                if let Some(axis) = machine.rotary.get_mut(slot) {
                    axis.direction = Rotation3::new(unit * tolerances.direction) * axis.direction;
                }
            });
        }
        let further = [0, 1].map(|index| if index == slot { tolerances.angle } else { 0.0 });
        add(format!("angle of {letter}"), tolerances.angle.to_degrees(), "deg", further, &|_| {});
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::motion::Pose;
    use crate::verify::tests::fixtures::pose;

    #[test]
    fn a_point_of_the_tool_goes_with_tip_and_axis() {
        let from = pose([1.0, 2.0, 3.0], [0.0, 0.0, 1.0]);
        let turn = Rotation3::new(Vector::new(2e-6, -1e-6, 0.0));
        let to = Pose { tip: from.tip + Vector::new(1e-6, 2e-6, -1e-6), axis: turn * from.axis };
        let point = Vector::new(4.0, -3.0, 20.0);
        let wanted = (to.tip + turn * point) - Point::from(from.tip.coords + point);
        assert!((moved(&from, &to, &point) - wanted).norm() < 1e-10);
    }
}
