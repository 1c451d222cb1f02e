//! What the cameras of a world see.
use super::{Moment, Object, World};
use crate::recording::{Detection, PointDetection, Sample};
use crate::rig::{Model, ModelFeature, Parent};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use rand::RngExt;
use rand_distr::StandardNormal;

/// A feature in view: exactly, until it is reported.
struct InView {
    camera: u32,
    feature: u32,
    report: Report,
}

/// What a tracker says of a feature.
#[derive(Clone, Copy)]
pub(super) struct Report {
    /// Where it is in the image [px].
    pub pixel: [f64; 2],
    /// Where it is in the camera's frame [m], which only depth cameras tell.
    pub point: Vector3<f64>,
}

impl InView {
    fn detection(&self) -> Detection {
        Detection { camera: self.camera, feature: self.feature, pixel: self.report.pixel }
    }
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
        seen.retain_mut(|InView { report: Report { pixel, point }, .. }| {
            // As many random numbers whatever happens.
            let is_seen = random.random::<f64>() >= missed;
            *pixel = tracker.report(*pixel, point.norm(), random);
            is_seen
        });
        let (random, sd) = (&mut self.sounding, self.options.points);
        for InView { report, .. } in seen.iter_mut().filter(|seen| self.depth[seen.camera as usize]) {
            report.point = report.point.map(|x| x + sd * random.sample::<f64, _>(StandardNormal));
        }
        for (fault, before) in self.options.faults.iter().zip(&mut self.reported) {
            let Some(&feature) = self.places.get(fault.feature) else { continue };
            let of_fault = |seen: &InView| (seen.camera as usize, seen.feature) == (fault.camera, feature);
            if let Some(at) = seen.iter().position(of_fault) {
                match fault.report(&self.model.cameras[fault.camera], seen[at].report, *before, time) {
                    Some(report) => (seen[at].report, *before) = (report, Some(report)),
                    None => drop(seen.remove(at)),
                }
            }
        }
        let deep = seen.iter().filter(|seen| self.depth[seen.camera as usize]);
        let points = deep.map(|InView { camera, feature, report }| PointDetection {
            camera: *camera,
            feature: *feature,
            point: report.point.into(),
        });
        Sample {
            time: Some(time),
            joints: readings,
            points: points.collect(),
            pixels: seen.iter().map(InView::detection).collect(),
            ..Sample::default()
        }
    }

    /// What would be seen at some joints, exactly.
    pub fn exact(&self, joints: &[f64]) -> Vec<Detection> {
        self.in_view(&self.model.links(joints), &self.objects).iter().map(InView::detection).collect()
    }

    /// What would be seen with the tip at a pose of the world, exactly; links before it stay where they are.
    pub fn exact_with_tip(&self, world_from_tip: &Pose) -> Vec<Detection> {
        self.in_view(&self.links_with_tip(world_from_tip), &self.objects).iter().map(InView::detection).collect()
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
                let report = pixel.map(|pixel| Report { pixel, point });
                seen.extend(report.map(|report| InView { camera: index as u32, feature, report }));
            }
        }
        seen.sort_unstable_by_key(|seen| (seen.camera, seen.feature));
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
