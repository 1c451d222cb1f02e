//! Servoing without a rig: default settings beside a Jacobian that is kept, cameras carried around the target; and CPU time of one step.
//!
//! `cargo bench --bench uncalibrated -- [SCENES [PLACES]] [TRACKER...]`: scenes drawn beside the reconstructed one and that of round numbers,
//! places of the cameras in each, and which trackers: all where none is named.
//! `diverged` counts the runs whose errors grew by more than 100 px in a step, `kept` those with the Jacobian kept; `refused` those that were
//! stopped with the reason that what is seen does not determine the motion. Iterations, image and 3D errors are ratios to those with the
//! Jacobian kept, over the places where both arrive: mean over the rows, largest, and how many rows are above 1. A row is one scene,
//! exploratory motion and gain. Last stand the iterations on the reconstructed scene, most of its rows. The second table is what the exact
//! Jacobian of every moment leads to with the same gain and trackers, and no regard for how far it holds: nobody can know it better.
//! In the third, points are seen exactly and only their target is rounded: the 3D error that is left then is what trackers that round leave open; its image errors are not of whole
//! pixels, and say nothing.
use cpu_time::ThreadTime;
use handeye::experiments::camera_rotation::{ITERATIONS, Run, Scene, Tracker, View, World, carried_around};
use handeye::servo::LimitRows;
use handeye::servo::uncalibrated::{Exploration, Phase, Settings, Stop, Uncalibrated};
use handeye::solvers::nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

const TRACKERS: [(&str, Tracker); 3] =
    [("perfect", Tracker::Perfect), ("rounded", Tracker::Rounded), ("0.2 px", Tracker::Gaussian(0.2))];
const SIZES_DEG: [f64; 5] = [2.0, 4.0, 6.0, 8.0, 10.0];
const GAINS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// Errors below these count as none [px, m].
const NONE: [f64; 2] = [1e-3, 1e-6];

fn main() {
    let numbers: Vec<usize> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    let is_named = |(name, _): &&(&str, Tracker)| std::env::args().any(|argument| argument == *name);
    let named: Vec<_> = TRACKERS.iter().filter(is_named).copied().collect();
    let trackers = if named.is_empty() { TRACKERS.to_vec() } else { named };
    let scenes = numbers.first().copied().unwrap_or(4);
    let places = numbers.get(1).copied().unwrap_or(36);
    let drawn = (0..scenes as u64).map(|seed| Scene::drawn(seed).expect("the shipped arm"));
    let scenes: Vec<Scene> = [Scene::RECONSTRUCTED, Scene::ROUND].into_iter().chain(drawn).collect();
    println!(
        "{} scenes, {places} places of the cameras, ratios to the Jacobian kept as mean / largest / rows above 1",
        scenes.len()
    );
    let around = |scene: &Scene, tracker: Tracker, settings: &Settings| {
        carried_around(scene, tracker, settings, places, 1).expect("settings that may be")
    };
    table(&scenes, &trackers, &around, &|scene, tracker, gain, size| {
        let settings = Settings { gain, exploration: Exploration::fixed(size), ..Settings::default() };
        around(scene, tracker, &settings)
    });
    println!("\nthe same with the exact Jacobian of every moment");
    table(&scenes, &trackers, &around, &|scene, tracker, gain, _| {
        (0..places).map(|place| with_exact_jacobian(scene, tracker, gain, (place, places))).collect()
    });
    println!("\nthe same with the exact Jacobian and points seen exactly, where only the target is rounded");
    for gain in GAINS {
        let kept = |scene: &Scene, size: f64| around(scene, Tracker::Rounded, &Settings::plain(gain, size));
        let ours = |scene: &Scene, _: f64| {
            let at = |place| with_exact_jacobian(scene, Tracker::RoundedTarget, gain, (place, places));
            (0..places).map(at).collect()
        };
        println!("{:8} {gain:>5} {}", "rounded", row(&scenes, &kept, &ours));
    }
    time();
}

/// Runs around the target, of a scene, a tracker, a gain and the size of exploratory motions [rad].
type Around<'a> = &'a dyn Fn(&Scene, Tracker, f64, f64) -> Vec<Run>;

fn table(
    scenes: &[Scene],
    trackers: &[(&str, Tracker)],
    around: &dyn Fn(&Scene, Tracker, &Settings) -> Vec<Run>,
    ours: Around<'_>,
) {
    println!(
        "{:8} {:>5} {:>9} {:>9} {:>9} {:>18} {:>18} {:>18} {:>13}",
        "tracker", "gain", "diverged", "refused", "kept", "iterations", "image error", "3D error", "reconstructed"
    );
    for &(name, tracker) in trackers {
        for gain in GAINS {
            let kept = |scene: &Scene, size: f64| around(scene, tracker, &Settings::plain(gain, size));
            let ours = |scene: &Scene, size: f64| ours(scene, tracker, gain, size);
            println!("{name:8} {gain:>5} {}", row(scenes, &kept, &ours));
        }
    }
}

