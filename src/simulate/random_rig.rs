//! Random rigs, for tests and benches that shall not depend on one robot.
use super::SimulateOptions;
use crate::camera::CameraModel;
use crate::reach::Views;
use crate::rig::{Camera, Feature, Joint, Limits, Model, Noise, Parent, Rig};
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{FRAC_PI_2, PI};

/// How far a joint turns to either side of the home position [rad].
const REACH: f64 = 1.0;

/// Half the width of the feature set [m].
const FEATURES: f64 = 0.06;

/// Smallest angle between the directions of two cameras from the working area [rad].
const APART: f64 = 0.6;

/// Positions by which a rig is judged, and how many of them have to have half the features in view of every camera.
const TRIALS: usize = 200;
const VIEWABLE: usize = TRIALS / 5;

/// A random complete arm of revolute joints, about 1 m long, whose neighbouring axes are not parallel.
///
/// Cameras (640 x 480, 600 px) look at the working area from 1.2 to 2 m, from further away where that is what it takes to see
/// half of the features in a fifth of all positions. The features fill 12 cm at the tip. 0.3 px noise. Never fails.
pub fn random_rig(joints: usize, cameras: usize, features: usize, seed: u64) -> Rig {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    for attempt in 0.. {
        let mut rig = arm(joints, features, random);
        let positions = positions(&rig, random);
        place_cameras(&mut rig, cameras, &positions, attempt, random);
        if is_viewable(&rig, &positions) {
            return rig;
        }
    }
    unreachable!("cameras go further away with every attempt, until they see everything")
}

fn arm(joints: usize, features: usize, random: &mut ChaCha8Rng) -> Rig {
    let mut rig = Rig {
        name: Some(format!("random arm of {joints} joints")),
        noise: Noise { pixels: 0.3, ..Noise::default() },
        ..Rig::default()
    };
    rig.robot.base = Some(Pose::identity());
    for index in 0..joints {
        // Short links are the more frequent, so that six of them make about a metre.
        let mut length = || 0.05 + 0.35 * random.random::<f64>().powi(3);
        let (d, a) = (length(), length());
        let alpha = FRAC_PI_2.copysign(random.random_range(-1.0..1.0)) + random.random_range(-0.3..0.3);
        let home: f64 = random.random_range(-1.0..1.0);
        rig.robot.joints.push(Joint {
            name: format!("j{}", index + 1),
            offset: Some(random.random_range(-PI..PI)),
            d: Some(d),
            a: Some(a),
            alpha: Some(alpha),
            limits: Limits { lower: Some(home - REACH), upper: Some(home + REACH), ..Limits::default() },
            ..Joint::default()
        });
    }
    for index in 0..features {
        rig.features.push(Feature {
            name: format!("f{index}"),
            parent: Parent::Tip,
            xyz: Some(std::array::from_fn(|_| random.random_range(-FEATURES..FEATURES))),
        });
    }
    rig
}

/// Joint positions, uniform within the limits.
fn positions(rig: &Rig, random: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let mut reading = |joint: &Joint| {
        let home = joint.limits.lower.unwrap_or(-REACH) + REACH;
        home + random.random_range(-REACH..REACH)
    };
    (0..TRIALS).map(|_| rig.robot.joints.iter().map(&mut reading).collect()).collect()
}

fn place_cameras(rig: &mut Rig, cameras: usize, positions: &[Vec<f64>], attempt: usize, random: &mut ChaCha8Rng) {
    let model = Model::new(rig).expect("the arm is complete");
    let tips = positions.iter().map(|joints| model.tip(joints).translation);
    let centre = tips.sum::<Vector3<f64>>() / positions.len() as f64;
    let mut directions: Vec<Vector3<f64>> = Vec::new();
    for index in 0..cameras {
        let direction = away_from(&directions, random);
        directions.push(direction);
        let distance = random.random_range(1.2..2.0) * (1.0 + 0.05 * attempt as f64);
        rig.cameras.push(Camera {
            name: format!("cam{}", index + 1),
            size: Some([640, 480]),
            model: Some(CameraModel::Pinhole),
            fx: Some(random.random_range(580.0..620.0)),
            fy: Some(random.random_range(580.0..620.0)),
            cx: Some(random.random_range(310.0..330.0)),
            cy: Some(random.random_range(230.0..250.0)),
            distortion: None,
            depth: false,
            parent: Parent::World,
            pose: Some(looking_from(centre + direction * distance, -direction)),
        });
    }
}

/// A direction no more than 60° above or below the horizon, apart from the others where there is room.
fn away_from(others: &[Vector3<f64>], random: &mut ChaCha8Rng) -> Vector3<f64> {
    let mut direction = Vector3::x();
    for _ in 0..50 {
        let (azimuth, elevation): (f64, f64) = (random.random_range(-PI..PI), random.random_range(-PI / 3.0..PI / 3.0));
        direction = Vector3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
        if others.iter().all(|other| other.dot(&direction) < APART.cos()) {
            break;
        }
    }
    direction
}

/// `world_from_camera` of a camera with a level x axis.
fn looking_from(position: Vector3<f64>, forward: Vector3<f64>) -> Pose {
    let right = forward.cross(&Vector3::z()).normalize();
    let down = forward.cross(&right);
    Pose { rotation: Matrix3::from_columns(&[right, down, forward]), translation: position }
}

fn is_viewable(rig: &Rig, positions: &[Vec<f64>]) -> bool {
    if rig.cameras.is_empty() || rig.features.is_empty() {
        return true;
    }
    let model = Model::new(rig).expect("the rig is complete");
    let views = Views::new(rig, &model, SimulateOptions::default().need(rig)).expect("every camera has a size");
    let mut in_view = vec![0; rig.cameras.len()];
    positions.iter().filter(|joints| views.shortfall(joints, &mut in_view).missing == 0).count() >= VIEWABLE
}
