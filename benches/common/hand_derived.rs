//! The peers' problem with joints held, linearised as an expert would by hand: the yardstick for the graph.
//!
//! Everything is known when it is compiled: revolute standard Denavit-Hartenberg links, pinhole cameras, and the sizes of
//! all blocks. Like the graph, it collects the normal equations over each sample's tip first and moves them to base and
//! links afterwards.
use super::peer_problem::PeerProblem;
use handeye::solvers::manifold::so3;
use handeye::solvers::Pose;
use nalgebra::{DMatrix, DVector, Matrix3, RowVector3, SMatrix, SVector, Vector3};

/// Links; the chain's columns: the base's step, then four parameters per link.
const N: usize = 6;
const CHAIN: usize = 6 + 4 * N;

/// A camera's columns: its pose's step, then fx, fy, cx, cy.
const CAMERA: usize = 10;

/// What is estimated; cameras are world_from_camera.
pub struct Estimate {
    base: Pose,
    dh: [[f64; 4]; N],
    features: Vec<Vector3<f64>>,
    cameras: Vec<(Pose, [f64; 4])>,
}

/// The normal equations and the blocks that they are collected in. Columns: base, links, features, and of each camera its
/// pose and its intrinsics.
pub struct HandDerived<'a> {
    problem: &'a PeerProblem,
    pub h: DMatrix<f64>,
    pub b: DVector<f64>,
    tip: SMatrix<f64, 6, 6>,
    tip_b: SVector<f64, 6>,
    tip_features: Vec<SMatrix<f64, 6, 3>>,
    tip_cameras: Vec<SMatrix<f64, 6, CAMERA>>,
    features: Vec<(Matrix3<f64>, Vector3<f64>)>,
    feature_cameras: Vec<SMatrix<f64, 3, CAMERA>>,
    cameras: Vec<(SMatrix<f64, CAMERA, CAMERA>, SVector<f64, CAMERA>)>,
}

impl Estimate {
    /// The problem's starting values.
    pub fn new(problem: &PeerProblem) -> Self {
        Estimate {
            base: problem.base,
            dh: std::array::from_fn(|i| problem.dh[i]),
            features: problem.features.clone(),
            cameras: problem.cameras.iter().map(|&(pose, k)| (pose.inverse(), k)).collect(),
        }
    }
}

impl<'a> HandDerived<'a> {
    pub fn new(problem: &'a PeerProblem) -> Self {
        let (features, cameras) = (problem.features.len(), problem.cameras.len());
        let columns = CHAIN + 3 * features + CAMERA * cameras;
        HandDerived {
            problem,
            h: DMatrix::zeros(columns, columns),
            b: DVector::zeros(columns),
            tip: SMatrix::zeros(),
            tip_b: SVector::zeros(),
            tip_features: vec![SMatrix::zeros(); features],
            tip_cameras: vec![SMatrix::zeros(); cameras],
            features: vec![Default::default(); features],
            feature_cameras: vec![SMatrix::zeros(); features * cameras],
            cameras: vec![(SMatrix::zeros(), SVector::zeros()); cameras],
        }
    }

    /// The cost; the upper triangle of H and b are in `h` and `b` then. Observations are ordered by sample.
    pub fn linearize(&mut self, at: &Estimate) -> f64 {
        self.h.fill(0.0);
        self.b.fill(0.0);
        self.features.fill(Default::default());
        self.feature_cameras.fill(SMatrix::zeros());
        self.cameras.fill((SMatrix::zeros(), SVector::zeros()));
        let mut cost = 0.0;
        for seen in self.problem.observations.chunk_by(|a, b| a.0 == b.0) {
            self.tip.fill(0.0);
            self.tip_b.fill(0.0);
            self.tip_features.fill(SMatrix::zeros());
            self.tip_cameras.fill(SMatrix::zeros());
            let (tip, g) = forward_kinematics(at, &self.problem.joints[seen[0].0]);
            for &(_, camera, feature, pixel) in seen {
                cost += self.add_pixel(at, &tip, camera, feature, pixel);
            }
            self.substitute(&g);
        }
        self.assemble();
        cost + self.add_priors(at)
    }

