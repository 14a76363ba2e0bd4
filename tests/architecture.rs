//! The shape of the house, checked on the sources: who may use whom, who may touch files and clocks.

#[path = "architecture/source_tree.rs"]
mod source_tree;

use source_tree::SourceTree;
use std::path::Path;

/// Modules that judge a program and therefore must not know how it came about.
const JUDGES: [&str; 3] = ["simulate", "stock", "verify"];
/// What judges must not use, not even through others.
const PLANNING: [&str; 4] = ["plan", "optimize", "envelope", "feed"];
/// Modules that stand over the pure ones and may touch files and terminals.
const OUTER: [&str; 1] = ["cli"];
/// What no pure module may touch: files, clocks, environment, network, processes, terminals.
const IMPURE: [&str; 12] = [
    "std::fs",
    "std::time",
    "std::env",
    "std::net",
    "std::process",
    "std::io::stdin",
    "std::io::stdout",
    "std::io::stderr",
    "println!",
    "eprintln!",
    "Instant::now",
    "SystemTime",
];

fn sources() -> std::io::Result<SourceTree> {
    SourceTree::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"))
}

fn assert_none(findings: &[String]) {
    assert!(findings.is_empty(), "\n{}\n", findings.join("\n"));
}

/// Uses of a module that stands below the user in `lib.rs`.
fn against_the_order(tree: &SourceTree) -> Vec<String> {
    let order = tree.order();
    let rank = |module: &str| order.iter().position(|m| m == module);
    let mut findings = Vec::new();
    for file in tree.files().filter(|f| f.module() != "") {
        for used in tree.uses(file) {
            let Some(target) = used.first() else { continue };
            match (rank(file.module()), rank(target)) {
                (Some(own), Some(other)) if other > own => {
                    findings.push(format!("{} uses {}, which stands below it", file.name, used.join("::")));
                }
                (_, None) => findings.push(format!("{} uses {}, not a module of lib.rs", file.name, used.join("::"))),
                _ => {}
            }
        }
    }
    findings
}

/// Ways from a judge to the planning side or to the writing half of `nc`.
fn judges_that_know_the_plan(tree: &SourceTree) -> Vec<String> {
    let mut findings = Vec::new();
    for judge in tree.files().filter(|f| JUDGES.contains(&f.module())) {
        for (reached, way) in tree.reachable(judge) {
            if PLANNING.contains(&reached.module()) || reached.writes_programs() {
                findings.push(format!("{} reaches {} by {}", judge.name, reached.name, way.join(" -> ")));
            }
        }
    }
    findings
}

/// Circles between files other than those of a folder's own `mod.rs` with its children.
fn circles(tree: &SourceTree) -> Vec<String> {
    let mut findings = Vec::new();
    for file in tree.files() {
        for (reached, way) in tree.reachable(file) {
            let direct_back = tree.uses_file(reached, file);
            if direct_back && !file.is_parent_of(reached) && !reached.is_parent_of(file) && reached.name >= file.name {
                findings.push(format!("{} -> {}", way.join(" -> "), file.name));
            }
        }
    }
    findings
}

/// Lines of pure modules that touch the world outside.
fn impurities(tree: &SourceTree) -> Vec<String> {
    let pure = tree.files().filter(|f| !OUTER.contains(&f.module()) && f.name != "main.rs");
    pure.flat_map(|file| {
        let touched = IMPURE.iter().filter(|word| file.code.contains(*word));
        touched.map(|word| format!("{} uses {word}", file.name)).collect::<Vec<_>>()
    })
    .collect()
}

/// Uses of the collision library outside the one module that wraps it.
fn strangers_to_collide(tree: &SourceTree) -> Vec<String> {
    let others = tree.files().filter(|f| f.module() != "collide" && f.code.contains("parry3d"));
    others.map(|file| format!("{} uses parry", file.name)).collect()
}

#[test]
fn modules_use_only_those_above_them() {
    assert_none(&against_the_order(&sources().unwrap()));
}

#[test]
fn the_judges_know_nothing_of_the_plan() {
    assert_none(&judges_that_know_the_plan(&sources().unwrap()));
}

#[test]
fn no_circles_between_files() {
    assert_none(&circles(&sources().unwrap()));
}

