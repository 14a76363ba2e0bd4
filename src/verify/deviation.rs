//! What is left on the part's whole region: deviation at samples, refined between them around the extremes, and shares
//! by area. Uses `part` and the other files of this module.

use super::measured::{MeasuredSample, edges, measure_samples};
use super::motion_tree::BlockMotion;
use super::refine::{Refinement, Side};
use super::sweep::Sweep;
use super::swept::Window;
use crate::part::{DesignSurface, SampleGrid, SurfaceSample};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The measured part.
#[derive(Clone, Debug)]
pub struct PartDeviation {
    /// The samples of the grid.
    pub samples: Vec<MeasuredSample>,
    /// Indices of three samples each, anticlockwise seen from the tool's side.
    pub triangles: Vec<[u32; 3]>,
    /// Area that belongs to each sample, mm²: a third of its triangles.
    pub areas: Vec<f64>,
    /// The deepest overcut found, between samples too; none when nothing is below the surface.
    pub worst_overcut: Option<MeasuredSample>,
    /// The largest undercut found, between samples too; an uncut sample when there is one.
    pub worst_undercut: Option<MeasuredSample>,
    /// Samples measured in all, those of the refinement included.
    pub measured: usize,
    /// Distance from the region's edge within which nothing is claimed, mm.
    pub border: f64,
}

/// How finely the part is measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fineness {
    /// Distance of neighbouring samples, mm.
    pub(super) spacing: f64,
    /// Refinement between samples ends when it could not change the extremes by more, mm.
    pub(super) change: f64,
    /// Samples on the region's edge are taken this far inside, mm: there the tool may end exactly at the edge.
    pub(super) border: f64,
}

/// Measures the whole region.
pub(super) fn measure<M: BlockMotion>(
    surface: &DesignSurface,
    sweep: &Sweep<'_, M>,
    window: Window,
    fineness: &Fineness,
) -> PartDeviation {
    let mut grid = surface.sample(fineness.spacing);
    draw_in_border(surface, &mut grid, fineness.border);
    let samples = measure_samples(sweep, grid.samples.clone(), |_| None);
    let areas = vertex_areas(&grid);
    let extremes = |side| Refinement::new(surface, sweep, window, &grid, &samples, side).run(fineness.change);
    let ((over, over_count), (under, under_count)) =
        rayon::join(|| extremes(Side::Overcut), || extremes(Side::Undercut));
    PartDeviation {
        measured: samples.len() + over_count + under_count,
        worst_overcut: over.filter(|m| m.deviation().is_some_and(|d| d < 0.0)),
        worst_undercut: under.filter(|m| m.deviation().is_none_or(|d| d > 0.0)),
        samples,
        triangles: grid.triangles,
        areas,
        border: fineness.border,
    }
}

impl PartDeviation {
    /// Share of the area on which `wanted` holds.
    pub fn area_share(&self, wanted: impl Fn(&MeasuredSample) -> bool) -> f64 {
        let total: f64 = self.areas.iter().sum();
        let chosen = self.samples.iter().zip(&self.areas).filter(|(s, _)| wanted(s)).map(|(_, a)| a);
        // Not `sum`, which makes -0 of nothing.
        let part = chosen.fold(0.0, |sum, area| sum + area);
        if total > 0.0 { part / total } else { 0.0 }
    }
}

/// Moves the samples on the region's edge a little into a triangle of theirs.
fn draw_in_border(surface: &DesignSurface, grid: &mut SampleGrid, border: f64) {
    let mut sides: Vec<(u32, u32)> = grid.triangles.iter().flat_map(edges).map(|(a, b)| (a.min(b), a.max(b))).collect();
    sides.par_sort_unstable();
    let mut on_edge = vec![false; grid.samples.len()];
    for single in sides.chunk_by(|a, b| a == b).filter(|same| same.len() == 1) {
        for (a, b) in single {
            on_edge[*a as usize] = true;
            on_edge[*b as usize] = true;
        }
    }
    // Each edge sample moves toward the mean of the other corners of the triangle that has the fewest edge samples.
    let mut into: BTreeMap<u32, (usize, usize)> = BTreeMap::new();
    for (index, triangle) in grid.triangles.iter().enumerate() {
        let count = triangle.iter().filter(|v| on_edge[**v as usize]).count();
        for vertex in triangle.iter().filter(|v| on_edge[**v as usize]) {
            let entry = into.entry(*vertex).or_insert((count, index));
            *entry = (*entry).min((count, index));
        }
    }
    let moved: Vec<(usize, SurfaceSample)> = into
        .into_iter()
        .map(|(vertex, (_, index))| {
            let triangle = grid.triangles[index];
            let corners = triangle.map(|v| &grid.samples[v as usize]);
            let centre = (corners[0].point.coords + corners[1].point.coords + corners[2].point.coords) / 3.0;
            let reach = (grid.samples[vertex as usize].point.coords - centre).norm();
            let share = if reach > 0.0 { (border / reach).min(1.0) } else { 0.0 };
            let weights = triangle.map(|v| share / 3.0 + if v == vertex { 1.0 - share } else { 0.0 });
            (vertex as usize, surface.between(corners, weights))
        })
        .collect();
    for (vertex, sample) in moved {
        grid.samples[vertex] = sample;
    }
}

fn vertex_areas(grid: &SampleGrid) -> Vec<f64> {
    let mut areas = vec![0.0; grid.samples.len()];
    for triangle in &grid.triangles {
        let [a, b, c] = triangle.map(|v| grid.samples[v as usize].point);
        let area = 0.5 * (b - a).cross(&(c - a)).norm();
        for vertex in triangle {
            areas[*vertex as usize] += area / 3.0;
        }
    }
    areas
}
