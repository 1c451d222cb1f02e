//! What holds a motion back.
use handeye::rig;
use handeye::servo::{self, Constraint};
use pyo3::prelude::*;

/// A constraint that holds a motion back.
#[pyclass(module = "handeye.servo", frozen, get_all)]
pub struct Active {
    /// Which, in words.
    constraint: String,
    /// The joint whose bound it is, by name; ``None`` for a limit.
    joint: Option<String>,
    /// Index of the limit in the list that was given; ``None`` for a joint's bound.
    limit: Option<usize>,
    /// How much the cost would fall per unit that it were wider.
    multiplier: f64,
    /// How far it gave way, in its own unit; 0 where it holds.
    slack: f64,
}

impl Active {
    pub fn all(active: &[servo::Active], rig: &rig::Rig) -> Vec<Self> {
        active.iter().map(|active| Active::new(active, rig)).collect()
    }

    fn new(active: &servo::Active, rig: &rig::Rig) -> Self {
        let (joint, limit) = match active.constraint {
            Constraint::Joint { joint, .. } => (rig.robot.joints.get(joint).map(|joint| joint.name.clone()), None),
            Constraint::Limit { limit, .. } => (None, Some(limit)),
        };
        let servo::Active { constraint, multiplier, slack } = active;
        Active { constraint: constraint.words(rig, &[]), joint, limit, multiplier: *multiplier, slack: *slack }
    }
}

#[pymethods]
impl Active {
    fn __repr__(&self) -> String {
        let gave_way = if self.slack > 0.0 { format!(", gave way by {:.2e}", self.slack) } else { String::new() };
        format!("<handeye.servo.Active {}{gave_way}>", self.constraint)
    }
}

/// Constraints in words.
pub fn words_of(constraints: &[Constraint], rig: &rig::Rig) -> Vec<String> {
    constraints.iter().map(|constraint| constraint.words(rig, &[])).collect()
}
