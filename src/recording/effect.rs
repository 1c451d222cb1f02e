//! Options that say nothing of the files that are read.
use super::{Actions, Angles, Format, OpenOptions};

/// An option that is given and is nothing to any of the files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WithoutEffect {
    /// The field of [`OpenOptions`], [`super::BagOptions`] or [`super::TableOptions`]; `degrees` or `radians` in place of `angles`.
    pub option: &'static str,
    /// What it says something of: "a bag", "a table" or "a recording".
    pub of: &'static str,
}

impl OpenOptions {
    /// The first option that is nothing to files of any of these formats. What is known of cameras may be of images beside them, and is not looked at.
    pub fn without_effect(&self, formats: &[Format]) -> Option<WithoutEffect> {
        let has_bag = formats.contains(&Format::Bag);
        let has_table = formats.iter().any(|format| matches!(format, Format::Csv | Format::Parquet | Format::LeRobot));
        let of_any =
            [("joints", !self.joints.is_empty()), ("still", self.still), ("joint_delay", self.joint_delay.is_some())];
        let of_bags = [
            ("joint_topic", self.bag.joint_topic.is_some()),
            ("pose_topic", self.bag.pose_topic.is_some()),
            ("frames", self.bag.frames.is_some()),
            ("camera_topics", !self.bag.camera_topics.is_empty()),
            ("join", self.bag.join.is_some()),
        ];
        let of_tables = [
            ("degrees", matches!(self.table.angles, Angles::Degrees(_))),
            ("radians", self.table.angles == Angles::Radians),
            ("actions", self.table.actions != Actions::Unsaid),
            ("episodes", !self.table.episodes.is_empty()),
        ];
        let kinds = [
            ("a recording", !formats.is_empty(), &of_any[..]),
            ("a bag", has_bag, &of_bags),
            ("a table", has_table, &of_tables),
        ];
        kinds.into_iter().filter(|(_, is_read, _)| !is_read).find_map(|(of, _, options)| {
            let given = options.iter().find(|(_, is_given)| *is_given);
            given.map(|&(option, _)| WithoutEffect { option, of })
        })
    }
}
