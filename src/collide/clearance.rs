//! The smallest clearance of a moving tool, with where and when: branching over time above the bounds over space.

use super::obstacle::{Obstacle, Role};
use super::solid::{Piece, ToolSolid};
use super::sweep::{Interval, MovingPiece, Sweep};
use crate::geometry::Point;
use crate::tool::Section;
use rayon::prelude::*;

/// A stretch of the program.
#[derive(Clone, Copy, Debug)]
pub struct Move<S> {
    /// The motion.
    pub sweep: S,
    /// The flutes may touch what is to be cut: true at feed, false in rapids.
    pub cutting: bool,
}

/// The nearest a section of the tool comes to an obstacle in one move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Index of the move.
    pub index: usize,
    /// Share of the move, 0 to 1.
    pub share: f64,
    /// What part of the tool.
    pub section: Section,
    /// Index of the obstacle.
    pub obstacle: usize,
    /// Where on the obstacle, part frame.
    pub point: Point,
    /// Clearance attained there and then, mm; below zero the point lies inside the tool, at least that deep. Guaranteed:
    /// nowhere in the move is it smaller by more than the resolution, and 1 % of the depth where there is one. Of a piece
    /// that stays inside a closed obstacle it is the depth of one point at the start.
    pub clearance: f64,
}

/// A tool among obstacles.
#[derive(Clone, Copy)]
pub struct Clearance<'a> {
    /// The tool.
    pub tool: &'a ToolSolid,
    /// What it must stay clear of.
    pub obstacles: &'a [Obstacle],
    /// How exactly clearances are wanted, mm; positive.
    pub resolution: f64,
}

/// Share of a depth to which it is known: how deep a collision is matters less than that it is.
const DEPTH_SHARE: f64 = 0.01;

/// Smallest resolution that floating point still tells apart at the sizes of machine tools, mm.
const FINEST: f64 = 1e-6;

/// An interval of shares that is not halved further: near the rounding of poses.
const INSTANT: f64 = 1e-12;

