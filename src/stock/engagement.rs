//! How far round the flutes are in material: points just outside the tool, ahead of its motion, are looked up in the stock
//! as it is at that moment. Uses `geometry` and `tool`.

use super::grid::Lattice;
use super::moves::{Moves, Stretch};
use crate::geometry::Vector;
use crate::motion::Pose;
use crate::tool::Tool;

/// Moments of a program that are looked at, at most about.
const MOMENTS: usize = 600;
/// Directions about the axis: steps of 3 degrees.
const DIRECTIONS: usize = 120;
/// Heights on the flutes.
const HEIGHTS: usize = 10;
/// Distance of the points from the tool, cells.
const AHEAD: f64 = 0.5;

/// A point to be looked up before a stretch is cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Probe {
    pub(super) stretch: usize,
    pub(super) row: usize,
    pub(super) column: usize,
    /// Coordinate along the line, mm.
    pub(super) place: f64,
    pub(super) number: u32,
}

/// All points of a program, by band and then by stretch.
pub(super) struct Probes {
    /// Direction of the lines that they are looked up in.
    pub(super) along: usize,
    list: Vec<Probe>,
    /// Block and time of each moment.
    moments: Vec<(usize, f64)>,
}

/// How far round the flutes are in material at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Engagement {
    /// Index of the block.
    pub block: usize,
    /// When, s.
    pub time: f64,
    /// Largest angle in material at any one height, radians; to about a cell over the radius.
    pub angle: f64,
}

impl Probes {
    /// Points around the flutes at evenly chosen feed stretches.
    pub(super) fn new(moves: &Moves, tool: &Tool, lattice: &Lattice, band: usize) -> Self {
        let feed: Vec<usize> = (0..moves.stretches.len())
            .filter(|i| moves.blocks.get(moves.stretches[*i].block).is_some_and(|block| !block.rapid))
            .collect();
        let every = feed.len().div_ceil(MOMENTS).max(1);
        let mut probes = Self { along: 2, list: Vec::new(), moments: Vec::new() };
        // Where there are few stretches, each is looked at several times on its way.
        let parts = (MOMENTS / feed.len().max(1)).clamp(1, 8);
        let mut first_of_block = (usize::MAX, 0);
        for index in feed.into_iter().step_by(every) {
            let stretch = &moves.stretches[index];
            let block = &moves.blocks[stretch.block];
            if first_of_block.0 != stretch.block {
                first_of_block = (stretch.block, moves.stretches.partition_point(|s| s.block < stretch.block));
            }
            let count = moves.stretches.partition_point(|s| s.block <= stretch.block) - first_of_block.1;
            for part in 0..parts {
                let share = (part as f64 + 0.5) / parts as f64;
                let within = ((index - first_of_block.1) as f64 + share) / count as f64;
                probes.moments.push((stretch.block, block.start + within * block.duration));
                probes.around(stretch, (index, share), tool, lattice);
            }
        }
        probes.list.sort_by_key(|probe| (probe.row / band, probe.stretch, probe.number));
        probes
    }

    fn around(&mut self, stretch: &Stretch, (index, share): (usize, f64), tool: &Tool, lattice: &Lattice) {
        let Pose { tip, axis } = stretch.from.interpolate(&stretch.to, share);
        let axis_way = stretch.to.axis.into_inner() - stretch.from.axis.into_inner();
        let tip_way = stretch.to.tip - stretch.from.tip;
        // Any direction across the axis will do as zero.
        let across = axis.cross(&Vector::ith(axis.iamin(), 1.0)).normalize();
        let beside = axis.cross(&across);
        let moment = (self.moments.len() - 1) * HEIGHTS;
        for level in 0..HEIGHTS {
            // Denser toward the tip, where shallow cuts are.
            let height = tool.flute_length() * ((level as f64 + 0.5) / HEIGHTS as f64).powi(2);
            let Some(contact) = tool.contact_at(height) else { continue };
            let way = tip_way + axis_way * height;
            for step in 0..DIRECTIONS {
                let (sin, cos) = (std::f64::consts::TAU * step as f64 / DIRECTIONS as f64).sin_cos();
                let radial = across * cos + beside * sin;
                let normal = axis.into_inner() * contact.normal_axial + radial * contact.normal_radial;
                if normal.dot(&way) <= 1e-9 * way.norm() {
                    continue;
                }
                let point = tip + axis.into_inner() * height + radial * contact.point.radius;
                let number = ((moment + level) * DIRECTIONS + step) as u32;
                self.add(point.coords + normal * (AHEAD * lattice.cell), index, number, lattice);
            }
        }
    }

    fn add(&mut self, point: Vector, stretch: usize, number: u32, lattice: &Lattice) {
        let (first, second) = ((self.along + 1) % 3, (self.along + 2) % 3);
        let nearest = |axis: usize| {
            let index = ((point[axis] - lattice.origin[axis]) / lattice.cell).round();
            (index >= 0.0 && index < lattice.counts[axis] as f64).then_some(index as usize)
        };
        if let (Some(column), Some(row)) = (nearest(first), nearest(second)) {
            self.list.push(Probe { stretch, row, column, place: point[self.along], number });
        }
    }

    /// The probes of the rows of a band, in the order of the stretches.
    pub(super) fn of_band(&self, first: usize, rows: usize) -> &[Probe] {
        let start = self.list.partition_point(|probe| probe.row / rows < first / rows);
        let end = self.list.partition_point(|probe| probe.row / rows <= first / rows);
        self.list.get(start..end).unwrap_or_default()
    }

    /// The angles, from the numbers of the probes that were in material.
    pub(super) fn engagements(&self, found: &[u32]) -> Vec<Engagement> {
        let mut counts = vec![0_u32; self.moments.len() * HEIGHTS];
        for number in found {
            if let Some(count) = counts.get_mut(*number as usize / DIRECTIONS) {
                *count += 1;
            }
        }
        let step = std::f64::consts::TAU / DIRECTIONS as f64;
        let angle = |counts: &[u32]| f64::from(counts.iter().copied().max().unwrap_or(0)) * step;
        let of = |((block, time), counts): (&(usize, f64), &[u32])| Engagement {
            block: *block,
            time: *time,
            angle: angle(counts),
        };
        self.moments.iter().zip(counts.chunks(HEIGHTS)).map(of).collect()
    }
}
