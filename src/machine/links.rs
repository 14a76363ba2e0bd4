//! The links of a machine's chain: where the axes bring each, and how its points are accelerated on the way. Uses
//! `collide` and `geometry`.
//!
//! Both sides branch off from the base. On the table's side come the linear axes that move the table, then the rotary
//! axes on it; on the head's side the linear axes that move the head, then the rotary axes on it. Everything is given
//! with every axis at zero, in the machine frame.

use super::axes::AxisPosition;
use super::bodies::Link;
use super::model::{Carrier, Machine};
use super::setup::Setup;
use crate::collide::RigidSweep;
use crate::geometry::{Point, RigidMotion, Vector};
use nalgebra::{Matrix3, UnitQuaternion};

/// A link: the side, and how many axes lie between it and the base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) side: Carrier,
    pub(super) axes: usize,
}

/// How fast the axes move in a course over shares 0 to 1; the rotary axes turn evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisRates {
    /// Turn of each rotary axis in the order of the machine file, radians.
    pub rotary: [f64; 2],
    /// What the linear axes follow.
    pub linear: LinearRates,
}

/// What the linear axes follow in a course, with bounds on the first and the second derivative of its place by the
/// share, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinearRates {
    /// A way of their own, machine frame.
    Axes {
        /// First derivative.
        speed: f64,
        /// Second derivative.
        acceleration: f64,
    },
    /// A way of the tip in the part frame.
    Tip {
        /// First derivative.
        speed: f64,
        /// Second derivative.
        acceleration: f64,
    },
}

/// A way of all axes over shares 0 to 1.
pub trait AxisCourse: Sync {
    /// Where they are at a share.
    fn axes(&self, share: f64) -> AxisPosition;

    /// How fast they move.
    fn rates(&self) -> AxisRates;
}

/// A way on which every axis goes straight, or the tip does, while the rotary axes turn evenly.
pub(super) struct Hop<'a> {
    pub(super) setup: &'a Setup,
    pub(super) ends: [AxisPosition; 2],
    /// Tips at both ends in the part frame, where the tip goes straight between them.
    pub(super) tips: Option<[Point; 2]>,
}

impl AxisCourse for Hop<'_> {
    fn axes(&self, share: f64) -> AxisPosition {
        let straight = self.ends[0].interpolate(&self.ends[1], share);
        match self.tips {
            Some([from, to]) => self.setup.with_rotary(&(from + (to - from) * share), straight.rotary),
            None => straight,
        }
    }

    fn rates(&self) -> AxisRates {
        let [from, to] = &self.ends;
        let linear = match self.tips {
            Some([from, to]) => LinearRates::Tip { speed: (to - from).norm(), acceleration: 0.0 },
            None => {
                let way = self.setup.linear_directions().0 * (Vector::from(to.linear) - Vector::from(from.linear));
                LinearRates::Axes { speed: way.norm(), acceleration: 0.0 }
            }
        };
        AxisRates { rotary: [0, 1].map(|k: usize| to.rotary[k] - from.rotary[k]), linear }
    }
}

/// One axis of a branch.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// The linear axis of an index.
    Linear(usize),
    /// The rotary axis of an index in the machine file.
    Rotary(usize),
}

/// A point that moves: where it is at share 0, how far from it the points meant are, and bounds on its derivatives.
#[derive(Clone, Copy, Debug)]
struct Mover {
    at: Point,
    radius: f64,
    speed: f64,
    acceleration: f64,
}

impl Mover {
    /// Turned about a pivot at an even rate, radians a share, by `turn` at share 0.
    ///
    /// For y = R (x - c) + c with the rate w: |y'| <= |x'| + w |x - c| and |y''| <= |x''| + 2 w |x'| + w^2 |x - c|.
    fn turned(self, turn: &RigidMotion, pivot: &Point, rate: f64) -> Self {
        let reach = (self.at - pivot).norm() + self.radius + self.speed;
        Self {
            at: turn * self.at,
            radius: self.radius,
            speed: self.speed + rate * reach,
            acceleration: self.acceleration + rate * (2.0 * self.speed + rate * reach),
        }
    }

    fn shifted(self, shift: &Vector, speed: f64, acceleration: f64) -> Self {
        let (speed, acceleration) = (self.speed + speed, self.acceleration + acceleration);
        Self { at: self.at + shift, radius: self.radius, speed, acceleration }
    }
}