impl Clearance<'_> {
    /// Every move, section and obstacle that come nearer than `margin` mm, in the order of the moves; each with its
    /// nearest approach. What is not listed keeps at least `margin` less the resolution.
    pub fn below<S: Sweep>(&self, moves: &[Move<S>], margin: f64) -> Vec<Approach> {
        let found = moves.par_iter().enumerate().map(|(index, one)| self.approaches(index, one, margin));
        found.collect::<Vec<_>>().concat()
    }

    /// The smallest clearance of all moves; `None` when there is nothing to meet, or everything stays farther apart
    /// than `horizon` mm.
    pub fn smallest<S: Sweep>(&self, moves: &[Move<S>], horizon: f64) -> Option<Approach> {
        // Half way through each move something is attained; nothing above the least of that can be the smallest.
        let halfway = |one: &Move<S>| self.attained_halfway(one, horizon);
        let seen = moves.par_iter().map(halfway).reduce(|| f64::INFINITY, f64::min);
        let ceiling = if seen.is_finite() { seen + 2.0 * self.fineness() } else { horizon };
        let found = self.below(moves, ceiling.min(horizon));
        found.into_iter().min_by(|a, b| a.clearance.total_cmp(&b.clearance).then(a.index.cmp(&b.index)))
    }

    fn fineness(&self) -> f64 {
        self.resolution.max(FINEST)
    }

    /// How far below an attained clearance nothing more is looked for.
    fn slack(&self, attained: f64) -> f64 {
        self.fineness() + DEPTH_SHARE * (-attained).max(0.0)
    }

    /// Pairs of piece and obstacle that must not meet.
    fn pairs(&self, cutting: bool) -> impl Iterator<Item = (Section, &Piece, usize, &Obstacle)> {
        let obstacles = self.obstacles.iter().enumerate();
        obstacles.flat_map(move |(index, obstacle)| {
            let allowed = move |section| section == Section::Flute && cutting && obstacle.role() == Role::Cut;
            let pieces = self.tool.pieces.iter().filter(move |(section, _)| !allowed(*section));
            pieces.map(move |(section, piece)| (*section, piece, index, obstacle))
        })
    }

    fn attained_halfway<S: Sweep>(&self, one: &Move<S>, horizon: f64) -> f64 {
        let instant = Interval::new(&one.sweep, 0.5, 0.5, self.tool.length);
        self.pairs(one.cutting).fold(f64::INFINITY, |least, (_, piece, _, body)| {
            let found = self.look(&one.sweep, piece, body, instant, least.min(horizon));
            found.map_or(least, |look| least.min(look.attained))
        })
    }

    /// The nearest approach of each section to each obstacle in one move, where below `margin`.
    fn approaches<S: Sweep>(&self, index: usize, one: &Move<S>, margin: f64) -> Vec<Approach> {
        let mut found: Vec<Approach> = Vec::new();
        for (section, piece, obstacle, body) in self.pairs(one.cutting) {
            let known = found.iter().position(|f| f.section == section && f.obstacle == obstacle);
            let ceiling = known.map_or(margin, |k| found[k].clearance);
            let crossed = self.nearest_in_time(&one.sweep, piece, body, ceiling);
            let crossed = crossed.map(|look| (look.share, look.point, look.attained));
            let inside = || swallowed(&one.sweep, piece, body).filter(|(.., clearance)| *clearance < ceiling);
            let seen = crossed.filter(|(.., clearance)| *clearance < 0.0).or_else(inside).or(crossed);
            let Some((share, point, clearance)) = seen else { continue };
            let approach = Approach { index, share, section, obstacle, point, clearance };
            match known {
                Some(k) => found[k] = approach,
                None => found.push(approach),
            }
        }
        found
    }

    /// The nearest approach of one piece to one obstacle during a sweep, if below `ceiling`.
    ///
    /// Halves intervals of time until the bound of each lies no more than the resolution below what is attained
    /// somewhere (or below the ceiling, before anything is). The guarantee of [`Approach::clearance`] follows: what is
    /// attained only falls, so an interval that was closed stays closed.
    fn nearest_in_time<S: Sweep>(&self, sweep: &S, piece: &Piece, body: &Obstacle, ceiling: f64) -> Option<Look> {
        let look = |from: f64, to: f64, limit: f64| {
            self.look(sweep, piece, body, Interval::new(sweep, from, to, self.tool.length), limit)
        };
        let mut best: Option<Look> = None;
        let mut limit = ceiling - self.fineness();
        let mut open: Vec<Look> = look(0.0, 1.0, limit).into_iter().collect();
        while let Some(seen) = open.pop() {
            if seen.attained < best.map_or(ceiling, |b| b.attained) {
                best = Some(seen);
                limit = seen.attained - self.slack(seen.attained);
            }
            if limit <= -piece.deepest() {
                break;
            }
            if seen.least >= limit || seen.interval.to - seen.interval.from < INSTANT {
                continue;
            }
            let halves = seen.interval.halves().into_iter();
            let mut halves: Vec<_> = halves.filter_map(|(from, to)| look(from, to, limit)).collect();
            // The half that may come nearer is looked at first.
            halves.sort_by(|a, b| b.least.total_cmp(&a.least));
            open.extend(halves);
        }
        best
    }

    /// Bound and attained clearance of one piece and obstacle in an interval; `None` when the bound is above `limit`.
    fn look<S: Sweep>(
        &self,
        sweep: &S,
        piece: &Piece,
        body: &Obstacle,
        interval: Interval,
        limit: f64,
    ) -> Option<Look> {
        let nearest = body.nearest(&MovingPiece::new(sweep, piece, &interval), limit, 0.25 * self.fineness())?;
        let share = interval.share(nearest.place);
        let attained = piece.signed(&sweep.pose(share), &nearest.point).distance;
        Some(Look { interval, least: nearest.least, share, point: nearest.point, attained })
    }
}

/// How deep a piece that crosses no skin during a sweep lies inside an obstacle: share, place on the skin, clearance.
fn swallowed(sweep: &impl Sweep, piece: &Piece, body: &Obstacle) -> Option<(f64, Point, f64)> {
    let (point, depth) = body.depth_of(&sweep.pose(0.0).at_height(piece.low.height))?;
    Some((0.0, point, -depth))
}

/// What is known of an interval.
#[derive(Clone, Copy)]
struct Look {
    interval: Interval,
    /// No clearance in the interval is smaller.
    least: f64,
    /// The clearance attained at a share and a point.
    share: f64,
    point: Point,
    attained: f64,
}
