//! From what is true to what is read: noise, missed detections, gross outliers.
use super::SimulateOptions;
use crate::recording::{Detection, PointDetection, RecordedCamera, Recording, Sample};
use crate::rig::{Noise, PoseNoise, Rig};
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Streams of random numbers beside that of the motions, which is 0.
const NOISE: u64 = 1;
const DETECTION: u64 = 2;
const POINT_NOISE: u64 = 3;
const POINT_DETECTION: u64 = 4;

/// A wrong point is up to this share of its distance off, along each axis of the camera.
const ASTRAY: f64 = 0.5;

/// A recording with noise, and how many of its detections are missing or wrong.
pub(super) struct Measured {
    pub recording: Recording,
    pub missed: usize,
    pub outliers: usize,
}

/// Adds the rig's noise to a true recording; leaves out what is missed, and what a rig without noise for it does not record.
pub(super) fn measure(truth: &Recording, rig: &Rig, options: &SimulateOptions) -> Measured {
    let stream = |number| {
        let mut random = ChaCha8Rng::seed_from_u64(options.seed);
        random.set_stream(number);
        random
    };
    let (mut noise, mut detector) = (stream(NOISE), stream(DETECTION));
    let (mut point_noise, mut point_detector) = (stream(POINT_NOISE), stream(POINT_DETECTION));
    let mut measured = Measured { recording: truth.clone(), missed: 0, outliers: 0 };
    let Measured { recording, missed, outliers } = &mut measured;
    let mut count = |fate: Fate| {
        *outliers += usize::from(fate == Fate::Outlier);
        *missed += usize::from(fate == Fate::Missed);
        fate != Fate::Missed
    };
    for sample in &mut recording.samples {
        blur(sample, &rig.noise, &mut noise);
        for seen in &mut sample.points {
            seen.point = seen.point.map(|x| x + rig.noise.points * point_noise.sample::<f64, _>(StandardNormal));
        }
        sample.pixels.retain_mut(|detection| count(detect(detection, &truth.cameras, options, &mut detector)));
        sample.points.retain_mut(|detection| count(detect_point(detection, options, &mut point_detector)));
    }
    measured
}

/// Gaussian noise on everything that a sample holds but points.
fn blur(sample: &mut Sample, noise: &Noise, random: &mut ChaCha8Rng) {
    let mut normal = |sd: f64| -> f64 { sd * random.sample::<f64, _>(StandardNormal) };
    sample.joints.iter_mut().flatten().for_each(|joint| *joint += normal(noise.joints));
    sample.joint_action.iter_mut().flatten().for_each(|joint| *joint += normal(noise.joint_action));
    let pose = sample.pose.filter(|_| noise.pose.is_noisy());
    sample.pose = pose.map(|pose| moved(pose, noise.pose, || normal(1.0)));
    // On A itself: the residual of eq. 12 of the paper, P_next P⁻¹ against A, is white.
    sample.pose_action = sample.pose_action.map(|action| moved(action, noise.pose_action, || normal(1.0)));
    for detection in &mut sample.pixels {
        detection.pixel = detection.pixel.map(|coordinate| coordinate + normal(noise.pixels));
    }
}

/// A pose turned and shifted by noise along the axes of its parent. `normal` draws standard normal numbers.
pub(super) fn moved(pose: Pose, noise: PoseNoise, mut normal: impl FnMut() -> f64) -> Pose {
    let w = Vector3::from_fn(|_, _| noise.rot * normal());
    let v = Vector3::from_fn(|_, _| noise.xyz * normal());
    Pose { rotation: so3::exp(&w) * pose.rotation, translation: pose.translation + v }
}

#[derive(Clone, Copy, PartialEq)]
enum Fate {
    Seen,
    Missed,
    Outlier,
}

/// Whether a detection is missed, or replaced by another place of the image. Every detection takes as many random numbers,
/// so what is missed with a small probability is missed with a larger one too.
fn detect(
    detection: &mut Detection,
    cameras: &[RecordedCamera],
    options: &SimulateOptions,
    random: &mut ChaCha8Rng,
) -> Fate {
    let [misses, errs, u, v] = std::array::from_fn(|_| random.random::<f64>());
    if misses < options.missed {
        return Fate::Missed;
    }
    if errs < options.outliers {
        let [width, height] = cameras[detection.camera as usize].size.unwrap_or_default().map(f64::from);
        detection.pixel = [u * width - 0.5, v * height - 0.5];
        return Fate::Outlier;
    }
    Fate::Seen
}

/// Whether a point is missed, or replaced by another place before the camera.
fn detect_point(detection: &mut PointDetection, options: &SimulateOptions, random: &mut ChaCha8Rng) -> Fate {
    let [misses, errs, shift @ ..]: [f64; 5] = std::array::from_fn(|_| random.random::<f64>());
    if misses < options.missed {
        return Fate::Missed;
    }
    if errs < options.outliers {
        let reach = ASTRAY * Vector3::from(detection.point).norm();
        detection.point.iter_mut().zip(shift).for_each(|(x, share)| *x += reach * (2.0 * share - 1.0));
        return Fate::Outlier;
    }
    Fate::Seen
}
