//! Follows APT statements: where the tool goes, how fast, and with what. Uses `geometry` and `motion`.

use super::AptFile;
use super::operation::{Leg, Operation};
use super::statement::{Statement, Unread, Word};
use super::words::{FeedUnit, HARMLESS};
use crate::geometry::{Direction, Point, Vector};
use crate::motion::pose::Pose;
use std::f64::consts::{PI, TAU};

/// Largest difference of a circle's radius at either end from what the statement says, mm, and as a share of it.
const RADIUS_TOLERANCE: (f64, f64) = (0.02, 0.001);

/// A circle that the next GOTO ends.
struct Circle {
    centre: Point,
    normal: Direction,
    radius: f64,
    word: Word,
}

/// A drilling cycle: every GOTO in it is a hole.
#[derive(Clone, Copy, Debug)]
struct Drilling {
    depth: f64,
    clearance: f64,
    retract: f64,
    feed: f64,
}

/// A cutter as the file gives it.
#[derive(Clone, Debug)]
struct Cutter {
    /// Diameter and corner radius, mm.
    sizes: [f64; 2],
    height: Option<f64>,
    word: Word,
}

/// The state of the file.
pub(super) struct Reader {
    chord: f64,
    scale: f64,
    at: Option<(Pose, usize)>,
    axis: Direction,
    home: Option<Pose>,
    rapid: bool,
    /// mm/min; 0 before the first FEDRAT.
    feed: f64,
    circle: Option<Circle>,
    drilling: Option<Drilling>,
    world: bool,
    ended: bool,
    /// What CUTTER said since the last motion: it may be meant for the tool call that follows.
    cutter: Option<Cutter>,
    operation: Operation,
    file: AptFile,
}

impl Reader {
    pub(super) fn new(chord: f64) -> Self {
        Self {
            chord,
            scale: 1.0,
            at: None,
            axis: Vector::z_axis(),
            home: None,
            rapid: false,
            feed: 0.0,
            circle: None,
            drilling: None,
            world: false,
            ended: false,
            cutter: None,
            operation: Operation::default(),
            file: AptFile::default(),
        }
    }

    pub(super) fn finish(mut self) -> AptFile {
        self.close_operation();
        self.file
    }

    /// Carries out one statement.
    pub(super) fn statement(&mut self, statement: &Statement) {
        let words = &statement.words;
        if self.ended {
            self.unread(&statement.major, "it stands behind FINI", true);
            return;
        }
        match statement.major.text.as_str() {
            "PARTNO" => self.file.name = words.first().map(|word| word.text.clone()).unwrap_or_default(),
            "UNITS" | "UNIT" => self.units(statement),
            "INCHES" => self.set_units(25.4),
            "MM" => self.set_units(1.0),
            "MULTAX" => self.multax(statement),
            "TLAXIS" => self.tool_axis(statement),
            "FROM" | "GOTO" | "GODLTA" | "GOHOME" => self.go(statement),
            "RAPID" => self.rapid = true,
            "FEDRAT" => self.feed_rate(statement),
            "CIRCLE" => self.begin_circle(statement),
            "CYCLE" => self.cycle(statement),
            "CUTTER" => self.cutter(statement),
            "LOADTL" | "LOAD" => self.load(statement),
            "SPINDL" => self.spindle(statement),
            "COOLNT" => self.operation.coolant |= words.first().is_some_and(|word| word.text != "OFF"),
            "TRNTYP" if words.first().is_some_and(|word| word.text == "WORLD") => self.world = true,
            "CSYS" | "MSYS" if self.world => {}
            "CUTCOM" if words.first().is_some_and(|word| word.text == "OFF") => {}
            "FINI" => self.ended = true,
            word if HARMLESS.contains(&word) => self.unread(&statement.major, "it is not carried on", true),
            _ => self.unread(&statement.major, "this word is not known here", false),
        }
    }

    fn unread(&mut self, word: &Word, reason: &str, harmless: bool) {
        let Word { text, line, column } = word;
        let (word, reason) = (text.clone(), reason.to_owned());
        self.file.unread.push(Unread { line: *line, column: *column, word, reason, harmless });
    }

    /// The numbers of a statement from a word on, as many as there are in a row.
    fn numbers(words: &[Word]) -> Vec<f64> {
        words.iter().map_while(Word::number).collect()
    }

