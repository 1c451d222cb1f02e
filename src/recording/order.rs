//! Joints by their names.
use super::Recording;

impl Recording {
    /// Puts the joints into the order of `names`, where they have just these names in another one, and says whether they had.
    pub(super) fn order_joints(&mut self, names: &[String]) -> bool {
        if !is_in_another_order(&self.joints, names) {
            return false;
        }
        let place = |name: &String| self.joints.iter().position(|joint| joint == name).unwrap_or_default();
        let places: Vec<usize> = names.iter().map(place).collect();
        let ordered = |row: &Vec<f64>| places.iter().map(|place| row[*place]).collect::<Vec<f64>>();
        for sample in &mut self.samples {
            sample.joints = sample.joints.as_ref().map(ordered);
            sample.joint_action = sample.joint_action.as_ref().map(ordered);
        }
        self.joints = names.to_vec();
        true
    }
}

/// True where both lists hold the same names, which differ from each other, and not in the same order.
pub(crate) fn is_in_another_order(joints: &[String], names: &[String]) -> bool {
    let sorted = |names: &[String]| {
        let mut names = names.to_vec();
        names.sort();
        names
    };
    let sorted_names = sorted(names);
    joints != names && sorted(joints) == sorted_names && sorted_names.windows(2).all(|pair| pair[0] != pair[1])
}
