//! Random parts of the data, as the masks of passes.
use crate::workspace::Mask;
use crate::{FactorKey, Graph};
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// Parts of the data that come first.
#[derive(Clone, Debug, PartialEq)]
pub struct Minibatches {
    /// Factors that belong together, such as those of one sample. Factors of no group are always taken.
    pub groups: Vec<Vec<FactorKey>>,
    /// Groups in a minibatch.
    pub size: usize,
    /// How many minibatches there are.
    pub batches: usize,
    /// Steps on each minibatch.
    pub iterations_each: usize,
    /// Decides which groups are in which.
    pub seed: u64,
}

impl Minibatches {
    /// Takes the next random groups.
    pub(crate) fn draw(&self, graph: &Graph, random: &mut ChaCha8Rng) -> Mask {
        let mut mask: Mask = graph.factors.iter().map(|_| Vec::new()).collect();
        graph.order.iter().for_each(|key| mask[key.pool as usize].push(true));
        let mut set = |group: usize, taken: bool| {
            self.groups[group].iter().for_each(|key| mask[key.pool as usize][key.place as usize] = taken);
        };
        let mut groups: Vec<usize> = (0..self.groups.len()).collect();
        groups.shuffle(random);
        groups.iter().for_each(|&group| set(group, false));
        groups.iter().take(self.size).for_each(|&group| set(group, true));
        mask
    }
}
