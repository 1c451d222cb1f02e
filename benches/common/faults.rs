//! Mistakes planted in recordings, and what the doctor has to say of each.
use handeye::recording::{Detection, RecordedCamera, Recording, Sample, TargetDetection};
use handeye::rig::{Camera, Feature, Model, Parent, Rig, catalog};
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use handeye::solvers::Pose;
use handeye::solvers::manifold::so3;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A mistake: its name, what a finding about it contains, and how it is made.
pub struct Fault {
    pub name: &'static str,
    pub says: &'static str,
    pub plant: fn(&mut Rig, &mut Recording),
}

/// Mistakes of recordings with joints and pixels.
pub fn of_joints() -> Vec<Fault> {
    let fault = |name, says, plant| Fault { name, says, plant };
    vec![
        fault("degrees", "joints are in degrees", |_, recording| {
            recording.samples.iter_mut().flat_map(|s| &mut s.joints).flatten().for_each(|j| *j = j.to_degrees());
        }),
        fault("joints a sample early", "joints are one sample early", |_, recording| {
            rows(recording, |i, n| (i + 1) % n)
        }),
        fault("joints a sample late", "joints are one sample late", |_, recording| {
            rows(recording, |i, n| (i + n - 1) % n)
        }),
        fault("joints 2 samples early", "joints are 2 samples early", |_, recording| {
            rows(recording, |i, n| (i + 2) % n)
        }),
        fault("joints reversed", "rows of joints are in reverse order", |_, recording| {
            rows(recording, |i, n| n - 1 - i)
        }),
        fault("two rows swapped", "the joint rows of samples 4 and 9 are swapped", |_, recording| {
            rows(recording, |i, _| [(4, 9), (9, 4)].iter().find(|pair| pair.0 == i).map_or(i, |pair| pair.1));
        }),
        fault("u, v swapped", "u and v are swapped", |_, recording| {
            recording.samples.iter_mut().flat_map(|s| &mut s.pixels).for_each(|seen| seen.pixel.reverse());
        }),
        fault("cx, cy swapped", "coordinates swapped", |rig, recording| {
            rig.cameras.iter_mut().for_each(|camera| std::mem::swap(&mut camera.cx, &mut camera.cy));
            recording.cameras.iter_mut().for_each(|camera| std::mem::swap(&mut camera.cx, &mut camera.cy));
        }),
        fault("declared on the hand", "declared on the tip", |rig, recording| {
            for recorded in &recording.cameras {
                if !rig.cameras.iter().any(|camera| camera.name == recorded.name) {
                    rig.cameras.push(Camera { name: recorded.name.clone(), ..Camera::default() });
                }
            }
            rig.cameras.iter_mut().for_each(|camera| camera.parent = Parent::Tip);
            rig.features = recording.features.iter().map(|name| in_world(name)).collect();
        }),
        fault("samples repeat", "repeat the robot's state", |_, recording| {
            let n = recording.samples.len();
            for i in 0..n / 3 {
                recording.samples[n - 1 - i] = recording.samples[i].clone();
            }
        }),
        fault("one joint moves", "moves", |_, recording| {
            let first = recording.samples[0].joints.clone().expect("joints are recorded");
            for joints in recording.samples.iter_mut().flat_map(|sample| &mut sample.joints) {
                let last = joints.len() - 1;
                joints[..last].copy_from_slice(&first[..last]);
            }
        }),
    ]
}

/// Mistakes of recordings of a UR arm whose chain the rig gives: the orders in which its drivers write them, and wrist joints that
/// are exchanged.
pub fn of_ur_arms() -> Vec<Fault> {
    let fault = |name, says, plant| Fault { name, says, plant };
    vec![
        fault("joints in alphabetical order", "joints shoulder_pan and elbow are swapped", |_, recording| {
            recording.samples.iter_mut().flat_map(|sample| &mut sample.joints).for_each(|joints| joints.swap(0, 2));
        }),
        fault("joints of the ROS 2 driver", "joints begin with another than the base's", |_, recording| {
            recording.samples.iter_mut().flat_map(|sample| &mut sample.joints).for_each(|joints| joints.rotate_left(1));
        }),
        fault("wrist joints swapped", "joints wrist_1 and wrist_3 are swapped", |_, recording| {
            recording.samples.iter_mut().flat_map(|sample| &mut sample.joints).for_each(|joints| joints.swap(3, 5));
        }),
    ]
}

/// Mistakes of recordings in which the arm moves on between images.
pub fn of_dense_motion() -> Vec<Fault> {
    let fault = |name, says, plant| Fault { name, says, plant };
    vec![
        fault("joints 0.13 s late", "s too late", |_, recording| lag(recording, 0.13)),
        fault("joints 0.04 s early", "s too early", |_, recording| lag(recording, -0.04)),
    ]
}

