//! Servoing with a rig on the problems that ViSP was measured on: mean pixel error after each command.
//!
//! `cargo bench --bench servo`. *True*: the rig itself. *Learned*: from 50 samples of the cameras at 0.3 px, from nothing. *Noisy*: the true
//! rig with 0.02 rad on joint readings and on actions, beside the floor, which is the target plus one noisy motion.
use handeye::calibrate::{Options, calibrate};
use handeye::infer::Sighting;
use handeye::recording::{Detection, RecordedCamera, Recording, Sample};
use handeye::rig::{Camera, Feature, Rig};
use handeye::servo::{Arm, ModelBased};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servo_cases::{Cases, mean, mean_error, normal};
use std::ops::ControlFlow;
use std::path::PathBuf;

#[path = "common/servo_cases.rs"]
mod servo_cases;

/// Commands, pixel noise of a recording [px], and noise of readings and actions [rad].
const COMMANDS: usize = 4;
const PIXELS: f64 = 0.3;
const NOISY: f64 = 0.02;

fn main() {
    let folder = std::env::var_os("HANDEYE_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    let path = folder.join("cases/servo_ur5.json");
    let Ok(text) = std::fs::read_to_string(&path) else {
        return println!("{} is not there: set HANDEYE_SHARED to its folder", path.display());
    };
    println!("{:28} {:>8} {:>8} {:>8} {:>8} {:>8} {:>12}", "mean px after commands", 0, 1, 2, 3, 4, "worst at 2");
    for set in ["mid", "eih"] {
        let cases = Cases::new(&text, set);
        row(&format!("{set}, true"), &cases, &cases.rig, 0.0);
        row(&format!("{set}, noisy"), &cases, &cases.rig, NOISY);
        floor(set, &cases);
        match learn(&cases) {
            Ok(rig) => row(&format!("{set}, learned"), &cases, &rig, 0.0),
            Err(error) => println!("{set}, learned: {error}"),
        }
    }
}

fn row(name: &str, cases: &Cases, rig: &Rig, noise: f64) {
    let mut servo = ModelBased::new(rig).expect("complete");
    let errors = cases.errors(&mut servo, COMMANDS, noise, 1);
    let means: Vec<String> = errors.iter().map(|errors| format!("{:8.3}", mean(errors))).collect();
    println!("{name:28} {} {:12.3}", means.join(" "), errors[2].iter().copied().fold(0.0, f64::max));
}

/// The target plus one noisy motion, over many draws.
fn floor(set: &str, cases: &Cases) {
    let arm = Arm::new(&cases.rig).expect("complete");
    let random = &mut ChaCha8Rng::seed_from_u64(2);
    let (mut sum, mut count) = (0.0, 0.0);
    for (_, target) in &cases.pairs {
        let goal = cases.look(&arm, target);
        for _ in 0..50 {
            let joints: Vec<f64> = target.iter().map(|joint| joint + normal(NOISY, random)).collect();
            sum += mean_error(&cases.look(&arm, &joints), &goal);
            count += 1.0;
        }
    }
    println!("{:28} {:8.3}", format!("{set}, floor of noisy"), sum / count);
}

/// From 50 samples around the starts, with the intrinsics of the header.
fn learn(cases: &Cases) -> Result<Rig, handeye::Error> {
    let arm = Arm::new(&cases.rig)?;
    let random = &mut ChaCha8Rng::seed_from_u64(3);
    let camera = |camera: &Camera| RecordedCamera {
        name: camera.name.clone(),
        size: camera.size,
        fx: camera.fx,
        fy: camera.fy,
        cx: camera.cx,
        cy: camera.cy,
        ..RecordedCamera::default()
    };
    let mut recording = Recording {
        joints: cases.rig.robot.joint_names(),
        cameras: cases.rig.cameras.iter().map(camera).collect(),
        features: cases.rig.features.iter().map(|feature| feature.name.clone()).collect(),
        ..Recording::default()
    };
    for (start, _) in cases.pairs.iter().take(50) {
        let joints: Vec<f64> = start.iter().map(|joint| joint + random.random_range(-0.3..0.3)).collect();
        let seen = cases.look(&arm, &joints);
        let detection = |seen: &Sighting| Detection {
            camera: seen.camera as u32,
            feature: seen.feature as u32,
            pixel: seen.pixel.map(|pixel| pixel + normal(PIXELS, random)),
        };
        let pixels = seen.iter().map(detection).collect();
        recording.samples.push(Sample { joints: Some(joints), pixels, ..Sample::default() });
    }
    // What is fixed to what is all that is known.
    let mut rig = Rig::default();
    rig.noise.pixels = PIXELS;
    rig.cameras.extend(cases.rig.cameras.iter().map(|camera| Camera {
        name: camera.name.clone(),
        parent: camera.parent,
        ..Camera::default()
    }));
    rig.features.extend(cases.rig.features.iter().map(|feature| Feature { xyz: None, ..feature.clone() }));
    Ok(calibrate(&rig, &recording, &Options::default(), &mut |_| ControlFlow::Continue(()))?.rig)
}
