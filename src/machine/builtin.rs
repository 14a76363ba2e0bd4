//! The machines that come along, as text inside the program. Uses `diagnostic`.

use super::model::Machine;
use crate::diagnostic::{Diagnostic, Result, nearest};

/// Name and text of every machine that comes along, in alphabetical order.
pub const BUILTIN: [(&str, &str); 5] = [
    ("bridgemill", include_str!("../../machines/bridgemill.toml")),
    ("head-b-table-c", include_str!("../../machines/head-b-table-c.toml")),
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
