//! Worlds are what they say: noise by distance, depth, slips, things that are carried, a virtual spring on a table, a drone over a line.
use handeye::rig::{Camera, Feature, Model, Parent, Rig, catalog};
use handeye::servo::Command;
use handeye::simulate::world::{
    Coupling, Drone, Execution, Object, Slip, Spring, SpringArm, Table, Tracker, World, WorldOptions,
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
    let strange = vec![Slip { joint: 6, by: 0.05, at: 0.0 }];
    assert!(World::new(&rig, &START, WorldOptions { slips: strange, ..WorldOptions::default() }).is_err());
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
    arm.pull(&tool, &centre, 1.0);
    arm.pull(&centre, &centre, 5.0);
    assert!((arm.tip().translation - centre).norm() < 1e-4, "{}", arm.tip().translation - centre);
    assert_eq!(arm.contact(), 0.0);
    for friction in [0.0, 0.05, 0.2] {
        let table = Table { height: tool.z, stiffness: 1e5, friction };
        let mut arm = SpringArm::new(&rig, &JOINTS, Spring { table: Some(table), ..free }).unwrap();
        let below = tool - 0.1 * Vector3::z();
        arm.pull(&tool, &below, 1.0);
        let mut centre = below;
        for way in [Vector3::new(0.06, 0.0, 0.0), Vector3::new(0.0, 0.05, 0.0), Vector3::new(-0.03, -0.02, 0.0)] {
            arm.pull(&centre, &(centre + way), 1.0);
            centre += way;
            arm.pull(&centre, &centre, 10.0);
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
