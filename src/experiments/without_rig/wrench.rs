//! The wrench of figure 3.5: its points may end on either side of the bolt.
use super::scenes::{against_command, ends, go, near, scene};
use crate::Error;
use crate::experiments::setting::trials;
use crate::experiments::{Experiment, Options, Outcome, Row};
use crate::rig::{Model, catalog};
use crate::scene::{Moment, Run};
use crate::servo::image_tasks::{self, Feature, ImageTask, Kind, ParallelLines, Part, Place, Trackers};
use crate::simulate::world::Tracker;
use handeye_solvers::manifold::so3;
use nalgebra::Vector3;

pub(in crate::experiments) const WRENCH: Experiment = Experiment {
    name: "wrench",
    about: "a wrench is brought to a bolt without a rig: which side it ends on, by how far it begins turned",
    source: "Ramirez 2016, figure 3.5 and section 3.2.1, in words",
    trials: 10,
    is_timed: false,
    is_seeded: true,
    run,
};

/// Where the joints shall be, the last of which turns the wrench about the axis that the task leaves two sides of, and how far the others
/// begin from there [rad].
const TARGET: [f64; 6] = [0.0, -1.3, 1.2, -1.5, -1.6, -1.5];
const AWAY: f64 = 0.1;

/// How far the wrench begins turned [degrees], and which of these are drawn.
const TURNS: [f64; 7] = [0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0];
const DRAWN: [(usize, bool, &str); 4] = [
    (1, false, "begins turned by 30°"),
    (5, false, "by 150°"),
    (1, true, "by 30°, side told"),
    (5, true, "by 150°, side told"),
];

/// Of the trackers [px].
const NOISE: f64 = 0.3;

/// Commands that are shown, and every how many.
const SHOWN: (usize, usize) = (60, 5);

/// Ends within this are on the right side, and beyond its supplement on the other [degrees].
const SAME: f64 = 20.0;

fn run(options: &Options) -> Result<Outcome, Error> {
    let results = trials(options, trial)?;
    let tip = Model::new(&catalog::rig("ur5")?)?;
    let goal = tip.tip(&TARGET);
    let turned = |moment: &Moment| {
        let off = tip.tip(&moment.joints).rotation * goal.rotation.transpose();
        so3::log(&off).norm().to_degrees()
    };
    let of = |turn: usize, told: bool| -> Vec<Run> {
        results.iter().map(|runs| runs[usize::from(told) * TURNS.len() + turn].clone()).collect()
    };
    let mut rows = Vec::new();
    for (turn, told, series) in DRAWN {
        let runs = of(turn, told);
        rows.extend(against_command("image error [px]", series, &runs, SHOWN, |moment| moment.error_px));
        rows.extend(against_command("turned by [degrees]", series, &runs, SHOWN, |moment| Some(turned(moment))));
    }
    let is_right = |run: &Run| run.moments.last().is_some_and(|end| turned(end) < SAME);
    let is_other = |run: &Run| run.moments.last().is_some_and(|end| turned(end) >= 180.0 - SAME);
    let untold: Vec<Run> = (0..TURNS.len()).flat_map(|turn| of(turn, false)).collect();
    let sides = [end(&untold, "on the right side", is_right), end(&untold, "on the other", is_other)];
    let mut notes = vec![sides.join(", ")];
    notes.push("how runs end, by how far they begin turned:".to_owned());
    for told in [false, true] {
        for (index, turn) in TURNS.iter().enumerate() {
            let runs = of(index, told);
            let ended = |is_there: &dyn Fn(&Run) -> bool| {
                runs.iter().map(|run| Some(f64::from(u8::from(is_there(run))))).collect::<Vec<_>>()
            };
            let side = if told { ", side told" } else { "" };
            rows.push(Row::new(
                format!("share on the right side, begins turned by {turn}°{side}"),
                None,
                &ended(&is_right),
            ));
            rows.push(Row::new(
                format!("share on the other side, begins turned by {turn}°{side}"),
                None,
                &ended(&is_other),
            ));
            notes.push(format!("  {turn}°{side}: {}", ends(&runs)));
        }
    }
    let beyond: Vec<Run> =
        (0..TURNS.len()).filter(|turn| TURNS[*turn] > 90.0).flat_map(|turn| of(turn, true)).collect();
    let sides = [end(&beyond, "on the right side", is_right), end(&beyond, "elsewhere", |run| !is_right(run))];
    notes.push(format!(
        "`side told` adds parallel lines with a direction; of what then begins beyond 90°, {}",
        sides.join(", ")
    ));
    notes.push(
        "published in words: an unexpected solution, the wrench's other points towards the left or the right, for the same errors".to_owned(),
    );
    Ok(Outcome {
        setting: format!("UR5, the shipped task `wrench`, 2 cameras, {NOISE} px; our defaults; a trial is a start"),
        measure: "root mean square of the rows [px], angle of the wrench from where it shall be [degrees], shares",
        abscissa: Some("commands, those of exploring included"),
        rows,
        notes,
    })
}

