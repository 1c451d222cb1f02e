//! Chains: joint readings to the pose of every link; one file per joint convention.

/// How a row of parameters makes a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Convention {
    /// Standard Denavit-Hartenberg.
    #[default]
    Dh,
    /// Modified Denavit-Hartenberg (Craig).
    ModifiedDh,
}

impl Convention {
    /// Every convention.
    pub const ALL: &'static [Convention] = &[Convention::Dh, Convention::ModifiedDh];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Convention::Dh => "dh",
            Convention::ModifiedDh => "modified-dh",
        }
    }

    /// The convention of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|convention| convention.name() == name)
    }
}

/// What a joint does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis.
    #[default]
    Revolute,
    /// Slides along its axis.
    Prismatic,
}

impl JointKind {
    /// Every kind of joint.
    pub const ALL: &'static [JointKind] = &[JointKind::Revolute, JointKind::Prismatic];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            JointKind::Revolute => "revolute",
            JointKind::Prismatic => "prismatic",
        }
    }
}
