//! Errors that are too large for the stated noise.
use super::observation::Kind;
use super::{Distance, Errors, Finding, ReadingNoise};
use crate::rig::Noise;

/// Errors are told of where they are this many times the stated noise.
const MISFIT: f64 = 3.0;

/// Root mean square errors of a coordinate over the stated noise together with what noise of the readings gives, of pixels and of points, each with
/// the stated noise.
pub(crate) fn over_noise(noise: &Noise, errors: &Errors, of_readings: &ReadingNoise) -> [(f64, Distance); 2] {
    Kind::ALL.map(|kind| {
        let sd = kind.sd(noise);
        let (rms, of_readings) = match kind {
            Kind::Pixels => (errors.rms_px, of_readings.px),
            Kind::Points => (errors.points.rms_m, of_readings.m),
        };
        (rms / (kind.coordinates().sqrt() * sd).hypot(of_readings), kind.distance(sd))
    })
}

/// Where those errors are far larger.
pub(crate) fn misfits(noise: &Noise, errors: &Errors, of_readings: &ReadingNoise) -> Vec<Finding> {
    let all = over_noise(noise, errors, of_readings).into_iter().filter(|(ratio, _)| *ratio > MISFIT);
    all.map(|(ratio, stated)| Finding::Misfit { ratio, stated }).collect()
}
