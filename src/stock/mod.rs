//! The stock: the material as it is, and what a moving tool takes from it, block by block. May use: geometry, tool, motion,
//! simulate.
//!
//! The material is kept as pieces of lines in all three directions of the part frame (tri-dexels; van Hook, Real-time
//! shaded NC milling display, 1986; Benouamer and Michelucci, 1997). Nothing is stamped pose by pose: of each line a block
//! takes the exact extent of the moving tool, in closed form where the tool is shifted (`straight`), and where it also
//! turns from the moments at which its envelope passes (`turning`). Between lines nothing is known; on them everything
//! to a micrometre.

mod blank;
mod cut;
mod dexel;
mod engagement;
mod extent;
mod grid;
mod moves;
mod shadow;
mod solid;
mod straight;
mod surface;
mod turning;

#[cfg(test)]
mod tests;

pub use blank::Blank;
pub use engagement::Engagement;
pub use moves::{Block, Moves, Stretch};

use crate::geometry::{Point, Vector};
use crate::tool::Tool;
use crate::tool::export::binary_stl;
use cut::{Bite, Cutter};
use engagement::Probes;
use grid::{Grid, Lattice};
use solid::Solid;

/// Lines that a stock may have: 150 bytes each.
const MOST_LINES: f64 = 3e7;

/// Why there is no stock.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StockError {
    /// The blank has no volume.
    #[error("the stock is empty: it measures {0:?} mm")]
    Empty([f64; 3]),
    /// More lines than the memory is meant to hold.
    #[error("cells of {cell} mm make {lines:.0} lines of a stock of {size:?} mm; at most {MOST_LINES:.0} are kept")]
    TooFine {
        /// Size of the cells, mm.
        cell: f64,
        /// Lines that they make.
        lines: f64,
        /// Size of the stock, mm.
        size: [f64; 3],
    },
}

/// Material in the part frame, mm.
#[derive(Clone, Debug)]
pub struct Stock {
    lattice: Lattice,
    grids: [Grid; 3],
}

/// What one block took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Removal {
    /// By the flutes, mm^3.
    pub volume: f64,
    /// About how thick the thickest of it was, mm.
    pub depth: f64,
    /// By shank and holder, mm^3.
    pub body_volume: f64,
    /// About how deep they were in material, mm.
    pub body_depth: f64,
    /// Whether that was the holder.
    pub holder: bool,
}

/// What a program took.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cut {
    /// Of each block.
    pub removals: Vec<Removal>,
    /// How far round the flutes were in material, in order of time.
    pub engagements: Vec<Engagement>,
}

impl Stock {
    /// Lays a blank on lines `cell` mm apart.
    pub fn new(blank: &Blank, cell: f64) -> Result<Self, StockError> {
        let bounds = blank.bounds();
        let size: [f64; 3] = (bounds.high - bounds.low).into();
        if !size.iter().all(|s| s.is_finite() && *s > 0.0) {
            return Err(StockError::Empty(size));
        }
        let [x, y, z] = size.map(|s| (s / cell).max(1.0));
        let lines = x * y + y * z + z * x;
        if cell.is_nan() || cell <= 0.0 || lines > MOST_LINES {
            return Err(StockError::TooFine { cell, lines, size });
        }
        let lattice = Lattice::over(&bounds, cell);
        Ok(Self { lattice, grids: [0, 1, 2].map(|along| blank.grid(&lattice, along)) })
    }

    /// Distance of neighbouring lines, mm.
    pub fn cell(&self) -> f64 {
        self.lattice.cell
    }

    /// Number of lines.
    pub fn lines(&self) -> usize {
        self.lattice.lines()
    }

    /// Volume, mm^3: the mean of what the lines of each direction say.
    pub fn volume(&self) -> f64 {
        self.mean(self.grids.each_ref().map(Grid::length))
    }

    fn mean(&self, [x, y, z]: [f64; 3]) -> f64 {
        (x + y + z) / 3.0 * self.lattice.cell * self.lattice.cell
    }

    /// Takes away what the tool covers on its way.
    pub fn cut(&mut self, moves: &Moves, tool: &Tool) -> Cut {
        let solids = Solid::of_tool(tool);
        let probes = Probes::new(moves, tool, &self.lattice, cut::BAND);
        let cutter = Cutter::new(moves, &solids, &self.lattice);
        let mut found = Vec::new();
        let mut bites: Vec<Vec<Bite>> = Vec::new();
        for grid in &mut self.grids {
            let (bite, probed) = cutter.cut(grid, &probes);
            bites.push(bite);
            found.extend(probed);
        }
        let removal = |block: usize| {
            let of = |value: fn(&Bite) -> f64| [0, 1, 2].map(|k: usize| bites[k].get(block).map_or(0.0, value));
            // What is wide in one direction may be thin in another: the thinnest counts.
            let thinnest = |values: [f64; 3]| {
                let least = values.into_iter().filter(|value| *value > 0.0).fold(f64::INFINITY, f64::min);
                if least.is_finite() { least } else { 0.0 }
            };
            let deepest =
                bites.iter().filter_map(|b| b.get(block)).max_by(|a, b| a.body_depth.total_cmp(&b.body_depth));
            Removal {
                volume: self.mean(of(|b| b.length)),
                depth: thinnest(of(|b| b.depth)),
                body_volume: self.mean(of(|b| b.body_length)),
                body_depth: thinnest(of(|b| b.body_depth)),
                holder: deepest.is_some_and(|b| b.holder),
            }
        };
        let removals = (0..moves.blocks.len()).map(removal).collect();
        Cut { removals, engagements: probes.engagements(&found) }
    }

    /// The surface of what is left as a closed mesh, binary STL, mm.
    pub fn stl(&self) -> Vec<u8> {
        let triangles = surface::triangles(&self.lattice, &self.grids);
        let corners: Vec<[[f64; 3]; 3]> = triangles.iter().map(|t| t.map(Into::into)).collect();
        binary_stl(b"stock, mm, part frame", &corners)
    }

    /// Every end of material on the lines: its place and outward normal. They lie on the surface exactly.
    pub fn ends(&self) -> impl Iterator<Item = (Point, Vector)> {
        self.grids.iter().flat_map(|grid| grid.ends(&self.lattice))
    }
}
