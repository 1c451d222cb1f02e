//! URDF files: the arm between two links as Denavit-Hartenberg rows, and calibrated joint origins in place of those that stand there.
//!
//! A URDF's joint moves about or along an axis through the origin of its own link, as a row of the modified convention does. So
//! each link keeps its frame, fixed against that of its row (`chain::Frames`), and what calibration changes of the rows is, read
//! back, a change of the joints' origins alone: axes, meshes, collision shapes and everything else of the file stay true.
mod arm;
mod document;
mod rows;
mod write;
mod xml;

pub use arm::{Arm, ArmJoint};
pub use document::Urdf;
