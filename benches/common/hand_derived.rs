//! One linearisation of the peers' problem with joints held, derived and written by hand: the yardstick for the graph.
//!
//! It knows when it is compiled that links are standard Denavit-Hartenberg and revolute, cameras pinholes, noise one pixel
//! and losses squared, and how large every block is. Like the graph, it collects what the pixels of a sample say of the tip
//! and then moves that to base and links, and it computes the upper triangle of H only.
use crate::peer_problem::PeerProblem;
use handeye::solvers::Pose;
use handeye::solvers::manifold::so3;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

const LINKS: usize = 6;
/// Columns of the chain: the base's step, then offset, d, a and alpha of each link.
const CHAIN: usize = 6 + 4 * LINKS;
const FEATURES: usize = 12;
const CAMERAS: usize = 2;
/// Columns of a camera: the step of its pose, then fx, fy, cx and cy.
const CAMERA: usize = 10;
/// Columns of everything: the chain, the features, the cameras.
const ALL: usize = CHAIN + 3 * FEATURES + CAMERA * CAMERAS;

/// A block of H by columns, and rows of a Jacobian.
type Block<const R: usize, const C: usize> = [[f64; R]; C];
type Rows<const C: usize> = [[f64; C]; 2];

/// The problem at its starting values, and its normal equations.
pub struct HandDerived<'a> {
    problem: &'a PeerProblem,
    world_from_camera: [Pose; CAMERAS],
    /// The upper triangle of H, and b.
    pub h: DMatrix<f64>,
    pub b: DVector<f64>,
}

/// What the pixels of one sample say of its tip.
#[derive(Default)]
struct Tip {
    h: Block<6, 6>,
    b: [f64; 6],
    features: [Block<6, 3>; FEATURES],
    cameras: [Block<6, CAMERA>; CAMERAS],
}

/// What all pixels say of features and cameras.
#[derive(Default)]
struct Shared {
    features: [(Block<3, 3>, [f64; 3]); FEATURES],
    features_cameras: [[Block<3, CAMERA>; CAMERAS]; FEATURES],
    cameras: [(Block<CAMERA, CAMERA>, [f64; CAMERA]); CAMERAS],
}

impl<'a> HandDerived<'a> {
    /// `None` where the problem has other numbers of links, features or cameras.
    pub fn new(problem: &'a PeerProblem) -> Option<Self> {
        let counts = [problem.dh.len(), problem.features.len(), problem.cameras.len()];
        (counts == [LINKS, FEATURES, CAMERAS]).then(|| HandDerived {
            problem,
            world_from_camera: std::array::from_fn(|camera| problem.cameras[camera].0.inverse()),
            h: DMatrix::zeros(ALL, ALL),
            b: DVector::zeros(ALL),
        })
    }

    /// The cost; H and b are in their places then.
    pub fn linearize(&mut self) -> f64 {
        self.h.fill(0.0);
        self.b.fill(0.0);
        let mut shared = Shared::default();
        let mut cost = 0.0;
        for seen in self.problem.observations.chunk_by(|a, b| a.0 == b.0) {
            let (world_from_tip, g) = self.forward_kinematics(&self.problem.joints[seen[0].0]);
            let mut tip = Tip::default();
            for &(_, camera, feature, pixel) in seen {
                cost += self.add_pixel(&world_from_tip, (camera, feature), pixel, &mut tip, &mut shared);
            }
            self.substitute(&g, &tip);
        }
        self.place(&shared);
        cost + self.add_priors()
    }

