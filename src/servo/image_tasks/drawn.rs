//! Places in general position for what a task leaves open.
use super::{Geometry, ImageTask, Kind, Place, View};
use crate::camera::CameraModel;
use handeye_solvers::Pose;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Size of what is drawn, where nothing is given to go by [m].
const SIZE: f64 = 0.1;

/// Distance of the cameras from what they see, in sizes of it.
const AWAY: f64 = 8.0;

/// Halvings of a step that leads astray.
const HALVINGS: usize = 12;

/// Draws, of which the one that fixes most is kept.
const ATTEMPTS: usize = 6;

impl Geometry {
    /// Two cameras at about a right angle, or as many as the task has, and features in general position where the task does not say
    /// where they are: such that the hand at the identity solves it, as far as what is given allows. Points of conics are on circles.
    pub fn drawn(task: &ImageTask, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut best: Option<((bool, usize), Geometry)> = None;
        // Some are no general position: a point and a line in one plane with both cameras look alike whether they meet or not.
        for _ in 0..ATTEMPTS {
            let drawn = Geometry::draw(task, &mut random);
            let is_solved = drawn.errors(task, &Pose::identity()).iter().all(|error: &f64| error.abs() < 1e-6);
            let merit = (is_solved, drawn.rank(task));
            if best.as_ref().is_none_or(|(most, _)| merit > *most) {
                best = Some((merit, drawn));
            }
        }
        best.map_or(Geometry { cameras: Vec::new(), points: Vec::new() }, |(_, drawn)| drawn)
    }

    /// Degrees of freedom that the task fixes with the hand at the identity.
    fn rank(&self, task: &ImageTask) -> usize {
        let points = &self.points;
        let middle = mean(points).unwrap_or_default();
        let size = points.iter().map(|point| (point - middle).norm()).fold(1e-3, f64::max);
        // Rotations are about the middle of everything.
        let moved = |lane: usize, by: f64| {
            let unit = Vector3::ith(lane % 3, by);
            let pose =
                if lane < 3 { Pose::new(unit, Vector3::zeros()) } else { Pose::new(Vector3::zeros(), unit * size) };
            let shift = middle - pose.rotation * middle;
            DVector::from_vec(self.errors(task, &Pose { translation: pose.translation + shift, ..pose }))
        };
        let slopes = (0..6).map(|lane| (moved(lane, 1e-5) - moved(lane, -1e-5)) / 2e-5).collect::<Vec<_>>();
        let slopes = DMatrix::from_columns(&slopes);
        if !slopes.iter().all(|slope| slope.is_finite()) {
            return 0;
        }
        let values = slopes.singular_values();
        values.iter().filter(|value| **value > 1e-4 * values.max()).count()
    }

    fn draw(task: &ImageTask, random: &mut ChaCha8Rng) -> Self {
        let given: Vec<Vector3<f64>> = task.features().iter().filter_map(given_place).collect();
        let centre = mean(&given).unwrap_or_default();
        let spread = given.iter().map(|point| (point - centre).norm()).fold(0.0, f64::max);
        let size = if spread > 0.0 { spread } else { SIZE };
        let mut points: Vec<Vector3<f64>> = task
            .features()
            .iter()
            .map(|feature| feature.place.xyz().unwrap_or_else(|| centre + size * in_ball(random)))
            .collect();
        let is_drawn = |index: usize| task.features()[index].place.xyz().is_none();
        let mut free: Vec<usize> = (0..points.len()).filter(|index| is_drawn(*index)).collect();
        for part in task.parts() {
            let Kind::PointToConic(kind) = &part.kind else { continue };
            if kind.conic.iter().all(|index| free.contains(index)) {
                let [right, down, _] = axes(&in_ball(random));
                let middle = centre + 0.3 * size * in_ball(random);
                let n = kind.conic.len() as f64;
                for (place, &index) in kind.conic.iter().enumerate() {
                    let angle = (place as f64 + random.random_range(-0.3..0.3)) * TAU / n;
                    points[index] = middle + 0.7 * size * (angle.cos() * right + angle.sin() * down);
                }
                free.retain(|index| !kind.conic.contains(index));
            }
        }
        let cameras = cameras(task.cameras().len(), &centre, AWAY * size, random);
        let mut geometry = Geometry { cameras, points };
        geometry.meet(task, &free, size);
        geometry
    }

