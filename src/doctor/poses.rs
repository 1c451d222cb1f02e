//! Robot and targets as two motions: which reading of them agrees with a rigid camera and a rigid target (a X = Z b).
use super::undo;
use super::{About, Finding, Misfit, OtherTips, Score, is_clearly_better};
use crate::calibrate::median;
use crate::geometry::robot_world;
use crate::recording::Recording;
use crate::rig::{Parent, Rig};
use handeye_solvers::Pose;
use std::collections::BTreeMap;

/// The name of an alternative that two others cannot be told from by the misfit.
const INVERTED: &str = "robot poses are inverted";

/// Fewest pairs that say anything.
const FEWEST: usize = 8;

/// Rounds of the closed form without the quarter that fits worst, so that wrong detections do not choose.
const ROUNDS: usize = 4;

/// A pair is wrong from this many medians on, and its mistake is explained where the misfit falls to this share.
const WRONG: f64 = 8.0;
const EXPLAINED: f64 = 0.25;

/// Most wrong pairs among which swapped ones are looked for.
const MOST_SWAPPED: usize = 40;

/// Robot and target of the camera and target that were seen together most.
pub(super) struct Pairs {
    /// Index of each sample in the recording.
    samples: Vec<usize>,
    /// `world_from_tip`.
    robot: Vec<Pose>,
    /// `camera_from_target`.
    target: Vec<Pose>,
    on_hand: bool,
    camera: String,
}

/// The closed form and what it leaves.
struct Fit {
    x: Pose,
    z: Pose,
    misfit: Misfit,
    each: Vec<Misfit>,
}

/// One reading of the pairs.
struct Reading {
    about: About,
    name: String,
    change: String,
    robot: Vec<Pose>,
    target: Vec<Pose>,
    on_hand: bool,
}

impl Pairs {
    /// `tips`: `world_from_tip` of each sample of the recording, where it is known.
    pub fn new(rig: &Rig, recording: &Recording, tips: &[Option<Pose>]) -> Option<Pairs> {
        let mut counts = BTreeMap::<(u32, &str), usize>::new();
        for (sample, _) in recording.samples.iter().zip(tips).filter(|(_, tip)| tip.is_some()) {
            sample.targets.iter().for_each(|seen| *counts.entry((seen.camera, &seen.target)).or_default() += 1);
        }
        let (&(camera, target), _) = counts.iter().max_by_key(|(pair, count)| (**count, std::cmp::Reverse(**pair)))?;
        let name = recording.cameras.get(camera as usize)?.name.clone();
        let on_hand = rig.cameras.iter().any(|camera| camera.name == name && camera.parent != Parent::World);
        let mut pairs = Pairs { samples: vec![], robot: vec![], target: vec![], on_hand, camera: name };
        for (index, (sample, tip)) in recording.samples.iter().zip(tips).enumerate() {
            let seen = sample.targets.iter().find(|seen| seen.camera == camera && seen.target == target);
            if let (Some(tip), Some(seen)) = (tip, seen) {
                pairs.samples.push(index);
                pairs.robot.push(*tip);
                pairs.target.push(seen.pose);
            }
        }
        (pairs.samples.len() >= FEWEST).then_some(pairs)
    }

    /// Scores every reading of the pairs. `other_tips`: tips from joints that are read otherwise, where joints are what is known.
    pub fn examine(&self, other_tips: &[OtherTips], scores: &mut Vec<Score>, findings: &mut Vec<Finding>) {
        let reading = |about: About, name: &str, change: &str| Reading {
            about,
            name: name.to_owned(),
            change: change.to_owned(),
            robot: self.robot.clone(),
            target: self.target.clone(),
            on_hand: self.on_hand,
        };
        let recorded = reading(About::Order, "as recorded", "").fit();
        let as_recorded = recorded.as_ref().map(|fit| fit.misfit);
        scores.push(Score { alternative: "as recorded".into(), misfit: as_recorded });
        let mut best: Option<(Misfit, Reading, Fit)> = None;
        for alternative in self.alternatives(other_tips, &reading) {
            let fit = alternative.fit();
            // The three obey one equation.
            let others = ["target poses are inverted", "the camera is on the other side of the robot"];
            let others = if alternative.name == INVERTED { &others[..] } else { &[] };
            for name in [alternative.name.as_str()].iter().chain(others) {
                scores.push(Score { alternative: (*name).to_owned(), misfit: fit.as_ref().map(|fit| fit.misfit) });
            }
            let Some(fit) = fit else { continue };
            if is_clearly_better(Some(fit.misfit), as_recorded)
                && best.as_ref().is_none_or(|(least, ..)| fit.misfit.size() < least.size() * (1.0 - 1e-6))
            {
                best = Some((fit.misfit, alternative, fit));
            }
        }
        if let Some((_, alternative, fit)) = best {
            findings.push(self.told_apart(alternative, &fit));
        } else if let Some(fit) = recorded {
            findings.extend(self.swapped(&fit));
        }
    }

