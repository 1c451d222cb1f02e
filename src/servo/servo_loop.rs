//! A closed loop around a controller: what to do with each measurement, and when and why to stop.
use super::controller::{Controller, Decision, Measurement, mean_distance};
use super::{Active, Bound, Constraint, Limit, Stop};
use crate::Error;
use crate::infer::{PointSighting, Sighting};
use crate::recording::Command;
use std::collections::VecDeque;

/// When a loop moves, and when it stops. Everything may change between ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopSettings {
    /// Error below which the features are where they shall be [px]: see [`Stop`].
    pub tolerance_px: f64,
    /// Measurements in a row that have to be within the tolerance.
    pub settled: usize,
    /// Measurements over which the error has to fall, from the median of the older half to that of the newer by 1 % and by two standard
    /// errors: else limits block the loop, or noise keeps it from doing better. As many as a motion to the goal takes at most; a loop of
    /// 1 kHz wants hundreds. Fewer than 4 never stop the loop.
    pub window: usize,
    /// The loop has diverged where the error is this many times that of the beginning, in two measurements in a row; of a target that is
    /// followed, that of the beginning and all the way that the target has gone since.
    pub diverged: f64,
    /// After this the loop stops [s].
    pub timeout: f64,
    /// Nothing moves on measurements that are older [s].
    pub watchdog: f64,
    /// The loop is lost where no measurement was of use for this long [s].
    pub patience: f64,
    /// Waits for a measurement from after the last motion before the next one. Without it, a loop moves at every tick, and what has
    /// not been seen yet is commanded twice.
    pub look_then_move: bool,
    /// The target moves: arriving does not end the loop.
    pub follow: bool,
}

impl Default for LoopSettings {
    /// Within half a pixel twice, a window of 10, a minute, and a watchdog of 0.5 s.
    fn default() -> Self {
        LoopSettings {
            tolerance_px: 0.5,
            settled: 2,
            window: 10,
            diverged: 3.0,
            timeout: 60.0,
            watchdog: 0.5,
            patience: 5.0,
            look_then_move: true,
            follow: false,
        }
    }
}

/// What a loop does with a measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// What the robot shall do; [`Command::Hold`] where the loop waits or stops.
    pub command: Command,
    /// The error that the controller judges [px], see [`Stop`]; `None` where nothing is seen of what is aimed at.
    pub error_px: Option<f64>,
    /// What holds the motion back.
    pub active: Vec<Active>,
    /// Constraints that cannot all hold, where a limit gave way; see [`super::Step::conflict`].
    pub conflict: Vec<Constraint>,
    /// Why the robot is held, while the loop goes on.
    pub waits: Option<String>,
    /// Why the loop has stopped. From then on every tick gives the same.
    pub stop: Option<Stop>,
}

/// A loop: the caller measures and moves, the loop says how and until when.
pub struct ServoLoop<C> {
    /// What turns measurements into commands.
    pub controller: C,
    /// May change between ticks.
    pub settings: LoopSettings,
    goal: Vec<Sighting>,
    /// What the controller does not believe.
    left_out: Vec<(usize, usize)>,
    began: Option<f64>,
    /// Time of the last measurement that was of use, and until when the last command moves the robot [s].
    useful: f64,
    moves_until: f64,
    /// What the error may be without the loop having led away [px]: that of the beginning, and as far as a followed target has gone since.
    baseline_px: Option<f64>,
    /// Time of the last measurement that was judged [s].
    judged: f64,
    /// The newest errors, and how many of them in a row are settled or beyond use.
    errors: VecDeque<f64>,
    n_settled: usize,
    n_diverged: usize,
    /// Commands in a row that something held back.
    n_held_back: usize,
    /// Whether the controller has been asked since the loop began, and what it decided last was to explore.
    has_decided: bool,
    explores: bool,
    stop: Option<Stop>,
}

/// Least fall of the error over half a window, as a share of it.
const LEAST_FALL: f64 = 0.01;

impl<C: Controller> ServoLoop<C> {
    /// A loop that has no goal yet.
    pub fn new(controller: C, settings: LoopSettings) -> Self {
        ServoLoop {
            controller,
            settings,
            goal: Vec::new(),
            left_out: Vec::new(),
            began: None,
            useful: 0.0,
            moves_until: f64::NEG_INFINITY,
            baseline_px: None,
            judged: f64::NEG_INFINITY,
            errors: VecDeque::new(),
            n_settled: 0,
            n_diverged: 0,
            n_held_back: 0,
            has_decided: false,
            explores: false,
            stop: None,
        }
    }

