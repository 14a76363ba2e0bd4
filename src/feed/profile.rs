//! Durations of a run of blocks, stretched so that no axis changes its rate too fast. Uses nothing of the crate.
//!
//! With `u = 1/T` the rate of an axis in a block is `d u`, and the limit `A` at the joint of two blocks reads
//!
//! ```text
//! |d' u' - d u| <= A (1/u + 1/u') / 2
//! ```
//!
//! First every joint is slowed so that it could be passed at one path speed on both sides (the maximum velocity curve);
//! then a pass forward limits each block by the one before and a pass backward by the one after, each in closed form,
//! as for time-optimal motion along a given path (Bobrow, Dubowsky, Gibson 1985). What the two passes leave is repaired
//! joint by joint: stretching both blocks by one factor divides the acceleration by its square.

/// Rounds of repair before the whole run is stretched, which always suffices.
const ROUNDS: usize = 400;

/// Overload that is rounding of the closed forms, as a share.
const ROUNDING: f64 = 1e-6;

/// Stretches `times` (s) so that every joint keeps the accelerations `limits` to within a millionth; `travels` are the axes' ways in each
/// block and `lengths` the way of the tool in the part, mm.
pub(super) fn stretch(times: &mut [f64], travels: &[[f64; 5]], lengths: &[f64], limits: &[f64; 5]) {
    let run = Run { travels, limits };
    pass_corners(times, &run, lengths);
    for i in 1..times.len() {
        times[i] = times[i].max(run.least_time(i, &travels[i - 1], times[i - 1]));
    }
    for i in (1..times.len()).rev() {
        times[i - 1] = times[i - 1].max(run.least_time(i - 1, &travels[i], times[i]));
    }
    for round in 0..ROUNDS {
        if !run.repair(times, round % 2 == 0) {
            return;
        }
    }
    let worst = (1..times.len()).map(|i| run.load(i, times[i - 1], times[i])).fold(1.0, f64::max);
    times.iter_mut().for_each(|time| *time *= worst.sqrt());
}

struct Run<'a> {
    travels: &'a [[f64; 5]],
    limits: &'a [f64; 5],
}

impl Run<'_> {
    /// Largest acceleration over its limit at the joint before block `i`, for durations of the two blocks there.
    fn load(&self, i: usize, before: f64, after: f64) -> f64 {
        let (from, to) = (&self.travels[i - 1], &self.travels[i]);
        let span = (before + after) / 2.0;
        let loads = (0..5).map(|k| (to[k] / after - from[k] / before).abs() / (span * self.limits[k]));
        loads.fold(0.0, f64::max)
    }

    /// The least duration of block `i` for which no axis moves faster than a neighbour of travel `other` in time
    /// `beside` lets it: the root of `x u^2 - (r + A T / 2) u - A / 2 = 0`.
    fn least_time(&self, i: usize, other: &[f64; 5], beside: f64) -> f64 {
        let mut least: f64 = 0.0;
        for (k, way) in self.travels[i].iter().enumerate() {
            let (x, limit) = (way.abs(), self.limits[k]);
            if x <= 0.0 || beside <= 0.0 {
                continue;
            }
            let p = way.signum() * other[k] / beside + limit * beside / 2.0;
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
        for step in 1..count {
            let i = if forward { step } else { count - step };
            let load = self.load(i, times[i - 1], times[i]);
            if load > 1.0 + ROUNDING {
                found = true;
                let factor = load.sqrt();
                times[i - 1] *= factor;
                times[i] *= factor;
            }
        }
        found
    }
}

/// Slows both sides of each joint until it can be passed at one path speed.
fn pass_corners(times: &mut [f64], run: &Run<'_>, lengths: &[f64]) {
    let original = times.to_vec();
    for i in 1..times.len() {
        let (mut before, mut after) = (original[i - 1], original[i]);
        let (a, b) = (lengths[i - 1], lengths[i]);
        if a > 0.0 && b > 0.0 {
            let slowness = (before / a).max(after / b);
            (before, after) = (a * slowness, b * slowness);
        }
        let load = run.load(i, before, after);
        if load > 1.0 {
            times[i - 1] = times[i - 1].max(before * load.sqrt());
            times[i] = times[i].max(after * load.sqrt());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: [f64; 5] = [100.0, 100.0, 100.0, 1.0, 1.0];

    fn stretched(mut times: Vec<f64>, travels: &[[f64; 5]]) -> Vec<f64> {
        let lengths: Vec<f64> = travels.iter().map(|t| t[0].hypot(t[1])).collect();
        stretch(&mut times, travels, &lengths, &LIMITS);
        let run = Run { travels, limits: &LIMITS };
        for i in 1..times.len() {
            let load = run.load(i, times[i - 1], times[i]);
            assert!(load <= 1.0 + ROUNDING, "joint {i}: {load}");
        }
        times
    }

    #[test]
    fn steady_motion_is_not_touched() {
        let times = vec![0.1; 20];
        assert_eq!(stretched(times.clone(), &[[1.0, 0.0, 0.0, 0.0, 0.0]; 20]), times);
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
        let run = Run { travels: &travels, limits: &LIMITS };
        for i in 60..140 {
            assert!(run.load(i, times[i - 1], times[i]) > 0.999_999, "joint {i} could be faster");
        }
        assert!(((squared[140] - squared[120]) / 20.0 - 20.0).abs() < 0.1, "{}", squared[140] - squared[120]);
        assert!((times[0] - 0.1 / 30.0).abs() < 1e-12, "far away the feed is kept");
    }

    #[test]
    fn reversal_in_one_block_is_kept_within_limits() {
        let mut travels = vec![[0.5, 0.0, 0.0, 0.01, 0.0]; 50];
        travels[25..].fill([-0.5, 0.0, 0.0, 0.3, 0.0]);
        stretched(vec![0.001; 50], &travels);
    }
}