    /// The tip, and its step's derivatives by the chain's columns, by rows. With z and o the axis and the origin of the
    /// link before, x and p those of the link itself, and t the tip:
    ///
    ///   offset: (z, z × (t - o))     d: (0, z)     a: (0, x)     alpha: (x, x × (t - p))
    fn forward_kinematics(&self, joints: &[f64]) -> (Pose, [[f64; CHAIN]; 6]) {
        let mut pose = self.problem.base;
        let mut axes = [[Vector3::zeros(); 4]; LINKS];
        for ((&[offset, d, a, alpha], joint), axes) in self.problem.dh.iter().zip(joints).zip(&mut axes) {
            let ((s, c), (sa, ca)) = ((offset + joint).sin_cos(), alpha.sin_cos());
            let (before, r) = (pose.translation, pose.rotation);
            let (x, y, z) = (r.column(0), r.column(1), r.column(2));
            let (turned_x, turned_y) = (x * c + y * s, y * c - x * s);
            pose.translation += z * d + turned_x * a;
            *axes = [z.into_owned(), before, turned_x, pose.translation];
            pose.rotation = Matrix3::from_columns(&[turned_x, turned_y * ca + z * sa, z * ca - turned_y * sa]);
        }
        let mut g = [[0.0; CHAIN]; 6];
        let mut set = |column: usize, w: Vector3<f64>, v: Vector3<f64>| {
            for k in 0..3 {
                (g[k][column], g[3 + k][column]) = (w[k], v[k]);
            }
        };
        for k in 0..3 {
            let axis = Vector3::ith(k, 1.0);
            set(k, axis, axis.cross(&(pose.translation - self.problem.base.translation)));
            set(3 + k, Vector3::zeros(), axis);
        }
        for (i, [z, before, x, after]) in axes.iter().enumerate() {
            let column = 6 + 4 * i;
            set(column, *z, z.cross(&(pose.translation - before)));
            set(column + 1, Vector3::zeros(), *z);
            set(column + 2, Vector3::zeros(), *x);
            set(column + 3, *x, x.cross(&(pose.translation - after)));
        }
        (pose, g)
    }

    /// Adds what one pixel says; returns its cost.
    #[inline]
    fn add_pixel(
        &self,
        world_from_tip: &Pose,
        (camera, feature): (usize, usize),
        pixel: [f64; 2],
        tip: &mut Tip,
        shared: &mut Shared,
    ) -> f64 {
        let (pose, [fx, fy, cx, cy]) = (&self.world_from_camera[camera], self.problem.cameras[camera].1);
        let arm = world_from_tip.rotation * self.problem.features[feature];
        let from_camera = arm + world_from_tip.translation - pose.translation;
        let point = pose.rotation.tr_mul(&from_camera);
        let inverse = 1.0 / point.z;
        let (x, y) = (point.x * inverse, point.y * inverse);
        let r = [fx * x + cx - pixel[0], fy * y + cy - pixel[1]];
        let (mut by_tip, mut by_feature, mut by_camera): (Rows<6>, Rows<3>, Rows<CAMERA>) = Default::default();
        let by_point = [[fx, 0.0, -fx * x], [0.0, fy, -fy * y]].map(|row| Vector3::from(row) * inverse);
        for (row, by_point) in by_point.into_iter().enumerate() {
            let in_world = pose.rotation * by_point;
            let (by_turn, by_camera_turn) = (arm.cross(&in_world), in_world.cross(&from_camera));
            by_tip[row][..3].copy_from_slice(by_turn.as_slice());
            by_tip[row][3..].copy_from_slice(in_world.as_slice());
            by_feature[row].copy_from_slice(world_from_tip.rotation.tr_mul(&in_world).as_slice());
            by_camera[row][..3].copy_from_slice(by_camera_turn.as_slice());
            by_camera[row][3..6].copy_from_slice((-in_world).as_slice());
            by_camera[row][6 + row] = [x, y][row];
            by_camera[row][8 + row] = 1.0;
        }
        add_square(&mut tip.h, &by_tip);
        add(&mut tip.features[feature], &by_tip, &by_feature);
        add(&mut tip.cameras[camera], &by_tip, &by_camera);
        add_gradient(&mut tip.b, &by_tip, r);
        let (h, b) = &mut shared.features[feature];
        add_square(h, &by_feature);
        add_gradient(b, &by_feature, r);
        add(&mut shared.features_cameras[feature][camera], &by_feature, &by_camera);
        let (h, b) = &mut shared.cameras[camera];
        add_square(h, &by_camera);
        add_gradient(b, &by_camera, r);
        0.5 * (r[0] * r[0] + r[1] * r[1])
    }

    /// Moves what is said of a tip to the chain: H_PP += Gᵀ H_tt G, H_Px += Gᵀ H_tx, b_P += Gᵀ b_t.
    fn substitute(&mut self, g: &[[f64; CHAIN]; 6], tip: &Tip) {
        for column in 0..CHAIN {
            let step: [f64; 6] = std::array::from_fn(|k| g[k][column]);
            let h = |i: usize, k: usize| if i <= k { tip.h[k][i] } else { tip.h[i][k] };
            let product = std::array::from_fn(|i| (0..6).map(|k| h(i, k) * step[k]).sum());
            self.add_chain(g, column, &product);
            self.b[column] += (0..6).map(|k| step[k] * tip.b[k]).sum::<f64>();
        }
        for (column, block) in tip.features.as_flattened().iter().chain(tip.cameras.as_flattened()).enumerate() {
            self.add_chain(g, CHAIN + column, block);
        }
    }