/// Mistakes of recordings with tip poses and pixels.
pub fn of_tips() -> Vec<Fault> {
    of_targets().into_iter().filter(|fault| fault.name.starts_with("robot")).collect()
}

/// Mistakes of recordings with targets and tip poses.
pub fn of_targets() -> Vec<Fault> {
    let fault = |name, says, plant| Fault { name, says, plant };
    vec![
        fault("robot inverted", "robot poses are inverted", |_, recording| robot(recording, Pose::inverse)),
        fault("robot wxyz", "robot poses are quaternions in the order", |_, recording| robot(recording, w_first)),
        fault("robot mm", "robot poses are in millimetres", |_, recording| robot(recording, millimetres)),
        fault("robot a sample early", "robot poses are one sample early", |_, recording| {
            rows(recording, |i, n| (i + 1) % n)
        }),
        fault("robot rows swapped", "the robot poses of samples 4 and 9 are swapped", |_, recording| {
            rows(recording, |i, _| [(4, 9), (9, 4)].iter().find(|pair| pair.0 == i).map_or(i, |pair| pair.1));
        }),
        fault("target inverted", "target poses are inverted", |_, recording| target(recording, Pose::inverse)),
        fault("target wxyz", "target poses are quaternions in the order", |_, recording| target(recording, w_first)),
        fault("target mm", "target poses are in millimetres", |_, recording| target(recording, millimetres)),
        fault("camera on the other side", "moves as if it were not", |rig, _| {
            let parent = &mut rig.cameras[0].parent;
            *parent = if *parent == Parent::World { Parent::Tip } else { Parent::World };
        }),
        fault("samples repeat", "repeat the robot's state", |_, recording| {
            let n = recording.samples.len();
            for i in 0..n / 3 {
                recording.samples[n - 1 - i] = recording.samples[i].clone();
            }
        }),
        fault("robot turns about one axis", "all rotations are about one axis of the tip: (", |_, recording| {
            let first = recording.samples[0].pose.expect("poses are recorded").rotation;
            let mut angle = 0.0;
            robot(recording, |pose| {
                angle += 0.3;
                Pose { rotation: first * so3::exp(&Vector3::new(0.0, 0.0, angle)), ..*pose }
            });
        }),
    ]
}

/// A recording of a target and tip poses: a camera on the hand for even seeds, in the world for odd ones. 1 mm and 0.002 rad of
/// noise on targets.
pub fn targets(seed: u64, samples: usize, one_axis: bool) -> (Rig, Recording) {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let on_hand = seed.is_multiple_of(2);
    let x = pose(random, 1.0, [0.05, 0.05, 0.08]);
    let z = Pose { translation: Vector3::new(0.6, random.random_range(-0.4..0.4), 0.3), ..pose(random, 2.0, [0.1; 3]) };
    let sample = |_| {
        // Half a turn about x: the target's z axis points towards the camera.
        let mut tilt = pose(random, 0.5, [0.2, 0.15, 0.2]);
        if one_axis {
            tilt.rotation = so3::exp(&Vector3::new(0.0, 0.0, random.random_range(-1.0..1.0)));
        }
        let facing = so3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
        let seen =
            Pose { rotation: facing * tilt.rotation, translation: tilt.translation + Vector3::new(0.0, 0.0, 0.6) };
        let tip = z * if on_hand { seen.inverse() } else { seen } * x.inverse();
        let mut normal = |sd: f64| Vector3::from_fn(|_, _| sd * Distribution::<f64>::sample(&StandardNormal, random));
        let noise = Pose::new(normal(0.002), normal(0.001));
        let targets = vec![TargetDetection { camera: 0, target: "tag".into(), pose: seen * noise, covariance: None }];
        Sample { pose: Some(tip), targets, ..Sample::default() }
    };
    let samples = (0..samples).map(sample).collect();
    let parent = if on_hand { Parent::Tip } else { Parent::World };
    let rig = Rig { cameras: vec![Camera { name: "camera".into(), parent, ..Camera::default() }], ..Rig::default() };
    let camera = RecordedCamera { name: "camera".into(), ..RecordedCamera::default() };
    (rig, Recording { cameras: vec![camera], samples, ..Recording::default() })
}

fn pose(random: &mut ChaCha8Rng, turn: f64, size: [f64; 3]) -> Pose {
    let rotation = Vector3::from_fn(|_, _| random.random_range(-turn..turn));
    Pose::new(rotation, Vector3::from_fn(|i, _| random.random_range(-size[i]..size[i])))
}

fn in_world(name: &str) -> Feature {
    Feature { name: name.to_owned(), parent: Parent::World, xyz: None }
}

