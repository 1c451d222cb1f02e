//! Where the arm of a scene shall be, which may move.
use crate::geometry::between;
use handeye_solvers::Pose;

/// Where the arm shall be: joints whose pixels are aimed at, or with which a task is solved.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Target {
    /// At the beginning [rad or m].
    pub joints: Vec<f64>,
    /// How fast they move [rad/s or m/s]; empty for a target that stands still.
    pub velocity: Vec<f64>,
    /// For how long they move [s].
    pub until: f64,
    /// How somebody moves the target of a task, in the order of time; empty where nobody does.
    pub path: Vec<Waypoint>,
}

/// Where a target that somebody moves is at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// When [s].
    pub time: f64,
    /// Its motion in the world since the beginning.
    pub motion: Pose,
}

impl Target {
    /// Its joints after some seconds.
    pub fn at(&self, time: f64) -> Vec<f64> {
        let time = time.min(self.until);
        let speed = |i: usize| self.velocity.get(i).copied().unwrap_or(0.0);
        self.joints.iter().enumerate().map(|(i, joint)| joint + speed(i) * time).collect()
    }

    /// How it was moved in the world by then; between waypoints, evenly.
    pub fn motion(&self, time: f64) -> Pose {
        let after = self.path.iter().position(|waypoint| waypoint.time >= time);
        let (from, to) = match (after, self.path.last()) {
            (_, None) => return Pose::identity(),
            (None, Some(last)) => return last.motion,
            (Some(0), _) => return self.path[0].motion,
            (Some(after), _) => (&self.path[after - 1], &self.path[after]),
        };
        between(&from.motion, &to.motion, (time - from.time) / (to.time - from.time))
    }
}
