//! Closed loops in simulated worlds: they arrive, or stop and say why.
use handeye::Error;
use handeye::infer::{Names, Sighting};
use handeye::recording::Sample;
use handeye::rig::{Limits, Rig, catalog};
use handeye::servo::limits::HalfSpace;
use handeye::servo::{
    Bound, Command, Constraint, Controller, Decision, Limit, LoopSettings, Measurement, ModelBased, ModelBasedTip,
    ServoLoop, Stop, Takes,
};
use handeye::simulate::world::{Execution, Tracker, World, WorldOptions};
use handeye::simulate::{SimulateOptions, simulate};

/// A rig, and pairs of start and target joints with all features in view.
pub fn rig_and_places(pairs: u64) -> (Rig, Vec<[Vec<f64>; 2]>) {
    let rig = catalog::rig("ur5").unwrap();
    let draw = |seed| {
        let options = SimulateOptions { samples: 2, seed, in_view: 1.0, ..SimulateOptions::default() };
        let samples = simulate(&rig, &options).unwrap().truth.samples;
        [0, 1].map(|index| samples[index].joints.clone().unwrap())
    };
    let places = (1..=pairs).map(draw).collect();
    (rig, places)
}

pub fn goal(world: &World, names: &Names, joints: &[f64]) -> Vec<Sighting> {
    names.sightings(&Sample { pixels: world.exact(joints), ..Sample::default() })
}

/// Runs a loop to its stop; gives the stop and the number of commands that moved the robot.
pub fn run<C: Controller>(
    world: &mut World,
    rig: &Rig,
    servo: &mut ServoLoop<C>,
    limits: &[&dyn Limit],
) -> Result<(Stop, usize), Error> {
    let names = Names::new(rig, world.header());
    let mut moved = 0;
    loop {
        let sample = world.look();
        let (joints, seen) = (sample.joints.clone().unwrap_or_default(), names.sightings(&sample));
        let now = Measurement { time: sample.time.unwrap(), joints: &joints, seen: &seen, points: &[] };
        let tick = servo.tick(world.time(), &now, limits, 1.0)?;
        if let Some(stop) = tick.stop {
            assert_eq!(tick.command, Command::Hold, "a loop that has stopped holds the robot");
            return Ok((stop, moved));
        }
        moved += usize::from(tick.command != Command::Hold);
        world.execute(&tick.command, 1.0)?;
    }
}

pub fn settings() -> LoopSettings {
    LoopSettings { tolerance_px: 0.01, settled: 1, ..LoopSettings::default() }
}

#[test]
fn a_known_rig_arrives_with_one_command_of_every_kind_that_robots_take() {
    let (rig, places) = rig_and_places(10);
    let free = unlimited(&rig);
    for &takes in Takes::ALL {
        for [start, target] in &places {
            let mut world = World::new(&free, start, WorldOptions::default()).unwrap();
            let mut controller = ModelBased::new(&free).unwrap();
            controller.takes = takes;
            let mut servo = ServoLoop::new(controller, settings());
            servo.aim(&goal(&world, &Names::new(&rig, world.header()), target));
            let (stop, moved) = run(&mut world, &rig, &mut servo, &[]).unwrap();
            assert!(matches!(stop, Stop::Converged { .. }) && moved == 1, "{takes:?}: {stop:?} after {moved}");
        }
    }
}

/// The rig without limits: a straight way of the tip may lead outside the narrow ones of its work cell.
fn unlimited(rig: &Rig) -> Rig {
    let mut free = rig.clone();
    free.robot.joints.iter_mut().for_each(|joint| joint.limits = Limits::default());
    free
}

