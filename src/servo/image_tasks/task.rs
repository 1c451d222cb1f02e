//! A task: a list of errors that shall all become 0.
use super::{Feature, Kind, Place, Seen};
use crate::Error;
use crate::servo::uncalibrated::Row;
use handeye_solvers::scalar::{Dual, LANES, derivatives, seed};
use nalgebra::Vector3;

/// What shall meet what, composed from named features.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageTask {
    name: Option<String>,
    cameras: Vec<String>,
    features: Vec<Feature>,
    parts: Vec<Part>,
    trackers: Trackers,
}

/// One of its errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// What shall meet what.
    pub kind: Kind,
    /// In the images of these cameras, by index.
    pub cameras: Vec<usize>,
}

/// Noise of what is tracked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trackers {
    /// Standard deviation of a pixel coordinate [px]. Default 0.5.
    pub pixels: f64,
    /// Standard deviation of a coordinate of a point in space [m]. Default 0.005.
    pub points: f64,
}

/// A row of a task at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowError {
    /// What shall become 0 [px]; NaN where a feature of it is not seen, or where those that are seen leave it undefined.
    pub error: f64,
    /// Standard deviation of its noise, to first order in that of the trackers [px]; NaN likewise.
    pub sd: f64,
    /// The camera, by index.
    pub camera: usize,
}

impl Default for Trackers {
    fn default() -> Self {
        Trackers { pixels: 0.5, points: 0.005 }
    }
}

impl ImageTask {
    /// Errors: [`Error::Unusable`] where there is nothing to do, where an index names no feature or camera, a feature comes twice in one
    /// part, or a number is not what it may be.
    pub fn new(
        name: Option<String>,
        cameras: Vec<String>,
        features: Vec<Feature>,
        parts: Vec<Part>,
        trackers: Trackers,
    ) -> Result<Self, Error> {
        let task = ImageTask { name, cameras, features, parts, trackers };
        if task.parts.is_empty() || task.cameras.is_empty() {
            return Err(Error::Unusable("a task needs a camera, and something that shall meet something".to_owned()));
        }
        let is_fine = |sd: f64| sd >= 0.0 && sd.is_finite();
        if !is_fine(trackers.pixels) || !is_fine(trackers.points) {
            return Err(Error::Unusable(format!("noise of trackers is {trackers:?}; it has to be 0 or more")));
        }
        for (index, part) in task.parts.iter().enumerate() {
            if let Some(problem) = ImageTask::problem_of(part, &task.cameras, &task.features) {
                return Err(Error::Unusable(format!("task {} ({}): {problem}", index + 1, part.kind.name())));
            }
        }
        Ok(task)
    }

    /// What is wrong with a part; `None` where it is fine.
    pub(super) fn problem_of(part: &Part, cameras: &[String], known: &[Feature]) -> Option<String> {
        let (features, n_cameras) = (part.kind.features(), cameras.len());
        if let Some(feature) = features.iter().find(|feature| **feature >= known.len()) {
            return Some(format!("feature {feature} of {}", known.len()));
        }
        if let Some(camera) = part.cameras.iter().find(|camera| **camera >= n_cameras) {
            return Some(format!("camera {camera} of {n_cameras}"));
        }
        if part.cameras.is_empty() {
            return Some("no camera sees it".to_owned());
        }
        let is_nowhere = |feature: usize, camera: usize| match &known[feature].place {
            Place::Image(pixels) => pixels.get(camera).is_none_or(|pixel| !pixel.iter().all(|x| x.is_finite())),
            Place::Hand(_) | Place::Target(_) => false,
        };
        for &camera in &part.cameras {
            if let Some(feature) = features.iter().find(|feature| is_nowhere(**feature, camera)) {
                let (name, camera) = (&known[*feature].name, &cameras[camera]);
                return Some(format!("`{name}` is on the image and has no pixel in that of `{camera}`"));
            }
        }
        let twice = features.iter().enumerate().find(|(i, feature)| features[..*i].contains(feature));
        twice.map(|(_, feature)| format!("`{}` is named twice", known[*feature].name)).or_else(|| part.kind.problem())
    }

    /// What its author calls it.
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Names of the cameras.
    pub fn cameras(&self) -> &[String] {
        &self.cameras
    }

    /// The features.
    pub fn features(&self) -> &[Feature] {
        &self.features
    }

    /// Its parts.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Noise of its trackers.
    pub fn trackers(&self) -> Trackers {
        self.trackers
    }

