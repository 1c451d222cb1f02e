//! Watches samples one after the other.
use super::blocks::{FIT_STEPS, Problem, SAME, causes, explain, images, zero_of};
use super::null::{Null, WINDOW, window_p_value};
use super::seen::{Names, Seen};
use super::{Cause, Change, Event, MonitorOptions};
use crate::Error;
use crate::chain::LINK_PARAMETERS;
use crate::recording::{Recording, Sample};
use crate::rig::{Model, Parent, Rig};
use handeye_solvers::Loss;
use std::collections::VecDeque;

/// Steps of a follower and looks at the gradient are this many samples apart.
const LOOK: usize = 10;

/// Changed samples that are waited for, as a multiple of those that it is relearned from, before the wait is given up.
const PATIENCE: usize = 4;

/// A rig that is watched, and kept up with.
#[derive(Clone, Debug)]
pub struct Monitor {
    rig: Rig,
    model: Model,
    names: Names,
    options: MonitorOptions,
    null: Null,
    /// Samples of the rig as it is, oldest first.
    buffer: VecDeque<Seen>,
    /// The last few samples, not yet known to be unchanged: number, p value, sample.
    recent: VecDeque<(usize, f64, Seen)>,
    /// A change that is being relearned, and the samples since.
    pending: Option<(Cause, Vec<Seen>)>,
    usual_norm: Option<f64>,
    n_observed: usize,
    since_look: usize,
}

impl Monitor {
    /// Watches a complete rig. `header`: its names of cameras and features are what the samples refer to; its samples do not matter.
    ///
    /// Errors: [`Error::Unusable`] where the rig is not complete, has no joints or another number than the header, or an
    /// option is out of range.
    pub fn new(rig: &Rig, header: &Recording, options: MonitorOptions) -> Result<Monitor, Error> {
        let model = Model::new(rig)?;
        let n_joints = model.chain.len();
        let unusable = |problem: String| Err(Error::Unusable(problem));
        if n_joints == 0 {
            return unusable("the rig has no joints: a monitor predicts from joints".to_owned());
        }
        if n_joints != header.joints.len() {
            return unusable(format!("the rig has {n_joints} joints, the recording {}", header.joints.len()));
        }
        if !(options.false_alarm_rate > 0.0 && options.false_alarm_rate < 1.0) {
            return unusable(format!("a false-alarm rate of {}: it is in (0, 1)", options.false_alarm_rate));
        }
        if options.buffer == 0
            || options.relearn_samples < 2
            || options.follow_ratio.is_nan()
            || options.follow_ratio <= 1.0
        {
            return unusable(
                "a monitor needs a buffer, 2 samples to relearn from and a follow ratio above 1".to_owned(),
            );
        }
        let learned = rig.fit.as_ref().map(|fit| fit.rms_px / 2.0_f64.sqrt());
        let sigma = learned.filter(|sigma| *sigma > 0.0 && sigma.is_finite()).unwrap_or(rig.noise.pixels);
        Ok(Monitor {
            rig: rig.clone(),
            names: Names::new(rig, header),
            model,
            options,
            null: Null::new(sigma),
            buffer: VecDeque::new(),
            recent: VecDeque::new(),
            pending: None,
            usual_norm: None,
            n_observed: 0,
            since_look: 0,
        })
    }

    /// Takes the next sample. Its indices are those of the header's cameras and features; one that is unusable changes nothing.
    pub fn observe(&mut self, sample: &Sample) -> Event {
        let number = self.n_observed;
        self.n_observed += 1;
        let Some(seen) = self.names.look(sample, self.model.chain.len()) else { return Event::Skipped };
        if let Some((cause, mut samples)) = self.pending.take() {
            samples.push(seen);
            return self.relearn(cause, samples);
        }
        let images = images(&self.model, &seen, self.rig.noise.joints);
        if !Null::can_judge(&images) {
            return Event::Skipped;
        }
        let p = self.null.p_value(&images);
        self.recent.push_back((number, p, seen));
        let p_values: Vec<f64> = self.recent.iter().map(|(_, p, _)| *p).collect();
        let p_value = window_p_value(&p_values);
        if p_value < self.options.false_alarm_rate {
            return self.alarm(p_value);
        }
        self.null.learn(&images, self.options.burn_in);
        if self.recent.len() == WINDOW {
            let settled = self.recent.pop_front();
            settled.into_iter().for_each(|(_, _, seen)| self.keep(seen));
        }
        self.follow()
    }

    /// The rig, with what has been relearned and followed.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// What moved and has not been relearned yet: predictions that depend on it are not to be relied on.
    pub fn left_out(&self) -> Option<&Cause> {
        self.pending.as_ref().map(|(cause, _)| cause)
    }

    /// Norm of the gradient of the mean squared pixel distance over the buffer, by all parameters of the rig
    /// [px²/(rad, m, px)]: table 7 of the paper.
    pub fn gradient_norm(&self) -> f64 {
        Problem::new(&self.model, self.buffer.iter(), self.null.sigma(), Loss::Squared)
            .gradient_norm(&self.rig, self.null.sigma())
    }

    /// The change began at the first sample of the window that is improbable.
    fn alarm(&mut self, p_value: f64) -> Event {
        let limit = self.second_least_p();
        let first = self.recent.iter().position(|(_, p, _)| *p <= limit).unwrap_or(0);
        let since = self.recent[first].0;
        let recent = std::mem::take(&mut self.recent);
        let mut samples = Vec::new();
        for (index, (_, _, seen)) in recent.into_iter().enumerate() {
            if index < first { self.keep(seen) } else { samples.push(seen) }
        }
        let (scores, _) = explain(&self.model, &samples, self.null.sigma(), self.null.median());
        let cause = scores[0].cause;
        self.pending = Some((cause, samples));
        Event::Changed(Change { since, cause, p_value, scores })
    }

