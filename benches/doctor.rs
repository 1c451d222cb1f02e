//! How often the doctor finds each of its faults, and how often it finds one in clean recordings.
//!
//! `cargo bench --bench doctor -- [TRIALS] [WORD]...`: rows whose names hold one of the words, all where none is given.
#[path = "common/faults.rs"]
mod faults;

use faults::Fault;
use handeye::calibrate::Options;
use handeye::doctor::examine;
use handeye::recording::Recording;
use handeye::rig::{Model, Rig};
use handeye::simulate::{SimulateOptions, random_rig, simulate};

fn main() {
    let trials = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(100);
    let words: Vec<String> =
        std::env::args().skip(1).filter(|word| word.parse::<u64>().is_err() && word != "--bench").collect();
    let table = |setting: &str, faults: &[Fault], trials: u64, data: &dyn Fn(u64) -> (Rig, Recording)| {
        table(setting, faults, trials, &words, data);
    };
    println!("{:56} {:>8} {:>8} of {trials}", "", "found", "others");
    table("targets and tip poses", &faults::of_targets(), trials, &|seed| faults::targets(seed, 30, false));
    table("tip poses and pixels, random rig", &faults::of_tips(), trials, &|seed| {
        by_tips(&random_rig(6, 2, 12, seed), seed)
    });
    table("joints and pixels, random rig", &faults::of_joints(), trials, &|seed| {
        by_joints(&random_rig(6, 2, 12, seed), seed)
    });
    table("joints and pixels, the chain of a UR5", &faults::of_ur_arms(), trials, &faults::ur5);
    table("joints and pixels, a random rig on the move", &faults::of_dense_motion(), trials, &faults::dense_motion);
    if let Some((rig, recording)) = ur3e() {
        let tips = tips_in_place_of_joints(&rig, &recording);
        table("ur3e-checkerboard, 25 tip poses of it", &faults::of_tips(), trials, &|seed| {
            (tips.0.clone(), part(&tips.1, seed))
        });
        let of_arm: Vec<Fault> = faults::of_joints().into_iter().chain(faults::of_ur_arms()).collect();
        table("ur3e-checkerboard, 25 samples of it", &of_arm, trials, &|seed| (rig.clone(), part(&recording, seed)));
    }
}

fn table(setting: &str, faults: &[Fault], trials: u64, words: &[String], data: &dyn Fn(u64) -> (Rig, Recording)) {
    let is_wanted = |name: &str| words.is_empty() || words.iter().any(|word| name.contains(word.as_str()));
    let clean = format!("{setting}, clean");
    if is_wanted(&clean) {
        let alarms = (1..=trials).filter(|seed| !found(&data(*seed)).is_empty()).count();
        println!("{clean:56} {:>8} {alarms:8}", "");
    }
    for fault in faults {
        let name = format!("{setting}, {}", fault.name);
        if !is_wanted(&name) {
            continue;
        }
        let (mut hits, mut others) = (0, 0);
        for seed in 1..=trials {
            let mut data = data(seed);
            (fault.plant)(&mut data.0, &mut data.1);
            let found = found(&data);
            let hit = found.iter().filter(|what| what.contains(fault.says)).count();
            hits += usize::from(hit > 0);
            others += usize::from(found.len() > hit);
        }
        println!("{name:56} {hits:8} {others:8}");
    }
}

fn found((rig, recording): &(Rig, Recording)) -> Vec<String> {
    examine(rig, recording, &Options::default()).findings.into_iter().map(|finding| finding.what).collect()
}

fn by_joints(rig: &Rig, seed: u64) -> (Rig, Recording) {
    let simulation =
        simulate(rig, &SimulateOptions { seed, ..SimulateOptions::default() }).expect("the rig is in view");
    (Rig::default(), simulation.recording)
}

fn by_tips(rig: &Rig, seed: u64) -> (Rig, Recording) {
    let simulation =
        simulate(rig, &SimulateOptions { seed, ..SimulateOptions::default() }).expect("the rig is in view");
    let mut recording = simulation.recording;
    recording.joints.clear();
    for (sample, truth) in recording.samples.iter_mut().zip(simulation.truth.samples) {
        (sample.joints, sample.pose) = (None, truth.pose);
    }
    (Rig::default(), recording)
}

/// The real recording without its own mistakes, where it is beside the project.
fn ur3e() -> Option<(Rig, Recording)> {
    let shared = std::env::var("HANDEYE_SHARED").unwrap_or_else(|_| "../shared".to_owned());
    let folder = std::path::Path::new(&shared).join("data/ur3e-checkerboard");
    let mut rig = Rig::read(&folder.join("ur3e.toml")).ok()?;
    let mut recording = Recording::read(&folder.join("recording.jsonl")).ok()?;
    rig.cameras.retain(|camera| camera.name != "cam3");
    let cameras: Vec<String> = recording.cameras.iter().map(|camera| camera.name.clone()).collect();
    for (index, sample) in recording.samples.iter_mut().enumerate() {
        let wrong = [8, 13, 14, 30, 32, 37].contains(&index);
        sample.pixels.retain(|seen| match cameras[seen.camera as usize].as_str() {
            "cam3" => false,
            "cam4" => !wrong,
            _ => true,
        });
    }
    Some((rig, recording.select(|sample| sample != 24 && sample != 25)))
}

/// The recording with the tip poses of the nominal chain.
fn tips_in_place_of_joints(rig: &Rig, recording: &Recording) -> (Rig, Recording) {
    let arm = Rig { cameras: Vec::new(), features: Vec::new(), ..rig.clone() };
    let model = Model::new(&arm).expect("the chain is known");
    let (mut rig, mut recording) = (rig.clone(), recording.clone());
    for sample in &mut recording.samples {
        sample.pose = sample.joints.take().map(|joints| model.tip(&joints));
    }
    recording.joints.clear();
    rig.robot = handeye::rig::Robot::default();
    rig.estimate.fixed.retain(|path| !path.starts_with("robot"));
    rig.estimate.prior.retain(|path, _| !path.starts_with("robot"));
    (rig, recording)
}

/// 25 samples that depend on the seed.
fn part(recording: &Recording, seed: u64) -> Recording {
    let n = recording.samples.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|i| (*i as u64 + 1).wrapping_mul(2 * seed + 0x9e37_79b9_7f4a_7c15).rotate_left(17) % 10_007);
    let chosen = &order[..n.min(25)];
    recording.select(|sample| chosen.contains(&sample))
}
