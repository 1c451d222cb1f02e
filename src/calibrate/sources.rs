//! What an uncertainty comes from: errors of the recording, or of what was known beside it.
use super::graph::Built;
use super::report::length_in_words;
use handeye_solvers::{Covariance, Key, Pose};
use nalgebra::DMatrix;
use std::ops::Range;

/// Parts below this share of the whole are not worth a word.
const WORTH_TELLING: f64 = 0.1;

/// Standard deviations that errors of each kind account for. Their squares add up to the square of the whole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sources {
    /// Of the recording: of its pixels, points and readings.
    pub data: f64,
    /// Of the base and the joints' numbers as they were given.
    pub robot: f64,
    /// Of cameras' poses and lenses as they were given.
    pub cameras: f64,
    /// Of features as they were given.
    pub features: f64,
    /// Of lengths that were measured, sides of tags among them.
    pub lengths: f64,
}

impl Sources {
    /// The kinds beside the recording's, in the order of [`Built::known`].
    fn known(&self) -> [(f64, &'static str); 4] {
        [
            (self.robot, "by the robot's numbers as given"),
            (self.cameras, "by what was given of the cameras"),
            (self.features, "by what was given of the features"),
            (self.lengths, "by the lengths that were measured"),
        ]
    }

    /// Standard deviation of the whole.
    pub fn whole(&self) -> f64 {
        (self.data.powi(2) + self.known().iter().map(|(sd, _)| sd * sd).sum::<f64>()).sqrt()
    }

    /// What counts, the largest first, as "4.792 mm by the lengths that were measured and 0.212 mm by the data"; empty where the data alone do.
    /// `metric`: whether they are in metres.
    pub(crate) fn in_words(&self, metric: bool, with_data: bool) -> String {
        let data = with_data.then_some((self.data, "by the data"));
        let least = WORTH_TELLING * self.whole();
        let mut parts: Vec<(f64, &str)> = self.known().into_iter().filter(|(sd, _)| *sd > least).collect();
        if parts.is_empty() {
            return String::new();
        }
        parts.extend(data);
        parts.sort_by(|one, other| other.0.total_cmp(&one.0));
        let words: Vec<String> =
            parts.iter().map(|(sd, what)| format!("{} {what}", length_in_words(*sd, metric))).collect();
        words.join(", ")
    }
}

/// Root of the trace of a pose's covariance over some coordinates of its step, and what it comes from.
pub(super) fn of_pose(
    built: &Built,
    covariance: &mut Covariance<'_>,
    pose: Key<Pose>,
    coordinates: [Range<usize>; 2],
) -> [Sources; 2] {
    let whole = covariance.of(pose);
    let parts = covariance.due_to(pose, &built.known);
    coordinates.map(|range| {
        let variance = |of: &DMatrix<f64>| range.clone().map(|i| of[(i, i)]).sum::<f64>().max(0.0);
        let known: Vec<f64> = parts.iter().map(variance).collect();
        let data = (variance(&whole) - known.iter().sum::<f64>()).max(0.0);
        let [data, robot, cameras, features, lengths] = [data, known[0], known[1], known[2], known[3]].map(f64::sqrt);
        Sources { data, robot, cameras, features, lengths }
    })
}
