//! Durations of a run of blocks, stretched so that no axis changes its rate too fast. Uses `filter` of this module.
//!
//! Only positions at the ends of blocks and the times between are looked at, so every limit is one on divided differences,
//! which are weighted means of the derivatives between (Peano): motion that keeps the limits everywhere keeps them here.
//! With travel `d_i` and duration `T_i`, the rate of an axis in a block, its acceleration at the joint before the block, and
//! its jerk about the block are
//!
//! ```text
//! r_i = d_i / T_i
//! a_i = (r_i - r_(i-1)) / ((T_(i-1) + T_i) / 2)
//! j_i = (a_(i+1) - a_i) / ((T_(i-1) + T_i + T_(i+1)) / 3)
//! ```
//!
//! Before and after the run the machine rests, which is blocks without travel that take no time.
//!
//! First every joint is slowed so that it could be passed at one path speed on both sides (the maximum velocity curve);
//! then a pass forward limits each block by the one before and a pass backward by the one after, each in closed form,
//! as for time-optimal motion along a given path (Bobrow, Dubowsky, Gibson 1985). What the two passes leave is repaired
//! joint by joint: stretching both blocks by one factor divides the acceleration by its square. Where jerk is limited, the
//! speed along the path is then averaged in time, as controls do it; where that is not enough, the blocks concerned are
//! slowed and it is done again.

use super::filter::averaged;

/// Rounds of repair before the whole run is stretched, which always suffices.
const ROUNDS: usize = 400;
/// Rounds of averaging before the whole run is stretched, which always suffices.
const JERK_ROUNDS: usize = 40;
/// Factor at which the whole run is stretched rather than averaged once more.
const NEARLY: f64 = 1.001;
/// Time over which the speed is averaged, in times that an axis takes to build up its acceleration: a little more than
/// once, because blocks are not even; then twice, for going from full acceleration one way to the other.
const WINDOWS: (f64, f64) = (1.05, 2.0);
/// Overload that is rounding of the closed forms, as a share.
const ROUNDING: f64 = 1e-6;

/// A run of blocks from rest to rest.
pub(super) struct Run<'a> {
    /// Way of each axis in each block.
    pub(super) travels: &'a [[f64; 5]],
    /// Way of the tool in each block, mm.
    pub(super) lengths: &'a [f64],
    /// Limits of each axis; infinite where there is none.
    pub(super) accelerations: &'a [f64; 5],
    pub(super) jerks: &'a [f64; 5],
}

/// Stretches `times` (s, above zero) so that the run keeps its limits to within a millionth.
pub(super) fn stretch(times: &mut [f64], run: &Run<'_>) {
    let progress = times.to_vec();
    run.limit_acceleration(times);
    if run.jerks.iter().any(|jerk| jerk.is_finite()) {
        run.limit_jerk(&progress, times);
    }
}

