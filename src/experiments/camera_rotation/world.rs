//! The scene: an arm, two cameras at a target, and trackers.
use crate::Error;
use crate::experiments::Options;
use crate::experiments::controlled::Controlled;
use crate::experiments::setting::first_seed;
use crate::rig::{Camera, Feature, Parent, Rig, catalog};
use crate::servo::uncalibrated::{Quantity, Row};
use crate::servo::{Arm, Configuration};
use handeye_solvers::Pose;
use handeye_solvers::nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::{FRAC_PI_4, PI};

/// Where the arm begins and where it shall be, as joints [rad].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scene {
    /// Joints at the start.
    pub start: [f64; 6],
    /// Joints whose view is the target.
    pub target: [f64; 6],
    /// Focal length of the cameras [px]; the principal point is at 0.
    pub focal: f64,
}

/// What a tracker makes of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tracker {
    /// The pixel.
    Perfect,
    /// The nearest whole pixel.
    Rounded,
    /// The pixel of what moves, and the nearest whole pixel of its target: no more can be known of a target that is seen in whole pixels.
    RoundedTarget,
    /// The pixel with normal noise of this standard deviation [px], drawn anew for every measurement.
    Gaussian(f64),
}

/// A camera that looks at the target horizontally.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where from, about the vertical through the target [rad].
    pub angle: f64,
    /// How far beside the line to the target [m]; the optical axis stays parallel to it.
    pub beside: f64,
    /// How far from the target [m].
    pub distance: f64,
}

/// A scene with its cameras.
pub struct World {
    arm: Arm,
    at: Configuration,
    features: Vec<Vector3<f64>>,
    target_points: Vec<Vector3<f64>>,
    target_pixels: Vec<f64>,
    tracker: Tracker,
    random: ChaCha8Rng,
}

/// The tool's points in the frame of the last link [m]: those of the thesis (listing 2), 0.1 m in front of it.
const POINTS: [[f64; 3]; 3] = [[0.0, 0.0, 0.2], [0.0, -0.1, 0.0], [0.0, 0.1, 0.0]];

/// Focal length of Corke's default camera [px].
const FOCAL: f64 = 800.0;

/// Distance between start and target [m], as in the thesis.
const AWAY: f64 = 0.314;

impl Scene {
    /// Start and target are not in the thesis: these make its tables come out, and are one of many scenes that do.
    pub const RECONSTRUCTED: Scene = Scene {
        start: [0.5360, 2.0173, 2.9420, 0.2724, 0.5988, -0.4495],
        target: [0.6245, 2.7478, 2.1798, 0.2600, 1.0457, -0.8363],
        focal: FOCAL,
    };

    /// Round numbers: from the arm's nominal pose in Corke's toolbox, to one of the targets whose table 5.2 is as the thesis's is.
    pub const ROUND: Scene = Scene {
        start: [0.0, FRAC_PI_4, PI, 0.0, FRAC_PI_4, 0.0],
        target: [0.4, 0.8, 2.6, -0.4, 0.7, 0.7],
        focal: 480.0,
    };

    /// That of a trial: the reconstructed one in the first, others drawn.
    ///
    /// Errors: none with the shipped arm.
    pub(super) fn of_trial(seed: u64, options: &Options) -> Result<Scene, Error> {
        if seed == first_seed(options) { Ok(Scene::RECONSTRUCTED) } else { Scene::drawn(seed) }
    }

