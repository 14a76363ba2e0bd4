use super::*;
use proptest::prelude::*;

/// Samples of `f` on [-1, 1] to be fitted by a sum of Chebyshev polynomials.
struct Fit<F: Fn(f64) -> f64> {
    degree: usize,
    samples: usize,
    f: F,
    sides: Sides,
    step_price: f64,
}

impl<F: Fn(f64) -> f64> Minimax for Fit<F> {
    fn unknowns(&self) -> usize {
        self.degree + 1
    }

    fn linearize(&mut self, x: &[f64], rows: &mut Rows) -> Option<()> {
        for i in 0..=self.samples {
            // Chebyshev points: those of the extremal polynomial are among them.
            let s = (std::f64::consts::PI * i as f64 / self.samples as f64).cos();
            let basis: Vec<f64> = (0..=self.degree).map(|k| (k as f64 * s.acos()).cos()).collect();
            let sum: f64 = basis.iter().zip(x).map(|(b, x)| b * x).sum();
            rows.bound((self.f)(s) - sum, self.sides, basis.iter().map(|b| -b).enumerate());
        }
        for k in 0..=self.degree {
            rows.square(0.0, self.step_price, [(k, 1.0)]);
        }
        Some(())
    }
}

fn fit<F: Fn(f64) -> f64>(degree: usize, f: F, sides: Sides) -> Fit<F> {
    Fit { degree, samples: 240, f, sides, step_price: 0.0 }
}

fn solved(problem: &mut impl Minimax, settings: &Settings) -> (Vec<f64>, Outcome) {
    let mut x = vec![0.0; problem.unknowns()];
    let outcome = minimize_largest(problem, &mut x, settings).unwrap();
    (x, outcome)
}

fn sharp() -> Settings {
    Settings { max_rounds: 60, gain_share: 1e-7, radius: 1.0, ..Settings::default() }
}

/// Chebyshev: the least largest error of x^(n+1) by polynomials of degree n is 2^-n.
#[test]
fn powers_are_fitted_as_chebyshev_found() {
    for degree in [1, 2, 3, 5, 7] {
        let power = move |s: f64| s.powi(degree as i32 + 1);
        let (_, outcome) = solved(&mut fit(degree, power, Sides::even(1.0)), &sharp());
        let want = 0.5_f64.powi(degree as i32);
        assert!((outcome.tau - want).abs() < 1e-6 * want, "degree {degree}: {outcome:?}");
    }
}

/// Held above zero the same fit errs by twice as much, to one side, and no sample lies below.
#[test]
fn one_sided_fits_err_by_twice_the_two_sided_figure() {
    let sides = Sides { above: 1.0, hard_below: 0.0, ..Sides::FREE };
    let (_, outcome) = solved(&mut fit(4, |s| s.powi(5), sides), &sharp());
    assert!((outcome.tau - 0.125).abs() < 1e-6 && outcome.trespass < 1e-7, "{outcome:?}");
}

/// A hard figure cuts off one sign where tau would go beyond it: the band between the signs keeps its width.
#[test]
fn a_hard_limit_moves_the_error_to_the_other_side() {
    for (hard, want) in [(0.01, 0.115), (0.05, 0.075), (0.2, 0.0625)] {
        let sides = Sides { hard_below: hard, ..Sides::even(1.0) };
        let (_, outcome) = solved(&mut fit(4, |s| s.powi(5), sides), &sharp());
        assert!((outcome.tau - want).abs() < 1e-6 && outcome.trespass < 1e-7, "{hard}: {outcome:?}");
    }
}

/// Unequal shares: both signs strain their shares equally.
#[test]
fn shares_divide_the_error() {
    let sides = Sides { above: 3.0, below: 1.0, ..Sides::FREE };
    let (_, outcome) = solved(&mut fit(4, |s| s.powi(5), sides), &sharp());
    assert!((outcome.tau - 0.125 / 4.0).abs() < 1e-7, "{outcome:?}");
}

/// The smallest ball that holds points: nonlinear rows |p - x|.
struct Ball(Vec<[f64; 2]>);

