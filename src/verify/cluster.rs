//! Many rays at once: what is clear of all of them is shown once, the rest of fewer and fewer of them. Uses the other files
//! of this module.

use super::fan::Fan;
use super::motion_tree::BlockMotion;
use super::ray::NormalRay;
use super::swept::{Query, SweptTool, Target, Touch};
use std::ops::Range;

/// Into how many groups a group of rays is parted.
const PARTS: usize = 4;
/// Rays that start farther apart than this share of the body's radius have no tool in common worth looking for.
const REACH: f64 = 1.0;

/// Rays, what is asked of each, the lowest touch of each that is known, and whether none is lower.
struct Group<'r> {
    asked: &'r [(NormalRay, Query)],
    bests: Vec<Option<Touch>>,
    done: Vec<bool>,
}

impl<M: BlockMotion> SweptTool<'_, M> {
    /// [`Self::lowest`] for many rays, of which those that follow each other lie near each other.
    pub(super) fn lowest_of(&self, asked: &[(NormalRay, Query)]) -> Vec<Option<Touch>> {
        let bests = asked.iter().map(|(ray, query)| self.hinted(ray, query)).collect();
        let mut group = Group { asked, bests, done: vec![false; asked.len()] };
        if !self.tree.nodes.is_empty() && !self.body.pieces.is_empty() {
            self.narrow(&mut group, 0..asked.len(), &[0]);
        }
        group.bests
    }

    /// Finds the lowest touches of some rays of a group in the stretches of some nodes: that of the middle ray, which leads
    /// the others to theirs or near them, then what is left of the stretches for fewer rays at a time.
    fn narrow(&self, group: &mut Group<'_>, members: Range<usize>, open: &[u32]) {
        let middle = members.start + members.len() / 2;
        if open.is_empty() || members.is_empty() {
            return;
        }
        if !std::mem::replace(&mut group.done[middle], true) {
            let (ray, query) = &group.asked[middle];
            group.bests[middle] = self.search(ray, query, group.bests[middle], open);
        }
        let others = members.clone().filter(|index| !group.done[*index]);
        let others: Vec<usize> = others.collect();
        if let Some(leader) = group.bests[middle] {
            others.iter().for_each(|index| self.lead(group, *index, &leader));
        }
        let left = self.not_clear(group, &others, open);
        let open = left.as_deref().unwrap_or(open);
        let size = members.len().div_ceil(PARTS);
        for start in members.clone().step_by(size) {
            self.narrow(group, start..(start + size).min(members.end), open);
        }
    }

    /// Goes from where the tool touches another ray to where it touches this one lower than is known, if it does.
    fn lead(&self, group: &mut Group<'_>, index: usize, leader: &Touch) {
        let (ray, query) = &group.asked[index];
        let best = &mut group.bests[index];
        let led = (leader.when.block < query.end).then(|| self.at(ray, leader.when)).flatten();
        if let Some(touch) = led.filter(|touch| touch.depth < self.goal(query, best.as_ref())) {
            *best = Some(self.settle(ray, query, touch));
        }
    }

    /// The nodes below some whose stretches may matter to one of some rays; `None` where the rays have too little in common.
    fn not_clear(&self, group: &Group<'_>, members: &[usize], open: &[u32]) -> Option<Vec<u32>> {
        let goals = members.iter().map(|index| self.goal(&group.asked[*index].1, group.bests[*index].as_ref()));
        let goal = goals.fold(f64::NEG_INFINITY, f64::max);
        if goal <= -self.window.inward {
            return Some(Vec::new());
        }
        let end = members.iter().map(|index| group.asked[*index].1.end).max()?;
        let fan = Fan::around(members.iter().map(|index| &group.asked[*index].0))?;
        self.open_to(&fan, goal, end, open)
    }

    /// The nodes below some in which blocks before `end` may reach a ray of a fan below `goal`, none much longer than the
    /// fan is wide; `None` where it is too wide.
    pub(super) fn open_to(&self, fan: &Fan, goal: f64, end: usize, open: &[u32]) -> Option<Vec<u32>> {
        if fan.radius() > REACH * self.body.radius {
            return None;
        }
        let target = Target { ray: &fan.ray, fan: Some(fan), guide: None, goal };
        let mut left = Vec::new();
        let mut stack: Vec<u32> = open.iter().rev().copied().collect();
        while let Some(index) = stack.pop() {
            let Some(node) = self.tree.nodes.get(index as usize) else { continue };
            if self.promise(&target, index, end) == f64::INFINITY {
                continue;
            }
            if node.right == 0 || node.stretch.linear.way(self.tree.reference) <= fan.radius() {
                left.push(index);
            } else {
                stack.extend([node.right, index + 1]);
            }
        }
        Some(left)
    }
}
