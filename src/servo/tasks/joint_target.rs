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
        let mut row = [0.0; 32];
        let n = arm.joints();
        for (i, (&target, &joint)) in self.joints.iter().zip(&at.joints).enumerate() {
            if target.is_nan() {
                continue;
            }
            // An arm of more joints than anybody has built takes an allocation.
            if n <= row.len() {
                row[i] = 1.0;
                rows.push(&row[..n], target - joint, self.sd);
                row[i] = 0.0;
            } else {
                let unit: Vec<f64> = (0..n).map(|k| if k == i { 1.0 } else { 0.0 }).collect();
                rows.push(&unit, target - joint, self.sd);
            }
        }
    }
}
