//! How fast the rotary axes may turn with TCP on from wherever the machine stands. Uses `geometry`.

use super::model::Carrier;
use super::setup::Setup;
use crate::geometry::{Point, Vector};

impl Setup {
    /// Speed, rad/s, root of the sum of squares of both rotary axes, at which they may turn with TCP on from any place
    /// within the travels without making a linear axis faster than it can: the least speed over the levers at which the
    /// axes turn tip or part.
    pub fn careful_turn(&self) -> f64 {
        let machine = self.machine();
        let least = |speeds: &mut dyn Iterator<Item = f64>| speeds.fold(f64::INFINITY, f64::min);
        let linear = least(&mut machine.linear.iter().map(|axis| axis.speed));
        let rotary = least(&mut machine.rotary.iter().filter(|axis| axis.is_present()).map(|axis| axis.speed));
        // Where one rotary axis carries the other, its turn moves the other's pivot about its own.
        let apart = (machine.rotary[1].pivot - machine.rotary[0].pivot).norm();
        let arm = |from: &Point| (machine.spindle.gauge_point - from).norm() + self.tool_length() + apart;
        let heads = || machine.rotary.iter().filter(|axis| axis.on == Carrier::Head && axis.is_present());
        // From the gauge point at rotary zero the tip goes no further than this.
        let swing = self.tool_length() + heads().map(|axis| 2.0 * arm(&axis.pivot)).sum::<f64>();
        let levers = machine.rotary.iter().filter(|axis| axis.is_present()).map(|axis| match axis.on {
            Carrier::Head => arm(&axis.pivot),
            Carrier::Table => {
                let farthest = self.corners().map(|corner| (corner - axis.pivot).norm()).fold(0.0, f64::max);
                farthest + swing + 2.0 * apart
            }
        });
        let lever = levers.map(|lever| lever * lever).sum::<f64>().sqrt();
        rotary.min(linear / lever.max(f64::MIN_POSITIVE))
    }

    /// The gauge point at rotary zero in the corners of the linear travels, machine frame, mm.
    fn corners(&self) -> impl Iterator<Item = Point> {
        let machine = self.machine();
        let gauge = machine.spindle.gauge_point;
        (0..8_u8).map(move |corner| {
            let shift = machine.linear.iter().enumerate().map(|(index, axis)| {
                axis.direction.into_inner() * if corner >> index & 1 == 0 { axis.min } else { axis.max }
            });
            gauge + shift.sum::<Vector>()
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::geometry::Point;
    use crate::machine::{BUILTIN, Machine, Setup};
    use proptest::prelude::*;

    proptest! {
        /// Small turns from any place within the travels, at that speed.
        #[test]
        fn no_linear_axis_is_too_fast(
            machine in 0..BUILTIN.len(), place in prop::array::uniform3(0.0..1.0), turned in prop::array::uniform2(-2.0..2.0),
            way in 0.0..std::f64::consts::TAU,
        ) {
            let machine = Machine::named(BUILTIN[machine].0).unwrap();
            let setup = Setup::at(&machine, [0.0; 3], 100.0).unwrap();
            let linear = std::array::from_fn(|k| {
                let axis = &machine.linear[k];
                axis.min + (axis.max - axis.min) * place[k]
            });
            let tip: Point = setup.forward(&crate::machine::AxisPosition { linear, rotary: turned }).tip;
            let step = 1e-5;
            let next = [turned[0] + step * way.cos(), turned[1] + step * way.sin()];
            let [before, after] = [turned, next].map(|rotary| setup.with_rotary(&tip, rotary).linear);
            let seconds = step / setup.careful_turn();
            for (axis, (before, after)) in machine.linear.iter().zip(before.into_iter().zip(after)) {
                prop_assert!((after - before).abs() / seconds <= axis.speed * (1.0 + 1e-4), "{}", axis.letter);
            }
        }
    }
}