/// The axes of one side, from the base outward.
fn branch(machine: &Machine, side: Carrier) -> impl DoubleEndedIterator<Item = Step> + '_ {
    let linear = machine.linear_order.iter().filter(move |index| machine.linear[**index].on == side);
    // The chain runs from the part to the tool: outward on the head, inward on the table.
    let [first, second] = machine.chain;
    let rotary = match side {
        Carrier::Table => [second, first],
        Carrier::Head => [first, second],
    };
    let rotary = rotary.into_iter().filter(move |index| {
        let axis = &machine.rotary[*index];
        axis.on == side && axis.is_present()
    });
    linear.map(|index| Step::Linear(*index)).chain(rotary.map(Step::Rotary))
}

impl Place {
    /// The link that a body moves with.
    pub(super) fn of(machine: &Machine, link: Link) -> Self {
        let count = |side| branch(machine, side).count();
        let along = |side, wanted: &dyn Fn(&Step) -> bool| {
            let axes = branch(machine, side).position(|step| wanted(&step)).map_or(0, |index| index + 1);
            Self { side, axes }
        };
        match link {
            Link::Base => Self { side: Carrier::Table, axes: 0 },
            Link::Table => Self { side: Carrier::Table, axes: count(Carrier::Table) },
            Link::Spindle => Self { side: Carrier::Head, axes: count(Carrier::Head) },
            Link::Linear(k) => along(machine.linear[k].on, &|step| matches!(step, Step::Linear(own) if *own == k)),
            Link::Rotary(k) => along(machine.rotary[k].on, &|step| matches!(step, Step::Rotary(own) if *own == k)),
        }
    }

    /// Whether nothing but one axis, or none, lies between two links.
    pub(super) fn joins(&self, other: &Self) -> bool {
        if self.side == other.side { self.axes.abs_diff(other.axes) <= 1 } else { self.axes + other.axes <= 1 }
    }
}

impl Setup {
    /// What the linear axes add up to from the base to a link, machine frame, mm.
    fn carried(&self, place: &Place, axes: &AxisPosition) -> Vector {
        let machine = self.machine();
        let sign = if place.side == Carrier::Head { 1.0 } else { -1.0 };
        let counted = self.counted(axes);
        let linear = branch(machine, place.side).take(place.axes).filter_map(|step| match step {
            Step::Linear(k) => Some(machine.linear[k].direction.into_inner() * (sign * counted[k])),
            Step::Rotary(_) => None,
        });
        linear.fold(Vector::zeros(), |sum, way| sum + way)
    }

    /// The turn of a rotary axis as a link on its side sees it.
    fn turn(&self, index: usize, axes: &AxisPosition) -> RigidMotion {
        let axis = &self.machine().rotary[index];
        // A table turns the other way than the tool does as seen from the part.
        let sign = if axis.on == Carrier::Head { axis.sign() } else { -axis.sign() };
        let turn = UnitQuaternion::from_axis_angle(&axis.direction, sign * axes.rotary[index]);
        RigidMotion::from_parts((axis.pivot - turn * axis.pivot).into(), turn)
    }

    /// Takes a point of a link, given with every axis at zero, to where the axes bring it; machine frame.
    pub(super) fn placed(&self, place: &Place, axes: &AxisPosition) -> RigidMotion {
        let turns = branch(self.machine(), place.side).take(place.axes).filter_map(|step| match step {
            Step::Rotary(k) => Some(self.turn(k, axes)),
            Step::Linear(_) => None,
        });
        let carried: nalgebra::Translation3<f64> = self.carried(place, axes).into();
        turns.fold(RigidMotion::from_parts(carried, UnitQuaternion::identity()), |sum, turn| sum * turn)
    }

    /// Takes what moves with a link, given in the machine frame with every axis at zero, to where the axes bring it in the
    /// part frame.
    pub fn seen_from_part(&self, link: Link, axes: &AxisPosition) -> RigidMotion {
        let [table, own] = [Link::Table, link].map(|link| self.placed(&Place::of(self.machine(), link), axes));
        let zero = nalgebra::Translation3::from(Vector::from(self.work_offset()));
        zero.inverse() * table.inverse() * own
    }

