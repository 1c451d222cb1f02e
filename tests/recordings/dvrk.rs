//! The da Vinci recording: a sliding joint, two features, one camera, hardly any motion.
use crate::{learn, shared};
use handeye::calibrate::evaluate;
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
