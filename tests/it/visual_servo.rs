//! What image-based and pose-based servoing promise with rigs of every kind: cameras in the world or on the hand, one or several.
use crate::learning::variants;
use crate::servo::{look, mean_error, moved, positions};
use handeye::Error;
use handeye::infer::Sighting;
use handeye::rig::Rig;
use handeye::servo::{Arm, Gain, ImageBased, ImageSettings, InteractionMatrix, Limit, PoseBased, PoseSettings, Step};
use handeye::simulate::random_rig;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

pub type Make = fn(u64) -> Rig;

pub const KINDS: [(&str, Make); 9] = [
    ("four joints", |seed| random_rig(4, 2, 12, seed)),
    ("six joints", |seed| random_rig(6, 2, 12, seed)),
    ("one camera", |seed| random_rig(6, 1, 12, seed)),
    ("seven joints, three cameras", |seed| random_rig(7, 3, 12, seed)),
    ("camera on the hand", |seed| variants::on_hand(1, seed)),
    ("two cameras on the hand", |seed| variants::on_hand(2, seed)),
    ("sliding joint", variants::prismatic),
    ("features in a plane", |seed| variants::planar(1, seed)),
    ("UR5", variants::ur5),
];

/// Either controller.
pub enum Servo {
    Image(ImageBased),
    Pose(PoseBased),
}

impl Servo {
    pub fn both(rig: &Rig, matrix: InteractionMatrix, gain: Gain) -> [Servo; 2] {
        let image = ImageBased::new(rig, ImageSettings { matrix, gain, ..ImageSettings::default() }).unwrap();
        let pose = PoseBased::new(rig, PoseSettings { matrix, gain, ..PoseSettings::default() }).unwrap();
        [Servo::Image(image), Servo::Pose(pose)]
    }

    pub fn defaults(rig: &Rig) -> [Servo; 2] {
        Servo::both(rig, InteractionMatrix::default(), Gain::default())
    }

    pub fn name(&self) -> &str {
        match self {
            Servo::Image(_) => "image-based",
            Servo::Pose(_) => "pose-based",
        }
    }

    pub fn aim(&mut self, goal: &[Sighting]) {
        match self {
            Servo::Image(servo) => servo.aim(goal),
            Servo::Pose(servo) => servo.aim(goal),
        }
    }

    pub fn step(&mut self, seen: &[Sighting], joints: &[f64], limits: &[&dyn Limit], dt: f64) -> Result<Step, Error> {
        match self {
            Servo::Image(servo) => servo.step(seen, joints, limits, dt).cloned(),
            Servo::Pose(servo) => servo.step(seen, joints, limits, dt).cloned(),
        }
    }

    /// The pixel error that commands lead to, with everything seen and executed exactly [px].
    pub fn arrive(&mut self, rig: &Rig, start: &[f64], target: &[f64], commands: usize) -> f64 {
        let arm = Arm::new(rig).unwrap();
        let goal = look(&arm, rig, target);
        self.aim(&goal);
        let mut joints = start.to_vec();
        for _ in 0..commands {
            let step = self.step(&look(&arm, rig, &joints), &joints, &[], 100.0).unwrap();
            moved(&mut joints, &step.motion);
        }
        mean_error(&look(&arm, rig, &joints), &goal)
    }
}

/// A position in view, and one a share of the way to another.
pub fn start_and_target(rig: &Rig, away: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let places = positions(rig, 2, seed);
    let start = places[0].iter().zip(&places[1]).map(|(target, other)| target + away * (other - target)).collect();
    (start, places[0].clone())
}

#[test]
fn both_arrive_in_a_few_commands_with_rigs_of_every_kind() {
    for (name, make) in KINDS {
        for seed in 0..20 {
            let rig = make(seed);
            let [mut image, mut pose] = Servo::defaults(&rig);
            let (start, target) = start_and_target(&rig, 0.5, seed);
            // A redundant arm ends elsewhere than the joints that were inferred, for which the mean matrix was made.
            let commands = if rig.robot.joints.len() > 6 { 40 } else { 12 };
            let error = image.arrive(&rig, &start, &target, commands);
            assert!(error < 0.01, "{name}, seed {seed}: image-based, {error} px");
            // One camera before points in a plane takes another pose for the true one from farther away.
            let (start, target) = start_and_target(&rig, 0.25, seed);
            let error = pose.arrive(&rig, &start, &target, commands);
            assert!(error < 0.01, "{name}, seed {seed}: pose-based, {error} px");
        }
    }
}

#[test]
fn current_and_desired_matrices_arrive_from_nearby_with_rigs_of_every_kind() {
    for (name, make) in KINDS {
        for seed in 0..10 {
            let rig = make(seed);
            let (start, target) = start_and_target(&rig, 0.1, seed);
            for matrix in [InteractionMatrix::Current, InteractionMatrix::Desired] {
                for mut servo in Servo::both(&rig, matrix, Gain::Constant(0.5)) {
                    let error = servo.arrive(&rig, &start, &target, 40);
                    // At a singularity, the last tenth of a pixel takes many more.
                    assert!(error < 0.1, "{name}, seed {seed}: {matrix:?}, {}, {error} px", servo.name());
                }
            }
        }
    }
}