    /// Moves what is free as little as it takes to solve the task with the hand at the identity: Gauss-Newton steps of least length.
    fn meet(&mut self, task: &ImageTask, free: &[usize], size: f64) {
        let here = Pose::identity();
        let step = 1e-6 * size;
        for _ in 0..50 {
            let errors = DVector::from_vec(self.errors(task, &here));
            if free.is_empty() || errors.amax() < 1e-10 {
                break;
            }
            let mut slopes = DMatrix::zeros(errors.len(), 3 * free.len());
            for column in 0..3 * free.len() {
                let (index, axis) = (free[column / 3], column % 3);
                let before = self.points[index][axis];
                let mut at = |value: f64| {
                    self.points[index][axis] = value;
                    DVector::from_vec(self.errors(task, &here))
                };
                let difference = (at(before + step) - at(before - step)) / (2.0 * step);
                self.points[index][axis] = before;
                slopes.set_column(column, &difference);
            }
            if !slopes.iter().chain(errors.iter()).all(|value| value.is_finite()) {
                break;
            }
            let largest = slopes.amax();
            let Ok(motion) = slopes.svd(true, true).solve(&-&errors, 1e-9 * largest) else { break };
            if motion.iter().any(|value| !value.is_finite()) {
                break;
            }
            let before = self.points.clone();
            let mut share = (0.5 * size / motion.amax().max(f64::MIN_POSITIVE)).min(1.0);
            // A shorter motion where the whole one leads astray.
            for _ in 0..HALVINGS {
                for (column, value) in motion.iter().enumerate() {
                    let (index, axis) = (free[column / 3], column % 3);
                    self.points[index][axis] = before[index][axis] + share * value;
                }
                if DVector::from_vec(self.errors(task, &here)).norm() < errors.norm() {
                    break;
                }
                share *= 0.5;
            }
        }
    }
}

fn given_place(feature: &super::Feature) -> Option<Vector3<f64>> {
    match &feature.place {
        Place::Hand(xyz) | Place::Target(xyz) => *xyz,
        Place::Image(_) => None,
    }
}

/// The mean of points; `None` of none.
pub(super) fn mean(points: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    (!points.is_empty()).then(|| points.iter().sum::<Vector3<f64>>() / points.len() as f64)
}

/// Uniform in the unit ball, without its middle.
pub(super) fn in_ball(random: &mut ChaCha8Rng) -> Vector3<f64> {
    loop {
        let point = Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
        if (0.1..=1.0).contains(&point.norm()) {
            return point;
        }
    }
}

/// Right-handed axes of which the last points along a vector.
pub(super) fn axes(ahead: &Vector3<f64>) -> [Vector3<f64>; 3] {
    let ahead = ahead.normalize();
    let right = ahead.cross(&Vector3::ith(ahead.iamin(), 1.0)).normalize();
    [right, ahead.cross(&right), ahead]
}

/// `world_from_camera` at a place, looking at another.
pub(super) fn looking(from: Vector3<f64>, at: &Vector3<f64>) -> Pose {
    Pose { rotation: Matrix3::from_columns(&axes(&(at - from))), translation: from }
}

fn cameras(n: usize, centre: &Vector3<f64>, away: f64, random: &mut ChaCha8Rng) -> Vec<View> {
    let first = random.random_range(0.0..TAU);
    let apart = if n < 4 { FRAC_PI_2 } else { TAU / n as f64 };
    let mut view = |index: usize| {
        let azimuth = first + apart * index as f64 + random.random_range(-0.2..0.2);
        let height = random.random_range(0.4..0.8_f64);
        let side = Vector3::new(height.cos() * azimuth.cos(), height.cos() * azimuth.sin(), height.sin());
        let mut intrinsics = [0.0; crate::camera::PARAMETERS];
        intrinsics[..4].copy_from_slice(&[800.0, 800.0, 320.0, 240.0]);
        View { model: CameraModel::Pinhole, intrinsics, pose: looking(centre + away * side, centre), on_hand: false }
    };
    (0..n).map(&mut view).collect()
}