#[test]
fn no_files_clocks_or_terminals_below_the_command_line() {
    assert_none(&impurities(&sources().unwrap()));
}

#[test]
fn only_collide_knows_the_collision_library() {
    assert_none(&strangers_to_collide(&sources().unwrap()));
}

#[test]
fn every_file_says_first_what_it_is_for() {
    let silent: Vec<_> =
        sources().unwrap().files().filter(|f| !f.text.starts_with("//! ")).map(|f| f.name.clone()).collect();
    assert_none(&silent);
}

#[test]
fn files_stay_short_enough_to_read() {
    let long = |f: &&source_tree::SourceFile| f.code.lines().filter(|l| !l.trim().is_empty()).count() > 500;
    let long: Vec<_> = sources().unwrap().files().filter(long).map(|f| format!("{} is too long", f.name)).collect();
    assert_none(&long);
}

/// A small tree that keeps the rules; each case below breaks one.
fn model() -> Vec<(&'static str, &'static str)> {
    vec![
        ("lib.rs", "pub mod geometry; pub mod plan; pub mod nc; pub mod simulate; pub mod cli;"),
        ("geometry/mod.rs", "pub mod knots; mod curve; pub use curve::Curve; pub struct Point;"),
        ("geometry/knots.rs", "pub struct Knots;"),
        ("geometry/curve.rs", "use super::{Point, knots::Knots}; pub struct Curve;"),
        ("plan/mod.rs", "use crate::geometry::{Curve, knots::Knots};"),
        ("nc/mod.rs", "mod read; mod write; pub use read::parse; pub use write::post;"),
        ("nc/read.rs", "use crate::geometry::Point; pub fn parse() {}"),
        ("nc/write.rs", "use crate::geometry::Point; pub fn post() {}"),
        ("simulate/mod.rs", "use crate::nc::parse;"),
        ("cli/mod.rs", "use crate::plan; use std::fs;"),
    ]
}

fn findings_with(name: &str, text: &str, check: fn(&SourceTree) -> Vec<String>) -> Vec<String> {
    let mut files = model();
    files.retain(|(n, _)| *n != name);
    assert!(check(&SourceTree::of(&files)).is_empty(), "the model itself keeps the rules");
    files.push((Box::leak(name.to_owned().into_boxed_str()), Box::leak(text.to_owned().into_boxed_str())));
    check(&SourceTree::of(&files))
}

#[test]
fn broken_rules_are_found() {
    for (name, text, check) in [
        ("plan/low.rs", "use crate::{geometry::Point, cli::run};", against_the_order as fn(&_) -> _),
        ("plan/low.rs", "fn f() { crate::cli::run() }", against_the_order),
        ("simulate/x.rs", "use crate::nc::{parse, post};", judges_that_know_the_plan),
        ("simulate/x.rs", "use crate::plan::Plan;", judges_that_know_the_plan),
        ("nc/read.rs", "use super::post; pub fn parse() {}", judges_that_know_the_plan),
        ("geometry/knots.rs", "use super::Curve; pub struct Knots;", circles),
        ("geometry/knots.rs", "use super::curve::Curve; pub struct Knots;", circles),
        ("plan/low.rs", "fn f() { std::fs::read(\"a\"); }", impurities),
        ("plan/low.rs", "use std::{collections::BTreeMap, time::Instant};", impurities),
        ("plan/low.rs", "use parry3d_f64::shape;", strangers_to_collide),
    ] {
        assert!(!findings_with(name, text, check).is_empty(), "{name}: {text}");
    }
}

#[test]
fn what_the_rules_allow_is_not_found() {
    for (name, text, check) in [
        ("plan/low.rs", "/// See [`crate::cli`].\nfn f() {}", against_the_order as fn(&_) -> _),
        ("plan/low.rs", "fn f() {}\n#[cfg(test)]\nmod tests { use crate::cli::run; }", against_the_order),
        ("geometry/knots.rs", "use super::Point; pub struct Knots;", circles),
        ("simulate/x.rs", "use crate::nc::parse;", judges_that_know_the_plan),
        ("plan/low.rs", "use std::{collections::BTreeMap, fmt};", impurities),
    ] {
        assert!(findings_with(name, text, check).is_empty(), "{name}: {text}");
    }
}
