//! What the samples themselves show, without a model.
use super::Finding;
use crate::recording::Recording;

/// Share of samples that may repeat an earlier one before it is worth saying.
const REPEATED: f64 = 0.2;

/// Samples that repeat.
pub(super) fn findings(recording: &Recording) -> Vec<Finding> {
    let joints: Vec<_> = recording.samples.iter().filter_map(|sample| sample.joints.as_ref()).collect();
    let repeats = (0..joints.len()).filter(|&i| joints[..i].contains(&joints[i])).count();
    if (repeats as f64) <= REPEATED * joints.len() as f64 {
        return Vec::new();
    }
    vec![Finding {
        what: format!("{repeats} of {} samples repeat the joints of an earlier one", joints.len()),
        change: "record more varied positions".to_owned(),
    }]
}
