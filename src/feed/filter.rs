//! A box filter over the progress along a path, as a control smooths it in time. Uses nothing of the crate.

/// Durations of blocks after the position on the path has been averaged over `window` s. `progress` is how far each block
/// leads, in any unit, and `times` its duration before, both above zero; before and after the run the position rests, so
/// the whole takes `window` longer.
///
/// With speed `p(t)` along the path before, the speed after is `q(t) = (P(t + w/2) - P(t - w/2)) / w`, where `P' = p`:
/// it has the slope `(p(t + w/2) - p(t - w/2)) / w`, so where `p` changes no faster than `a`, the slope of `q` changes by
/// at most `2 a / w`. `p` is taken as linear in each half of a block, see [`halves`], so `q` is a parabola between the
/// times at which one of the window's edges passes an end of a half.
pub(super) fn averaged(progress: &[f64], times: &[f64], window: f64) -> Vec<f64> {
    let halves = halves(progress, times);
    let mut edges = [Edge::new(&halves, 0.0), Edge::new(&halves, window)];
    let (mut out, mut last) = (Vec::with_capacity(times.len()), 0.0);
    let (mut now, mut rate) = (0.0, 0.0);
    // Way still to go to the end of the block that the filtered position is in.
    let mut left = progress.first().copied().unwrap_or(0.0);
    while out.len() < times.len() {
        let step = edges[0].left.min(edges[1].left);
        if !step.is_finite() {
            // Both edges have left the path: what rounding has left over belongs to the last block.
            out.push(now - last);
            last = now;
            continue;
        }
        let [ahead, behind] = &edges;
        let mut way = Parabola {
            rate,
            slope: (ahead.speed - behind.speed) / window,
            bend: (ahead.slope - behind.slope) / window,
        };
        let mut span = step;
        while out.len() + 1 < times.len() && way.covered(span) >= left {
            let x = way.root(left, span);
            way = way.from(x);
            (now, span) = (now + x, span - x);
            out.push(now - last);
            (last, left) = (now, progress.get(out.len()).copied().unwrap_or(0.0));
        }
        left -= way.covered(span);
        rate = way.from(span).rate;
        now += span;
        edges.iter_mut().for_each(|edge| edge.advance(step));
    }
    out
}

/// A speed and how it changes.
#[derive(Clone, Copy)]
struct Parabola {
    rate: f64,
    slope: f64,
    bend: f64,
}

impl Parabola {
    fn speed(&self, x: f64) -> f64 {
        self.rate + x * (self.slope + x * self.bend / 2.0)
    }

    /// Way after `x` seconds.
    fn covered(&self, x: f64) -> f64 {
        x * (self.rate + x * (self.slope / 2.0 + x * self.bend / 6.0))
    }

    /// The same seen from `x` seconds later; never backwards by rounding.
    fn from(&self, x: f64) -> Self {
        Self { rate: self.speed(x).max(0.0), slope: self.slope + x * self.bend, bend: self.bend }
    }

    /// Seconds after which `way` is covered, at most `span`: Newton's method, kept between two bounds.
    fn root(&self, way: f64, span: f64) -> f64 {
        let (mut low, mut high) = (0.0, span);
        let mut x = span / 2.0;
        for _ in 0..60 {
            let off = self.covered(x) - way;
            if off > 0.0 {
                high = x;
            } else {
                low = x;
            }
            let newton = x - off / self.speed(x);
            let next = if newton > low && newton < high { newton } else { (low + high) / 2.0 };
            if (next - x).abs() <= 1e-15 * span {
                return next;
            }
            x = next;
        }
        x
    }
}

/// Half a block: its duration, and the speed at both ends.
struct Half {
    duration: f64,
    speeds: [f64; 2],
}

/// Speed along the path as a continuous function that is linear in each half of a block, covers each block in its time,
/// and is that of constant acceleration where that is what the blocks were made by.
fn halves(progress: &[f64], times: &[f64]) -> Vec<Half> {
    let speed = |i: usize| progress[i] / times[i];
    // At the joint before block i: linear between the middles of the blocks, but never too fast to leave either in time.
    let joint = |i: usize| match i {
        0 => 0.0,
        _ if i >= times.len() => 0.0,
        _ => {
            let (before, after) = (times[i - 1], times[i]);
            let speed_there = (speed(i - 1) * after + speed(i) * before) / (before + after);
            speed_there.min(2.0 * speed(i - 1)).min(2.0 * speed(i))
        }
    };
    let mut halves = Vec::with_capacity(2 * times.len());
    for (i, time) in times.iter().enumerate() {
        let (start, end) = (joint(i), joint(i + 1));
        let middle = 2.0 * speed(i) - (start + end) / 2.0;
        halves.extend([[start, middle], [middle, end]].map(|speeds| Half { duration: time / 2.0, speeds }));
    }
    halves
}

