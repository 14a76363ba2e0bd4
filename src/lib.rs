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

pub mod diagnostic;

pub mod geometry;

pub mod part;

pub mod tool;

pub mod motion;

pub mod envelope;

pub mod optimize;

pub mod plan;

pub mod collide;

pub mod machine;

pub mod feed;

pub mod nc;

pub mod simulate;

pub mod verify;

pub mod report;

pub mod job;

pub mod pipeline;

pub mod cli;
