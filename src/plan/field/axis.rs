//! The axis direction as one smooth angle over the whole surface: where the law of attainable errors is sharp it
//! decides, elsewhere smoothness and the user's wish do. Pointwise best directions jump where the curvature's kind
//! changes; this one cannot.

use super::sheet::{Net, Sheet, Station};
use crate::geometry::Vector;
use crate::plan::attainable::FlankLaw;
use nalgebra::{DMatrix, DVector};

/// Spline functions along each parameter.
const SIDE: usize = 7;
/// Weight of the axis' turn over one flank's reach, against 1 for the curvature's misfit over its usual size.
const SMOOTHNESS: f64 = 0.2;
/// Weight of a wanted direction, against the same: the axis may lean to where the error vanishes, but not turn along it.
const LEAN: f64 = 0.05;
/// Error, mm, below which a surface prefers no direction.
const NEGLIGIBLE: f64 = 1e-6;
/// Share of its curvature by which a surface may bend differently in different directions and still prefers none.
const ALIKE: f64 = 0.1;
/// Gauss-Newton steps.
const STEPS: usize = 12;
/// Rounds in which places of large misfit gain weight.
const ROUNDS: usize = 3;

/// A cutting direction that the user would like.
#[derive(Clone, Copy, Debug)]
pub(in crate::plan) struct Wish {
    /// The direction, part frame.
    pub(in crate::plan) direction: Vector,
    /// How firmly borders follow it, against 1 for standing square to the axis.
    pub(in crate::plan) weight: f64,
}

/// Angles of the axis from the first parameter's direction.
#[derive(Clone, Debug)]
pub(in crate::plan) struct AxisField {
    /// One angle a station, rad.
    pub(in crate::plan) angles: Vec<f64>,
    /// Largest error of a fully engaged flank by the law, mm.
    pub(in crate::plan) worst: f64,
}

struct Problem<'a> {
    sheet: &'a Sheet,
    flank: &'a FlankLaw,
    wish: Option<Wish>,
    net: Net,
    usual: f64,
    /// Weight of each station's misfit, from the rounds before.
    weights: Vec<f64>,
}

/// One residual at a station: its value, and its derivatives by the angle and by the angle's derivatives by s and t.
type Row = (f64, [f64; 3]);

impl AxisField {
    /// The field found from a constant angle.
    pub(in crate::plan) fn solve(sheet: &Sheet, flank: &FlankLaw, wish: Option<Wish>, start: f64) -> Option<Self> {
        let squares = sheet.stations.iter().map(|s| {
            let bent = s.bending.form[0].abs() + s.bending.form[2].abs();
            s.area * (s.bending.contrast().powi(2) + (ALIKE * bent).powi(2))
        });
        let usual = squares.sum::<f64>().sqrt().max(16.0 * NEGLIGIBLE / flank.reach.powi(2));
        let net = Net::new(SIDE)?;
        let mut coefficients = vec![start; net.size()];
        let weights = vec![1.0; sheet.stations.len()];
        let mut problem = Problem { sheet, flank, wish, net, usual, weights };
        for _ in 0..ROUNDS {
            problem.minimize(&mut coefficients)?;
            problem.reweight(&coefficients);
        }
        Some(Self::of(sheet, flank, problem.angles(&coefficients)))
    }

    /// The axis square to a direction everywhere.
    pub(in crate::plan) fn square_to(sheet: &Sheet, direction: &Vector, flank: &FlankLaw) -> Self {
        let angle = |station: &Station| {
            let (x, y) = (station.bending.e1.dot(direction), station.bending.e2.dot(direction));
            x.atan2(-y)
        };
        Self::of(sheet, flank, sheet.stations.iter().map(angle).collect())
    }

    fn of(sheet: &Sheet, flank: &FlankLaw, angles: Vec<f64>) -> Self {
        let places = sheet.stations.iter().zip(&angles);
        let worst = places.map(|(s, a)| flank.error(s.bending.curvature(*a).0, flank.reach)).fold(0.0, f64::max);
        Self { angles, worst }
    }

    /// True where the axis is the same line nearly everywhere.
    pub(in crate::plan) fn resembles(&self, other: &Self, sheet: &Sheet) -> bool {
        let off = self.angles.iter().zip(&other.angles).zip(&sheet.stations);
        off.map(|((a, b), station)| station.area * (a - b).sin().powi(2)).sum::<f64>() < 0.01
    }
}

