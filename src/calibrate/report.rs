//! What a calibration did and found, and how good it is.
use super::lag::in_words as lag_in_words;
use super::sources::Sources;
use super::{CameraErrors, Combination, Influence, PointErrors, TargetReport};
use crate::rig::{Length, Noise, Rig};

/// A learned rig and how it came about.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The rig with every value filled in, and how it was learned in `fit`.
    pub rig: Rig,
    /// How it was learned.
    pub report: Report,
}

/// How a rig was learned.
#[derive(Clone, Debug)]
pub struct Report {
    /// Samples used.
    pub samples: usize,
    /// Detections used.
    pub observations: usize,
    /// Detections left out as wrong.
    pub rejected: usize,
    /// Root mean square, mean and median of the pixel distances [px].
    pub rms_px: f64,
    /// Mean pixel distance [px].
    pub mean_px: f64,
    /// Median pixel distance [px].
    pub median_px: f64,
    /// Of those detections that are points of depth cameras.
    pub points: PointErrors,
    /// The same per camera.
    pub cameras: Vec<CameraErrors>,
    /// What was minimised, in order.
    pub stages: Vec<StageReport>,
    /// True where the last stage reached a minimum.
    pub converged: bool,
    /// True where lengths are metres; false where nothing metric is known, and they are in the model's unit.
    pub metric: bool,
    /// What the data cannot determine, in words, and how it was fixed.
    pub gauge: Vec<String>,
    /// Where the robot's state is known from: which readings and actions take part, and how well they are known.
    pub states: Vec<String>,
    /// The noise as it was estimated, where that was asked for; it is the learned rig's.
    pub noise: Option<Noise>,
    /// Samples, images and cameras that do not fit.
    pub findings: Vec<Finding>,
    /// Standard deviation of the tip over the recorded workspace; `None` where the data leave the rig open.
    pub tip: Option<TipDeviation>,
    /// Standard deviations of the pose of every camera of the learned rig against the arm. Where the base's frame lies against the first axis,
    /// which nothing that is seen depends on, is no part of them. Empty where the tip has none.
    pub camera_poses: Vec<PoseDeviation>,
    /// Combinations of numbers that nothing, or a prior more than the data, determines; those that move a camera against what it is mounted on
    /// first, then those that move the tip, then the others.
    pub weak: Vec<Combination>,
    /// What leaving out each sample would change, where [`Options::influence`](super::Options) asks for it.
    pub influence: Vec<Influence>,
    /// What was learned from targets, where these and not pixels were used; the pixel distances are 0 then.
    pub targets: Option<TargetReport>,
}

/// One stage of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct StageReport {
    /// Its name.
    pub name: String,
    /// Iterations of the minimiser, over all starts.
    pub iterations: usize,
    /// Loss before.
    pub loss_before: f64,
    /// Loss after.
    pub loss_after: f64,
    /// How long it took [s].
    pub seconds: f64,
}

/// Something in the recording that does not fit the rest.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// A camera has no detection in a sample with joints and no given pose; the learned rig is without it.
    UnseenCamera {
        /// Its name.
        camera: String,
    },
    /// All errors together are far larger than the stated noise: the model leaves something out.
    Misfit {
        /// Root mean square error of a coordinate over its stated standard deviation.
        ratio: f64,
        /// Stated standard deviation of a coordinate.
        stated: Distance,
    },
    /// Joints are stamped late, or early: without that, the samples in which the robot is fastest fit far better.
    Lag {
        /// By how much they are late [s].
        seconds: f64,
        /// Median distance of those samples as recorded, and without the lag.
        misfits: [Distance; 2],
    },
    /// A measured length that the learned rig misses by more than three of its standard deviations.
    MissedLength {
        /// What was measured.
        length: Length,
        /// How long it is in the learned rig [m].
        learned: f64,
    },
    /// Joints' numbers that are further from what the rig gives than is assumed of it, by more than 5 standard deviations, the furthest first.
    FarFromGiven {
        /// Path, given and learned value [m, rad], and standard deviations between them.
        values: Vec<(String, [f64; 2], f64)>,
    },
    /// Single detections were left out, in images of which the others fit.
    Outliers {
        /// How many.
        count: usize,
        /// Of how many.
        of: usize,
    },
    /// The joints of a sample, or the tip pose where poses are what was read, do not lead to what its images show; it was left
    /// out.
    WrongJoints {
        /// Index of the sample, from 0.
        sample: usize,
        /// Its median distance from where the learned rig predicts it.
        off: Distance,
        /// The sample whose images its joints fit, where the two were swapped.
        swapped_with: Option<usize>,
        /// True where tip poses were read and no joints.
        by_pose: bool,
    },
    /// Nothing was read of a sample's state, and its images do not determine it; it was left out.
    UnknownState {
        /// Index of the sample, from 0.
        sample: usize,
    },
    /// An image does not belong to its sample; it was left out.
    WrongImage {
        /// Index of the sample, from 0.
        sample: usize,
        /// The camera's name.
        camera: String,
        /// Its median distance from where the learned rig predicts it; of its points, where those are what is wrong.
        off: Distance,
    },
    /// A camera was not where it was during the whole recording; its images were left out of the fit of all else.
    CameraMoved {
        /// The camera's name.
        camera: String,
        /// Largest median shift of an image from where the learned rig puts it.
        largest: Distance,
        /// The sample of that image, from 0.
        sample: usize,
    },
}

