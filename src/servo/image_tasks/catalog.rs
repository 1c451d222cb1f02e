//! The shipped tasks, inside the program.

/// Name and task file of every shipped task.
pub const ALL: &[(&str, &str)] = &[
    ("wrench", include_str!("../../../models/tasks/wrench.toml")),
    ("peg-in-hole", include_str!("../../../models/tasks/peg-in-hole.toml")),
    ("ring", include_str!("../../../models/tasks/ring.toml")),
];
