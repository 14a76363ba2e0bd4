//! What is left on the part's whole region: deviation at samples, refined between them around the extremes, and shares
//! by area. Uses `part` and the other files of this module.

use super::motion_tree::BlockMotion;
use super::ray::NormalRay;
use super::sweep::Sweep;
use super::swept::{Touch, Window};
use crate::part::{DesignSurface, SampleGrid, SurfaceSample};
use std::collections::BTreeMap;

/// A sample of the part and the lowest point that any cutting move reaches on its normal; `None` where it is uncut.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredSample {
    /// Where.
    pub sample: SurfaceSample,
    /// What cut it.
    pub touch: Option<Touch>,
}

impl MeasuredSample {
    /// Signed deviation, mm: positive where material is left.
    pub fn deviation(&self) -> Option<f64> {
        self.touch.map(|t| t.depth)
    }
}

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
    let samples = measure_samples(sweep, grid.samples.clone());
    let areas = vertex_areas(&grid);
    let extremes = |sign| Refinement::new(surface, sweep, window, &grid, &samples, sign).run(fineness.change);
    let ((over, over_count), (under, under_count)) = (extremes(-1.0), extremes(1.0));
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
        let part: f64 = self.samples.iter().zip(&self.areas).filter(|(s, _)| wanted(s)).map(|(_, a)| a).sum();
        if total > 0.0 { part / total } else { 0.0 }
    }
}

fn measure_samples<M: BlockMotion>(sweep: &Sweep<'_, M>, samples: Vec<SurfaceSample>) -> Vec<MeasuredSample> {
    let rays: Vec<NormalRay> = samples.iter().map(ray_of).collect();
    let touches = sweep.lowest_all(&rays, |_| f64::INFINITY);
    samples.into_iter().zip(touches).map(|(sample, touch)| MeasuredSample { sample, touch }).collect()
}

/// The normal of the part at a sample.
pub(super) fn ray_of(sample: &SurfaceSample) -> NormalRay {
    NormalRay { origin: sample.point, normal: sample.normal.0 }
}

