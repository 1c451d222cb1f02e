//! Noise that was stated larger than the errors show it to be.
use super::observation::Kind;
use super::report::{Calibration, Distance};

/// Errors below this share of what the stated noise gives are told of.
const CLEAR: f64 = 0.75;

/// Noise that the data show to be smaller than stated. A fit does not believe that by itself, so that standard deviations are too large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverstatedNoise {
    /// Standard deviation of a coordinate, as stated.
    pub stated: Distance,
    /// The same, as the errors show it.
    pub shown: Distance,
    /// The first over the second: so many times too large is every standard deviation that the data decide.
    pub factor: f64,
}

/// Of pixels and of points, where it is clearly so; nothing where the noise was estimated.
///
/// Of N coordinates, as many errors as there are free numbers are fitted away. What is left, N', shows the noise to 1/√(2 N').
pub fn overstated_noise(calibration: &Calibration) -> Vec<OverstatedNoise> {
    let Calibration { rig, report } = calibration;
    let Some(fit) = rig.fit.as_ref().filter(|_| report.noise.is_none() && report.targets.is_none()) else {
        return Vec::new();
    };
    let of_state = if rig.noise.joints > 0.0 { rig.robot.joints.len() } else { 0 };
    let of_state = of_state.max(if rig.noise.pose.is_noisy() { 6 } else { 0 });
    let free = fit.sd.values().map(Vec::len).sum::<usize>() + of_state * report.samples;
    let counts = [report.observations.saturating_sub(report.points.observations), report.points.observations];
    let all: f64 = Kind::ALL.iter().zip(counts).map(|(kind, count)| kind.coordinates() * count as f64).sum();
    let share = 1.0 - free as f64 / all.max(1.0);
    let of_kind = |(kind, count): (Kind, usize)| {
        let sd = kind.sd(&rig.noise);
        let rms = if kind == Kind::Pixels { report.rms_px } else { report.points.rms_m };
        let left = share * kind.coordinates() * count as f64;
        let shown = rms / (kind.coordinates() * share).sqrt();
        let is_clear = left > 0.0 && shown > 0.0 && shown / sd < CLEAR.min(1.0 - 3.0 / (2.0 * left).sqrt());
        let overstated =
            || OverstatedNoise { stated: kind.distance(sd), shown: kind.distance(shown), factor: sd / shown };
        is_clear.then(overstated)
    };
    Kind::ALL.into_iter().zip(counts).filter_map(of_kind).collect()
}

/// What it means and what to do.
impl std::fmt::Display for OverstatedNoise {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (stated, shown, key) = (
            self.stated.rounded(),
            self.shown.rounded(),
            match self.stated {
                Distance::Pixels(_) => "pixels",
                Distance::Metres(_) => "points",
            },
        );
        write!(
            f,
            "the noise is stated too large: {stated} a coordinate, where the errors show {shown}; so standard deviations that the data decide are \
             about {:.1} times too large. `--estimate-noise` takes it from the data, or `[noise]` of the rig states it (`{key}`)",
            self.factor
        )
    }
}
