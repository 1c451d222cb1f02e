//! A recording that was put together in memory, held to what a recording file is held to.
use super::names::Names;
use super::{Recording, Sample};
use crate::Error;
use crate::rig::{problem_of_distortion, problem_of_joint_name, problem_of_name};

impl Recording {
    /// The same recording with features in natural order and detections by camera, then feature, as if it had been read from a file.
    ///
    /// Errors: [`Error::Unusable`] for whatever a file could not say: names that are empty or twice, indices without a name, numbers that
    /// are not finite, samples of another number of joints.
    pub fn checked(self) -> Result<Recording, Error> {
        if let Some(problem) = self.problem_of_header() {
            return Err(Error::Unusable(problem));
        }
        for (index, sample) in self.samples.iter().enumerate() {
            if let Some(problem) = self.problem_of_sample(sample) {
                return Err(Error::Unusable(format!("sample {index}: {problem}")));
            }
        }
        if self.samples.is_empty() {
            return Err(Error::Unusable("a recording has at least one sample".to_owned()));
        }
        let mut names = Names::default();
        self.features.iter().for_each(|name| _ = names.intern(name));
        let (features, places) = names.in_natural_order();
        let mut samples = self.samples;
        samples.iter_mut().for_each(|sample| sample.renumber(&places));
        if let Some(last) = samples.last_mut() {
            (last.joint_action, last.pose_action) = (None, None);
        }
        Ok(Recording { features, samples, ..self })
    }

    /// The same of a recording that was read from a file, which messages name.
    pub(super) fn checked_as(self, file: &str) -> Result<Recording, Error> {
        self.checked().map_err(|error| Error::Unusable(format!("{file}: {error}")))
    }

    fn problem_of_header(&self) -> Option<String> {
        let cameras: Vec<&str> = self.cameras.iter().map(|camera| camera.name.as_str()).collect();
        problem_of_names("joints", self.joints.iter().map(String::as_str), problem_of_joint_name)
            .or_else(|| problem_of_names("cameras", cameras.iter().copied(), problem_of_name))
            .or_else(|| problem_of_names("features", self.features.iter().map(String::as_str), problem_of_name))
            .or_else(|| {
                self.cameras.iter().find_map(|camera| {
                    let named = |problem: String| Some(format!("camera `{}`: {problem}", camera.name));
                    if camera.size.is_some_and(|size| size.contains(&0)) {
                        return named("an image is at least 1 px wide and high".to_owned());
                    }
                    let focal =
                        [camera.fx, camera.fy].into_iter().flatten().find(|focal| focal.is_nan() || *focal <= 0.0);
                    if let Some(focal) = focal {
                        return named(format!("a focal length is above 0 px, found {focal}"));
                    }
                    let distortion = camera.distortion.as_deref().unwrap_or_default();
                    let mut numbers = [camera.fx, camera.fy, camera.cx, camera.cy].into_iter().flatten();
                    if !numbers.all(f64::is_finite) || !distortion.iter().all(|number| number.is_finite()) {
                        return named("a number is not finite".to_owned());
                    }
                    problem_of_distortion(camera.model, distortion.len()).and_then(named)
                })
            })
    }

    fn problem_of_sample(&self, sample: &Sample) -> Option<String> {
        let n = self.joints.len();
        for (what, list) in [("joints", &sample.joints), ("joint_action", &sample.joint_action)] {
            let Some(list) = list else { continue };
            if list.len() != n {
                return Some(format!("`{what}` has {} numbers, and there are {n} joints", list.len()));
            }
        }
        let lists = [&sample.joints, &sample.joint_action].into_iter().flatten().flatten();
        let poses =
            [&sample.pose, &sample.pose_action].into_iter().flatten().chain(sample.targets.iter().map(|one| &one.pose));
        let of_poses = poses.flat_map(|pose| pose.rotation.iter().chain(&pose.translation));
        let detections = sample.pixels.iter().flat_map(|seen| &seen.pixel);
        let points = sample.points.iter().flat_map(|seen| &seen.point);
        let mut numbers = sample.time.iter().chain(lists).chain(of_poses).chain(detections).chain(points);
        if let Some(number) = numbers.find(|number| !number.is_finite()) {
            return Some(format!("found {number}; what was not measured is left out"));
        }
        let cameras = sample.pixels.iter().map(|seen| seen.camera);
        let mut cameras = cameras
            .chain(sample.points.iter().map(|seen| seen.camera))
            .chain(sample.targets.iter().map(|seen| seen.camera));
        if let Some(camera) = cameras.find(|camera| *camera as usize >= self.cameras.len()) {
            return Some(format!("camera {camera} of {}", self.cameras.len()));
        }
        let pixels: Vec<(u32, u32)> = sample.pixels.iter().map(|seen| (seen.camera, seen.feature)).collect();
        let points = sample.points.iter().map(|seen| (seen.camera, seen.feature)).collect();
        for mut pairs in [pixels, points] {
            if let Some((_, feature)) = pairs.iter().find(|(_, feature)| *feature as usize >= self.features.len()) {
                return Some(format!("feature {feature} of {}", self.features.len()));
            }
            pairs.sort_unstable();
            if let Some(pair) = pairs.windows(2).find(|pair| pair[0] == pair[1]) {
                let (camera, feature) = pair[0];
                let [camera, feature] = [&self.cameras[camera as usize].name, &self.features[feature as usize]];
                return Some(format!("camera `{camera}` has feature `{feature}` twice"));
            }
        }
        let mut targets: Vec<_> = sample.targets.iter().map(|seen| (seen.camera, seen.target.as_str())).collect();
        if let Some(problem) = targets.iter().find_map(|(_, target)| problem_of_name(target)) {
            return Some(problem);
        }
        targets.sort_unstable();
        if let Some(pair) = targets.windows(2).find(|pair| pair[0] == pair[1]) {
            let (camera, target) = pair[0];
            return Some(format!("camera `{}` has target `{target}` twice", self.cameras[camera as usize].name));
        }
        None
    }
}

