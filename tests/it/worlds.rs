//! Worlds are what they say: noise by distance, depth, slips, things that are carried, a virtual spring on a table, a drone over a line.
use handeye::rig::{Camera, Feature, Model, Parent, Rig, catalog};
use handeye::servo::Command;
use handeye::simulate::world::{
    Coupling, Drone, Execution, Fault, FaultKind, Object, Slip, Spring, SpringArm, Table, Tracker, World, WorldOptions,
};
use handeye::solvers::Pose;
use handeye::solvers::nalgebra::{Matrix3, Rotation3, Vector3};

const START: [f64; 6] = [0.0, -1.3, 1.2, -1.5, -1.6, 0.3];

/// Two features 1 m and 3 m in front of a camera, which looks along x; and a UR5 that does not matter.
fn near_and_far(depth: bool) -> Rig {
    let mut rig = catalog::rig("ur5").unwrap();
    let rotation = Matrix3::from_columns(&[-Vector3::y(), -Vector3::z(), Vector3::x()]);
    rig.cameras = vec![Camera {
        pose: Some(Pose { rotation, translation: Vector3::new(5.0, 0.0, 0.0) }),
        depth,
        ..rig.cameras[0].clone()
    }];
    let feature =
        |name: &str, x: f64| Feature { name: name.to_owned(), parent: Parent::World, xyz: Some([x, 0.1, 0.2]) };
    rig.features = vec![feature("near", 6.0), feature("far", 8.0)];
    rig
}

fn sd(numbers: &[f64]) -> f64 {
    let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
    (numbers.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (numbers.len() - 1) as f64).sqrt()
}

#[test]
fn noise_of_trackers_grows_with_the_distance_and_points_of_depth_cameras_have_their_own() {
    let options =
        WorldOptions { tracker: Tracker::ByDistance { sd: 0.3, at: 2.0 }, points: 0.004, ..WorldOptions::default() };
    let mut world = World::new(&near_and_far(true), &START, options).unwrap();
    const LOOKS: usize = 4000;
    let looks: Vec<_> = (0..LOOKS).map(|_| world.look()).collect();
    let feature = |name: &str| world.header().features.iter().position(|known| known == name).unwrap() as u32;
    for (name, x) in [("near", 1.0_f64), ("far", 3.0)] {
        let place = [-0.1, -0.2, x];
        let distance = place.iter().map(|x| x * x).sum::<f64>().sqrt();
        for axis in 0..2 {
            let of = |sample: &handeye::recording::Sample| {
                sample.pixels.iter().find(|seen| seen.feature == feature(name)).unwrap().pixel[axis]
            };
            let found = sd(&looks.iter().map(of).collect::<Vec<_>>());
            let expected = 0.3 * distance / 2.0;
            // Of a standard deviation of n numbers: 1 / √(2 n) of it; 4 of these.
            assert!((found / expected - 1.0).abs() < 4.0 / (2.0 * LOOKS as f64).sqrt(), "{name}: {found} {expected}");
        }
        for (axis, expected) in place.iter().enumerate() {
            let of = |sample: &handeye::recording::Sample| {
                sample.points.iter().find(|seen| seen.feature == feature(name)).unwrap().point[axis]
            };
            let points: Vec<f64> = looks.iter().map(of).collect();
            let mean = points.iter().sum::<f64>() / LOOKS as f64;
            assert!((mean - expected).abs() < 4.0 * 0.004 / (LOOKS as f64).sqrt(), "{name}: {mean} {expected}");
            assert!((sd(&points) / 0.004 - 1.0).abs() < 4.0 / (2.0 * LOOKS as f64).sqrt());
        }
    }
    assert!(World::new(&near_and_far(false), &START, WorldOptions::default()).unwrap().look().points.is_empty());
}

