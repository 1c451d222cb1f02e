//! S²: unit directions in space.
use super::{Variable, so3};
use crate::Scalar;
use nalgebra::{Matrix3, Vector3};

/// A unit vector. A step has two numbers, along two fixed tangents (b₁, b₂) of the stored direction:
/// u ⊞ δ = exp(δ₁ b₁ + δ₂ b₂) u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction<T = f64>(pub Vector3<T>);

impl Direction {
    /// The direction of a vector; `None` where its length is 0 or not finite.
    pub fn new(vector: Vector3<f64>) -> Option<Self> {
        let length = vector.norm();
        (length > 0.0 && length.is_finite()).then(|| Direction(vector / length))
    }
}

impl Variable for Direction {
    type Over<T: Scalar> = Direction<T>;

    fn ambient(&self) -> usize {
        3
    }

    fn tangent(&self) -> usize {
        2
    }

    fn store(over: &Self, x: &mut [f64]) {
        x.copy_from_slice((over.0 / over.0.norm()).as_slice());
    }

    fn load(x: &[f64]) -> Self {
        Direction(Vector3::new(x[0], x[1], x[2]))
    }

    fn retract<T: Scalar>(x: &[f64], delta: impl Fn(usize) -> T) -> Direction<T> {
        let (b1, b2) = tangents(x);
        let (d1, d2) = (delta(0), delta(1));
        let w = Vector3::from_fn(|i, _| d1 * b1[i] + d2 * b2[i]);
        Direction(so3::apply(&so3::exp(&w), &Vector3::new(x[0], x[1], x[2]).map(T::from)))
    }

    fn local<T: Scalar>(x: &[f64], y: &Direction<T>, delta: &mut [T]) {
        let (b1, b2) = tangents(x);
        let u = Vector3::new(x[0], x[1], x[2]);
        // The rotation from u to y turns about u × y by the angle between them: with the frame (u, b₁, b₂) it is
        // the first column of exp(w), and log takes it from there without a division by sin 0.
        let w = so3::log(&shortest_rotation(&u.map(T::from), &y.0));
        let along = |b: &Vector3<f64>| w.x * b.x + w.y * b.y + w.z * b.z;
        delta[0] = along(&b1);
        delta[1] = along(&b2);
    }
}

/// The rotation of least angle that takes `u` to `v`: I + [c] + [c]² / (1 + u·v) with c = u × v.
fn shortest_rotation<T: Scalar>(u: &Vector3<T>, v: &Vector3<T>) -> Matrix3<T> {
    let c = Vector3::new(u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x);
    let k = Matrix3::new(T::zero(), -c.z, c.y, c.z, T::zero(), -c.x, -c.y, c.x, T::zero());
    let scale = T::one() / (u.x * v.x + u.y * v.y + u.z * v.z + 1.0);
    Matrix3::identity() + k + so3::times(&k, &k) * scale
}

/// Two unit vectors that make a right-handed orthogonal frame with the direction.
fn tangents(x: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
    let u = Vector3::new(x[0], x[1], x[2]);
    let b1 = u.cross(&Vector3::ith(u.iamin(), 1.0)).normalize();
    (b1, u.cross(&b1))
}
