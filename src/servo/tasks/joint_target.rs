//! Joints to given readings: a target, or as a task of low priority a posture.
use super::{Arm, Configuration, Task, TaskRows};

/// Brings joints to readings: q + Δq = target.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointTarget {
    /// One reading per joint [rad or m]; NaN where a joint may be anywhere.
    pub joints: Vec<f64>,
    /// Standard deviation of each [rad or m].
    pub sd: f64,
}

impl Task for JointTarget {
    fn rows(&self, arm: &Arm, at: &Configuration, rows: &mut TaskRows) {
        let n = arm.joints();
        let known = self.joints.iter().zip(&at.joints).take(n).enumerate().filter(|(_, (target, _))| !target.is_nan());
        for (i, (target, joint)) in known {
            rows.push((0..n).map(|k| if k == i { 1.0 } else { 0.0 }), target - joint, self.sd);
        }
    }
}
