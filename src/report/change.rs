//! A stretch of a recording of which nothing fits: something was moved, rather than read wrongly.
use crate::calibrate::Finding;

/// Samples that are no chance, and how many of a stretch must be wrong.
const LEAST: usize = 4;
const SHARE: f64 = 0.8;

/// When, in words, such as "From sample 24 on"; `None` where there is no such stretch. `judged`: the samples of which anything could be compared,
/// in order.
pub(super) fn when(judged: &[usize], findings: &[Finding]) -> Option<String> {
    let wrong: Vec<usize> =
        findings.iter().filter_map(sample_of).filter(|sample| judged.binary_search(sample).is_ok()).collect();
    let (first, last) = (*wrong.iter().min()?, *wrong.iter().max()?);
    let stretch = judged.iter().filter(|sample| (first..=last).contains(sample)).count();
    if wrong.len() < LEAST || (wrong.len() as f64) < SHARE * stretch as f64 {
        return None;
    }
    Some(match (judged.first() == Some(&first), judged.last() == Some(&last)) {
        (_, true) => format!("From sample {first} on"),
        (true, false) => format!("Up to sample {last}"),
        (false, false) => format!("From sample {first} to sample {last}"),
    })
}

/// A sample of which no image fits and no other's does either.
pub(super) fn sample_of(finding: &Finding) -> Option<usize> {
    match finding {
        Finding::WrongJoints { sample, swapped_with: None, .. } => Some(*sample),
        _ => None,
    }
}

/// What was moved, and what to do, where `seeing` are the cameras that saw anything.
pub(super) fn words(when: &str, seeing: &[&str]) -> String {
    if let [camera] = seeing {
        return format!(
            "{when} nothing is seen where the rest of the samples has it: camera `{camera}`, the base or the features were moved, or the joints \
             count from elsewhere. `handeye calibrate --relearn cameras.{camera}` learns the camera anew from the samples of its new place \
             (robot.base or features where those were moved)."
        );
    }
    format!(
        "{when} no camera sees anything where the rest of the samples has it: the base, a joint or the features were moved. `handeye monitor` \
         tells which, and `handeye calibrate --relearn` learns that part anew from the samples of its new place."
    )
}
