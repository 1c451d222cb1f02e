//! A part of a learned rig is learned anew from a few samples, wherever it was before, and everything else stays.
use crate::learning::record;
use handeye::Error;
use handeye::calibrate::{Options, evaluate, relearn};
use handeye::recording::Recording;
use handeye::rig::Rig;
use handeye::simulate::random_rig;
use handeye::solvers::Pose;
use std::ops::ControlFlow;

const DRAWS: u64 = 15;

fn again(rig: &Rig, recording: &Recording, paths: &[&str]) -> Result<Rig, Error> {
    let paths: Vec<String> = paths.iter().map(|&path| path.to_owned()).collect();
    relearn(rig, recording, &paths, &Options::default(), &mut |_| ControlFlow::Continue(())).map(|learned| learned.rig)
}

/// Median factor over the floor on fresh samples; a draw that fails counts as infinite.
fn factor(samples: usize, paths: &[&str], spoil: impl Fn(&mut Rig)) -> f64 {
    let draw = |seed: u64| {
        let truth = random_rig(6, 2, 12, seed);
        let mut rig = truth.clone();
        spoil(&mut rig);
        let Ok(learned) = again(&rig, &record(&truth, samples, seed), paths) else { return f64::INFINITY };
        let judged = evaluate(&learned, &record(&truth, 100, seed + 10_000)).expect("the learned rig is complete");
        judged.total.rms_px / (truth.noise.pixels * 2.0_f64.sqrt())
    };
    let mut factors: Vec<f64> = (1..=DRAWS).map(draw).collect();
    factors.sort_by(f64::total_cmp);
    factors[factors.len() / 2]
}

/// Puts a camera where it certainly is not, with intrinsics 3 % off.
fn misplace_camera(rig: &mut Rig) {
    let camera = &mut rig.cameras[0];
    camera.pose = Some(Pose::identity());
    (camera.fx, camera.fy) = (camera.fx.map(|f| 1.03 * f), camera.fy.map(|f| 0.98 * f));
}

#[test]
fn a_camera_needs_two_samples_and_five_do_well() {
    let of = |samples| factor(samples, &["cameras.cam1"], misplace_camera);
    let (two, five) = (of(2), of(5));
    assert!(two <= 3.2 && five <= 1.3, "{two} times the floor from 2 samples, {five} from 5");
}

#[test]
fn structure_needs_two_samples() {
    let factor = factor(2, &["features"], |rig| rig.features.iter_mut().for_each(|f| f.xyz = Some([9.0, 9.0, 9.0])));
    assert!(factor <= 1.3, "{factor} times the floor");
}

#[test]
fn a_base_needs_three_samples() {
    let factor = factor(3, &["robot.base"], |rig| rig.robot.base = Some(Pose::identity()));
    assert!(factor <= 1.12, "{factor} times the floor");
}

#[test]
fn what_is_held_stays_to_the_last_bit() {
    let truth = random_rig(6, 2, 12, 4);
    let mut rig = truth.clone();
    misplace_camera(&mut rig);
    let learned = again(&rig, &record(&truth, 5, 4), &["cameras.cam1"]).expect("5 samples do");
    assert_eq!(learned.robot, truth.robot);
    assert_eq!(learned.features, truth.features);
    assert_eq!(learned.cameras[1], truth.cameras[1]);
    assert_eq!(learned.estimate, truth.estimate);
    assert_ne!(learned.cameras[0].pose, rig.cameras[0].pose);
}

#[test]
fn a_new_camera_and_a_new_object_are_added_to_a_learned_rig() {
    let truth = random_rig(6, 3, 12, 5);
    let mut rig = truth.clone();
    rig.cameras.pop();
    rig.features.truncate(6);
    let learned = again(&rig, &record(&truth, 10, 5), &[]).expect("10 samples do");
    assert_eq!((learned.cameras.len(), learned.features.len()), (3, 12));
    assert_eq!(learned.robot, truth.robot);
    let judged = evaluate(&learned, &record(&truth, 100, 10_005)).expect("complete").total;
    assert!(judged.rms_px < 1.3 * 0.3 * 2.0_f64.sqrt(), "{judged:?}");
}

#[test]
fn a_slipped_joint_and_the_whole_chain_are_learned_anew() {
    let slipped = factor(3, &["robot.joints.*.offset"], |rig| {
        rig.robot.joints[2].offset = rig.robot.joints[2].offset.map(|offset| offset + 0.1);
    });
    assert!(slipped <= 1.15, "{slipped} times the floor");
    let chain = factor(50, &["robot.joints"], |rig| rig.robot.joints[2].a = Some(3.0));
    assert!(chain <= 1.06, "{chain} times the floor");
}

#[test]
fn a_path_that_names_nothing_and_too_few_samples_are_told() {
    let truth = random_rig(6, 2, 12, 6);
    let told = |paths: &[&str], samples| again(&truth, &record(&truth, samples, 6), paths).unwrap_err().to_string();
    assert!(told(&["cameras.nowhere"], 5).contains("`cameras.nowhere` names nothing"));
    let mut blind = record(&truth, 5, 6);
    blind.samples.iter_mut().for_each(|sample| sample.pixels.retain(|seen| seen.camera != 0));
    let unseen = again(&truth, &blind, &["cameras.cam1"]).unwrap_err().to_string();
    assert!(unseen.contains("camera `cam1`"), "{unseen}");
    let few = told(&["robot.joints"], 3);
    assert!(few.contains("3 samples"), "{few}");
}
