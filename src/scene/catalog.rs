//! The shipped scenes, inside the program.

/// Name and scene file of every shipped scene.
pub const ALL: &[(&str, &str)] = &[
    ("ur5-reach", include_str!("../../models/scenes/ur5-reach.toml")),
    ("ur5-visual", include_str!("../../models/scenes/ur5-visual.toml")),
    ("ur5-noisy", include_str!("../../models/scenes/ur5-noisy.toml")),
    ("ur5-uncalibrated", include_str!("../../models/scenes/ur5-uncalibrated.toml")),
    ("ur5-wrench", include_str!("../../models/scenes/ur5-wrench.toml")),
    ("ur5-moving", include_str!("../../models/scenes/ur5-moving.toml")),
];
