//! Joints servoed to pixels without a rig or with an outdated one, with trackers that fail.
use crate::servo_loop::goal;
use handeye::Error;
use handeye::infer::{Names, Sighting};
use handeye::rig::{Limits, Rig, catalog};
use handeye::servo::limits::TipSpeed;
use handeye::servo::uncalibrated::{Foresight, Phase, Quantity, Row, Settings, Trust, Uncalibrated};
use handeye::servo::{
    Command, Controller, Limit, LimitRows, LoopSettings, Measurement, ModelBased, ServoLoop, Stop, Takes,
    UncalibratedJoints,
};
use handeye::simulate::world::{Execution, Fault, FaultKind, Tracker, World, WorldOptions};
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[path = "../../benches/common/moved_camera.rs"]
mod moved_camera;

const PIXELS: f64 = 0.3;

fn settings() -> LoopSettings {
    LoopSettings { tolerance_px: 1.5, settled: 2, window: 30, timeout: 150.0, ..LoopSettings::default() }
}

/// A random rig, a start, and a target a quarter of the way to other joints, with all features in view of both.
fn rig_and_way(seed: u64, share: f64) -> (Rig, Vec<f64>, Vec<f64>) {
    let rig = random_rig(6, 2, 12, seed);
    let options = SimulateOptions { samples: 2, seed, in_view: 1.0, ..SimulateOptions::default() };
    let samples = simulate(&rig, &options).unwrap().truth.samples;
    let [start, end] = [0, 1].map(|index| samples[index].joints.clone().unwrap());
    let world = World::new(&rig, &start, WorldOptions::default()).unwrap();
    let all = world.exact(&start).len();
    let towards = |share: f64| start.iter().zip(&end).map(|(a, b)| a + share * (b - a)).collect::<Vec<f64>>();
    let share = [share, 0.5 * share, 0.25 * share].into_iter().find(|share| world.exact(&towards(*share)).len() == all);
    let target = towards(share.unwrap_or(1.0));
    (rig, start, target)
}

/// What a loop came to.
struct End {
    stop: Stop,
    commands: usize,
    /// Mean pixel distance from the goal in truth, at the end and at first [px].
    error_px: f64,
    began_px: f64,
}

/// Runs a loop to its stop, while every step is held against the hard limits; `stale`: ticks in which the measurement of before is given again. `slack`: by how much the range may seem exceeded [rad], infinite where a
/// controller infers the joints and does not look at readings.
fn run<C: Controller>(world: &mut World, rig: &Rig, controller: C, target: &[f64], stale: &[usize], slack: f64) -> End {
    let names = Names::new(rig, world.header());
    let aimed_at = goal(world, &names, target);
    let mut servo = ServoLoop::new(controller, settings());
    servo.aim(&aimed_at);
    let began_px = distance(&goal(world, &names, world.joints()), &aimed_at);
    let (mut commands, mut tick_number) = (0, 0);
    let mut sample = world.look();
    loop {
        if !stale.contains(&tick_number) {
            sample = world.look();
        }
        let (joints, seen) = (sample.joints.clone().unwrap_or_default(), names.sightings(&sample));
        let now = Measurement { time: sample.time.unwrap(), joints: &joints, seen: &seen, points: &[] };
        let tick = servo.tick(world.time(), &now, &[], 1.0).unwrap();
        let age = world.time() - now.time;
        assert!(age <= servo.settings.watchdog || tick.command == Command::Hold, "moves on data {age} s old");
        if let Command::JointDelta(motion) = &tick.command {
            for ((joint, motion), now) in rig.robot.joints.iter().zip(motion).zip(&joints) {
                let [lower, upper] = [joint.limits.lower.unwrap(), joint.limits.upper.unwrap()];
                let room = lower - slack..=upper + slack;
                assert!(*motion == 0.0 || room.contains(&(now + motion)), "{now} {motion}");
                assert!(joint.limits.velocity.is_none_or(|fastest| motion.abs() <= fastest + 1e-9));
            }
        }
        if let Some(stop) = tick.stop {
            let error_px = distance(&goal(world, &names, world.joints()), &aimed_at);
            return End { stop, commands, error_px, began_px };
        }
        commands += usize::from(tick.command != Command::Hold);
        world.execute(&tick.command, 1.0).unwrap();
        tick_number += 1;
    }
}