/// How many of the runs end there, and what is left of their errors.
fn end(runs: &[Run], place: &str, is_there: impl Fn(&Run) -> bool) -> String {
    let there: Vec<&Run> = runs.iter().filter(|run| is_there(run)).collect();
    let errors: Vec<Option<f64>> = there.iter().map(|run| run.moments.last().and_then(|end| end.error_px)).collect();
    let median = Row::new("", None, &errors).median();
    let median = median.map_or(String::new(), |median| format!(" with {median:.2} px in the median"));
    format!("{} of {} end {place}{median}", there.len(), runs.len())
}

/// Runs by whether the side is told, then by turn.
fn trial(seed: u64) -> Result<Vec<Run>, Error> {
    let mut runs = Vec::new();
    for told in [false, true] {
        for (index, turn) in TURNS.iter().enumerate() {
            let seed = seed.wrapping_mul(100).wrapping_add(index as u64);
            let mut start = near(&TARGET, AWAY, seed);
            start[5] = TARGET[5] + turn.to_radians();
            let mut scene = scene(catalog::rig("ur5")?, task(told)?, start, TARGET.to_vec(), seed);
            scene.world.tracker = Tracker::Gaussian(NOISE);
            scene.settings.window = 30;
            scene.settings.tolerance_px = 1.5 * NOISE;
            scene.settings.timeout = 200.0;
            runs.push(go(&scene)?);
        }
    }
    Ok(runs)
}

/// The shipped task with the axis of its two sides on that of the last joint, and with the side where that is told.
fn task(told: bool) -> Result<ImageTask, Error> {
    let shipped = image_tasks::catalog::ALL.iter().find(|(name, _)| *name == "wrench");
    let (name, text) = shipped.ok_or_else(|| Error::Unusable("no task is called `wrench`".to_owned()))?;
    let task = ImageTask::parse(text, name)?;
    let moved = |xyz: &Vector3<f64>| Vector3::new(xyz.x - 0.05, -xyz.z, xyz.y + 0.1);
    let place = |place: &Place| match place {
        Place::Hand(xyz) => Place::Hand(xyz.as_ref().map(moved)),
        Place::Target(xyz) => Place::Target(xyz.as_ref().map(moved)),
        Place::Image(pixels) => Place::Image(pixels.clone()),
    };
    let features = task.features().iter().map(|f| Feature { name: f.name.clone(), place: place(&f.place) }).collect();
    let mut parts = task.parts().to_vec();
    if told {
        let line = |names: [&str; 2]| {
            let [from, to] = names.map(|name| task.feature(name));
            from.zip(to).map(|(from, to)| [from, to])
        };
        let lines = line(["wrench-5", "wrench-6"]).zip(line(["bolt-1", "bolt-2"]));
        parts.extend(lines.map(|(line, to)| Part {
            kind: Kind::ParallelLines(ParallelLines { line, to, directed: true }),
            cameras: (0..task.cameras().len()).collect(),
        }));
    }
    let trackers = Trackers { pixels: NOISE, ..Trackers::default() };
    ImageTask::new(None, task.cameras().to_vec(), features, parts, trackers)
}
