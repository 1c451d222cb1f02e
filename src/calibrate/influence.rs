//! How much the result hangs on every sample.
use super::direction::stepped;
use super::gauge;
use super::graph::{State, build};
use super::observation::Kind;
use super::outliers::Verdict;
use super::residuals::distances;
use super::stage::{Stage, Stages};
use crate::rig::Model;
use handeye_solvers::LeaveOut;
use nalgebra::Vector3;
use rayon::prelude::*;

/// What leaving out a sample would change, and how well it fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Influence {
    /// Index of the sample in the recording, from 0.
    pub sample: usize,
    /// How far the tip would move: root mean square over the recorded samples, after one Gauss-Newton step [m, or the model's
    /// unit where nothing metric is known]; infinite where the others do not determine the rig without it. `None` where the
    /// tip does not follow from anything that is learned.
    pub tip: Option<f64>,
    /// Root mean square pixel distance of its detections [px]; 0 without pixels.
    pub rms_px: f64,
    /// Root mean square distance of its points [m]; 0 without points.
    pub rms_points_m: f64,
    /// Root mean square of all its errors, by coordinate [standard deviations].
    pub misfit: f64,
}

/// Samples whose tips are compared, spread evenly over the recording.
const TIPS: usize = 100;

/// Of every sample that has a detection in use, in the order of the recording.
pub(crate) fn influence(stages: &Stages<'_>, last: &Stage<'_>, state: &State, verdict: &Verdict) -> Vec<Influence> {
    let setup = stages.setup;
    let tips = tip_motions(stages, last, state, verdict);
    let distances = distances(setup, state);
    let of_sample = |sample: usize| -> Option<Influence> {
        let first = setup.observations.partition_point(|seen| seen.sample < sample);
        let end = setup.observations.partition_point(|seen| seen.sample <= sample);
        let used = || (first..end).filter(|&i| verdict.active[i]).map(|i| (setup.observations[i].kind(), distances[i]));
        used().next()?;
        let rms = |kind: Kind| {
            let of_kind = || used().filter(|(other, _)| *other == kind);
            (of_kind().map(|(_, d)| d * d).sum::<f64>() / of_kind().count().max(1) as f64).sqrt()
        };
        let whitened: f64 = used().map(|(kind, d)| (d / setup.sd(kind)).powi(2)).sum();
        let coordinates: f64 = used().map(|(kind, _)| kind.coordinates()).sum();
        Some(Influence {
            sample: setup.samples[sample],
            tip: tips.as_ref().map(|tips| tips[sample]),
            rms_px: rms(Kind::Pixels),
            rms_points_m: rms(Kind::Points),
            misfit: (whitened / coordinates).sqrt(),
        })
    };
    (0..setup.len()).filter_map(of_sample).collect()
}

/// How far the tip moves without the detections of each sample; `None` where it does not follow from anything that is learned.
///
/// One Gauss-Newton step of the same graph without them, from where the fit with them ended: the first-order change of a fit
/// without the sample, its leverage included. Detections pull as much as they did in the fit.
fn tip_motions(stages: &Stages<'_>, last: &Stage<'_>, state: &State, verdict: &Verdict) -> Option<Vec<f64>> {
    let setup = stages.setup;
    let freedom = gauge::with_frames_held(setup, last.freedom);
    if !gauge::is_tip_learned(setup, &freedom) {
        return None;
    }
    let built = build(setup, state, &freedom, stages.priors, last.loss, |index| verdict.active[index]);
    let mut detections = vec![Vec::new(); setup.len()];
    for &(index, factor) in &built.factors {
        detections[setup.observations[index].sample].push(factor);
    }
    let wanted = [built.base.index(), built.parameters.index()];
    let Ok(leave_out) = LeaveOut::new(&built.graph, &detections, &wanted) else {
        return Some(vec![f64::INFINITY; setup.len()]);
    };
    let every = setup.len().div_ceil(TIPS).max(1);
    // The rig is compared, at the same joints.
    let tips = |model: &Model| -> Vec<Vector3<f64>> {
        state.joints.iter().step_by(every).map(|joints| model.tip(joints).translation).collect()
    };
    let before = tips(&state.model);
    let of_sample = |sample: usize| {
        let Some(steps) = leave_out.step(sample) else { return f64::INFINITY };
        let mut model = state.model.clone();
        model.base = stepped(&model.base, &steps[0].iter().copied().enumerate().collect::<Vec<_>>());
        model.parameters.iter_mut().zip(&steps[1]).for_each(|(number, step)| *number += step);
        let square: f64 = tips(&model).iter().zip(&before).map(|(a, b)| (a - b).norm_squared()).sum();
        let moved = (square / before.len().max(1) as f64).sqrt();
        if moved.is_finite() { moved } else { f64::INFINITY }
    };
    Some((0..setup.len()).into_par_iter().map(of_sample).collect())
}

