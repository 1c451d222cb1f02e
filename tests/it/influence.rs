//! The influence of a sample is what leaving it out does.
use crate::learning::{learn, record};
use handeye::calibrate::{Influence, Options, calibrate, most_influential, worst_fitting};
use handeye::recording::Recording;
use handeye::rig::{Model, Rig};
use handeye::simulate::random_rig;
use std::ops::ControlFlow;

fn influence(rig: &Rig, recording: &Recording) -> Vec<Influence> {
    let options = Options { influence: true, ..Options::default() };
    calibrate(rig, recording, &options, &mut |_| ControlFlow::Continue(())).unwrap().report.influence
}

/// A rig whose cameras are held where they are: everything else is refined.
fn start(truth: &Rig) -> Rig {
    let mut rig = truth.clone();
    rig.estimate.fixed = ["robot.base", "cameras", "robot.joints.j1.offset", "robot.joints.j1.d", "robot.joints.j6"]
        .map(str::to_owned)
        .into();
    rig
}

fn tips(rig: &Rig, recording: &Recording) -> Vec<nalgebra::Vector3<f64>> {
    let model = Model::new(rig).unwrap();
    recording.samples.iter().map(|sample| model.tip(sample.joints.as_ref().unwrap()).translation).collect()
}

#[test]
fn one_step_agrees_with_fitting_again_without_the_sample() {
    let truth = random_rig(6, 2, 12, 5);
    let recording = record(&truth, 25, 5);
    let rig = start(&truth);
    let all = influence(&rig, &recording);
    assert_eq!(all.len(), 25);
    let with = tips(&learn(&rig, &recording).unwrap().rig, &recording);
    let mut ratios = Vec::new();
    for one in &all {
        let mut fewer = recording.clone();
        fewer.samples.remove(one.sample);
        let without = tips(&learn(&rig, &fewer).unwrap().rig, &recording);
        let square: f64 = with.iter().zip(&without).map(|(a, b)| (a - b).norm_squared()).sum();
        ratios.push(one.tip.unwrap() / (square / with.len() as f64).sqrt());
    }
    ratios.sort_by(f64::total_cmp);
    println!("influence over refit: {:.3} {:.3} {:.3}", ratios[0], ratios[12], ratios[24]);
    // The fit's loss lets the outermost detections pull a little less than the step does.
    assert!((0.9..1.1).contains(&ratios[12]) && ratios[0] > 0.8 && ratios[24] < 1.25, "{ratios:?}");
}

#[test]
fn the_order_of_samples_changes_nothing() {
    let truth = random_rig(6, 2, 12, 6);
    let recording = record(&truth, 20, 6);
    let mut reversed = recording.clone();
    reversed.samples.reverse();
    let (one, other) = (influence(&start(&truth), &recording), influence(&start(&truth), &reversed));
    for (a, b) in one.iter().zip(other.iter().rev()) {
        assert_eq!(a.sample, 19 - b.sample);
        assert!((a.tip.unwrap() / b.tip.unwrap() - 1.0).abs() < 1e-3, "{a:?} {b:?}");
        assert!((a.rms_px - b.rms_px).abs() < 1e-4, "{a:?} {b:?}");
    }
}

#[test]
fn a_slightly_wrong_sample_is_on_top_of_both_lists() {
    let truth = random_rig(6, 2, 12, 7);
    let mut recording = record(&truth, 30, 7);
    // 3 standard deviations along u: too little for any detection to be left out, far too much for a whole sample.
    for detection in &mut recording.samples[11].pixels {
        detection.pixel[0] += 3.0 * truth.noise.pixels;
    }
    let all = influence(&start(&truth), &recording);
    assert_eq!(worst_fitting(&all, 10)[0].sample, 11);
    assert!(most_influential(&all, 3).iter().any(|one| one.sample == 11), "{:?}", most_influential(&all, 10));
    assert_eq!(most_influential(&all, 10).len(), 10);
}

#[test]
fn any_number_of_threads_finds_the_same_to_the_last_bit() {
    let mut truth = random_rig(6, 2, 12, 8);
    truth.noise.joints = 0.002;
    let recording = record(&truth, 60, 8);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| influence(&start(&truth), &recording))
    };
    let one = with(1);
    assert!(one.iter().all(|one| one.tip.unwrap() > 0.0));
    assert!(one == with(2) && one == with(5));
}
