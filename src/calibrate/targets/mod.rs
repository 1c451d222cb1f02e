//! Hand-eye and robot-world calibration: cameras and targets from poses of targets in the cameras' frames.
//!
//! Started in closed form, then refined as one graph: tips free under the noise of their readings or derived from joints and
//! chain, the clock of the images and the scale of their translations as free scalars where the data speak for them.
mod account;
mod clock;
mod graph;
mod moments;
mod scale;
mod scatter;
mod setup;
mod spread;
mod start;

pub use account::{Disagreement, TargetReport};

use super::{Calibration, Observer, Options, Progress, StageReport};
use crate::Error;
use crate::recording::Recording;
use crate::rig::{Parent, Rig};
use graph::{Built, Freedom, State, build};
use handeye_solvers::manifold::so3;
use handeye_solvers::{Covariance, Loss, Pose, Report as FitReport, Solver};
use moments::{Stream, chain_of};
use setup::Setup;
use start::{Start, starts};

/// Width of Cauchy's loss [standard deviations of six numbers together]: targets are mistaken as a whole, such as a board seen
/// from its other side.
const TAILS: f64 = 4.0;

/// Rounds in which the noise is estimated from the scatter, and streams are smoothed where the clock now puts them.
const ROUNDS: usize = 4;
/// The same where how far the chain is off is estimated too.
const CHAIN_ROUNDS: usize = 10;

/// Where nothing is said of the noise, this is where its estimation starts [rad, m].
const ROT: f64 = 0.005;
const XYZ: f64 = 0.003;

/// Starts that are refined.
const REFINED: usize = 3;

/// Learns the poses of cameras and targets; see [`super::calibrate`].
pub(super) fn calibrate_targets(
    rig: &Rig,
    recording: &Recording,
    options: &Options,
    observer: Observer<'_>,
) -> Result<Calibration, Error> {
    let started = std::time::Instant::now();
    let clock = first_offset(rig, recording)?;
    let setup = Setup::new(rig, recording, clock)?;
    let mut tell = |done: usize| match observer(&Progress { stage: "targets", done, of: 3, rms_px: None }).is_break() {
        true => Err(Error::Cancelled),
        false => Ok(()),
    };
    tell(0)?;
    let (a, b) = pairs(&setup);
    let candidates = starts(&a, &b, options.seed);
    let fixed = refined(&setup, &candidates, clock, false)?;
    let free = refined(&setup, &candidates, clock, true)?;
    tell(1)?;
    let fixed = Fitted::new(setup, fixed, recording, rig)?;
    let setup = Setup::new(rig, recording, clock)?;
    let free = Fitted::new(setup, free, recording, rig)?;
    tell(2)?;
    let best = if free.is_better_than(&fixed)? { free } else { fixed };
    let stage = StageReport {
        name: "targets".into(),
        iterations: best.iterations,
        loss_before: best.first_cost,
        loss_after: best.report.final_cost,
        seconds: started.elapsed().as_secs_f64(),
    };
    let converged = best.report.termination.converged();
    let Fitted { setup, state, freedom, built, solver, .. } = best;
    let account = account::Account { setup: &setup, state: &state, freedom, built: &built, starts: &candidates };
    account.finish(solver, stage, converged, recording)
}

/// The best of the first few starts, refined.
fn refined(setup: &Setup, starts: &[Start], clock: f64, is_scale_free: bool) -> Result<State, Error> {
    let mut best: Option<(f64, State)> = None;
    for start in starts.iter().filter(|start| is_scale_free || start.scale == 1.0).take(REFINED) {
        let mut state = first_state(setup, start, clock);
        let freedom = Freedom { offset: setup.apart, scale: is_scale_free };
        let (report, _) = build(setup, &state, freedom, Loss::Cauchy(TAILS)).minimize(&mut state)?;
        if best.as_ref().is_none_or(|(least, _)| report.final_cost < *least) {
            best = Some((report.final_cost, state));
        }
    }
    let (_, state) = best.ok_or_else(|| Error::NotEnoughData("no start fits the targets".into()))?;
    Ok(state)
}

/// A fit with its noise.
struct Fitted {
    setup: Setup,
    state: State,
    freedom: Freedom,
    built: Built,
    solver: Solver,
    report: FitReport,
    iterations: usize,
    first_cost: f64,
}

impl Fitted {
    /// Estimates the noise from the scatter, smooths streams where the clock now puts them, and fits again, in turns.
    fn new(mut setup: Setup, mut state: State, recording: &Recording, rig: &Rig) -> Result<Fitted, Error> {
        let freedom = Freedom { offset: setup.apart, scale: state.scale != 1.0 };
        let (mut iterations, mut first_cost) = (0, 0.0);
        let mut last = None;
        let rounds = if setup.by_joints { CHAIN_ROUNDS } else { ROUNDS };
        for round in 0..rounds {
            if setup.rig.noise.target.is_none() {
                scatter::estimate(&setup, &mut state);
            }
            if setup.apart {
                setup = Setup::new(rig, recording, state.offset)?;
                state.drifts.resize(setup.views.len(), [0.0; 6]);
                state.tips = setup.moments.iter().map(|moment| moment.pose.at(state.offset)).collect();
            }
            let mut built = build(&setup, &state, freedom, Loss::Cauchy(TAILS));
            let (report, solver) = built.minimize(&mut state)?;
            iterations += report.iterations;
            if let Ok(mut covariance) = Covariance::with(&built.graph, Solver::new(&built.graph)) {
                state.shown = scatter::shown(&setup, &built, &state, &mut covariance);
                spread::estimate(&setup, &built, &mut covariance, &mut state);
            }
            if round == 0 {
                first_cost = report.initial_cost;
            }
            last = Some((built, report, solver));
        }
        let (built, report, solver) = last.ok_or_else(|| Error::NotEnoughData("no round of the fit was run".into()))?;
        Ok(Fitted { setup, state, freedom, built, solver, report, iterations, first_cost })
    }
}

