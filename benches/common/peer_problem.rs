//! The calibration problem that peers were measured on: its file and its graph.
use handeye::camera::CameraModel;
use handeye::chain::{Chain, Convention, JointKind};
use handeye::factors::{ForwardKinematics, Intrinsics, Reprojection};
use handeye::solvers::manifold::so3;
use handeye::solvers::{DynamicVector, Factor, Graph, Pose, Scalar, Vector};
use nalgebra::{Matrix3, Vector3};
use std::path::Path;
use std::sync::Arc;

/// A problem file: starting values, standard deviations of the priors around them, and observations.
pub struct PeerProblem {
    pub sigma_joint: f64,
    pub prior: Option<[f64; 9]>,
    pub base: Pose,
    pub dh: Vec<[f64; 4]>,
    pub features: Vec<Vector3<f64>>,
    /// camera_from_world and fx, fy, cx, cy.
    pub cameras: Vec<(Pose, [f64; 4])>,
    pub joints: Vec<Vec<f64>>,
    /// Sample, camera, feature, pixel.
    pub observations: Vec<(usize, usize, usize, [f64; 2])>,
}

impl PeerProblem {
    pub fn read(path: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(path).ok()?;
        let mut numbers = text.split_whitespace().map(|word| word.parse::<f64>().expect("a number"));
        let mut next = || numbers.next().expect("the file is whole");
        let [n, samples, cameras, features, observations] = std::array::from_fn(|_| next() as usize);
        let (_, sigma_joint) = (next(), next());
        let prior = (next() != 0.0).then(|| std::array::from_fn(|_| next()));
        let pose = |next: &mut dyn FnMut() -> f64| {
            let rotation: [f64; 9] = std::array::from_fn(|_| next());
            Pose {
                rotation: Matrix3::from_row_slice(&rotation),
                translation: Vector3::from(std::array::from_fn(|_| next())),
            }
        };
        let base = pose(&mut next);
        Some(PeerProblem {
            sigma_joint,
            prior,
            base,
            dh: (0..n).map(|_| std::array::from_fn(|_| next())).collect(),
            features: (0..features).map(|_| Vector3::from(std::array::from_fn(|_| next()))).collect(),
            cameras: (0..cameras).map(|_| (pose(&mut next), std::array::from_fn(|_| next()))).collect(),
            joints: (0..samples).map(|_| (0..n).map(|_| next()).collect()).collect(),
            observations: (0..observations)
                .map(|_| (next() as usize, next() as usize, next() as usize, [next(), next()]))
                .collect(),
        })
    }

    /// The graph at its starting values, with the joints held or free under their readings.
    pub fn graph(&self, joints_free: bool) -> Graph {
        let mut graph = Graph::new();
        let n = self.dh.len();
        let chain = Arc::new(Chain {
            convention: Convention::Dh,
            kinds: vec![JointKind::Revolute; n],
            reversed: vec![false; n],
            frames: None,
        });
        let base = graph.free(self.base);
        let rows = DynamicVector::from_iterator(5 * n, self.dh.iter().flat_map(|row| row.iter().copied().chain([0.0])));
        let parameters = graph.free(rows.clone());
        let beta: Vec<usize> = (0..n).map(|i| 5 * i + 4).collect();
        graph.hold_coordinates(parameters, &beta);
        let features: Vec<_> = self.features.iter().map(|&feature| graph.free(feature)).collect();
        let cameras: Vec<_> = self
            .cameras
            .iter()
            .map(|(camera_from_world, k)| {
                let mut intrinsics = Intrinsics::zeros();
                intrinsics.as_mut_slice()[..4].copy_from_slice(k);
                let (pose, intrinsics) = (graph.free(camera_from_world.inverse()), graph.free(intrinsics));
                graph.hold_coordinates(intrinsics, &[4, 5, 6, 7, 8, 9, 10, 11]);
                (pose, intrinsics)
            })
            .collect();
        let world = graph.held(Pose::identity());
        let joints: Vec<_> = self
            .joints
            .iter()
            .map(|joints| {
                let joints = DynamicVector::from_column_slice(joints);
                if joints_free { graph.free(joints) } else { graph.held(joints) }
            })
            .collect();
        let tips: Vec<_> = joints
            .iter()
            .map(|&joints| {
                graph.derive(ForwardKinematics { chain: chain.clone(), upto: n }, (base, parameters, joints))
            })
            .collect();
        for &(sample, camera, feature, pixel) in &self.observations {
            let (pose, intrinsics) = cameras[camera];
            graph.factor(
                Reprojection { pixel, model: CameraModel::Pinhole },
                (tips[sample], features[feature], world, pose, intrinsics),
            );
        }
        if joints_free {
            for (&node, joints) in joints.iter().zip(&self.joints) {
                graph.prior(node, &DynamicVector::from_column_slice(joints), &vec![self.sigma_joint; n]);
            }
        }
        if let Some([base_w, base_t, angle, length, feature, camera_w, camera_t, focal, centre]) = self.prior {
            let pose = |w: f64, t: f64| [w, w, w, t, t, t];
            graph.prior(base, &self.base, &pose(base_w, base_t));
            graph.prior(parameters, &rows, &[angle, length, length, angle, f64::INFINITY].repeat(n));
            for (&node, mean) in features.iter().zip(&self.features) {
                graph.prior(node, mean, &[feature; 3]);
            }
            for (&(node, intrinsics), &(mean, k)) in cameras.iter().zip(&self.cameras) {
                graph.factor(InversePrior(mean), (node,)).sigmas(pose(camera_w, camera_t));
                let mean = Intrinsics::from_fn(|i, _| k.get(i).copied().unwrap_or(0.0));
                let mut sigmas = [f64::INFINITY; 12];
                sigmas[..4].copy_from_slice(&[focal, focal, centre, centre]);
                graph.prior(intrinsics, &mean, &sigmas);
            }
        }
        graph
    }
}

/// The peers' prior is on camera_from_world, the inverse of what is estimated here.
struct InversePrior(Pose);

impl Factor<6> for InversePrior {
    type On = (Pose,);

    fn residual<T: Scalar>(&self, (pose,): (Pose<T>,)) -> [T; 6] {
        let inverse = pose.inverse();
        let mean: Pose<T> = self.0.lift();
        let w = so3::log(&so3::times(&inverse.rotation, &mean.rotation.transpose()));
        let v: Vector<3, T> = inverse.translation - mean.translation;
        [w.x, w.y, w.z, v.x, v.y, v.z]
    }
}
