//! Where what is moved without a rig is: as read, or the sum of the motions so far.
use super::Takes;
use super::uncalibrated::Quantity;
use crate::Error;
use crate::recording::Command;

/// Readings of what is controlled, whether a robot gives any or not.
#[derive(Debug)]
pub(super) struct Readings {
    quantities: Vec<Quantity>,
    /// Where they are now, and the sum of all motions, in each one's unit.
    now: Vec<f64>,
    commanded: Vec<f64>,
    /// Whether the robot gave any when they were taken last; `None` before.
    is_read: Option<bool>,
}

impl Readings {
    /// Of quantities with these limits.
    pub fn new(quantities: Vec<Quantity>) -> Self {
        let n = quantities.len();
        Readings { quantities, now: vec![0.0; n], commanded: vec![0.0; n], is_read: None }
    }

    /// What is controlled, without ends where it is not read: nobody knows how far it is to them, and the robot stops there.
    pub fn quantities(&self) -> Vec<Quantity> {
        let mut quantities = self.quantities.clone();
        if self.is_read == Some(false) {
            quantities.iter_mut().for_each(|one| (one.limits.lower, one.limits.upper) = (None, None));
        }
        quantities
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.quantities.len()
    }

    /// Sets the dead band of each; they are as many.
    pub fn set_dead_bands(&mut self, widths: impl IntoIterator<Item = f64>) {
        self.quantities.iter_mut().zip(widths).for_each(|(quantity, width)| quantity.dead_band = width);
    }

    /// Takes what was read, empty where the robot gives nothing. True where servoing has to begin anew, as what was taken
    /// before was a sum of motions, which starts at 0 and not where things are.
    ///
    /// Errors: [`Error::NotEnoughData`] where nothing was read and something has to be, as it `must` or was before: no sum stands for it.
    pub fn take(&mut self, read: &[f64], must: bool) -> Result<bool, Error> {
        let is_read = !read.is_empty();
        if !is_read && (must || self.is_read == Some(true)) {
            return Err(Error::NotEnoughData("the joints are not read, or not as numbers".to_owned()));
        }
        let anew = self.is_read == Some(false) && is_read;
        self.is_read = Some(is_read);
        self.now.clear();
        self.now.extend(if is_read { read } else { &self.commanded });
        Ok(anew)
    }

    /// Where they are.
    pub fn now(&self) -> &[f64] {
        &self.now
    }

    /// A motion is commanded.
    pub fn moves(&mut self, motion: &[f64]) {
        self.commanded.iter_mut().zip(motion).for_each(|(at, by)| *at += by);
    }

    /// The command for a motion of the next `dt` seconds; `None` of a robot that does not take joints.
    pub fn command(&self, takes: Takes, motion: &[f64], dt: f64) -> Option<Command> {
        match takes {
            Takes::Joints => Some(Command::Joints(self.now.iter().zip(motion).map(|(at, by)| at + by).collect())),
            Takes::JointDelta => Some(Command::JointDelta(motion.to_vec())),
            Takes::JointVelocity => Some(Command::JointVelocity(motion.iter().map(|motion| motion / dt).collect())),
            Takes::PoseDelta | Takes::PoseVelocity => None,
        }
    }
}
