//! A robot that goes to the joint positions that were suggested to it, and how far off it then believes its tip to be.
use handeye::calibrate::Suggestion;
use handeye::recording::{Detection, Recording, Sample};
use handeye::rig::{Estimate, Model, Rig};
use handeye::simulate::{SimulateOptions, simulate};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// What a camera has in view.
pub fn in_view(model: &Model, rig: &Rig, joints: &[f64]) -> Vec<(usize, usize, [f64; 2])> {
    let links = model.links(joints);
    let all = (0..rig.cameras.len()).flat_map(|camera| (0..rig.features.len()).map(move |feature| (camera, feature)));
    let seen = all.map(|(camera, feature)| (camera, feature, model.pixel(camera, feature, &links)));
    seen.filter(|&(camera, feature, [u, v])| {
        let [width, height] = rig.cameras[camera].size.expect("every camera has a size").map(f64::from);
        let is_inside = (-0.5..width - 0.5).contains(&u) && (-0.5..height - 0.5).contains(&v);
        is_inside && model.in_camera(camera, feature, &links).z > 0.0
    })
    .collect()
}

/// The recording, and what a robot that goes to the suggested positions would add to it.
pub fn visit(truth: &Rig, recording: &Recording, suggestion: &Suggestion, seed: u64) -> Recording {
    let (mut random, model) = (ChaCha8Rng::seed_from_u64(seed), Model::new(truth).expect("the rig is complete"));
    let mut normal = |sd: f64| sd * random.sample::<f64, _>(StandardNormal);
    let mut recording = recording.clone();
    for joints in suggestion.samples.iter().map(|sample| &sample.joints) {
        let read = joints.iter().map(|joint| joint + normal(truth.noise.joints)).collect();
        let mut sample = Sample { joints: Some(read), ..Sample::default() };
        for (camera, feature, pixel) in in_view(&model, truth, joints) {
            let name = &truth.features[feature].name;
            let feature = recording.features.iter().position(|known| known == name).expect("it was seen before");
            let pixel = pixel.map(|x| x + normal(truth.noise.pixels));
            sample.pixels.push(Detection { camera: camera as u32, feature: feature as u32, pixel });
        }
        sample.pixels.sort_unstable_by_key(|seen| (seen.camera, seen.feature));
        recording.samples.push(sample);
    }
    recording
}

/// Nothing is known well, but for what would be redundant, which is where it truly is: so the tip can be compared with the true one.
pub fn gauge_alone(truth: &Rig) -> Rig {
    let fixed = ["robot.base", "cameras.*.pose", "robot.joints.j1.offset", "robot.joints.j1.d", "robot.joints.j6"];
    let prior = [("robot", 10.0), ("features", 10.0)].map(|(path, sd)| (path.to_owned(), sd)).into();
    Rig { estimate: Estimate { fixed: fixed.map(str::to_owned).into(), prior, ..Estimate::default() }, ..truth.clone() }
}

/// Root mean square distance of the learned tip from the true one in 100 fresh positions [m].
pub fn tip_error(learned: &Rig, truth: &Rig, seed: u64) -> f64 {
    let fresh = simulate(truth, &SimulateOptions { samples: 100, seed: seed + 1_000, ..SimulateOptions::default() })
        .expect("the rig is complete");
    let [learned, truth] = [learned, truth].map(|rig| Model::new(rig).expect("the rig is complete"));
    let joints = fresh.truth.samples.iter().flat_map(|sample| &sample.joints);
    let squares: Vec<f64> =
        joints.map(|joints| (learned.tip(joints).translation - truth.tip(joints).translation).norm_squared()).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}
