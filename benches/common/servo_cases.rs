//! The servoing problems that ViSP was measured on, as rigs: `cases/servo_ur5.json`.
use handeye::infer::Sighting;
use handeye::rig::{Camera, Feature, Limits, Parent, Rig};
use handeye::servo::{Arm, Command, Configuration, Controller, Measurement};
use handeye::solvers::Pose;
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use serde_json::Value;

#[path = "dh_rows.rs"]
mod dh_rows;

/// A set of problems: start and target joints [rad] of one rig.
pub struct Cases {
    pub rig: Rig,
    pub pairs: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Cases {
    /// `set`: "mid" (two cameras in the world, features on the flange) or "eih" (a camera on the flange, points in the world).
    pub fn new(text: &str, set: &str) -> Cases {
        let all: Value = serde_json::from_str(text).expect("the file is whole");
        let eye_in_hand = set == "eih";
        let mut rig = Rig::default();
        rig.robot.base = Some(Pose::identity());
        for (i, row) in list(&all["robot"]["dh"]).iter().enumerate() {
            rig.robot.joints.push(dh_rows::joint(i, &numbers(row), Limits::default()));
        }
        let lens = &all["camera_intrinsics"];
        let number = |key: &str| lens[key].as_f64();
        let poses =
            if eye_in_hand { vec![all["eye_in_hand"]["eMc"].clone()] } else { list(&all["cameras_wMc"]).to_vec() };
        for (i, rows) in poses.iter().enumerate() {
            rig.cameras.push(Camera {
                name: format!("cam{i}"),
                size: Some([640, 480]),
                fx: number("fx"),
                fy: number("fy"),
                cx: number("cx"),
                cy: number("cy"),
                parent: if eye_in_hand { Parent::Tip } else { Parent::World },
                pose: Some(pose(rows)),
                ..Camera::default()
            });
        }
        let points = if eye_in_hand { &all["eye_in_hand"]["world_points"] } else { &all["features_flange"] };
        for (i, point) in list(points).iter().enumerate() {
            let parent = if eye_in_hand { Parent::World } else { Parent::Tip };
            let xyz = numbers(point).try_into().ok();
            rig.features.push(Feature { name: format!("f{i}"), parent, xyz });
        }
        let pair = |case: &Value| (numbers(&case["start"]), numbers(&case["target"]));
        let pairs = list(&all["sets"][set]["cases"]).iter().map(pair).collect();
        Cases { rig, pairs }
    }

    /// What all cameras see of all features, in the image or not. `arm`: of the rig.
    pub fn look(&self, arm: &Arm, joints: &[f64]) -> Vec<Sighting> {
        let mut at = Configuration::default();
        arm.configure(joints, &mut at);
        let features = self.rig.features.len();
        let all = (0..self.rig.cameras.len()).flat_map(|camera| (0..features).map(move |feature| (camera, feature)));
        let see = |(camera, feature)| Sighting {
            camera,
            feature,
            pixel: arm.pixel(&at, camera, feature).expect("of the rig"),
        };
        all.map(see).collect()
    }

    /// Mean pixel errors [px] after 0, 1, .. commands, of every pair in turn, several times over. `noise`: of joint readings and of
    /// motions [rad]. A loop that loses its features, or is farther from its goal than [`LOST`], stands still there.
    pub fn errors(&self, servo: &mut dyn Controller, commands: usize, noise: f64, times: usize) -> Vec<Vec<f64>> {
        let arm = Arm::new(&self.rig).expect("complete");
        let random = &mut ChaCha8Rng::seed_from_u64(1);
        let mut errors = vec![Vec::new(); commands + 1];
        for (start, target) in self.pairs.iter().cycle().take(times * self.pairs.len()) {
            let goal = self.look(&arm, target);
            servo.aim(&goal);
            let mut joints = start.clone();
            let mut lost = false;
            for (command, errors) in errors.iter_mut().enumerate() {
                let seen = self.look(&arm, &joints);
                let error = mean_error(&seen, &goal);
                lost |= error.is_nan() || error > LOST;
                errors.push(if lost { LOST } else { error });
                if command == commands || lost {
                    continue;
                }
                let read: Vec<f64> = joints.iter().map(|joint| joint + normal(noise, random)).collect();
                let now = Measurement { time: command as f64, joints: &read, seen: &seen, points: &[] };
                let Ok(Command::JointDelta(motion)) = servo.decide(&now, &[], 1.0).map(|decision| decision.command)
                else {
                    lost = true;
                    continue;
                };
                joints.iter_mut().zip(motion).for_each(|(joint, motion)| *joint += motion + normal(noise, random));
            }
        }
        errors
    }
}

/// Farther from its goal than this a loop counts as lost, with this error [px]: so it was for ViSP.
const LOST: f64 = 1000.0;

pub fn mean(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len() as f64
}

pub fn normal(sd: f64, random: &mut ChaCha8Rng) -> f64 {
    Normal::new(0.0, sd).expect("finite").sample(random)
}

/// Mean distance of pixels that are listed in the same order [px].
pub fn mean_error(seen: &[Sighting], goal: &[Sighting]) -> f64 {
    let distance = |(a, b): (&Sighting, &Sighting)| (a.pixel[0] - b.pixel[0]).hypot(a.pixel[1] - b.pixel[1]);
    seen.iter().zip(goal).map(distance).sum::<f64>() / seen.len() as f64
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}

fn numbers(value: &Value) -> Vec<f64> {
    list(value).iter().map(|number| number.as_f64().expect("a number")).collect()
}

fn pose(rows: &Value) -> Pose {
    let rows: Vec<Vec<f64>> = list(rows).iter().map(numbers).collect();
    Pose { rotation: Matrix3::from_fn(|i, j| rows[i][j]), translation: Vector3::from_fn(|i, _| rows[i][3]) }
}