/// Mean distance of what is seen from what is aimed at [px].
fn distance(seen: &[Sighting], goal: &[Sighting]) -> f64 {
    let distance = |aim: &Sighting| {
        let seen = seen.iter().find(|seen| (seen.camera, seen.feature) == (aim.camera, aim.feature));
        seen.map(|seen| (seen.pixel[0] - aim.pixel[0]).hypot(seen.pixel[1] - aim.pixel[1]))
    };
    let distances: Vec<f64> = goal.iter().filter_map(distance).collect();
    distances.iter().sum::<f64>() / distances.len().max(1) as f64
}

fn noisy(seed: u64) -> WorldOptions {
    WorldOptions { tracker: Tracker::Gaussian(PIXELS), seed, ..WorldOptions::default() }
}

fn none(rig: &Rig) -> UncalibratedJoints {
    UncalibratedJoints::new(&rig.robot.joints, PIXELS, Settings::default()).unwrap()
}

fn hybrid(rig: &Rig) -> UncalibratedJoints {
    UncalibratedJoints::with_rig(rig, PIXELS, Settings::with_rig()).unwrap()
}

fn mean(list: &[usize]) -> f64 {
    list.iter().sum::<usize>() as f64 / list.len().max(1) as f64
}

#[test]
fn a_true_rig_leads_there_as_fast_as_model_based_and_an_outdated_one_much_faster_than_none() {
    let (mut truly, mut by_model, mut moved, mut without) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let count = 100;
    for seed in 1..=count {
        let (rig, start, target) = rig_and_way(seed, 1.0);
        let go = |controller: UncalibratedJoints, steps: &mut Vec<usize>| {
            let mut world = World::new(&rig, &start, noisy(seed)).unwrap();
            let end = run(&mut world, &rig, controller, &target, &[], 1e-9);
            if matches!(end.stop, Stop::Converged { .. }) {
                assert!(end.error_px < 4.0, "seed {seed}: {} px", end.error_px);
                steps.push(end.commands);
            }
        };
        go(hybrid(&rig), &mut truly);
        go(hybrid(&moved_camera::with_moved_camera(&rig, seed)), &mut moved);
        go(none(&rig), &mut without);
        let mut world = World::new(&rig, &start, noisy(seed)).unwrap();
        let end = run(&mut world, &rig, ModelBased::new(&rig).unwrap(), &target, &[], f64::INFINITY);
        by_model.extend(matches!(end.stop, Stop::Converged { .. }).then_some(end.commands));
    }
    println!(
        "hybrid {} in {:.2}, model-based {} in {:.2}, camera moved {} in {:.2}, no rig {} in {:.2}",
        truly.len(),
        mean(&truly),
        by_model.len(),
        mean(&by_model),
        moved.len(),
        mean(&moved),
        without.len(),
        mean(&without)
    );
    assert!(truly.len() >= by_model.len() && mean(&truly) <= mean(&by_model));
    assert!(moved.len() >= 95, "{} of {count}", moved.len());
    assert!(mean(&moved) <= 0.5 * mean(&without));
}

/// The longest step is 2 rad here, the way 3.04 rad, and what pixels alone ask for ends 30 px off at the limits of the joints.
#[test]
fn a_true_rig_leads_to_a_solution_that_is_farther_than_one_step_goes() {
    let rig = random_rig(6, 2, 12, 69);
    let options = SimulateOptions { samples: 2, seed: 69, in_view: 1.0, ..SimulateOptions::default() };
    let samples = simulate(&rig, &options).unwrap().truth.samples;
    let [start, target] = [0, 1].map(|index| samples[index].joints.clone().unwrap());
    let mut world = World::new(&rig, &start, noisy(69)).unwrap();
    let trust = Settings::with_rig().trust.map(|trust| Trust { motion: 2.0, ..trust });
    let settings = Settings { trust, ..Settings::with_rig() };
    let controller = UncalibratedJoints::with_rig(&rig, PIXELS, settings).unwrap();
    let end = run(&mut world, &rig, controller, &target, &[], 1e-9);
    assert!(matches!(end.stop, Stop::Converged { .. }), "{:?} after {} commands", end.stop, end.commands);
}

