//! What the data leave open is named, with what it costs and what would help.
use crate::learning::{learn, record};
use handeye::calibrate::DeterminedBy;
use handeye::rig::{Limits, Rig};
use handeye::simulate::random_rig;
use std::collections::BTreeMap;

/// Everything is given, and known to a hundredth; nothing but the images says more.
fn given(truth: &Rig) -> Rig {
    let mut rig = truth.clone();
    rig.estimate.prior = BTreeMap::from([("robot".to_owned(), 0.01), ("features".to_owned(), 0.01)]);
    rig
}

#[test]
fn the_scale_that_only_priors_give_is_told_apart_from_what_the_data_determine() {
    let truth = random_rig(6, 2, 12, 2);
    let report = learn(&given(&truth), &record(&truth, 40, 2)).unwrap().report;
    let tip = report.tip.unwrap();
    println!("tip: {:.3} mm, by the data {:.3} mm", 1e3 * tip.median, 1e3 * tip.by_data);
    assert!(tip.by_data < 0.5 * tip.median, "{tip:?}");
    let prior = report.weak.iter().filter(|weak| matches!(weak.determined_by, DeterminedBy::Prior(_)));
    let largest = prior.filter_map(|weak| weak.tip).fold(0.0, f64::max);
    // One of the combinations named accounts for most of it.
    assert!(largest > 0.3 * tip.median, "{largest} of {tip:?}");
    assert!(report.weak.iter().any(|weak| weak.cure.starts_with("measure the distance between features")));
}

#[test]
fn a_joint_that_hardly_moved_is_named() {
    let mut truth = random_rig(6, 2, 12, 4);
    let limits = Limits { lower: Some(0.3), upper: Some(0.3 + 1_f64.to_radians()), ..Limits::default() };
    truth.robot.joints[2].limits = limits;
    let report = learn(&given(&truth), &record(&truth, 40, 4)).unwrap().report;
    let words: Vec<String> = report.weak.iter().map(ToString::to_string).collect();
    assert!(words.iter().any(|words| words.contains("joint `j3` moved only")), "{words:#?}");
}
