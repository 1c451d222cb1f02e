//! What an arm's cameras see.
use handeye::infer::Sighting;
use handeye::servo::{Arm, Configuration};

/// All features that two cameras of twelve features see at some joints [rad or m], exactly.
pub fn look(arm: &Arm, joints: &[f64]) -> Vec<Sighting> {
    let mut at = Configuration::default();
    arm.configure(joints, &mut at);
    let pairs = (0..2).flat_map(|camera| (0..12).map(move |feature| (camera, feature)));
    let see = |(camera, feature)| Some(Sighting { camera, feature, pixel: arm.pixel(&at, camera, feature)? });
    pairs.filter_map(see).collect()
}