#[test]
fn loops_end_right_where_half_of_the_features_are_lost_or_trackers_drift() {
    let mut counts = std::collections::BTreeMap::new();
    for seed in 1..=200 {
        for drifts in [false, true] {
            let (rig, start, target) = rig_and_way(seed, 0.3);
            let random = &mut ChaCha8Rng::seed_from_u64(seed);
            let from = random.random_range(0.0..40.0_f64).floor();
            let stale: Vec<usize> = (0..3).map(|_| random.random_range(0..40)).collect();
            let fault = |camera, feature, kind| Fault { camera, feature, kind, from, until: f64::INFINITY };
            let faults: Vec<Fault> = if drifts {
                let speed = random.random_range(0.2..3.0);
                let kind = FaultKind::Drifting([speed, -0.5 * speed]);
                (0..3).map(|_| fault(random.random_range(0..2), random.random_range(0..12), kind)).collect()
            } else {
                (0..12).map(|k| fault(k % 2, k / 2 * 2, FaultKind::Lost)).collect()
            };
            let mut world = World::new(&rig, &start, WorldOptions { faults, ..noisy(seed) }).unwrap();
            let End { stop, error_px, .. } = run(&mut world, &rig, none(&rig), &target, &stale, 1e-9);
            *counts.entry((drifts, stop.name())).or_insert(0) += 1;
            // What is said to have converged has, in truth.
            match stop {
                Stop::Converged { .. } => {
                    assert!(error_px < 4.0, "seed {seed}, drifts {drifts}: {error_px} px in truth");
                }
                other => println!("seed {seed}, drifts {drifts}: {other:?}, {error_px:.2} px"),
            }
        }
    }
    println!("{counts:?}");
    // Where trackers drift before slopes are known, or several do in one camera, a loop may go on to where it can do no better.
    assert_eq!(counts[&(false, "converged")], 200, "{counts:?}");
    assert!(counts[&(true, "converged")] >= 195, "{counts:?}");
    assert!(counts.keys().all(|(_, name)| ["converged", "no-better"].contains(name)), "{counts:?}");
}

#[test]
fn a_robot_with_a_dead_band_or_without_readings_arrives_too() {
    let mut blocked = 0;
    for seed in 1..=10 {
        let (rig, start, target) = rig_and_way(seed, 0.2);
        let unread = WorldOptions { readings: None, ..noisy(seed) };
        let dead = Execution { dead_band: 0.002, ..Execution::default() };
        for options in [unread, WorldOptions { execution: dead, ..noisy(seed) }] {
            let mut controller = none(&rig);
            if options.execution.dead_band > 0.0 {
                controller.dead_bands(&[0.002; 6]).unwrap();
            }
            let mut world = World::new(&rig, &start, options).unwrap();
            let end = run(&mut world, &rig, controller, &target, &[], 1e-9);
            // A start at the end of a joint may keep it there.
            blocked += usize::from(matches!(end.stop, Stop::Blocked { .. }));
            assert!(end.stop.is_success() || matches!(end.stop, Stop::Blocked { .. }), "seed {seed}: {:?}", end.stop);
            let (ended, began) = (end.error_px, end.began_px);
            assert!(ended < 3.5 && began > 4.0 * ended, "seed {seed}: {ended} of {began} px");
        }
    }
    assert!(blocked <= 1, "{blocked} of 20");
}

