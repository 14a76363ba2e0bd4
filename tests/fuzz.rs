//! Reading and following programs made of broken ones: no panic, no hang, findings within bounds. Deterministic; a short run
//! by default, as many seconds as the environment variable `REGULUS_FUZZ_SECONDS` says otherwise.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(clippy::print_stderr, reason = "a long run says what it did")]

use regulus::machine::{Dialect, DialectOptions, Machine, Setup};
use regulus::nc::{Rules, read};
use regulus::simulate::{ToolReach, simulate};
use std::time::{Duration, Instant};

/// Programs tried in a short run, for each dialect.
const SHORT: usize = 400;
/// Longest that a program of some kilobytes may take.
const HANG: Duration = Duration::from_secs(5);
/// Pieces that programs are made of, whole blocks and fragments of all dialects.
const PIECES: &[&str] = &[
    "G21 G90 G17\n",
    "G20\n",
    "G91 ",
    "G0 X1. Y-2.5 Z30. A10. C-20.\n",
    "G1 X10.5 F300.\n",
    "G93 G1 Y3. F60.\n",
    "G2 X5. Y5. I2.5 J0.\n",
    "G3 X0. Y10. R-7. P3\n",
    "G18 ",
    "G19 ",
    "G43 H1\n",
    "G43.4 H1 ",
    "G43.5 I0. J0. K1. H1\n",
    "G49\n",
    "M428\n",
    "M429\n",
    "M68 E3 Q1\n",
    "T1 M6\n",
    "S8000 M3\n",
    "M5\n",
    "M30\n",
    "%\n",
    "/",
    "(",
    ")",
    ";",
    "N10 ",
    "G54\n",
    "G54.1 P5\n",
    "G28 Z0.\n",
    "G53 G0 Z0.\n",
    "G64 P0.01\n",
    "G61\n",
    "G4 P0.5\n",
    "G81 X1 Z-5 R2\n",
    "#1=2\n",
    "O100 sub\n",
    "TRAORI\n",
    "TRAFOOF\n",
    "ORIWKS\n",
    "A3=0.1 B3=-.2 C3=1\n",
    "C=DC(350) ",
    "CYCLE832(0.01)\n",
    "CYCLE832(0.01,3,0.2)\n",
    "5 CYCL DEF 32.1 T0.02\n6 CYCL DEF 32.2 HSC-MODE:0 TA0.5\n",
    "FGROUP(X,Y,A)\n",
    "FGREF[A]=10\n",
    "SUPA ",
    "D1\n",
    "MSG(\"x\")\n",
    "0 BEGIN PGM A MM\n",
    "END PGM A MM\n",
    "5 L X+1,5 IY-2 A+3 R0 FMAX M126\n",
    "LN X+1 Y+2 Z+3 NX+0 NY+0 NZ+1 TX+0.6 TY+0 TZ+0.8 F100\n",
    "M128 ",
    "M129\n",
    "FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR\n",
    "CC X+0 Y+0\n",
    "C X+3 Y+0 DR-\n",
    "CYCL DEF 247\n Q339=+1\n",
    "TOOL CALL 1 Z S100\n",
    "X",
    "Y1e5 ",
    "Z-.",
    "A",
    "..",
    "+-",
    "99999999999999999999",
    "1e400",
    "-0",
    "\u{feff}",
    "\r\n",
    "\t",
    "é",
    "\0",
    "~\n",
    "*",
    "=",
    "[",
    "]",
    "B-720 ",
    "C36000.\n",
    "F0\n",
    "F-1 ",
    "G169 H1\n",
    "G170\n",
    "G15 H2\n",
    "G234 H1\n",
    "G8.2 ",
    "G1000 ",
    "M9999 ",
    "X1000000. ",
    "I0 J0 K0\n",
];

/// Numbers that look random and are the same each time (Marsaglia, Xorshift RNGs, 2003).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }
}

/// A program of pieces, with bytes broken here and there.
fn program(numbers: &mut Numbers) -> Vec<u8> {
    let mut text: Vec<u8> = Vec::new();
    for _ in 0..1 + numbers.below(120) {
        text.extend_from_slice(PIECES[numbers.below(PIECES.len())].as_bytes());
    }
    for _ in 0..numbers.below(12) {
        let at = numbers.below(text.len());
        match numbers.below(4) {
            0 => text[at] = numbers.next() as u8,
            1 => drop(text.drain(at..(at + numbers.below(20)).min(text.len()))),
            2 => text.insert(at, b"0123456789.-XYZGM \n"[numbers.below(19)]),
            _ => text.truncate(at.max(1)),
        }
        if text.is_empty() {
            break;
        }
    }
    text
}

