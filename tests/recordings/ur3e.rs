//! A UR3e with a checkerboard on its flange, seen by four webcams, one of which moved; with swapped rows and wrong images.
use crate::{learn, shared};
use handeye::calibrate::{Calibration, Evaluation, Finding, evaluate};
use handeye::recording::Recording;
use handeye::rig::Rig;

/// Images that match no listed pose, by sample, all of cam4.
const WRONG_IMAGES: [usize; 6] = [8, 13, 14, 30, 32, 37];

pub fn read() -> Option<(Rig, Recording)> {
    let folder = shared("data/ur3e-checkerboard")?;
    let rig = Rig::read(&folder.join("ur3e.toml")).expect("the rig is valid");
    Some((rig, Recording::read(&folder.join("recording.jsonl")).expect("the recording is valid")))
}

/// The recording without samples 24 and 25, the wrong images and the camera that moved.
pub fn without_mistakes() -> Option<(Rig, Recording)> {
    let (mut rig, recording) = read()?;
    rig.cameras.retain(|camera| camera.name != "cam3");
    Some((rig, part(&recording, |sample| sample != 24 && sample != 25, is_right)))
}

fn is_held_out(sample: usize) -> bool {
    sample.is_multiple_of(3) && sample != 24
}

/// The samples for which `keep_sample` and, of each, the images for which `keep_image` says so.
fn part(
    recording: &Recording,
    keep_sample: impl Fn(usize) -> bool,
    keep_image: impl Fn(usize, &str) -> bool,
) -> Recording {
    let mut part = recording.clone();
    let mut number = 0;
    part.samples.retain(|_| {
        number += 1;
        keep_sample(number - 1)
    });
    let kept: Vec<usize> = (0..recording.samples.len()).filter(|&sample| keep_sample(sample)).collect();
    for (sample, number) in part.samples.iter_mut().zip(kept) {
        sample.pixels.retain(|seen| keep_image(number, &recording.cameras[seen.camera as usize].name));
    }
    part
}

fn is_right(sample: usize, camera: &str) -> bool {
    !(camera == "cam4" && WRONG_IMAGES.contains(&sample)) && camera != "cam3"
}

fn held_out(learned: &Calibration, recording: &Recording) -> Evaluation {
    let fresh = part(recording, is_held_out, is_right);
    evaluate(&learned.rig, &fresh).expect("the learned rig is complete")
}

/// Mean distance of neighbouring corners of the board [m].
fn pitch(rig: &Rig) -> f64 {
    let at = |row: usize, column: usize| {
        let name = format!("c{row}_{column}");
        let feature = rig.features.iter().find(|feature| feature.name == name).expect("every corner is learned");
        nalgebra::Vector3::from(feature.xyz.expect("every feature has coordinates"))
    };
    let rows = (0..7).flat_map(|r| (0..8).map(move |c| ((r, c), (r, c + 1))));
    let columns = (0..6).flat_map(|r| (0..9).map(move |c| ((r, c), (r + 1, c))));
    let distances: Vec<f64> = rows.chain(columns).map(|(a, b)| (at(a.0, a.1) - at(b.0, b.1)).norm()).collect();
    distances.iter().sum::<f64>() / distances.len() as f64
}

#[test]
fn without_its_mistakes_it_predicts_held_out_samples_as_well_as_scipy() {
    let Some((rig, recording)) = read() else { return };
    let training = part(&recording, |sample| !is_held_out(sample) && sample != 24 && sample != 25, is_right);
    let mut three = rig.clone();
    three.cameras.retain(|camera| camera.name != "cam3");
    let learned = learn(&three, &training);
    let errors = held_out(&learned, &recording).total;
    println!("mistakes taken out: {:.4} px rms, {:.4} px median", errors.rms_px, errors.median_px);
    println!("corner pitch {:.3} mm", 1e3 * pitch(&learned.rig));
    assert!(errors.rms_px <= 0.70 && errors.median_px <= 0.335, "{errors:?}");
    assert!((pitch(&learned.rig) - 0.020).abs() < 1e-4);
}

#[test]
fn as_it_is_it_predicts_held_out_samples_and_its_mistakes_are_named() {
    let Some((rig, recording)) = read() else { return };
    let learned = learn(&rig, &part(&recording, |sample| !is_held_out(sample), |_, _| true));
    let errors = held_out(&learned, &recording).total;
    println!("as it is: {:.4} px rms, {:.4} px median", errors.rms_px, errors.median_px);
    println!("corner pitch {:.3} mm", 1e3 * pitch(&learned.rig));
    assert!(errors.rms_px <= 0.74 && errors.median_px <= 0.36, "{errors:?}");
    assert!((pitch(&learned.rig) - 0.020).abs() < 1e-4);
}

#[test]
fn every_mistake_of_the_whole_recording_is_named_and_nothing_else() {
    let Some((rig, recording)) = read() else { return };
    let learned = learn(&rig, &recording);
    let (mut joints, mut images, mut moved) = (Vec::new(), Vec::new(), Vec::new());
    for finding in &learned.report.findings {
        match finding {
            Finding::WrongJoints { sample, swapped_with, .. } => joints.push((*sample, *swapped_with)),
            Finding::WrongImage { sample, camera, .. } => images.push((*sample, camera.as_str())),
            Finding::CameraMoved { camera, .. } => moved.push(camera.as_str()),
            Finding::Outliers { .. } => {}
            other => panic!("{other}"),
        }
    }
    assert_eq!(joints, [(24, Some(25)), (25, Some(24))]);
    assert_eq!(images, WRONG_IMAGES.map(|sample| (sample, "cam4")));
    assert_eq!(moved, ["cam3"]);
}
