//! What a report shows, as plain data: filled by whoever ran a job, checked here before a page is written.
//!
//! Uses `geometry` and `tool`. Lengths mm, times seconds, part frame, unless a field says otherwise.

use crate::geometry::{Point, RigidMotion, Vector};
use crate::tool::{Element, Section, Tool};

/// Everything on one report page.
#[derive(Clone, Debug, Default)]
pub struct ReportData {
    /// Name of the job.
    pub name: String,
    /// Pass or fail, and why.
    pub verdict: Verdict,
    /// Names and settings shown under the title: part, tool, machine, control and so on, as label and value.
    pub facts: Vec<(String, String)>,
    /// Hash of the inputs, hexadecimal.
    pub input_hash: String,
    /// The measured part; none for a program that is checked alone.
    pub part: Option<PartView>,
    /// Surfaces around the part that it comes with: check surfaces.
    pub surroundings: Vec<Mesh>,
    /// Bodies of the machine, and fixtures.
    pub bodies: Vec<BodyView>,
    /// Where the links are that bodies move with.
    pub links: Vec<LinkTrack>,
    /// Sampled positions of the tool axis while cutting.
    pub rulings: Vec<Ruling>,
    /// The tool's outline, from the tip upward.
    pub tool: Vec<ProfileSection>,
    /// The motion that the program makes.
    pub timeline: Timeline,
    /// Measured figures in the order of the table; the first few with a limit are also shown large.
    pub figures: Vec<Figure>,
    /// The strips as planned, in order; none for a program that some other system planned.
    pub strips: Vec<StripRow>,
    /// Where the program is slower than usual, the most costly first.
    pub slow: Vec<SlowRow>,
    /// What would help where the plan misses the tolerance, one sentence each.
    pub advice: Vec<String>,
    /// What was found in the program.
    pub findings: Vec<Finding>,
    /// The program's text.
    pub program: String,
}

/// The judgement on a program.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    /// Within tolerance and limits.
    pub pass: bool,
    /// Why, or why not, one sentence each.
    pub reasons: Vec<String>,
}

/// A triangulated surface.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Corners.
    pub points: Vec<Point>,
    /// One normal a corner, out of the material; need not have length one.
    pub normals: Vec<Vector>,
    /// Indices into `points`, counterclockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// A body on the page.
#[derive(Clone, Debug, Default)]
pub struct BodyView {
    /// Its name.
    pub name: String,
    /// Whether it belongs to the setup and not to the machine.
    pub fixture: bool,
    /// Its form: part frame where it stands with the part, else as its link's motions take it there.
    pub mesh: Mesh,
    /// Index of the link that it moves with; none where it stands with the part.
    pub link: Option<usize>,
}

/// Where a link of the machine is, seen from the part: what takes its bodies to the part frame, one a sample of the motion.
pub type LinkTrack = Vec<RigidMotion>;

/// The part with what was measured on it; each list has one entry a corner of the mesh.
#[derive(Clone, Debug, Default)]
pub struct PartView {
    /// The surface.
    pub mesh: Mesh,
    /// Deviation: positive is material left (undercut), negative is material missing (overcut), `None` where no pass
    /// reaches.
    pub deviation: Vec<Option<f64>>,
    /// Strip that made the corner, from 0; `None` where there is none.
    pub strip: Vec<Option<u32>>,
    /// Allowed overcut, not negative.
    pub overcut_tolerance: f64,
    /// Allowed undercut, not negative.
    pub undercut_tolerance: f64,
}

/// One position of the tool axis, from the tip end to the spindle end of the flutes.
#[derive(Clone, Copy, Debug)]
pub struct Ruling {
    /// Strip it belongs to, from 0.
    pub strip: u32,
    /// End nearer the tip.
    pub from: Point,
    /// End nearer the spindle.
    pub to: Point,
}

/// A stretch of the tool's outline.
#[derive(Clone, Debug)]
pub struct ProfileSection {
    /// What this stretch is.
    pub section: Section,
    /// Height above the tip and radius of each corner of the outline, from the tip upward.
    pub outline: Vec<[f64; 2]>,
}

/// Motion over time; all lists of samples have the same length, times never fall.
#[derive(Clone, Debug, Default)]
pub struct Timeline {
    /// Where the tool is.
    pub samples: Vec<ToolSample>,
    /// Where the axes are.
    pub axes: Vec<AxisTrack>,
}

/// The tool at one instant.
#[derive(Clone, Copy, Debug)]
pub struct ToolSample {
    /// Since the start of the program.
    pub time: f64,
    /// Tip.
    pub tip: Point,
    /// Unit axis from the tip toward the spindle.
    pub axis: Vector,
    /// Line of the program that moves it there, from 1.
    pub line: usize,
}

/// What the two curves of a track are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TrackKind {
    /// Position and speed of a machine axis.
    #[default]
    Axis,
    /// What is taken from the stock: removal rate, cm^3/min, and engagement, degrees.
    Stock,
}

