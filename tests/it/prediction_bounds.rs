//! Margins from a learned rig's standard deviations: a bound that predictions keep.
use crate::servo::positions;
use handeye::calibrate::{Options, calibrate};
use handeye::rig::{Fit, Rig};
use handeye::servo::{Arm, Configuration, PredictionBounds};
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use std::ops::ControlFlow;

#[test]
fn predictions_of_learned_rigs_are_off_by_less_than_three_bounds() {
    let mut bounds = Vec::new();
    for seed in 0..8 {
        let truth = random_rig(6, 2, 6, seed);
        let recording = simulate(&truth, &SimulateOptions { seed, ..SimulateOptions::default() }).unwrap().recording;
        let learned = calibrate(&Rig::default(), &recording, &Options::default(), &mut |_| ControlFlow::Continue(()))
            .unwrap()
            .rig;
        let predicted = PredictionBounds::new(&learned).unwrap();
        let [truth_arm, learned_arm] = [&truth, &learned].map(|rig| Arm::new(rig).unwrap());
        let mut at = Configuration::default();
        for joints in positions(&truth, 10, seed + 100) {
            for (camera, feature) in [(0, 0), (1, 3)] {
                let mut pixel = |arm: &Arm| {
                    arm.configure(&joints, &mut at);
                    arm.pixel(&at, camera, feature).unwrap()
                };
                let (a, b) = (pixel(&truth_arm), pixel(&learned_arm));
                let off = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
                let bound = predicted.pixel(&joints, camera, feature).unwrap();
                assert!(off < 3.0 * bound, "seed {seed}: {off} px off, the bound is {bound} px");
                bounds.push(bound);
            }
        }
        assert!(predicted.pixel(&[0.0; 6], 2, 0).is_none(), "there is no third camera");
    }
    bounds.sort_by(f64::total_cmp);
    // Worth something as a margin of an image of 640 px.
    assert!(bounds[bounds.len() / 2] < 30.0, "half of the bounds are over {} px", bounds[bounds.len() / 2]);
}

#[test]
fn bounds_add_up_what_single_numbers_do() {
    let mut rig = random_rig(6, 2, 6, 3);
    let error = PredictionBounds::new(&rig).err().unwrap().to_string();
    assert!(error.contains("[fit.sd]"), "{error}");
    let sd = [
        ("cameras.camera1.cx", vec![0.5]),
        ("robot.base", vec![0.0, 0.003, 0.0, 0.0, 0.0, 0.0]),
        ("robot.joints.j6.d", vec![0.001]),
    ];
    let name = rig.cameras[0].name.clone();
    let path = |path: &str| path.replace("camera1", &name);
    rig.fit = Some(Fit { sd: sd.iter().map(|(key, sd)| (path(key), sd.clone())).collect(), ..Fit::default() });
    let bounds = PredictionBounds::new(&rig).unwrap();
    let joints = positions(&rig, 1, 1).remove(0);
    // A base moves the tip as far as itself, and so does the last link; the camera does not.
    assert!((bounds.tip(&joints) - 0.004).abs() < 1e-9, "{}", bounds.tip(&joints));
    rig.fit.as_mut().unwrap().sd.retain(|path, _| path.ends_with("cx"));
    let bounds = PredictionBounds::new(&rig).unwrap();
    assert!((bounds.pixel(&joints, 0, 0).unwrap() - 0.5).abs() < 1e-9 && bounds.pixel(&joints, 1, 0) == Some(0.0));
}
