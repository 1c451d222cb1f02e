//! A part of a learned rig is learned anew from a few samples, wherever it was before, and everything else stays.
use crate::cli::Folder;
use crate::learning::{over_floor, record};
use handeye::Error;
use handeye::calibrate::{Options, evaluate, relearn};
use handeye::recording::{RecordedCamera, Recording};
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
fn a_camera_that_only_the_recording_names_is_added_from_five_samples() {
    let factor = factor(5, &["cameras.cam1"], |rig| {
        rig.cameras.remove(0);
    });
    assert!(factor <= 1.3, "{factor} times the floor");
}

#[test]
fn features_that_only_the_recording_names_are_added_from_two_samples() {
    let factor = factor(2, &["features.f1*"], |rig| rig.features.retain(|feature| !feature.name.starts_with("f1")));
    assert!(factor <= 1.25, "{factor} times the floor");
}

/// Of the object before, nothing is seen any more.
#[test]
fn another_object_in_the_gripper_is_learned_beside_the_one_before() {
    for seed in 1..=DRAWS {
        let rig = random_rig(6, 2, 12, seed);
        let mut truth = rig.clone();
        truth.features.truncate(7);
        for (index, feature) in truth.features.iter_mut().enumerate() {
            feature.name = format!("tool{index}");
            feature.xyz = feature.xyz.map(|[x, y, z]| [y, -x, z + 0.02]);
        }
        let learned = again(&rig, &record(&truth, 3, seed), &["features.tool*"]).expect("3 samples do");
        assert_eq!((learned.features.len(), learned.cameras.len()), (19, 2));
        assert_eq!((&learned.features[..12], &learned.robot), (&rig.features[..], &rig.robot), "seed {seed}");
        for (feature, truth) in learned.features[12..].iter().zip(&truth.features) {
            let sd = &learned.fit.as_ref().unwrap().sd[&format!("features.{}.xyz", feature.name)];
            let off = feature.xyz.unwrap().iter().zip(truth.xyz.unwrap()).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            let bound = 5.0 * sd.iter().map(|sd| sd * sd).sum::<f64>().sqrt();
            assert!(feature.name == truth.name && off.sqrt() < bound, "seed {seed}: {feature:?} {truth:?} {sd:?}");
        }
    }
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
    let nowhere = told(&["cameras.nowhere"], 5);
    assert!(nowhere.contains("`cameras.nowhere` names nothing in the rig or the recording"), "{nowhere}");
    assert!(nowhere.contains("cameras cam1, cam2;"), "{nowhere}");
    let mut header_alone = record(&truth, 5, 6);
    header_alone.cameras.push(RecordedCamera {
        name: "top".into(),
        size: Some([640, 480]),
        ..RecordedCamera::default()
    });
    assert_eq!(again(&truth, &header_alone, &["features"]).expect("the header may name more").cameras.len(), 2);
    let unseen = again(&truth, &header_alone, &["cameras.top"]).unwrap_err().to_string();
    assert!(unseen.contains("camera `top` is to be learned, and no sample"), "{unseen}");
    let mut blind = record(&truth, 5, 6);
    blind.samples.iter_mut().for_each(|sample| sample.pixels.retain(|seen| seen.camera != 0));
    let unseen = again(&truth, &blind, &["cameras.cam1"]).unwrap_err().to_string();
    assert!(unseen.contains("camera `cam1`"), "{unseen}");
    let few = told(&["robot.joints"], 3);
    assert!(few.contains("3 samples"), "{few}");
}

#[test]
fn the_command_adds_a_camera_to_the_file_and_keeps_its_comments() {
    let folder = Folder::new("relearn-new");
    let truth = random_rig(6, 3, 12, 7);
    let mut known = truth.clone();
    known.cameras.pop();
    known.write(&folder.path().join("arm.toml"), None).unwrap();
    folder.write("arm.toml", &format!("# the arm at the window\n{}", folder.read("arm.toml")));
    record(&truth, 5, 7).write(&folder.path().join("five.jsonl")).unwrap();
    let calibrate = "calibrate five.jsonl --rig arm.toml -o arm.toml";
    let (_, refused) = folder.expect(2, &format!("{calibrate} --relearn features"));
    assert!(refused.contains("--relearn cameras.cam3 would add it"), "{refused}");
    folder.expect(0, &format!("{calibrate} --relearn cameras.cam3"));
    let text = folder.read("arm.toml");
    assert!(text.starts_with("# the arm at the window\n"), "{text}");
    let learned = Rig::read(&folder.path().join("arm.toml")).unwrap();
    assert_eq!(learned.cameras.len(), 3);
    let factor = over_floor(&learned, &truth, 7);
    assert!(factor < 1.5, "{factor} times the floor");
}
