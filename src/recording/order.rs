//! Joints by their names.
use super::Recording;

impl Recording {
    /// Takes the joints of these names in this order, where the recording has all of them and not just so; what has to be said of it.
    pub(super) fn take_joints(&mut self, names: &[String]) -> Vec<String> {
        let place = |name: &String| self.joints.iter().position(|joint| joint == name);
        let places: Option<Vec<usize>> = names.iter().map(place).collect();
        let Some(places) = places.filter(|_| !names.is_empty() && self.joints != names && are_different(names)) else {
            return Vec::new();
        };
        let taken = |row: &Vec<f64>| places.iter().map(|place| row[*place]).collect::<Vec<f64>>();
        for sample in &mut self.samples {
            sample.joints = sample.joints.as_ref().map(taken);
            sample.joint_action = sample.joint_action.as_ref().map(taken);
        }
        let before = std::mem::replace(&mut self.joints, names.to_vec());
        let order = (!places.is_sorted()).then(|| {
            let (ours, theirs) = (names.join(", "), before.join(", "));
            format!("joints are taken by their names, in the order of the rig: {ours}; the file has them in the order {theirs}")
        });
        order.into_iter().chain(note_on_others(&before, names)).collect()
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

/// True where both lists hold the same names, which differ from each other, and not in the same order.
pub(crate) fn is_in_another_order(joints: &[String], names: &[String]) -> bool {
    let sorted = |names: &[String]| {
        let mut names = names.to_vec();
        names.sort();
        names
    };
    joints != names && sorted(joints) == sorted(names) && are_different(names)
}

fn are_different(names: &[String]) -> bool {
    names.iter().enumerate().all(|(index, name)| !names[..index].contains(name))
}