/// Gives each of n samples the robot's state of another.
fn rows(recording: &mut Recording, from: impl Fn(usize, usize) -> usize) {
    let samples = recording.samples.clone();
    for (i, sample) in recording.samples.iter_mut().enumerate() {
        let read = &samples[from(i, samples.len())];
        (sample.joints, sample.pose) = (read.joints.clone(), read.pose);
    }
}

/// Stamps the joints so many seconds late: each sample gets those of an earlier time, linear between samples.
fn lag(recording: &mut Recording, seconds: f64) {
    let samples = recording.samples.clone();
    let at = |time: f64| {
        let after = samples.partition_point(|sample| sample.time < Some(time)).clamp(1, samples.len() - 1);
        let [a, b] = [&samples[after - 1], &samples[after]];
        let (from, to) = (a.time?, b.time?);
        let share = ((time - from) / (to - from)).clamp(0.0, 1.0);
        let pairs = a.joints.as_ref()?.iter().zip(b.joints.as_ref()?);
        Some(pairs.map(|(a, b)| a + share * (b - a)).collect())
    };
    for sample in &mut recording.samples {
        sample.joints = sample.time.and_then(|time| at(time - seconds));
    }
    // Samples before the first reading have none.
    recording.samples.retain(|sample| {
        let read = sample.time.unwrap_or_default() - seconds;
        samples[0].time <= Some(read) && Some(read) <= samples[samples.len() - 1].time
    });
}

/// A UR5 with noise on its pixels, of which the chain and the intrinsics are known.
pub fn ur5(seed: u64) -> (Rig, Recording) {
    let rig = catalog::rig("ur5").expect("it is shipped");
    let options = SimulateOptions { samples: 25, seed, ..SimulateOptions::default() };
    let recording = simulate(&rig, &options).expect("the rig is in view").recording;
    let noise = rig.noise;
    (Rig { robot: rig.robot, noise, ..Rig::default() }, recording)
}

/// A random rig's arm on its way through random positions, ten images a second with 0.3 px of noise; nothing known but intrinsics.
pub fn dense_motion(seed: u64) -> (Rig, Recording) {
    const STEPS: usize = 10;
    let rig = random_rig(6, 2, 12, seed);
    let options = SimulateOptions { samples: 16, seed, ..SimulateOptions::default() };
    let mut recording = simulate(&rig, &options).expect("the rig is in view").recording;
    let stops: Vec<Vec<f64>> = recording.samples.iter().flat_map(|sample| sample.joints.clone()).collect();
    let model = Model::new(&rig).expect("the rig is complete");
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    recording.samples.clear();
    for index in 0..STEPS * (stops.len() - 1) {
        let [from, to] = [&stops[index / STEPS], &stops[index / STEPS + 1]];
        let share = (index % STEPS) as f64 / STEPS as f64;
        let share = share * share * (3.0 - 2.0 * share);
        let joints: Vec<f64> = from.iter().zip(to).map(|(a, b)| a + share * (b - a)).collect();
        let links = model.links(&joints);
        let mut pixels = Vec::new();
        for (camera, size) in recording.cameras.iter().map(|camera| camera.size).enumerate() {
            for feature in 0..recording.features.len() {
                let index = rig.features.iter().position(|known| known.name == recording.features[feature]);
                let pixel = model.pixel(camera, index.expect("every feature is the rig's"), &links);
                let pixel = pixel.map(|x| x + 0.3 * Distribution::<f64>::sample(&StandardNormal, random));
                let [width, height] = size.unwrap_or([640, 480]).map(f64::from);
                if (0.0..width).contains(&pixel[0]) && (0.0..height).contains(&pixel[1]) {
                    pixels.push(Detection { camera: camera as u32, feature: feature as u32, pixel });
                }
            }
        }
        recording.samples.push(Sample {
            time: Some(0.1 * index as f64),
            joints: Some(joints),
            pixels,
            ..Sample::default()
        });
    }
    (Rig::default(), recording)
}

fn robot(recording: &mut Recording, change: impl FnMut(&Pose) -> Pose) {
    let mut change = change;
    recording.samples.iter_mut().for_each(|sample| sample.pose = sample.pose.map(|pose| change(&pose)));
}

fn target(recording: &mut Recording, change: impl Fn(&Pose) -> Pose) {
    recording.samples.iter_mut().flat_map(|sample| &mut sample.targets).for_each(|seen| seen.pose = change(&seen.pose));
}

/// The pose whose quaternion is read in the order in which it was not written.
fn w_first(pose: &Pose) -> Pose {
    let [x, y, z, w] = so3::quaternion(&pose.rotation);
    Pose { rotation: so3::from_quaternion([w, x, y, z]), ..*pose }
}

fn millimetres(pose: &Pose) -> Pose {
    Pose { translation: pose.translation * 1000.0, ..*pose }
}