fn row(scenes: &[Scene], kept: &dyn Fn(&Scene, f64) -> Vec<Run>, ours: &dyn Fn(&Scene, f64) -> Vec<Run>) -> String {
    let (mut diverged, mut refused, mut diverged_kept) = (0, 0, 0);
    let mut ratios: [Vec<f64>; 3] = Default::default();
    let mut reconstructed = Vec::new();
    for (index, scene) in scenes.iter().enumerate() {
        for size_deg in SIZES_DEG {
            let [kept, ours] = [kept, ours].map(|around| around(scene, size_deg.to_radians()));
            diverged += ours.iter().filter(|run| run.diverged()).count();
            refused += ours.iter().filter(|run| run.stop.is_some() && !run.diverged()).count();
            diverged_kept += kept.iter().filter(|run| run.diverged()).count();
            let arrive = |run: &Run| !run.diverged() && run.steps(1).is_some();
            let both: Vec<usize> = (0..kept.len()).filter(|i| arrive(&kept[*i]) && arrive(&ours[*i])).collect();
            let figures = |runs: &[Run]| -> [f64; 3] {
                [
                    mean(both.iter().map(|i| runs[*i].steps(1).unwrap_or(0) as f64)),
                    mean(both.iter().map(|i| runs[*i].errors.last().copied().unwrap_or(0.0))).max(NONE[0]),
                    mean(both.iter().map(|i| runs[*i].error_3d)).max(NONE[1]),
                ]
            };
            let (ours_are, kept_are) = (figures(&ours), figures(&kept));
            if !both.is_empty() {
                (0..3).for_each(|k| ratios[k].push(ours_are[k] / kept_are[k]));
            }
            if index == 0 {
                reconstructed.push(mean(ours.iter().filter_map(|run| run.steps(1)).map(|steps| steps as f64)));
            }
        }
    }
    let cell = |ratios: &Vec<f64>| {
        if ratios.is_empty() {
            return "-".to_owned();
        }
        let worse = ratios.iter().filter(|ratio| **ratio > 1.0).count();
        format!("{:.2} / {:.2} / {worse}", mean(ratios.iter().copied()), ratios.iter().copied().fold(0.0, f64::max))
    };
    let worst = reconstructed.iter().copied().fold(0.0, f64::max);
    let [iterations, image, space] = ratios.each_ref().map(cell);
    format!("{diverged:>9} {refused:>9} {diverged_kept:>9} {iterations:>18} {image:>18} {space:>18} {worst:>13.2}")
}

/// Half the distance of the differences that stand for derivatives [rad].
const STEP: f64 = 1e-6;

/// dq = -λ J⁺ e with J where the arm is; it diverges as the others do.
fn with_exact_jacobian(scene: &Scene, tracker: Tracker, gain: f64, (place, places): (usize, usize)) -> Run {
    let views = View::pair(TAU * place as f64 / places as f64);
    let world = |tracker: Tracker| World::new(scene, &views, tracker, place as u64).expect("the shipped arm");
    let (mut world, mut exact) = (world(tracker), world(Tracker::Perfect));
    let mut run = Run { errors: Vec::new(), error_3d: 0.0, condition: None, stop: None };
    let mut before = Vec::new();
    let size = |errors: &[f64]| errors.iter().map(|error| error.abs()).sum::<f64>();
    for _ in 0..=ITERATIONS {
        let (joints, errors) = (world.joints().to_vec(), world.errors());
        run.errors.push(size(&errors));
        let growth = size(&errors) - size(&before);
        if !before.is_empty() && (growth.is_nan() || growth > Settings::default().divergence) {
            run.stop = Some(Stop::Diverged { growth });
            return run;
        }
        run.error_3d = world.error_3d();
        let mut slope = |joint: usize| {
            let mut there = |by: f64| {
                let mut there = joints.clone();
                there[joint] += by;
                exact.move_to(&there);
                DVector::from_vec(exact.errors())
            };
            (there(STEP) - there(-STEP)) / (2.0 * STEP)
        };
        let jacobian = DMatrix::from_columns(&(0..joints.len()).map(&mut slope).collect::<Vec<_>>());
        let motion = jacobian.svd(true, true).solve(&DVector::from_column_slice(&errors), 0.0).expect("both factors");
        let there: Vec<f64> = joints.iter().zip(motion.iter()).map(|(joint, motion)| joint - gain * motion).collect();
        world.move_to(&there);
        before = errors;
    }
    run
}

fn mean(figures: impl Iterator<Item = f64>) -> f64 {
    let all: Vec<f64> = figures.collect();
    all.iter().sum::<f64>() / all.len().max(1) as f64
}

/// One step of 6 joints and 12 rows, with no limit active.
fn time() {
    let mut world =
        World::new(&Scene::RECONSTRUCTED, &View::pair(0.0), Tracker::Gaussian(0.2), 1).expect("the shipped arm");
    let mut limits = LimitRows::default();
    limits.clear(6);
    let mut times = Vec::new();
    for _ in 0..100 {
        world.move_to(&Scene::RECONSTRUCTED.start);
        let mut servo =
            Uncalibrated::new(world.quantities(), world.rows(), Settings::default()).expect("settings that may be");
        for _ in 0..100 {
            let (joints, errors) = (world.joints().to_vec(), world.errors());
            let explored = servo.phase() != &Phase::Exploring;
            let before = ThreadTime::now();
            let motion = servo.step(&joints, &errors, &limits, 1.0).expect("6 joints, 12 rows").motion;
            let elapsed = before.elapsed();
            let there: Vec<f64> = joints.iter().zip(motion).map(|(joint, motion)| joint + motion).collect();
            world.move_to(&there);
            if explored {
                times.push(1e6 * elapsed.as_secs_f64());
            }
        }
    }
    times.sort_by(f64::total_cmp);
    let n = times.len();
    println!(
        "\none step of 6 joints and 12 rows: median {:.1} µs (5 wanted), 99 % {:.1} µs",
        times[n / 2],
        times[n * 99 / 100]
    );
}
