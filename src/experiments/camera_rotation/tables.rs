//! Tables 5.1 to 5.3: errors, steps and divergence, by exploratory motion and gain, with the Jacobian kept as explored.
use super::published::{GAUSSIAN, PERFECT, Printed, ROUNDED};
use super::run::{ITERATIONS, Run, carried_around};
use super::world::{Scene, Tracker};
use crate::Error;
use crate::experiments::{Experiment, Options, Outcome, Published, Row};
use crate::servo::uncalibrated::Settings;

pub(in crate::experiments) const TABLE5_1: Experiment = Experiment {
    name: "table5.1",
    about: "servoing without a rig, cameras carried around the target, trackers of whole pixels",
    source: "Ramirez 2016, table 5.1",
    trials: 360,
    is_timed: false,
    is_seeded: false,
    run: |options| run(options, Tracker::Rounded, &ROUNDED),
};

pub(in crate::experiments) const TABLE5_2: Experiment = Experiment {
    name: "table5.2",
    about: "servoing without a rig, cameras carried around the target, perfect trackers",
    source: "Ramirez 2016, table 5.2",
    run: |options| run(options, Tracker::Perfect, &PERFECT),
    ..TABLE5_1
};

pub(in crate::experiments) const TABLE5_3: Experiment = Experiment {
    name: "table5.3",
    about: "servoing without a rig, cameras carried around the target, trackers with noise of 0.2 px",
    source: "Ramirez 2016, table 5.3",
    is_seeded: true,
    run: |options| run(options, Tracker::Gaussian(0.2), &GAUSSIAN),
    ..TABLE5_1
};

/// Iterations that the thesis counts as one step, as its figures show: 50 of them at λ = 0.25 would leave nothing of what it prints.
pub(super) const STRIDE: usize = 4;

fn run(options: &Options, tracker: Tracker, printed: &[Printed]) -> Result<Outcome, Error> {
    let mut rows = Vec::new();
    for (index, line) in printed.iter().enumerate() {
        let settings = Settings::plain(line.gain, line.size_deg.to_radians());
        let seed = options.seed.wrapping_mul(100).wrapping_add(index as u64);
        let runs = carried_around(&Scene::RECONSTRUCTED, tracker, &settings, options.trials, seed)?;
        let kept: Vec<&Run> = runs.iter().filter(|run| !run.diverged()).collect();
        let diverged = 360.0 * (runs.len() - kept.len()) as f64 / runs.len() as f64;
        let ours: [Vec<Option<f64>>; 4] = [
            kept.iter().map(|run| run.errors.last().copied()).collect(),
            kept.iter().map(|run| Some(run.error_3d)).collect(),
            kept.iter().filter_map(|run| run.steps(STRIDE)).map(|steps| Some(steps as f64)).collect(),
            vec![Some(diverged)],
        ];
        for (figure, (what, ours)) in
            ["image error", "3D error", "steps to 10 px", "diverged"].iter().zip(&ours).enumerate()
        {
            let label = format!("{} degrees, gain {}, {what}", line.size_deg, line.gain);
            let row = Row::new(label, Published::single(line.thesis[figure]), ours);
            rows.push(Row { reconstructed: Some(line.reconstructed[figure]), ..row });
        }
    }
    Ok(Outcome {
        setting: format!(
            "Puma 560, 3 points seen by 2 cameras 1 m away and 0.3 m apart; {ITERATIONS} iterations; a trial is a place of the cameras"
        ),
        measure: "sums of absolute errors over 12 pixel coordinates [px] and 9 coordinates in space [m], steps of 4 iterations, places of 360",
        abscissa: None,
        rows,
        notes: vec![
            "errors and steps are means over the places that did not diverge: where errors never grew by more than 100 px in one iteration"
                .to_owned(),
            "start and target are not in the thesis: they were searched for until its figures came out, by the reconstruction whose own \
             figures stand beside"
                .to_owned(),
        ],
    })
}
