//! Trackers that fail.

/// What goes wrong with a tracker, and when.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// Index of the camera in the rig.
    pub camera: usize,
    /// Index of the feature in the rig.
    pub feature: usize,
    /// What.
    pub kind: FaultKind,
    /// When it begins [s].
    pub from: f64,
    /// When it ends [s]; infinite for good.
    pub until: f64,
}

/// How a tracker fails.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// Nothing is reported.
    Lost,
    /// What was reported last is reported again.
    Frozen,
    /// What is reported is off by this [px].
    Jumped([f64; 2]),
    /// What is reported moves away this fast [px/s].
    Drifting([f64; 2]),
}

impl Fault {
    /// What is reported in place of a pixel that would be; `before`: what was reported last, if anything was.
    pub(super) fn report(&self, pixel: [f64; 2], before: Option<[f64; 2]>, time: f64) -> Option<[f64; 2]> {
        if !(self.from..self.until).contains(&time) {
            return Some(pixel);
        }
        let off = |by: [f64; 2], times: f64| Some([pixel[0] + by[0] * times, pixel[1] + by[1] * times]);
        match self.kind {
            FaultKind::Lost => None,
            FaultKind::Frozen => before.or(Some(pixel)),
            FaultKind::Jumped(by) => off(by, 1.0),
            FaultKind::Drifting(speed) => off(speed, time - self.from),
        }
    }
}