#[test]
fn a_joint_that_slips_is_seen_and_not_read_and_commands_miss_by_it_from_then_on() {
    let rig = catalog::rig("ur5").unwrap();
    let slips = vec![Slip { joint: 2, by: 0.05, at: 1.5 }];
    let mut world = World::new(&rig, &START, WorldOptions { slips, ..WorldOptions::default() }).unwrap();
    let goal: Vec<f64> = START.iter().map(|joint| joint + 0.1).collect();
    for step in 0..4 {
        world.execute(&Command::Joints(goal.clone()), 1.0).unwrap();
        let off: Vec<f64> = world.joints().iter().zip(&goal).map(|(joint, goal)| joint - goal).collect();
        // The slip is in the second command, of 1 s to 2 s.
        let slipped = if step >= 1 { 0.05 } else { 0.0 };
        let expected = [0.0, 0.0, slipped, 0.0, 0.0, 0.0];
        assert!(off.iter().zip(expected).all(|(off, expected)| (off - expected).abs() < 1e-12), "{step}: {off:?}");
        let read = world.look().joints.unwrap();
        assert!(read.iter().zip(&goal).all(|(read, goal)| (read - goal).abs() < 1e-12), "{step}: {read:?}");
        assert_eq!(world.look().pixels, world.exact(world.joints()));
    }
    let good = Slip { joint: 2, by: 0.05, at: 0.0 };
    let with = |slip: Slip| World::new(&rig, &START, WorldOptions { slips: vec![slip], ..WorldOptions::default() });
    assert!(with(good).is_ok());
    for strange in [
        Slip { joint: 6, ..good },
        Slip { by: f64::INFINITY, ..good },
        Slip { at: f64::NAN, ..good },
        Slip { at: f64::INFINITY, ..good },
        Slip { at: -1.0, ..good },
    ] {
        assert!(with(strange).is_err(), "{strange:?}");
    }
}