    /// Adds Gᵀ s to one column of H.
    #[inline]
    fn add_chain(&mut self, g: &[[f64; CHAIN]; 6], column: usize, s: &[f64; 6]) {
        let mut sum = [0.0; CHAIN];
        for (g, s) in g.iter().zip(s) {
            for (sum, g) in sum.iter_mut().zip(g) {
                *sum += g * s;
            }
        }
        for (h, sum) in self.h.as_mut_slice()[column * ALL..].iter_mut().zip(sum) {
            *h += sum;
        }
    }

    /// Puts what is said of features and cameras where it belongs.
    fn place(&mut self, shared: &Shared) {
        for feature in 0..FEATURES {
            let (at, (h, b)) = (CHAIN + 3 * feature, &shared.features[feature]);
            self.add_block(at, at, h);
            self.b.rows_mut(at, 3).copy_from_slice(b);
            for camera in 0..CAMERAS {
                let columns = CHAIN + 3 * FEATURES + CAMERA * camera;
                self.add_block(at, columns, &shared.features_cameras[feature][camera]);
            }
        }
        for (camera, (h, b)) in shared.cameras.iter().enumerate() {
            let at = CHAIN + 3 * FEATURES + CAMERA * camera;
            self.add_block(at, at, h);
            self.b.rows_mut(at, CAMERA).copy_from_slice(b);
        }
    }

    fn add_block<const R: usize, const C: usize>(&mut self, row: usize, column: usize, block: &Block<R, C>) {
        for (j, values) in block.iter().enumerate() {
            for (h, value) in self.h.column_mut(column + j).rows_mut(row, R).iter_mut().zip(values) {
                *h += value;
            }
        }
    }

    /// Priors around the starting values, whose residuals are 0 there; returns their cost. The step of a camera's inverse is
    /// (-Rᵀ w, Rᵀ (w × t - v)).
    fn add_priors(&mut self) -> f64 {
        let Some([base_w, base_t, angle, length, feature, camera_w, camera_t, focal, centre]) = self.problem.prior
        else {
            return 0.0;
        };
        let links = [angle, length, length, angle].repeat(LINKS);
        let sigmas = [base_w; 3].into_iter().chain([base_t; 3]).chain(links).chain([feature; 3 * FEATURES]);
        for (i, sigma) in sigmas.enumerate() {
            self.h[(i, i)] += 1.0 / (sigma * sigma);
        }
        for camera in 0..CAMERAS {
            let at = CHAIN + 3 * FEATURES + CAMERA * camera;
            let t = so3::cross_matrix(&self.world_from_camera[camera].translation);
            let (of_turn, of_shift) = (Matrix3::identity() / camera_w.powi(2), Matrix3::identity() / camera_t.powi(2));
            let mut turn = self.h.fixed_view_mut::<3, 3>(at, at);
            turn += of_turn + t.transpose() * of_shift * t;
            let mut both = self.h.fixed_view_mut::<3, 3>(at, at + 3);
            both += t.transpose() * of_shift;
            let mut shift = self.h.fixed_view_mut::<3, 3>(at + 3, at + 3);
            shift += of_shift;
            for (i, sigma) in [focal, focal, centre, centre].into_iter().enumerate() {
                self.h[(at + 6 + i, at + 6 + i)] += 1.0 / (sigma * sigma);
            }
        }
        0.0
    }
}

/// block += Aᵀ B.
#[inline(always)]
fn add<const R: usize, const C: usize>(block: &mut Block<R, C>, a: &Rows<R>, b: &Rows<C>) {
    for j in 0..C {
        for i in 0..R {
            block[j][i] += a[0][i] * b[0][j] + a[1][i] * b[1][j];
        }
    }
}

/// The upper triangle of block += Aᵀ A.
#[inline(always)]
fn add_square<const R: usize>(block: &mut Block<R, R>, a: &Rows<R>) {
    for j in 0..R {
        for i in 0..=j {
            block[j][i] += a[0][i] * a[0][j] + a[1][i] * a[1][j];
        }
    }
}

/// b += Aᵀ r.
#[inline(always)]
fn add_gradient<const R: usize>(b: &mut [f64; R], a: &Rows<R>, r: [f64; 2]) {
    for i in 0..R {
        b[i] += a[0][i] * r[0] + a[1][i] * r[1];
    }
}
