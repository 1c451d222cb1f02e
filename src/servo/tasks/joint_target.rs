//! Joints to given readings: a target, or as a task of low priority a posture.
use super::{Arm, Configuration, Task, TaskRows};

/// Brings joints to readings: q + Δq = target. Of low priority it is a posture, which an arm keeps as far as its other tasks allow.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointTarget {
    /// One reading per joint [rad or m].
    pub joints: Vec<f64>,
    /// Standard deviation of each [rad or m]; infinite where a joint may be anywhere.
    pub sd: Vec<f64>,
}

impl JointTarget {
    /// Every joint with one standard deviation.
    pub fn new(joints: Vec<f64>, sd: f64) -> Self {
        JointTarget { sd: vec![sd; joints.len()], joints }
    }
}

impl Task for JointTarget {
    fn rows(&self, arm: &Arm, at: &Configuration, rows: &mut TaskRows) {
        let n = arm.joints();
        let targets = self.joints.iter().zip(&self.sd).zip(&at.joints).enumerate();
        for (i, ((target, &sd), joint)) in targets.filter(|(_, ((_, sd), _))| sd.is_finite()) {
            rows.push((0..n).map(|k| if k == i { 1.0 } else { 0.0 }), target - joint, sd);
        }
    }
}