    fn second_least_p(&self) -> f64 {
        let mut sorted: Vec<f64> = self.recent.iter().map(|(_, p, _)| *p).collect();
        sorted.sort_by(f64::total_cmp);
        sorted.get(1).copied().unwrap_or(1.0)
    }

    /// Learns again what moved, once enough samples show it. The cause is judged again, by all of them.
    fn relearn(&mut self, cause: Cause, samples: Vec<Seen>) -> Event {
        let needed = self.options.relearn_samples;
        let shows = |seen: &&Seen| match cause {
            Cause::Camera(camera) => seen.detections.iter().any(|spot| spot.camera == camera),
            _ => true,
        };
        if samples.iter().filter(shows).count() < needed && samples.len() < PATIENCE * needed {
            self.pending = Some((cause, samples));
            return Event::Unchanged;
        }
        let (scores, model) = explain(&self.model, &samples, self.null.sigma(), self.null.median());
        let cause = scores[0].cause;
        if cause == Cause::Unexplained {
            // Nothing to be learned: what is seen goes on being compared with the rig as it was.
            return Event::Unchanged;
        }
        self.take(&cause, model);
        let samples_used = samples.len();
        self.buffer = samples.into();
        while self.buffer.len() > self.options.buffer {
            self.buffer.pop_front();
        }
        (self.since_look, self.usual_norm) = (0, None);
        Event::Relearned { cause, samples: samples_used, rig: Box::new(self.rig.clone()) }
    }

    /// One damped step of the part that explains the buffer best, where the gradient says that something drifts and a part that moved
    /// explains the buffer better than none.
    fn follow(&mut self) -> Event {
        self.since_look += 1;
        if self.buffer.len() < self.options.buffer || self.since_look < LOOK {
            return Event::Unchanged;
        }
        self.since_look = 0;
        let norm = self.gradient_norm();
        let usual = *self.usual_norm.get_or_insert(norm);
        if norm < self.options.follow_ratio * usual {
            return Event::Unchanged;
        }
        let fitted = |cause: &Cause, steps: usize| {
            let mut model = self.model.clone();
            let mut problem = Problem::new(&model, self.buffer.iter(), self.null.sigma(), Loss::Cauchy(3.0));
            problem.fit(cause, steps, &mut model).map(|loss| (loss, model))
        };
        let n = self.buffer.iter().map(|seen| 2 * seen.detections.len()).sum::<usize>() as f64;
        let Ok((unmoved, _)) = fitted(&Cause::Unexplained, 0) else { return Event::Unchanged };
        // Which part it is, by Akaike's criterion: with Schwarz's a joint of one freedom would stand in for a camera of six that moved little.
        // That one is, by Schwarz's.
        let mut best = (f64::INFINITY, f64::INFINITY, Cause::Unexplained);
        for cause in causes(&self.model) {
            let Ok((loss, _)) = fitted(&cause, FIT_STEPS) else { continue };
            let aic = loss + 2.0 * cause.freedom();
            if aic < best.0 - SAME {
                best = (aic, loss + cause.freedom() * n.ln(), cause);
            }
        }
        let (_, bic, cause) = best;
        if bic.is_nan() || bic >= unmoved {
            return Event::Unchanged;
        }
        let Ok((_, model)) = fitted(&cause, 1) else { return Event::Unchanged };
        self.take(&cause, model);
        Event::Followed { cause, gradient_norm: norm }
    }

    fn keep(&mut self, seen: Seen) {
        self.buffer.push_back(seen);
        if self.buffer.len() > self.options.buffer {
            self.buffer.pop_front();
        }
    }

    /// The rig with the part that moved as the model has it. Its standard deviations are no longer those of the fit.
    fn take(&mut self, cause: &Cause, model: Model) {
        let rig = &mut self.rig;
        let stale: Vec<String> = match *cause {
            Cause::Camera(camera) => {
                rig.cameras[camera].pose = Some(model.cameras[camera].pose);
                vec![format!("cameras.{}.pose", rig.cameras[camera].name)]
            }
            Cause::Structure => {
                let moved = rig.features.iter_mut().zip(&model.features);
                let on_tip = moved.filter(|(feature, _)| feature.parent == Parent::Tip);
                on_tip
                    .map(|(feature, moved)| {
                        feature.xyz = Some(moved.xyz.into());
                        format!("features.{}.", feature.name)
                    })
                    .collect()
            }
            Cause::Base => {
                rig.robot.base = Some(model.base);
                vec!["robot.base".to_owned()]
            }
            Cause::Joint(joint) => {
                let index = zero_of(&model, joint);
                let row = &mut rig.robot.joints[joint];
                let is_offset = index == LINK_PARAMETERS * joint;
                let slot = if is_offset { &mut row.offset } else { &mut row.d };
                *slot = Some(model.parameters[index]);
                vec![format!("robot.joints.{}.{}", row.name, if is_offset { "offset" } else { "d" })]
            }
            Cause::Unexplained => return,
        };
        if let Some(fit) = &mut rig.fit {
            fit.sd.retain(|path, _| !stale.iter().any(|stale| path.starts_with(stale)));
        }
        self.model = model;
    }
}