    /// Another start and target, as far apart, on whose way the arm is nowhere near a singularity.
    ///
    /// Errors: none with the shipped arm.
    pub fn drawn(seed: u64) -> Result<Scene, Error> {
        let arm = Arm::new(&rig(&[], FOCAL)?)?;
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        loop {
            let wrist = random.random_range(0.3..1.5) * if random.random_bool(0.5) { 1.0 } else { -1.0 };
            let target = [
                random.random_range(-2.7..2.7),
                random.random_range(0.0..3.0),
                random.random_range(-3.7..0.6),
                random.random_range(-1.5..1.5),
                wrist,
                random.random_range(-2.0..2.0),
            ];
            let way: [f64; 6] = std::array::from_fn(|_| random.random_range(-1.0..1.0));
            let at = |share: f64| -> [f64; 6] { std::array::from_fn(|i| target[i] + share * way[i]) };
            let away = |share: f64| (centre(&arm, &at(share)) - centre(&arm, &target)).norm();
            let far = (1..=300).map(|step| f64::from(step) * 0.005).find(|share| away(*share) >= AWAY);
            let Some(far) = far.filter(|far| far * way.iter().map(|x| x * x).sum::<f64>().sqrt() < 1.4) else {
                continue;
            };
            if (0..=10).all(|step| regularity(&arm, &at(0.1 * f64::from(step) * far)) > REGULAR) {
                return Ok(Scene { start: at(far), target, focal: FOCAL });
            }
        }
    }
}

/// Least of the singular values of the points' Jacobian over the largest; the reconstructed scene has 0.04 and more on its way.
const REGULAR: f64 = 0.03;

fn regularity(arm: &Arm, joints: &[f64]) -> f64 {
    let mut at = Configuration::default();
    arm.configure(joints, &mut at);
    let points = points(&at);
    let slope = |row: usize, column: usize| at.posture.axes[column].twist(&points[row / 3]).1[row % 3];
    let values = handeye_solvers::nalgebra::DMatrix::from_fn(9, 6, slope).singular_values();
    values.min() / values.max()
}

fn points(at: &Configuration) -> Vec<Vector3<f64>> {
    POINTS.iter().map(|point| at.posture.tip().transform(&Vector3::from(*point))).collect()
}

fn centre(arm: &Arm, joints: &[f64]) -> Vector3<f64> {
    let mut at = Configuration::default();
    arm.configure(joints, &mut at);
    points(&at).iter().sum::<Vector3<f64>>() / 3.0
}

/// The arm with its points and with cameras of a focal length [px] at poses `world_from_camera`.
fn rig(cameras: &[Pose], focal: f64) -> Result<Rig, Error> {
    let mut rig = catalog::rig("puma560")?;
    let feature = |(index, point): (usize, &[f64; 3])| Feature {
        name: format!("point-{index}"),
        parent: Parent::Tip,
        xyz: Some(*point),
    };
    rig.features = POINTS.iter().enumerate().map(feature).collect();
    let camera = |(index, pose): (usize, &Pose)| Camera {
        name: format!("camera-{index}"),
        fx: Some(focal),
        fy: Some(focal),
        cx: Some(0.0),
        cy: Some(0.0),
        pose: Some(*pose),
        ..Camera::default()
    };
    rig.cameras = cameras.iter().enumerate().map(camera).collect();
    Ok(rig)
}

impl Tracker {
    /// Standard deviation of a difference of two tracked pixels [px].
    pub fn sd(&self) -> f64 {
        match self {
            Tracker::Perfect => 0.0,
            Tracker::Rounded => (2.0_f64 / 12.0).sqrt(),
            Tracker::RoundedTarget => (1.0_f64 / 12.0).sqrt(),
            Tracker::Gaussian(sd) => 2.0_f64.sqrt() * sd,
        }
    }

    fn track(&self, pixel: f64, random: &mut ChaCha8Rng) -> f64 {
        match self {
            Tracker::Perfect | Tracker::RoundedTarget => pixel,
            Tracker::Rounded => pixel.round(),
            Tracker::Gaussian(sd) => {
                let noise: f64 = StandardNormal.sample(random);
                pixel + sd * noise
            }
        }
    }
}

impl View {
    /// Of two parallel cameras, 0.3 m apart and 1 m from the target.
    pub fn pair(angle: f64) -> [View; 2] {
        [-0.15, 0.15].map(|beside| View { angle, beside, distance: 1.0 })
    }

