//! Which camera an image is of, and what the bag says of it.
use super::images::{Images, Source};
use super::kinds::need;
use super::topics::{Topic, is_topic};
use super::value::Value;
use crate::Error;
use crate::camera::CameraModel;
use crate::intrinsics::model_of;
use crate::recording::names::tidy;
use crate::recording::{OpenOptions, RecordedCamera, px};
use std::collections::BTreeMap;
use std::path::Path;

/// A sensor_msgs/CameraInfo.
pub(super) struct Info {
    size: [u32; 2],
    /// Of the images as they come; `None` of a camera that was not calibrated. Errors, in words: why it is none.
    raw: Result<Option<Lens>, String>,
    /// Of rectified images.
    rectified: Option<Lens>,
}

/// Lens model, [fx, fy, cx, cy] and distortion.
type Lens = (CameraModel, [f64; 4], Vec<f64>);

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
        let &[fx, ..] = matrix else {
            return Err("has an empty camera matrix".to_owned());
        };
        let rectified = match message.numbers("p").or_else(|| message.numbers("P")) {
            Some(&[fx, _, cx, _, _, fy, cy, ..])
                if fx > 0.0 && fy > 0.0 && [fx, fy, cx, cy].iter().all(|n| n.is_finite()) =>
            {
                Some((CameraModel::Pinhole, [fx, fy, cx, cy], Vec::new()))
            }
            _ => None,
        };
        // A focal length of 0 is how ROS says that the camera is not calibrated.
        let raw = if fx == 0.0 { Ok(None) } else { lens(message, matrix, distortion).map(Some) };
        Ok(Info { size, raw, rectified })
    }

    /// Errors, in words: a lens that is none.
    fn camera(&self, name: String, is_rectified: bool) -> Result<RecordedCamera, String> {
        let size = self.size();
        let lens = if is_rectified { &self.rectified } else { self.raw.as_ref().map_err(String::clone)? };
        let Some((model, [fx, fy, cx, cy], distortion)) = lens else {
            return Ok(RecordedCamera { name, size, ..RecordedCamera::default() });
        };
        Ok(RecordedCamera {
            name,
            size,
            model: Some(*model),
            fx: Some(*fx),
            fy: Some(*fy),
            cx: Some(*cx),
            cy: Some(*cy),
            distortion: Some(distortion.clone()).filter(|coefficients| !coefficients.is_empty()),
        })
    }

    /// `None` where the driver does not say it.
    fn size(&self) -> Option<[u32; 2]> {
        (!self.size.contains(&0)).then_some(self.size)
    }
}

/// The lens of the images as they come.
fn lens(message: &Value, matrix: &[f64], distortion: &[f64]) -> Result<Lens, String> {
    let &[fx, skew, cx, _, fy, cy, ..] = matrix else {
        return Err(format!("has a camera matrix of {} numbers", matrix.len()));
    };
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
    Ok((model, [fx, fy, cx, cy], distortion))
}

