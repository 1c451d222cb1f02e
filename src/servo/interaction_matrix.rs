//! Where the slopes of the error by the joints are taken.

/// Which interaction matrix, times the arm's Jacobian, stands between the joints' motion and the error (Chaumette and Hutchinson 2006,
/// part I).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum InteractionMatrix {
    /// That of the present configuration: a Newton step, whose remaining error is of second order in the motion.
    Current,
    /// That of the configuration aimed at, which is inferred from the goal's pixels once: needs no good reading on the way.
    Desired,
    /// The mean of both: the remaining error is of third order in the motion (Malis 2004). The mean is that of the slopes by the joints,
    /// where the arm's own curvature cancels as well; ViSP's is of the camera's motion alone.
    #[default]
    Mean,
}

impl InteractionMatrix {
    /// All of them.
    pub const ALL: &'static [InteractionMatrix] =
        &[InteractionMatrix::Current, InteractionMatrix::Desired, InteractionMatrix::Mean];

    /// The word for it in scene files.
    pub fn name(self) -> &'static str {
        match self {
            InteractionMatrix::Current => "current",
            InteractionMatrix::Desired => "desired",
            InteractionMatrix::Mean => "mean",
        }
    }

    /// The two places whose mean is taken.
    pub(super) fn places<T: Copy>(self, now: T, desired: T) -> [T; 2] {
        match self {
            InteractionMatrix::Current => [now, now],
            InteractionMatrix::Desired => [desired, desired],
            InteractionMatrix::Mean => [now, desired],
        }
    }

    /// True where the configuration aimed at has to be known.
    pub(super) fn looks_ahead(self) -> bool {
        self != InteractionMatrix::Current
    }
}