    /// `world_from_camera`, of a target in the world [m].
    pub fn pose(&self, target: &Vector3<f64>) -> Pose {
        let (sin, cos) = self.angle.sin_cos();
        let [ahead, right] = [Vector3::new(cos, sin, 0.0), Vector3::new(sin, -cos, 0.0)];
        let translation = target - self.distance * ahead + self.beside * right;
        Pose { translation, rotation: Matrix3::from_columns(&[right, -Vector3::z(), ahead]) }
    }
}

impl World {
    /// Errors: none with the shipped arm.
    pub fn new(scene: &Scene, views: &[View], tracker: Tracker, seed: u64) -> Result<World, Error> {
        let target = centre(&Arm::new(&rig(&[], scene.focal)?)?, &scene.target);
        let poses: Vec<Pose> = views.iter().map(|view| view.pose(&target)).collect();
        let arm = Arm::new(&rig(&poses, scene.focal)?)?;
        let mut world = World {
            arm,
            at: Configuration::default(),
            features: POINTS.map(Vector3::from).to_vec(),
            target_points: Vec::new(),
            target_pixels: Vec::new(),
            tracker,
            random: ChaCha8Rng::seed_from_u64(seed),
        };
        world.move_to(&scene.target);
        world.target_points = points(&world.at);
        world.target_pixels = world.pixels();
        world.move_to(&scene.start);
        Ok(world)
    }

    /// The arm's joints, free to move.
    pub fn quantities(&self) -> Vec<Quantity> {
        (0..6).map(|joint| Quantity { name: format!("q{joint}"), ..Quantity::default() }).collect()
    }

    /// What is seen, with the tracker's noise.
    pub fn rows(&self) -> Vec<Row> {
        let per_camera = 2 * self.features.len();
        (0..self.target_pixels.len()).map(|row| Row { sd: self.tracker.sd(), camera: row / per_camera }).collect()
    }

    /// Where the arm is [rad].
    pub fn joints(&self) -> &[f64] {
        &self.at.joints
    }

    /// Moves the arm there.
    pub fn move_to(&mut self, joints: &[f64]) {
        self.arm.configure(joints, &mut self.at);
    }

    fn pixels(&self) -> Vec<f64> {
        let cameras = 0..self.at.cameras.len();
        let pairs = cameras.flat_map(|camera| (0..self.features.len()).map(move |feature| (camera, feature)));
        pairs.flat_map(|(camera, feature)| self.arm.pixel(&self.at, camera, feature).unwrap_or([f64::NAN; 2])).collect()
    }

    /// What the trackers see of the points minus what they see of the target [px].
    pub fn errors(&mut self) -> Vec<f64> {
        let pixels = self.pixels();
        let of_target = if self.tracker == Tracker::RoundedTarget { Tracker::Rounded } else { self.tracker };
        let mut see = |(pixel, target): (&f64, &f64)| {
            self.tracker.track(*pixel, &mut self.random) - of_target.track(*target, &mut self.random)
        };
        pixels.iter().zip(&self.target_pixels).map(&mut see).collect()
    }

    /// Sum of the absolute coordinates of what separates the points from their targets [m].
    pub fn error_3d(&self) -> f64 {
        points(&self.at).iter().zip(&self.target_points).map(|(point, target)| (point - target).abs().sum()).sum()
    }
}

impl Controlled for World {
    fn quantities(&self) -> Vec<Quantity> {
        World::quantities(self)
    }

    fn rows(&mut self) -> Result<Vec<Row>, Error> {
        Ok(World::rows(self))
    }

    fn readings(&self) -> Vec<f64> {
        self.joints().to_vec()
    }

    fn errors(&mut self) -> Vec<f64> {
        World::errors(self)
    }

    fn carry_out(&mut self, motion: &[f64]) -> Result<(), Error> {
        let there: Vec<f64> = self.joints().iter().zip(motion).map(|(joint, motion)| joint + motion).collect();
        self.move_to(&there);
        Ok(())
    }
}
