//! What the cameras of a world see.
use super::{Moment, Object, World};
use crate::recording::{Detection, PointDetection, Sample};
use crate::rig::{Model, ModelFeature, Parent};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use rand::RngExt;
use rand_distr::StandardNormal;

/// A feature in view, exactly.
struct InView {
    detection: Detection,
    /// In the camera's frame [m].
    point: Vector3<f64>,
}

impl World {
    /// What is read and seen now, with noise; its time is when it was, which latency puts into the past.
    pub fn look(&mut self) -> Sample {
        let Moment { time, joints, slipped, objects } = self.then((self.time - self.options.latency).max(0.0));
        let random = &mut self.observing;
        let mut normal = |sd: f64| sd * random.sample::<f64, _>(StandardNormal);
        let reading = |sd: f64| joints.iter().zip(&slipped).map(|(joint, slip)| joint - slip + normal(sd)).collect();
        let readings: Option<Vec<f64>> = self.options.readings.map(reading);
        let mut seen = self.in_view(&self.model.links(&joints), &objects);
        let (random, tracker, missed) = (&mut self.observing, self.options.tracker, self.options.missed);
        seen.retain_mut(|InView { detection, point }| {
            // As many random numbers whatever happens.
            let is_seen = random.random::<f64>() >= missed;
            detection.pixel = tracker.report(detection.pixel, point.norm(), random);
            is_seen
        });
        for (fault, reported) in self.options.faults.iter().zip(&mut self.reported) {
            let Some(&feature) = self.places.get(fault.feature) else { continue };
            let of_fault =
                |seen: &InView| (seen.detection.camera as usize, seen.detection.feature) == (fault.camera, feature);
            if let Some(at) = seen.iter().position(of_fault) {
                match fault.report(seen[at].detection.pixel, *reported, time) {
                    Some(pixel) => (seen[at].detection.pixel, *reported) = (pixel, Some(pixel)),
                    None => drop(seen.remove(at)),
                }
            }
        }
        let (random, sd) = (&mut self.sounding, self.options.points);
        let deep = seen.iter().filter(|seen| self.depth[seen.detection.camera as usize]);
        let points = deep.map(|InView { detection: Detection { camera, feature, .. }, point }| PointDetection {
            camera: *camera,
            feature: *feature,
            point: point.map(|x| x + sd * random.sample::<f64, _>(StandardNormal)).into(),
        });
        Sample {
            time: Some(time),
            joints: readings,
            points: points.collect(),
            pixels: seen.iter().map(|seen| seen.detection).collect(),
            ..Sample::default()
        }
    }

    /// What would be seen at some joints, exactly.
    pub fn exact(&self, joints: &[f64]) -> Vec<Detection> {
        self.in_view(&self.model.links(joints), &self.objects).into_iter().map(|seen| seen.detection).collect()
    }

    /// What would be seen with the tip at a pose of the world, exactly; links before it stay where they are.
    pub fn exact_with_tip(&self, world_from_tip: &Pose) -> Vec<Detection> {
        let seen = self.in_view(&self.links_with_tip(world_from_tip), &self.objects);
        seen.into_iter().map(|seen| seen.detection).collect()
    }

    /// All features in view of cameras, in the order of recordings.
    fn in_view(&self, links: &[Pose], objects: &[Object]) -> Vec<InView> {
        let model = &self.model;
        let in_world: Vec<_> =
            (0..model.features.len()).map(|feature| in_world(model, feature, links, objects)).collect();
        let mut seen = Vec::new();
        for (index, camera) in model.cameras.iter().enumerate() {
            let world_from_camera = model.carrier(camera.parent, links) * camera.pose;
            for (point, &feature) in in_world.iter().zip(&self.places) {
                let point = world_from_camera.inverse_transform(point);
                let pixel = camera.pixel_inside(self.sizes[index], &point);
                let detection = |pixel| Detection { camera: index as u32, feature, pixel };
                seen.extend(pixel.map(|pixel| InView { detection: detection(pixel), point }));
            }
        }
        seen.sort_unstable_by_key(|seen| (seen.detection.camera, seen.detection.feature));
        seen
    }
}

/// Where a feature is, on its link or on its object [m].
pub(super) fn in_world(model: &Model, feature: usize, links: &[Pose], objects: &[Object]) -> Vector3<f64> {
    let object = objects.iter().find(|object| object.features.contains(&feature));
    let tip = model.carrier(Parent::Tip, links);
    let ModelFeature { parent, xyz } = &model.features[feature];
    let carrier = object.map_or_else(|| model.carrier(*parent, links), |object| object.carrier(&tip));
    carrier.transform(xyz)
}
