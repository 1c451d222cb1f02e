//! Which camera an image is of, and what the bag says of it.
use super::BagOptions;
use super::images::{Source, tidy};
use super::kinds::need;
use super::topics::{Topic, is_topic};
use super::value::Value;
use crate::camera::CameraModel;
use crate::intrinsics::model_of;
use crate::recording::RecordedCamera;
use std::collections::BTreeMap;

/// A sensor_msgs/CameraInfo.
pub(super) struct Info {
    size: [u32; 2],
    /// Lens model, [fx, fy, cx, cy] and distortion; `None` of a camera that was not calibrated.
    intrinsics: Option<(CameraModel, [f64; 4], Vec<f64>)>,
}

impl Info {
    pub(super) fn read(message: &Value) -> Result<Info, String> {
        let parts = ["binning_x", "binning_y"].map(|name| message.number(name).is_some_and(|binning| binning > 1.0));
        let cut = ["roi.x_offset", "roi.y_offset"].map(|name| message.number(name).is_some_and(|offset| offset > 0.0));
        if parts.contains(&true) || cut.contains(&true) {
            return Err(
                "is of images that are binned or cut out, and its camera matrix is that of whole ones".to_owned()
            );
        }
        let side = |name: &str| need(message.number(name).map(|side| side as u32), name);
        let size = [side("width")?, side("height")?];
        let matrix = need(message.numbers("k").or_else(|| message.numbers("K")), "k")?;
        let distortion = need(message.numbers("d").or_else(|| message.numbers("D")), "d")?;
        let &[fx, skew, cx, _, fy, cy, ..] = matrix else {
            return Err(format!("has a camera matrix of {} numbers", matrix.len()));
        };
        if fx == 0.0 {
            // As ROS says that the camera is not calibrated.
            return Ok(Info { size, intrinsics: None });
        }
        if skew != 0.0 || !(fx > 0.0 && fy > 0.0) || [fx, fy, cx, cy].iter().chain(distortion).any(|n| !n.is_finite()) {
            return Err(format!("has a camera matrix that is none: {matrix:?}"));
        }
        let name = message.text("distortion_model").unwrap_or_default();
        let model = if distortion.is_empty() { Some(CameraModel::Pinhole) } else { model_of(name) };
        let model = model.ok_or_else(|| format!("has an unknown distortion model `{name}`"))?;
        let most = model.distortion().len();
        if distortion.iter().skip(most).any(|value| *value != 0.0) {
            return Err(format!("has {} distortion coefficients, and `{name}` has {most}", distortion.len()));
        }
        let distortion = distortion.iter().take(most).copied().collect();
        Ok(Info { size, intrinsics: Some((model, [fx, fy, cx, cy], distortion)) })
    }

    fn camera(&self, name: String) -> RecordedCamera {
        let size = (!self.size.contains(&0)).then_some(self.size);
        let Some((model, [fx, fy, cx, cy], distortion)) = &self.intrinsics else {
            return RecordedCamera { name, size, ..RecordedCamera::default() };
        };
        RecordedCamera {
            name,
            size,
            model: Some(*model),
            fx: Some(*fx),
            fy: Some(*fy),
            cx: Some(*cx),
            cy: Some(*cy),
            distortion: Some(distortion.clone()).filter(|coefficients| !coefficients.is_empty()),
        }
    }
}

/// The cameras in the order of their names, and for each source the index of its camera.
///
/// A camera is called as the options say, otherwise after the frame of its images, or after the namespace of its topic where the
/// frame is empty or that of images in several namespaces.
pub(super) fn cameras(
    sources: &[Source],
    infos: &BTreeMap<Source, Info>,
    topics: &[Topic],
    options: &BagOptions,
) -> (Vec<RecordedCamera>, Vec<u32>) {
    let space = |source: &Source| topics[source.0].namespace();
    let name = |source: &Source| {
        let given = options.camera_topics.iter().find(|(topic, _)| is_topic(&topics[source.0].name, topic));
        if let Some((_, Some(name))) = given {
            return tidy(name);
        }
        let is_shared = sources.iter().any(|other| other.1 == source.1 && space(other) != space(source));
        let is_frame = !source.1.is_empty() && !is_shared;
        tidy(if is_frame || space(source).is_empty() { &source.1 } else { space(source) })
    };
    let names: Vec<String> = sources.iter().map(name).collect();
    let mut sorted = names.clone();
    sorted.sort_by(|a, b| crate::recording::natural_order(a, b));
    sorted.dedup();
    let camera = |name: &String| {
        let of_it = || sources.iter().zip(&names).filter(move |(_, known)| *known == name).map(|(source, _)| source);
        let find = |fits: &dyn Fn(&Source, &Source) -> bool| {
            of_it().find_map(|source| infos.iter().find(|(info, _)| fits(info, source)).map(|(_, info)| info))
        };
        let is_frame = |info: &Source, source: &Source| info.1 == source.1 && !info.1.is_empty();
        let is_space = |info: &Source, source: &Source| space(info) == space(source);
        let info = find(&|info, source| is_frame(info, source) && is_space(info, source))
            .or_else(|| find(&is_space))
            .or_else(|| find(&is_frame));
        info.map_or_else(
            || RecordedCamera { name: name.clone(), ..RecordedCamera::default() },
            |info| info.camera(name.clone()),
        )
    };
    let cameras = sorted.iter().map(camera).collect();
    let index = |name: &String| sorted.iter().position(|known| known == name).unwrap_or(0) as u32;
    (cameras, names.iter().map(index).collect())
}