#[test]
fn one_command_leaves_an_error_of_third_order_with_the_mean_matrix_and_of_second_with_the_others() {
    let kinds: [Make; 2] = [|seed| random_rig(6, 2, 12, seed), |seed| variants::on_hand(1, seed)];
    for make in kinds {
        for (matrix, order) in
            [(InteractionMatrix::Current, 2), (InteractionMatrix::Desired, 2), (InteractionMatrix::Mean, 3)]
        {
            for controller in 0..2 {
                let ratio = |seed| {
                    let rig = make(seed);
                    let left = |away| {
                        let (start, target) = start_and_target(&rig, away, seed);
                        Servo::both(&rig, matrix, Gain::Constant(1.0))[controller].arrive(&rig, &start, &target, 1)
                    };
                    left(0.1) / left(0.05)
                };
                let mut ratios: Vec<f64> = (0..31).map(ratio).collect();
                ratios.sort_by(f64::total_cmp);
                let (found, expected) = (ratios[15], 2.0_f64.powi(order));
                assert!((found / expected - 1.0).abs() < 0.15, "{matrix:?}, controller {controller}: {found}");
            }
        }
    }
}

#[test]
fn a_gain_takes_its_share_and_an_adaptive_one_is_small_where_the_error_is_large() {
    let adaptive = Gain::Adaptive { near: 0.8, far: 0.2, slope: 0.05 };
    assert!((adaptive.share(0.0) - 0.8).abs() < 1e-12 && (adaptive.share(1e6) - 0.2).abs() < 1e-12);
    let fall = (adaptive.share(0.0) - adaptive.share(1e-5)) / 1e-5;
    assert!((fall - 0.05).abs() < 1e-5, "the gain falls by {fall}/px at the goal");
    assert!((1..100).all(|error| adaptive.share(f64::from(error)) < adaptive.share(f64::from(error - 1))));
    // Out of range it is brought back, and equal ends divide by nothing.
    assert_eq!(Gain::Constant(7.0).share(1.0), 1.0);
    assert_eq!(Gain::Adaptive { near: 0.4, far: 0.4, slope: 1.0 }.share(0.0), 0.4);
    for seed in 0..10 {
        let rig = random_rig(6, 2, 12, seed);
        let (start, target) = start_and_target(&rig, 0.002, seed);
        let before = {
            let arm = Arm::new(&rig).unwrap();
            mean_error(&look(&arm, &rig, &start), &look(&arm, &rig, &target))
        };
        for mut servo in Servo::both(&rig, InteractionMatrix::Mean, Gain::Constant(0.3)) {
            let left = servo.arrive(&rig, &start, &target, 1) / before;
            assert!((left - 0.7).abs() < 0.01, "seed {seed}: {}, {left} of the error is left", servo.name());
        }
    }
}

#[test]
fn a_target_that_moves_is_followed() {
    for seed in 0..10 {
        let rig = random_rig(6, 2, 12, seed);
        let arm = Arm::new(&rig).unwrap();
        let places = positions(&rig, 2, seed);
        for mut servo in Servo::defaults(&rig) {
            let mut joints = places[0].clone();
            for index in 0..=50 {
                let share = f64::from(index) / 50.0;
                let target: Vec<f64> = places[0].iter().zip(&places[1]).map(|(a, b)| a + share * (b - a)).collect();
                let goal = look(&arm, &rig, &target);
                servo.aim(&goal);
                let step = servo.step(&look(&arm, &rig, &joints), &joints, &[], 100.0).unwrap();
                moved(&mut joints, &step.motion);
                let error = mean_error(&look(&arm, &rig, &joints), &goal);
                assert!(error < 0.05, "seed {seed}: {}, {error} px behind at {index}", servo.name());
            }
        }
    }
}

#[test]
fn with_noisy_readings_and_motions_the_error_is_that_of_one_motion() {
    let sd = 0.02;
    let (mut floor, mut found) = ([0.0; 3], [0.0; 3]);
    for seed in 0..40 {
        let rig = random_rig(6, 2, 12, seed);
        let arm = Arm::new(&rig).unwrap();
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let mut noisy = |joints: &[f64]| -> Vec<f64> {
            joints.iter().map(|joint| joint + sd * random.sample::<f64, _>(StandardNormal)).collect()
        };
        let (start, target) = start_and_target(&rig, 0.5, seed);
        let goal = look(&arm, &rig, &target);
        let [image, pose] = Servo::defaults(&rig);
        let settings = ImageSettings { infer_joints: true, ..ImageSettings::default() };
        let inferring = Servo::Image(ImageBased::new(&rig, settings).unwrap());
        for (k, mut servo) in [image, pose, inferring].into_iter().enumerate() {
            servo.aim(&goal);
            let mut joints = start.clone();
            for index in 0..15 {
                let step = servo.step(&look(&arm, &rig, &joints), &noisy(&joints), &[], 100.0).unwrap();
                moved(&mut joints, &step.motion);
                joints = noisy(&joints);
                if index >= 3 {
                    found[k] += mean_error(&look(&arm, &rig, &joints), &goal);
                    floor[k] += mean_error(&look(&arm, &rig, &noisy(&target)), &goal);
                }
            }
        }
    }
    for (k, (found, floor)) in found.iter().zip(floor).enumerate() {
        // Two means of 480 errors of about 40 % of their mean: 2.6 % of standard deviation, and 3 of them.
        assert!((found / floor - 1.0).abs() < 0.08, "controller {k}: {} of the floor", found / floor);
    }
}