/// The cameras in the order of their names, and for each source the index of its camera.
///
/// A camera is called as the options say, otherwise after the frame of its images, or after the namespace of its topic where the
/// frame is empty or that of images in several namespaces. Its lens is that of the CameraInfo in the same namespace and of the same frame, then
/// of the same namespace, then of the same frame; where the options say another, only its size is taken, unless the images show theirs.
///
/// Errors: [`Error::Unusable`] for a CameraInfo that cannot be read or is of another size than the images, and for images of one camera of
/// which some are rectified.
pub(super) fn cameras(
    path: &Path,
    images: &mut Images,
    options: &OpenOptions,
    notes: &mut Vec<String>,
) -> Result<(Vec<RecordedCamera>, Vec<u32>), Error> {
    let (sources, topics) = (&images.sources, &images.topics);
    let names: Vec<String> = sources.iter().map(|source| name(source, sources, topics, options)).collect();
    let mut sorted = names.clone();
    sorted.sort_by(|a, b| crate::recording::natural_order(a, b));
    sorted.dedup();
    let unusable = |problem: String| Error::Unusable(format!("{}: {problem}", path.display()));
    let mut cameras = Vec::new();
    for name in &sorted {
        let of_it: Vec<usize> = (0..sources.len()).filter(|source| names[*source] == *name).collect();
        let topic = |source: usize| &topics[sources[source].0];
        let first = of_it[0];
        let is_rectified = topic(first).is_rectified();
        if let Some(&other) = of_it.iter().find(|source| topic(**source).is_rectified() != is_rectified) {
            let [one, other] = [first, other].map(|source| topic(source).name.as_str());
            return Err(unusable(format!(
                "{one} and {other} are both of camera `{name}`, and only one is of rectified images: --camera-topic names one of them"
            )));
        }
        let seen = of_it.iter().find_map(|source| Some((*source, *images.sizes.get(source)?)));
        let unknown =
            RecordedCamera { name: name.clone(), size: seen.map(|(_, size)| size), ..RecordedCamera::default() };
        let is_known = options.cameras.iter().any(|camera| camera.name == *name && camera.has_lens());
        let Some(key) = info_of(&of_it, sources, topics, &images.infos) else {
            cameras.push(unknown);
            continue;
        };
        let info_topic = &topics[key.0].name;
        if is_known {
            let said = images.infos[&key].as_ref().ok().and_then(Info::size);
            if let (Some(said), Some(seen)) = (said, unknown.size)
                && said != seen
            {
                let (said, seen) = (px(said), px(seen));
                notes.push(format!("{info_topic} is of {said}, and images of camera `{name}` are of {seen}, as its given lens has to be"));
            }
            cameras.push(RecordedCamera { size: unknown.size.or(said), ..unknown });
            continue;
        }
        let camera = match &images.infos[&key] {
            Ok(info) => info.camera(name.clone(), is_rectified).map_err(|why| {
                unusable(format!("{info_topic} {why}; --camera {name}=FILE gives the intrinsics of these images"))
            })?,
            Err(_) => match images.infos.remove(&key) {
                Some(Err(error)) => return Err(error),
                _ => unknown.clone(),
            },
        };
        if let (Some((source, seen)), Some(said)) = (seen, camera.size)
            && seen != said
        {
            let [images, info] = [sources[source].0, key.0].map(|channel| topics[channel].name.as_str());
            return Err(unusable(format!(
                "{images}: images are of {}, and {info} is of {}; --camera {name}=FILE gives the intrinsics of these images",
                px(seen),
                px(said)
            )));
        }
        cameras.push(camera.over(&unknown));
    }
    let index = |name: &String| sorted.iter().position(|known| known == name).unwrap_or(0) as u32;
    Ok((cameras, names.iter().map(index).collect()))
}

/// What the camera of a source is called.
fn name(source: &Source, sources: &[Source], topics: &[Topic], options: &OpenOptions) -> String {
    let space = |source: &Source| topics[source.0].namespace();
    let given = options.bag.camera_topics.iter().find(|(topic, _)| is_topic(&topics[source.0].name, topic));
    if let Some((_, Some(name))) = given {
        return tidy(name);
    }
    let is_shared = sources.iter().any(|other| other.1 == source.1 && space(other) != space(source));
    let is_frame = !source.1.is_empty() && !is_shared;
    tidy(if is_frame || space(source).is_empty() { &source.1 } else { space(source) })
}

/// The CameraInfo that is of a camera's sources.
fn info_of<T>(of_it: &[usize], sources: &[Source], topics: &[Topic], infos: &BTreeMap<Source, T>) -> Option<Source> {
    let is_frame = |info: &Source, source: &Source| info.1 == source.1 && !info.1.is_empty();
    let is_space = |info: &Source, source: &Source| topics[info.0].namespace() == topics[source.0].namespace();
    let find = |fits: &dyn Fn(&Source, &Source) -> bool| {
        of_it.iter().find_map(|source| infos.keys().find(|info| fits(info, &sources[*source]))).cloned()
    };
    find(&|info, source| is_frame(info, source) && is_space(info, source))
        .or_else(|| find(&is_space))
        .or_else(|| find(&is_frame))
}
