//! Mistakes planted in a real recording are found, and so are its own.
#[path = "../../benches/common/faults.rs"]
#[allow(dead_code)]
mod faults;

use crate::ur3e;
use handeye::calibrate::Options;
use handeye::doctor::examine;
use handeye::recording::Recording;
use handeye::rig::Rig;

fn found(rig: &Rig, recording: &Recording) -> Vec<String> {
    let diagnosis = examine(rig, recording, &Options::default());
    diagnosis.findings.into_iter().map(|finding| finding.what).collect()
}

#[test]
fn the_swapped_rows_of_the_whole_recording_are_found() {
    let Some((rig, recording)) = ur3e::read() else { return };
    assert_eq!(found(&rig, &recording), ["the joint rows of samples 24 and 25 are swapped"]);
}

#[test]
fn nothing_is_found_without_its_mistakes_and_every_planted_one_is() {
    let Some((rig, recording)) = ur3e::without_mistakes() else { return };
    assert_eq!(found(&rig, &recording), Vec::<String>::new());
    for fault in faults::of_joints() {
        let (mut rig, mut recording) = (rig.clone(), recording.clone());
        (fault.plant)(&mut rig, &mut recording);
        let found = found(&rig, &recording);
        println!("{}: {found:?}", fault.name);
        assert!(found.iter().any(|what| what.contains(fault.says)), "{}: {found:?}", fault.name);
    }
}
