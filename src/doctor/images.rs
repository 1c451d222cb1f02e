//! Mistakes of image coordinates: u and v, or cx and cy, exchanged.
use crate::recording::Recording;
use crate::rig::Rig;

/// Detections outside the image from which on a size says something.
const OUTSIDE: usize = 5;

/// What sizes of images say of the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Axes {
    /// Coordinates are outside the images, and inside with u and v exchanged.
    Swapped,
    /// Exchanged, they would be outside.
    Right,
    /// Sizes do not tell.
    Open,
}

/// Width and height of a camera's images [px].
fn size(rig: &Rig, recording: &Recording, camera: usize) -> Option<[f64; 2]> {
    let recorded = &recording.cameras[camera];
    let known = rig.cameras.iter().find(|known| known.name == recorded.name);
    known.and_then(|known| known.size).or(recorded.size).map(|size| size.map(f64::from))
}

pub(super) fn axes(rig: &Rig, recording: &Recording) -> Axes {
    let (mut as_is, mut exchanged) = (0, 0);
    for seen in recording.samples.iter().flat_map(|sample| &sample.pixels) {
        if let Some([width, height]) = size(rig, recording, seen.camera as usize) {
            let is_outside = |u: f64, v: f64| u > width || v > height;
            as_is += usize::from(is_outside(seen.pixel[0], seen.pixel[1]));
            exchanged += usize::from(is_outside(seen.pixel[1], seen.pixel[0]));
        }
    }
    match () {
        () if as_is >= OUTSIDE && as_is > 4 * exchanged => Axes::Swapped,
        () if exchanged >= OUTSIDE && exchanged > 4 * as_is => Axes::Right,
        () => Axes::Open,
    }
}

/// The recording with u and v exchanged.
pub(super) fn exchanged_axes(recording: &Recording) -> Recording {
    let mut exchanged = recording.clone();
    exchanged.samples.iter_mut().flat_map(|sample| &mut sample.pixels).for_each(|seen| seen.pixel.reverse());
    exchanged
}

/// Cameras whose principal point is nearer to the middle of the image with its coordinates exchanged, or whose size is unknown.
pub(super) fn suspects(rig: &Rig, recording: &Recording) -> Vec<String> {
    let is_suspect = |index: &usize| {
        let recorded = &recording.cameras[*index];
        let known = rig.cameras.iter().find(|known| known.name == recorded.name);
        let cx = known.and_then(|known| known.cx).or(recorded.cx);
        let cy = known.and_then(|known| known.cy).or(recorded.cy);
        let (Some(cx), Some(cy)) = (cx, cy) else { return false };
        let Some([width, height]) = size(rig, recording, *index) else { return cx != cy };
        let off = |u: f64, v: f64| (u - 0.5 * width).hypot(v - 0.5 * height);
        off(cy, cx) < off(cx, cy)
    };
    (0..recording.cameras.len()).filter(is_suspect).map(|index| recording.cameras[index].name.clone()).collect()
}

/// Rig and recording with the principal points of these cameras exchanged.
pub(super) fn exchanged_centres(rig: &Rig, recording: &Recording, names: &[String]) -> (Rig, Recording) {
    let (mut rig, mut recording) = (rig.clone(), recording.clone());
    for camera in rig.cameras.iter_mut().filter(|camera| names.contains(&camera.name)) {
        std::mem::swap(&mut camera.cx, &mut camera.cy);
    }
    for camera in recording.cameras.iter_mut().filter(|camera| names.contains(&camera.name)) {
        std::mem::swap(&mut camera.cx, &mut camera.cy);
    }
    (rig, recording)
}

/// The rig with all intrinsics held that somebody gives, so that they cannot adapt to a mistake.
pub(super) fn held(rig: &Rig, recording: &Recording) -> Rig {
    let mut held = rig.clone();
    for recorded in &recording.cameras {
        let known = rig.cameras.iter().find(|known| known.name == recorded.name);
        let given = |of_rig: Option<f64>, of_header: Option<f64>| of_rig.or(of_header).is_some();
        let named = |f: fn(&crate::rig::Camera) -> Option<f64>| known.and_then(f);
        if !given(named(|c| c.cx), recorded.cx) || !given(named(|c| c.cy), recorded.cy) {
            continue;
        }
        // A held parameter needs its value in the rig.
        if known.is_none() {
            held.cameras.push(crate::rig::Camera { name: recorded.name.clone(), ..Default::default() });
        }
        for camera in held.cameras.iter_mut().filter(|camera| camera.name == recorded.name) {
            (camera.fx, camera.fy) = (camera.fx.or(recorded.fx), camera.fy.or(recorded.fy));
            (camera.cx, camera.cy) = (camera.cx.or(recorded.cx), camera.cy.or(recorded.cy));
            camera.size = camera.size.or(recorded.size);
            let keys = [("fx", camera.fx), ("fy", camera.fy), ("cx", camera.cx), ("cy", camera.cy)];
            for (key, _) in keys.into_iter().filter(|(_, value)| value.is_some()) {
                held.estimate.fixed.push(format!("cameras.{}.{key}", camera.name));
            }
        }
    }
    held
}
