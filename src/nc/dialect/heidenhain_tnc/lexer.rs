//! Cuts a Klartext program into words: `12 L X+10 Y-5.5 C+30 R0 F1000 M128`, `LN X Y Z TX TY TZ`, `TOOL CALL 1 Z S8000`.

use super::Keyword;
use crate::nc::block::{Blocks, WordMode, address};
use crate::nc::finding::FindingCode;
use crate::nc::number::decimal;
use crate::nc::scan::{Scanner, behind, behind_blanks, is_blank, name_length};

/// Cuts `text` into blocks.
pub(in crate::nc) fn lex(text: &[u8]) -> Blocks {
    let mut lexer = Klartext { scanner: Scanner::new(text), cycle: 0.0, kind: Kind::Other, arc: false };
    let (mut open, mut continued) = (false, false);
    while let Some(line) = lexer.scanner.next_line() {
        // The parameters of a cycle stand on lines of their own, without numbers.
        let parameter = lexer.kind == Kind::Cycle && behind_blanks(line).starts_with(b"Q");
        let rest = if open && (continued || parameter) {
            behind_blanks(line)
        } else {
            lexer.scanner.end_block();
            lexer.begin(line)
        };
        lexer.words(rest);
        open = true;
        continued = line.trim_ascii_end().ends_with(b"~");
        lexer.check_arc(continued);
    }
    lexer.scanner.end_block();
    lexer.scanner.finish()
}

/// What a block is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// L, LN, C, CR.
    Motion,
    /// CC.
    Centre,
    /// TOOL CALL.
    Tool,
    /// CYCL DEF.
    Cycle,
    Other,
}

struct Klartext<'a> {
    scanner: Scanner<'a>,
    /// Number of the cycle that the block defines.
    cycle: f64,
    kind: Kind,
    /// The block is an arc whose direction has not come yet.
    arc: bool,
}

