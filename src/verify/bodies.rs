//! Bodies of the machine, fixtures and tool too near each other, as records and findings. Uses `machine`, `simulate` and
//! the other files of this module.

use super::findings::sorted;
use super::judge::Verified;
use super::record::{CollisionRecord, FindingRecord, MachineVerification, NearMissRecord, Verdict};
use crate::machine::{Encounter, Scene};
use crate::nc::FindingCode;
use crate::simulate::{Segment, ToolMotion};
use rayon::prelude::*;

/// Blocks that are looked at one after the other; what parted two bodies in one makes the next quick.
const CHUNK: usize = 256;
/// Findings of one rule that are listed one by one.
const LISTED: usize = 50;

/// Two bodies too near each other over a stretch of blocks, where they are nearest.
#[derive(Clone, Debug, PartialEq)]
pub struct BodiesMet {
    /// What moves, and what it comes near to.
    pub names: [String; 2],
    /// Line of the first block of the stretch.
    pub first: usize,
    /// Line where they are nearest.
    pub line: usize,
    /// When that is, s.
    pub time: f64,
    /// How near, mm; below zero they overlap that deep.
    pub distance: f64,
    /// Whether they overlap by more than a touch.
    pub collides: bool,
}

/// Every two bodies of a scene that come too near each other, in the order of time; blocks in a row count as one.
pub fn bodies_met(motion: &ToolMotion, scene: &Scene) -> Vec<BodiesMet> {
    if scene.is_empty() {
        return Vec::new();
    }
    let of_chunk = |(chunk, segments): (usize, &[Segment])| {
        let mut hints = scene.hints();
        let mut found = Vec::new();
        for (offset, segment) in segments.iter().enumerate() {
            for course in motion.courses(segment) {
                let near = scene.encounters(&course, &mut hints);
                found.extend(near.into_iter().map(|near| (chunk * CHUNK + offset, course.share(near.share), near)));
            }
        }
        found
    };
    let found: Vec<_> = motion.segments().par_chunks(CHUNK).enumerate().map(of_chunk).collect();
    let mut found: Vec<(usize, f64, Encounter)> = found.concat();
    found.sort_by_key(|(block, _, near)| (near.pair, *block));
    let rows = found.chunk_by(|(a, _, one), (b, _, other)| one.pair == other.pair && b - a <= 1);
    let mut met: Vec<BodiesMet> = rows.filter_map(|row| of_row(motion, scene, row)).collect();
    met.sort_by(|a, b| a.time.total_cmp(&b.time));
    met
}

fn of_row(motion: &ToolMotion, scene: &Scene, row: &[(usize, f64, Encounter)]) -> Option<BodiesMet> {
    let (block, share, near) =
        row.iter().reduce(|best, one| if one.2.distance < best.2.distance { one } else { best })?;
    let segment = motion.segments().get(*block)?;
    let first = row.first().and_then(|(block, ..)| motion.segments().get(*block))?;
    Some(BodiesMet {
        names: scene.names(near.pair).map(str::to_owned),
        first: first.line,
        line: segment.line,
        time: segment.start + share * segment.duration,
        distance: near.distance,
        collides: near.is_collision(),
    })
}

impl BodiesMet {
    fn finding(&self) -> FindingRecord {
        let ([a, b], at) = (&self.names, if self.first == self.line { String::new() } else { self.at() });
        let (code, message) = if self.collides {
            (FindingCode::Collision, format!("{a} {:.4} mm into the {b}{at}", -self.distance))
        } else {
            (FindingCode::NearMiss, format!("{a} comes within {:.4} mm of the {b}{at}", self.distance.max(0.0)))
        };
        FindingRecord::new(code, Some(self.first), message)
    }

    fn at(&self) -> String {
        format!(" on line {}", self.line)
    }

    fn collision(&self) -> CollisionRecord {
        let [body_a, body_b] = self.names.clone();
        CollisionRecord { line: self.line, time_s: self.time, body_a, body_b, depth_mm: -self.distance }
    }

    fn near_miss(&self) -> NearMissRecord {
        let [body_a, body_b] = self.names.clone();
        NearMissRecord { line: self.line, time_s: self.time, body_a, body_b, distance_mm: self.distance.max(0.0) }
    }
}

/// What of a record bodies that met change.
struct Records<'a> {
    verdict: &'a mut Verdict,
    reasons: &'a mut Vec<String>,
    collisions: &'a mut Vec<CollisionRecord>,
    near_misses: &'a mut Vec<NearMissRecord>,
    findings: &'a mut Vec<FindingRecord>,
}

impl Records<'_> {
    fn take(self, met: &[BodiesMet]) {
        for one in met.iter().filter(|one| one.collides) {
            *self.verdict = Verdict::Fail;
            self.reasons.push(format!("line {}: {}", one.first, one.finding().message));
            self.collisions.push(one.collision());
        }
        self.collisions.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        self.near_misses.extend(met.iter().filter(|one| !one.collides).map(BodiesMet::near_miss));
        for collides in [true, false] {
            let alike = met.iter().filter(|one| one.collides == collides);
            self.findings.extend(alike.take(LISTED).map(BodiesMet::finding));
        }
        *self.findings = sorted(std::mem::take(self.findings));
    }
}

impl Verified {
    /// Takes bodies that met into record and verdict.
    #[must_use]
    pub fn with_bodies(mut self, met: &[BodiesMet]) -> Self {
        let record = &mut self.record;
        Records {
            verdict: &mut record.verdict,
            reasons: &mut record.reasons,
            collisions: &mut record.collisions,
            near_misses: &mut record.near_misses,
            findings: &mut record.findings,
        }
        .take(met);
        self
    }
}

impl MachineVerification {
    /// Takes bodies that met into record and verdict.
    #[must_use]
    pub fn with_bodies(mut self, met: &[BodiesMet]) -> Self {
        Records {
            verdict: &mut self.verdict,
            reasons: &mut self.reasons,
            collisions: &mut self.collisions,
            near_misses: &mut self.near_misses,
            findings: &mut self.findings,
        }
        .take(met);
        self
    }
}