/// One machine axis over time; or the stock, with its own two curves in place of position and speed.
#[derive(Clone, Debug, Default)]
pub struct AxisTrack {
    /// What the curves are.
    pub kind: TrackKind,
    /// Letter.
    pub name: String,
    /// Unit of the position, `mm` or `deg`; speeds are per minute.
    pub unit: String,
    /// One position a sample.
    pub position: Vec<f64>,
    /// One speed a sample, unit per minute, signed.
    pub speed: Vec<f64>,
    /// Travel, low and high.
    pub travel: Option<(f64, f64)>,
    /// Largest speed either way, unit per minute.
    pub max_speed: Option<f64>,
}

/// One row of the table of figures.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// What was measured.
    pub label: String,
    /// The measured value.
    pub value: f64,
    /// Digits shown after the point, for value and limit.
    pub decimals: usize,
    /// Unit, empty for counts.
    pub unit: String,
    /// The limit it was judged by.
    pub limit: Option<f64>,
    /// Whether it keeps the limit; `None` for figures that are not judged.
    pub ok: Option<bool>,
}

/// One strip as planned.
#[derive(Clone, Debug, Default)]
pub struct StripRow {
    /// Largest depth below the surface, not negative.
    pub overcut: f64,
    /// Largest height above the surface, not negative.
    pub undercut: f64,
    /// Largest and mean angle to the next strip, degrees; none for the last.
    pub kink: Option<(f64, f64)>,
    /// Length of the way.
    pub length: f64,
    /// Widest engagement of the flank.
    pub engagement: f64,
    /// Steps of the optimizer.
    pub steps: usize,
    /// Least error that the part's curvature along the flank leaves a straight tool.
    pub curvature_error: f64,
    /// What keeps the strip from being better.
    pub limited_by: String,
}

/// Blocks in a row that are slower than usual for one reason.
#[derive(Clone, Debug, Default)]
pub struct SlowRow {
    /// First and last line.
    pub lines: (usize, usize),
    /// Seconds more than at the usual feed.
    pub lost: f64,
    /// Lowest feed, mm/min.
    pub feed: f64,
    /// Usual feed around it, mm/min.
    pub usual_feed: f64,
    /// What holds it back.
    pub cause: String,
}

/// Something found in the program or on the part.
#[derive(Clone, Debug, Default)]
pub struct Finding {
    /// Line of the program, from 1.
    pub line: Option<usize>,
    /// Where on the part or in space.
    pub point: Option<Point>,
    /// Code and name of the rule.
    pub code: String,
    /// Whether it keeps the program from passing.
    pub error: bool,
    /// What was found.
    pub text: String,
    /// What to do about it.
    pub help: String,
}

/// Data that cannot be shown truthfully.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReportError {
    /// A number that is infinite, not a number, or too large to show.
    #[error("{what} {index} is not a finite number")]
    NotFinite {
        /// Which list.
        what: &'static str,
        /// Index in it, from 0.
        index: usize,
    },
    /// Lists that belong together and differ in length, or an index past the end of its list.
    #[error("{what}: {found} where {wanted} were expected")]
    Count {
        /// Which list.
        what: &'static str,
        /// Length or index found.
        found: usize,
        /// Length wanted.
        wanted: usize,
    },
    /// Times that run backward.
    #[error("sample {index} is earlier than the sample before it")]
    TimeOrder {
        /// Index of the offending sample, from 0.
        index: usize,
    },
}

fn finite(what: &'static str, numbers: impl IntoIterator<Item = f64>) -> Result<(), ReportError> {
    // The page holds 32-bit floats; what overflows them cannot be shown either.
    match numbers.into_iter().position(|n| !(n as f32).is_finite()) {
        Some(index) => Err(ReportError::NotFinite { what, index }),
        None => Ok(()),
    }
}

fn count(what: &'static str, found: usize, wanted: usize) -> Result<(), ReportError> {
    if found == wanted { Ok(()) } else { Err(ReportError::Count { what, found, wanted }) }
}

impl Mesh {
    fn check(&self) -> Result<(), ReportError> {
        count("normals of a mesh", self.normals.len(), self.points.len())?;
        finite("coordinate of a mesh", self.points.iter().flat_map(|p| [p.x, p.y, p.z]))?;
        finite("normal component of a mesh", self.normals.iter().flat_map(|n| [n.x, n.y, n.z]))?;
        let wanted = self.points.len();
        match self.triangles.iter().flatten().find(|i| **i as usize >= wanted) {
            Some(index) => Err(ReportError::Count { what: "corner of a triangle", found: *index as usize, wanted }),
            None => Ok(()),
        }
    }
}