    /// Words behind the first `count` that nobody has looked at.
    fn rest(&mut self, words: &[Word], count: usize) {
        for word in words.iter().skip(count) {
            self.unread(word, "it is not understood in this statement", false);
        }
    }

    fn set_units(&mut self, scale: f64) {
        (self.scale, self.file.has_units) = (scale, true);
    }

    fn units(&mut self, statement: &Statement) {
        match statement.words.first().map(|word| word.text.as_str()) {
            Some("MM" | "MILLIMETERS") => self.set_units(1.0),
            Some("INCHES" | "INCH" | "IN") => self.set_units(25.4),
            Some("CM" | "CENTIMETERS") => self.set_units(10.0),
            _ => self.unread(&statement.major, "write UNITS/MM or UNITS/INCHES", false),
        }
    }

    fn multax(&mut self, statement: &Statement) {
        match statement.words.first().map(|word| word.text.as_str()) {
            None | Some("ON") => {}
            Some("OFF") => self.axis = Vector::z_axis(),
            Some(_) => self.rest(&statement.words, 0),
        }
    }

    fn tool_axis(&mut self, statement: &Statement) {
        match *Self::numbers(&statement.words) {
            [i, j, k] if Direction::try_new(Vector::new(i, j, k), 1e-9).is_some() => {
                self.axis = Direction::new_normalize(Vector::new(i, j, k));
            }
            _ => self.unread(&statement.major, "write the three components of the tool axis", false),
        }
    }

    fn go(&mut self, statement: &Statement) {
        let numbers = Self::numbers(&statement.words);
        let major = &statement.major;
        let here = self.at.map(|(pose, _)| pose.tip);
        let tip = match (major.text.as_str(), &numbers[..]) {
            ("GOHOME", []) => match self.home {
                Some(home) => {
                    self.axis = home.axis;
                    home.tip
                }
                None => return self.unread(major, "no FROM says where home is", false),
            },
            ("GODLTA", [way]) if here.is_some() => {
                here.unwrap_or_default() + self.axis.into_inner() * (way * self.scale)
            }
            ("GODLTA", [x, y, z]) if here.is_some() => here.unwrap_or_default() + Vector::new(*x, *y, *z) * self.scale,
            ("GOTO" | "FROM", [x, y, z, axis @ ..]) => {
                match *axis {
                    [] => {}
                    [i, j, k] if Direction::try_new(Vector::new(i, j, k), 1e-9).is_some() => {
                        self.axis = Direction::new_normalize(Vector::new(i, j, k));
                    }
                    _ => return self.unread(major, "write x, y, z, or x, y, z and the tool axis i, j, k", false),
                }
                Point::new(*x, *y, *z) * self.scale
            }
            _ => return self.unread(major, "its numbers are not understood", false),
        };
        self.rest(&statement.words, numbers.len());
        let pose = Pose { tip, axis: self.axis };
        if major.text == "FROM" {
            self.home = Some(pose);
            self.at = Some((pose, major.line));
        } else {
            self.go_to(pose, major);
        }
    }

    /// Moves to a pose as the state says.
    fn go_to(&mut self, pose: Pose, word: &Word) {
        if let Some(drilling) = self.drilling {
            self.rapid = false;
            return self.drill(pose, drilling, word.line);
        }
        let feed = if std::mem::take(&mut self.rapid) { None } else { Some(self.feed) };
        if let (Some(circle), Some((from, _))) = (self.circle.take(), self.at) {
            match self.chords(&circle, &from, &pose) {
                Some(chords) => {
                    let last = chords.len();
                    for (index, chord) in chords.into_iter().enumerate() {
                        self.leg(chord, feed, word.line, index + 1 == last);
                    }
                    return;
                }
                None => {
                    self.unread(
                        &circle.word,
                        "its radius is not that of the motion's ends; a straight line is taken",
                        false,
                    );
                }
            }
        }
        self.leg(pose, feed, word.line, true);
    }

    fn leg(&mut self, to: Pose, feed: Option<f64>, line: usize, corner: bool) {
        self.take_cutter();
        if let Some((from, start_line)) = self.at {
            if self.operation.start.is_none() {
                self.operation.start = Some((from, start_line));
            }
            if self.operation.line == 0 {
                self.operation.line = line;
            }
            let still = (to.tip - from.tip).norm() < 1e-9 && to.axis_angle(&from) < 1e-9;
            if !still {
                self.operation.legs.push(Leg { to, feed, line, corner });
            }
        }
        self.at = Some((to, line));
    }

