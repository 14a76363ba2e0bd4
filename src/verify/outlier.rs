//! Which ends of blocks lie off the course of the blocks around them: what a wrong word leaves in a program. Uses
//! `geometry` and the motion of this module.

use super::motion_tree::BlockMotion;
use nalgebra::{SMatrix, SVector};

/// Wrong ends in a row that are looked for.
const MOST_WRONG: usize = 6;
/// Blocks before and after a stretch whose ends are looked at, too.
const BESIDE: usize = 3;
/// Stretches of more blocks are no single mistake.
const LONGEST: usize = 48;
/// Ends around a place by which the course there is known, and the powers of the way in it, one more than its degree.
const AROUND: usize = 6;
const POWERS: usize = 4;
/// Of these so many must be before and as many after.
const LEAST_BESIDE: usize = 2;
/// Pieces of a course to which distances are measured.
const PIECES: u32 = 64;
/// An end is off the course when it is off by so many times what the others are.
const OFF: f64 = 6.0;

/// Where the tip and a point higher up the axis are, mm.
type Place = SVector<f64, 6>;

/// Share of the farthest by which the first and the last of several ends must be off: the course is known less well
/// between them than where it is fitted.
const OFF_SHARE: f64 = 0.1;

/// The ends of a row of blocks.
pub(super) struct Ends {
    places: Vec<Place>,
    /// The block after which the first of them is.
    first: usize,
}

/// A course of tip and axis along their way: a polynomial in the way.
struct Course {
    coefficients: SMatrix<f64, POWERS, 6>,
    /// How far the ends that it is fitted to are from it, mm.
    residual: f64,
}

impl Ends {
    /// Those around the blocks `from` to `to`; `None` where these are too many. `same` tells whether a block is of the
    /// same run of cuts. Axes are compared at `height`, mm.
    pub(super) fn around(
        motion: &impl BlockMotion,
        (from, to): (usize, usize),
        height: f64,
        same: impl Fn(usize) -> bool,
    ) -> Option<Self> {
        if to - from > LONGEST {
            return None;
        }
        let reach = BESIDE + AROUND;
        let first = (from.saturating_sub(reach)..from).rev().take_while(|block| same(*block)).last().unwrap_or(from);
        let end = (to..=to + reach).take_while(|block| *block < motion.blocks() && same(*block)).last()?;
        let place = |block: usize| {
            let pose = motion.pose(block, 1.0);
            let (tip, top) = (pose.tip.coords, pose.at_height(height).coords);
            Place::from_iterator(tip.iter().chain(top.iter()).copied())
        };
        Some(Self { places: (first..=end).map(place).collect(), first })
    }

    /// The first of the blocks in a row that end off the course of the others, by at least `least` mm: of all such rows the
    /// one without which all other ends lie most evenly. How well the ends next to a row fit together would not tell: beside
    /// a mistake they may do so by chance.
    pub(super) fn first_wrong(&self, least: f64) -> Option<usize> {
        let rows = (0..self.places.len()).flat_map(|from| (1..=MOST_WRONG).map(move |count| (from, from + count)));
        let off = rows.filter(|(from, to)| self.are_off(*from, *to, least).unwrap_or(false));
        let uneven = off.filter_map(|(from, to)| Some((self.unevenness(from, to)?, from)));
        let evenest = uneven.reduce(|best, one| if one.0 < best.0 { one } else { best });
        evenest.map(|(_, from)| self.first + from)
    }

    /// Whether the ends `from..to` are off the course of those around them, the first and the last of them in any case;
    /// `None` where that course is not known.
    fn are_off(&self, from: usize, to: usize, least: f64) -> Option<bool> {
        let inside = self.places.get(from..to)?;
        let course = self.course_around(from, to)?;
        let off: Vec<f64> = inside.iter().map(|place| course.distance(place)).collect();
        let farthest = off.iter().copied().fold(0.0, f64::max);
        let enough = (OFF * course.residual).max(OFF_SHARE * farthest);
        let by = |distance: Option<&f64>| distance.is_some_and(|distance| *distance > enough);
        Some(farthest >= least && by(off.first()) && by(off.last()))
    }

    /// How far the ends but `from..to` are from courses of a few of them in a row each, added up, mm.
    fn unevenness(&self, from: usize, to: usize) -> Option<f64> {
        let others: Vec<&Place> = self.places.get(..from)?.iter().chain(self.places.get(to..)?).collect();
        Some(others.windows(AROUND).filter_map(Course::of).map(|course| course.residual).sum())
    }

    /// The course of the ends nearest to `from..to` without these; `None` where there are too few.
    fn course_around(&self, from: usize, to: usize) -> Option<Course> {
        let after = AROUND.div_ceil(2).max(AROUND.saturating_sub(from)).min(self.places.len().checked_sub(to)?);
        let before = AROUND - after;
        // Nothing is foreseen beyond the ends that are known.
        if before.min(after) < LEAST_BESIDE {
            return None;
        }
        let chosen = self.places.get(from.checked_sub(before)?..from)?.iter().chain(self.places.get(to..to + after)?);
        Course::of(&chosen.collect::<Vec<_>>())
    }
}

