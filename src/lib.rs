//! `regulus` plans 5-axis flank milling, writes the NC program for a real machine, reads that program back and
//! proves from its text what the swept tool leaves of the part.
//!
//! ```text
//! job ─► part ─► plan ─► tool path ─► machine (inverse kinematics) ─► feed ─► nc (post) ─► program text
//!                                                                                             │
//!   report ◄─ verify (swept tool against part) ◄─ simulate (forward kinematics) ◄─ nc (parse) ◄┘
//! ```
//!
//! The lower row never sees what the planner meant: it starts from the program's text. Modules are listed in the order
//! in which they may use each other; a module uses those above it, never those below.
//!
//! Nothing below [`cli`] touches files, clocks or terminals: bytes and text go in, values and text come out. A whole
//! job, from its text to the verdict on its program:
//!
//! ```
//! use regulus::job::Job;
//! use regulus::machine::Machine;
//! use regulus::pipeline::{InputFile, Inputs, Judging, PartFiles, judge, plan, post_job};
//! use regulus::verify::Verdict;
//!
//! // A patch of 40 mm x 10 mm, twisted a little; its normal, Su x Sv, points to the tool.
//! let part = br#"{"format": "regulus-bspline", "version": 1, "units": "mm", "degree": [1, 1],
//!     "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1], "flip": false,
//!     "control": [[[0, 0, 0], [0, 0, 10]], [[40, 0, 0], [40, 0.5, 10]]]}"#;
//! let job = r#"
//!     format = "regulus-job"
//!     version = 1
//!     name = "patch"
//!     [part]
//!     file = "patch.json"
//!     tolerance = { overcut = 0.01, undercut = 0.02 }
//!     [tool]
//!     number = 1
//!     kind = "cylinder"
//!     diameter = 8.0
//!     flute_length = 20.0
//!     gauge_length = 80.0
//!     [strategy]
//!     kind = "single-sweep"
//!     direction = [1.0, 0.0, 0.0]
//!     [machine]
//!     file = "xyzac-trt"
//!     [feed]
//!     cut = 600.0
//!     spindle = 8000
//! "#;
//!
//! let job = Job::read(job, "job.toml")?;
//! let machine = Machine::named("xyzac-trt").map_err(|e| vec![*e])?;
//! let part = InputFile { name: "patch.json", bytes: part };
//! let inputs = Inputs::read(job, &PartFiles::alone(part), &machine, "")?;
//!
//! let planned = plan(&inputs).map_err(|e| vec![*e])?;
//! let program = post_job(&inputs, &planned.path).map_err(|e| vec![*e])?.text;
//! assert!(program.contains("G93"));
//!
//! // From here on only the text counts.
//! let text = InputFile { name: "program.ngc", bytes: program.as_bytes() };
//! let judged = judge(&inputs, text, Some(&planned.path), &Judging::default())?;
//! assert_eq!(judged.verified.record.verdict, Verdict::Pass);
//! assert!(judged.verified.record.deviation.overcut_max_mm <= 0.01);
//! # Ok::<(), Vec<regulus::diagnostic::Diagnostic>>(())
//! ```

pub mod diagnostic;

pub mod geometry;

pub mod part;

pub mod tool;

pub mod motion;

pub mod envelope;

pub mod optimize;

pub mod collide;

pub mod plan;

pub mod machine;

pub mod feed;

pub mod nc;

pub mod simulate;

pub mod stock;

pub mod verify;

pub mod report;

pub mod job;

pub mod pipeline;

pub mod cli;
