//! Section 5.1.3: a robot that does not carry out small motions, and how far from its target it stays.
use super::scenes::{UR5_TARGET, endless, go, near, scene_of_features};
use crate::Error;
use crate::experiments::setting::{columns, trials};
use crate::experiments::{Experiment, Options, Outcome, Published, Row};
use crate::rig::catalog;
use crate::scene::{Control, UncalibratedControl};
use crate::servo::uncalibrated::{Settings, Update};
use crate::simulate::world::{Execution, Tracker};

pub(in crate::experiments) const DEAD_BAND: Experiment = Experiment {
    name: "dead-band",
    about: "servoing without a rig a robot that ignores small motions, by the gain",
    source: "Ramirez 2016, section 5.1.3, in words and as TOL/λ",
    trials: 20,
    is_timed: false,
    is_seeded: true,
    run,
};

/// Motions of a joint below this are not carried out [rad].
const WIDTH: f64 = 0.002;

/// λ.
const GAINS: [f64; 4] = [0.1, 0.25, 0.5, 1.0];

/// What the controller knows of the dead band, and how it servoes.
const CONTROLLERS: [(&str, bool, bool); 3] =
    [("told nothing", false, true), ("told of the dead band", true, true), ("told of it, our defaults", true, false)];

/// How far the joints begin from where they shall be [rad].
const AWAY: f64 = 0.2;

/// Of the trackers [px].
const NOISE: f64 = 0.1;

const COMMANDS: usize = 120;

fn run(options: &Options) -> Result<Outcome, Error> {
    let results = trials(options, trial)?;
    let figures = columns(&results);
    let most = |is_told: bool| {
        let of = figures.iter().enumerate().filter(|(index, _)| CONTROLLERS[index / GAINS.len()].1 == is_told);
        of.flat_map(|(_, values)| values.iter().flatten().copied()).fold(0.0, f64::max)
    };
    let mut rows = Vec::new();
    for (index, values) in figures.iter().enumerate() {
        let (series, is_told, _) = CONTROLLERS[index / GAINS.len()];
        let gain = GAINS[index % GAINS.len()];
        let published = if is_told { None } else { Published::single(1.0 / gain) };
        rows.push(Row::new(format!("{series}, gain {gain}"), published, values).at(series, gain));
    }
    Ok(Outcome {
        setting: format!(
            "UR5, 12 features, 2 cameras, {NOISE} px; motions of a joint below {WIDTH} rad are not carried out; {COMMANDS} commands, a trial is \
             a start; the Jacobian is kept but for our defaults"
        ),
        measure: "largest distance of a joint from its target at the end [dead bands]",
        abscissa: Some("gain"),
        rows,
        notes: vec![
            "published: the final error grows to TOL/λ; a few steps with doubled gain near the target gain 0.1 to 0.2 mm on a WAM".to_owned(),
            "TOL/λ is the most that steps of a share λ leave of one joint alone, where the Jacobian is right: below it they are swallowed".to_owned(),
            format!(
                "who is told takes whole steps where shares of them would be swallowed: at most {:.1} dead bands are left in all trials, and {:.1} \
                 where nothing is told",
                most(true),
                most(false)
            ),
        ],
    })
}

fn trial(seed: u64) -> Result<Vec<Option<f64>>, Error> {
    let start = near(&UR5_TARGET, AWAY, seed);
    let mut figures = Vec::new();
    for (_, is_told, is_plain) in CONTROLLERS {
        for gain in GAINS {
            let plain = Settings { update: Update::Keep, trust: None, ..Settings::default() };
            let settings = if is_plain { plain } else { Settings::default() };
            let mut scene = scene_of_features(catalog::rig("ur5")?, start.clone(), UR5_TARGET.to_vec(), seed);
            scene.world.execution = Execution { dead_band: WIDTH, ..Execution::default() };
            scene.world.tracker = Tracker::Gaussian(NOISE);
            scene.control = Some(Control::Uncalibrated(UncalibratedControl {
                pixels: NOISE,
                settings: Settings { gain, ..settings },
                dead_band: if is_told { WIDTH } else { 0.0 },
                hybrid: false,
            }));
            scene.settings = endless(COMMANDS);
            let run = go(&scene)?;
            let off = run.moments.last().map(|moment| {
                moment.joints.iter().zip(UR5_TARGET).map(|(joint, target)| (joint - target).abs()).fold(0.0, f64::max)
            });
            figures.push(off.map(|off| off / WIDTH));
        }
    }
    Ok(figures)
}