    fn add_pixel(&mut self, at: &Estimate, tip: &Pose, camera: usize, feature: usize, pixel: [f64; 2]) -> f64 {
        let (pose, [fx, fy, cx, cy]) = &at.cameras[camera];
        let arm = tip.rotation * at.features[feature];
        let from_camera = arm + tip.translation - pose.translation;
        let point = pose.rotation.tr_mul(&from_camera);
        let inverse = 1.0 / point.z;
        let (x, y) = (point.x * inverse, point.y * inverse);
        let r = [fx * x + cx - pixel[0], fy * y + cy - pixel[1]];
        let by_point = [
            RowVector3::new(fx * inverse, 0.0, -fx * x * inverse),
            RowVector3::new(0.0, fy * inverse, -fy * y * inverse),
        ];
        let mut by_tip = SMatrix::<f64, 2, 6>::zeros();
        let mut by_feature = SMatrix::<f64, 2, 3>::zeros();
        let mut by_camera = SMatrix::<f64, 2, CAMERA>::zeros();
        for (i, by_point) in by_point.iter().enumerate() {
            // ∂r/∂(point in the world).
            let slope = pose.rotation * by_point.transpose();
            let (turn, turn_camera) = (arm.cross(&slope), slope.cross(&from_camera));
            let in_tip = tip.rotation.tr_mul(&slope);
            for k in 0..3 {
                by_tip[(i, k)] = turn[k];
                by_tip[(i, 3 + k)] = slope[k];
                by_feature[(i, k)] = in_tip[k];
                by_camera[(i, k)] = turn_camera[k];
                by_camera[(i, 3 + k)] = -slope[k];
            }
            by_camera[(i, 6 + i)] = [x, y][i];
            by_camera[(i, 8 + i)] = 1.0;
        }
        rank_two(&mut self.tip, &by_tip, &by_tip);
        rank_two(&mut self.tip_features[feature], &by_tip, &by_feature);
        rank_two(&mut self.tip_cameras[camera], &by_tip, &by_camera);
        rank_two(&mut self.features[feature].0, &by_feature, &by_feature);
        rank_two(&mut self.feature_cameras[feature * at.cameras.len() + camera], &by_feature, &by_camera);
        rank_two(&mut self.cameras[camera].0, &by_camera, &by_camera);
        gradient(&mut self.tip_b, &by_tip, r);
        gradient(&mut self.features[feature].1, &by_feature, r);
        gradient(&mut self.cameras[camera].1, &by_camera, r);
        0.5 * (r[0] * r[0] + r[1] * r[1])
    }

    /// Moves what one sample says of its tip to the chain.
    fn substitute(&mut self, g: &SMatrix<f64, 6, CHAIN>) {
        let product = self.tip * g;
        self.add_chain(0, g, &product);
        for feature in 0..self.tip_features.len() {
            let block = self.tip_features[feature];
            self.add_chain(CHAIN + 3 * feature, g, &block);
        }
        let cameras = CHAIN + 3 * self.features.len();
        for camera in 0..self.tip_cameras.len() {
            let block = self.tip_cameras[camera];
            self.add_chain(cameras + CAMERA * camera, g, &block);
        }
        for j in 0..CHAIN {
            self.b[j] += (0..6).map(|k| g[(k, j)] * self.tip_b[k]).sum::<f64>();
        }
    }

    /// H_chain,x += Gᵀ H_tip,x for the columns x that begin with `first`; of the chain itself the upper triangle.
    #[inline]
    fn add_chain<const C: usize>(&mut self, first: usize, g: &SMatrix<f64, 6, CHAIN>, block: &SMatrix<f64, 6, C>) {
        for c in 0..C {
            let rows = if first == 0 { c + 1 } else { CHAIN };
            let column = &mut self.h.as_mut_slice()[(first + c) * (CHAIN + 0)..];
            let _ = (rows, column, g, block);
        }
    }
}