/// Refuses bodies that are not finite, or whose link is not known all the time.
fn check_bodies(bodies: &[BodyView], links: &[LinkTrack], samples: usize) -> Result<(), ReportError> {
    for track in links {
        count("places of a link", track.len(), samples)?;
        let numbers = track.iter().flat_map(|motion| {
            let (turn, way) = (motion.rotation.coords, motion.translation.vector);
            [turn.x, turn.y, turn.z, turn.w, way.x, way.y, way.z]
        });
        finite("place of a link", numbers)?;
    }
    for body in bodies {
        body.mesh.check()?;
        if let Some(link) = body.link.filter(|link| *link >= links.len()) {
            return Err(ReportError::Count { what: "link of a body", found: link, wanted: links.len() });
        }
    }
    Ok(())
}

impl PartView {
    fn check(&self) -> Result<(), ReportError> {
        self.mesh.check()?;
        count("deviations", self.deviation.len(), self.mesh.points.len())?;
        count("strip numbers", self.strip.len(), self.mesh.points.len())?;
        finite("deviation", self.deviation.iter().map(|d| d.unwrap_or(0.0)))?;
        finite("tolerance", [self.overcut_tolerance, self.undercut_tolerance])
    }

    /// Largest overcut and largest undercut at the corners, both positive or zero.
    pub fn extremes(&self) -> (f64, f64) {
        let measured = self.deviation.iter().flatten();
        measured.fold((0.0, 0.0), |(over, under), d| (f64::max(over, -d), f64::max(under, *d)))
    }
}

impl Timeline {
    fn check(&self) -> Result<(), ReportError> {
        finite("time", self.samples.iter().map(|s| s.time))?;
        finite("tip coordinate", self.samples.iter().flat_map(|s| [s.tip.x, s.tip.y, s.tip.z]))?;
        finite("axis component", self.samples.iter().flat_map(|s| [s.axis.x, s.axis.y, s.axis.z]))?;
        if let Some(index) = self.samples.windows(2).position(|w| w[1].time < w[0].time) {
            return Err(ReportError::TimeOrder { index: index + 1 });
        }
        for track in &self.axes {
            count("axis positions", track.position.len(), self.samples.len())?;
            count("axis speeds", track.speed.len(), self.samples.len())?;
            finite("axis position", track.position.iter().copied())?;
            finite("axis speed", track.speed.iter().copied())?;
            let (low, high) = track.travel.unwrap_or_default();
            finite("axis limit", [low, high, track.max_speed.unwrap_or_default()])?;
        }
        Ok(())
    }
}

impl ReportData {
    /// Refuses numbers that are not finite and lists that do not fit together.
    pub(super) fn check(&self) -> Result<(), ReportError> {
        for mesh in &self.surroundings {
            mesh.check()?;
        }
        check_bodies(&self.bodies, &self.links, self.timeline.samples.len())?;
        if let Some(part) = &self.part {
            part.check()?;
        }
        let ends = self.rulings.iter().flat_map(|r| [r.from, r.to]);
        finite("coordinate of a ruling", ends.flat_map(|p| [p.x, p.y, p.z]))?;
        finite("size of the tool", self.tool.iter().flat_map(|s| s.outline.iter().flatten().copied()))?;
        self.timeline.check()?;
        finite("figure", self.figures.iter().flat_map(|f| [f.value, f.limit.unwrap_or(0.0)]))?;
        let planned = self.strips.iter().flat_map(|s| {
            let (most, mean) = s.kink.unwrap_or_default();
            [s.overcut, s.undercut, most, mean, s.length, s.engagement, s.curvature_error]
        });
        finite("figure of a strip", planned)?;
        finite("figure of a slow stretch", self.slow.iter().flat_map(|s| [s.lost, s.feed, s.usual_feed]))?;
        let places = self.findings.iter().filter_map(|f| f.point);
        finite("place of a finding", places.flat_map(|p| [p.x, p.y, p.z]))
    }
}

/// Steps into which an arc of the outline is cut, per right angle.
const ARC_STEPS_PER_QUARTER: f64 = 12.0;

/// The tool's outline for the 3D view: straight pieces exact, arcs cut into steps of at most 7.5 degrees.
pub fn tool_outline(tool: &Tool) -> Vec<ProfileSection> {
    let flutes = tool.flutes().iter().map(|e| (Section::Flute, e));
    let mut sections: Vec<ProfileSection> = Vec::new();
    for (section, element) in flutes.chain(tool.body()) {
        let outline = sampled(element);
        match sections.last_mut().filter(|s| s.section == section) {
            Some(last) => last.outline.extend(outline.into_iter().skip(1)),
            None => sections.push(ProfileSection { section, outline }),
        }
    }
    sections
}

fn sampled(element: &Element) -> Vec<[f64; 2]> {
    let steps = match element {
        Element::Line { .. } => 1,
        Element::Arc { from, to, .. } => {
            let quarters = (to - from).abs() / std::f64::consts::FRAC_PI_2;
            (quarters * ARC_STEPS_PER_QUARTER).ceil().max(1.0) as usize
        }
    };
    let share = |i: usize| element.contact(i as f64 / steps as f64).point;
    (0..=steps).map(share).map(|p| [p.height, p.radius]).collect()
}
