//! Away from singularities.
use super::{Arm, Configuration, Task, TaskRows};
use crate::chain::Axis;
use nalgebra::{Matrix6, Vector3, Vector6};

/// Raises Yoshikawa's measure w = √det(J Jᵀ), the volume of the tip's motions at unit joint speeds, where it is below what is wanted.
///
///   ln w + ∂(ln w)/∂q Δq = ln wanted,   ∂(ln w)/∂q_k = tr((J Jᵀ)⁻¹ ∂J/∂q_k Jᵀ)
///
/// J is the geometric Jacobian of the tip, with translations over `length`, so that w has no unit. An arm of fewer joints than J has
/// rows moves in as many directions as it has joints, and w is the volume in these. As a task of low priority it spends on this what
/// the others leave open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manipulability {
    /// Which motions of the tip count.
    pub of: TipMotion,
    /// Translation that counts as much as a turn by 1 rad [m]. Where the arm has joints for every direction it scales w and leaves
    /// the directions of its growth as they are.
    pub length: f64,
    /// The measure from which on no more is wanted; see [`Manipulability::measure`].
    pub wanted: f64,
    /// Standard deviation of ln w: 0.1 weighs a measure 10 % short like another task's error of one standard deviation.
    pub sd: f64,
}

/// Motions of the tip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TipMotion {
    /// Translations of its origin.
    Position,
    /// Translations and turns.
    Pose,
}

/// Added to every singular value of J, in squares: where one vanishes, ln w and its slopes stay finite.
const LEAST: f64 = 1e-4;

impl Manipulability {
    /// w, where the arm is.
    pub fn measure(&self, at: &Configuration) -> f64 {
        let columns = self.columns(at);
        let gram = gram(columns);
        // The product of the squared singular values, of which those that the arm has no joint or J no row for are `LEAST`².
        let directions = match self.of {
            TipMotion::Position => 3,
            TipMotion::Pose => 6,
        };
        let open = 6 - directions.min(at.posture.axes.len());
        gram.determinant().max(0.0).sqrt() / LEAST.powi(open as i32)
    }

    fn columns<'a>(&self, at: &'a Configuration) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + 'a {
        let tip = at.posture.tip().translation;
        let (of, length) = (self.of, self.length);
        at.posture.axes.iter().map(move |axis| {
            let (w, v) = axis.twist(&tip);
            (counted(of, w), v / length)
        })
    }
}

impl Task for Manipulability {
    fn rows(&self, _arm: &Arm, at: &Configuration, rows: &mut TaskRows) {
        let lacking = (self.wanted / self.measure(at)).ln();
        let Some(inverse) = gram(self.columns(at)).try_inverse() else { return };
        if lacking.is_nan() || lacking <= 0.0 {
            return;
        }
        let tip = at.posture.tip().translation;
        let twists = || at.posture.axes.iter().map(|axis: &Axis| axis.twist(&tip));
        let slopes = twists().enumerate().map(|(k, (w_k, v_k))| {
            // What is beyond a joint turns with it, and so do the columns of J; a column before it follows the tip.
            let change = |i: usize, w: Vector3<f64>, v: Vector3<f64>| {
                if k <= i { (w_k.cross(&w), w_k.cross(&v)) } else { (Vector3::zeros(), w.cross(&v_k)) }
            };
            let of_column = |(i, (w, v)): (usize, (Vector3<f64>, Vector3<f64>))| {
                let (turn, shift) = change(i, w, v);
                let column = stacked(counted(self.of, w), v / self.length);
                stacked(counted(self.of, turn), shift / self.length).dot(&(inverse * column))
            };
            twists().enumerate().map(of_column).sum::<f64>()
        });
        rows.push(slopes, lacking, self.sd);
    }
}

/// J Jᵀ + `LEAST`² I.
fn gram(columns: impl Iterator<Item = (Vector3<f64>, Vector3<f64>)>) -> Matrix6<f64> {
    let mut gram = Matrix6::identity() * (LEAST * LEAST);
    for (w, v) in columns {
        let column = stacked(w, v);
        gram.ger(1.0, &column, &column, 1.0);
    }
    gram
}

fn counted(of: TipMotion, turn: Vector3<f64>) -> Vector3<f64> {
    match of {
        TipMotion::Position => Vector3::zeros(),
        TipMotion::Pose => turn,
    }
}

fn stacked(w: Vector3<f64>, v: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z)
}
