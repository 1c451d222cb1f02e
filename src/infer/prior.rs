//! What is known of the joints beside the pixels.
use super::information::Information;
use super::joint_box::JointBox;
use crate::Error;

/// Where the joints are expected.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prior {
    /// One reading per joint [rad or m]; empty where nothing is known.
    pub mean: Vec<f64>,
    /// Standard deviation of each [rad or m]; infinite where the mean is only where to begin. Empty: all infinite.
    pub sd: Vec<f64>,
}

impl Prior {
    /// Nothing is known but the limits.
    pub fn none() -> Self {
        Prior::default()
    }

    /// Where to begin, and to stay where the pixels leave the joints open; says nothing otherwise.
    pub fn start(joints: &[f64]) -> Self {
        Prior { mean: joints.to_vec(), sd: Vec::new() }
    }

    /// Readings with a standard deviation [rad or m].
    pub fn readings(joints: &[f64], sd: f64) -> Self {
        Prior { mean: joints.to_vec(), sd: vec![sd; joints.len()] }
    }

    pub(super) fn is_given(&self) -> bool {
        !self.mean.is_empty()
    }

    /// Fails where it is not of `n` joints.
    pub(super) fn check(&self, n: usize) -> Result<(), Error> {
        let fits = |list: &[f64]| list.is_empty() || list.len() == n;
        if !fits(&self.mean) || !fits(&self.sd) {
            let (mean, sd) = (self.mean.len(), self.sd.len());
            return Err(Error::Unusable(format!(
                "a prior of {mean} joints with {sd} deviations; the rig has {n} joints"
            )));
        }
        if !self.mean.iter().all(|mean| mean.is_finite()) || !self.sd.iter().all(|sd| *sd > 0.0) {
            return Err(Error::Unusable("a prior needs finite joints and deviations above 0".to_owned()));
        }
        Ok(())
    }

    /// Its mean, or the middle of where the rig was learned or of the limits; and where nothing else is said, the spread of joints anywhere inside the limits.
    pub(super) fn information(&self, limits: &JointBox) -> Information {
        let n = limits.len();
        let mut information = Information { matrix: vec![0.0; n * n], ..Information::default() };
        for i in 0..n {
            let (lower, upper) = limits.range(i);
            information.mean.push(self.mean.get(i).copied().unwrap_or_else(|| limits.middle(i)));
            let anywhere = ((upper - lower) / 12.0_f64.sqrt()).max(1e-6);
            let read = self.sd.get(i).copied().filter(|sd| sd.is_finite());
            let sd = read.unwrap_or(anywhere);
            information.matrix[i * n + i] = 1.0 / (sd * sd);
            information.weak.push(if read.is_some() { 0.0 } else { 1.0 / (sd * sd) });
        }
        information
    }

    /// -ln of the density of joints, of those that are read by their readings and of the others by where the rig was learned; but for
    /// a constant.
    pub(super) fn cost(&self, joints: &[f64], limits: &JointBox) -> f64 {
        let term = |(i, joint): (usize, &f64)| match (self.mean.get(i), self.sd.get(i)) {
            (Some(mean), Some(sd)) if sd.is_finite() => 0.5 * ((joint - mean) / sd).powi(2),
            _ => limits.strangeness(i, *joint),
        };
        joints.iter().enumerate().map(term).sum()
    }
}