impl Finding {
    /// In words, where a rig is judged and nothing is learned: what does not fit, and nothing of its being left out.
    pub fn of_evaluation(&self) -> String {
        match self {
            Finding::UnseenCamera { camera } => format!("camera `{camera}` saw nothing"),
            Finding::Misfit { ratio, stated } => format!(
                "errors are {ratio:.1} times the stated noise of {}: the noise is larger, a number that is held, a lens model or a joint's kind is \
                 wrong, or the fit went astray",
                stated.rounded()
            ),
            Finding::Lag { seconds, misfits: [with, without] } => {
                let [what, change] = lag_in_words(*seconds);
                format!(
                    "{what}: where the robot is fastest, {} in the median become {} without that, and nothing else that does not fit is to be \
                     believed before; {change}; or take what stands still alone (`--still`)",
                    with.rounded(),
                    without.rounded()
                )
            }
            Finding::MissedLength { length, learned } => format!(
                "{} was measured as {:.2} mm and is {:.2} mm in the learned rig: one of it and the other known lengths is wrong",
                length.between,
                1e3 * length.length,
                1e3 * learned
            ),
            Finding::FarFromGiven { values } => {
                let one = |(path, [given, learned], sds): &(String, [f64; 2], f64)| {
                    format!("{path} is {learned:.4}, {sds:.0} standard deviations from the {given:.4} that was given")
                };
                let named: Vec<String> = values.iter().take(3).map(one).collect();
                let more = values.len().saturating_sub(named.len());
                let more = if more > 0 { format!(" and {more} more") } else { String::new() };
                format!(
                    "{}{more}: this is another robot than the rig's, or a length that was given is wrong",
                    named.join(", ")
                )
            }
            Finding::Outliers { count, of } => format!("{count} single detections of {of} do not fit"),
            Finding::WrongJoints { sample, off, swapped_with, by_pose } => {
                let (leads, fits) = if *by_pose { ("tip pose does", "it fits") } else { ("joints do", "they fit") };
                let swapped =
                    swapped_with.map(|other| format!("; {fits} the images of sample {other}: the two are swapped"));
                let swapped = swapped.unwrap_or_default();
                format!("sample {sample}: its {leads} not lead to what the cameras saw ({off:.1}){swapped}")
            }
            Finding::UnknownState { sample } => {
                format!("sample {sample}: nothing was read of the robot's state, and its images do not determine it")
            }
            Finding::WrongImage { sample, camera, off } => {
                format!("sample {sample}: the image of camera `{camera}` belongs to another pose ({off:.1})")
            }
            Finding::CameraMoved { camera, largest, sample } => {
                format!("camera `{camera}` is not where the rig has it: sample {sample} is {largest:.1} off")
            }
        }
    }
}

