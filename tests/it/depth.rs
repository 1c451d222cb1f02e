//! A depth camera's points teach a rig in metres, alone and beside other cameras' pixels, with points missing and wrong.
use crate::cli::Folder;
use crate::learning::{learn, variants};
use handeye::calibrate::{Calibration, Distance, Finding, Options, calibrate, evaluate};
use handeye::doctor::examine;
use handeye::recording::Recording;
use handeye::rig::{Estimate, Rig};
use handeye::simulate::{SimulateOptions, simulate};
use nalgebra::Vector3;
use serde_json::Value;
use std::ops::ControlFlow;

const SEEDS: u64 = 6;

/// What is recorded of a rig.
#[derive(Clone, Copy)]
struct Setting {
    cameras: usize,
    /// Whether the depth camera gives points alone, and nobody its intrinsics.
    points_alone: bool,
}

const DEPTH: Setting = Setting { cameras: 1, points_alone: true };
const DEPTH_AND_COLOUR: Setting = Setting { cameras: 2, points_alone: true };
const BOTH_IN_ONE: Setting = Setting { cameras: 1, points_alone: false };

impl Setting {
    fn truth(self, seed: u64) -> Rig {
        variants::depth(self.cameras, seed)
    }

    fn record(self, truth: &Rig, options: &SimulateOptions) -> Recording {
        let mut recording = simulate(truth, options).expect("the rig is complete and in view").recording;
        if self.points_alone {
            variants::points_alone(truth, &mut recording);
        }
        recording
    }

    /// Root mean squares of pixels and of points on 100 fresh samples, over the floors of the noise; 0 of what there is none of.
    fn over_floors(self, learned: &Rig, truth: &Rig, seed: u64) -> [f64; 2] {
        let options = SimulateOptions { samples: 100, seed: seed + 1_000_000, ..SimulateOptions::default() };
        let judged = evaluate(learned, &self.record(truth, &options)).expect("the learned rig is complete").total;
        let noise = truth.noise;
        [judged.rms_px / (noise.pixels * 2.0_f64.sqrt()), judged.points.rms_m / (noise.points * 3.0_f64.sqrt())]
    }

    /// Learns every seed's rig from nothing: within 1.05 of the floors, and in metres to 1 %, where the shape of the features, which
    /// no frame changes, is known to about a tenth of that.
    fn learned_to_the_floor(self, options: &SimulateOptions) -> Vec<(Recording, Calibration)> {
        let (mut failures, mut all) = (Vec::new(), Vec::new());
        for seed in 0..SEEDS {
            let truth = self.truth(seed);
            let recording = self.record(&truth, &SimulateOptions { seed, ..options.clone() });
            match learn(&variants::forgotten(&truth), &recording) {
                Ok(learned) => {
                    let ratios = self.over_floors(&learned.rig, &truth, seed);
                    let scale = size(&learned.rig, &truth) / size(&truth, &truth);
                    if ratios.iter().any(|ratio| *ratio > 1.05) || (scale - 1.0).abs() > 0.01 {
                        failures.push(format!("seed {seed}: {ratios:.3?} of the floors, scale {scale:.4}"));
                    }
                    all.push((recording, learned));
                }
                Err(error) => failures.push(format!("seed {seed}: {error}")),
            }
        }
        assert!(failures.is_empty(), "{} of {SEEDS}: {failures:#?}", failures.len());
        all
    }
}

/// Root mean square distance of the features from their mean.
fn size(rig: &Rig, truth: &Rig) -> f64 {
    let place = |name: &str| rig.features.iter().find(|feature| feature.name == name).and_then(|feature| feature.xyz);
    let places: Vec<Vector3<f64>> =
        truth.features.iter().filter_map(|one| place(&one.name)).map(Vector3::from).collect();
    let mean = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
    (places.iter().map(|place| (place - mean).norm_squared()).sum::<f64>() / places.len() as f64).sqrt()
}

