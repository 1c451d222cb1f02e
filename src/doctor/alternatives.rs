//! How else the data may have come about: each a rig and a recording with one mistake undone.
use crate::chain::JointKind;
use crate::recording::Recording;
use crate::rig::Rig;

/// The data with one mistake undone.
pub(super) struct Alternative {
    pub name: &'static str,
    pub change: &'static str,
    pub rig: Rig,
    pub recording: Recording,
}

/// The alternatives that apply.
pub(super) fn all(rig: &Rig, recording: &Recording) -> Vec<Alternative> {
    let as_recorded = |name, change| Alternative { name, change, rig: rig.clone(), recording: recording.clone() };
    let is_revolute = |joint: usize| rig.robot.joints.get(joint).is_none_or(|joint| joint.kind == JointKind::Revolute);
    let mut all = Vec::new();

    let mut degrees = as_recorded("joints are in degrees", "divide the readings of revolute joints by 57.2958");
    for joints in degrees.recording.samples.iter_mut().filter_map(|sample| sample.joints.as_mut()) {
        joints.iter_mut().enumerate().filter(|(i, _)| is_revolute(*i)).for_each(|(_, j)| *j = j.to_radians());
    }
    all.push(degrees);

    for (shift, name, change) in [
        (1, "joints are one sample late", "pair each image with the joints of the next sample"),
        (-1, "joints are one sample early", "pair each image with the joints of the sample before"),
    ] {
        let mut shifted = as_recorded(name, change);
        let samples = &recording.samples;
        shifted.recording.samples = (0..samples.len())
            .filter_map(|i| {
                let read = samples.get(i.checked_add_signed(shift)?)?;
                Some(crate::recording::Sample { joints: read.joints.clone(), ..samples[i].clone() })
            })
            .collect();
        all.push(shifted);
    }

    let mut axes = as_recorded("u and v are swapped", "write pixels as [u, v]: u to the right, v down");
    axes.recording.samples.iter_mut().flat_map(|sample| &mut sample.pixels).for_each(|seen| seen.pixel.reverse());
    all.push(axes);

    let mut centre = as_recorded("principal points have their coordinates swapped", "exchange cx and cy");
    for camera in &mut centre.rig.cameras {
        std::mem::swap(&mut camera.cx, &mut camera.cy);
    }
    for camera in &mut centre.recording.cameras {
        std::mem::swap(&mut camera.cx, &mut camera.cy);
    }
    if centre.rig != *rig || centre.recording != *recording {
        all.push(centre);
    }
    all
}
