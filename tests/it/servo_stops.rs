//! What a closed loop does not take for success, and what it knows of an arm that stands still.
use crate::servo_loop::{goal, rig_and_places, run, settings};
use handeye::Error;
use handeye::infer::{Names, Sighting};
use handeye::rig::Limits;
use handeye::servo::limits::HalfSpace;
use handeye::servo::{
    Command, Controller, Decision, Gain, Limit, LoopSettings, Measurement, ModelBased, ServoLoop, Stop, Tick,
};
use handeye::simulate::world::{World, WorldOptions};

/// A controller to which everything says too little, or, without a reason, one that moves the first joint by so much.
struct Stubborn(Option<&'static str>, f64);

impl Controller for Stubborn {
    fn aim(&mut self, _goal: &[Sighting]) {}

    fn decide(&mut self, _: &Measurement<'_>, _: &[&dyn Limit], _: f64) -> Result<Decision, Error> {
        let command = Command::JointDelta(vec![self.1, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let decision = Decision::free(command);
        self.0.map_or(Ok(decision), |why| Err(Error::NotEnoughData(why.to_owned())))
    }
}

#[test]
fn a_loop_that_never_moves_is_lost_and_not_as_good_as_it_can_be() {
    let (rig, places) = rig_and_places(1);
    let [start, target] = &places[0];
    let world = World::new(&rig, start, WorldOptions::default()).unwrap();
    let names = Names::new(&rig, world.header());
    let (seen, aimed_at) = (goal(&world, &names, start), goal(&world, &names, target));
    for controller in [Stubborn(Some("too few features"), 0.0), Stubborn(None, f64::NAN)] {
        let mut servo = ServoLoop::new(controller, settings());
        servo.aim(&aimed_at);
        let ticks = (0..60).map(|tick| 0.1 * f64::from(tick));
        let stops = ticks
            .map(|now| servo.tick(now, &Measurement { time: now, joints: start, seen: &seen, points: &[] }, &[], 0.1));
        let last: Tick = stops.map(Result::unwrap).last().unwrap();
        assert!(matches!(last.stop, Some(Stop::Lost { .. })), "{last:?}");
    }
}

#[test]
fn one_measurement_that_is_seen_again_and_again_is_one() {
    let (rig, places) = rig_and_places(1);
    let [start, _] = &places[0];
    let world = World::new(&rig, start, WorldOptions::default()).unwrap();
    let seen = goal(&world, &Names::new(&rig, world.header()), start);
    let settings = LoopSettings { settled: 2, look_then_move: false, ..settings() };
    let mut servo = ServoLoop::new(Stubborn(None, 0.0), settings);
    servo.aim(&seen);
    let mut tick = |now: f64, time: f64| {
        servo.tick(now, &Measurement { time, joints: start, seen: &seen, points: &[] }, &[], 0.001)
    };
    for millisecond in 0..30 {
        assert_eq!(tick(0.001 * f64::from(millisecond), 0.0).unwrap().stop, None);
    }
    assert!(matches!(tick(0.033, 0.033).unwrap().stop, Some(Stop::Converged { .. })));
}

#[test]
fn an_arm_that_runs_away_from_a_target_that_moves_has_diverged_and_one_that_lags_has_not() {
    let (rig, places) = rig_and_places(1);
    let [start, _] = &places[0];
    let place = |step: f64| -> Vec<f64> { start.iter().map(|joint| joint + 0.002 * step).collect() };
    for (motion, diverges) in [(-0.05, true), (0.0, false)] {
        let mut world = World::new(&rig, start, WorldOptions::default()).unwrap();
        let names = Names::new(&rig, world.header());
        let settings = LoopSettings { follow: true, timeout: 100.0, ..settings() };
        let mut servo = ServoLoop::new(Stubborn(None, motion), settings);
        let mut stop = None;
        for step in 0..20 {
            servo.aim(&goal(&world, &names, &place(f64::from(step))));
            let sample = world.look();
            let seen = names.sightings(&sample);
            let now = Measurement { time: sample.time.unwrap(), joints: start, seen: &seen, points: &[] };
            let tick = servo.tick(world.time(), &now, &[], 1.0).unwrap();
            stop = stop.or(tick.stop);
            world.execute(&tick.command, 1.0).unwrap();
        }
        assert_eq!(matches!(stop, Some(Stop::Diverged { .. })), diverges, "{motion}: {stop:?}");
    }
}

/// With old images and limits of acceleration the arm stands between motions; a step that took it for moving would push it on.
#[test]
fn an_arm_that_waits_for_new_images_stands_still_and_does_not_overshoot() {
    let (mut rig, places) = rig_and_places(10);
    for joint in &mut rig.robot.joints {
        joint.limits = Limits { velocity: Some(5.0), acceleration: Some(5.0), ..joint.limits };
    }
    for [start, target] in &places {
        let options = WorldOptions { latency: 0.25, ..WorldOptions::default() };
        let mut world = World::new(&rig, start, options).unwrap();
        let names = Names::new(&rig, world.header());
        let mut servo = ServoLoop::new(ModelBased::new(&rig).unwrap(), LoopSettings { window: 0, ..settings() });
        servo.aim(&goal(&world, &names, target));
        let mut farthest: f64 = 0.0;
        loop {
            let sample = world.look();
            let (joints, seen) = (sample.joints.clone().unwrap(), names.sightings(&sample));
            let now = Measurement { time: sample.time.unwrap(), joints: &joints, seen: &seen, points: &[] };
            let tick = servo.tick(world.time(), &now, &[], 0.1).unwrap();
            world.execute(&tick.command, 0.1).unwrap();
            for ((joint, from), to) in world.joints().iter().zip(start).zip(target) {
                farthest = farthest.max((joint - to) * (to - from).signum());
            }
            if let Some(stop) = tick.stop {
                assert!(matches!(stop, Stop::Converged { .. }), "{stop:?}");
                break;
            }
        }
        assert!(farthest < 1e-3, "{farthest} rad past the target");
    }
}

#[test]
fn what_cannot_all_hold_is_named_with_what_blocks() {
    let (rig, places) = rig_and_places(3);
    for [start, target] in &places {
        let mut world = World::new(&rig, start, WorldOptions::default()).unwrap();
        let here = world.tip().translation;
        // No place is left of one plane and right of the other.
        let wall = |sign: f64, offset: f64| HalfSpace { normal: nalgebra::Vector3::z() * sign, offset, strength: 10.0 };
        let (below, above) = (wall(1.0, here.z - 0.05), wall(-1.0, -here.z - 0.05));
        let mut servo = ServoLoop::new(ModelBased::new(&rig).unwrap(), LoopSettings { window: 20, ..settings() });
        servo.aim(&goal(&world, &Names::new(&rig, world.header()), target));
        let (stop, _) = run(&mut world, &rig, &mut servo, &[&below, &above]).unwrap();
        let words = stop.words(&rig, &["floor".to_owned(), "ceiling".to_owned()]);
        assert!(words.contains("these cannot all hold: limit `ceiling`, limit `floor`"), "{words}");
    }
}

#[test]
fn a_gain_is_a_share_at_every_error_whatever_its_settings() {
    for (near, far) in [(0.8, 0.2), (0.2, 0.8), (0.5, 0.5)] {
        let gain = Gain::Adaptive { near, far, slope: 0.01 };
        assert!((gain.share(0.0) - near).abs() < 1e-12 && (gain.share(1e6) - far).abs() < 1e-9, "{gain:?}");
    }
    assert_eq!((Gain::Constant(f64::NAN).share(1.0), Gain::Constant(3.0).share(1.0)), (0.0, 1.0));
}
