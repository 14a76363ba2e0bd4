//! Writes the program of a tool path: header, approach, timed blocks, end. Uses `diagnostic`, `motion`, `machine` and
//! `feed`.

use super::dialect::{Part, Style};
use super::feed_rules::{FeedRules, Travelled};
use super::template::{Approach, Fields, render};
use super::write_block::{BlockWriter, LINEAR, Motion, ROTARY, Words};
use super::write_feed::{FeedWord, NoFeedWord, feed_word, unit_mm};
use crate::diagnostic::{Diagnostic, Result};
use crate::feed::TimedMove;
use crate::machine::{AxisZero, DialectOptions, FeedMode, Interpolation, LengthUnit, OrientationWords, Setup, Travel};
use crate::motion::ToolPath;

/// What to write.
#[derive(Clone, Copy, Debug)]
pub struct WriteRequest<'a> {
    /// Name, tool, spindle speed and tolerances.
    pub path: &'a ToolPath,
    /// The path's moves. The first only says where it begins: the machine gets there by rapids.
    pub moves: &'a [TimedMove],
    /// The machine with its part and tool.
    pub setup: &'a Setup,
    /// G code of the setup's work offset, such as `G54`.
    pub work_offset: &'a str,
    /// With TCP on; else as axis positions.
    pub tcp: bool,
    /// Hash of everything the program was made from, for its header.
    pub input_hash: &'a str,
    /// Program number, for controls that have one.
    pub number: u32,
    /// Leave out words that stay as they were.
    pub modal: bool,
}

/// A program, and what its control's words cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The text, lines ended by a line feed.
    pub text: String,
    /// Lines, from 1, whose feed a ceiling of the control lowers by more than the rounding of the word, in order.
    pub slowed: Vec<usize>,
    /// Seconds by which the program takes longer than asked, rounding and ceilings together.
    pub lost: f64,
    /// For each move the seconds that its feed word makes it take; none for the first, for rapids, and for moves too short
    /// to be written, whose time is the next one's.
    pub seconds: Vec<Option<f64>>,
}

/// Share by which rounding alone may lower a feed.
const ROUNDING: f64 = 0.01;
/// Rotary angles that differ by more are another branch or turn, radians.
const OTHER_BRANCH: f64 = 0.1;
/// Angle to the pole below which the rotary axes are not watched, radians.
const NEAR_POLE: f64 = 1e-3;

/// Writes a program. The same request gives the same bytes.
///
/// # Errors
/// No moves; numbers that are not finite or too large; a state of TCP or a form of feed that the control does not have;
/// a template that cannot be filled in; a block that is too long for the control, or too slow for any F word; a turn of
/// a wrapped axis by half a turn or more; tool vectors that the control would follow with other rotary angles.
pub fn write(request: &WriteRequest) -> Result<Written> {
    let mut writer = Writer::new(request)?;
    let Some((first, moves)) = request.moves.split_first() else {
        return Err(Diagnostic::error("the path has no moves, so there is no program to write"));
    };
    writer.begin(first)?;
    writer.out.seconds.push(None);
    for step in moves {
        let seconds = writer.step(step)?;
        writer.out.seconds.push(seconds);
    }
    writer.end()?;
    Ok(writer.out)
}

struct Writer<'a> {
    request: &'a WriteRequest<'a>,
    options: &'a DialectOptions,
    style: Style,
    rules: FeedRules,
    fields: Fields<'a>,
    blocks: BlockWriter,
    /// Blocks give the tool axis by its components.
    vectors: bool,
    out: Written,
    line: usize,
    /// Where the path stands, in words and exactly.
    at: Words,
    rotary: [f64; 2],
    /// Durations of blocks too short to be written, s.
    owed: f64,
}

