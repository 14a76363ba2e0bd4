//! The machines that come along, as text inside the program. Uses `diagnostic`.

use super::model::Machine;
use crate::diagnostic::{Diagnostic, Result, nearest};

/// Name and text of every machine that comes along, in alphabetical order.
pub const BUILTIN: [(&str, &str); 14] = [
    ("bridgemill", include_str!("../../machines/bridgemill.toml")),
    ("dmg-dmu40-monoblock", include_str!("../../machines/dmg-dmu40-monoblock.toml")),
    ("dmg-dmu50-evolution", include_str!("../../machines/dmg-dmu50-evolution.toml")),
    ("dmg-dmu80p-duoblock", include_str!("../../machines/dmg-dmu80p-duoblock.toml")),
    ("four-axis-a", include_str!("../../machines/four-axis-a.toml")),
    ("haas-umc-750", include_str!("../../machines/haas-umc-750.toml")),
    ("head-b-table-c", include_str!("../../machines/head-b-table-c.toml")),
    ("huron-kx100", include_str!("../../machines/huron-kx100.toml")),
    ("mazak-variaxis-630", include_str!("../../machines/mazak-variaxis-630.toml")),
    ("pocket-nc-v2", include_str!("../../machines/pocket-nc-v2.toml")),
    ("tr-35", include_str!("../../machines/tr-35.toml")),
    ("trunnion-ac-30i", include_str!("../../machines/trunnion-ac-30i.toml")),
    ("xyzac-trt", include_str!("../../machines/xyzac-trt.toml")),
    ("xyzbc-trt", include_str!("../../machines/xyzbc-trt.toml")),
];

/// The text of a machine that comes along.
pub fn builtin(name: &str) -> Option<&'static str> {
    BUILTIN.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

impl Machine {
    /// A machine that comes along, by name.
    pub fn named(name: &str) -> Result<Self> {
        if let Some(text) = builtin(name) {
            return Self::read(&format!("machines/{name}.toml"), text);
        }
        let known = BUILTIN.map(|(known, _)| known);
        let meant = nearest(name, &known).map(|near| format!("did you mean {near}? ")).unwrap_or_default();
        Err(Diagnostic::error(format!("no machine is called \"{name}\"")).help(format!(
            "{meant}Write the path of a machine file, or one of the machines that come along: {}",
            known.join(", ")
        )))
    }
}