#[test]
fn a_robot_whose_joints_are_unobserved_is_servoed_in_its_joints_or_by_its_tip_alone() {
    let (rig, places) = rig_and_places(10);
    for [start, target] in &places {
        let options = WorldOptions { readings: None, tracker: Tracker::Gaussian(0.1), ..WorldOptions::default() };
        let settings = LoopSettings { tolerance_px: 0.3, ..settings() };
        let mut world = World::new(&rig, start, options.clone()).unwrap();
        let mut servo = ServoLoop::new(ModelBased::new(&rig).unwrap(), settings);
        servo.aim(&goal(&world, &Names::new(&rig, world.header()), target));
        let (stop, moved) = run(&mut world, &rig, &mut servo, &[]).unwrap();
        assert!(stop.is_success() && moved <= 20, "joints: {stop:?} after {moved}");

        let mut chainless = rig.clone();
        chainless.robot.joints.clear();
        let mut world = World::new(&rig, start, options).unwrap();
        let mut servo = ServoLoop::new(ModelBasedTip::new(&chainless).unwrap(), settings);
        servo.aim(&goal(&world, &Names::new(&rig, world.header()), target));
        let (stop, moved) = run(&mut world, &rig, &mut servo, &[]).unwrap();
        assert!(stop.is_success() && moved <= 20, "tip: {stop:?} after {moved}");
    }
}

#[test]
fn wrong_gains_and_old_images_cost_commands_and_not_the_goal() {
    let (rig, places) = rig_and_places(20);
    for (index, [start, target]) in places.iter().enumerate() {
        let gain = (0..6).map(|joint| if (joint + index) % 2 == 0 { 0.8 } else { 1.15 }).collect();
        let execution = Execution { gain, ..Execution::default() };
        let options = WorldOptions { execution, latency: 0.3, ..WorldOptions::default() };
        let mut world = World::new(&rig, start, options).unwrap();
        let mut servo = ServoLoop::new(ModelBased::new(&rig).unwrap(), settings());
        servo.aim(&goal(&world, &Names::new(&rig, world.header()), target));
        let (stop, moved) = run(&mut world, &rig, &mut servo, &[]).unwrap();
        assert!(matches!(stop, Stop::Converged { .. }) && moved <= 9, "{stop:?} after {moved}");
    }
}

/// With noise on the actions, the loop ends where noise keeps it: at the target plus one noisy motion, in the mean.
#[test]
fn a_noisy_robot_stops_at_what_its_noise_allows_and_says_how_much_that_is() {
    let (rig, places) = rig_and_places(60);
    let sd = 0.02;
    let (mut reported, mut floor) = (0.0, 0.0);
    for (seed, [start, target]) in places.iter().enumerate() {
        let execution = Execution { joints: sd, ..Execution::default() };
        let options = WorldOptions { execution, readings: Some(sd), seed: seed as u64, ..WorldOptions::default() };
        let mut world = World::new(&rig, start, options.clone()).unwrap();
        let aimed_at = goal(&world, &Names::new(&rig, world.header()), target);
        let mut servo = ServoLoop::new(ModelBased::new(&rig).unwrap(), settings());
        servo.aim(&aimed_at);
        let (stop, _) = run(&mut world, &rig, &mut servo, &[]).unwrap();
        let Stop::NoBetter { error_px, sd_px } = stop else { panic!("{stop:?}") };
        assert!(sd_px > 0.0);
        reported += error_px;
        let mut there = World::new(&rig, target, options).unwrap();
        for _ in 0..10 {
            there.execute(&Command::Joints(target.clone()), 1.0).unwrap();
            let seen = there.exact(there.joints());
            let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
            let pairs = seen.iter().zip(there.exact(target));
            floor += pairs.map(|(a, b)| distance(a.pixel, b.pixel)).sum::<f64>() / seen.len() as f64 / 10.0;
        }
    }
    // Means of 60 windows of 10 against 600 draws, where one draw varies by half of its mean.
    let ratio = reported / floor;
    assert!((ratio - 1.0).abs() < 0.15, "{ratio}");
}