#[test]
fn a_reading_that_is_no_number_holds_the_arm_and_teaches_nothing() {
    for seed in 1..=10 {
        let (rig, start, target) = rig_and_way(seed, 0.2);
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let mut world = World::new(&rig, &start, noisy(seed)).unwrap();
        let names = Names::new(&rig, world.header());
        let aimed_at = goal(&world, &names, &target);
        let mut servo = ServoLoop::new(none(&rig), settings());
        servo.aim(&aimed_at);
        let mut told = [0; 2];
        let stop = loop {
            let sample = world.look();
            let (mut joints, seen) = (sample.joints.clone().unwrap(), names.sightings(&sample));
            // The first of all, and one in ten.
            let is_lost = world.time() == 0.0 || random.random::<f64>() < 0.1;
            if is_lost {
                joints[2] = f64::NAN;
            }
            let now = Measurement { time: world.time(), joints: &joints, seen: &seen, points: &[] };
            let tick = servo.tick(world.time(), &now, &[], 1.0).unwrap();
            if let Some(stop) = tick.stop {
                break stop;
            }
            assert!(!is_lost || tick.command == Command::Hold, "seed {seed}: moves without a reading");
            if let Command::JointDelta(motion) = &tick.command {
                assert!(motion.iter().all(|motion| motion.abs() < 0.6), "seed {seed}: {motion:?}");
            }
            told[usize::from(is_lost)] += 1;
            world.execute(&tick.command, 1.0).unwrap();
        };
        let error_px = distance(&goal(&world, &names, world.joints()), &aimed_at);
        assert!(
            !matches!(stop, Stop::Diverged { .. } | Stop::Lost { .. }) && error_px < 4.0,
            "seed {seed}: {stop:?}, {error_px} px"
        );
        assert!(told[1] > 0, "seed {seed}: {told:?}");
    }
}

#[test]
fn a_target_that_moves_keeps_what_was_learned() {
    let (rig, start, target) = rig_and_way(2, 0.2);
    let mut world = World::new(&rig, &start, noisy(1)).unwrap();
    let names = Names::new(&rig, world.header());
    let follow = LoopSettings { follow: true, ..settings() };
    let mut servo = ServoLoop::new(none(&rig), follow);
    let mut errors = Vec::new();
    for step in 0..60 {
        let moving: Vec<f64> = target.iter().map(|joint| joint + 0.002 * f64::from(step)).collect();
        servo.aim(&goal(&world, &names, &moving));
        let sample = world.look();
        let seen = names.sightings(&sample);
        let now =
            Measurement { time: world.time(), joints: sample.joints.as_deref().unwrap(), seen: &seen, points: &[] };
        let tick = servo.tick(world.time(), &now, &[], 1.0).unwrap();
        assert_eq!(tick.stop, None, "step {step}");
        errors.push(tick.error_px.unwrap());
        world.execute(&tick.command, 1.0).unwrap();
    }
    // It goes on by about a pixel a step; a loop that explored anew at each would stay where it is.
    assert!(errors[59] < 0.1 * errors[0], "{} of {} px behind", errors[59], errors[0]);
}

#[test]
fn a_loop_that_gave_up_begins_anew_with_another_goal() {
    let (rig, start, target) = rig_and_way(2, 0.2);
    let mut world = World::new(&rig, &start, noisy(1)).unwrap();
    let names = Names::new(&rig, world.header());
    let aimed_at = goal(&world, &names, &target);
    let mut controller = none(&rig);
    controller.aim(&aimed_at);
    // Pixels that no motion explains: the sum of the errors leaps.
    let mut stop = None;
    for step in 0..100 {
        let sample = world.look();
        let mut seen = names.sightings(&sample);
        if controller.phase() == Some(&Phase::Servoing) {
            seen.iter_mut().for_each(|seen| seen.pixel[0] += 200.0);
        }
        let now =
            Measurement { time: f64::from(step), joints: sample.joints.as_deref().unwrap(), seen: &seen, points: &[] };
        let decision = controller.decide(&now, &[], 1.0).unwrap();
        stop = decision.stop;
        if stop.is_some() {
            break;
        }
        world.execute(&decision.command, 1.0).unwrap();
    }
    assert!(matches!(stop, Some(Stop::Diverged { .. })), "{stop:?}");
    let end = run(&mut world, &rig, controller, &start, &[], 1e-9);
    assert!(matches!(end.stop, Stop::Converged { .. }), "{:?}", end.stop);
}

