//! Good programs: the same path on every machine that comes along, in every dialect, unit, feed and place.

use crate::bench::{Form, form, inputs, judge_on, judged_path, posted};
use rayon::prelude::*;
use regulus::machine::{BUILTIN, Dialect};

/// Where parts stand: off centre, and high, for machines whose tables stand low.
const OFFSETS: [[f64; 3]; 2] = [[3.0, -4.0, 5.0], [-20.0, 15.0, 160.0]];

/// Every form that is tried: each machine with its own control, and two machines with every control.
fn forms() -> Vec<(Form, &'static str)> {
    let mut forms = Vec::new();
    // The limited axis of the TR-35 is followed as turning the shorter way.
    let own = BUILTIN.iter().map(|(machine, _)| (*machine, None)).filter(|(machine, _)| *machine != "tr-35");
    let every = |machine: &'static str| Dialect::ALL.iter().map(move |(dialect, _)| (machine, Some(*dialect)));
    for (machine, dialect) in own.chain(every("xyzbc-trt")).chain(every("trunnion-ac-30i")) {
        for (index, offset) in OFFSETS.into_iter().enumerate() {
            for [per_minute, inch, slow] in
                [[false; 3], [true, false, false], [false, true, true], [true, true, false], [true, false, true]]
            {
                let cut = if slow { "cut = 250.0" } else { "cut = 600.0" };
                // A second place need not be tried in every form.
                if index == 0 || !inch {
                    forms.push((Form { dialect, per_minute, inch, offset, ..form(machine) }, cut));
                }
            }
        }
    }
    forms
}

#[test]
fn good_programs_on_every_machine_and_control_are_accepted() {
    // Before the threads: what waits for them must not be waited for by them.
    let path = judged_path();
    let judged: Vec<_> = forms()
        .par_iter()
        .map(|(form, cut)| {
            let inputs = inputs(form, |job| job.replace("cut = 600.0", cut), |_| {});
            // Some machines do not reach some places.
            let text = posted(&inputs, path).ok()?;
            let judgement = judge_on(&inputs, &text);
            let good = judgement.as_ref().is_some_and(|judgement| judgement.passed && judgement.findings.is_empty());
            let said = judgement.map(|judgement| judgement.findings);
            Some((good, format!("{form:?} {cut}: {said:?}")))
        })
        .collect();
    let posted: Vec<_> = judged.into_iter().flatten().collect();
    let refused: Vec<&String> = posted.iter().filter(|(good, _)| !good).map(|(_, name)| name).collect();
    assert!(refused.is_empty(), "{} of {}: {refused:#?}", refused.len(), posted.len());
    assert!(posted.len() >= 200, "only {} programs", posted.len());
}