impl<'a> Klartext<'a> {
    /// Begins a block: its number, then what it is. Returns the words behind.
    fn begin(&mut self, line: &'a [u8]) -> &'a [u8] {
        self.kind = Kind::Other;
        self.arc = false;
        let rest = self.scanner.begin_block(line);
        let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
        let rest = behind_blanks(behind(rest, digits));
        // The statement that most programs are made of.
        if let Some(words) = rest.strip_prefix(b"L ") {
            self.kind = Kind::Motion;
            self.scanner.keyword(Keyword::Line as usize, rest, words);
            return words;
        }
        self.statement(rest)
    }

    /// An arc whose direction does not come is no motion.
    fn check_arc(&mut self, continued: bool) {
        if self.arc && !continued {
            let message = "an arc needs its direction".to_owned();
            self.scanner.complain_about(&[], &[], FindingCode::BadArc, message, "write DR+ or DR-");
            self.scanner.drop_block();
        }
    }

    /// Reads the word that says what a block is.
    fn statement(&mut self, rest: &'a [u8]) -> &'a [u8] {
        if rest.first() == Some(&b'*') {
            return &[];
        }
        let length = rest.iter().take_while(|byte| byte.is_ascii_alphabetic()).count();
        let (name, after) = rest.split_at(length);
        let separate = after.first().is_none_or(|byte| is_blank(*byte) || *byte == b'~');
        if !separate {
            return rest;
        }
        let motion = |lexer: &mut Self, keyword: Option<Keyword>| {
            lexer.kind = Kind::Motion;
            match keyword {
                Some(keyword) => lexer.scanner.keyword(keyword as usize, rest, after),
                None => lexer.arc = true,
            }
            after
        };
        match name {
            b"L" => motion(self, Some(Keyword::Line)),
            b"LN" => motion(self, Some(Keyword::VectorLine)),
            b"C" | b"CR" => motion(self, None),
            b"CC" => {
                self.kind = Kind::Centre;
                self.scanner.keyword(Keyword::CircleCentre as usize, rest, after);
                after
            }
            b"TOOL" => self.tool(rest, behind_blanks(after)),
            b"CYCL" => self.cycle(rest, behind_blanks(after)),
            b"BEGIN" => self.begin_program(rest, after),
            b"END" => {
                self.scanner.close("END PGM");
                &[]
            }
            b"FUNCTION" => self.function(rest, after),
            b"PLANE" if behind_blanks(after).starts_with(b"RESET") => &[],
            b"BLK" | b"LBL" => &[],
            b"STOP" => after,
            b"PLANE" | b"CALL" | b"FN" | b"CT" | b"CP" | b"CTP" | b"LP" | b"LT" | b"LCT" | b"APPR" | b"DEP"
            | b"CHF" | b"RND" | b"FPOL" | b"FL" | b"FC" | b"FLT" | b"FCT" | b"SEL" | b"PATTERN" | b"TCH" | b"TRANS" => {
                self.not_followed(rest)
            }
            _ => rest,
        }
    }

    /// The rest of the line is known and not followed.
    fn not_followed(&mut self, rest: &'a [u8]) -> &'a [u8] {
        let text = rest.trim_ascii_end();
        let shown = String::from_utf8_lossy(text.get(..text.len().min(40)).unwrap_or_default()).into_owned();
        let message = format!("\"{shown}\" is not followed here: what it does to the motion is not known");
        let help = "post the program without it";
        self.scanner.complain_about(rest, &[], FindingCode::UnsupportedCode, message, help);
        &[]
    }

    /// `TOOL CALL 1 Z S8000`, `TOOL DEF 2`.
    fn tool(&mut self, rest: &'a [u8], what: &'a [u8]) -> &'a [u8] {
        let Some(call) = what.strip_prefix(b"CALL") else { return &[] };
        self.kind = Kind::Tool;
        let call = behind_blanks(call);
        let after = if call.first() == Some(&b'"') {
            let length = call.iter().skip(1).position(|byte| *byte == b'"').map_or(call.len(), |end| end + 2);
            behind(call, length)
        } else if let Ok((after, number)) = decimal(call, false, true) {
            self.scanner.word(b'T', number, WordMode::Plain, call, after);
            after
        } else {
            // Only its speed changes.
            return call;
        };
        self.scanner.keyword(Keyword::ToolCall as usize, rest, after);
        after
    }

    /// `CYCL DEF 247 DATUM SETTING ~`, `CYCL DEF 7.1 X+0`, `CYCL DEF 32.1 T0.01`,
    /// `CYCL DEF 32.2 HSC-MODE:0 TA0.5`.
    fn cycle(&mut self, rest: &'a [u8], what: &'a [u8]) -> &'a [u8] {
        let number = what.strip_prefix(b"DEF").and_then(|number| decimal(behind_blanks(number), false, true).ok());
        let Some((after, number)) = number else { return self.not_followed(rest) };
        self.kind = Kind::Cycle;
        self.cycle = number.value;
        let value = behind_blanks(after);
        let is_zero = || {
            let axis = value.iter().take_while(|byte| byte.is_ascii_alphabetic()).count();
            decimal(behind(value, axis), false, true).is_ok_and(|(_, number)| number.value == 0.0)
        };
        match (number.value.trunc() as i64, number.decimals) {
            (247, 0) => self.scanner.keyword(Keyword::Preset as usize, rest, after),
            (32, _) if number.value > 32.05 && number.value < 32.15 => {
                if let Some((end, tolerance)) = value.strip_prefix(b"T").and_then(|t| decimal(t, false, true).ok()) {
                    self.scanner.keyword(Keyword::Tolerance as usize, rest, end);
                    self.scanner.word(b'P', tolerance, WordMode::Plain, value, end);
                }
            }
            (32, _) if number.value > 32.15 && number.value < 32.25 => {
                let rotary = value.split(|byte| is_blank(*byte)).find_map(|part| {
                    let (end, rotary) = decimal(part.strip_prefix(b"TA")?, false, true).ok()?;
                    Some((part, end, rotary))
                });
                if let Some((part, end, rotary)) = rotary {
                    self.scanner.keyword(Keyword::Tolerance as usize, rest, part);
                    self.scanner.word(b'Q', rotary, WordMode::Plain, part, end);
                }
            }
            // Headings, the rest of the tolerance cycle, a dwell.
            (7 | 10, 1) if number.value.fract() == 0.0 => {}
            (32 | 9, _) => {}
            // A shift or a turn by nothing ends one.
            (7 | 10, _) if is_zero() => {}
            _ => return self.not_followed(rest),
        }
        &[]
    }

    /// `BEGIN PGM NAME MM`.
    fn begin_program(&mut self, rest: &'a [u8], after: &'a [u8]) -> &'a [u8] {
        let unit = after.trim_ascii_end().rsplit(|byte| is_blank(*byte)).next().unwrap_or_default();
        match unit {
            b"MM" => self.scanner.keyword(Keyword::Mm as usize, rest, &[]),
            b"INCH" | b"IN" => self.scanner.keyword(Keyword::Inch as usize, rest, &[]),
            _ => {
                let message = "a program's first block ends with its units".to_owned();
                self.scanner.complain_about(rest, &[], FindingCode::UnreadableText, message, "write MM or INCH");
            }
        }
        &[]
    }

