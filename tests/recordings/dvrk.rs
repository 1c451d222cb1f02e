//! The da Vinci recording: a sliding joint, two features, one camera, hardly any motion.
use crate::{learn, shared};
use handeye::calibrate::{DeterminedBy, evaluate};
use handeye::recording::Recording;
use handeye::rig::Rig;

/// Bars of the held-out rms [px]; the ball detector sets the floor.
const HELD_OUT: f64 = 2.2;

#[test]
fn a_known_chain_is_enough_to_place_a_camera_that_sees_two_balls() {
    let Some(folder) = shared("data/dvrk-prismatic") else { return };
    let rig = Rig::read(&folder.join("dvrk.toml")).expect("the rig is readable");
    let recording = Recording::read(&folder.join("recording.jsonl")).expect("the recording is readable");
    for fold in 0..3 {
        let learned = learn(&rig, &recording.select(|sample| sample % 3 != fold));
        let judged = evaluate(&learned.rig, &recording.select(|sample| sample % 3 == fold)).expect("complete").total;
        println!("dvrk, fold {fold}: {:.4} px rms, {:.4} px median held out", judged.rms_px, judged.median_px);
        assert!(judged.rms_px <= HELD_OUT, "fold {fold}: {judged:?}");
    }
}

#[test]
fn the_report_says_that_it_is_ill_posed_and_why() {
    let Some(folder) = shared("data/dvrk-prismatic") else { return };
    let rig = Rig::read(&folder.join("dvrk.toml")).expect("the rig is readable");
    let recording = Recording::read(&folder.join("recording.jsonl")).expect("the recording is readable");
    let report = learn(&rig, &recording).report;
    assert_eq!(report.tip, None, "the whole chain is held: nothing is to be said of the tip");
    let [weak] = &report.weak[..] else { panic!("{:#?}", report.weak) };
    println!("dvrk: {weak}");
    let DeterminedBy::Poorly { sd, share, metric: true } = weak.determined_by else { panic!("{weak}") };
    assert!((0.005..0.03).contains(&sd) && share > 0.01, "{weak}");
    assert!(weak.numbers.iter().any(|(path, _)| path.starts_with("cameras.rgb.pose")), "{weak}");
    let words = weak.to_string();
    for part in [
        "ill-posed",
        "joint `yaw` moved only 14.3 degrees",
        "joint `pitch` moved only 5.9 degrees",
        "over more than 30 degrees",
    ] {
        assert!(words.contains(part), "{part}: {words}");
    }
    assert!(report.gauge.contains(&words));
}