#[test]
fn a_goal_out_of_reach_ends_blocked_and_names_what_blocks() {
    let (rig, places) = rig_and_places(30);
    let joint = 2;
    for [start, target] in places.iter().filter(|[start, target]| (start[joint] - target[joint]).abs() > 0.3) {
        // The elbow may not go where the target is; other joints may meet their ends before it.
        let mut narrow = rig.clone();
        let middle = 0.5 * (start[joint] + target[joint]);
        let limits = &mut narrow.robot.joints[joint].limits;
        if target[joint] > middle {
            limits.upper = Some(middle)
        } else {
            limits.lower = Some(middle)
        }
        let mut world = World::new(&rig, start, WorldOptions::default()).unwrap();
        let names = Names::new(&rig, world.header());
        let aimed_at = goal(&world, &names, target);
        let mut servo = ServoLoop::new(ModelBased::new(&narrow).unwrap(), settings());
        servo.aim(&aimed_at);
        let (stop, _) = run(&mut world, &rig, &mut servo, &[]).unwrap();
        let Stop::Blocked { by, .. } = &stop else { panic!("{stop:?}") };
        assert!(!by.is_empty());
        for active in by {
            let Constraint::Joint { joint, bound: Bound::Position, upper } = active.constraint else {
                panic!("{by:?}")
            };
            let limits = &narrow.robot.joints[joint].limits;
            let end = if upper { limits.upper } else { limits.lower };
            assert!((world.joints()[joint] - end.unwrap()).abs() < 1e-3, "joint {joint} is not at {end:?}");
            let name = format!("limit of joint `{}`", narrow.robot.joints[joint].name);
            assert!(stop.words(&narrow, &[]).contains(&name), "{}", stop.words(&narrow, &[]));
        }

        // A wall between start and target.
        let mut world = World::new(&rig, start, WorldOptions::default()).unwrap();
        let here = world.tip().translation;
        world.execute(&Command::Joints(target.clone()), 1.0).unwrap();
        let there = world.tip().translation;
        let normal = (there - here).normalize();
        let wall = HalfSpace { normal, offset: normal.dot(&(0.5 * (here + there))), strength: 10.0 };
        let mut world = World::new(&rig, start, WorldOptions::default()).unwrap();
        let mut servo = ServoLoop::new(ModelBased::new(&rig).unwrap(), LoopSettings { window: 30, ..settings() });
        servo.aim(&aimed_at);
        let (stop, _) = run(&mut world, &rig, &mut servo, &[&wall]).unwrap();
        let words = stop.words(&rig, &["wall".to_owned()]);
        assert!(words.starts_with("blocked at") && words.contains("limit `wall`"), "{words}");
    }
}

/// A controller that always moves the first joint.
struct Restless;

impl Controller for Restless {
    fn aim(&mut self, _goal: &[Sighting]) {}

    fn decide(&mut self, _: &Measurement<'_>, _: &[&dyn Limit], _: f64) -> Result<Decision, Error> {
        Ok(Decision::free(Command::JointDelta(vec![0.05, 0.0, 0.0, 0.0, 0.0, 0.0])))
    }
}

#[test]
fn a_loop_that_leads_away_ends_diverged_and_one_without_end_times_out() {
    let (rig, places) = rig_and_places(1);
    let [start, _] = &places[0];
    let mut world = World::new(&rig, start, WorldOptions::default()).unwrap();
    let mut near = start.clone();
    near[0] -= 0.01;
    let names = Names::new(&rig, world.header());
    let aimed_at = goal(&world, &names, &near);
    let mut servo = ServoLoop::new(Restless, settings());
    servo.aim(&aimed_at);
    let (stop, _) = run(&mut world, &rig, &mut servo, &[]).unwrap();
    let Stop::Diverged { from_px, error_px } = stop else { panic!("{stop:?}") };
    assert!(error_px > 3.0 * from_px);

    let mut world = World::new(&rig, start, WorldOptions::default()).unwrap();
    let endless = LoopSettings { timeout: 4.0, diverged: f64::INFINITY, ..settings() };
    let mut servo = ServoLoop::new(Restless, endless);
    servo.aim(&aimed_at);
    let (stop, moved) = run(&mut world, &rig, &mut servo, &[]).unwrap();
    assert!(matches!(stop, Stop::TimedOut { .. }) && moved == 4, "{stop:?} after {moved}");
}