    fn alternatives(&self, other_tips: &[OtherTips], reading: &impl Fn(About, &str, &str) -> Reading) -> Vec<Reading> {
        let mut all = Vec::new();
        for (about, name, change, undo) in undo::OF_POSES {
            let robot = self.robot.iter().map(undo).collect();
            all.push(Reading { robot, ..reading(about, &format!("robot poses are {name}"), change) });
        }
        for (about, name, change, undo) in undo::OF_POSES.into_iter().skip(1) {
            let target = self.target.iter().map(undo).collect();
            all.push(Reading { target, ..reading(about, &format!("target poses are {name}"), change) });
        }
        for (about, name, change, tips) in other_tips {
            let robot = self.samples.iter().map(|sample| tips[*sample].unwrap_or_else(Pose::identity)).collect();
            all.push(Reading { robot, ..reading(*about, name, change) });
        }
        for (name, change, rows) in undo::pairings("robot poses", self.samples.len()) {
            let of = |poses: &[Pose], index: &dyn Fn(usize) -> Option<usize>| -> Vec<Pose> {
                (0..rows.len()).filter(|i| rows[*i].is_some()).filter_map(|i| Some(poses[index(i)?])).collect()
            };
            let (robot, target) = (of(&self.robot, &|i| rows[i]), of(&self.target, &|i| Some(i)));
            all.push(Reading { robot, target, ..reading(About::Order, &name, &change) });
        }
        all
    }

    /// Inverted robot poses, inverted target poses and a camera on the other side of the robot obey the same equation. A camera
    /// sees what is in front of it, and what is mounted on the tip is nearer to it than the rest of the world to the base.
    fn told_apart(&self, found: Reading, fit: &Fit) -> Finding {
        let Reading { about, name, change, .. } = found;
        if name != INVERTED {
            return Finding { about, what: name, change };
        }
        let off_axis = |poses: &mut dyn Iterator<Item = Pose>| {
            median(&mut poses.map(|pose| pose.translation.xy().norm().atan2(pose.translation.z)).collect::<Vec<_>>())
        };
        let as_given = off_axis(&mut self.target.iter().copied());
        let inverted = off_axis(&mut self.target.iter().map(Pose::inverse));
        // With the poses of the robot inverted, X is on the tip and Z in the world; with the camera elsewhere, the reverse.
        let (on_tip, in_world) = (fit.x.translation.norm(), fit.z.translation.norm());
        if inverted < as_given {
            return Finding {
                about,
                what: "target poses are inverted".into(),
                change: "write the inverse of each".into(),
            };
        }
        if on_tip <= in_world {
            return Finding { about, what: name, change };
        }
        let (is, should) = if self.on_hand { ("on the tip", "world") } else { ("in the world", "tip") };
        let camera = &self.camera;
        let what = format!("camera {camera} is declared {is} and moves as if it were not");
        Finding { about, what, change: format!("set its parent to \"{should}\"") }
    }

    /// Two samples, each of whose robot poses fits the other's image.
    fn swapped(&self, fit: &Fit) -> Vec<Finding> {
        let limit = WRONG * fit.misfit.size();
        let wrong: Vec<usize> =
            (0..self.samples.len()).filter(|i| fit.each[*i].size() > limit).take(MOST_SWAPPED).collect();
        let misfit = |row: usize, image: usize| {
            misfit(&fit.x, &fit.z, &self.robot[row], &seen(&self.target[image], self.on_hand)).size()
        };
        let mut findings = Vec::new();
        for (k, &i) in wrong.iter().enumerate() {
            for &j in &wrong[k + 1..] {
                if misfit(i, j) < EXPLAINED * misfit(i, i) && misfit(j, i) < EXPLAINED * misfit(j, j) {
                    findings.push(Finding {
                        about: About::Order,
                        what: format!(
                            "the robot poses of samples {} and {} are swapped",
                            self.samples[i], self.samples[j]
                        ),
                        change: "exchange the robot poses of the two samples".into(),
                    });
                }
            }
        }
        findings
    }
}

/// b of a X = Z b.
fn seen(target: &Pose, on_hand: bool) -> Pose {
    if on_hand { target.inverse() } else { *target }
}

fn misfit(x: &Pose, z: &Pose, a: &Pose, b: &Pose) -> Misfit {
    let (left, right) = (*a * *x, *z * *b);
    Misfit::Poses { turn: left.angle_to(&right), shift: (left.translation - right.translation).norm() }
}

impl Reading {
    fn fit(&self) -> Option<Fit> {
        let seen: Vec<Pose> = self.target.iter().map(|target| seen(target, self.on_hand)).collect();
        let n = seen.len();
        if n < FEWEST {
            return None;
        }
        let mut kept: Vec<usize> = (0..n).collect();
        let mut best: Option<Fit> = None;
        for _ in 0..ROUNDS {
            let (a, b): (Vec<Pose>, Vec<Pose>) = kept.iter().map(|&i| (self.robot[i], seen[i])).unzip();
            let Some((x, z)) = robot_world(&a, &b) else { break };
            let each: Vec<Misfit> = (0..n).map(|i| misfit(&x, &z, &self.robot[i], &seen[i])).collect();
            let of = |part: fn(&Misfit) -> f64| median(&mut each.iter().map(part).collect::<Vec<_>>());
            let misfit = Misfit::Poses { turn: of(Misfit::turn), shift: of(Misfit::shift) };
            kept = (0..n).collect();
            kept.sort_by(|&i, &j| each[i].size().total_cmp(&each[j].size()));
            kept.truncate(n - n / 4);
            kept.sort_unstable();
            if best.as_ref().is_none_or(|best| misfit.size() < best.misfit.size()) {
                best = Some(Fit { x, z, misfit, each });
            }
        }
        best
    }
}
