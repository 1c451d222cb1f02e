//! Features to pixels.
use super::{Arm, Configuration, Task, TaskRows};
use crate::infer::Sighting;

/// Brings features to pixels, in any number of cameras: π(q) + J Δq = target.
///
/// Where the features are seen now is predicted by the rig, or taken from `seen`, which corrects a rig that is off.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImagePoints {
    /// Where the features shall be [px]; those that are not of the rig are passed over.
    pub targets: Vec<Sighting>,
    /// Where features are seen now [px]; of those not among them, the rig's prediction is taken.
    pub seen: Vec<Sighting>,
    /// Standard deviation of a pixel coordinate [px]: the weight beside other tasks.
    pub sd: f64,
}

impl Task for ImagePoints {
    fn rows(&self, arm: &Arm, at: &Configuration, rows: &mut TaskRows) {
        for target in &self.targets {
            let Some(sight) = arm.sight(at, target) else { continue };
            let same = |seen: &&Sighting| (seen.camera, seen.feature) == (target.camera, target.feature);
            let seen = self.seen.iter().find(same);
            for axis in 0..2 {
                let error = seen.map_or(sight.error[axis], |seen| seen.pixel[axis] - target.pixel[axis]);
                rows.push(sight.slopes(axis), -error, self.sd);
            }
        }
    }
}