#[test]
fn what_it_cannot_do_is_said() {
    let (rig, start, target) = rig_and_way(1, 0.2);
    let refused = |error: Error, what: &str| assert!(error.to_string().contains(what), "{error}");
    refused(UncalibratedJoints::new(&[], PIXELS, Settings::default()).err().unwrap(), "quantities");
    refused(UncalibratedJoints::new(&rig.robot.joints, -1.0, Settings::default()).err().unwrap(), "-1 px");
    refused(none(&rig).dead_bands(&[0.1]).unwrap_err(), "6 numbers");
    let world = &mut World::new(&rig, &start, noisy(1)).unwrap();
    let names = Names::new(&rig, world.header());
    let (sample, aimed_at) = (world.look(), goal(world, &names, &target));
    let seen = names.sightings(&sample);
    let now = |seen| Measurement { time: 0.0, joints: sample.joints.as_deref().unwrap(), seen, points: &[] };
    let mut controller = none(&rig);
    controller.aim(&aimed_at);
    refused(controller.decide(&now(&seen[..2]), &[], 1.0).unwrap_err(), "2 of the 24 features");
    controller.takes = Takes::Joints;
    refused(controller.decide(&Measurement { joints: &[], ..now(&seen) }, &[], 1.0).unwrap_err(), "not read");
    controller.takes = Takes::JointDelta;
    let limit = TipSpeed { speed: 1.0, strength: 10.0 };
    let limits: [&dyn Limit; 1] = [&limit];
    refused(controller.decide(&now(&seen), &limits, 1.0).unwrap_err(), "need a rig");
    controller.takes = Takes::PoseDelta;
    refused(controller.decide(&now(&seen), &[], 1.0).unwrap_err(), "pose-deltas");
    // With a rig, limits hold.
    let mut with_rig = hybrid(&rig);
    with_rig.aim(&aimed_at);
    assert!(
        !with_rig.decide(&now(&seen), &[&TipSpeed { speed: 0.001, strength: 10.0 }], 1.0).unwrap().active.is_empty()
    );
}

/// A model of two quantities and four rows that says what it is told to.
struct Told {
    slopes: Vec<f64>,
    solution: Option<Vec<f64>>,
}

impl Foresight for Told {
    fn predict(&mut self, _: &[f64], errors: &mut Vec<f64>, slopes: &mut Vec<f64>) {
        (*errors, *slopes) = (vec![0.0; self.slopes.len() / 2], self.slopes.clone());
    }

    fn solution(&mut self, _: &[f64]) -> Option<Vec<f64>> {
        self.solution.clone()
    }

    fn doubts(&mut self, _: &[f64], errors: &[f64]) -> Vec<DMatrix<f64>> {
        vec![DMatrix::identity(2, 2); errors.len()]
    }
}