    /// `FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS`, `FUNCTION RESET TCPM`.
    fn function(&mut self, rest: &'a [u8], after: &'a [u8]) -> &'a [u8] {
        let mut parts = after.split(|byte| is_blank(*byte)).filter(|part| !part.is_empty());
        let mut keyword = Keyword::TcpmAxis;
        match (parts.next(), parts.next()) {
            (Some(b"RESET"), Some(b"TCPM")) => keyword = Keyword::TcpmReset,
            (Some(b"TCPM"), Some(b"F")) => {
                let mut before: &[u8] = b"F";
                for part in parts {
                    match (before, part) {
                        (b"F", b"TCP") | (b"AXIS", b"POS") | (b"PATHCTRL", b"AXIS") | (b"REFPNT", b"TIP-TIP") => {}
                        (b"PATHCTRL", b"VECTOR") => keyword = Keyword::TcpmVector,
                        (_, b"F" | b"AXIS" | b"PATHCTRL" | b"REFPNT") => {}
                        // The largest feed of the compensation.
                        (_, part) if part.first() == Some(&b'F') => {}
                        _ => return self.not_followed(rest),
                    }
                    before = part;
                }
            }
            _ => return self.not_followed(rest),
        }
        self.scanner.keyword(keyword as usize, rest, &[]);
        &[]
    }

    /// Reads the words behind the statement.
    fn words(&mut self, mut rest: &'a [u8]) {
        while let Some(byte) = rest.first() {
            rest = match byte {
                byte if is_blank(*byte) => behind_blanks(rest),
                b'A'..=b'Z' => self.word(rest),
                b';' | b'~' => &[],
                _ => self.scanner.unreadable(rest),
            };
        }
    }

    fn word(&mut self, rest: &'a [u8]) -> &'a [u8] {
        let second = rest.get(1).copied().unwrap_or(b' ');
        match (rest.first().copied().unwrap_or(b' '), second) {
            (letter @ (b'X'..=b'Z' | b'A'..=b'C' | b'M' | b'S' | b'F'), b'+' | b'-' | b'.' | b'0'..=b'9') => {
                self.number(rest, 1, letter, WordMode::Plain)
            }
            (b'F', b'M') if rest.starts_with(b"FMAX") => {
                let after = behind(rest, 4);
                if self.kind == Kind::Motion {
                    self.scanner.keyword(Keyword::Rapid as usize, rest, after);
                }
                after
            }
            (b'R', b'0' | b'L' | b'R') => self.radius_correction(rest),
            (b'R', _) => self.number(rest, 1, b'R', WordMode::Plain),
            (b'I', letter @ (b'X'..=b'Z' | b'A'..=b'C')) => self.number(rest, 2, letter, WordMode::Incremental),
            (b'T', letter @ b'X'..=b'Z') => {
                self.number(rest, 2, address::VECTOR[usize::from(letter - b'X')], WordMode::Plain)
            }
            // The normal of the surface moves nothing.
            (b'N', b'X'..=b'Z') => decimal(behind(rest, 2), false, true).map_or(&[], |(after, _)| after),
            (b'D', b'R') if self.kind == Kind::Motion => self.direction(rest),
            (b'Q', b'0'..=b'9') if self.kind == Kind::Cycle => self.parameter(rest),
            // The tool axis, and what the tool differs by from its table.
            (b'X'..=b'Z' | b'D', _) if self.kind == Kind::Tool => {
                behind(rest, rest.iter().take_while(|byte| !is_blank(**byte)).count())
            }
            // M140 MB MAX and the like: parameters of a code that is not followed.
            (b'M', b'B') => {
                let value = behind_blanks(behind(rest, 2));
                behind(value, value.iter().take_while(|byte| !is_blank(**byte)).count())
            }
            _ if rest.starts_with(b"STOP") => {
                let after = behind(rest, 4);
                let zero = crate::nc::number::Decimal { value: 0.0, point: false, decimals: 0 };
                self.scanner.word(b'M', zero, WordMode::Plain, rest, after);
                after
            }
            _ => self.scanner.unreadable(rest),
        }
    }

    /// An address of `length` letters with its number.
    fn number(&mut self, rest: &'a [u8], length: usize, letter: u8, mode: WordMode) -> &'a [u8] {
        let Ok((after, number)) = decimal(behind(rest, length), false, true) else {
            return self.scanner.unreadable(rest);
        };
        // Behind M128 alone it is the largest feed of the compensation.
        if letter != b'F' || self.kind == Kind::Motion {
            self.scanner.word(letter, number, mode, rest, after);
        }
        after
    }

    /// `R0` corrects nothing; `RL` and `RR` move the path by the tool radius.
    fn radius_correction(&mut self, rest: &'a [u8]) -> &'a [u8] {
        let after = behind(rest, 2);
        match name_length(rest) {
            2 if rest.starts_with(b"R0") => after,
            2 => {
                let message = "tool radius compensation is not followed here".to_owned();
                let help = "post the path of the tool's centre, with R0";
                self.scanner.complain_about(rest, after, FindingCode::UnsupportedCode, message, help);
                after
            }
            _ => self.number(rest, 1, b'R', WordMode::Plain),
        }
    }

    /// `DR+`, `DR-`.
    fn direction(&mut self, rest: &'a [u8]) -> &'a [u8] {
        let after = behind(rest, 3);
        match rest.get(2) {
            Some(b'+') => self.scanner.keyword(Keyword::Counterclockwise as usize, rest, after),
            Some(b'-') => self.scanner.keyword(Keyword::Clockwise as usize, rest, after),
            _ => return self.scanner.unreadable(rest),
        }
        self.arc = false;
        after
    }

    /// `Q339=+1` of a cycle.
    fn parameter(&mut self, rest: &'a [u8]) -> &'a [u8] {
        let name = name_length(rest);
        let value = behind_blanks(behind(rest, name)).strip_prefix(b"=").map(behind_blanks);
        let Some(Ok((after, number))) = value.map(|value| decimal(value, false, true)) else {
            return self.scanner.unreadable(rest);
        };
        if self.cycle == 247.0 && rest.starts_with(b"Q339") {
            self.scanner.word(b'Q', number, WordMode::Plain, rest, after);
        }
        after
    }
}