/// Where an edge of the window stands on the path.
struct Edge<'a> {
    halves: std::slice::Iter<'a, Half>,
    speed: f64,
    slope: f64,
    /// Seconds until it comes to the path, or to the end of a half; none after the path's end.
    left: f64,
}

impl<'a> Edge<'a> {
    /// An edge that comes to the path in `wait` seconds.
    fn new(halves: &'a [Half], wait: f64) -> Self {
        let mut edge = Self { halves: halves.iter(), speed: 0.0, slope: 0.0, left: wait };
        if wait <= 0.0 {
            edge.enter();
        }
        edge
    }

    fn enter(&mut self) {
        match self.halves.next() {
            Some(half) => {
                let [start, end] = half.speeds;
                (self.speed, self.slope, self.left) = (start, (end - start) / half.duration, half.duration);
            }
            None => (self.speed, self.slope, self.left) = (0.0, 0.0, f64::INFINITY),
        }
    }

    fn advance(&mut self, step: f64) {
        if self.left <= step {
            self.enter();
        } else {
            self.speed += self.slope * step;
            self.left -= step;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Even speed from rest to rest: the ends take half the window longer each, and the way in between is as it was.
    #[test]
    fn a_ramp_comes_at_each_end() {
        let times = vec![0.01; 300];
        let out = averaged(&times, &times, 0.5);
        let total: f64 = out.iter().sum();
        assert!((total - 3.5).abs() < 1e-9, "{total}");
        assert!(out[100..200].iter().all(|t| (t - 0.01).abs() < 1e-9));
        assert!(out[..20].windows(2).all(|pair| pair[0] > pair[1]), "{:?}", &out[..20]);
    }

    /// Speed a t, averaged: the way is a t^3 / (6 w) from when the window begins to see it.
    #[test]
    fn constant_acceleration_becomes_constant_jerk() {
        let (acceleration, window, way) = (3.0, 0.4, 0.001);
        let reached = |n: usize| (2.0 * way * n as f64 / acceleration).sqrt();
        let times: Vec<f64> = (0..200).map(|n| reached(n + 1) - reached(n)).collect();
        let out = averaged(&[way; 200], &times, window);
        let mut now = 0.0;
        for (n, time) in out.iter().enumerate().take(10) {
            now += time;
            let exact = (6.0 * window * way * (n + 1) as f64 / acceleration).cbrt();
            assert!((now - exact).abs() < 1e-9, "{now} {exact}");
        }
    }

    proptest! {
        #[test]
        fn the_position_is_the_mean_over_the_window(
            blocks in prop::collection::vec((0.1..1.0, 0.01..1.0), 1..20), window in 0.01..3.0,
        ) {
            let (progress, times): (Vec<f64>, Vec<f64>) = blocks.iter().copied().unzip();
            let out = averaged(&progress, &times, window);
            let total: f64 = times.iter().sum();
            prop_assert!((out.iter().sum::<f64>() - total - window).abs() < 1e-9);
            let halves = halves(&progress, &times);
            // Each block is covered in its time, never backwards.
            for (pair, way) in halves.chunks(2).zip(&progress) {
                let covered: f64 = pair.iter().map(|h| h.duration * (h.speeds[0] + h.speeds[1]) / 2.0).sum();
                prop_assert!((covered - way).abs() < 1e-9);
                prop_assert!(pair.iter().all(|h| h.speeds.iter().all(|speed| *speed >= -1e-12)));
            }
            // Integral of the position before, from 0 to t.
            let integral = |t: f64| {
                let (mut sum, mut way, mut left) = (0.0, 0.0, t);
                for Half { duration, speeds: [start, end] } in &halves {
                    let (span, slope) = (left.clamp(0.0, *duration), (end - start) / duration);
                    sum += span * (way + span * (start / 2.0 + span * slope / 6.0));
                    way += span * (start + span * slope / 2.0);
                    left -= duration;
                }
                sum + way * left.max(0.0)
            };
            let (mut now, mut way) = (-window / 2.0, 0.0);
            for (h, d) in progress.iter().zip(&out) {
                (now, way) = (now + d, way + h);
                let mean = (integral(now + window / 2.0) - integral((now - window / 2.0).max(0.0))) / window;
                prop_assert!((mean - way).abs() < 1e-6, "{mean} {way}");
            }
        }
    }
}