impl Run<'_> {
    fn travel(&self, block: Option<usize>) -> [f64; 5] {
        block.and_then(|block| self.travels.get(block)).copied().unwrap_or_default()
    }

    /// Accelerations at the joint before block `i`, from 0 to the number of blocks.
    fn joint(&self, i: usize, times: &[f64]) -> [f64; 5] {
        let time = |block: Option<usize>| block.and_then(|block| times.get(block)).copied().unwrap_or(0.0);
        let (before, after) = (i.checked_sub(1), Some(i));
        joint((self.travel(before), time(before)), (self.travel(after), time(after)))
    }

    /// Largest acceleration over its limit.
    fn load(&self, accelerations: [f64; 5]) -> f64 {
        share(&accelerations, self.accelerations)
    }

    fn load_at(&self, i: usize, times: &[f64]) -> f64 {
        self.load(self.joint(i, times))
    }

    fn limit_acceleration(&self, times: &mut [f64]) {
        self.pass_corners(times);
        for i in 0..times.len() {
            let before = i.checked_sub(1);
            let beside = before.map_or(0.0, |before| times[before]);
            times[i] = times[i].max(self.least_time(i, &self.travel(before), beside));
        }
        for i in (0..times.len()).rev() {
            let beside = times.get(i + 1).copied().unwrap_or(0.0);
            times[i] = times[i].max(self.least_time(i, &self.travel(Some(i + 1)), beside));
        }
        for round in 0..ROUNDS {
            if !self.repair(times, round % 2 == 0) {
                return;
            }
        }
        let worst = (0..=times.len()).map(|i| self.load_at(i, times)).fold(1.0, f64::max);
        times.iter_mut().for_each(|time| *time *= worst.sqrt());
    }

    /// The least duration of block `i` for which no axis moves faster than a neighbour of travel `other` in time
    /// `beside` lets it: the root of `x u^2 - (r + A T / 2) u - A / 2 = 0` with `u = 1 / T`.
    fn least_time(&self, i: usize, other: &[f64; 5], beside: f64) -> f64 {
        let mut least: f64 = 0.0;
        for (k, way) in self.travels[i].iter().enumerate() {
            let (x, limit) = (way.abs(), self.accelerations[k]);
            if x <= 0.0 || !limit.is_finite() {
                continue;
            }
            let rate = if beside > 0.0 { way.signum() * other[k] / beside } else { 0.0 };
            let p = rate + limit * beside / 2.0;
            let root = (p * p + 2.0 * limit * x).sqrt();
            // 1/u; both forms are the same number, each exact for its sign of p.
            let time = if p >= 0.0 { 2.0 * x / (p + root) } else { (root - p) / limit };
            least = least.max(time);
        }
        least
    }

    /// Stretches both blocks of each joint that is overloaded; says whether there was one.
    fn repair(&self, times: &mut [f64], forward: bool) -> bool {
        let mut found = false;
        let count = times.len();
        for step in 0..=count {
            let i = if forward { step } else { count - step };
            let load = self.load_at(i, times);
            if load > 1.0 + ROUNDING {
                found = true;
                let factor = load.sqrt();
                times.iter_mut().take(i + 1).skip(i.saturating_sub(1)).for_each(|time| *time *= factor);
            }
        }
        found
    }

    /// Slows both sides of each joint until it can be passed at one path speed.
    fn pass_corners(&self, times: &mut [f64]) {
        let original = times.to_vec();
        for i in 1..times.len() {
            let (mut before, mut after) = (original[i - 1], original[i]);
            let (a, b) = (self.lengths[i - 1], self.lengths[i]);
            if a > 0.0 && b > 0.0 {
                let slowness = (before / a).max(after / b);
                (before, after) = (a * slowness, b * slowness);
            }
            let load = self.load(joint((self.travels[i - 1], before), (self.travels[i], after)));
            if load > 1.0 {
                times[i - 1] = times[i - 1].max(before * load.sqrt());
                times[i] = times[i].max(after * load.sqrt());
            }
        }
    }

    /// Averages the speed along the path over the time in which the axes build up their acceleration; `progress` is how
    /// far each block leads: the time that it takes at full speed.
    fn limit_jerk(&self, progress: &[f64], times: &mut [f64]) {
        let moving = |k: usize| self.travels.iter().any(|travel| travel[k] != 0.0);
        let windows = (0..5).filter(|k| moving(*k)).map(|k| self.accelerations[k] / self.jerks[k]);
        let window = windows.filter(|window| window.is_finite()).fold(0.0, f64::max);
        if window <= 0.0 {
            return;
        }
        let mut slowed = times.to_vec();
        for round in 0..JERK_ROUNDS {
            let window = window * if round == 0 { WINDOWS.0 } else { WINDOWS.1 };
            times.copy_from_slice(&averaged(progress, &slowed, window));
            let mut factors = self.needed(progress, times);
            let worst = factors.iter().copied().fold(1.0, f64::max);
            if worst <= NEARLY || round + 1 == JERK_ROUNDS {
                times.iter_mut().for_each(|time| *time *= worst);
                return;
            }
            if round > 0 {
                spread(&mut factors, times, window);
                slowed.iter_mut().zip(&factors).for_each(|(time, factor)| *time *= factor);
                self.limit_acceleration(&mut slowed);
            }
        }
    }

    /// Factors by which blocks must be stretched, together with their neighbours, to come within every limit.
    fn needed(&self, least: &[f64], times: &[f64]) -> Vec<f64> {
        let mut factors: Vec<f64> = least.iter().zip(times).map(|(least, time)| (least / time).max(1.0)).collect();
        let mut raise = |blocks: std::ops::Range<usize>, factor: f64| {
            let window = factors.iter_mut().take(blocks.end).skip(blocks.start);
            window.for_each(|own| *own = own.max(factor));
        };
        let mut before = [0.0; 5];
        for i in 0..=times.len() + 1 {
            let after = if i <= times.len() { self.joint(i, times) } else { [0.0; 5] };
            raise(i.saturating_sub(1)..i + 1, self.load(after).sqrt());
            let jerk = self.jerk(i, (before, after), times);
            raise(i.saturating_sub(2)..i + 1, share(&jerk, self.jerks).cbrt());
            before = after;
        }
        factors
    }

    /// Jerks between the accelerations at the joints before blocks `i - 1` and `i`.
    fn jerk(&self, i: usize, (before, after): ([f64; 5], [f64; 5]), times: &[f64]) -> [f64; 5] {
        let span: f64 = times.iter().take(i + 1).skip(i.saturating_sub(2)).sum();
        std::array::from_fn(|k| 3.0 * (after[k] - before[k]) / span)
    }
}