#[test]
fn a_joint_that_another_drags_along_moves_by_its_share() {
    let rig = catalog::rig("ur5").unwrap();
    let couplings = vec![Coupling { joint: 4, by: 3, share: -0.2 }];
    let execution = Execution { couplings, ..Execution::default() };
    let mut world = World::new(&rig, &START, WorldOptions { execution, ..WorldOptions::default() }).unwrap();
    world.execute(&Command::JointDelta(vec![0.0, 0.1, 0.0, 0.3, 0.05, 0.0]), 1.0).unwrap();
    let moved: Vec<f64> = world.joints().iter().zip(START).map(|(now, before)| now - before).collect();
    let expected = [0.0, 0.1, 0.0, 0.3, 0.05 - 0.2 * 0.3, 0.0];
    assert!(moved.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{moved:?}");
    // A joint at the end of its limits does not move, and drags nothing along; who is dragged along stops at its own end.
    let mut narrow = rig.clone();
    narrow.robot.joints[3].limits.upper = Some(START[3] + 0.1);
    narrow.robot.joints[4].limits.lower = Some(START[4] - 0.05);
    let execution = Execution { couplings: vec![Coupling { joint: 4, by: 3, share: -0.2 }], ..Execution::default() };
    let mut world = World::new(&narrow, &START, WorldOptions { execution, ..WorldOptions::default() }).unwrap();
    for (motion, expected) in [(0.3, [0.1, -0.02]), (0.3, [0.1, -0.02]), (-0.1, [0.0, 0.0]), (0.05, [0.05, -0.01])] {
        world.execute(&Command::JointDelta(vec![0.0, 0.0, 0.0, motion, 0.0, 0.0]), 1.0).unwrap();
        let moved = [3, 4].map(|joint| world.joints()[joint] - START[joint]);
        assert!(moved.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{motion}: {moved:?}");
    }
    world.execute(&Command::JointDelta(vec![0.0, 0.0, 0.0, 0.05, -1.0, 0.0]), 1.0).unwrap();
    assert!((world.joints()[4] - (START[4] - 0.05)).abs() < 1e-12, "{}", world.joints()[4]);
    let strange = Execution { couplings: vec![Coupling { joint: 6, by: 3, share: 0.1 }], ..Execution::default() };
    assert!(World::new(&rig, &START, WorldOptions { execution: strange, ..WorldOptions::default() }).is_err());
}

#[test]
fn a_thing_that_is_carried_is_seen_where_it_is_or_was_with_latency_and_a_held_one_stays_in_the_hand() {
    let rig = catalog::rig("ur5").unwrap();
    let model = Model::new(&rig).unwrap();
    let (here, there) = (model.tip(&START), model.tip(&[0.1, -1.2, 1.2, -1.5, -1.6, 0.3]));
    for latency in [0.0, 0.4] {
        let mut world = World::new(&rig, &START, WorldOptions { latency, ..WorldOptions::default() }).unwrap();
        let all: Vec<usize> = (0..rig.features.len()).collect();
        let thing = world.put(Object::new(all, here));
        world.execute(&Command::Hold, 1.0).unwrap();
        let before = world.look().pixels;
        world.carry(thing, there);
        world.execute(&Command::Hold, 1.0).unwrap();
        world.execute(&Command::Hold, 1.0).unwrap();
        let after = world.look().pixels;
        // As the tip would have it there, in another world in which nothing stands apart.
        let free = World::new(&rig, &START, WorldOptions::default()).unwrap();
        assert_eq!(before, free.exact_with_tip(&here));
        assert_eq!(after, free.exact_with_tip(&there));
        world.grasp(thing);
        world.carry(thing, here);
        let [held, there] = [world.exact(&START), free.exact_with_tip(&there)];
        let same =
            held.iter().zip(&there).all(|(a, b)| (a.pixel[0] - b.pixel[0]).hypot(a.pixel[1] - b.pixel[1]) < 1e-9);
        assert!(held.len() == there.len() && same, "what is held was carried");
    }
}

#[test]
fn what_is_seen_with_latency_is_the_thing_where_it_was_on_its_way_then() {
    let rig = catalog::rig("ur5").unwrap();
    let model = Model::new(&rig).unwrap();
    let here = model.tip(&START);
    // Carried evenly, and turned by 0.2 rad per second.
    let at = |time: f64| {
        let turned = Pose::new(Vector3::new(0.0, 0.0, 0.2 * time), Vector3::zeros()).rotation * here.rotation;
        Pose { rotation: turned, translation: here.translation + Vector3::new(0.03, -0.02, 0.01) * time }
    };
    let free = World::new(&rig, &START, WorldOptions::default()).unwrap();
    for latency in [0.0, 0.3, 0.5, 1.0, 1.7] {
        let mut world = World::new(&rig, &START, WorldOptions { latency, ..WorldOptions::default() }).unwrap();
        let thing = world.put(Object::new((0..rig.features.len()).collect(), here));
        for second in 0..5 {
            world.carry(thing, at(f64::from(second)));
            let sample = world.look();
            let then = (f64::from(second) - latency).max(0.0);
            assert_eq!(sample.time, Some(then));
            let expected = free.exact_with_tip(&at(then));
            assert_eq!(sample.pixels.len(), expected.len());
            for (seen, expected) in sample.pixels.iter().zip(&expected) {
                let off = (seen.pixel[0] - expected.pixel[0]).hypot(seen.pixel[1] - expected.pixel[1]);
                assert!(off < 1e-6, "{latency} s old at {second} s: {off} px from where it was");
            }
            world.execute(&Command::Hold, 1.0).unwrap();
        }
    }
}

#[test]
fn a_tracker_that_fails_says_the_same_of_a_point_in_space_as_of_its_pixel() {
    let rig = near_and_far(true);
    let of = |kind: FaultKind| {
        let fault = Fault { camera: 0, feature: 1, kind, from: 1.0, until: 3.0 };
        let options = WorldOptions { points: 0.004, faults: vec![fault], ..WorldOptions::default() };
        let mut world = World::new(&rig, &START, options).unwrap();
        let far = world.header().features.iter().position(|known| known == "far").unwrap() as u32;
        let mut looks = Vec::new();
        for _ in 0..4 {
            let sample = world.look();
            let pixel = sample.pixels.iter().find(|seen| seen.feature == far).map(|seen| seen.pixel);
            let point = sample.points.iter().find(|seen| seen.feature == far).map(|seen| Vector3::from(seen.point));
            looks.push((pixel, point));
            world.execute(&Command::Hold, 1.0).unwrap();
        }
        looks
    };
    let is_near = |point: Option<Vector3<f64>>, place: Vector3<f64>| (point.unwrap() - place).norm() < 6.0 * 0.004;
    let place = Vector3::new(-0.1, -0.2, 3.0);
    let focal = rig.cameras[0].fx.unwrap();
    let lost = of(FaultKind::Lost);
    assert!(lost[1] == (None, None) && lost[2] == (None, None) && is_near(lost[3].1, place), "{lost:?}");
    let frozen = of(FaultKind::Frozen);
    assert!(frozen[1] == frozen[0] && frozen[2] == frozen[0] && frozen[3].1 != frozen[0].1, "{frozen:?}");
    // 60 px to the right, at the same distance from the camera.
    for (kind, by) in [(FaultKind::Jumped([60.0, 0.0]), [60.0, 60.0]), (FaultKind::Drifting([60.0, 0.0]), [0.0, 60.0])]
    {
        let looks = of(kind);
        for (look, by) in looks[1..3].iter().zip(by) {
            let ray = Vector3::new(place.x / place.z + by / focal, place.y / place.z, 1.0).normalize();
            assert!(is_near(look.1, place.norm() * ray), "{kind:?}: {look:?}");
        }
        assert!(is_near(looks[0].1, place) && is_near(looks[3].1, place), "{looks:?}");
    }
    let with = |fault: Fault| World::new(&rig, &START, WorldOptions { faults: vec![fault], ..WorldOptions::default() });
    let good = Fault { camera: 0, feature: 1, kind: FaultKind::Lost, from: 0.0, until: f64::INFINITY };
    assert!(with(good.clone()).is_ok());
    for strange in [
        Fault { camera: 1, ..good.clone() },
        Fault { feature: 2, ..good.clone() },
        Fault { from: f64::NAN, ..good.clone() },
        Fault { kind: FaultKind::Jumped([f64::NAN, 0.0]), ..good },
    ] {
        assert!(with(strange.clone()).is_err(), "{strange:?}");
    }
}

/// A WAM with its tool 0.385 m before the last joint, and where that is.
fn wam(joints: &[f64; 4]) -> (Rig, Vector3<f64>) {
    let mut rig = catalog::rig("wam4").unwrap();
    rig.robot.joints[3].frame = Some(Pose { translation: Vector3::new(0.0, 0.0, 0.385), ..Pose::identity() });
    let tool = Model::new(&rig).unwrap().tip(joints).translation;
    (rig, tool)
}

#[test]
fn a_spring_pulls_the_tip_to_its_centre_and_presses_it_on_a_table_as_statics_has_it() {
    const JOINTS: [f64; 4] = [0.0, 1.0, 0.0, 1.8];
    let (rig, tool) = wam(&JOINTS);
    let free = Spring { stiffness: [200.0, 300.0, 400.0], damping: 2.0, table: None };
    let mut arm = SpringArm::new(&rig, &JOINTS, free).unwrap();
    let centre = tool + Vector3::new(0.05, -0.04, 0.03);
    arm.pull(&tool, &centre, 1.0).unwrap();
    arm.pull(&centre, &centre, 5.0).unwrap();
    assert!((arm.tip().translation - centre).norm() < 1e-4, "{}", arm.tip().translation - centre);
    assert_eq!(arm.contact(), 0.0);
    for friction in [0.0, 0.05, 0.2] {
        let table = Table { height: tool.z, stiffness: 1e5, friction };
        let mut arm = SpringArm::new(&rig, &JOINTS, Spring { table: Some(table), ..free }).unwrap();
        let below = tool - 0.1 * Vector3::z();
        arm.pull(&tool, &below, 1.0).unwrap();
        let mut centre = below;
        for way in [Vector3::new(0.06, 0.0, 0.0), Vector3::new(0.0, 0.05, 0.0), Vector3::new(-0.03, -0.02, 0.0)] {
            arm.pull(&centre, &(centre + way), 1.0).unwrap();
            centre += way;
            arm.pull(&centre, &centre, 10.0).unwrap();
            let stretched = centre - arm.tip().translation;
            let normal = 400.0 * -stretched.z;
            assert!((arm.contact() / normal - 1.0).abs() < 0.01, "{} N, by statics {normal}", arm.contact());
            assert!((arm.contact() - 40.0).abs() < 0.5);
            // Coulomb: what friction holds is at most μ times the normal force; without friction nothing is held.
            let held = (200.0 * stretched.x).hypot(300.0 * stretched.y);
            assert!(held <= 1.02 * friction * normal + 0.05, "{friction}: {held} N held of {normal}");
        }
    }
    let soft = Spring { damping: 0.0, ..free };
    assert!(SpringArm::new(&rig, &JOINTS, soft).is_err());
}

#[test]
fn a_spring_whose_centre_or_time_is_no_number_is_refused_and_nothing_moves() {
    const JOINTS: [f64; 4] = [0.0, 1.0, 0.0, 1.8];
    let (rig, tool) = wam(&JOINTS);
    let spring = Spring { stiffness: [200.0; 3], damping: 2.0, table: None };
    let mut arm = SpringArm::new(&rig, &JOINTS, spring).unwrap();
    let there = tool + Vector3::new(0.05, 0.0, 0.0);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0] {
        assert!(arm.pull(&tool, &there, bad).is_err(), "{bad} s");
        if bad != -1.0 {
            let nowhere = Vector3::new(tool.x, bad, tool.z);
            assert!(arm.pull(&nowhere, &there, 1.0).is_err() && arm.pull(&tool, &nowhere, 1.0).is_err(), "{bad} m");
        }
    }
    let far = Vector3::new(1e308, 1e308, -1e308);
    assert!(arm.pull(&far, &-far, 1.0).is_err(), "{:?}", arm.joints());
    assert_eq!((arm.joints(), arm.tip().translation), (&JOINTS[..], tool));
    arm.pull(&tool, &there, 1.0).unwrap();
    assert!((arm.tip().translation - tool).norm() > 0.01);
}

#[test]
fn the_line_below_a_drone_is_where_projecting_its_points_has_it() {
    for (index, yaw) in [0.0_f64, 0.4, -1.1, 2.0, 3.0].into_iter().enumerate() {
        let lean = [0.05 * index as f64 - 0.1, 0.04];
        let drone = Drone { position: Vector3::new(3.0, 0.2, 1.5), yaw, lean };
        let [ahead, behind] = drone.line().unwrap();
        assert!(((ahead[0] - behind[0]).hypot(ahead[1] - behind[1]) - 200.0).abs() < 1e-9);
        // Forward, right and down of the drone as turns of heading, pitch and roll have them (Tait-Bryan, z down).
        let north_east_down = Rotation3::from_euler_angles(lean[1], -lean[0], -yaw);
        let see = |x: f64| {
            // North is the line, east to its right.
            let away = Vector3::new(x - 3.0, 0.2, 1.5);
            let body = north_east_down.inverse() * away;
            [320.0 + 560.0 * body.y / body.z, 180.0 - 560.0 * body.x / body.z]
        };
        for x in [2.8, 3.0, 3.3] {
            let seen = see(x);
            let across =
                (ahead[0] - behind[0]) * (seen[1] - behind[1]) - (ahead[1] - behind[1]) * (seen[0] - behind[0]);
            assert!((across / 200.0).abs() < 1e-6, "yaw {yaw}, {x}: {} px beside the line", across / 200.0);
        }
        let along = [see(3.1)[0] - see(3.0)[0], see(3.1)[1] - see(3.0)[1]];
        assert!(along[0] * (ahead[0] - behind[0]) + along[1] * (ahead[1] - behind[1]) > 0.0);
    }
    let level = Drone { position: Vector3::new(0.0, 0.3, 1.5), yaw: 0.0, lean: [0.0; 2] };
    let [ahead, behind] = level.line().unwrap();
    // Upright, to the right of a nose that points along it from its left: 560 px · 0.3 m / 1.5 m from the middle.
    assert!((ahead[0] - (320.0 + 112.0)).abs() < 1e-9 && (behind[0] - (320.0 + 112.0)).abs() < 1e-9, "{ahead:?}");
    assert!((ahead[1] - 80.0).abs() < 1e-9 && (behind[1] - 280.0).abs() < 1e-9, "{ahead:?} {behind:?}");
    let far = Drone { position: Vector3::new(0.0, 2.0, 1.5), ..level };
    assert_eq!(far.line(), None);
    let turned = Drone { yaw: 0.5, ..level };
    let [ahead, behind] = turned.line().unwrap();
    // Turned to the left, the line leans to the right: by the same angle.
    let angle = (ahead[0] - behind[0]).atan2(behind[1] - ahead[1]);
    assert!((angle - 0.5).abs() < 1e-9, "{angle}");
}
