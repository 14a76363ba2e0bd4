//! The keys of a job file as they are written, before any check of their values.

use crate::machine::{Dialect, RawBody};
use crate::motion::FeedReference;
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Job {
    pub(super) format: String,
    pub(super) version: u32,
    pub(super) name: String,
    pub(super) part: Part,
    pub(super) tool: Tool,
    pub(super) strategy: Strategy,
    pub(super) machine: Machine,
    pub(super) feed: Feed,
    #[serde(default)]
    pub(super) output: Output,
    pub(super) stock: Option<Stock>,
    #[serde(default)]
    pub(super) fixtures: Vec<RawBody>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stock {
    #[serde(rename = "box")]
    pub(super) cuboid: Option<StockBox>,
    pub(super) cylinder: Option<StockCylinder>,
    pub(super) file: Option<String>,
    pub(super) cell: Option<f64>,
    pub(super) rubbing: Option<f64>,
    pub(super) feed_limit: Option<f64>,
    pub(super) removal_limit: Option<f64>,
    pub(super) engagement_limit_deg: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StockBox {
    pub(super) min: [f64; 3],
    pub(super) max: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StockCylinder {
    pub(super) base: [f64; 3],
    #[serde(default = "upward")]
    pub(super) axis: [f64; 3],
    pub(super) diameter: f64,
    pub(super) height: f64,
}

fn upward() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Part {
    pub(super) file: Option<String>,
    pub(super) sides: Option<Vec<String>>,
    pub(super) face: Option<String>,
    pub(super) units: Option<Units>,
    #[serde(default)]
    pub(super) flip: bool,
    pub(super) body: Option<String>,
    #[serde(default)]
    pub(super) check: Vec<String>,
    pub(super) tolerance: Tolerance,
    pub(super) placement: Option<Placement>,
    pub(super) triangles: Option<Triangles>,
    pub(super) crease_deg: Option<f64>,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Triangles {
    Flat,
    Curved,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Units {
    Mm,
    Inch,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Tolerance {
    pub(super) overcut: f64,
    pub(super) undercut: f64,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Placement {
    pub(super) origin: [f64; 3],
    pub(super) rotate_deg: [f64; 3],
}

/// All keys of all kinds; which belong to the kind is checked afterwards.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Tool {
    pub(super) name: Option<String>,
    pub(super) number: u32,
    pub(super) kind: ToolKind,
    pub(super) tip_diameter: Option<f64>,
    pub(super) half_angle_deg: Option<f64>,
    pub(super) corner_radius: Option<f64>,
    pub(super) flute_length: Option<f64>,
    pub(super) spheres: Option<Spheres>,
    pub(super) diameter: Option<f64>,
    pub(super) ball_diameter: Option<f64>,
    pub(super) barrel_radius: Option<f64>,
    /// Height and radius, and the bulge of the piece that follows.
    pub(super) points: Option<Vec<Vec<f64>>>,
    pub(super) family: Option<MeridianFamily>,
    pub(super) coefficients: Option<u32>,
    pub(super) radius: Option<[f64; 2]>,
    pub(super) ends: Option<[f64; 2]>,
    pub(super) start: Option<Seed>,
    pub(super) length: Option<[f64; 2]>,
    pub(super) weights: Option<MeridianWeights>,
    pub(super) shank_diameter: Option<f64>,
    pub(super) gauge_length: f64,
    #[serde(default)]
    pub(super) holder: Vec<[f64; 2]>,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum ToolKind {
    Cylinder,
    Ball,
    Bull,
    Cone,
    TaperedBall,
    Barrel,
    Meridian,
    Optimize,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum MeridianFamily {
    #[default]
    Free,
    Cone,
    Cylinder,
    Barrel,
}

/// What the search for a tool starts from.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Seed {
    Line,
    Surface,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeridianWeights {
    pub(super) accuracy: Option<f64>,
    pub(super) rigidity: Option<f64>,
    pub(super) fairness: Option<f64>,
    pub(super) proximity: Option<f64>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Spheres {
    pub(super) r1: f64,
    pub(super) r2: f64,
    pub(super) length: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Strategy {
    pub(super) kind: StrategyKind,
    pub(super) direction: Option<[f64; 3]>,
    pub(super) weights: Option<Weights>,
    pub(super) strips: Option<u32>,
    #[serde(default)]
    pub(super) method: Method,
    pub(super) tip: Option<TipSide>,
    pub(super) spindle: Option<[f64; 3]>,
    pub(super) climb: Option<bool>,
    pub(super) engage_from: Option<f64>,
    pub(super) lead: Option<f64>,
    pub(super) stand_off: Option<f64>,
    pub(super) rajain: Option<Rajain>,
}

/// Settings of the method "rajain-2023".
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Rajain {
    pub(super) field: Option<String>,
    #[serde(default)]
    pub(super) free: Vec<Freed>,
    pub(super) engagement: Option<[f64; 2]>,
    pub(super) step: Option<f64>,
    pub(super) samples: Option<u32>,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Freed {
    Length,
    R1,
    R2,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Method {
    #[default]
    Regulus,
    Rulings,
    #[serde(rename = "rajain-2023")]
    Rajain2023,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum TipSide {
    Low,
    High,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum StrategyKind {
    SingleSweep,
    MultiStrip,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Weights {
    pub(super) accuracy: Option<f64>,
    pub(super) g1: Option<f64>,
    pub(super) rigidity: Option<f64>,
    pub(super) proximity: Option<f64>,
    pub(super) fairness: Option<f64>,
    pub(super) direction: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Machine {
    pub(super) file: String,
    #[serde(default = "first_work_offset")]
    pub(super) work_offset: String,
    pub(super) offset: Option<[f64; 3]>,
    pub(super) tcp: Option<bool>,
    pub(super) dialect: Option<Dialect>,
}

fn first_work_offset() -> String {
    "G54".to_owned()
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Feed {
    pub(super) cut: f64,
    #[serde(default)]
    pub(super) reference: FeedReference,
    pub(super) spindle: f64,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Output {
    pub(super) linearization: Option<f64>,
    pub(super) program_number: Option<u32>,
}