impl<'a> Writer<'a> {
    fn new(request: &'a WriteRequest<'a>) -> Result<Self> {
        let machine = request.setup.machine();
        let options = &machine.control.options;
        let style = Style::of(machine.control.dialect);
        let reachable = match request.tcp {
            true => options.tcp_on.is_some() || options.tcp_at_start,
            false => options.tcp_off.is_some() || !options.tcp_at_start,
        };
        if !reachable {
            let state = if request.tcp { "on" } else { "off" };
            return Err(Diagnostic::error(format!("the control of {} cannot turn TCP {state}", machine.name))
                .help("give the code in [control.options], or write the program the other way"));
        }
        if style.feed_units.is_none() && options.feed_mode == FeedMode::InverseTime {
            let dialect = machine.control.dialect.name();
            return Err(Diagnostic::error(format!("{dialect} has no inverse-time feed"))
                .help("write feed_mode = \"per-minute\" in [control.options]"));
        }
        let blocks = BlockWriter::new(machine, style, request.modal);
        Ok(Self {
            request,
            options,
            style,
            rules: FeedRules::new(machine.control.dialect, options),
            fields: fields(request, &style, &blocks)?,
            vectors: vectors(request),
            blocks,
            out: Written {
                text: String::with_capacity(request.moves.len() * 60),
                slowed: Vec::new(),
                lost: 0.0,
                seconds: Vec::with_capacity(request.moves.len()),
            },
            line: 0,
            at: [0; 8],
            rotary: [0.0; 2],
            owed: 0.0,
        })
    }

    /// Begins a line.
    fn open(&mut self) -> usize {
        use std::fmt::Write;
        let start = self.out.text.len();
        if self.style.numbered_lines {
            // Writing to a string cannot fail.
            let _ = write!(self.out.text, "{} ", self.line);
        }
        start
    }

    /// Ends the line that begins at `start`; refuses one that the control does not take.
    fn close(&mut self, start: usize) -> Result<()> {
        let length = self.out.text.len() - start;
        let limit = self.options.max_block_length;
        if length > limit {
            let message = format!("block {} would have {length} characters; the control takes {limit}", self.line + 1);
            return Err(Diagnostic::error(message)
                .help("lower linear_digits or rotary_digits, or raise max_block_length if the control takes more"));
        }
        self.line += 1;
        self.out.text.push('\n');
        Ok(())
    }

    /// Adds a part that comes from a template.
    fn part(&mut self, part: Part) -> Result<()> {
        let own = &self.request.setup.machine().control.templates;
        for line in render(part, own, &self.style, self.options.max_block_length, &self.fields)? {
            let start = self.open();
            self.out.text.push_str(&line);
            self.close(start)?;
        }
        Ok(())
    }

    /// Everything before the path: to where it begins by rapids.
    fn begin(&mut self, first: &TimedMove) -> Result<()> {
        self.part(Part::Header)?;
        self.part(Part::Retract)?;
        self.part(Part::ToolCall)?;
        let joint = self.words_of(first, false)?;
        let start = self.words_of(first, self.request.tcp)?;
        let text = |words: &Words, indices: &[usize]| self.blocks.text(words, indices);
        self.fields.approach = Some(Approach {
            rotary: text(&joint, &ROTARY),
            across: text(&joint, &[0, 1]),
            joint: text(&joint, &[0, 1, 2, 3, 4]),
            start: text(&start, &LINEAR),
            start_words: LINEAR.iter().map(|index| text(&start, &[*index])).collect(),
        });
        (self.at, self.rotary) = (start, first.axes.to.rotary);
        self.part(Part::Approach)
    }

    fn end(&mut self) -> Result<()> {
        self.fields.approach = None;
        self.part(Part::Retract)?;
        self.part(Part::End)
    }

    /// The words of a move.
    fn words_of(&self, step: &TimedMove, tcp: bool) -> Result<Words> {
        let exact = self.request.setup.words(&step.axes.to, tcp);
        let unit = unit_mm(self.options);
        let ([x, y, z], [a, b]) = (exact.linear.map(|value| value / unit), exact.rotary);
        let axis = step.axes.pose.axis;
        let [i, j, k] = if self.vectors { [axis.x, axis.y, axis.z] } else { [0.0; 3] };
        let mut words = [0; 8];
        for (index, value) in [x, y, z, a, b, i, j, k].into_iter().enumerate() {
            words[index] = self.blocks.steps(index, value).ok_or_else(|| {
                Diagnostic::error(format!("{value} after block {} is no number that a control reads", self.line))
                    .help("check the path: its poses must be finite and within reach")
            })?;
        }
        for slot in ROTARY {
            if self.blocks.wrapped[slot - 3] {
                words[slot] = words[slot].rem_euclid(self.blocks.turn());
            }
        }
        Ok(words)
    }