#[test]
fn a_depth_camera_alone_teaches_a_rig_in_metres_and_needs_no_intrinsics() {
    for (recording, Calibration { rig, report }) in DEPTH.learned_to_the_floor(&SimulateOptions::default()) {
        assert!(report.gauge.iter().all(|line| !line.contains("metric")), "{:?}", report.gauge);
        assert!(report.tip.is_some_and(|tip| tip.metric), "{:?}", report.tip);
        assert_eq!((report.points.observations, report.rms_px), (report.observations, 0.0));
        let camera = &rig.cameras[0];
        assert!(camera.depth && camera.fx.is_none() && camera.cx.is_none(), "{camera:?}");
        // A learned rig is a rig file, and refined from there it is the same.
        let read = Rig::parse(&rig.to_toml(), "learned.toml").unwrap();
        assert_eq!(read.fit.as_ref().and_then(|fit| fit.rms_points_m), Some(report.points.rms_m));
        let again = learn(&read, &recording).unwrap().report;
        assert!((again.points.rms_m / report.points.rms_m - 1.0).abs() < 1e-3, "{:?}", again.points);
    }
}

#[test]
fn a_depth_camera_beside_a_colour_camera_teaches_both_in_metres() {
    for (_, Calibration { rig, report }) in DEPTH_AND_COLOUR.learned_to_the_floor(&SimulateOptions::default()) {
        assert!(report.gauge.iter().all(|line| !line.contains("metric")), "{:?}", report.gauge);
        assert!(rig.cameras[0].depth && rig.cameras[0].fx.is_none(), "{:?}", rig.cameras[0]);
        assert!(!rig.cameras[1].depth && rig.cameras[1].fx.is_some(), "{:?}", rig.cameras[1]);
    }
}

#[test]
fn one_camera_of_pixels_and_points_teaches_a_rig_in_metres() {
    BOTH_IN_ONE.learned_to_the_floor(&SimulateOptions::default());
}

#[test]
fn without_points_the_same_colour_camera_has_no_metres() {
    let truth = DEPTH_AND_COLOUR.truth(1);
    let mut recording = DEPTH_AND_COLOUR.record(&truth, &SimulateOptions { samples: 80, ..SimulateOptions::default() });
    recording.samples.iter_mut().for_each(|sample| sample.points.clear());
    let learned = learn(&variants::forgotten(&truth), &recording).unwrap();
    assert!(learned.report.gauge.iter().any(|line| line.contains("nothing that is known is metric")));
}

/// An outlier is within 65 mm of the truth, 13 standard deviations, with a probability of about 0.02 % (the share of a cube of 1.5 m
/// that such a ball has); a good point is further than 10 with one of e⁻⁵⁰.
#[test]
fn gross_outliers_among_points_are_left_out_and_counted_and_good_points_are_not() {
    let options = SimulateOptions { samples: 80, missed: 0.3, outliers: 0.05, ..SimulateOptions::default() };
    for setting in [DEPTH, DEPTH_AND_COLOUR] {
        let mut planted = 0;
        let mut rejected = 0;
        for (seed, (recording, learned)) in (0..).zip(setting.learned_to_the_floor(&options)) {
            let truth = setting.truth(seed);
            let exact = evaluate(&truth, &recording).unwrap();
            let far = handeye::calibrate::distances(&truth, &recording).unwrap();
            let all = far.iter().flat_map(|sample| &sample.cameras);
            let is_far = |px: f64, sd: f64| px > 10.0 * sd;
            planted += all
                .map(|camera| {
                    let pixels = camera.pixels.iter().filter(|pixel| is_far(pixel.px, truth.noise.pixels)).count();
                    pixels + camera.points.iter().filter(|m| is_far(**m, truth.noise.points)).count()
                })
                .sum::<usize>();
            let report = &learned.report;
            rejected += report.rejected;
            let only_single = [Finding::Outliers { count: report.rejected, of: exact.total.observations }];
            assert_eq!(report.findings, only_single, "seed {seed}");
        }
        // What lies near 10 standard deviations falls on either side.
        assert!(planted > 100 && planted.abs_diff(rejected) <= 3, "{rejected} of {planted} planted");
    }
}