impl Course {
    /// That of some ends, [`AROUND`] of them; `None` where they are all in one place.
    fn of(chosen: &[&Place]) -> Option<Self> {
        let mut ways = vec![0.0];
        for pair in chosen.windows(2) {
            let [a, b] = pair else { continue };
            ways.push(ways.last()? + (*b - *a).norm());
        }
        let whole = ways.last().copied().filter(|whole| *whole > 0.0)?;
        let powers = SMatrix::<f64, AROUND, POWERS>::from_fn(|k, power| {
            ways.get(k).map_or(0.0, |way| (way / whole).powi(power as i32))
        });
        let targets = SMatrix::<f64, AROUND, 6>::from_fn(|k, column| chosen.get(k).map_or(0.0, |place| place[column]));
        let qr = powers.qr();
        let coefficients = qr.r().solve_upper_triangular(&(qr.q().transpose() * targets))?;
        let left = targets - powers * coefficients;
        let residual = left.row_iter().map(|row| row.norm()).fold(0.0, f64::max);
        residual.is_finite().then_some(Self { coefficients, residual })
    }

    fn at(&self, share: f64) -> Place {
        let powers = SVector::<f64, POWERS>::from_fn(|power, _| share.powi(power as i32));
        self.coefficients.tr_mul(&powers)
    }

    /// How far a place is from the course, mm.
    fn distance(&self, place: &Place) -> f64 {
        let at = |k: u32| self.at(f64::from(k) / f64::from(PIECES));
        let to_piece = |k: u32| {
            let (start, end) = (at(k), at(k + 1));
            let (way, out) = (end - start, place - start);
            let square = way.norm_squared();
            let share = if square > 0.0 { (out.dot(&way) / square).clamp(0.0, 1.0) } else { 0.0 };
            (out - way * share).norm()
        };
        (0..PIECES).map(to_piece).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Direction, Point, Vector};
    use crate::motion::Pose;
    use proptest::prelude::*;

    /// A winding way of tip and axis in blocks that are not all equally long, some of whose ends are elsewhere.
    struct Winding {
        blocks: usize,
        wrong: std::ops::Range<usize>,
        by: Vector,
    }

    impl BlockMotion for Winding {
        fn blocks(&self) -> usize {
            self.blocks
        }

        fn pose(&self, block: usize, share: f64) -> Pose {
            let end = |block: f64| 0.05 * (block + 0.3 * (2.0 * block).sin());
            let time = end(block as f64) + share * (end(block as f64 + 1.0) - end(block as f64));
            let off = if share == 1.0 && self.wrong.contains(&block) { self.by } else { Vector::zeros() };
            let tip = Point::new(30.0 * time.cos(), 30.0 * time.sin(), 3.0 * (2.0 * time).sin()) + off;
            Pose { tip, axis: Direction::new_normalize(Vector::new(0.3 * time.sin(), 0.2 * time, 1.0)) }
        }

        fn chord_bound(&self, _: usize, _: f64, _: f64, _: f64) -> f64 {
            0.0
        }

        fn is_rapid(&self, _: usize) -> bool {
            false
        }
    }

    fn found(winding: &Winding, stretch: (usize, usize)) -> Option<usize> {
        Ends::around(winding, stretch, 30.0, |_| true)?.first_wrong(0.01)
    }

    proptest! {
        #[test]
        fn the_first_of_some_ends_that_are_off_is_found(
            at in 12_usize..40, count in 1_usize..=MOST_WRONG, by in prop::array::uniform3(-0.2..0.2),
            (before, after) in (0_usize..8, 0_usize..8),
        ) {
            // Along the way an end may be moved without leaving it.
            let by = Vector::from(by) + Vector::new(0.0, 0.0, 0.3);
            let winding = Winding { blocks: 60, wrong: at..at + count, by };
            prop_assert_eq!(found(&winding, (at - before.min(4), at + count + after)), Some(at));
        }

        #[test]
        fn a_way_without_a_mistake_has_no_end_that_is_off(from in 0_usize..40, length in 0_usize..20) {
            let winding = Winding { blocks: 60, wrong: 0..0, by: Vector::zeros() };
            prop_assert_eq!(found(&winding, (from, from + length)), None);
        }
    }

    #[test]
    fn long_stretches_and_short_ways_are_left_alone() {
        let winding = |blocks| Winding { blocks, wrong: 20..21, by: Vector::new(0.0, 0.0, 0.3) };
        assert_eq!(found(&winding(100), (0, LONGEST + 1)), None);
        assert_eq!(found(&winding(100), (0, LONGEST)), Some(20));
        assert_eq!(found(&Winding { wrong: 2..3, ..winding(AROUND) }, (1, 3)), None);
    }
}