/// Moves the samples on the region's edge a little into a triangle of theirs.
fn draw_in_border(surface: &DesignSurface, grid: &mut SampleGrid, border: f64) {
    let mut uses: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for triangle in &grid.triangles {
        for (a, b) in edges(triangle) {
            *uses.entry((a.min(b), a.max(b))).or_default() += 1;
        }
    }
    let mut on_edge = vec![false; grid.samples.len()];
    for ((a, b), count) in uses {
        if count == 1 {
            on_edge[a as usize] = true;
            on_edge[b as usize] = true;
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

fn edges(triangle: &[u32; 3]) -> [(u32, u32); 3] {
    let [a, b, c] = *triangle;
    [(a, b), (b, c), (c, a)]
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

/// Part of a grid triangle, by its corners' weights in that triangle.
#[derive(Clone, Copy)]
struct Facet {
    triangle: usize,
    weights: [[f64; 3]; 3],
    values: [f64; 3],
    /// How far the deviation may rise above its corners, judged by how it bends at the scale of this facet, mm.
    bump: f64,
}

impl Facet {
    fn potential(&self) -> f64 {
        self.values.iter().copied().fold(f64::NEG_INFINITY, f64::max) + 2.0 * self.bump
    }
}

/// Best-first subdivision toward one extreme.
struct Refinement<'a, M> {
    surface: &'a DesignSurface,
    sweep: &'a Sweep<'a, M>,
    window: Window,
    grid: &'a SampleGrid,
    /// +1 looks for the largest undercut, -1 for the deepest overcut.
    sign: f64,
    facets: Vec<Facet>,
    best: Option<MeasuredSample>,
    peak: f64,
}

impl<'a, M: BlockMotion> Refinement<'a, M> {
    fn new(
        surface: &'a DesignSurface,
        sweep: &'a Sweep<'a, M>,
        window: Window,
        grid: &'a SampleGrid,
        samples: &[MeasuredSample],
        sign: f64,
    ) -> Self {
        let mut this =
            Self { surface, sweep, window, grid, sign, facets: Vec::new(), best: None, peak: f64::NEG_INFINITY };
        let values: Vec<f64> = samples.iter().map(|s| this.value(s)).collect();
        let bumps = bumps(grid, &values);
        for sample in samples {
            this.consider(*sample);
        }
        // Overcut is not looked for next to uncut samples, where the deviation jumps: what no pass reaches fails anyway.
        this.facets = grid
            .triangles
            .iter()
            .enumerate()
            .map(|(index, corners)| Facet {
                triangle: index,
                weights: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                values: corners.map(|v| values[v as usize]),
                bump: corners.map(|v| bumps[v as usize]).into_iter().fold(0.0, f64::max),
            })
            .filter(|facet| facet.values.iter().all(|v| *v > -window.outward))
            .collect();
        this
    }

    fn value(&self, sample: &MeasuredSample) -> f64 {
        self.sign * sample.deviation().unwrap_or(self.window.outward)
    }

    fn consider(&mut self, sample: MeasuredSample) {
        let value = self.value(&sample);
        if value > self.peak {
            self.peak = value;
            self.best = Some(sample);
        }
    }

    /// Splits the facets that may rise above the peak until none may by more than `change`. Returns the extreme and the
    /// number of samples spent.
    fn run(mut self, change: f64) -> (Option<MeasuredSample>, usize) {
        const BATCH: usize = 256;
        let budget = self.grid.samples.len().max(4096);
        let clamp = if self.sign > 0.0 { self.window.outward } else { self.window.inward };
        let mut spent = 0;
        while spent < budget && self.peak < clamp {
            let floor = self.peak + change;
            self.facets.retain(|f| f.potential() > floor);
            if self.facets.is_empty() {
                break;
            }
            self.facets.sort_by(|a, b| b.potential().total_cmp(&a.potential()));
            let rest = self.facets.split_off(self.facets.len().min(BATCH));
            let batch = std::mem::replace(&mut self.facets, rest);
            spent += 3 * batch.len();
            self.split(&batch);
        }
        (self.best, spent)
    }

    fn split(&mut self, batch: &[Facet]) {
        let middle = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| 0.5 * (a[i] + b[i])) };
        let middles: Vec<[[f64; 3]; 3]> = batch
            .iter()
            .map(|f| {
                [
                    middle(f.weights[0], f.weights[1]),
                    middle(f.weights[1], f.weights[2]),
                    middle(f.weights[2], f.weights[0]),
                ]
            })
            .collect();
        let places = batch.iter().zip(&middles).flat_map(|(facet, middles)| {
            let corners = self.grid.triangles[facet.triangle].map(|v| &self.grid.samples[v as usize]);
            middles.map(|weights| self.surface.between(corners, weights))
        });
        let measured = measure_samples(self.sweep, places.collect());
        for ((facet, middles), found) in batch.iter().zip(&middles).zip(measured.chunks_exact(3)) {
            let values = [self.value(&found[0]), self.value(&found[1]), self.value(&found[2])];
            for sample in found {
                self.consider(*sample);
            }
            let bend = |k: usize| (values[k] - 0.5 * (facet.values[k] + facet.values[(k + 1) % 3])).abs();
            let bump = bend(0).max(bend(1)).max(bend(2));
            let (w, m, v) = (&facet.weights, middles, &facet.values);
            let child =
                |weights: [[f64; 3]; 3], values: [f64; 3]| Facet { triangle: facet.triangle, weights, values, bump };
            self.facets.extend([
                child([w[0], m[0], m[2]], [v[0], values[0], values[2]]),
                child([m[0], w[1], m[1]], [values[0], v[1], values[1]]),
                child([m[2], m[1], w[2]], [values[2], values[1], v[2]]),
                child([m[0], m[1], m[2]], values),
            ]);
        }
    }
}

/// How far each sample lies from the mean of its neighbours.
fn bumps(grid: &SampleGrid, values: &[f64]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0u32); values.len()];
    for triangle in &grid.triangles {
        for (a, b) in edges(triangle) {
            for (vertex, other) in [(a, b), (b, a)] {
                let sum = &mut sums[vertex as usize];
                sum.0 += values[other as usize];
                sum.1 += 1;
            }
        }
    }
    values.iter().zip(sums).map(|(v, (sum, n))| if n > 0 { (v - sum / f64::from(n)).abs() } else { 0.0 }).collect()
}