    /// Writes a move; the seconds that its feed word makes it take.
    fn step(&mut self, step: &TimedMove) -> Result<Option<f64>> {
        let words = self.words_of(step, self.request.tcp)?;
        let turned = self.turned(&words)?;
        let way = self.way(&words, turned, step);
        if way.is_none() {
            // The control would not move; the time goes to the next block.
            self.owed += if step.axes.kind.is_rapid() { 0.0 } else { step.duration };
            return Ok(None);
        }
        self.check_branch(step)?;
        let (words, feed) = if step.axes.kind.is_rapid() { (words, None) } else { self.feed(words, step, way)? };
        let motion = if feed.is_some() { Motion::Feed } else { Motion::Rapid };
        let start = self.open();
        self.blocks.push(&mut self.out.text, motion, &words, self.vectors, turned, feed);
        self.close(start)?;
        (self.at, self.rotary) = (words, step.axes.to.rotary);
        Ok(feed.map(|word| word.seconds))
    }

    /// The feed of a block, and the words that it can be given for.
    fn feed(&mut self, words: Words, step: &TimedMove, way: Travelled) -> Result<(Words, Option<FeedWord>)> {
        let asked = step.duration + std::mem::take(&mut self.owed);
        if !(asked.is_finite() && asked > 0.0) {
            return Err(Diagnostic::error(format!("the block after line {} is to take {asked} s", self.line)));
        }
        let (tcp, rules, options) = (self.request.tcp, self.rules, self.options);
        let least = asked.max(1.0 / options.max_block_rate);
        let (words, word) = match feed_word(options, &rules, way, tcp, least) {
            Ok(word) => (words, word),
            Err(NoFeedWord::TipStill) => {
                // The tip moves by less than any feed word tells: it waits for the next block.
                let turning = Travelled { linear: 0.0, ..way };
                let word = feed_word(options, &rules, turning, tcp, least).map_err(|_| self.too_slow(asked))?;
                let [x, y, z, ..] = self.at;
                let [_, _, _, a, b, i, j, k] = words;
                ([x, y, z, a, b, i, j, k], word)
            }
            Err(NoFeedWord::TooSlow) => return Err(self.too_slow(asked)),
        };
        self.out.lost += word.seconds - asked;
        if word.seconds > asked * (1.0 + ROUNDING) {
            self.out.slowed.push(self.line + 1);
        }
        Ok((words, Some(word)))
    }

    fn too_slow(&self, seconds: f64) -> Box<Diagnostic> {
        Diagnostic::error(format!("the block after line {} is to take {seconds} s: no F word is that slow", self.line))
            .help("raise feed_digits, or raise the feed")
    }

    /// By how much the rotary axes turn from where they stand, in steps of their words.
    fn turned(&self, words: &Words) -> Result<[i64; 2]> {
        let mut turned = [0; 2];
        for slot in ROTARY {
            let mut steps = words[slot] - self.at[slot];
            if self.blocks.wrapped[slot - 3] {
                let turn = self.blocks.turn();
                steps = (steps + turn / 2).rem_euclid(turn) - turn / 2;
                if steps == -turn / 2 {
                    let letter = self.request.setup.machine().rotary[slot - 3].letter;
                    return Err(Diagnostic::error(format!(
                        "{letter} turns by half a turn in the block after line {}: the control may go either way",
                        self.line
                    ))
                    .help("put more blocks there"));
                }
            }
            turned[slot - 3] = steps;
        }
        Ok(turned)
    }

    /// How far a block goes from where the path stands.
    fn way(&self, words: &Words, turned: [i64; 2], step: &TimedMove) -> Travelled {
        let unit = unit_mm(self.options);
        let [x, y, z] = LINEAR.map(|index| self.blocks.value(index, words[index] - self.at[index]) * unit);
        let linear = x.hypot(y).hypot(z);
        if self.vectors {
            // The control finds the angles of the vector itself.
            let same = (5..8).all(|index| words[index] == self.at[index]);
            let [a, b]: [f64; 2] = std::array::from_fn(|k| (step.axes.to.rotary[k] - self.rotary[k]).to_degrees());
            return Travelled { linear, rotary: if same { 0.0 } else { a.hypot(b) } };
        }
        let [a, b] = ROTARY.map(|slot| self.blocks.value(slot, turned[slot - 3]));
        Travelled { linear, rotary: a.hypot(b) }
    }