#[test]
fn a_model_that_says_nothing_of_use_gives_way_to_exploring_and_one_that_is_wrong_to_what_is_seen() {
    let slopes = [[300.0, 40.0], [-20.0, 250.0], [100.0, -150.0], [60.0, 80.0]];
    let told = |slopes: Vec<f64>, solution| Told { slopes, solution };
    let flat = slopes.concat();
    let turned: Vec<f64> = slopes.iter().flat_map(|row| [row[0] + 0.6 * row[1], row[1] - 0.6 * row[0]]).collect();
    let models = [
        (told(Vec::new(), None), true),
        (told(vec![f64::NAN; 8], None), true),
        (told(flat[..6].to_vec(), Some(vec![0.0; 2])), true),
        (told(flat.clone(), Some(vec![0.0])), false),
        (told(flat, Some(vec![f64::NAN; 2])), false),
        (told(turned, Some(vec![7.0, -7.0])), false),
    ];
    for (case, (model, explores)) in models.into_iter().enumerate() {
        let rows = (0..4).map(|row| Row { sd: 0.1, camera: row / 2 }).collect();
        let quantities = vec![Quantity::default(); 2];
        let mut servo = Uncalibrated::new(quantities, rows, Settings::with_rig()).unwrap();
        servo.begin_with_model(Box::new(model));
        let mut limits = LimitRows::default();
        limits.clear(2);
        let mut at = [0.3, -0.2];
        let mut explored = false;
        for _ in 0..40 {
            let errors = slopes.map(|row| row[0] * at[0] + row[1] * at[1]);
            let command = servo.step(&at, &errors, &limits, 1.0).unwrap();
            explored |= *command.phase == Phase::Exploring;
            at.iter_mut().zip(command.motion).for_each(|(at, motion)| *at += motion);
        }
        assert!(at.iter().all(|at| at.abs() < 2e-3), "case {case}: {at:?}");
        assert!(explored || !explores, "case {case}");
    }
}

/// Errors are 200 (q² - 1): there are two solutions.
struct Parabola;

impl Foresight for Parabola {
    fn predict(&mut self, at: &[f64], errors: &mut Vec<f64>, slopes: &mut Vec<f64>) {
        (*errors, *slopes) = (vec![200.0 * (at[0] * at[0] - 1.0); 2], vec![400.0 * at[0]; 2]);
    }

    fn solution(&mut self, _: &[f64]) -> Option<Vec<f64>> {
        Some(vec![-1.0])
    }

    fn doubts(&mut self, _: &[f64], errors: &[f64]) -> Vec<DMatrix<f64>> {
        vec![DMatrix::identity(1, 1); errors.len()]
    }
}

#[test]
fn a_model_leads_to_the_solution_that_the_limits_allow_and_not_to_a_nearer_one_beyond() {
    for (upper, end) in [(None, 1.0), (Some(0.5), -1.0)] {
        let quantity = Quantity { limits: Limits { upper, ..Limits::default() }, ..Quantity::default() };
        let rows = vec![Row { sd: 0.1, camera: 0 }, Row { sd: 0.1, camera: 1 }];
        let mut servo = Uncalibrated::new(vec![quantity], rows, Settings::with_rig()).unwrap();
        servo.begin_with_model(Box::new(Parabola));
        let mut limits = LimitRows::default();
        limits.clear(1);
        let mut at = 0.3;
        for _ in 0..20 {
            let (mut errors, mut slopes) = (Vec::new(), Vec::new());
            Parabola.predict(&[at], &mut errors, &mut slopes);
            at += servo.step(&[at], &errors, &limits, 1.0).unwrap().motion[0];
        }
        assert!((at - end).abs() < 1e-3, "{at}, and {end} is inside an upper limit of {upper:?}");
    }
}

#[test]
fn a_start_at_the_target_or_near_it_is_neither_divergence_nor_one_point_of_view() {
    let rig = catalog::rig("ur5").unwrap();
    for seed in 1..=10 {
        let options = SimulateOptions { samples: 1, seed, in_view: 1.0, ..SimulateOptions::default() };
        let start = simulate(&rig, &options).unwrap().truth.samples[0].joints.clone().unwrap();
        for off in [0.0, 0.002, 0.004, 0.006, 0.008, 0.02] {
            let mut target = start.clone();
            target[seed as usize % 6] += off;
            let mut world = World::new(&rig, &start, noisy(seed)).unwrap();
            let End { stop, commands, error_px, .. } = run(&mut world, &rig, none(&rig), &target, &[], 1e-9);
            assert!(matches!(stop, Stop::Converged { .. }), "seed {seed}, {off} rad off: {stop:?} at {error_px} px");
            assert!(off > 0.0 || commands == 0, "seed {seed}: {commands} commands where nothing is to be done");
        }
    }
}