    /// Rapid to the clearance plane, at the feed to the depth, rapid back.
    fn drill(&mut self, hole: Pose, drilling: Drilling, line: usize) {
        let above = |height: f64| Pose { tip: hole.at_height(height), axis: hole.axis };
        self.leg(above(drilling.retract.max(drilling.clearance)), None, line, true);
        self.leg(above(drilling.clearance), None, line, true);
        self.leg(above(-drilling.depth), Some(drilling.feed), line, true);
        self.leg(above(drilling.retract.max(drilling.clearance)), None, line, true);
    }

    /// Poses along a circle, right-handed about its normal, a helix where the ends are at different heights; `None` if the
    /// ends are not on it.
    fn chords(&self, circle: &Circle, from: &Pose, to: &Pose) -> Option<Vec<Pose>> {
        let flat = |v: Vector| v - circle.normal.into_inner() * circle.normal.dot(&v);
        let (start, end) = (flat(from.tip - circle.centre), flat(to.tip - circle.centre));
        let off = |radius: f64| (radius - circle.radius).abs();
        let allowed = RADIUS_TOLERANCE.0.max(RADIUS_TOLERANCE.1 * circle.radius);
        if off(start.norm()).max(off(end.norm())) > allowed || start.norm() < 1e-9 || end.norm() < 1e-9 {
            return None;
        }
        let turned = circle.normal.dot(&start.cross(&end)).atan2(start.dot(&end)).rem_euclid(TAU);
        let angle = if turned < 1e-9 { TAU } else { turned };
        let rise = circle.normal.dot(&(to.tip - from.tip));
        let base = from.tip - start;
        // A chord over an angle leaves its circle by r (1 - cos(angle / 2)).
        let step = 2.0 * (1.0 - (self.chord / circle.radius).min(1.0)).acos();
        let count = (angle / step.clamp(1e-4, PI / 2.0)).ceil() as usize;
        let across = circle.normal.cross(&start);
        let pose = |k: usize| {
            let share = k as f64 / count as f64;
            let (sin, cos) = (angle * share).sin_cos();
            let radius = 1.0 + (end.norm() / start.norm() - 1.0) * share;
            let tip = base + (start * cos + across * sin) * radius + circle.normal.into_inner() * (rise * share);
            Pose { tip, axis: from.interpolate(to, share).axis }
        };
        Some((1..count).map(pose).chain([*to]).collect())
    }

    fn begin_circle(&mut self, statement: &Statement) {
        let numbers = Self::numbers(&statement.words);
        let [x, y, z, i, j, k, radius, ..] = numbers[..] else {
            return self.unread(
                &statement.major,
                "write the centre, the normal and the radius: x, y, z, i, j, k, r",
                false,
            );
        };
        let radius = radius * self.scale;
        match Direction::try_new(Vector::new(i, j, k), 1e-9) {
            Some(normal) if radius > 0.0 && self.at.is_some() => {
                let centre = Point::new(x, y, z) * self.scale;
                self.circle = Some(Circle { centre, normal, radius, word: statement.major.clone() });
            }
            _ => self.unread(&statement.major, "a circle needs a start, a normal and a radius", false),
        }
    }

    fn feed_rate(&mut self, statement: &Statement) {
        let value = statement.words.iter().find_map(Word::number);
        let mut unit = FeedUnit::PerMinute;
        for word in statement.words.iter().filter(|word| word.number().is_none()) {
            match FeedUnit::named(&word.text) {
                Some(named) => unit = named,
                None => self.unread(word, "it is no unit of feed: MMPM, IPM, MMPR, IPR", false),
            }
        }
        let feed = value.and_then(|value| unit.mm_per_minute(value, self.scale, self.operation.spindle));
        match feed.filter(|feed| *feed > 0.0) {
            // A feed ends what RAPID began.
            Some(feed) => (self.feed, self.rapid) = (feed, false),
            None => {
                self.unread(&statement.major, "write a positive feed; one per revolution needs SPINDL before it", false)
            }
        }
    }

