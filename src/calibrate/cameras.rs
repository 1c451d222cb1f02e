//! What rig and recording together say of every camera: which take part, and what is known of their lenses.
use crate::Error;
use crate::recording::{RecordedCamera, Recording, Sample};
use crate::rig::{Camera, Rig};

/// Which intrinsics somebody gave, in the rig or in the recording's header.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct KnownIntrinsics {
    pub focal: bool,
    pub centre: bool,
    pub distortion: bool,
    /// True for a camera that gave points alone: its lens, where it has one, stays as it is.
    pub unused: bool,
}

/// Focal length [longer side of the image] where nobody gives one.
const FOCAL_GUESS: f64 = 1.2;

/// Fills in what a recording's header says of a camera beside the rig.
fn fill_from_header(camera: &mut Camera, header: &RecordedCamera) {
    camera.size = camera.size.or(header.size);
    camera.model = camera.model.or(header.model);
    camera.fx = camera.fx.or(header.fx);
    camera.fy = camera.fy.or(header.fy);
    camera.cx = camera.cx.or(header.cx);
    camera.cy = camera.cy.or(header.cy);
    if camera.distortion.is_none() && (camera.model == header.model || header.model.is_none()) {
        camera.distortion.clone_from(&header.distortion);
    }
}

/// What learning starts from: a rig, and of its cameras what a recording's header says besides.
pub(crate) fn with_headers(rig: &Rig, recording: &Recording) -> Rig {
    let mut rig = rig.clone();
    for recorded in &recording.cameras {
        if rig.cameras.iter().all(|camera| camera.name != recorded.name) {
            rig.cameras.push(Camera { name: recorded.name.clone(), ..Camera::default() });
        }
        let is_it = |camera: &&mut Camera| camera.name == recorded.name;
        rig.cameras.iter_mut().filter(is_it).for_each(|camera| fill_from_header(camera, recorded));
    }
    rig
}

/// Fills in what the header says, and guesses the rest; nothing of a lens that nobody speaks of and nothing was seen through.
pub(super) fn complete_camera(
    camera: &mut Camera,
    recorded: Option<&RecordedCamera>,
    recording: &Recording,
) -> Result<KnownIntrinsics, Error> {
    if let Some(header) = recorded {
        fill_from_header(camera, header);
    }
    let (gives_pixels, gives_points) = gives(camera, recording);
    camera.depth |= gives_points;
    if camera.gives_points_alone() && !gives_pixels {
        return Ok(KnownIntrinsics { unused: true, ..KnownIntrinsics::default() });
    }
    let known = KnownIntrinsics {
        unused: gives_points && !gives_pixels,
        focal: camera.fx.is_some() && camera.fy.is_some(),
        centre: camera.cx.is_some() && camera.cy.is_some(),
        distortion: camera.distortion.is_some(),
    };
    let model = camera.model.unwrap_or_default();
    camera.model = Some(model);
    let coefficients = camera.distortion.get_or_insert_default();
    if coefficients.len() > model.distortion().len() {
        return Err(Error::Unusable(format!(
            "camera `{}` has {} distortion coefficients, its model `{}` takes {}",
            camera.name,
            coefficients.len(),
            model.name(),
            model.distortion().len()
        )));
    }
    coefficients.resize(model.distortion().len(), 0.0);
    let [width, height] = match camera.size {
        Some(size) => size.map(f64::from),
        None if known.focal && known.centre => [2.0 * camera.cx.unwrap_or(0.0), 2.0 * camera.cy.unwrap_or(0.0)],
        None => seen_size(camera, recording).ok_or_else(|| {
            Error::Unusable(format!("camera `{}` has neither a size nor intrinsics nor detections", camera.name))
        })?,
    };
    let focal = FOCAL_GUESS * width.max(height);
    camera.fx = Some(camera.fx.or(camera.fy).unwrap_or(focal));
    camera.fy = Some(camera.fy.or(camera.fx).unwrap_or(focal));
    camera.cx = Some(camera.cx.unwrap_or(0.5 * (width - 1.0)));
    camera.cy = Some(camera.cy.unwrap_or(0.5 * (height - 1.0)));
    Ok(known)
}

/// Takes out cameras that nothing could place, and returns their names.
pub(super) fn leave_out_unseen_cameras(rig: &mut Rig, recording: &Recording) -> Vec<String> {
    let (unseen, seen): (Vec<Camera>, Vec<Camera>) = std::mem::take(&mut rig.cameras)
        .into_iter()
        .partition(|camera| camera.pose.is_none() && gives(camera, recording) == (false, false));
    rig.cameras = seen;
    unseen.into_iter().map(|camera| camera.name).collect()
}

/// Whether a recording has pixels, and points, of a camera.
fn gives(camera: &Camera, recording: &Recording) -> (bool, bool) {
    let Some(index) = recording.cameras.iter().position(|recorded| recorded.name == camera.name) else {
        return (false, false);
    };
    let index = index as u32;
    let any = |is_of: &dyn Fn(&Sample) -> bool| recording.samples.iter().any(is_of);
    (
        any(&|sample| sample.pixels.iter().any(|seen| seen.camera == index)),
        any(&|sample| sample.points.iter().any(|seen| seen.camera == index)),
    )
}

/// Size of the smallest image that holds all detections, where nobody gives one.
fn seen_size(camera: &Camera, recording: &Recording) -> Option<[f64; 2]> {
    let index = recording.cameras.iter().position(|recorded| recorded.name == camera.name)? as u32;
    let seen = recording.samples.iter().flat_map(|sample| &sample.pixels).filter(|seen| seen.camera == index);
    seen.map(|seen| seen.pixel)
        .reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])])
        .map(|most| most.map(|x| x.max(1.0) + 1.0))
}