fn machines() -> Vec<Machine> {
    let made = Dialect::ALL.iter().enumerate().map(|(index, (dialect, _))| {
        let names = ["xyzac-trt", "huron-kx100", "head-b-table-c", "dmg-dmu50-evolution", "four-axis-a"];
        let mut machine = Machine::named(names[index % names.len()]).unwrap();
        (machine.control.dialect, machine.control.options) = (*dialect, DialectOptions::of(*dialect));
        machine
    });
    made.collect()
}

/// What this thread has computed for so far; where the system does not say, the time since the start. Another process that
/// takes the computer does not make a program hang.
fn busy(since: Instant) -> Duration {
    let said = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = said.as_ref().and_then(|text| text.split_whitespace().next()?.parse().ok());
    nanoseconds.map_or_else(|| since.elapsed(), Duration::from_nanos)
}

/// Reads and follows a text on a machine; twice where it took long, since the computer may have slept.
fn follow(machine: &Machine, text: &[u8]) {
    let slow = || {
        let since = Instant::now();
        let start = busy(since);
        follow_once(machine, text);
        busy(since).saturating_sub(start) >= HANG
    };
    assert!(!(slow() && slow()), "hangs for {:?}", String::from_utf8_lossy(text));
}

fn follow_once(machine: &Machine, text: &[u8]) {
    let setup = Setup::at(machine, [1.0, 2.0, 3.0], 100.0).unwrap();
    let motion = simulate(&read(text, &Rules::of(machine)), &setup, Some(1.into()));
    for segment in motion.segments() {
        assert!(segment.start.is_finite() && segment.duration.is_finite() && segment.duration >= 0.0, "{segment:?}");
        let pose = motion.pose(segment, 0.5);
        assert!(pose.tip.coords.norm().is_finite() && (pose.axis.norm() - 1.0).abs() < 1e-6, "{segment:?}");
    }
    let lines = text.iter().filter(|byte| **byte == b'\n').count() + 2;
    for finding in motion.findings().list() {
        assert!(finding.line <= lines && !finding.message.is_empty() && !finding.help.is_empty(), "{finding:?}");
        let shown = finding.diagnostic("fuzz", text).to_string();
        assert!(shown.contains(finding.code.id()), "{shown}");
    }
    let _report = motion.axis_report();
    let band = motion.blending_band(&ToolReach { heights: (0.0, 40.0), radius: 5.0 }, |_| 0.0);
    assert!(band.is_finite() && band >= motion.blending() && motion.rotary_blending().is_finite(), "{band}");
}

#[test]
fn broken_programs_are_read_and_followed_to_their_end() {
    let seconds = std::env::var("REGULUS_FUZZ_SECONDS").ok().and_then(|text| text.parse::<u64>().ok());
    let machines = machines();
    let mut numbers = Numbers(0x9e37_79b9_7f4a_7c15);
    let (start, mut count) = (Instant::now(), 0_usize);
    loop {
        let text = program(&mut numbers);
        for machine in &machines {
            let tried = std::panic::catch_unwind(|| follow(machine, &text));
            let dialect = machine.control.dialect.name();
            assert!(tried.is_ok(), "{dialect}, program {count}: {:?}", String::from_utf8_lossy(&text));
        }
        count += 1;
        let over = seconds.map_or(count >= SHORT, |seconds| start.elapsed().as_secs() >= seconds);
        if over {
            break;
        }
    }
    eprintln!("{count} programs in each of {} dialects", machines.len());
}

#[test]
fn one_endless_line_and_a_million_lines_take_no_more_than_they_hold() {
    for machine in machines() {
        follow(&machine, "X1.5 Y2 ".repeat(50_000).as_bytes());
        follow(&machine, "(".repeat(300_000).as_bytes());
        follow(&machine, "G1\n".repeat(200_000).as_bytes());
        follow(&machine, &[0xff; 300_000]);
    }
}
