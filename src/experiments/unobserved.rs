//! Servoing a noisy controller whose state nobody observes, with a rig that was learned from it: figures 10 and 11.
use super::servoing::{Acts, FLOOR_NOTE, TARGETS, learned_from_controller, rows, servo};
use super::setting::{NOISE_NOTE, SETTING, rig, trials};
use super::{Options, Outcome, Published, Row};
use crate::Error;
use crate::rig::PoseNoise;
use crate::servo::{ModelBased, ModelBasedTip};
use crate::simulate::world::Execution;

const COMMANDS: usize = 5;

/// Standard deviations of the controllers [m and rad], what the paper says of the error that they lead to [px], and their curves.
pub(super) type Curves = [(f64, Option<f64>, &'static str); 2];

/// A controller whose noise is this share of its motion.
const SHARE: f64 = 0.02;

/// Two curves of constant noise and one of noise in proportion to the motion.
pub(super) fn outcome(options: &Options, acts: Acts, curves: Curves, said: &str) -> Result<Outcome, Error> {
    let mut all = Vec::new();
    for (sd, published, series) in curves {
        let execution = match acts {
            Acts::Joints => Execution { joints: sd, ..Execution::default() },
            Acts::Tip => Execution { pose: PoseNoise { xyz: sd, rot: sd }, ..Execution::default() },
        };
        all.extend(curve(options, acts, &execution, series, published)?);
    }
    let execution = Execution { share: SHARE, ..Execution::default() };
    all.extend(curve(options, acts, &execution, "2 % of the motion", None)?);
    Ok(Outcome {
        setting: format!(
            "{SETTING}; 50 random actions to learn from, then {TARGETS} random targets a trial; neither joints nor poses are read"
        ),
        measure: "true mean distance from the target [px]",
        abscissa: Some("commands"),
        rows: all,
        notes: vec![NOISE_NOTE.to_owned(), FLOOR_NOTE.to_owned(), format!("published: {said}")],
    })
}

fn curve(
    options: &Options,
    acts: Acts,
    execution: &Execution,
    series: &'static str,
    published: Option<f64>,
) -> Result<Vec<Row>, Error> {
    let truth = rig()?;
    let results = trials(options, |seed| {
        let Some(known) = learned_from_controller(&truth, acts, execution, seed)? else { return Ok(None) };
        let (robot, run) = ((execution, None, acts), (seed, COMMANDS));
        let servoed = match acts {
            Acts::Joints => servo(&truth, &known, robot, run, || ModelBased::new(&known)),
            Acts::Tip => servo(&truth, &known, robot, run, || ModelBasedTip::new(&known)),
        };
        servoed.map(Some)
    })?;
    let at_the_end = |step: usize| published.filter(|_| step == COMMANDS).and_then(Published::single);
    Ok(rows(series, at_the_end, &results, COMMANDS))
}