/// The most influential, the largest first; none where the tip does not follow from anything that is learned.
pub fn most_influential(all: &[Influence], count: usize) -> Vec<Influence> {
    let moving: Vec<Influence> = all.iter().filter(|one| one.tip.is_some()).copied().collect();
    // What nothing can replace is the most influential of all.
    largest(&moving, count, |one| one.tip.unwrap_or(0.0))
}

/// The worst-fitting, the largest error first.
pub fn worst_fitting(all: &[Influence], count: usize) -> Vec<Influence> {
    largest(all, count, |one| one.misfit)
}

fn largest(all: &[Influence], count: usize, by: impl Fn(&Influence) -> f64) -> Vec<Influence> {
    let mut sorted = all.to_vec();
    sorted.sort_by(|a, b| by(b).total_cmp(&by(a)).then(a.sample.cmp(&b.sample)));
    sorted.truncate(count);
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::graph::Priors;
    use crate::calibrate::setup::Setup;
    use crate::calibrate::{Fitted, Progress, fit};
    use crate::recording::Recording;
    use crate::rig::{Noise, PoseNoise, Rig};
    use crate::simulate::{SimulateOptions, random_rig, simulate};
    use handeye_solvers::GaussNewton;
    use std::ops::ControlFlow;

    /// The same by building the graph without the sample's detections, and solving that.
    fn solved_without(
        stages: &Stages<'_>,
        last: &Stage<'_>,
        state: &State,
        verdict: &Verdict,
        sample: usize,
    ) -> Option<f64> {
        let setup = stages.setup;
        let freedom = gauge::with_frames_held(setup, last.freedom);
        let takes_part = |index: usize| verdict.active[index] && setup.observations[index].sample != sample;
        let mut built = build(setup, state, &freedom, stages.priors, last.loss, takes_part);
        let step = GaussNewton { max_iterations: 1, halvings: 0, ..GaussNewton::default() };
        step.minimize(&mut built.graph).ok()?;
        let mut without = state.clone();
        built.read(&mut without);
        let tips = |model: &Model| -> Vec<Vector3<f64>> {
            state.joints.iter().map(|joints| model.tip(joints).translation).collect()
        };
        let (after, before) = (tips(&without.model), tips(&state.model));
        let square: f64 = after.iter().zip(&before).map(|(a, b)| (a - b).norm_squared()).sum();
        Some((square / before.len() as f64).sqrt())
    }

    /// A rig whose cameras are held, seen with some noise, and its recording.
    fn recorded(seed: u64, options: SimulateOptions, noise: impl Fn(&mut Noise)) -> (Rig, Recording) {
        let mut rig = random_rig(6, 2, 12, seed);
        noise(&mut rig.noise);
        let recording = simulate(&rig, &SimulateOptions { seed, ..options }).unwrap().recording;
        let fixed = ["robot.base", "cameras", "robot.joints.j1.offset", "robot.joints.j1.d", "robot.joints.j6"];
        rig.estimate.fixed = fixed.map(str::to_owned).into();
        (rig, recording)
    }

    /// Checks every sample at the optimum and beside it, and returns what leaving it out does at the optimum.
    fn agree(rig: &Rig, recording: &Recording, what: &str) -> Vec<f64> {
        let setup = Setup::new(rig, recording).unwrap();
        let priors = Priors::new(&setup);
        let mut observer = |_: &Progress<'_>| ControlFlow::Continue(());
        let mut stages = Stages::new(&setup, &priors, crate::calibrate::Options::default().iterations, &mut observer);
        let Fitted { mut state, freedom, verdict, loss, .. } = fit(&mut stages, None, 1).unwrap();
        let takes_part = |index: usize| verdict.active[index];
        let last = Stage { name: "last", freedom: &freedom, loss, takes_part: &takes_part };
        let check = |state: &State| {
            let found = tip_motions(&stages, &last, state, &verdict).unwrap();
            for (sample, found) in found.iter().enumerate().filter(|(_, found)| found.is_finite()) {
                let solved = solved_without(&stages, &last, state, &verdict, sample).unwrap();
                assert!((found / solved - 1.0).abs() < 1e-6, "{what}: sample {sample}: {found} and {solved}");
            }
            found
        };
        let found = check(&state);
        state.model.base.translation.x += 1e-4;
        state.model.parameters.iter_mut().enumerate().for_each(|(i, number)| *number += 1e-5 * (i as f64).sin());
        state.joints.iter_mut().flatten().enumerate().for_each(|(i, joint)| *joint += 1e-5 * (i as f64).cos());
        check(&state);
        found
    }

    #[test]
    fn one_factorisation_tells_what_solving_without_each_sample_does() {
        let some = |samples: usize| SimulateOptions { samples, ..SimulateOptions::default() };
        let spoilt = SimulateOptions { samples: 25, missed: 0.3, outliers: 0.05, ..SimulateOptions::default() };
        let pose = PoseNoise { xyz: 0.002, rot: 0.002 };
        let mut found = Vec::new();
        let mut compare = |what: &str, (rig, recording): (Rig, Recording)| found.extend(agree(&rig, &recording, what));
        compare("exact joints", recorded(1, some(20), |_| {}));
        compare("exact joints, missed and wrong detections", recorded(2, spoilt, |_| {}));
        compare("noisy joints", recorded(3, some(20), |noise| noise.joints = 0.002));
        compare(
            "noisy joints and tip poses",
            recorded(4, some(20), |noise| (noise.joints, noise.pose) = (0.002, pose)),
        );
        compare("tip poses beside exact joints", recorded(5, some(20), |noise| noise.pose = pose));
        compare(
            "joint actions too",
            recorded(6, some(20), |noise| (noise.joints, noise.joint_action) = (0.002, 0.001)),
        );
        let points = |noise: &mut Noise| (noise.points, noise.joints) = (0.001, 0.002);
        compare("noisy joints and points", recorded(7, some(20), points));
        let (rig, mut recording) = recorded(8, some(30), |noise| (noise.joints, noise.joint_action) = (0.002, 0.001));
        recording.samples.iter_mut().skip(1).step_by(3).for_each(|sample| sample.joints = None);
        compare("joints that are not always read", (rig, recording));
        let (rig, recording) = recorded(9, some(40), |noise| (noise.joints, noise.pose) = (0.001, pose));
        compare("an unknown chain and tip poses", (Rig { noise: rig.noise, ..Rig::default() }, recording));
        assert!(found.iter().all(|motion| motion.is_finite() && *motion > 0.0), "{found:?}");
    }

    #[test]
    fn a_feature_that_the_others_do_not_determine_makes_a_sample_indispensable() {
        let (mut rig, mut recording) =
            recorded(10, SimulateOptions { samples: 20, ..SimulateOptions::default() }, |_| {});
        // Of one feature nothing is known, and one camera sees it in two samples; of another, both do in one.
        let [twice, once] = [11, 10];
        for feature in [twice, once] {
            rig.features[feature].xyz = None;
        }
        for (number, sample) in recording.samples.iter_mut().enumerate() {
            sample.pixels.retain(|seen| match seen.feature as usize {
                feature if feature == twice => seen.camera == 0 && (number == 3 || number == 12),
                feature if feature == once => number == 7,
                _ => true,
            });
        }
        let counts = |feature: usize| {
            recording.samples.iter().flat_map(|s| &s.pixels).filter(|seen| seen.feature as usize == feature).count()
        };
        assert_eq!((counts(twice), counts(once)), (2, 2));
        let found = agree(&rig, &recording, "features seen rarely");
        let infinite: Vec<usize> = (0..20).filter(|&sample| found[sample].is_infinite()).collect();
        // Without the sample that alone sees a feature, there is no such feature to determine.
        assert_eq!(infinite, [3, 12], "{found:?}");
    }
}
