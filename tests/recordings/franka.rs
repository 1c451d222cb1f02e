//! The Franka recording: tip poses without joints, three cameras, a marker on the hand.
use crate::{learn, shared};
use handeye::recording::Recording;
use handeye::rig::{Feature, Rig};

/// Side of the marker by the mean of the reference's learned sides, and how unequal sides may be [m].
const SIDE: f64 = 0.039;
const UNEQUAL: f64 = 1.5e-4;

#[test]
fn tip_poses_alone_place_cameras_and_make_the_marker_a_square() {
    let Some(path) = shared("data/franka-aruco/recording.jsonl") else { return };
    let recording = Recording::read(&path).expect("the recording is readable");
    let mut rig = Rig::default();
    rig.noise.pixels = 0.6;
    rig.estimate.fixed = ["fx", "fy", "cx", "cy"].map(|field| format!("cameras.*.{field}")).to_vec();
    let learned = learn(&rig, &recording);
    let report = &learned.report;
    println!("franka: {:.4} px rms, {:.4} px median, {} left out", report.rms_px, report.median_px, report.rejected);
    assert!(report.rms_px <= 0.84 && report.rejected == 0, "{} px, {} left out", report.rms_px, report.rejected);
    let corner = |i: usize| {
        let named = |feature: &&Feature| feature.name == format!("m9_{i}");
        let xyz = learned.rig.features.iter().find(named).and_then(|feature| feature.xyz);
        nalgebra::Vector3::from(xyz.expect("all four corners are learned"))
    };
    let sides: Vec<f64> = (0..4).map(|i| (corner(i) - corner((i + 1) % 4)).norm()).collect();
    let diagonals = [(corner(0) - corner(2)).norm(), (corner(1) - corner(3)).norm()];
    println!("sides {sides:.5?} m, diagonals {diagonals:.5?} m");
    let mean = sides.iter().sum::<f64>() / 4.0;
    assert!((mean - SIDE).abs() < UNEQUAL, "sides of {mean} m");
    assert!(sides.iter().all(|side| (side - mean).abs() < UNEQUAL), "{sides:?}");
    assert!(diagonals.iter().all(|diagonal| (diagonal - mean * 2.0_f64.sqrt()).abs() < 2.0 * UNEQUAL), "{diagonals:?}");
}
