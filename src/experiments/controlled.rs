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

/// How the errors went down.
#[derive(Clone, Debug, PartialEq)]
pub struct Convergence {
    /// Sum of the absolute errors before each command after the first exploring and after the last [px]; fewer where it was stopped.
    pub errors: Vec<f64>,
    /// Condition number after exploring; `None` where that found none.
    pub condition: Option<f64>,
    /// Why it was stopped, where it was.
    pub stop: Option<Stop>,
}

/// Explores, and servoes for as many commands, of which those that explore again on the way are some. `watch` is shown where things are before
/// each of these commands and after the last, with what is being done.
///
/// Errors: what [`Uncalibrated::new`] refuses; those of the rows and of carrying out.
pub fn servo<W: Controlled>(
    world: &mut W,
    settings: &Settings,
    commands: usize,
    watch: &mut dyn FnMut(&W, &Phase),
) -> Result<Convergence, Error> {
    let rows = world.rows()?;
    let mut controller = Uncalibrated::new(world.quantities(), rows, settings.clone())?;
    let mut limits = LimitRows::default();
    limits.clear(world.quantities().len());
    let mut found = Convergence { errors: Vec::new(), condition: None, stop: None };
    while found.errors.len() <= commands {
        let (errors, readings) = (world.errors(), world.readings());
        let command = controller.step(&readings, &errors, &limits, 1.0)?;
        let (motion, phase) = (command.motion.to_vec(), command.phase.clone());
        let is_first = matches!(phase, Phase::Exploring | Phase::Waiting(_));
        let has_explored = !is_first || !found.errors.is_empty();
        if has_explored {
            if let (true, Some(estimate)) = (found.errors.is_empty(), controller.estimate()) {
                found.condition = Some(estimate.condition());
            }
            found.errors.push(errors.iter().filter(|error| error.is_finite()).map(|error| error.abs()).sum());
            watch(world, &phase);
        }
        if let Phase::Stopped(stop) = phase {
            found.stop = Some(stop);
            break;
        }
        if found.errors.len() <= commands {
            world.carry_out(&motion)?;
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors J q + c, of which no motion takes c away.
    struct Unreachable {
        at: [f64; 2],
        carried_out: usize,
    }

    impl Controlled for Unreachable {
        fn quantities(&self) -> Vec<Quantity> {
            ["x", "y"].map(|name| Quantity { name: name.to_owned(), ..Quantity::default() }).to_vec()
        }

        fn rows(&mut self) -> Result<Vec<Row>, Error> {
            Ok(vec![Row { sd: 0.1, camera: 0 }; 4])
        }

        fn readings(&self) -> Vec<f64> {
            self.at.to_vec()
        }

        fn errors(&mut self) -> Vec<f64> {
            let [x, y] = [self.at[0] - 0.1, self.at[1] + 0.2];
            vec![200.0 * x + 20.0, 200.0 * y + 20.0, 200.0 * x - 20.0, 200.0 * y - 20.0]
        }

        fn carry_out(&mut self, motion: &[f64]) -> Result<(), Error> {
            self.at.iter_mut().zip(motion).for_each(|(at, motion)| *at += motion);
            self.carried_out += 1;
            Ok(())
        }
    }

    #[test]
    fn commands_that_explore_again_count_as_the_others_do() {
        const COMMANDS: usize = 60;
        let mut world = Unreachable { at: [0.0; 2], carried_out: 0 };
        let mut watched = Vec::new();
        let found = servo(&mut world, &Settings::default(), COMMANDS, &mut |world, phase| {
            watched.push((world.carried_out, phase.clone()));
        })
        .unwrap();
        assert_eq!((found.stop, found.errors.len()), (None, COMMANDS + 1));
        let first = watched[0].0;
        assert!(watched.iter().enumerate().all(|(index, (carried_out, _))| *carried_out == first + index));
        assert_eq!(world.carried_out, first + COMMANDS);
        assert!(watched.iter().any(|(_, phase)| *phase == Phase::Exploring), "nothing made it explore again");
    }
}
