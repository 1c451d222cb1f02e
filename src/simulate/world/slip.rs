//! Joints that slip.
use crate::Error;

/// A joint that slips between its motor and its link: the link jumps, and what the robot reads and commands is off by that from then on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slip {
    /// Index of the joint.
    pub joint: usize,
    /// How far the link jumps [rad or m].
    pub by: f64,
    /// When [s].
    pub at: f64,
}

impl Slip {
    /// That it is of one of `n` joints, and by and at numbers that may be.
    pub(super) fn check(&self, n: usize) -> Result<(), Error> {
        if self.joint >= n || !self.by.is_finite() || !(0.0..f64::INFINITY).contains(&self.at) {
            return Err(Error::Unusable(format!(
                "{self:?}: `joint` has to be one of {n}, counted from 0, `by` finite, and `at` 0 or more"
            )));
        }
        Ok(())
    }
}