/// Spreads factors above one to the neighbourhood, falling off with the distance in time over `window`.
fn spread(factors: &mut [f64], times: &[f64], window: f64) {
    let mut reach = |indices: &mut dyn Iterator<Item = usize>| {
        let mut carried: f64 = 0.0;
        for i in indices {
            let fade = (-times[i] / window).exp();
            carried = (factors[i] - 1.0).max(carried * fade);
            factors[i] = 1.0 + carried;
        }
    };
    reach(&mut (0..times.len()));
    reach(&mut (0..times.len()).rev());
}

/// Accelerations between two blocks, each a travel and a duration.
pub(super) fn joint((from, before): ([f64; 5], f64), (to, after): ([f64; 5], f64)) -> [f64; 5] {
    let rate = |way: f64, time: f64| if way == 0.0 { 0.0 } else { way / time };
    std::array::from_fn(|k| 2.0 * (rate(to[k], after) - rate(from[k], before)) / (before + after))
}

/// Largest of the values over their limits.
fn share(values: &[f64; 5], limits: &[f64; 5]) -> f64 {
    values.iter().zip(limits).map(|(value, limit)| value.abs() / limit).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: [f64; 5] = [100.0, 100.0, 100.0, 1.0, 1.0];

    const NO_JERKS: [f64; 5] = [f64::INFINITY; 5];

    /// Stretched times, which keep every limit.
    fn stretched_with(mut times: Vec<f64>, travels: &[[f64; 5]], jerks: &[f64; 5]) -> Vec<f64> {
        let lengths: Vec<f64> = travels.iter().map(|t| t[0].hypot(t[1])).collect();
        let run = Run { travels, lengths: &lengths, accelerations: &LIMITS, jerks };
        let before = times.clone();
        stretch(&mut times, &run);
        let worst = run.needed(&before, &times).into_iter().fold(0.0, f64::max);
        assert!(worst <= 1.0 + ROUNDING, "{worst} too fast");
        times
    }

    fn stretched(times: Vec<f64>, travels: &[[f64; 5]]) -> Vec<f64> {
        stretched_with(times, travels, &NO_JERKS)
    }

    /// From rest to speed v in v / a and back.
    #[test]
    fn line_takes_the_time_of_a_trapezoid() {
        let times = stretched(vec![0.1 / 30.0; 1000], &[[0.1, 0.0, 0.0, 0.0, 0.0]; 1000]);
        let total: f64 = times.iter().sum();
        assert!((total - (100.0 / 30.0 + 30.0 / 100.0)).abs() < 2e-3, "{total}");
        // Too short for its speed: 2 sqrt(l / a).
        let total: f64 = stretched(vec![0.1 / 30.0; 80], &[[0.1, 0.0, 0.0, 0.0, 0.0]; 80]).iter().sum();
        assert!((total - 2.0 * (8.0_f64 / 100.0).sqrt()).abs() < 2e-3, "{total}");
    }

    /// With jerk j the speed is reached in v / a + a / j.
    #[test]
    fn line_takes_the_time_of_an_s_curve() {
        let jerks = [1000.0; 5];
        let times = stretched_with(vec![0.1 / 30.0; 1000], &[[0.1, 0.0, 0.0, 0.0, 0.0]; 1000], &jerks);
        let total: f64 = times.iter().sum();
        let exact = 100.0 / 30.0 + 30.0 / 100.0 + 100.0 / 1000.0;
        assert!(total >= exact && total - exact < 0.1 * 100.0 / 1000.0, "{total}");
    }

    /// Two axes on a circle of radius r: v^2 / r is the acceleration, v^3 / r^2 the jerk.
    #[test]
    fn circle_is_slowed_to_its_centripetal_acceleration_and_jerk() {
        let (radius, count) = (5.0, 2000);
        let at = |i: usize| {
            let angle = std::f64::consts::TAU * 2.0 * i as f64 / count as f64;
            (radius * angle.cos(), radius * angle.sin())
        };
        let travels: Vec<[f64; 5]> =
            (0..count).map(|i| [at(i + 1).0 - at(i).0, at(i + 1).1 - at(i).1, 0.0, 0.0, 0.0]).collect();
        let way = travels[0][0].hypot(travels[0][1]);
        let fast = vec![way / 1000.0; count];
        let jerks = [200.0; 5];
        for (times, speed) in [
            (stretched(fast.clone(), &travels), (radius * 100.0_f64).sqrt()),
            (stretched_with(fast, &travels, &jerks), (radius * radius * 200.0_f64).cbrt()),
        ] {
            // One axis at a time bears all of it: away from there the path could be faster.
            let slowest = times[count / 4..count * 3 / 4].iter().fold(0.0, |a: f64, b| a.max(*b));
            let ratio = way / slowest / speed;
            assert!((0.9..=1.001).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn steady_motion_is_only_touched_where_it_begins_and_ends() {
        let times = vec![0.1; 20];
        let travels = [[1.0, 0.0, 0.0, 0.0, 0.0]; 20];
        assert_eq!(stretched(times, &travels)[2..18], [0.1; 16]);
    }

    /// A square corner with acceleration A and blocks of length h: v^2 = A h at the corner, every joint near it loaded
    /// fully (there is no faster way), and v^2 growing by 2 A h a block.
    #[test]
    fn corner_is_slowed_and_left_with_full_acceleration() {
        let mut travels = vec![[0.1, 0.0, 0.0, 0.0, 0.0]; 200];
        travels[100..].fill([0.0, 0.1, 0.0, 0.0, 0.0]);
        let times = stretched(vec![0.1 / 30.0; 200], &travels);
        let squared: Vec<f64> = times.iter().map(|t| (0.1 / t).powi(2)).collect();
        assert!((squared[99] - 10.0).abs() < 1e-6 && (squared[100] - 10.0).abs() < 1e-6, "{}", squared[100]);
        let lengths = vec![0.1; 200];
        let run = Run { travels: &travels, lengths: &lengths, accelerations: &LIMITS, jerks: &NO_JERKS };
        for i in 60..140 {
            assert!(run.load_at(i, &times) > 0.999_999, "joint {i} could be faster");
        }
        assert!(((squared[140] - squared[120]) / 20.0 - 20.0).abs() < 0.1, "{}", squared[140] - squared[120]);
        assert!((times[50] - 0.1 / 30.0).abs() < 1e-12, "far away the feed is kept");
    }

    #[test]
    fn reversal_in_one_block_is_kept_within_limits() {
        let mut travels = vec![[0.5, 0.0, 0.0, 0.01, 0.0]; 50];
        travels[25..].fill([-0.5, 0.0, 0.0, 0.3, 0.0]);
        stretched(vec![0.001; 50], &travels);
    }
}
