//! Takes what the moving tool covers away from every line, block by block. Uses `geometry` and the other files of this
//! module.
//!
//! Lines do not know of each other: bands of rows are cut side by side, each through the whole program, and what was taken
//! is added up in the order of the bands. The result is the same for any number of threads.

use super::dexel::Dexel;
use super::engagement::{Probe, Probes};
use super::extent::Extent;
use super::grid::{Grid, Lattice};
use super::moves::{Moves, Stretch};
use super::shadow::{Shadow, bounds};
use super::solid::Solid;
use super::straight::Shifted;
use super::turning::Turning;
use crate::geometry::Vector;
use crate::tool::Section;
use rayon::prelude::*;

/// Rows that are cut together.
pub(super) const BAND: usize = 8;
/// Stretches whose boxes are looked at together.
const GROUP: usize = 64;
/// A turn that moves no point of the solid by more than this counts as none, mm.
const NO_TURN: f64 = 1e-7;

/// What one block took from the lines of one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Bite {
    pub(super) block: usize,
    /// By the flutes: sum of lengths, and the greatest depth, mm.
    pub(super) length: f64,
    pub(super) depth: f64,
    /// By shank and holder.
    pub(super) body_length: f64,
    pub(super) body_depth: f64,
    /// Whether the holder is what reached deepest of both.
    pub(super) holder: bool,
}

/// A stretch with the box of everything that it sweeps.
struct Boxed {
    low: Vector,
    high: Vector,
}

/// Stretches, solids and boxes, ready to cut any grid.
pub(super) struct Cutter<'a> {
    moves: &'a Moves,
    solids: &'a [Solid],
    lattice: &'a Lattice,
    boxes: Vec<Boxed>,
    groups: Vec<Boxed>,
}

/// A solid in a stretch for one direction of lines.
enum Kernel<'a> {
    Straight(Box<Shifted>),
    Turning(Box<Turning<'a>>),
}

impl Boxed {
    fn meets(&self, axis: usize, low: f64, high: f64) -> bool {
        self.low[axis] <= high && self.high[axis] >= low
    }
}

impl<'a> Cutter<'a> {
    pub(super) fn new(moves: &'a Moves, solids: &'a [Solid], lattice: &'a Lattice) -> Self {
        let around = |stretch: &Stretch| {
            let mut boxed = Boxed { low: Vector::repeat(f64::INFINITY), high: Vector::repeat(f64::NEG_INFINITY) };
            for (solid, k) in solids.iter().flat_map(|solid| (0..3).map(move |k| (solid, k))) {
                let (low, high) = bounds(solid, stretch, &Vector::ith(k, 1.0));
                boxed.low[k] = boxed.low[k].min(low);
                boxed.high[k] = boxed.high[k].max(high);
            }
            boxed
        };
        let boxes: Vec<Boxed> = moves.stretches.par_iter().map(around).collect();
        let union = |group: &[Boxed]| Boxed {
            low: group.iter().fold(Vector::repeat(f64::INFINITY), |low, b| low.inf(&b.low)),
            high: group.iter().fold(Vector::repeat(f64::NEG_INFINITY), |high, b| high.sup(&b.high)),
        };
        let groups = boxes.chunks(GROUP).map(union).collect();
        Self { moves, solids, lattice, boxes, groups }
    }

    /// Cuts all lines of a grid. Returns what each block took, in order, and which probes were in material.
    pub(super) fn cut(&self, grid: &mut Grid, probes: &Probes) -> (Vec<Bite>, Vec<u32>) {
        let (along, columns) = (grid.along, grid.columns);
        let bands: Vec<(Vec<Bite>, Vec<u32>)> = grid
            .dexels
            .par_chunks_mut(BAND * columns)
            .enumerate()
            .map(|(band, dexels)| {
                let probes = if probes.along == along { probes.of_band(band * BAND, BAND) } else { &[] };
                Band { cutter: self, along, columns, first: band * BAND, dexels }.cut(probes)
            })
            .collect();
        let mut bites = vec![Bite::default(); self.moves.blocks.len()];
        for bite in bands.iter().flat_map(|(bites, _)| bites) {
            bites[bite.block].join(bite);
        }
        (bites, bands.into_iter().flat_map(|(_, found)| found).collect())
    }
}

impl Bite {
    fn join(&mut self, other: &Self) {
        self.length += other.length;
        self.depth = self.depth.max(other.depth);
        self.body_length += other.body_length;
        if other.body_depth > self.body_depth {
            (self.body_depth, self.holder) = (other.body_depth, other.holder);
        }
    }

    fn took_nothing(&self) -> bool {
        self.length == 0.0 && self.body_length == 0.0
    }
}

/// Some rows of a grid.
struct Band<'a> {
    cutter: &'a Cutter<'a>,
    along: usize,
    columns: usize,
    /// Index of the first row.
    first: usize,
    dexels: &'a mut [Dexel],
}

