//! Joints that slip.

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