#[test]
fn points_of_another_sample_and_swapped_joints_are_named_in_millimetres() {
    for seed in 0..SEEDS {
        let truth = DEPTH_AND_COLOUR.truth(seed);
        let mut recording = DEPTH_AND_COLOUR.record(&truth, &SimulateOptions { seed, ..SimulateOptions::default() });
        recording.samples[7].points = recording.samples[30].points.clone();
        let learned = learn(&variants::forgotten(&truth), &recording).unwrap();
        let [Finding::WrongImage { sample: 7, camera, off: Distance::Metres(m) }] = &learned.report.findings[..] else {
            panic!("seed {seed}: {:?}", learned.report.findings);
        };
        assert!(*camera == truth.cameras[0].name && *m > 0.05, "seed {seed}: {camera}, {m}");
        assert!(
            learned.report.findings[0].to_string().contains(" mm); it was left out"),
            "{}",
            learned.report.findings[0]
        );

        let truth = DEPTH.truth(seed);
        let mut recording = DEPTH.record(&truth, &SimulateOptions { seed, ..SimulateOptions::default() });
        let of_three = recording.samples[3].joints.take();
        recording.samples[3].joints = recording.samples[40].joints.take();
        recording.samples[40].joints = of_three;
        let learned = learn(&variants::forgotten(&truth), &recording).unwrap();
        let swapped = |finding: &Finding| match finding {
            Finding::WrongJoints { sample, swapped_with, off: Distance::Metres(_), .. } => {
                Some((*sample, *swapped_with))
            }
            _ => None,
        };
        let named: Vec<_> = learned.report.findings.iter().map(swapped).collect();
        assert_eq!(named, [Some((3, Some(40))), Some((40, Some(3)))], "seed {seed}: {:?}", learned.report.findings);
    }
}

/// A standard deviation from n numbers has one of its own of σ/√(2n): 5 of those for about 1,500 pixel and 2,000 point coordinates.
#[test]
fn the_noise_of_points_is_estimated_beside_that_of_pixels() {
    for setting in [DEPTH, DEPTH_AND_COLOUR, BOTH_IN_ONE] {
        for seed in 0..2 {
            let mut truth = setting.truth(seed);
            truth.noise.points = 0.003;
            let recording =
                setting.record(&truth, &SimulateOptions { seed, samples: 80, ..SimulateOptions::default() });
            let options = Options { estimate_noise: true, ..Options::default() };
            let rig = Rig { estimate: Estimate::default(), ..Rig::default() };
            // Joints were read exactly, which nobody says: their noise is estimated too, and has to come out small.
            let learned = calibrate(&rig, &recording, &options, &mut |_| ControlFlow::Continue(())).unwrap();
            let noise = learned.report.noise.expect("it was asked for");
            assert!((noise.points / 0.003 - 1.0).abs() < 0.08, "seed {seed}: {noise:?}");
            assert!(
                setting.cameras == 1 && setting.points_alone || (noise.pixels / 0.3 - 1.0).abs() < 0.1,
                "{noise:?}"
            );
            assert!(noise.joints < 2e-3, "seed {seed}: {noise:?}");
        }
    }
}

#[test]
fn a_new_depth_camera_is_learned_in_a_known_rig_from_ten_samples() {
    for seed in 0..SEEDS {
        let truth = DEPTH.truth(seed);
        let recording = DEPTH.record(&truth, &SimulateOptions { seed, samples: 10, ..SimulateOptions::default() });
        let mut known = truth.clone();
        known.cameras.clear();
        known.estimate.fixed = vec!["robot".to_owned(), "features".to_owned()];
        let learned = learn(&known, &recording).unwrap();
        // 6 numbers from some 300 coordinates: 1.01, more where the fresh samples lie further out.
        let [_, ratio] = DEPTH.over_floors(&learned.rig, &truth, seed);
        assert!(ratio < 1.1, "seed {seed}: {ratio:.3}");
    }
}