    /// The index of a feature.
    pub fn feature(&self, name: &str) -> Option<usize> {
        self.features.iter().position(|feature| feature.name == name)
    }

    /// Number of rows, over all cameras.
    pub fn rows(&self) -> usize {
        self.parts.iter().map(|part| part.kind.rows() * part.cameras.len()).sum()
    }

    /// Every row: by part, then by camera.
    pub fn errors(&self, seen: &Seen) -> Vec<RowError> {
        let pairs = self.parts.iter().flat_map(|part| part.cameras.iter().map(move |camera| (part, *camera)));
        pairs.flat_map(|(part, camera)| self.errors_of(part, camera, seen)).collect()
    }

    /// The errors of every row alone, in the order of [`ImageTask::errors`] [px]; NaN likewise.
    pub fn values(&self, seen: &Seen) -> Vec<f64> {
        let mut errors = Vec::with_capacity(self.rows());
        for part in &self.parts {
            for &camera in &part.cameras {
                part.kind.errors(&self.places(part, camera, seen), &mut errors);
            }
        }
        errors.iter_mut().filter(|error| !error.is_finite()).for_each(|error| *error = f64::NAN);
        errors
    }

    /// What [`crate::servo::uncalibrated::Uncalibrated`] is told of the rows; their standard deviations are those at a moment when all of
    /// them are seen.
    ///
    /// Errors: [`Error::NotEnoughData`] where a row is not seen.
    pub fn signals(&self, seen: &Seen) -> Result<Vec<Row>, Error> {
        let rows = self.errors(seen);
        match rows.iter().position(|row| !row.sd.is_finite()) {
            None => Ok(rows.iter().map(|row| Row { sd: row.sd, camera: row.camera }).collect()),
            Some(row) => Err(Error::NotEnoughData(format!(
                "row {row} of {} is not seen in camera `{}`; begin where all are",
                rows.len(),
                self.cameras[rows[row].camera]
            ))),
        }
    }

    /// Where the features of a part are seen: homogeneous pixels, or points in the camera's frame [m].
    fn places(&self, part: &Part, camera: usize, seen: &Seen) -> Vec<Vector3<f64>> {
        let place = |feature: usize| {
            if part.kind.is_spatial() {
                return Vector3::from(at(&seen.points, camera, feature));
            }
            let [u, v] = at(&seen.pixels, camera, feature);
            Vector3::new(u, v, 1.0)
        };
        part.kind.features().into_iter().map(place).collect()
    }

    fn errors_of(&self, part: &Part, camera: usize, seen: &Seen) -> Vec<RowError> {
        let features = part.kind.features();
        let (coordinates, noise) =
            if part.kind.is_spatial() { (3, self.trackers.points) } else { (2, self.trackers.pixels) };
        let values = self.places(part, camera, seen);
        let mut errors = Vec::new();
        part.kind.errors(&values, &mut errors);
        // Features that are fixed in the image have no noise.
        let noisy = |place: usize| !matches!(self.features[features[place]].place, Place::Image(_));
        let scattered: Vec<[usize; 2]> = (0..features.len())
            .filter(|place| noisy(*place))
            .flat_map(|place| (0..coordinates).map(move |coordinate| [place, coordinate]))
            .collect();
        let mut squares = vec![0.0; errors.len()];
        for chunk in scattered.chunks(LANES) {
            let mut seeded: Vec<Vector3<Dual>> = values.iter().map(|value| value.map(Dual::from)).collect();
            for (lane, &[place, coordinate]) in chunk.iter().enumerate() {
                seeded[place][coordinate] = seed(values[place][coordinate], lane);
            }
            let mut moved = Vec::new();
            part.kind.errors(&seeded, &mut moved);
            for (square, error) in squares.iter_mut().zip(&moved) {
                *square += derivatives(error).iter().map(|slope| slope * slope).sum::<f64>();
            }
        }
        let row = |(error, square): (&f64, &f64)| {
            let sd = noise * square.sqrt();
            let is_defined = error.is_finite() && sd.is_finite();
            let [error, sd] = if is_defined { [*error, sd] } else { [f64::NAN; 2] };
            RowError { error, sd, camera }
        };
        errors.iter().zip(&squares).map(row).collect()
    }
}

/// NaN where nothing stands.
fn at<const N: usize>(values: &[Vec<[f64; N]>], camera: usize, feature: usize) -> [f64; N] {
    values.get(camera).and_then(|values| values.get(feature)).copied().unwrap_or([f64::NAN; N])
}