    /// The number behind a minor word.
    fn behind(words: &[Word], name: &str) -> Option<f64> {
        let at = words.iter().position(|word| word.text == name)?;
        words.get(at + 1)?.number()
    }

    fn cycle(&mut self, statement: &Statement) {
        let words = &statement.words;
        let kind = words.first().map(|word| word.text.as_str());
        match kind {
            Some("OFF" | "INIT") => self.drilling = None,
            Some("DRILL") => {
                let length = |name: &str| Self::behind(words, name).map(|value| value * self.scale);
                let unit = words.iter().find_map(|word| FeedUnit::named(&word.text).map(|unit| (unit, &word.text)));
                let feed = unit.and_then(|(unit, name)| {
                    unit.mm_per_minute(Self::behind(words, name)?, self.scale, self.operation.spindle)
                });
                let (Some(depth), Some(feed)) = (length("FEDTO").or(length("DEPTH")), feed.filter(|f| *f > 0.0)) else {
                    return self.unread(
                        &statement.major,
                        "a drilling cycle needs FEDTO and a feed with its unit",
                        false,
                    );
                };
                let clearance = length("RAPTO").unwrap_or(0.0);
                let retract = length("RTRCTO").unwrap_or(clearance);
                if Self::behind(words, "DWELL").is_some_and(|dwell| dwell != 0.0) {
                    self.unread(&statement.major, "the dwell of the cycle is not carried on", true);
                }
                self.drilling = Some(Drilling { depth, clearance, retract, feed });
            }
            _ => {
                self.unread(&statement.major, "this cycle is not known here; its places are moved to as by GOTO", false)
            }
        }
    }

    fn cutter(&mut self, statement: &Statement) {
        let numbers = Self::numbers(&statement.words);
        let Some(diameter) = numbers.first() else {
            return self.unread(&statement.major, "write the diameter of the cutter", true);
        };
        let corner = numbers.get(1).copied().unwrap_or_default();
        // d, r, e, f, alpha, beta, height.
        let height = numbers.get(6).map(|height| height * self.scale).filter(|height| *height > 0.0);
        let sizes = [diameter * self.scale, corner * self.scale];
        self.cutter = Some(Cutter { sizes, height, word: statement.major.clone() });
    }

    /// The cutter is now that of the operation.
    fn take_cutter(&mut self) {
        let Some(Cutter { sizes, height, word }) = self.cutter.take() else { return };
        if self.operation.cutter.is_some_and(|before| before != sizes) && !self.operation.legs.is_empty() {
            return self.unread(&word, "another cutter without a tool call", false);
        }
        (self.operation.cutter, self.operation.cutter_height) = (Some(sizes), height);
    }

    fn load(&mut self, statement: &Statement) {
        let words = &statement.words;
        let words = match words.first() {
            Some(first) if first.text == "TOOL" => &words[1..],
            _ => &words[..],
        };
        let number = words.first().and_then(Word::number).filter(|n| n.fract() == 0.0 && (0.0..=1e9).contains(n));
        let Some(number) = number else {
            return self.unread(&statement.major, "write the whole number of the tool", false);
        };
        self.close_operation();
        // Nobody knows where the tool change leaves the machine.
        self.at = None;
        self.operation.line = statement.major.line;
        self.operation.tool = Some(number as u32);
        self.operation.tool_length = Self::behind(words, "LENGTH").map(|length| length * self.scale);
    }

    /// Keeps the operation, if it moves; the next begins without a tool.
    fn close_operation(&mut self) {
        let operation = std::mem::take(&mut self.operation);
        if !operation.legs.is_empty() {
            self.file.operations.push(operation);
        }
    }

    fn spindle(&mut self, statement: &Statement) {
        let mut turns = true;
        for word in &statement.words {
            match word.text.as_str() {
                "OFF" => turns = false,
                "ON" | "RPM" | "CLW" => {}
                _ if word.number().is_some() => {}
                _ => self.unread(word, "write SPINDL/RPM,speed,CLW or SPINDL/OFF", false),
            }
        }
        if let Some(speed) = statement.words.iter().find_map(Word::number).filter(|speed| *speed > 0.0) {
            match self.operation.spindle.filter(|before| turns && *before != speed && self.operation.start.is_some()) {
                Some(_) => self.unread(&statement.major, "another speed in the middle of an operation", false),
                None => self.operation.spindle = Some(speed),
            }
        }
    }
}
