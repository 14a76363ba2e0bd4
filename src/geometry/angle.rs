//! Angles that say their unit.

/// An angle in degrees, as files and people write it.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Degrees(pub f64);

/// An angle in radians, as kinematics uses it.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Radians(pub f64);

impl From<Degrees> for Radians {
    fn from(angle: Degrees) -> Self {
        Self(angle.0.to_radians())
    }
}

impl From<Radians> for Degrees {
    fn from(angle: Radians) -> Self {
        Self(angle.0.to_degrees())
    }
}

impl Radians {
    /// Sine and cosine.
    pub fn sin_cos(self) -> (f64, f64) {
        self.0.sin_cos()
    }
}