/// The offset of the images' clock from angular speeds, where the streams were recorded apart.
fn first_offset(rig: &Rig, recording: &Recording) -> Result<f64, Error> {
    let stream = Stream::new(rig, recording)?;
    if !stream.apart {
        return Ok(0.0);
    }
    let (mut times, mut poses): (Vec<f64>, Vec<Pose>) = (Vec::new(), Vec::new());
    for sample in &recording.samples {
        if let (Some(time), Some(first)) = (sample.time, sample.targets.first())
            && times.last().is_none_or(|last| time > *last)
        {
            times.push(time);
            poses.push(first.pose);
        }
    }
    if times.len() < 3 {
        return Err(Error::NotEnoughData(
            "robot and targets were recorded apart, and too few samples have a time".into(),
        ));
    }
    Ok(clock::offset(stream.trajectory(), (&times, &poses)))
}

/// a and b of a X = Z b for the camera and target that were seen together most.
fn pairs(setup: &Setup) -> (Vec<Pose>, Vec<Pose>) {
    let (camera, target) = most_seen(setup);
    let on_hand = setup.rig.cameras[camera].parent != Parent::World;
    let views = setup.views.iter().filter(|view| (view.camera, view.target) == (camera, target));
    views
        .map(|view| {
            let moment = &setup.moments[view.moment];
            (moment.pose.at(moment.around), if on_hand { view.seen.inverse() } else { view.seen })
        })
        .unzip()
}

fn most_seen(setup: &Setup) -> (usize, usize) {
    let mut counts = std::collections::BTreeMap::<(usize, usize), usize>::new();
    setup.views.iter().for_each(|view| *counts.entry((view.camera, view.target)).or_default() += 1);
    let most = counts.iter().max_by_key(|(pair, count)| (**count, std::cmp::Reverse(**pair)));
    most.map_or((0, 0), |(pair, _)| *pair)
}

/// Everything from one start: cameras and targets that it does not name follow from those that it does.
fn first_state(setup: &Setup, start: &Start, offset: f64) -> State {
    let rig = &setup.rig;
    let (camera, target) = most_seen(setup);
    let on_hand = rig.cameras[camera].parent != Parent::World;
    let mut cameras: Vec<Option<Pose>> = vec![None; rig.cameras.len()];
    let mut targets: Vec<Option<Pose>> = vec![None; rig.targets.len()];
    (cameras[camera], targets[target]) =
        if on_hand { (Some(start.x), Some(start.z)) } else { (Some(start.z), Some(start.x)) };
    let tips: Vec<Pose> = setup.moments.iter().map(|moment| moment.pose.at(moment.around)).collect();
    let carrier = |parent: Parent, moment: usize| if parent == Parent::World { Pose::identity() } else { tips[moment] };
    // Each pass places what has been seen together with something placed.
    for _ in 0..cameras.len() + targets.len() {
        for view in &setup.views {
            let seen = Pose { translation: view.seen.translation / start.scale, ..view.seen };
            let mount = carrier(rig.cameras[view.camera].parent, view.moment);
            let below = carrier(rig.targets[view.target].parent, view.moment);
            match (cameras[view.camera], targets[view.target]) {
                (Some(camera), None) => targets[view.target] = Some(below.inverse() * mount * camera * seen),
                (None, Some(target)) => {
                    cameras[view.camera] = Some(mount.inverse() * below * target * seen.inverse());
                }
                _ => {}
            }
        }
    }
    let given = |poses: Vec<Option<Pose>>| poses.into_iter().map(|pose| pose.unwrap_or_else(Pose::identity)).collect();
    let chain = chain_of(rig).filter(|_| setup.by_joints);
    let stated = rig.noise.target;
    let (rot, xyz) = stated.map_or((ROT, XYZ), |noise| (noise.rot, noise.xyz));
    State {
        cameras: given(cameras),
        targets: given(targets),
        base: chain.as_ref().map_or_else(Pose::identity, |model| model.base),
        parameters: chain.map_or_else(Vec::new, |model| model.parameters),
        tips,
        offset,
        scale: start.scale,
        sigmas: [rot, rot, rot, xyz, xyz, xyz],
        walks: [0.0; 2],
        drifts: vec![[0.0; 6]; setup.views.len()],
        spread: spread::START,
        shown: [1.0; 6],
    }
}

/// The axis that most turns of the tip share, in the tip's frame, and the root mean squares of the turns [rad] about it and about
/// the axis next to it.
fn turning(tips: &[Pose]) -> (nalgebra::Vector3<f64>, [f64; 2]) {
    let n = tips.len();
    let mut spread = nalgebra::Matrix3::zeros();
    for i in 0..n {
        let turn = so3::log(&(tips[i].rotation.transpose() * tips[(i + n / 3 + 1) % n].rotation));
        spread += turn * turn.transpose() / n as f64;
    }
    let eigen = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    let rms = |k: usize| eigen.eigenvalues[order[k]].max(0.0).sqrt();
    (eigen.eigenvectors.column(order[0]).into_owned(), [rms(0), rms(1)])
}