    /// Sets where features shall be seen. May be called before every tick for a target that moves; begins anew where the loop had
    /// stopped.
    pub fn aim(&mut self, goal: &[Sighting]) {
        if self.goal == goal {
            return;
        }
        let moved = mean_distance(goal, &self.goal, &self.left_out).unwrap_or(0.0);
        self.goal = goal.to_vec();
        self.controller.aim(goal);
        self.errors.clear();
        (self.n_settled, self.n_held_back) = (0, 0);
        let has_stopped = self.stop.take().is_some();
        if has_stopped {
            (self.began, self.has_decided, self.explores) = (None, false, false);
        }
        if self.settings.follow && !has_stopped {
            self.baseline_px = self.baseline_px.map(|baseline| baseline + moved);
        } else {
            (self.baseline_px, self.n_diverged) = (None, 0);
        }
    }

    /// What to do now, at `now` [s] of the clock by which measurements are dated, for the next `dt` seconds.
    ///
    /// Errors: those of the controller that no later measurement mends.
    pub fn tick(
        &mut self,
        now: f64,
        measurement: &Measurement<'_>,
        limits: &[&dyn Limit],
        dt: f64,
    ) -> Result<Tick, Error> {
        let began = *self.began.get_or_insert_with(|| {
            self.useful = now;
            now
        });
        let seen: Vec<Sighting> = measurement
            .seen
            .iter()
            .filter(|seen| seen.pixel.iter().all(|number| number.is_finite()))
            .copied()
            .collect();
        let is_point = |seen: &&PointSighting| seen.point.iter().all(|number| number.is_finite());
        let points: Vec<PointSighting> = measurement.points.iter().filter(is_point).copied().collect();
        let readable = if measurement.joints.iter().all(|joint| joint.is_finite()) { measurement.joints } else { &[] };
        let usable = Measurement { time: measurement.time, joints: readable, seen: &seen, points: &points };
        let error_px = self.controller.error_px(&usable, &self.goal, &self.left_out);
        let elapsed = now - began;
        if self.stop.is_none() && (elapsed.is_nan() || elapsed >= self.settings.timeout) {
            self.stop = Some(Stop::TimedOut { error_px, seconds: elapsed });
        }
        if self.stop.is_some() {
            return Ok(self.hold(error_px, None));
        }
        let age = now - measurement.time;
        if age.is_nan() || age > self.settings.watchdog {
            return Ok(self.wait(now, error_px, format!("what was measured is {age:.3} s old")));
        }
        if self.settings.look_then_move && measurement.time < self.moves_until - 1e-9 * now.abs() {
            return Ok(self.hold(error_px, Some("what was measured is from before the last motion ended".to_owned())));
        }
        let Some(error) = error_px else {
            return Ok(self.wait(now, None, "nothing is seen of what is aimed at".to_owned()));
        };
        if readable.len() < measurement.joints.len() && self.controller.reads_joints() {
            return Ok(self.wait(now, error_px, "the joints are not read, or not as numbers".to_owned()));
        }
        // A measurement that is seen twice tells nothing the second time.
        let is_new = measurement.time > self.judged;
        if is_new {
            self.judged = measurement.time;
            self.judge(error);
        }
        if self.stop.is_some() {
            return Ok(self.hold(error_px, None));
        }
        if self.n_settled > 0 && !self.has_decided {
            // It is there before anything has moved: what would have to be explored first would lead away.
            self.useful = now;
            return Ok(self.hold(error_px, None));
        }
        let decision = match self.controller.decide(&usable, limits, dt) {
            Ok(decision) if decision.command.is_finite() => decision,
            Ok(_) => return Ok(self.wait(now, error_px, "the motion would not have been finite".to_owned())),
            Err(Error::NotEnoughData(why)) => return Ok(self.wait(now, error_px, why)),
            Err(error) => return Err(error),
        };
        self.useful = now;
        (self.has_decided, self.explores) = (true, decision.explores);
        self.n_held_back = if decision.active.is_empty() { 0 } else { self.n_held_back + 1 };
        if decision.explores || decision.left_out != self.left_out {
            self.errors.clear();
        }
        self.left_out.clone_from(&decision.left_out);
        if is_new || decision.stop.is_some() {
            self.stop = decision.stop.clone().or_else(|| self.no_more(error, &decision));
            if self.stop.is_some() {
                return Ok(Tick { active: decision.active, conflict: decision.conflict, ..self.hold(error_px, None) });
            }
        }
        self.moves_until = now + dt;
        let Decision { command, active, conflict, .. } = decision;
        Ok(Tick { command, error_px, active, conflict, waits: None, stop: None })
    }

