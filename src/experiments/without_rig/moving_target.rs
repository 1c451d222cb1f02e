//! A target that somebody's hand moves along a recorded path, and an arm that follows it.
use super::scenes::{UR5_POINTS, UR5_TARGET, against_command, endless, ends, go, meeting, near, scene};
use crate::Error;
use crate::experiments::setting::trials;
use crate::experiments::{Experiment, Options, Outcome, Row};
use crate::rig::catalog;
use crate::scene::{Run, Waypoint};
use crate::servo::image_tasks::Trackers;
use crate::servo::uncalibrated::Settings;
use crate::simulate::world::Tracker;
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};

pub(in crate::experiments) const MOVING_TARGET: Experiment = Experiment {
    name: "moving-target",
    about: "a target that a hand moves along a recorded path is followed without a rig, by how fast it moves",
    source: "Ramirez 2016, sections 4.4.2 and 4.4.6, in words",
    trials: 10,
    is_timed: false,
    is_seeded: true,
    run,
};

/// How fast the hand is, against the path as it was recorded.
const SPEEDS: [(&str, f64); 3] = [("half as fast", 0.5), ("as recorded", 1.0), ("twice as fast", 2.0)];

/// The hand's way: when [commands after the arm has arrived] and where [m], with rests.
const PATH: [[f64; 4]; 9] = [
    [0.0, 0.0, 0.0, 0.0],
    [10.0, 0.04, 0.01, 0.0],
    [16.0, 0.07, -0.02, 0.03],
    [24.0, 0.03, -0.06, 0.05],
    [32.0, 0.03, -0.06, 0.05],
    [40.0, -0.02, -0.03, 0.02],
    [48.0, -0.05, 0.02, -0.02],
    [56.0, 0.0, 0.0, 0.0],
    [70.0, 0.0, 0.0, 0.0],
];

/// Commands before the hand begins, and all of them at the slowest.
const BEGINS: f64 = 40.0;
const COMMANDS: usize = 180;

/// How far the joints begin from where they shall be [rad], and noise of the trackers [px].
const AWAY: f64 = 0.15;
const NOISE: f64 = 0.3;

fn run(options: &Options) -> Result<Outcome, Error> {
    let results = trials(options, trial)?;
    let (mut rows, mut lags, mut notes) = (Vec::new(), Vec::new(), Vec::new());
    for (index, (series, speed)) in SPEEDS.iter().enumerate() {
        let runs: Vec<Run> = results.iter().map(|runs| runs[index].clone()).collect();
        let shown = (COMMANDS, 10);
        rows.extend(against_command("image error [px]", series, &runs, shown, |moment| moment.error_px));
        rows.extend(against_command("3D error [mm]", series, &runs, shown, |moment| Some(1e3 * moment.error_m)));
        // On the first stretch, of constant speed, once the arm has taken it up; and at rest at the end.
        let at =
            |run: &Run, time: f64| run.moments.get((BEGINS + time / speed) as usize).map(|moment| 1e3 * moment.error_m);
        let per_command = 1e3 * speed * Vector3::new(0.04, 0.01, 0.0).norm() / 10.0;
        let lag: Vec<Option<f64>> = runs.iter().map(|run| at(run, 9.0).map(|lag| lag / per_command)).collect();
        lags.push(Row::new(format!("lag in motions of the hand, {series}"), None, &lag));
        let rest: Vec<Option<f64>> = runs.iter().map(|run| at(run, 70.0)).collect();
        lags.push(Row::new(format!("at rest at the end, {series}, mm"), None, &rest));
        notes.push(format!("{series}, {per_command:.1} mm per command at first: {}", ends(&runs)));
    }
    rows.extend(lags);
    let gain = Settings::default().gain;
    notes.push(format!(
        "with gain {gain}, an arm that is not told how fast its target moves lags by {} of its motions where its Jacobian is right",
        1.0 / gain
    ));
    notes.push("published in words: targets are set by touch and by gestures of a tracked body; `timed-out` is the end of the time".to_owned());
    Ok(Outcome {
        setting: format!(
            "UR5, 4 points of the hand and as many of a target that a person's hand moves after {BEGINS} commands, 2 cameras, {NOISE} px; our \
             defaults, gain {gain}; a trial is a start"
        ),
        measure: "root mean square of the rows [px], mean distance of the hand's points from the target's [mm]",
        abscissa: Some("commands, those of exploring included"),
        rows,
        notes,
    })
}

fn trial(seed: u64) -> Result<Vec<Run>, Error> {
    let mut runs = Vec::new();
    for (_, speed) in SPEEDS {
        let trackers = Trackers { pixels: NOISE, ..Trackers::default() };
        let task = meeting(&["left", "right"], &UR5_POINTS, trackers)?;
        let mut scene = scene(catalog::rig("ur5")?, task, near(&UR5_TARGET, AWAY, seed), UR5_TARGET.to_vec(), seed);
        scene.world.tracker = Tracker::Gaussian(NOISE);
        let waypoint = |[time, x, y, z]: [f64; 4]| Waypoint {
            time: BEGINS + time / speed,
            motion: Pose { rotation: Matrix3::identity(), translation: Vector3::new(x, y, z) },
        };
        scene.target.path = PATH.map(waypoint).to_vec();
        scene.settings = endless(COMMANDS);
        runs.push(go(&scene)?);
    }
    Ok(runs)
}