impl Minimax for Ball {
    fn unknowns(&self) -> usize {
        2
    }

    fn linearize(&mut self, x: &[f64], rows: &mut Rows) -> Option<()> {
        for p in &self.0 {
            let (dx, dy) = (x[0] - p[0], x[1] - p[1]);
            let distance = dx.hypot(dy);
            rows.bound(distance, Sides::even(1.0), [(0, dx / distance), (1, dy / distance)]);
        }
        Some(())
    }
}

#[test]
fn smallest_circle_around_a_triangle_is_its_circumcircle() {
    let corners = [0.4_f64, 2.3, 4.6].map(|a| [3.0 + 2.0 * a.cos(), -1.0 + 2.0 * a.sin()]);
    let (x, outcome) = solved(&mut Ball(corners.to_vec()), &Settings { gain_share: 1e-10, ..sharp() });
    assert!((outcome.tau - 2.0).abs() < 1e-9, "{outcome:?}");
    assert!((x[0] - 3.0).abs() < 1e-6 && (x[1] + 1.0).abs() < 1e-6, "{x:?}");
}

#[test]
fn enough_is_enough_and_an_undefined_start_is_no_result() {
    let settings = Settings { enough: 0.3, ..sharp() };
    let (_, outcome) = solved(&mut fit(4, |s| s.powi(5), Sides::even(1.0)), &settings);
    assert!(outcome.ending == Ending::Enough && outcome.tau <= 0.3);
    let mut broken = Ball(vec![[f64::NAN, 0.0]]);
    assert!(minimize_largest(&mut broken, &mut vec![0.0; 2], &sharp()).is_none());
}

#[test]
fn dear_steps_are_short_but_arrive_at_the_same_place() {
    let free = solved(&mut fit(3, f64::exp, Sides::even(1.0)), &sharp());
    let mut dear = Fit { step_price: 0.3, ..fit(3, f64::exp, Sides::even(1.0)) };
    let one = solved(&mut dear, &Settings { max_rounds: 1, ..sharp() });
    let all = solved(&mut dear, &sharp());
    assert!(one.1.tau > 1.01 * free.1.tau);
    assert!((all.1.tau - free.1.tau).abs() < 1e-4 * free.1.tau, "{all:?} {free:?}");
}

/// Every row taken in from the start must give what the growing set of rows gives.
#[test]
fn the_active_set_changes_nothing() {
    let mut problem = fit(5, |s| (3.0 * s).sin() + s.abs(), Sides::even(1.0));
    let (mut rows, x) = (Rows::default(), vec![0.0; 6]);
    problem.linearize(&x, &mut rows).unwrap();
    let here = worth(&rows, None, 10.0).unwrap();
    let every: Vec<(usize, usize)> = (0..rows.len()).flat_map(|row| [(row, 0), (row, 1)]).collect();
    let trust = Trust { radius: 10.0, way: f64::INFINITY, penalty: 10.0 };
    let (_, few) = best_step(&rows, 6, &here, &trust, &[]).unwrap();
    let (_, all) = best_step(&rows, 6, &here, &trust, &every).unwrap();
    assert!((few.tau - all.tau).abs() < 0.02 * all.tau, "{few:?} {all:?}");
}

/// A polyline through `f`, off zero by hard floors in its first half: every row touches two neighbouring unknowns.
struct Polyline {
    nodes: usize,
    floor: f64,
    phase: f64,
}

impl Minimax for Polyline {
    fn unknowns(&self) -> usize {
        self.nodes
    }