/// Where a rig was learned: with what was left out.
impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let words = self.of_evaluation();
        match self {
            Finding::Misfit { .. }
            | Finding::Lag { .. }
            | Finding::MissedLength { .. }
            | Finding::FarFromGiven { .. } => f.write_str(&words),
            Finding::UnseenCamera { .. } | Finding::Outliers { .. } => {
                let verb = if matches!(self, Finding::UnseenCamera { .. }) { "was" } else { "were" };
                write!(f, "{words} and {verb} left out")
            }
            Finding::WrongJoints { swapped_with: Some(_), .. } => write!(
                f,
                "{words}, and both were left out (nothing has to be mended; to use them, exchange what was read in them)"
            ),
            Finding::WrongJoints { .. } | Finding::UnknownState { .. } | Finding::WrongImage { .. } => {
                write!(f, "{words}; it was left out")
            }
            Finding::CameraMoved { camera, largest, sample } => write!(
                f,
                "camera `{camera}` moved during the recording: sample {sample} is {largest:.1} off; its images were left out of the fit of all \
                 else"
            ),
        }
    }
}

/// A distance in an image, or in space where it is one of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distance {
    /// Of pixels [px].
    Pixels(f64),
    /// Of points [m].
    Metres(f64),
}

impl Distance {
    /// Without its unit [px or m]: comparable among distances of one kind.
    pub(crate) fn size(self) -> f64 {
        match self {
            Distance::Pixels(size) | Distance::Metres(size) => size,
        }
    }

    fn with_unit(&self) -> (f64, &'static str) {
        match self {
            Distance::Pixels(px) => (*px, "px"),
            Distance::Metres(m) => (1e3 * m, "mm"),
        }
    }

    /// With its unit, to three digits that count and no zeros behind them.
    pub fn rounded(&self) -> String {
        let (value, unit) = self.with_unit();
        let decimals = if value == 0.0 { 0 } else { (2.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize };
        let digits = format!("{value:.decimals$}");
        let digits = if decimals > 0 { digits.trim_end_matches('0').trim_end_matches('.') } else { &digits };
        format!("{digits} {unit}")
    }
}

/// With its unit; points in mm. A precision is that of the number.
impl std::fmt::Display for Distance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (value, unit) = self.with_unit();
        value.fmt(f)?;
        write!(f, " {unit}")
    }
}

/// Standard deviation of the tip's position over the recorded samples, as the data leave it.
///
/// In words it is what follows "the tip's position is known to".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipDeviation {
    /// Median over the samples, root of the trace of the covariance.
    pub median: f64,
    /// Largest over the samples.
    pub largest: f64,
    /// What errors of the recording alone account for, of the median.
    pub by_data: f64,
    /// What errors of each kind account for, of the median.
    pub sources: Sources,
    /// True where it is in metres; false where nothing metric is known and it is in the model's unit.
    pub metric: bool,
}

impl TipDeviation {
    /// True where what is known beside the recording decides a good part of it, so that two figures are needed to tell what is known.
    pub fn hangs_on_priors(&self) -> bool {
        self.by_data < 0.9 * self.median
    }

    /// A length of the tip with its unit.
    pub fn length(&self, length: f64) -> String {
        length_in_words(length, self.metric)
    }
}

impl std::fmt::Display for TipDeviation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [median, largest, by_data] = [self.median, self.largest, self.by_data].map(|length| self.length(length));
        let unit = if self.metric { "" } else { "; nothing metric is known, so in the model's unit" };
        if !self.hangs_on_priors() {
            return write!(f, "{median} (median standard deviation over the samples; largest {largest}{unit})");
        }
        let known = self.sources.in_words(self.metric, false);
        write!(
            f,
            "{by_data} by the data, and to {median} (largest {largest}) with what was given and measured besides: {known} "
        )?;
        write!(f, "(median standard deviations over the samples, whose squares add up{unit})")
    }
}

/// Standard deviations of the pose of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseDeviation {
    /// Of its centre [m, or the model's unit]: the root of the trace of the covariance.
    pub length: f64,
    /// Of its rotation [rad], likewise.
    pub angle: f64,
    /// What errors of each kind account for, of `length`.
    pub sources: Sources,
}

/// A length with its unit, or as a bare number where nothing metric is known.
pub fn length_in_words(length: f64, metric: bool) -> String {
    if metric { format!("{:.3} mm", 1e3 * length) } else { format!("{length:.2e}") }
}
