//! What is known of a recording's cameras beside it.
use super::{RecordedCamera, Recording};
use crate::Error;
use crate::error::suggestion;
use crate::intrinsics::read_intrinsics;
use std::path::Path;

impl Recording {
    /// Adds what is known of its cameras, by their names. A lens replaces the one that the recording has; where only a size is known, that stays.
    ///
    /// Errors, in words: a camera that the recording does not have, and another size than that of its images.
    pub fn describe_cameras(&mut self, known: &[RecordedCamera]) -> Result<(), String> {
        self.need_cameras(known)?;
        self.describe_those_there(known)
    }

    /// Errors, in words: a camera that the recording does not have.
    pub(super) fn need_cameras(&self, known: &[RecordedCamera]) -> Result<(), String> {
        let there = || self.cameras.iter().map(|camera| camera.name.as_str());
        match known.iter().find(|known| !there().any(|name| name == known.name)) {
            None => Ok(()),
            Some(RecordedCamera { name, .. }) => {
                Err(format!("there are no images of a camera `{name}` {}", suggestion(name, there())))
            }
        }
    }

    /// Adds what is known of cameras that the recording has.
    pub(super) fn describe_those_there(&mut self, known: &[RecordedCamera]) -> Result<(), String> {
        for known in known {
            let name = &known.name;
            let Some(camera) = self.cameras.iter_mut().find(|camera| camera.name == *name) else { continue };
            if let (Some(said), Some(found)) = (known.size, camera.size)
                && said != found
            {
                return Err(format!(
                    "camera `{name}` is said to be of {}, and its images are of {}",
                    px(said),
                    px(found)
                ));
            }
            *camera = known.over(camera);
        }
        Ok(())
    }
}

impl RecordedCamera {
    /// A camera whose lens and size a calibration file says (YAML of ROS, OpenCV or Kalibr).
    ///
    /// Errors: [`Error::Io`], and those of [`read_intrinsics`].
    pub fn read(name: &str, path: &Path) -> Result<RecordedCamera, Error> {
        let text = std::fs::read_to_string(path).map_err(|source| Error::Io { path: path.to_owned(), source })?;
        let read = read_intrinsics(&text, &path.display().to_string(), None)?;
        Ok(RecordedCamera {
            name: name.to_owned(),
            size: read.size,
            model: Some(read.model),
            fx: Some(read.focal[0]),
            fy: Some(read.focal[1]),
            cx: Some(read.centre[0]),
            cy: Some(read.centre[1]),
            distortion: Some(read.distortion).filter(|coefficients| !coefficients.is_empty()),
        })
    }

    /// What is known here, and of the rest what `other` says. A lens is taken whole: parts of two would be none.
    pub(super) fn over(&self, other: &RecordedCamera) -> RecordedCamera {
        let lens = if self.has_lens() { self } else { other };
        RecordedCamera { name: self.name.clone(), size: self.size.or(other.size), ..lens.clone() }
    }

    pub(super) fn has_lens(&self) -> bool {
        let numbers = [self.fx, self.fy, self.cx, self.cy];
        self.model.is_some() || self.distortion.is_some() || numbers.iter().any(Option::is_some)
    }
}

/// A size in words.
pub(crate) fn px([width, height]: [u32; 2]) -> String {
    format!("{width} x {height} px")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraModel;

    #[test]
    fn a_size_leaves_the_lens_and_a_lens_is_taken_whole() {
        let bent = RecordedCamera {
            name: "left".into(),
            size: Some([640, 480]),
            model: Some(CameraModel::BrownConrady),
            fx: Some(600.0),
            distortion: Some(vec![0.1]),
            ..RecordedCamera::default()
        };
        let mut recording = Recording { cameras: vec![bent.clone()], ..Recording::default() };
        let of_size = |size| RecordedCamera { name: "left".into(), size: Some(size), ..RecordedCamera::default() };
        recording.describe_cameras(&[of_size([640, 480])]).unwrap();
        assert_eq!(recording.cameras[0], bent);
        let straight = RecordedCamera { fx: Some(500.0), model: Some(CameraModel::Pinhole), ..of_size([640, 480]) };
        let straight = RecordedCamera { size: None, ..straight };
        recording.describe_cameras(std::slice::from_ref(&straight)).unwrap();
        assert_eq!(recording.cameras, [RecordedCamera { size: bent.size, ..straight }]);
        let error = recording.describe_cameras(&[of_size([320, 240])]).unwrap_err();
        assert_eq!(error, "camera `left` is said to be of 320 x 240 px, and its images are of 640 x 480 px");
        let error = recording.describe_cameras(&[RecordedCamera { name: "lift".into(), ..bent }]).unwrap_err();
        assert_eq!(error, "there are no images of a camera `lift` (did you mean `left`?)");
    }
}
