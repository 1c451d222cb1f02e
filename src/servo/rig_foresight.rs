//! What a rig that may be outdated says of pixels, for servoing that corrects it.
use super::pixel_reader::PixelReader;
use super::uncalibrated::Foresight;
use super::{Arm, Configuration, PredictionBounds};
use crate::Error;
use crate::infer::Sighting;
use crate::rig::Rig;
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// A rig's pixels minus those aimed at, two rows per sighting of the goal.
pub(super) struct RigForesight {
    arm: Arm,
    reader: PixelReader,
    /// Joints that lead to the goal that servoing began with, asked for once: where a search begins, not where it ends.
    solution: Option<Option<Vec<f64>>>,
    /// None where the rig does not say how well it is known.
    bounds: Option<PredictionBounds>,
    goal: Vec<Sighting>,
    at: Configuration,
    /// Mean focal length of each camera [px], and the angle by which each seems to have turned [rad].
    focal: Vec<f64>,
    turned: BTreeMap<usize, f64>,
}

/// Standard deviation of slopes of a rig that says nothing of itself, as a share of their root mean square; and the largest that is believed
/// of one that does, as its numbers make up for each other.
const SHARE: f64 = 0.01;

/// A camera is where the rig has it where it seems to have turned by less than this many times what the best one has.
const STANDS: f64 = 2.0;

impl RigForesight {
    /// Of a complete rig.
    ///
    /// Errors: [`Error::Unusable`] with the paths of what is missing.
    pub fn new(rig: &Rig, goal: &[Sighting]) -> Result<Self, Error> {
        let says = rig.fit.as_ref().is_some_and(|fit| !fit.sd.is_empty());
        Ok(RigForesight {
            arm: Arm::new(rig)?,
            reader: PixelReader::new(rig)?,
            solution: None,
            bounds: if says { Some(PredictionBounds::new(rig)?) } else { None },
            goal: goal.to_vec(),
            at: Configuration::default(),
            focal: rig
                .cameras
                .iter()
                .map(|camera| 0.5 * (camera.fx.unwrap_or(1.0) + camera.fy.unwrap_or(1.0)))
                .collect(),
            turned: BTreeMap::new(),
        })
    }
}

impl Foresight for RigForesight {
    fn predict(&mut self, at: &[f64], errors: &mut Vec<f64>, slopes: &mut Vec<f64>) {
        errors.clear();
        slopes.clear();
        self.arm.configure(at, &mut self.at);
        for sight in self.goal.iter().filter_map(|goal| self.arm.sight(&self.at, goal)) {
            for axis in 0..2 {
                errors.push(sight.error[axis]);
                slopes.extend(sight.slopes(axis));
            }
        }
    }

    /// From the cameras that are where the rig has them.
    fn solution(&mut self, at: &[f64]) -> Option<Vec<f64>> {
        if self.solution.is_none() {
            let best = self.turned.values().copied().fold(f64::INFINITY, f64::min);
            let stands = |goal: &&Sighting| self.turned.get(&goal.camera).is_none_or(|turned| *turned <= STANDS * best);
            let goal: Vec<Sighting> = self.goal.iter().filter(stands).copied().collect();
            self.solution = Some(self.reader.joints_on_the_way(&goal, at).ok());
        }
        self.solution.clone().flatten()
    }

    /// A camera that sees features elsewhere than the rig has them by an angle has turned by about that: its slopes are off by that share.
    fn doubts(&mut self, at: &[f64], measured: &[f64]) -> Vec<DMatrix<f64>> {
        let n = at.len();
        let (mut errors, mut slopes) = (Vec::new(), Vec::new());
        self.predict(at, &mut errors, &mut slopes);
        let cameras: Vec<usize> = self.goal.iter().flat_map(|goal| [goal.camera; 2]).collect();
        for &camera in &cameras {
            let of_camera = (0..errors.len()).filter(|row| cameras[*row] == camera && measured[*row].is_finite());
            let squares: Vec<f64> = of_camera.map(|row| (measured[row] - errors[row]).powi(2)).collect();
            let rms = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
            self.turned.insert(camera, (rms / self.focal[camera]).max(SHARE));
        }
        let moved = self.bounds.as_ref().map(|bounds| bounds.slopes(at, &self.goal));
        let doubt = |(row, slopes): (usize, &[f64])| {
            let turned = self.turned.get(&cameras[row]).copied().unwrap_or(SHARE);
            let largest = turned * turned * slopes.iter().map(|slope| slope * slope).sum::<f64>() / n as f64;
            let Some(moved) = moved.as_ref().filter(|_| turned <= SHARE) else {
                return DMatrix::from_diagonal_element(n, n, largest);
            };
            let mut covariance = DMatrix::zeros(n, n);
            for change in moved {
                let change = &change[row * n..(row + 1) * n];
                covariance += DMatrix::from_fn(n, n, |i, k| change[i] * change[k]);
            }
            let mean = covariance.trace() / n as f64;
            if mean > largest { covariance * (largest / mean) } else { covariance }
        };
        slopes.chunks(n.max(1)).enumerate().map(doubt).collect()
    }
}