impl Problem<'_> {
    fn angles(&self, coefficients: &[f64]) -> Vec<f64> {
        self.sheet.stations.iter().map(|s| self.net.at(s.place).value(coefficients)[0]).collect()
    }

    fn rows(&self, station: &Station, weight: f64, [angle, by_s, by_t]: [f64; 3]) -> [Row; 4] {
        let (hollow, slope) = station.bending.curvature(angle);
        let room = (1.0 - self.flank.radius * hollow).max(0.05);
        let scale = weight.sqrt() / self.usual;
        let bent = ((hollow / room + self.flank.bend) * scale, [slope / (room * room) * scale, 0.0, 0.0]);
        let turn = SMOOTHNESS * self.flank.reach;
        let gradient = station.gradient((by_s, by_t));
        let (along_s, along_t) = (station.gradient((1.0, 0.0)), station.gradient((0.0, 1.0)));
        let smooth = |k: usize| (turn * gradient[k], [0.0, turn * along_s[k], turn * along_t[k]]);
        let wished = self.wish.map_or((0.0, [0.0; 3]), |wish| {
            let (a, b) = (station.bending.e1.dot(&wish.direction), station.bending.e2.dot(&wish.direction));
            let length = a.hypot(b).max(1e-9);
            let (sin, cos) = angle.sin_cos();
            let scale = LEAN / length;
            ((a * cos + b * sin) * scale, [(b * cos - a * sin) * scale, 0.0, 0.0])
        });
        [bent, smooth(0), smooth(1), wished]
    }

    fn cost(&self, coefficients: &[f64]) -> f64 {
        let places = self.sheet.stations.iter().zip(&self.weights);
        places
            .map(|(station, weight)| {
                let rows = self.rows(station, *weight, self.net.at(station.place).value(coefficients));
                station.area * rows.iter().map(|(value, _)| value * value).sum::<f64>()
            })
            .sum()
    }

    /// Damped Gauss-Newton.
    fn minimize(&self, coefficients: &mut Vec<f64>) -> Option<()> {
        let size = self.net.size();
        let mut cost = self.cost(coefficients);
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let mut matrix = DMatrix::<f64>::zeros(size, size);
            let mut gradient = DVector::<f64>::zeros(size);
            for (station, weight) in self.sheet.stations.iter().zip(&self.weights) {
                let local = self.net.at(station.place);
                let rows = self.rows(station, *weight, local.value(coefficients));
                for (value, by) in rows {
                    let run: Vec<(usize, f64)> = local
                        .functions()
                        .map(|(index, f)| (index, by[0] * f[0] + by[1] * f[1] + by[2] * f[2]))
                        .collect();
                    for (i, a) in &run {
                        gradient[*i] += station.area * value * a;
                        for (j, b) in &run {
                            matrix[(*i, *j)] += station.area * a * b;
                        }
                    }
                }
            }
            let mean = matrix.trace() / size as f64;
            for i in 0..size {
                matrix[(i, i)] += damping * mean + 1e-12;
            }
            let step = matrix.cholesky()?.solve(&gradient);
            let moved: Vec<f64> = coefficients.iter().zip(step.iter()).map(|(c, s)| c - s).collect();
            let found = self.cost(&moved);
            if found < cost {
                let settled = cost - found < 1e-6 * cost;
                (*coefficients, cost, damping) = (moved, found, damping * 0.3);
                if settled {
                    break;
                }
            } else {
                damping *= 10.0;
            }
        }
        Some(())
    }

    /// Lawson's rule toward the least largest misfit, held within limits: the field must stay smooth.
    fn reweight(&mut self, coefficients: &[f64]) {
        let misfits: Vec<f64> = self
            .sheet
            .stations
            .iter()
            .zip(self.angles(coefficients))
            .map(|(station, angle)| self.flank.misfit(station.bending.curvature(angle).0).abs().min(1e3))
            .collect();
        let mean = misfits.iter().zip(&self.sheet.stations).map(|(m, s)| m * s.area).sum::<f64>().max(1e-12);
        for (weight, misfit) in self.weights.iter_mut().zip(&misfits) {
            *weight = (*weight * (0.5 + 0.5 * misfit / mean)).clamp(0.2, 20.0);
        }
    }
}
