//! An arm that a virtual spring pulls, and a table that it may press on.
use crate::Error;
use crate::chain::{JointChain, Posture};
use crate::rig::{Model, Rig};
use handeye_solvers::Pose;
use nalgebra::{DMatrix, DVector, Vector3};

/// An arm whose motors carry its weight and pull with τ = Jᵀ K (x_d - x): as if a spring led from the tip's origin x to the centre x_d. After
/// Ramirez, "Towards Practical Uncalibrated Visual Servoing", 2016, section 4.4.3.
pub struct SpringArm {
    chain: JointChain,
    joints: Vec<f64>,
    posture: Posture,
    settings: Spring,
    contact: f64,
}

/// The spring, and what it meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// K along the world's axes [N/m].
    pub stiffness: [f64; 3],
    /// What brakes every joint [N m s/rad, or N s/m].
    pub damping: f64,
    /// A table below the tip, where there is one.
    pub table: Option<Table>,
}

/// A horizontal table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table {
    /// Height of its top [m].
    pub height: f64,
    /// What it gives way by [N/m].
    pub stiffness: f64,
    /// Coefficient of friction.
    pub friction: f64,
}

/// Steps per second of simulated time.
const RATE: f64 = 500.0;

/// More seconds than anybody pulls for.
const LONGEST: f64 = 1e6;

/// Below this speed friction grows with the speed, so that what sticks creeps [m/s].
const CREEP: f64 = 1e-3;

impl SpringArm {
    /// At these joints [rad or m], at rest.
    ///
    /// Errors: [`Error::Unusable`] where the rig is not complete, the joints are not as many as its, or a number is out of range.
    pub fn new(rig: &Rig, joints: &[f64], settings: Spring) -> Result<Self, Error> {
        let n = rig.robot.joints.len();
        super::check_joints(joints, n)?;
        let table = settings.table.map_or([0.0, 1.0, 0.0], |table| [table.height, table.stiffness, table.friction]);
        let is_fine = |x: &f64| (0.0..f64::INFINITY).contains(x);
        let is_soft = settings.damping > 0.0 && settings.damping.is_finite() && settings.stiffness.iter().all(is_fine);
        if !is_soft || !table[0].is_finite() || !is_fine(&table[1]) || !is_fine(&table[2]) {
            return Err(Error::Unusable(format!(
                "{settings:?}: stiffness and friction are 0 or more, damping above 0"
            )));
        }
        let chain = Model::new(rig)?.joint_chain();
        let mut posture = Posture::default();
        chain.posture(joints, &mut posture);
        Ok(SpringArm { chain, joints: joints.to_vec(), posture, settings, contact: 0.0 })
    }

    /// Where the joints are [rad or m].
    pub fn joints(&self) -> &[f64] {
        &self.joints
    }

    /// Where the tip is, `world_from_tip`.
    pub fn tip(&self) -> Pose {
        self.posture.tip()
    }

    /// How hard the tip presses on the table [N]; 0 where it does not touch it.
    pub fn contact(&self) -> f64 {
        self.contact
    }

    /// Lets the spring pull for some seconds, its centre moving evenly from one place of the world to another [m]. Inertia is left out: the
    /// arm's brakes are taken to be stronger.
    ///
    /// Errors: [`Error::Unusable`], and nothing moves, where a number is not finite, the seconds are below 0 or above a million, or forces
    /// are too large for numbers.
    pub fn pull(&mut self, from: &Vector3<f64>, to: &Vector3<f64>, seconds: f64) -> Result<(), Error> {
        let is_finite = from.iter().chain(to).all(|x| x.is_finite());
        if !is_finite || !(0.0..=LONGEST).contains(&seconds) {
            let [from, to] = [from, to].map(|place| [place.x, place.y, place.z]);
            return Err(Error::Unusable(format!(
                "a spring's centre cannot go from {from:?} to {to:?} m in {seconds} s: places must be finite, and seconds from 0 to {LONGEST}"
            )));
        }
        let before = self.joints.clone();
        self.pull_on(from, to, seconds).inspect_err(|_| {
            self.chain.posture(&before, &mut self.posture);
            self.joints = before;
        })
    }

    fn pull_on(&mut self, from: &Vector3<f64>, to: &Vector3<f64>, seconds: f64) -> Result<(), Error> {
        let too_large = || Error::Unusable("the forces of a spring are too large for numbers".to_owned());
        let n = self.joints.len();
        let steps = (RATE * seconds).ceil().max(1.0);
        let h = seconds / steps;
        let mut velocity = Vector3::<f64>::zeros();
        for step in 1..=steps as usize {
            let centre = from.lerp(to, step as f64 / steps);
            let tip = self.tip().translation;
            // D q̇ = Jᵀ (K (x_d - x - h J q̇) + contact), implicit in the velocity, and so stable whatever the stiffness.
            let columns: Vec<Vector3<f64>> = self.posture.axes.iter().map(|axis| axis.twist(&tip).1).collect();
            let slopes = DMatrix::from_fn(3, n, |row, column| columns[column][row]);
            let mut force = Vector3::from(self.settings.stiffness).component_mul(&(centre - tip));
            let mut resistance = Vector3::from(self.settings.stiffness) * h;
            let depth = self.settings.table.map_or(0.0, |table| (table.height - tip.z).max(0.0));
            if let Some(table) = self.settings.table.filter(|_| depth > 0.0) {
                let normal = table.stiffness * depth;
                force.z += normal;
                resistance.z += table.stiffness * h;
                let slide = velocity.xy().norm().max(CREEP);
                resistance.x += table.friction * normal / slide;
                resistance.y += table.friction * normal / slide;
            }
            let weighted = DMatrix::from_fn(3, n, |row, column| resistance[row] * slopes[(row, column)]);
            let system = slopes.transpose() * weighted + DMatrix::identity(n, n) * self.settings.damping;
            let pull = slopes.transpose() * DVector::from_column_slice(force.as_slice());
            let speed = system.cholesky().ok_or_else(too_large)?.solve(&pull);
            if speed.iter().any(|speed| !speed.is_finite()) {
                return Err(too_large());
            }
            self.joints.iter_mut().zip(speed.iter()).for_each(|(joint, speed)| *joint += h * speed);
            let moved = &slopes * &speed;
            velocity = Vector3::new(moved[0], moved[1], moved[2]);
            self.chain.posture(&self.joints, &mut self.posture);
        }
        let depth = |table: Table| table.stiffness * (table.height - self.tip().translation.z).max(0.0);
        self.contact = self.settings.table.map_or(0.0, depth);
        Ok(())
    }
}