/// Nothing moves on what is stale, missing or not a number; after a while the loop is lost, and says why.
#[test]
fn nothing_moves_on_useless_measurements_and_the_loop_is_lost_in_the_end() {
    let (rig, places) = rig_and_places(1);
    let [start, target] = &places[0];
    let world = World::new(&rig, start, WorldOptions::default()).unwrap();
    let names = Names::new(&rig, world.header());
    let (seen, aimed_at) = (goal(&world, &names, start), goal(&world, &names, target));
    let spoilt: Vec<Sighting> =
        seen.iter().map(|seen| Sighting { pixel: [f64::NAN, seen.pixel[1]], ..*seen }).collect();
    type Case<'a> = (&'a [Sighting], fn(f64) -> f64, &'a str);
    let cases: [Case<'_>; 5] = [
        (&seen, |now| now - 0.6, "0.600 s old"),
        (&seen, |_| 0.0, "s old"),
        (&seen, |_| f64::NAN, "NaN s old"),
        (&spoilt, |now| now, "nothing is seen of what is aimed at"),
        (&[], |now| now, "nothing is seen of what is aimed at"),
    ];
    for (seen, dated, why) in cases {
        let mut servo = ServoLoop::new(Restless, settings());
        servo.aim(&aimed_at);
        let mut stop = None;
        for tick in 0..7 {
            // The clock of the second case has gone on before the first tick.
            let now = 10.0 + f64::from(tick);
            let measured = Measurement { time: dated(now), joints: start, seen, points: &[] };
            let tick = servo.tick(now, &measured, &[], 1.0).unwrap();
            assert_eq!(tick.command, Command::Hold);
            stop = tick.stop;
        }
        let Some(Stop::Lost { why: said, seconds }) = &stop else { panic!("{why}: {stop:?}") };
        assert!(said.contains(why) && *seconds == 5.0, "{said} after {seconds}");
    }
    // Readings that are no numbers are as good as none.
    let mut servo = ServoLoop::new(ModelBased::new(&rig).unwrap(), settings());
    servo.aim(&aimed_at);
    let measured = Measurement { time: 0.0, joints: &[f64::NAN; 6], seen: &seen, points: &[] };
    let tick = servo.tick(0.0, &measured, &[], 1.0).unwrap();
    let Command::JointDelta(motion) = &tick.command else { panic!("{tick:?}") };
    assert!(motion.iter().all(|motion| motion.is_finite()));
}

#[test]
fn a_target_that_moves_is_followed_at_the_distance_of_one_step() {
    let (rig, places) = rig_and_places(5);
    for [start, target] in &places {
        let mut world = World::new(&rig, start, WorldOptions::default()).unwrap();
        let names = Names::new(&rig, world.header());
        let settings = LoopSettings { follow: true, timeout: 40.0, ..settings() };
        let mut servo = ServoLoop::new(ModelBased::new(&rig).unwrap(), settings);
        let place = |step: f64| -> Vec<f64> {
            start.iter().zip(target).map(|(from, to)| from + (to - from) * step / 30.0).collect()
        };
        let mut furthest: f64 = 0.0;
        for step in 0..30 {
            let step = f64::from(step);
            servo.aim(&goal(&world, &names, &place(step)));
            let sample = world.look();
            let (joints, seen) = (sample.joints.clone().unwrap(), names.sightings(&sample));
            let now = Measurement { time: sample.time.unwrap(), joints: &joints, seen: &seen, points: &[] };
            let tick = servo.tick(world.time(), &now, &[], 1.0).unwrap();
            assert_eq!(tick.stop, None);
            world.execute(&tick.command, 1.0).unwrap();
            let away = world.joints().iter().zip(place(step)).map(|(joint, place)| (joint - place).abs());
            furthest = away.fold(furthest, f64::max);
        }
        assert!(furthest < 1e-6, "{furthest}");
    }
}

/// An arm that stands a little outside its limits is led to a target inside: what it sees, no joints inside explain.
#[test]
fn an_arm_outside_its_limits_is_led_back_and_to_the_target() {
    let (rig, places) = rig_and_places(20);
    for [start, target] in &places {
        let mut outside = start.clone();
        for (joint, limits) in outside.iter_mut().zip(rig.robot.joints.iter().map(|joint| joint.limits)) {
            *joint = if *joint > 0.5 * (limits.lower.unwrap() + limits.upper.unwrap()) {
                limits.upper.unwrap() + 0.02
            } else {
                limits.lower.unwrap() - 0.02
            };
        }
        let mut world = World::new(&unlimited(&rig), &outside, WorldOptions::default()).unwrap();
        let mut servo = ServoLoop::new(ModelBased::new(&rig).unwrap(), settings());
        servo.aim(&goal(&world, &Names::new(&rig, world.header()), target));
        let (stop, moved) = run(&mut world, &rig, &mut servo, &[]).unwrap();
        assert!(matches!(stop, Stop::Converged { .. }) && moved <= 9, "{stop:?} after {moved}");
    }
}
