//! Approaching with what is held in the hand, from afar.
use crate::rig::Rig;
use nalgebra::Vector3;

/// The rig with some features, those of an object in the hand, shifted away from the other features on the tip: their centroid is
/// `factor` times as far. Joints that bring such features to the pixels of an object keep the hand short of it, along the line between the
/// two; factors that fall to 1 lead it there (the paper's stretched structure; the object keeps its shape, by which its pixels are
/// understood). Features without a value, and a rig without others, stay as they are.
pub fn stretched(rig: &Rig, object: &[usize], factor: f64) -> Rig {
    let centroid = |is_of_object: bool| {
        let features = rig.features.iter().enumerate();
        let tip = features.filter(|(index, feature)| {
            object.contains(index) == is_of_object && (is_of_object || feature.parent == crate::rig::Parent::Tip)
        });
        let places: Vec<Vector3<f64>> = tip.filter_map(|(_, feature)| feature.xyz).map(Vector3::from).collect();
        (!places.is_empty()).then(|| places.iter().sum::<Vector3<f64>>() / places.len() as f64)
    };
    let mut far = rig.clone();
    let (Some(held), Some(hand)) = (centroid(true), centroid(false)) else { return far };
    let shift = (held - hand) * (factor - 1.0);
    for (index, feature) in far.features.iter_mut().enumerate() {
        if object.contains(&index) {
            feature.xyz = feature.xyz.map(|xyz| (Vector3::from(xyz) + shift).into());
        }
    }
    far
}
