//! Servoing with a rig that is outdated, beside the same without any rig and with the true one.
//!
//! `cargo bench --bench hybrid [-- RIGS]`. Random rigs of 6 joints, 2 cameras, 12 features at 0.3 px; starts and targets with all features in
//! view. *Moved*: one camera of the rig that is known stands 10 cm beside where it is in truth, and is turned by 10 degrees. Commands are
//! counted until the mean pixel distance is below 1 px, exploration included.
use handeye::infer::{Names, Sighting};
use handeye::recording::Sample;
use handeye::rig::Rig;
use handeye::servo::uncalibrated::Settings;
use handeye::servo::{
    Command, Controller, LoopSettings, Measurement, ModelBased, ServoLoop, Stop, Takes, UncalibratedJoints,
};
use handeye::simulate::world::{Tracker, World, WorldOptions};
use handeye::simulate::{SimulateOptions, random_rig, simulate};

#[path = "common/moved_camera.rs"]
mod moved_camera;

/// The rig that is known of a true one, and the controller that it makes.
type Known = fn(&Rig, u64) -> Rig;
type Makes = fn(&Rig) -> Box<dyn Controller>;

const PIXELS: f64 = 0.3;
const ARRIVED: f64 = 1.0;

fn main() {
    let rigs: u64 = std::env::args().filter_map(|argument| argument.parse().ok()).next().unwrap_or(100);
    println!("{:34} {:>9} {:>8} {:>8} {:>8}   others", "", "arrived", "median", "mean", "worst");
    let kinds: [(&str, Known, Makes); 5] = [
        ("true rig, model-based", same, model_based),
        ("true rig, hybrid", same, hybrid),
        ("camera moved, model-based", moved_camera::with_moved_camera, model_based),
        ("camera moved, hybrid", moved_camera::with_moved_camera, hybrid),
        ("no rig", same, none),
    ];
    for (name, known, controller) in kinds {
        let mut steps = Vec::new();
        let mut others = std::collections::BTreeMap::new();
        for seed in 1..=rigs {
            match run(seed, known, controller) {
                (Stop::Converged { .. }, commands) => steps.push(commands),
                (stop, _) => *others.entry(stop.name()).or_insert(0) += 1,
            }
        }
        steps.sort_unstable();
        let mean = steps.iter().sum::<usize>() as f64 / steps.len().max(1) as f64;
        let (median, worst) = (steps.get(steps.len() / 2).unwrap_or(&0), steps.last().unwrap_or(&0));
        println!("{name:34} {:4} / {rigs:<2} {median:8} {mean:8.2} {worst:8}   {others:?}", steps.len());
    }
}

fn run(seed: u64, known: Known, controller: Makes) -> (Stop, usize) {
    let truth = random_rig(6, 2, 12, seed);
    let options = SimulateOptions { samples: 2, seed, in_view: 1.0, ..SimulateOptions::default() };
    let places = simulate(&truth, &options).expect("in view").truth.samples;
    let joints = |index: usize| places[index].joints.clone().expect("recorded");
    let options = WorldOptions { tracker: Tracker::Gaussian(PIXELS), seed, ..WorldOptions::default() };
    let mut world = World::new(&truth, &joints(0), options).expect("complete");
    let names = Names::new(&truth, world.header());
    let goal: Vec<Sighting> = names.sightings(&Sample { pixels: world.exact(&joints(1)), ..Sample::default() });
    let settings =
        LoopSettings { tolerance_px: ARRIVED, settled: 1, window: 30, timeout: 100.0, ..LoopSettings::default() };
    let mut servo = ServoLoop::new(controller(&known(&truth, seed)), settings);
    servo.aim(&goal);
    let mut commands = 0;
    loop {
        let sample = world.look();
        let (joints, seen) = (sample.joints.clone().unwrap_or_default(), names.sightings(&sample));
        let now = Measurement { time: world.time(), joints: &joints, seen: &seen, points: &[] };
        let tick = servo.tick(world.time(), &now, &[], 1.0).expect("fits");
        if let Some(stop) = tick.stop {
            return (stop, commands);
        }
        commands += usize::from(tick.command != Command::Hold);
        world.execute(&tick.command, 1.0).expect("finite");
    }
}

fn model_based(rig: &Rig) -> Box<dyn Controller> {
    let mut controller = ModelBased::new(rig).expect("complete");
    controller.takes = Takes::JointDelta;
    Box::new(controller)
}

fn hybrid(rig: &Rig) -> Box<dyn Controller> {
    Box::new(UncalibratedJoints::with_rig(rig, PIXELS, Settings::with_rig()).expect("complete"))
}

fn none(rig: &Rig) -> Box<dyn Controller> {
    Box::new(UncalibratedJoints::new(&rig.robot.joints, PIXELS, Settings::default()).expect("joints"))
}

fn same(rig: &Rig, _: u64) -> Rig {
    rig.clone()
}
