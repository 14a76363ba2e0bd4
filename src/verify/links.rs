//! Which blocks only lead from cut to cut: rapids, and feed moves through free space, for controls whose rapids are
//! written so. Uses `collide`, `tool` and the other files of this module.

use super::crossings::BlockSweep;
use super::deviation::PartDeviation;
use super::motion_tree::BlockMotion;
use crate::collide::{Clearance, Move, Obstacle, ToolSolid};
use crate::tool::{Section, Tool};

/// How exactly clearances are followed, as a share of the clearance asked for.
const SHARE: f64 = 0.5;

/// Of each block whether it is a rapid, or keeps the flutes more than about `clearance` mm away from the part all along.
/// Its `surface` is that which crossings were looked for in.
pub(super) fn links<M: BlockMotion>(
    motion: &M,
    tool: &Tool,
    (part, surface): (&PartDeviation, Option<Obstacle>),
    clearance: f64,
) -> Vec<bool> {
    let mut links: Vec<bool> = (0..motion.blocks()).map(|block| motion.is_rapid(block)).collect();
    let Some(surface) = surface else { return links };
    // What has cut a sample is near; the others are followed.
    let mut cut = links.clone();
    for touch in part.samples.iter().filter_map(|sample| sample.touch) {
        if let Some(block) = cut.get_mut(touch.when.block) {
            *block = true;
        }
    }
    let open: Vec<usize> = (0..links.len()).filter(|block| !cut[*block]).collect();
    let moves: Vec<_> =
        open.iter().map(|block| Move { sweep: BlockSweep { motion, block: *block }, cutting: false }).collect();
    let solid = ToolSolid::of(tool);
    let near =
        Clearance { tool: &solid, obstacles: &[surface], resolution: SHARE * clearance }.below(&moves, clearance);
    for block in &open {
        links[*block] = true;
    }
    for approach in near.iter().filter(|approach| approach.section == Section::Flute) {
        if let Some(link) = open.get(approach.index).and_then(|block| links.get_mut(*block)) {
            *link = false;
        }
    }
    links
}
