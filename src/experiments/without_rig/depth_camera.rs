//! A depth camera: points of the hand are brought onto points of a target in space.
use super::scenes::{UR5_POINTS, UR5_TARGET, against_command, ends, go, near, pairs, scene};
use crate::Error;
use crate::experiments::setting::trials;
use crate::experiments::{Experiment, Options, Outcome};
use crate::rig::{Rig, catalog};
use crate::scene::Run;
use crate::servo::image_tasks::{ImageTask, Kind, Part, PointToPoint3d, Trackers};

pub(in crate::experiments) const DEPTH_CAMERA: Experiment = Experiment {
    name: "depth-camera",
    about: "points of the hand are brought onto points of a target without a rig, as one depth camera sees them",
    source: "Ramirez 2016, section 4.4.6, in words",
    trials: 20,
    is_timed: false,
    is_seeded: true,
    run,
};

/// Standard deviations of the camera's points [m], by series.
const NOISE: [(&str, f64); 4] = [("exact", 0.0), ("1 mm", 1e-3), ("3 mm", 3e-3), ("6 mm", 6e-3)];

/// How far the joints begin from where they shall be [rad].
const AWAY: f64 = 0.2;

/// The camera's focal length over its distance from the target [px/m]: errors in pixels are as in its image.
const PX_PER_METRE: f64 = 400.0;

/// Commands that are shown, and every how many.
const SHOWN: (usize, usize) = (50, 5);

fn run(options: &Options) -> Result<Outcome, Error> {
    let results = trials(options, trial)?;
    let (mut rows, mut notes) = (Vec::new(), Vec::new());
    for (index, (series, noise)) in NOISE.iter().enumerate() {
        let runs: Vec<Run> = results.iter().map(|runs| runs[index].clone()).collect();
        rows.extend(against_command("error of the rows [px]", series, &runs, SHOWN, |moment| moment.error_px));
        rows.extend(against_command("3D error [mm]", series, &runs, SHOWN, |moment| Some(1e3 * moment.error_m)));
        let once = 1e3 * noise * (2.0 * 6.0 / UR5_POINTS.len() as f64 / 3.0).sqrt();
        notes.push(format!("{series}: {}; one look at all points alone leaves some {once:.1} mm", ends(&runs)));
    }
    notes.push(
        "published in words: common systems calibrate the sensor against the robot, which is not required here"
            .to_owned(),
    );
    Ok(Outcome {
        setting: format!(
            "UR5, {} points of the hand and as many of the target, one depth camera, noise of its points along each axis; our defaults; a trial \
             is a start",
            UR5_POINTS.len()
        ),
        measure: "root mean square of the rows [px], mean distance of the hand's points from the target's [mm]",
        abscissa: Some("commands, those of exploring included"),
        rows,
        notes,
    })
}

fn trial(seed: u64) -> Result<Vec<Run>, Error> {
    let mut rig: Rig = catalog::rig("ur5")?;
    rig.cameras.truncate(1);
    rig.cameras[0].depth = true;
    let name = rig.cameras[0].name.clone();
    let (features, pairs) = pairs(&UR5_POINTS);
    let part = |[point, to]: [usize; 2]| Part {
        kind: Kind::PointToPoint3d(PointToPoint3d { point, to, px_per_metre: PX_PER_METRE }),
        cameras: vec![0],
    };
    let parts: Vec<Part> = pairs.into_iter().map(part).collect();
    let start = near(&UR5_TARGET, AWAY, seed);
    let mut runs = Vec::new();
    for (_, points) in NOISE {
        let trackers = Trackers { points, ..Trackers::default() };
        let task = ImageTask::new(None, vec![name.clone()], features.clone(), parts.clone(), trackers)?;
        let mut scene = scene(rig.clone(), task, start.clone(), UR5_TARGET.to_vec(), seed);
        scene.world.points = points;
        scene.settings.tolerance_px = f64::max(0.1, 1.2 * 2.0_f64.sqrt() * PX_PER_METRE * points);
        scene.settings.window = 30;
        runs.push(go(&scene)?);
    }
    Ok(runs)
}
