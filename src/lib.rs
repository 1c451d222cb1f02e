//! Learns one generative model of a robot, its features and its cameras from a recording: joints -> poses -> 3D features ->
//! pixels.
pub mod calibrate;
pub mod camera;
pub mod chain;
pub mod cli;
pub mod detect;
pub mod doctor;
mod error;
pub mod experiments;
pub mod export;
pub mod factors;
pub mod geometry;
pub mod infer;
pub mod intrinsics;
pub mod online;
mod reach;
pub mod recording;
pub mod report;
pub mod rig;
pub mod scene;
pub mod servo;
pub mod simulate;
mod svg;
pub mod urdf;

// The command line names the library as everybody else does.
extern crate self as handeye;

pub use error::Error;
pub use handeye_solvers as solvers;

// Compiles and runs the README's Rust code.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