    fn linearize(&mut self, x: &[f64], rows: &mut Rows) -> Option<()> {
        let pieces = self.nodes - 1;
        for i in 0..=20 * pieces {
            let at = i as f64 / 20.0;
            let k = (at as usize).min(pieces - 1);
            let share = at - k as f64;
            let value = (0.7 * at + self.phase).sin() - (1.0 - share) * x[k] - share * x[k + 1];
            let sides =
                if 2 * k < pieces { Sides { hard_below: -self.floor, ..Sides::even(1.0) } } else { Sides::even(1.0) };
            rows.bound(value, sides, [(k, share - 1.0), (k + 1, -share)]);
        }
        for (k, height) in x.iter().enumerate() {
            rows.square(*height, 1e-4, [(k, 1.0)]);
        }
        Some(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Scaling the values scales the error; nothing else changes. From 1e-6 to 1e3.
    #[test]
    fn units_do_not_matter(power in -6..4_i32, shift in -1.0..1.0_f64) {
        let scale = 10f64.powi(power);
        let settings = |scale: f64| Settings { radius: scale, ..sharp() };
        let f = move |s: f64| (2.0 * s + shift).sin();
        let (_, one) = solved(&mut fit(4, f, Sides::even(1.0)), &settings(1.0));
        let (_, other) = solved(&mut fit(4, move |s| scale * f(s), Sides::even(1.0)), &settings(scale));
        prop_assert!((other.tau / scale - one.tau).abs() < 1e-5 * one.tau, "{one:?} {other:?}");
    }

    /// The banded method and the general conic solver find the same least objective.
    #[test]
    fn both_solvers_agree(nodes in 12..40_usize, floor in -0.1..0.1_f64, phase in 0.0..6.0_f64, power in -3..1_i32) {
        let mut problem = Polyline { nodes, floor, phase };
        let (mut rows, x) = (Rows::default(), vec![0.0; nodes]);
        problem.linearize(&x, &mut rows).unwrap();
        let (penalty, radius) = (20.0, 10f64.powi(power));
        let here = worth(&rows, None, penalty).unwrap();
        let scales = Scales { unit: 1.0, tau: here.tau, radius, penalty };
        let mut every = ActiveSet::empty(rows.len());
        for row in 0..rows.len() {
            (0..SIDES).for_each(|which| _ = every.insert(row, which));
        }
        let merit = |step: &Step| worth(&rows, Some(&step.step), penalty).unwrap().merit;
        let whole = ActiveSet::whole(rows.len());
        let banded = merit(&interior::solve(&rows, nodes, &whole, &scales).unwrap());
        let general = merit(&solve(&rows, nodes, &every, &scales).unwrap());
        prop_assert!((banded - general).abs() < 1e-4 * here.merit, "{banded} {general} from {}", here.merit);
    }

    /// However short a way is foreseen: the rows left out of a banded problem change nothing.
    #[test]
    fn rows_out_of_reach_change_nothing(
        nodes in 12..40_usize, floor in -0.1..0.1_f64, phase in 0.0..6.0_f64, way in 0.0..0.5_f64,
    ) {
        let mut problem = Polyline { nodes, floor, phase };
        let (mut rows, x) = (Rows::default(), vec![0.0; nodes]);
        problem.linearize(&x, &mut rows).unwrap();
        let here = worth(&rows, None, 20.0).unwrap();
        let step = |way: f64| best_step(&rows, nodes, &here, &Trust { radius: 1.0, way, penalty: 20.0 }, &[]).unwrap().1;
        let (few, all) = (step(way), step(f64::INFINITY));
        prop_assert!((few.merit - all.merit).abs() < 2e-3 * here.merit, "{few:?} {all:?}");
    }

    /// The best fit's error alternates: it is reached at least degree + 2 times with changing sign (Chebyshev).
    #[test]
    fn errors_alternate(degree in 1..6_usize, a in 0.5..2.0_f64) {
        let mut problem = fit(degree, move |s| (a * s).exp(), Sides::even(1.0));
        let (x, outcome) = solved(&mut problem, &sharp());
        let mut rows = Rows::default();
        problem.linearize(&x, &mut rows).unwrap();
        let (mut turns, mut sign) = (0, 0.0);
        for row in 0..rows.len() {
            let value = rows.value(row);
            if value.abs() > (1.0 - 1e-3) * outcome.tau && value.signum() != sign {
                sign = value.signum();
                turns += 1;
            }
        }
        prop_assert!(turns >= degree + 2, "{turns} turns at degree {degree}");
    }
}