fn problem_of_names<'a>(
    what: &str,
    names: impl Iterator<Item = &'a str>,
    problem: fn(&str) -> Option<String>,
) -> Option<String> {
    let mut names: Vec<&str> = names.collect();
    if let Some(problem) = names.iter().find_map(|name| problem(name)) {
        return Some(problem);
    }
    names.sort_unstable();
    let twice = names.windows(2).find(|pair| pair[0] == pair[1])?;
    Some(format!("two {what} are called `{}`", twice[0]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Detection, RecordedCamera, TargetDetection};
    use handeye_solvers::Pose;

    fn recording() -> Recording {
        let detection = |feature| Detection { camera: 0, feature, pixel: [f64::from(feature), 1.0] };
        let pixels = vec![detection(0), detection(1), detection(2)];
        let sample = Sample { joints: Some(vec![0.5]), joint_action: Some(vec![0.1]), pixels, ..Sample::default() };
        Recording {
            joints: vec!["j1".into()],
            cameras: vec![RecordedCamera { name: "left".into(), ..RecordedCamera::default() }],
            features: ["f10", "f2", "f1"].map(String::from).to_vec(),
            samples: vec![sample.clone(), sample],
        }
    }

    #[test]
    fn it_is_what_would_have_been_read_back() {
        let checked = recording().checked().unwrap();
        let mut text = Vec::new();
        checked.write_to(&mut text).unwrap();
        assert_eq!(Recording::read_from(&text[..], "text").unwrap(), checked);
        assert_eq!(checked.features, ["f1", "f2", "f10"]);
        assert_eq!(checked.samples[0].pixels[0].pixel, [2.0, 1.0], "f1 was the third");
        assert_eq!(checked.samples[1].joint_action, None, "it leads to no sample");
    }

    #[test]
    fn what_a_file_could_not_say_is_refused() {
        type Fault = fn(&mut Recording);
        let faults: [(Fault, &str); 9] = [
            (
                |it| it.samples[1].joints = Some(vec![0.0; 2]),
                "sample 1: `joints` has 2 numbers, and there are 1 joints",
            ),
            (|it| it.samples[0].time = Some(f64::NAN), "sample 0: found NaN; what was not measured is left out"),
            (|it| it.samples[1].pixels[0].feature = 3, "sample 1: feature 3 of 3"),
            (|it| it.samples[1].pixels[0].camera = 1, "sample 1: camera 1 of 1"),
            (|it| it.samples[0].pixels[0].feature = 1, "sample 0: camera `left` has feature `f2` twice"),
            (
                |it| {
                    let seen =
                        TargetDetection { camera: 0, target: "tag".into(), pose: Pose::identity(), covariance: None };
                    it.samples[1].targets = vec![seen.clone(), seen];
                },
                "sample 1: camera `left` has target `tag` twice",
            ),
            (|it| it.features[0] = "f1".into(), "two features are called `f1`"),
            (|it| it.joints[0] = "tip".into(), "a joint cannot be called `tip`, which is the parent of that name"),
            (|it| it.samples.clear(), "a recording has at least one sample"),
        ];
        for (fault, message) in faults {
            let mut wrong = recording();
            fault(&mut wrong);
            assert_eq!(wrong.checked().unwrap_err().to_string(), message);
        }
    }
}
