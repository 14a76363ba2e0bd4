//! Where the tool crosses a surface that it must not, followed continuously in time: whatever lies between samples of
//! surface or motion is found. Uses `collide`, `part`, `tool` and the other files of this module.

use super::contacts::{Contact, Obstacle, ToolBody};
use super::motion_tree::{BlockMotion, Instant};
use crate::collide::{self, Clearance, Move, ToolSolid};
use crate::motion::Pose;
use crate::part::{DesignSurface, Part, SampleGrid};
use crate::tool::{Section, Tool};
use rayon::prelude::*;

/// How exactly clearances are followed, as a share of the contact allowed.
const SHARE: f64 = 0.25;
/// Triangles may leave a curved surface by this share of the contact allowed, where that takes no more than
/// [`MOST_REFINED`] times as fine a grid.
const SAG_SHARE: f64 = 0.25;
const MOST_REFINED: f64 = 4.0;

/// What may happen without being a collision, mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Allowed {
    /// Depth of any touch.
    pub(super) contact: f64,
    /// Depth of the tool in the part.
    pub(super) overcut: f64,
    /// Distance of neighbouring samples where surfaces are curved.
    pub(super) spacing: f64,
}

/// A block as `collide` follows it.
pub(super) struct BlockSweep<'a, M> {
    pub(super) motion: &'a M,
    pub(super) block: usize,
}

impl<M: BlockMotion> collide::Sweep for BlockSweep<'_, M> {
    fn pose(&self, share: f64) -> Pose {
        self.motion.pose(self.block, share)
    }

    fn chord_bound(&self, from: f64, to: f64, height: f64) -> f64 {
        self.motion.chord_bound(self.block, from, to, height)
    }
}

/// A surface to stay out of.
struct Guarded {
    what: Obstacle,
    mesh: collide::Obstacle,
    /// Depth that is no collision, mm: what is allowed, and what triangles leave a curved surface by.
    allowed: f64,
}

/// Every block, section of the tool and surface where the tool is deeper than allowed: shank and holder in the part, the
/// flutes in the part in rapids, anything in the part's body or a check surface. None deeper than that by the resolution
/// is missed. Beside them the part's surface as it was followed; `None` where it has no triangles.
pub(super) fn crossings<M: BlockMotion>(
    motion: &M,
    tool: &Tool,
    part: &Part,
    allowed: Allowed,
) -> (Vec<Contact>, Option<collide::Obstacle>) {
    let overcut = allowed.contact + allowed.overcut;
    let surface = guarded(Obstacle::Part, collide::Role::Cut, &part.surface, overcut, &allowed);
    let body =
        part.body.iter().filter_map(|body| guarded(Obstacle::Body, collide::Role::Avoid, body, overcut, &allowed));
    let check = part.check.iter().enumerate().filter_map(|(index, surface)| {
        guarded(Obstacle::Check(index), collide::Role::Avoid, surface, allowed.contact, &allowed)
    });
    let solid = ToolSolid::of(tool);
    let resolution = SHARE * allowed.contact;
    let moves: Vec<_> = (0..motion.blocks())
        .map(|block| Move { sweep: BlockSweep { motion, block }, cutting: !motion.is_rapid(block) })
        .collect();
    let (mut found, mut followed) = (Vec::new(), None);
    for Guarded { what, mesh, allowed } in surface.into_iter().chain(body).chain(check) {
        let obstacles = [mesh];
        let clearance = Clearance { tool: &solid, obstacles: &obstacles, resolution };
        found.extend(clearance.below(&moves, -allowed).into_iter().map(|approach| Contact {
            body: match approach.section {
                Section::Flute if motion.is_rapid(approach.index) => ToolBody::FlutesInRapid,
                Section::Flute => ToolBody::Flutes,
                Section::Shank => ToolBody::Shank,
                Section::Holder => ToolBody::Holder,
            },
            obstacle: what,
            when: Instant { block: approach.index, share: approach.share },
            depth: -approach.clearance,
        }));
        let [mesh] = obstacles;
        followed = followed.or(Some(mesh).filter(|_| what == Obstacle::Part));
    }
    (found, followed)
}

/// A surface as triangles; `None` where it has none.
fn guarded(
    what: Obstacle,
    role: collide::Role,
    surface: &DesignSurface,
    depth: f64,
    allowed: &Allowed,
) -> Option<Guarded> {
    let (grid, sag) = triangles(surface, allowed);
    let points: Vec<_> = grid.samples.iter().map(|sample| sample.point).collect();
    let mesh = collide::Obstacle::new(what.name(), role, &points, &grid.triangles).ok()?;
    // Curved patches leave the mesh by less than they bulge: what is so near the skin crosses it, which is followed.
    let mesh = match surface.mesh() {
        Some(whole) => mesh.with_inside(whole),
        None => mesh,
    };
    Some(Guarded { what, mesh, allowed: depth + sag + SHARE * allowed.contact })
}

/// Triangles of a surface, and how far they leave it at most, as seen at the middles of their sides and in their centres.
fn triangles(surface: &DesignSurface, allowed: &Allowed) -> (SampleGrid, f64) {
    let grid = surface.sample(allowed.spacing);
    let sag = sag(surface, &grid);
    // The sag falls with the square of the spacing.
    let finer = (sag / (SAG_SHARE * allowed.contact)).sqrt().min(MOST_REFINED);
    if finer <= 1.0 {
        return (grid, sag);
    }
    let grid = surface.sample(allowed.spacing / finer);
    let sag = self::sag(surface, &grid);
    (grid, sag)
}

/// Largest distance of the surface from its triangles, as seen at the middles of their sides and in their centres.
fn sag(surface: &DesignSurface, grid: &SampleGrid) -> f64 {
    const PLACES: [[f64; 3]; 4] =
        [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0]];
    let off = |[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|index| grid.samples.get(*index as usize));
        let (Some(a), Some(b), Some(c)) = (a, b, c) else { return 0.0 };
        let leaves = |weights: [f64; 3]| {
            let flat = a.point.coords * weights[0] + b.point.coords * weights[1] + c.point.coords * weights[2];
            let exact = surface.between([a, b, c], weights);
            (exact.point.coords - flat).dot(&exact.normal.0).abs()
        };
        PLACES.into_iter().map(leaves).fold(0.0, f64::max)
    };
    match surface {
        DesignSurface::Mesh(_) => 0.0,
        DesignSurface::Spline(_) | DesignSurface::Curved(_) => {
            grid.triangles.par_iter().map(off).reduce(|| 0.0, f64::max)
        }
    }
}
