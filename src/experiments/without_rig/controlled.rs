//! Something that is moved without a rig, and what is seen of it.
use crate::Error;
use crate::servo::LimitRows;
use crate::servo::uncalibrated::{Phase, Quantity, Row, Settings, Stop, Uncalibrated};

/// Something that is moved, and errors that shall become 0.
pub trait Controlled {
    /// What is moved.
    fn quantities(&self) -> Vec<Quantity>;

    /// What is seen, where it is now.
    ///
    /// Errors: [`Error::NotEnoughData`] where a row is not seen.
    fn rows(&mut self) -> Result<Vec<Row>, Error>;

    /// Where every quantity is, in its unit.
    fn readings(&self) -> Vec<f64>;

    /// Every row [px]; NaN where it is not seen.
    fn errors(&mut self) -> Vec<f64>;

    /// Moves every quantity by this much, in its unit.
    ///
    /// Errors: [`Error::Unusable`] for what cannot be carried out.
    fn carry_out(&mut self, motion: &[f64]) -> Result<(), Error>;
}

/// How servoing went.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Sum of the absolute errors before each command after exploring and after the last [px]; fewer where it was stopped.
    pub errors: Vec<f64>,
    /// Condition number after exploring; `None` where that found none.
    pub condition: Option<f64>,
    /// Why it was stopped, where it was.
    pub stop: Option<Stop>,
}

/// Explores, and servoes for as many commands; `watch` is shown what became of each, those of exploring included.
///
/// Errors: what [`Uncalibrated::new`] refuses; those of the rows.
pub fn serve<W: Controlled>(
    world: &mut W,
    settings: &Settings,
    commands: usize,
    watch: &mut dyn FnMut(&W, &Phase),
) -> Result<Course, Error> {
    let rows = world.rows()?;
    let mut servo = Uncalibrated::new(world.quantities(), rows, settings.clone())?;
    let mut limits = LimitRows::default();
    limits.clear(world.quantities().len());
    let mut course = Course { errors: Vec::new(), condition: None, stop: None };
    while course.errors.len() <= commands {
        let (errors, readings) = (world.errors(), world.readings());
        let command = servo.step(&readings, &errors, &limits, 1.0)?;
        let (motion, phase) = (command.motion.to_vec(), command.phase.clone());
        if phase != Phase::Exploring {
            if let (true, Some(estimate)) = (course.errors.is_empty(), servo.estimate()) {
                course.condition = Some(estimate.condition());
            }
            course.errors.push(errors.iter().filter(|error| error.is_finite()).map(|error| error.abs()).sum());
        }
        watch(world, &phase);
        if let Phase::Stopped(stop) = phase {
            course.stop = Some(stop);
            break;
        }
        if course.errors.len() <= commands {
            world.carry_out(&motion)?;
        }
    }
    Ok(course)
}
