//! What a tool path's sweeps leave of the part: envelope points of the whole flank, far denser than the planner looks,
//! gathered in small cells of the surface. A cell's undercut is what the lowest sweep over it leaves. Where a sweep passes a
//! cell more than once, as where the tool turns onto the surface, each time counts by itself: what the lower one takes is
//! gone.

use rayon::prelude::*;
use regulus::diagnostic::{Diagnostic, Result};
use regulus::envelope::envelope_point;
use regulus::geometry::Vector;
use regulus::motion::{Pass, PassKind, PassMotion, RuledMotion, ToolPath};
use regulus::part::{DesignSurface, OrientedSpline, Part};
use regulus::tool::Tool;

/// Cells along the flank.
const CELLS: f64 = 24.0;
/// Most cells along one parameter.
const MOST_CELLS: f64 = 1200.0;
/// Envelope points along one side of a cell.
const POINTS: f64 = 2.2;

/// Instants after which a sweep that comes back to a cell passes it once more: about four times what it takes to cross one.
const BACK: usize = 8;

/// How far, mm, what is over the surface may lie off the normal at its foot.
const BEYOND: f64 = 1e-5;

/// What the sweeps came to.
pub(crate) struct Figures {
    /// Deepest cut below the surface, mm.
    pub(crate) overcut: f64,
    /// Highest rest above the surface where any sweep passes, mm.
    pub(crate) undercut: f64,
    /// Largest angle between neighbouring envelopes along their seams.
    pub(crate) kink_deg: f64,
    /// Share of the area that a sweep passes.
    pub(crate) covered: f64,
    /// Number of sweeps.
    pub(crate) strips: usize,
}

/// What one sweep does to a cell.
#[derive(Clone, Copy)]
struct Cut {
    lowest: f64,
    highest: f64,
    /// What the envelope's normal differs by from the surface's under it: unlike the normals themselves this hardly changes
    /// within a cell, however round the surface is.
    tilt: Vector,
}

impl Cut {
    /// What is left where both were made, with the deepest of either.
    fn over(self, other: Self) -> Self {
        let lower = if other.highest < self.highest { other } else { self };
        Self { lowest: self.lowest.min(other.lowest), ..lower }
    }
}

/// What one sweep does to a cell, time after time.
#[derive(Clone, Copy, Default)]
struct Passes {
    /// The last of them, and its last instant.
    last: Option<(usize, Cut)>,
    /// What those before leave.
    before: Option<Cut>,
}

impl Passes {
    fn add(&mut self, instant: usize, cut: Cut) {
        self.last = match self.last {
            Some((then, seen)) if instant <= then + BACK => {
                let lowest = seen.lowest.min(cut.lowest);
                Some((instant, Cut { lowest, highest: seen.highest.max(cut.highest), ..cut }))
            }
            _ => {
                self.before = self.left();
                Some((instant, cut))
            }
        };
    }

    fn left(&self) -> Option<Cut> {
        let last = self.last.map(|(_, cut)| cut);
        self.before.into_iter().chain(last).reduce(Cut::over)
    }
}

/// Cells in columns side by side along v, each divided along u by its own length: all are about as large, also where the
/// surface is narrow.
struct Grid<'a> {
    spline: &'a OrientedSpline,
    /// Number of the first cell of each column, and of all cells.
    firsts: Vec<usize>,
    /// Size of a cell, mm.
    size: f64,
}

/// Judges the cuts of a path.
pub(crate) fn measure(part: &Part, tool: &Tool, path: &ToolPath) -> Result<Figures> {
    let DesignSurface::Spline(spline) = &part.surface else {
        return Err(Diagnostic::error("only splines are measured"));
    };
    let grid = Grid::new(spline, tool);
    let cuts: Vec<&RuledMotion> = path.passes.iter().filter_map(cut).collect();
    let swept: Vec<Vec<Option<Cut>>> = cuts.par_iter().map(|motion| grid.sweep(motion, tool)).collect();
    let mut figures = Figures { overcut: 0.0, undercut: 0.0, kink_deg: 0.0, covered: 0.0, strips: cuts.len() };
    let lowest = |cell: usize| {
        let cuts = swept.iter().enumerate().filter_map(|(strip, cells)| Some((strip, cells[cell]?)));
        cuts.min_by(|a, b| a.1.highest.total_cmp(&b.1.highest))
    };
    let (mut area, mut covered) = (0.0, 0.0);
    for j in 0..grid.columns() {
        for i in 0..grid.rows(j) {
            let cell = grid.firsts[j] + i;
            let weight = grid.area(i, j);
            area += weight;
            let Some((strip, cut)) = lowest(cell) else { continue };
            covered += weight;
            figures.undercut = figures.undercut.max(cut.highest);
            for cells in &swept {
                figures.overcut = figures.overcut.max(cells[cell].map_or(0.0, |cut| -cut.lowest));
            }
            // A seam runs between this cell and the next where another sweep is the lowest there.
            for next in grid.next(i, j).into_iter().flatten() {
                let Some((other, beyond)) = lowest(next) else { continue };
                if other != strip {
                    let here = swept[other][cell].unwrap_or(beyond);
                    figures.kink_deg = figures.kink_deg.max((cut.tilt - here.tilt).norm().to_degrees());
                }
            }
        }
    }
    figures.covered = covered / area;
    Ok(figures)
}

fn cut(pass: &Pass) -> Option<&RuledMotion> {
    match &pass.motion {
        PassMotion::Ruled(motion) if pass.kind == PassKind::Cut => Some(motion),
        _ => None,
    }
}