    /// Bound on the second derivative, by the share, of the place of any point of a ball on one link, as seen from
    /// another.
    pub(super) fn acceleration(
        &self,
        [moving, fixed]: [&Place; 2],
        (centre, radius): (Point, f64),
        course: &impl AxisCourse,
    ) -> f64 {
        let rates = course.rates();
        let start = course.axes(0.0);
        let machine = self.machine();
        let way = self.linear_way(&rates, &start);
        let mut mover = Mover { at: centre, radius, speed: 0.0, acceleration: 0.0 };
        let shared = if moving.side == fixed.side { moving.axes.min(fixed.axes) } else { 0 };
        let steps = |place: &Place| {
            let all = branch(machine, place.side).take(place.axes).skip(shared);
            let (linear, rotary): (Vec<_>, Vec<_>) = all.partition(|step| matches!(step, Step::Linear(_)));
            (linear, rotary)
        };
        let ((up_linear, up), (down_linear, down)) = (steps(moving), steps(fixed));
        let turned = |mover: Mover, step: &Step, back: bool| match step {
            Step::Rotary(k) => {
                let turn = self.turn(*k, &start);
                let turn = if back { turn.inverse() } else { turn };
                mover.turned(&turn, &machine.rotary[*k].pivot, rates.rotary[*k].abs())
            }
            Step::Linear(_) => mover,
        };
        mover = up.iter().rev().fold(mover, |mover, step| turned(mover, step, false));
        let linear: Vec<usize> = up_linear
            .iter()
            .chain(&down_linear)
            .filter_map(|step| if let Step::Linear(k) = step { Some(*k) } else { None })
            .collect();
        if !linear.is_empty() {
            let share = self.share_of_way(&linear);
            let shift = self.carried(moving, &start) - self.carried(fixed, &start);
            mover = mover.shifted(&shift, share * way.speed, share * way.acceleration);
        }
        mover = down.iter().fold(mover, |mover, step| turned(mover, step, true));
        let whole = [moving, fixed].iter().all(|place| place.axes == branch(machine, place.side).count());
        match rates.linear {
            // As seen from the part the tip goes its own way, and the tool turns about it.
            LinearRates::Tip { acceleration, .. }
                if whole && moving.side == Carrier::Head && fixed.side == Carrier::Table =>
            {
                let turn: f64 = rates.rotary.iter().map(|rate| rate.abs()).sum();
                let reach = (centre.coords - self.tip_at_zero()).norm() + radius;
                mover.acceleration.min(acceleration + turn * turn * reach)
            }
            _ => mover.acceleration,
        }
    }

    /// Bounds on the derivatives of the linear axes' way, machine frame.
    fn linear_way(&self, rates: &AxisRates, start: &AxisPosition) -> Mover {
        let still = |at: Point| Mover { at, radius: 0.0, speed: 0.0, acceleration: 0.0 };
        let (speed, acceleration) = match rates.linear {
            LinearRates::Axes { speed, acceleration } => {
                return Mover { speed, acceleration, ..still(Point::origin()) };
            }
            LinearRates::Tip { speed, acceleration } => (speed, acceleration),
        };
        // The axes go from where the head's turns leave the tip to where the table's turns bring its place in the part.
        let machine = self.machine();
        let tip = self.forward(start).tip + Vector::from(self.work_offset());
        let mut part = Mover { speed, acceleration, ..still(tip) };
        let mut head = still(Point::from(self.tip_at_zero()));
        for (side, mover) in [(Carrier::Table, &mut part), (Carrier::Head, &mut head)] {
            for step in branch(machine, side).rev() {
                if let Step::Rotary(k) = step {
                    let turn = self.turn(k, start);
                    *mover = mover.turned(&turn, &machine.rotary[k].pivot, rates.rotary[k].abs());
                }
            }
        }
        Mover {
            speed: part.speed + head.speed,
            acceleration: part.acceleration + head.acceleration,
            ..still(Point::origin())
        }
    }

    /// How much of the way of all linear axes some of them may make: 1 for square axes, or for all of them.
    fn share_of_way(&self, some: &[usize]) -> f64 {
        let (all, back) = self.linear_directions();
        let picked = Matrix3::from_fn(|row, column| if some.contains(&column) { all[(row, column)] } else { 0.0 });
        let part = picked * back;
        let square = (all.transpose() * all - Matrix3::identity()).norm() < 1e-9;
        if square || some.len() == 3 { 1.0 } else { part.norm() }
    }
}

/// One link as seen from another along a course.
pub(super) struct LinkSweep<'a, C> {
    pub(super) setup: &'a Setup,
    pub(super) course: &'a C,
    /// The moving link and the other.
    pub(super) places: [Place; 2],
    /// The motion at shares 0 and 1.
    pub(super) ends: [RigidMotion; 2],
    pub(super) acceleration: f64,
}

impl<C: AxisCourse> RigidSweep for LinkSweep<'_, C> {
    fn motion(&self, share: f64) -> RigidMotion {
        if share == 0.0 {
            return self.ends[0];
        }
        if share == 1.0 {
            return self.ends[1];
        }
        let axes = self.course.axes(share);
        let [moving, fixed] = self.places.map(|place| self.setup.placed(&place, &axes));
        fixed.inverse() * moving
    }

    fn acceleration(&self) -> f64 {
        self.acceleration
    }
}

#[cfg(test)]
#[path = "link_tests.rs"]
mod tests;
