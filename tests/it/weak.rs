//! What the data leave open is named, with what it costs and what would help.
use crate::learning::{learn, nothing, record};
use handeye::calibrate::DeterminedBy;
use handeye::rig::{Ends, Length, Limits, Model, Rig};
use handeye::simulate::random_rig;
use nalgebra::Vector3;
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

/// One length measured to 1 % makes all of them as uncertain, and what it accounts for is just that.
#[test]
fn what_a_measured_length_accounts_for_is_its_share_of_the_way_to_the_tip() {
    for seed in 1..=3 {
        let truth = random_rig(6, 2, 12, seed);
        let between = Ends::new(["features.f0", "features.f7"]).unwrap();
        let xyz = |k: usize| Vector3::from(truth.features[k].xyz.unwrap());
        let length = (xyz(0) - xyz(7)).norm();
        let mut known = nothing(&truth);
        known.estimate.lengths = vec![Length { between, length, sd: 0.01 * length }];
        let recording = record(&truth, 40, seed);
        let learned = learn(&known, &recording).unwrap();
        let tip = learned.report.tip.unwrap();
        let (sources, model) = (tip.sources, Model::new(&learned.rig).unwrap());
        let base = learned.rig.robot.base.unwrap().translation;
        let joints = recording.samples.iter().flat_map(|sample| sample.joints.clone());
        let mut ways: Vec<f64> = joints.map(|joints| (model.tip(&joints).translation - base).norm()).collect();
        ways.sort_by(f64::total_cmp);
        let expected = 0.01 * ways[ways.len() / 2];
        println!("seed {seed}: {sources:?}, expected {expected}");
        assert!((sources.lengths / expected - 1.0).abs() < 1e-3, "seed {seed}: {sources:?}, expected {expected}");
        assert!((sources.whole() / tip.median - 1.0).abs() < 1e-12 && sources.data == tip.by_data, "{tip:?}");
        assert!(sources.data < 0.5 * sources.lengths, "{sources:?}");
        assert_eq!([sources.robot, sources.features], [0.0; 2]);
        assert!(tip.to_string().contains("by the lengths that were measured"), "{tip}");
    }
}
