//! Figure 5.10: one of the two cameras is carried around the target, and with it the angle between both.
use super::run::{ITERATIONS, Run, servo};
use super::world::{Scene, Tracker, View, World};
use crate::Error;
use crate::experiments::setting::trials;
use crate::experiments::{Experiment, Options, Outcome, Row};
use crate::servo::uncalibrated::{Settings, Stop};

pub(in crate::experiments) const FIGURE5_10: Experiment = Experiment {
    name: "figure5.10",
    about: "servoing without a rig by the angle between two cameras: condition number and iterations",
    source: "Ramirez 2016, figure 5.10 and section 5.2.2, in words",
    trials: 100,
    is_timed: false,
    is_seeded: true,
    run,
};

/// Between neighbouring angles [degrees].
const STRIDE: usize = 10;

/// Size of the exploratory motions [rad] and gain, of the figure's caption.
const SIZE: f64 = 8.0 * std::f64::consts::PI / 180.0;
const GAIN: f64 = 0.5;

fn run(options: &Options) -> Result<Outcome, Error> {
    let angles: Vec<usize> = (0..360).step_by(STRIDE).collect();
    let trials: Vec<Vec<Run>> = trials(options, |seed| {
        let scene = Scene::of_trial(seed, options)?;
        angles.iter().map(|angle| between(&scene, (*angle as f64).to_radians())).collect()
    })?;
    let mut rows = Vec::new();
    for (series, figure) in [
        ("condition number", (|run: &Run| run.condition) as fn(&Run) -> Option<f64>),
        ("iterations to 10 px", iterations),
    ] {
        for (index, angle) in angles.iter().enumerate() {
            let values: Vec<Option<f64>> = trials.iter().map(|runs| figure(&runs[index])).collect();
            // Where all are refused there is nothing to draw, and a note says so.
            if values.iter().any(Option::is_some) {
                rows.push(Row::new(format!("{series} at {angle} degrees"), None, &values).at(series, *angle as f64));
            }
        }
    }
    let refused = trials.iter().filter(|runs| matches!(runs[0].stop, Some(Stop::Undetermined(_)))).count();
    Ok(Outcome {
        setting: format!(
            "Puma 560, 3 points seen by 2 cameras 1 m away, perfect trackers; exploratory motions of {:.0} degrees, gain {GAIN}, the Jacobian kept; \
             a trial is a scene, the first one reconstructed",
            SIZE.to_degrees()
        ),
        measure: "condition number of the Jacobian, iterations",
        abscissa: Some("angle between the cameras [degrees]"),
        rows,
        notes: vec![
            format!("iterations are {ITERATIONS} where the errors never sum up to less than 10 px, or the loop stops before"),
            "published in words: the condition number is smallest and convergence fastest where the cameras are orthogonal; where they overlap \
             servoing diverges"
                .to_owned(),
            format!("where the cameras coincide, {refused} of {} are refused before the arm moves", trials.len()),
        ],
    })
}

/// All of them where the errors never come below 10 px, or the loop stops before.
fn iterations(run: &Run) -> Option<f64> {
    run.condition.map(|_| run.steps(1).filter(|_| run.stop.is_none()).unwrap_or(ITERATIONS) as f64)
}

/// One camera in front of the target, the other at an angle to it [rad].
fn between(scene: &Scene, angle: f64) -> Result<Run, Error> {
    let views = [0.0, angle].map(|angle| View { angle, beside: 0.0, distance: 1.0 });
    servo(&mut World::new(scene, &views, Tracker::Perfect, 1)?, &Settings::plain(GAIN, SIZE))
}
