//! Joints by their names.
use super::Recording;
use super::same_joints::{Places, places, several};

impl Recording {
    /// Takes the joints that a rig calls so in its order, where the recording has all of them and not just so; what has to be said of it.
    ///
    /// Errors: in words, where several may be those of the rig.
    pub(super) fn take_joints(&mut self, of_rig: &[String]) -> Result<Vec<String>, String> {
        let places = match places(of_rig, &self.joints) {
            Places::Found(places) if !places.iter().copied().eq(0..self.joints.len()) => places,
            Places::Several(first) => return Err(format!("{}: take the others out", several(&first))),
            Places::Found(_) | Places::Missing => return Ok(Vec::new()),
        };
        let names: Vec<String> = places.iter().map(|place| self.joints[*place].clone()).collect();
        let taken = |row: &Vec<f64>| places.iter().map(|place| row[*place]).collect::<Vec<f64>>();
        for sample in &mut self.samples {
            sample.joints = sample.joints.as_ref().map(taken);
            sample.joint_action = sample.joint_action.as_ref().map(taken);
        }
        let before = std::mem::replace(&mut self.joints, names.clone());
        let order = (!places.is_sorted()).then(|| {
            let (ours, theirs) = (names.join(", "), before.join(", "));
            format!("joints are taken by their names, in the order of the rig: {ours}; the file has them in the order {theirs}")
        });
        Ok(order.into_iter().chain(note_on_others(&before, &names)).collect())
    }
}

/// What is said of joints that a file has beside those that are taken.
pub(super) fn note_on_others<'a>(all: impl IntoIterator<Item = &'a String>, taken: &[String]) -> Option<String> {
    let mut others: Vec<&str> = Vec::new();
    for name in all {
        if !taken.contains(name) && !others.contains(&name.as_str()) {
            others.push(name);
        }
    }
    let (taken, others_listed) = (taken.join(", "), others.join(", "));
    (!others.is_empty()).then(|| format!("joints that are left out: {others_listed}; those that are taken: {taken}"))
}

/// True where a recording's joints are those of a rig, and not in the same order.
pub(crate) fn is_in_another_order(joints: &[String], of_rig: &[String]) -> bool {
    matches!(places(of_rig, joints), Places::Found(places) if places.len() == joints.len() && !places.is_sorted())
}
