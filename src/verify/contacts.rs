//! Where the tool touches what it must not, gathered: crossings of surfaces from elsewhere; here, from samples of the part,
//! shank and holder against what the flutes leave and rapids against material. Uses the other files of this module.

use super::deviation::PartDeviation;
use super::measured::ray_of;
use super::motion_tree::{BlockMotion, Instant};
use super::ray::NormalRay;
use super::strips::Runs;
use super::sweep::Sweep;
use super::swept::{Query, Touch};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A section of the moving tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ToolBody {
    /// The flutes at feed.
    Flutes,
    /// The flutes in rapid traverse.
    FlutesInRapid,
    /// The shank.
    Shank,
    /// The holder.
    Holder,
}

/// What a tool can run into.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Obstacle {
    /// The part as the flutes leave it.
    Part,
    /// The finished part's body.
    Body,
    /// A check surface, by its index.
    Check(usize),
}

/// A place where the tool is where it must not be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Which section.
    pub body: ToolBody,
    /// Of what.
    pub obstacle: Obstacle,
    /// When it is deepest.
    pub when: Instant,
    /// How deep, mm.
    pub depth: f64,
}

impl ToolBody {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flutes => "flutes",
            Self::FlutesInRapid => "flutes in rapid",
            Self::Shank => "shank",
            Self::Holder => "holder",
        }
    }
}

impl Obstacle {
    /// In words.
    pub fn name(self) -> String {
        match self {
            Self::Part => "part".to_owned(),
            Self::Body => "part's body".to_owned(),
            Self::Check(index) => format!("check surface {}", index + 1),
        }
    }
}

/// The deepest contact of each body with each obstacle in each run, and the block of the first.
#[derive(Debug, Default)]
pub(super) struct Contacts {
    deepest: BTreeMap<(ToolBody, Obstacle, Option<u32>), (Contact, usize)>,
}

impl Contacts {
    /// Takes one in.
    pub(super) fn add(&mut self, runs: &Runs, contact: Contact) {
        let key = (contact.body, contact.obstacle, runs.of_block(contact.when.block));
        let (deepest, first) = self.deepest.entry(key).or_insert((contact, contact.when.block));
        *first = contact.when.block.min(*first);
        if contact.depth > deepest.depth {
            *deepest = contact;
        }
    }

    /// In order of time of the deepest; with each the block of the first.
    pub(super) fn into_sorted(self) -> Vec<(Contact, usize)> {
        let mut contacts: Vec<(Contact, usize)> = self.deepest.into_values().collect();
        contacts.sort_by(|(a, _), (b, _)| {
            a.when.block.cmp(&b.when.block).then(a.when.share.total_cmp(&b.when.share)).then(a.body.cmp(&b.body))
        });
        contacts
    }

    /// Shank or holder below what the flutes leave of the part, by more than `allowance`.
    pub(super) fn body_on_part<M: BlockMotion>(
        &mut self,
        body: ToolBody,
        sweep: &Sweep<'_, M>,
        part: &PartDeviation,
        runs: &Runs,
        outward: f64,
        allowance: f64,
    ) {
        let rays: Vec<NormalRay> = part.samples.iter().map(|s| ray_of(&s.sample)).collect();
        let left = |index: usize| part.samples[index].deviation().unwrap_or(outward);
        let touches = sweep.lowest_all(&rays, |index| (None, left(index) - allowance));
        for (index, touch) in touches.into_iter().enumerate() {
            if let Some(Touch { depth, when, .. }) = touch {
                self.add(runs, Contact { body, obstacle: Obstacle::Part, when, depth: left(index) - depth });
            }
        }
    }

    /// Rapids that come below `skin` above the design surface where no feed move before them has cleared the way, by
    /// more than `allowance`.
    pub(super) fn rapids_in_part<M: BlockMotion>(
        &mut self,
        sweep: &Sweep<'_, M>,
        part: &PartDeviation,
        runs: &Runs,
        (skin, outward, allowance): (f64, f64, f64),
    ) {
        let guilty = |index: usize| {
            let ray = ray_of(&part.samples[index].sample);
            let mut end = usize::MAX;
            // From the deepest rapid back in time: one that is innocent may hide an earlier one that is not.
            while let Some(rapid) = sweep.rapid.lowest(&ray, &Query { hint: None, end, limit: skin }) {
                let before = Query { hint: None, end: rapid.when.block, limit: f64::INFINITY };
                let left = sweep.feed.lowest(&ray, &before).map_or(outward, |t| t.depth);
                if left - rapid.depth > allowance {
                    return Some((rapid.when, left - rapid.depth));
                }
                end = rapid.when.block;
            }
            None
        };
        let found: Vec<Option<(Instant, f64)>> = (0..part.samples.len()).into_par_iter().map(guilty).collect();
        for (when, depth) in found.into_iter().flatten() {
            self.add(runs, Contact { body: ToolBody::FlutesInRapid, obstacle: Obstacle::Part, when, depth });
        }
    }
}
