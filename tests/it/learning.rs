//! What the tests of learning share: recordings of a rig, what is learned from them, and how it is judged.
use handeye::Error;
use handeye::calibrate::{Calibration, Options, calibrate, evaluate};
use handeye::recording::Recording;
use handeye::rig::{Estimate, Joint, Noise, Rig};
use handeye::simulate::{SimulateOptions, simulate};
use handeye::solvers::Pose;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::ops::ControlFlow;

#[path = "../../benches/common/variants.rs"]
pub mod variants;

/// A recording of `samples` random positions with the rig's noise, nothing missed and nothing wrong.
pub fn record(truth: &Rig, samples: usize, seed: u64) -> Recording {
    let options = SimulateOptions { samples, seed, ..SimulateOptions::default() };
    simulate(truth, &options).expect("the rig is complete and in view").recording
}

/// Learns with the default options, watched by nobody.
pub fn learn(rig: &Rig, recording: &Recording) -> Result<Calibration, Error> {
    calibrate(rig, recording, &Options::default(), &mut |_| ControlFlow::Continue(()))
}

/// Pixel rms on 100 fresh samples over the floor, which is √2 standard deviations of a coordinate.
pub fn over_floor(learned: &Rig, truth: &Rig, seed: u64) -> f64 {
    let fresh = record(truth, 100, seed.wrapping_add(1_000_000));
    let judged = evaluate(learned, &fresh).expect("the learned rig is complete");
    judged.total.rms_px / (truth.noise.pixels * 2.0_f64.sqrt())
}

/// A rig of which only the noise is known.
pub fn nothing(truth: &Rig) -> Rig {
    Rig { noise: truth.noise, estimate: Estimate::default(), ..Rig::default() }
}

/// A rig of which the noise is known and the chain as a data sheet has it: 1 mm and 1 mrad off (standard deviations).
pub fn nominal_chain(truth: &Rig, seed: u64) -> Rig {
    let mut rig = Rig { robot: truth.robot.clone(), ..nothing(truth) };
    let mut normal = Normal::new(seed);
    for Joint { offset, d, a, alpha, .. } in &mut rig.robot.joints {
        for value in [offset, d, a, alpha].into_iter().flatten() {
            *value += normal.draw(0.001);
        }
    }
    rig
}

/// Gaussian numbers.
pub struct Normal(ChaCha8Rng);

impl Normal {
    pub fn new(seed: u64) -> Self {
        Normal(ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn draw(&mut self, sd: f64) -> f64 {
        sd * self.0.sample::<f64, _>(StandardNormal)
    }

    /// The pose, turned and shifted in its own frame by standard deviations per axis.
    pub fn move_pose(&mut self, pose: &Pose, angle: f64, length: f64) -> Pose {
        let w = Vector3::from_fn(|_, _| self.draw(angle));
        *pose * Pose::new(w, Vector3::from_fn(|_, _| self.draw(length)))
    }
}

/// No noise of anything but pixels.
pub fn pixel_noise(pixels: f64) -> Noise {
    Noise { pixels, ..Noise::default() }
}