#[test]
fn tip_poses_and_points_place_the_camera_and_the_features() {
    let record = |truth: &Rig, samples: usize, seed: u64| {
        let options = SimulateOptions { samples, seed, ..SimulateOptions::default() };
        let simulation = simulate(truth, &options).unwrap();
        let mut recording = simulation.recording;
        variants::points_alone(truth, &mut recording);
        for (sample, truth) in recording.samples.iter_mut().zip(&simulation.truth.samples) {
            (sample.joints, sample.pose) = (None, truth.pose);
        }
        recording
    };
    for seed in 0..SEEDS {
        let truth = DEPTH.truth(seed);
        let learned = learn(&variants::forgotten(&truth), &record(&truth, 20, seed)).unwrap();
        let judged = evaluate(&learned.rig, &record(&truth, 50, seed + 1000)).unwrap().total.points;
        let ratio = judged.rms_m / (truth.noise.points * 3.0_f64.sqrt());
        assert!(ratio < 1.08, "seed {seed}: {ratio:.3}");
    }
}

#[test]
fn the_doctor_finds_millimetres_and_degrees_among_points() {
    let truth = DEPTH.truth(3);
    let recording = DEPTH.record(&truth, &SimulateOptions { seed: 3, ..SimulateOptions::default() });
    let found = |recording: &Recording| -> Vec<String> {
        let diagnosis = examine(&variants::forgotten(&truth), recording, &Options::default());
        diagnosis.findings.into_iter().map(|finding| finding.what).collect()
    };
    assert_eq!(found(&recording), [""; 0]);
    let mut spoilt = recording.clone();
    let points = spoilt.samples.iter_mut().flat_map(|sample| &mut sample.points);
    points.for_each(|seen| seen.point = seen.point.map(|x| 1e3 * x));
    assert!(found(&spoilt).contains(&"points of depth cameras are in millimetres".to_owned()));
    let mut spoilt = recording.clone();
    let joints = spoilt.samples.iter_mut().flat_map(|sample| &mut sample.joints).flatten();
    joints.for_each(|joint| *joint = joint.to_degrees());
    assert_eq!(found(&spoilt), ["joints are in degrees"]);
}

/// The commands on a rig file whose camera is a depth camera.
#[test]
fn every_command_reads_points_and_says_how_far_off_they_are_in_millimetres() {
    let folder = Folder::new("depth");
    let mut rig = DEPTH_AND_COLOUR.truth(2);
    rig.noise.points = 0.002;
    folder.write("rig.toml", &rig.to_toml());
    folder.expect(0, "simulate rig.toml --seed 1 -o motions.jsonl");
    folder.expect(0, "simulate rig.toml --seed 2 -o fresh.jsonl");
    let (told, _) = folder.expect(0, "check rig.toml motions.jsonl");
    assert!(told.contains("points") && told.contains("no mistake"), "{told}");
    let (told, _) = folder.expect(0, "calibrate motions.jsonl -o learned.toml --folds 2 --influence");
    assert!(told.contains("rms mm"), "{told}");
    let json = |arguments: &str| -> Value { serde_json::from_str(&folder.expect(0, arguments).0).unwrap() };
    let judged = json("evaluate learned.toml fresh.jsonl --json");
    let floor = 2.0 * 3.0_f64.sqrt();
    for part in [&judged["points"], &judged["cameras"]["cam1"]["points"]] {
        let rms = part["rms_mm"].as_f64().unwrap();
        assert!((0.9 * floor..1.1 * floor).contains(&rms), "{part}");
    }
    assert!(judged["cameras"]["cam2"]["points"].is_null(), "{judged}");
    let (told, _) = folder.expect(0, "monitor learned.toml fresh.jsonl");
    assert!(told.contains("no change") && told.contains("points of depth cameras not watched"), "{told}");
}