impl<'a> Grid<'a> {
    fn new(spline: &'a OrientedSpline, tool: &Tool) -> Self {
        let [(u0, u1), (v0, v1)] = spline.surface().domain();
        let mut longest = [0.0_f64; 2];
        for i in 0..=20 {
            for j in 0..=20 {
                let (a, b) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                let jet = spline.surface().jet(u0 + a * (u1 - u0), v0 + b * (v1 - v0));
                longest = [longest[0].max(jet.su.norm() * (u1 - u0)), longest[1].max(jet.sv.norm() * (v1 - v0))];
            }
        }
        let size = (tool.flute_length() / CELLS).max(longest[0].max(longest[1]) / MOST_CELLS);
        let columns = (longest[1] / size).ceil() as usize;
        let mut firsts = vec![0];
        for j in 0..columns {
            let b = (j as f64 + 0.5) / columns as f64;
            let speed =
                |i: i32| spline.surface().jet(u0 + f64::from(i) / 20.0 * (u1 - u0), v0 + b * (v1 - v0)).su.norm();
            let length = (0..=20).map(speed).fold(0.0, f64::max) * (u1 - u0);
            firsts.push(firsts[j] + ((length / size).ceil() as usize).max(1));
        }
        Self { spline, firsts, size }
    }

    fn columns(&self) -> usize {
        self.firsts.len() - 1
    }

    fn rows(&self, column: usize) -> usize {
        self.firsts[column + 1] - self.firsts[column]
    }

    /// Middle of a cell as shares of the parameters' intervals.
    fn middle(&self, i: usize, j: usize) -> [f64; 2] {
        [(i as f64 + 0.5) / self.rows(j) as f64, (j as f64 + 0.5) / self.columns() as f64]
    }

    /// The cell at these shares of the parameters' intervals.
    fn at(&self, [a, b]: [f64; 2]) -> usize {
        let index = |share: f64, n: usize| ((share * n as f64) as usize).min(n - 1);
        let j = index(b, self.columns());
        self.firsts[j] + index(a, self.rows(j))
    }

    /// The cells after one along u and along v.
    fn next(&self, i: usize, j: usize) -> [Option<usize>; 2] {
        let [a, b] = self.middle(i, j);
        let beside = (j + 1 < self.columns()).then(|| self.at([a, b + 1.0 / self.columns() as f64]));
        [(i + 1 < self.rows(j)).then(|| self.firsts[j] + i + 1), beside]
    }

    fn area(&self, i: usize, j: usize) -> f64 {
        let [(u0, u1), (v0, v1)] = self.spline.surface().domain();
        let [a, b] = self.middle(i, j);
        let jet = self.spline.surface().jet(u0 + a * (u1 - u0), v0 + b * (v1 - v0));
        jet.su.cross(&jet.sv).norm() / self.rows(j) as f64
    }

    fn cell(&self, u: f64, v: f64) -> Option<usize> {
        let [(u0, u1), (v0, v1)] = self.spline.surface().domain();
        let (a, b) = ((u - u0) / (u1 - u0), (v - v0) / (v1 - v0));
        let inside = (0.0..=1.0).contains(&a) && (0.0..=1.0).contains(&b);
        inside.then(|| self.at([a, b]))
    }

    /// Every cell that the flank passes in one sweep.
    fn sweep(&self, motion: &RuledMotion, tool: &Tool) -> Vec<Option<Cut>> {
        let mut cells = vec![Passes::default(); self.firsts[self.columns()]];
        let (start, end) = motion.domain();
        let middle = |share: f64| {
            let t = start + (end - start) * share;
            nalgebra::center(&motion.lower.point(t), &motion.upper.point(t))
        };
        let fastest = (0..100).map(|i| (middle(f64::from(i + 1) / 100.0) - middle(f64::from(i) / 100.0)).norm());
        let instants = (150.0 * fastest.fold(0.0, f64::max) * POINTS / self.size).ceil() as usize;
        let heights = (tool.flute_length() * POINTS / self.size).ceil() as usize;
        let mut near = vec![None; heights + 1];
        for j in 0..=instants {
            let t = start + (end - start) * j as f64 / instants as f64;
            let Some(rate) = motion.pose_rate(t) else { continue };
            for (k, near) in near.iter_mut().enumerate() {
                let height = tool.flute_length() * k as f64 / heights as f64;
                let Some(contact) = tool.contact_at(height).filter(|c| c.normal_radial > 1e-3) else { continue };
                let centre = rate.pose.at_height(contact.sphere_height());
                let surface = self.spline.surface();
                let place = near.unwrap_or_else(|| {
                    let foot = surface.closest(&centre);
                    (foot.u, foot.v)
                });
                let foot = surface.closest_from(&centre, place);
                let into = -self.spline.at(foot.u, foot.v).normal.0;
                let Ok(touch) = envelope_point(&rate, &contact, &into) else { continue };
                let foot = surface.closest_from(&touch.point, (foot.u, foot.v));
                *near = Some((foot.u, foot.v));
                let Some(cell) = self.cell(foot.u, foot.v) else { continue };
                let at = self.spline.at(foot.u, foot.v);
                let offset = touch.point - at.point;
                let height = offset.dot(&at.normal.0);
                // Not square over its foot: it lies beyond the surface's edge.
                if (offset - at.normal.0.into_inner() * height).norm() > BEYOND {
                    continue;
                }
                let tilt = touch.normal.into_inner() + at.normal.0.into_inner();
                cells[cell].add(j, Cut { lowest: height, highest: height, tilt });
            }
        }
        cells.iter().map(Passes::left).collect()
    }
}
