//! Features to pixels.
use super::{Arm, Configuration, Task, TaskRows};
use crate::infer::Sighting;
use std::cell::RefCell;

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

thread_local! {
    /// Two rows, kept so that none but a thread's first step allocates.
    static ROWS: RefCell<[Vec<f64>; 2]> = RefCell::default();
}

impl Task for ImagePoints {
    fn rows(&self, arm: &Arm, at: &Configuration, rows: &mut TaskRows) {
        ROWS.with_borrow_mut(|[first, second]| {
            first.resize(arm.joints(), 0.0);
            second.resize(arm.joints(), 0.0);
            for target in &self.targets {
                let Some(mut error) = arm.pixel_rows(at, target, [first, second]) else { continue };
                let same = |seen: &&Sighting| (seen.camera, seen.feature) == (target.camera, target.feature);
                if let Some(seen) = self.seen.iter().find(same) {
                    error = [seen.pixel[0] - target.pixel[0], seen.pixel[1] - target.pixel[1]];
                }
                rows.push(first, -error[0], self.sd);
                rows.push(second, -error[1], self.sd);
            }
        });
    }
}
