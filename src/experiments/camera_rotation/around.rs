//! Figures 5.8 and 5.9: a pair of cameras is carried around the target; errors, condition number and steps by where it is.
use super::run::{ITERATIONS, Run, carried_around};
use super::tables::STRIDE;
use super::world::{Scene, Tracker};
use crate::Error;
use crate::experiments::setting::trials;
use crate::experiments::{Experiment, Options, Outcome, Row};
use crate::servo::uncalibrated::Settings;

pub(in crate::experiments) const FIGURE5_8: Experiment = Experiment {
    name: "figure5.8",
    about: "servoing without a rig by the angle of a pair of cameras: errors, condition number, steps; trackers of whole pixels",
    source: "Ramirez 2016, figure 5.8, and table 5.1 over all angles",
    trials: 20,
    is_timed: false,
    is_seeded: true,
    run: |options| run(options, Tracker::Rounded, 6.0),
};

pub(in crate::experiments) const FIGURE5_9: Experiment = Experiment {
    name: "figure5.9",
    about: "servoing without a rig by the angle of a pair of cameras: errors, condition number, steps; perfect trackers",
    source: "Ramirez 2016, figure 5.9, and table 5.2 over all angles",
    run: |options| run(options, Tracker::Perfect, 8.0),
    ..FIGURE5_8
};

/// Places around the target.
const PLACES: usize = 36;

/// Of a run that never arrives.
const ALL_STEPS: usize = ITERATIONS.div_ceil(STRIDE);

/// λ, of the figures' captions.
const GAIN: f64 = 0.5;

fn run(options: &Options, tracker: Tracker, size_deg: f64) -> Result<Outcome, Error> {
    let settings = Settings::plain(GAIN, size_deg.to_radians());
    let trials: Vec<Vec<Run>> =
        trials(options, |seed| carried_around(&Scene::of_trial(seed, options)?, tracker, &settings, PLACES, seed))?;
    type Figure = fn(&Run) -> Option<f64>;
    let figures: [(&str, Figure); 4] = [
        ("image error [px]", |run| run.errors.last().copied()),
        ("3D error [m]", |run| Some(run.error_3d)),
        ("condition number", |run| run.condition),
        ("steps to 10 px", |run| Some(run.steps(STRIDE).unwrap_or(ALL_STEPS) as f64)),
    ];
    let mut rows = Vec::new();
    for (panel, figure) in figures {
        for place in 0..PLACES {
            let angle = 360.0 * place as f64 / PLACES as f64;
            // A run that diverged has no end.
            let kept = trials.iter().map(|runs| &runs[place]).filter(|run| !run.diverged());
            let values: Vec<Option<f64>> = kept.map(figure).collect();
            if !values.is_empty() {
                rows.push(Row::new(format!("{panel} at {angle} degrees"), None, &values).at("", angle).on(panel));
            }
        }
    }
    let count = |is_it: &dyn Fn(&Run) -> bool| trials.iter().flatten().filter(|run| is_it(run)).count();
    let (all, diverged) = (count(&|_| true), count(&Run::diverged));
    let stopped = count(&|run| run.stop.is_some() && !run.diverged());
    let late = count(&|run| !run.diverged() && run.steps(STRIDE).is_none());
    Ok(Outcome {
        setting: format!(
            "Puma 560, 3 points seen by 2 cameras 1 m away and 0.3 m apart; exploratory motions of {size_deg} degrees, gain {GAIN}, the Jacobian \
             kept, {ITERATIONS} iterations; a trial is a scene, the first one reconstructed"
        ),
        measure: "sums of absolute errors over 12 pixel coordinates [px] and 9 coordinates in space [m], condition number, steps of 4 iterations",
        abscissa: Some("angle of the cameras [degrees]"),
        rows,
        notes: vec![
            format!(
                "{diverged} of {all} diverged, and are left out; {stopped} were stopped for another reason, and count as they ended"
            ),
            format!(
                "{late} of the {} others were not within 10 px at any of their steps, and count as {ALL_STEPS}",
                all - diverged
            ),
            "published as curves without numbers; in words: the higher the condition number, the longer it takes"
                .to_owned(),
        ],
    })
}
