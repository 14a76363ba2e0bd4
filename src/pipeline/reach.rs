//! The machine of a job as the bound that its plan keeps to.

use crate::diagnostic::Result;
use crate::geometry::Direction;
use crate::machine::{Machine, Setup, beyond};
use crate::plan::{AxisBound, AxisReach};

#[derive(Debug)]
struct MachineReach(Setup);

impl AxisReach for MachineReach {
    fn beyond(&self, axis: &Direction) -> f64 {
        beyond(&self.0, *axis).map_or(0.0, |(by, _)| by)
    }

    fn words(&self, axis: &Direction) -> String {
        beyond(&self.0, *axis).map_or_else(String::new, |(_, words)| words)
    }
}

/// Tool axis directions that a machine makes; no bound for machines without two rotary axes, which make so few that
/// only the course along them can tell.
pub(super) fn axis_bound(machine: &Machine) -> Result<Option<AxisBound>> {
    if machine.rotary.iter().any(|axis| !axis.is_present()) {
        return Ok(None);
    }
    // Directions do not depend on where the part stands, nor on how long the tool is.
    Ok(Some(AxisBound::new(MachineReach(Setup::at(machine, [0.0; 3], 0.0)?))))
}