impl Band<'_> {
    fn cut(mut self, probes: &[Probe]) -> (Vec<Bite>, Vec<u32>) {
        let Cutter { moves, lattice, boxes, groups, .. } = self.cutter;
        let axis = (self.along + 2) % 3;
        let rows = self.dexels.len() / self.columns;
        let (low, high) = (lattice.place(axis, self.first), lattice.place(axis, self.first + rows - 1));
        let (mut bites, mut found) = (Vec::new(), Vec::new());
        let mut bite = Bite::default();
        let mut waiting = probes.iter().peekable();
        for (group, _) in groups.iter().enumerate().filter(|(_, group)| group.meets(axis, low, high)) {
            let first = group * GROUP;
            for (offset, stretch) in moves.stretches[first..].iter().take(GROUP).enumerate() {
                let index = first + offset;
                if !boxes[index].meets(axis, low, high) {
                    continue;
                }
                while let Some(probe) = waiting.next_if(|probe| probe.stretch <= index) {
                    found.extend(self.probed(probe));
                }
                if stretch.block != bite.block {
                    bites.extend(Some(std::mem::take(&mut bite)).filter(|b| !b.took_nothing()));
                    bite.block = stretch.block;
                }
                self.cut_stretch(stretch, &mut bite);
            }
        }
        bites.extend(Some(bite).filter(|b| !b.took_nothing()));
        found.extend(waiting.filter_map(|probe| self.probed(probe)));
        (bites, found)
    }

    /// The probe's number, where it is in material.
    fn probed(&self, probe: &Probe) -> Option<u32> {
        let dexel = self.dexels.get((probe.row - self.first) * self.columns + probe.column)?;
        dexel.meets(probe.place, probe.place).then_some(probe.number)
    }

    fn cut_stretch(&mut self, stretch: &Stretch, bite: &mut Bite) {
        let lattice = self.cutter.lattice;
        for solid in self.cutter.solids {
            let shadow = Shadow::new(solid, stretch, self.along);
            let rows = shadow.rows(lattice);
            let mine = rows.start.max(self.first)..rows.end.min(self.first + self.dexels.len() / self.columns);
            if mine.is_empty() {
                continue;
            }
            let kernel = Kernel::new(solid, stretch, self.along);
            let axis = (self.along + 1) % 3;
            let all = (0..self.columns).map(|column| shadow.along_column(lattice.place(axis, column)));
            let reach: Vec<(f64, f64)> = all.collect();
            for row in mine {
                self.cut_row(row, (&shadow, &reach), stretch, solid, &kernel, bite);
            }
        }
    }

    fn cut_row(
        &mut self,
        row: usize,
        (shadow, reach): (&Shadow, &[(f64, f64)]),
        stretch: &Stretch,
        solid: &Solid,
        kernel: &Kernel<'_>,
        bite: &mut Bite,
    ) {
        let (lattice, along) = (self.cutter.lattice, self.along);
        let (first, second) = ((along + 1) % 3, (along + 2) % 3);
        let mut foot = Vector::zeros();
        foot[second] = lattice.place(second, row);
        let (low, high) = shadow.along_row(foot[second]);
        for column in shadow.columns(lattice, foot[second]) {
            let dexel = &mut self.dexels[(row - self.first) * self.columns + column];
            if !dexel.meets(low.max(reach[column].0), high.min(reach[column].1)) {
                continue;
            }
            foot[first] = lattice.place(first, column);
            let Some((extent, zero)) = kernel.extent(stretch, &foot, along) else { continue };
            let ends = (extent[0].s + zero, extent[1].s + zero);
            let normals = || extent.map(|end| -kernel.normal(stretch, solid, &foot, along, end.s + zero, &end));
            let Some(taken) = dexel.cut(ends, along, normals) else { continue };
            if solid.section == Section::Flute {
                bite.length += taken.length;
                bite.depth = bite.depth.max(taken.depth);
            } else {
                bite.body_length += taken.length;
                if taken.depth > bite.body_depth {
                    (bite.body_depth, bite.holder) = (taken.depth, solid.section == Section::Holder);
                }
            }
        }
    }
}

impl<'a> Kernel<'a> {
    fn new(solid: &'a Solid, stretch: &Stretch, along: usize) -> Self {
        let turn = (stretch.to.axis.into_inner() - stretch.from.axis.into_inner()).norm();
        let straight = (turn * (solid.high + solid.radius) < NO_TURN)
            .then(|| Shifted::new(solid, stretch.from.axis.into_inner(), stretch.to.tip - stretch.from.tip, along));
        match straight.flatten() {
            Some(shifted) => Self::Straight(Box::new(shifted)),
            None => Self::Turning(Box::new(Turning::new(solid, stretch.from, stretch.to, along))),
        }
    }

    /// What is covered of the line through `foot`, and the coordinate from which its places count.
    fn extent(&self, stretch: &Stretch, foot: &Vector, along: usize) -> Option<(Extent, f64)> {
        match self {
            Self::Straight(shifted) => {
                let mut o = foot - stretch.from.tip.coords;
                o[along] = 0.0;
                Some((shifted.extent(&o)?, stretch.from.tip[along]))
            }
            Self::Turning(turning) => Some((turning.extent(foot)?, 0.0)),
        }
    }

    /// Outward normal of the solid at one end of what it covers.
    fn normal(
        &self,
        stretch: &Stretch,
        solid: &Solid,
        foot: &Vector,
        along: usize,
        place: f64,
        end: &super::extent::End,
    ) -> Vector {
        let (tip, axis) = match self {
            Self::Straight(_) => {
                let way = stretch.to.tip - stretch.from.tip;
                (stretch.from.tip.coords + way * end.t, stretch.from.axis.into_inner())
            }
            Self::Turning(turning) => turning.pose(end.t),
        };
        let mut x = foot - tip;
        x[along] += place;
        solid.normal(end.face, &x, &axis)
    }
}
