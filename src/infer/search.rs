//! From a start to the minimum that it leads to, in pixels.
use super::branch::{APART, Minimum};
use super::information::Information;
use super::joints::Inference;
use super::pose::is_plausible;
use super::prior::Prior;
use super::sighting::Telling;
use super::starts::Starts;

/// Most Levenberg-Marquardt iterations from one start.
const ITERATIONS: usize = 40;

/// Relative decrease of the cost at which they stop.
const CONVERGED: f64 = 1e-10;

/// Expected decrease of the cost at which a last step is taken unseen: it is shorter than 1e-5 standard deviations.
const ARRIVED: f64 = 1e-10;

/// A start far from the solution is given up where this many iterations have not halved its cost.
const PATIENCE: usize = 6;

impl Inference {
    /// Starts all over the limits, refined in pixels.
    pub(super) fn search(
        &mut self,
        minima: &mut Vec<Minimum>,
        seen: &Telling,
        information: &Information,
        prior: &Prior,
    ) {
        let n = self.chain.len();
        let mut starts = Starts::new(n, self.options.seed);
        for _ in 0..self.options.pixel_starts {
            let mut start = vec![0.0; n];
            starts.next(&self.limits, &mut start);
            self.add(minima, seen, information, prior, start);
        }
    }

    /// Adds where a start leads to, if it is new.
    pub(super) fn add(
        &mut self,
        minima: &mut Vec<Minimum>,
        seen: &Telling,
        information: &Information,
        prior: &Prior,
        start: Vec<f64>,
    ) {
        let Some(minimum) = self.refine(seen, information, prior, start, true) else { return };
        if minima.iter().all(|other| self.limits.distance(&other.joints, &minimum.joints) > APART) {
            minima.push(minimum);
        }
    }

    /// The minimum that a start leads to. `None` where the search breaks down, or, `hasty`, is slow.
    pub(super) fn refine(
        &mut self,
        seen: &Telling,
        information: &Information,
        prior: &Prior,
        mut joints: Vec<f64>,
        hasty: bool,
    ) -> Option<Minimum> {
        self.limits.bring_inside(&mut joints, &information.mean);
        self.descend(seen, information, &mut joints, hasty)?;
        // Once more without what limits say, which moves what the pixels determine and leaves the rest where it is.
        self.descend(seen, &information.readings(), &mut joints, hasty)?;
        self.limits.bring_inside(&mut joints, &information.mean);
        let cost = self.error.look((&self.chain, &self.views), seen, information, &joints);
        let (settled, open) = information.settled(&self.error.square());
        let known = self.error.seen + prior.cost(&joints, &self.limits);
        cost.is_finite().then(|| Minimum::new(&self.error, known, joints, (&settled, open)))
    }

    /// The minimum near what is believed of the joints. `weight`: -ln of the belief's density at its mean; `limits`: what else is
    /// known, which tells what is open.
    pub(super) fn refine_belief(
        &mut self,
        seen: &Telling,
        belief: &Information,
        limits: &Information,
        weight: f64,
    ) -> Option<Minimum> {
        let mut joints = belief.mean.clone();
        self.descend(seen, belief, &mut joints, false)?;
        let cost = self.error.look((&self.chain, &self.views), seen, belief, &joints);
        let (_, open) = limits.settled(&(self.error.square() + belief.square() - limits.square()));
        let mut minimum = Minimum::new(&self.error, cost, joints.clone(), (belief, open));
        minimum.cost += weight;
        self.limits.bring_inside(&mut minimum.joints, &joints);
        cost.is_finite().then_some(minimum)
    }

    /// Levenberg-Marquardt in pixels inside the limits.
    fn descend(&mut self, seen: &Telling, information: &Information, joints: &mut Vec<f64>, hasty: bool) -> Option<()> {
        let Inference { chain, views, limits, error, trial, .. } = self;
        let mut cost = error.look((chain, views), seen, information, joints);
        let (mut lambda, mut mark, mut marked) = (1e-6, cost, 0);
        for iteration in 0..ITERATIONS {
            let step = error.step(limits, joints, lambda)?;
            trial.clear();
            trial.extend(joints.iter().zip(step).map(|(joint, s)| joint + s));
            if error.expected_decrease() < ARRIVED {
                std::mem::swap(joints, trial);
                break;
            }
            let tried = error.look((chain, views), seen, information, trial);
            let change = cost - tried;
            if change > -CONVERGED * (1.0 + cost) {
                std::mem::swap(joints, trial);
                (cost, lambda) = (tried, (0.1 * lambda).max(1e-9));
                if change < CONVERGED * (1.0 + cost) {
                    break;
                }
            } else {
                lambda = (10.0 * lambda).max(1e-3);
                error.look((chain, views), seen, information, joints);
                if lambda > 1e6 {
                    break;
                }
            }
            if cost < 0.5 * mark {
                (mark, marked) = (cost, iteration);
            } else if hasty && iteration - marked >= PATIENCE && !is_plausible(cost, seen.coordinates()) {
                return None;
            }
        }
        Some(())
    }
}