    /// Whether the error alone says that the loop is to stop.
    fn judge(&mut self, error: f64) {
        let settings = &self.settings;
        // How far a target has gone that nobody aims at, but the controller sees itself, is not known here.
        let unknown = settings.follow && self.goal.is_empty();
        let baseline = *self.baseline_px.get_or_insert(if unknown { f64::INFINITY } else { error });
        let in_a_row = |so_far: usize, again: bool| if again { so_far + 1 } else { 0 };
        self.n_settled = in_a_row(self.n_settled, error <= settings.tolerance_px);
        // A motion to learn from leads away for as long as it takes.
        let has_diverged = !self.explores && error > settings.diverged * baseline.max(settings.tolerance_px);
        self.n_diverged = in_a_row(self.n_diverged, has_diverged);
        if self.n_diverged >= 2 {
            self.stop = Some(Stop::Diverged { from_px: baseline, error_px: error });
        } else if self.n_settled >= settings.settled.max(1) && !settings.follow {
            self.stop = Some(Stop::Converged { error_px: error });
        }
    }

    /// Why the loop is to stop where the errors that commands led to fall no more.
    fn no_more(&mut self, error: f64, decision: &Decision) -> Option<Stop> {
        let settings = &self.settings;
        self.errors.push_back(error);
        while self.errors.len() > settings.window.max(1) {
            self.errors.pop_front();
        }
        if decision.explores || settings.window < 4 || self.errors.len() < settings.window || settings.follow {
            return None;
        }
        let [error_px, sd_px] = steady(&self.errors)?;
        // Nothing else holds the arm where every motion of the window was held back.
        if self.n_held_back < settings.window {
            return Some(Stop::NoBetter { error_px, sd_px });
        }
        let (by, conflict) = (blocking(&decision.active), decision.conflict.clone());
        Some(Stop::Blocked { error_px: error, by, conflict })
    }

    /// Holds the robot; where that has gone on for too long, for good.
    fn wait(&mut self, now: f64, error_px: Option<f64>, why: String) -> Tick {
        let seconds = now - self.useful;
        if seconds >= self.settings.patience {
            self.stop = Some(Stop::Lost { why, seconds });
            return self.hold(error_px, None);
        }
        self.hold(error_px, Some(why))
    }

    fn hold(&mut self, error_px: Option<f64>, waits: Option<String>) -> Tick {
        self.controller.held();
        let (active, conflict) = (Vec::new(), Vec::new());
        Tick { command: Command::Hold, error_px, active, conflict, waits, stop: self.stop.clone() }
    }
}

/// Those that block and do not merely slow down, where there are any.
fn blocking(held_back: &[Active]) -> Vec<Active> {
    let slows = |active: &Active| {
        matches!(active.constraint, Constraint::Joint { bound: Bound::Velocity | Bound::Acceleration, .. })
    };
    let blocking: Vec<Active> = held_back.iter().filter(|active| !slows(active)).copied().collect();
    if blocking.is_empty() { held_back.to_vec() } else { blocking }
}

/// Mean and standard deviation of the newer half of the errors, where they fall no more.
fn steady(errors: &VecDeque<f64>) -> Option<[f64; 2]> {
    let half = errors.len() / 2;
    let mut older: Vec<f64> = errors.iter().take(half).copied().collect();
    let mut newer: Vec<f64> = errors.iter().skip(half).copied().collect();
    let n = newer.len() as f64;
    let mean = newer.iter().sum::<f64>() / n;
    let sd = (newer.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let median = |list: &mut Vec<f64>| {
        list.sort_by(f64::total_cmp);
        list[list.len() / 2]
    };
    let (before, after) = (median(&mut older), median(&mut newer));
    // The variance of a median of Gaussian numbers is π/2 that of their mean.
    let of_difference = sd * (std::f64::consts::PI / n).sqrt();
    let falls = before - after > 2.0 * of_difference && before - after > LEAST_FALL * before;
    (!falls).then_some([mean, sd])
}