    /// With tool vectors the control takes the rotary angles nearest to where it stands: they must be those of the path.
    fn check_branch(&self, step: &TimedMove) -> Result<()> {
        if !self.vectors {
            return Ok(());
        }
        let (setup, wanted) = (self.request.setup, step.axes.to.rotary);
        let taken = setup.inverse_near(&step.axes.pose, self.rotary).map(|axes| axes.rotary);
        let other = taken.is_none_or(|taken| taken.iter().zip(wanted).any(|(a, b)| (a - b).abs() > OTHER_BRANCH));
        // At the pole the angle is free.
        if other && setup.pole_distance(&step.axes.pose.axis) > NEAR_POLE {
            let message = format!(
                "after line {} the control would follow the tool vector with other rotary angles than the path's",
                self.line
            );
            return Err(Diagnostic::error(message)
                .help("write orientation = \"angles\" in [control.options], or put more blocks there"));
        }
        Ok(())
    }
}

/// Whether blocks give the tool axis by its components.
fn vectors(request: &WriteRequest) -> bool {
    request.tcp && request.setup.machine().control.options.orientation == OrientationWords::Vectors
}

/// What the templates may use, but for the approach.
fn fields<'a>(request: &WriteRequest<'a>, style: &Style, blocks: &BlockWriter) -> Result<Fields<'a>> {
    let (path, machine) = (request.path, request.setup.machine());
    let options = &machine.control.options;
    let rpm = path.spindle_rpm;
    let rpm = if style.whole_spindle_speed { rpm.round() } else { rpm };
    if !(rpm.is_finite() && rpm > 0.0) {
        return Err(Diagnostic::error(format!("spindle speed {rpm} is not a positive number"))
            .help("write the speed in revolutions per minute"));
    }
    let vectors = vectors(request);
    let tcp_on =
        if vectors { options.tcp_on_vectors.as_ref().or(options.tcp_on.as_ref()) } else { options.tcp_on.as_ref() };
    let plain = style.plain_text;
    // Whether the tool length is called in a block of its own.
    let length = match request.tcp {
        _ if style.length_with_tool => false,
        true => machine.spindle.axis_zero == AxisZero::GaugePoint && !style.length_with_tcp,
        false => options.length_offset_without_tcp,
    };
    let [length_on, length_off] = &options.length_codes;
    let number = path.tool.number;
    let switchable = options.tcp_off.is_some() || !options.tcp_at_start;
    Ok(Fields {
        name: plain(&path.name),
        number: request.number,
        machine: &machine.name,
        dialect: machine.control.dialect.name(),
        version: env!("CARGO_PKG_VERSION"),
        input: request.input_hash,
        tool_number: number,
        tool_description: plain(&path.tool.description),
        gauge_length: format!("{:.4}", path.tool.gauge_length),
        overcut: format!("{:.4}", path.overcut_tolerance),
        undercut: format!("{:.4}", path.undercut_tolerance),
        work_offset: request.work_offset,
        spindle: format!("{rpm}"),
        inch: options.units == LengthUnit::Inch,
        tcp: request.tcp,
        vectors,
        great_circle: request.setup.interpolation(request.tcp) == Interpolation::TipAndVector,
        tcp_on: tcp_on.map_or("", String::as_str),
        tcp_off: options.tcp_off.as_deref().unwrap_or_default(),
        switchable,
        length_on: if length && !length_on.is_empty() { format!("{length_on} H{number}") } else { String::new() },
        length_off: if length { length_off.clone() } else { String::new() },
        turn_feed: if switchable || options.tcp_limits_axes || !request.tcp {
            String::new()
        } else {
            let careful = request.setup.careful_turn().to_degrees() * 60.0;
            blocks.number(careful.min(options.max_feed).floor(), options.feed_digits)
        },
        feed_radius: blocks.number(options.feed_radius / unit_mm(options), options.linear_digits),
        per_minute: options.feed_mode == FeedMode::PerMinute,
        wrapped: machine.rotary.iter().any(|axis| axis.travel == Travel::Wrapped),
        letters: machine.rotary.iter().filter(|axis| axis.is_present()).map(|axis| axis.letter.to_string()).collect(),
        start_lines: &options.start_lines,
        retract_lines: &options.retract_lines,
        end_lines: &options.end_lines,
        approach: None,
    })
}
