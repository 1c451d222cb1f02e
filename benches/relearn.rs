//! How many samples relearning a part of a known rig takes: median factor over the floor, for random rigs with 6 joints, 2 cameras,
//! 12 features and 0.3 px, everything else held, from no start.
//!
//! `cargo bench --bench relearn -- [DRAWS]`
use handeye::calibrate::{Options, evaluate, relearn};
use handeye::recording::Recording;
use handeye::rig::Rig;
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use handeye::solvers::Pose;
use std::ops::ControlFlow;

fn main() {
    let draws = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(60);
    println!("{:44} {:>7} {:>8} {:>8} {:>7}", "relearned", "samples", "median", "largest", "failed");
    // A camera whose intrinsics are up to 3 % off, alternately too long and too short.
    let camera = |rig: &mut Rig, seed: u64| {
        let camera = &mut rig.cameras[0];
        let by = if seed.is_multiple_of(2) { 1.03 } else { 0.97 };
        camera.pose = Some(Pose::identity());
        (camera.fx, camera.fy) = (camera.fx.map(|f| by * f), camera.fy.map(|f| by * f));
    };
    for samples in [2, 3, 5, 10] {
        row("a camera, its header 3 % off", samples, draws, "cameras.cam1", camera);
    }
    let structure = |rig: &mut Rig, _| rig.features.iter_mut().for_each(|feature| feature.xyz = Some([9.0; 3]));
    for samples in [2, 3, 5] {
        row("the structure", samples, draws, "features", structure);
    }
    for samples in [2, 3, 5] {
        row("the base", samples, draws, "robot.base", |rig, _| rig.robot.base = Some(Pose::identity()));
    }
    for samples in [15, 20, 30, 50] {
        row("the chain, with structure and base", samples, draws, "robot.joints", |_, _| ());
    }
}

fn row(name: &str, samples: usize, draws: u64, path: &str, spoil: impl Fn(&mut Rig, u64)) {
    let draw = |seed: u64| {
        let truth = random_rig(6, 2, 12, seed);
        let mut rig = truth.clone();
        spoil(&mut rig, seed);
        let mut recording = record(&truth, samples, seed);
        // The header says of intrinsics what the rig does.
        for (recorded, camera) in recording.cameras.iter_mut().zip(&rig.cameras) {
            (recorded.fx, recorded.fy) = (camera.fx, camera.fy);
        }
        let paths = [path.to_owned()];
        let learned =
            relearn(&rig, &recording, &paths, &Options::default(), &mut |_| ControlFlow::Continue(())).ok()?;
        let judged = evaluate(&learned.rig, &record(&truth, 100, seed + 10_000)).ok()?;
        Some(judged.total.rms_px / (truth.noise.pixels * 2.0_f64.sqrt()))
    };
    let factors: Vec<Option<f64>> = (1..=draws).map(draw).collect();
    let failed = factors.iter().filter(|factor| factor.is_none()).count();
    let mut factors: Vec<f64> = factors.into_iter().map(|factor| factor.unwrap_or(f64::INFINITY)).collect();
    factors.sort_by(f64::total_cmp);
    let (median, largest) = (factors[factors.len() / 2], factors[factors.len() - 1]);
    println!("{name:44} {samples:7} {median:8.3} {largest:8.3} {failed:7}");
}

fn record(rig: &Rig, samples: usize, seed: u64) -> Recording {
    let options = SimulateOptions { samples, seed, ..SimulateOptions::default() };
    simulate(rig, &options).expect("the rig is in view").recording
}
