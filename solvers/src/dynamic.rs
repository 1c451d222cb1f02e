//! Residuals whose size and arguments are known at run time only, such as those that another language computes.
use crate::accumulate::{Arguments, Run, Want};
use crate::graph::Node;
use crate::jacobian::{Columns, Jacobian, compact, width};
use crate::pool::{FactorPool, MOST, grown, squared};
use crate::{Error, FactorKey, Graph, Key, Loss};
use std::any::{Any, TypeId};
use std::ops::Range;

/// A residual r(x) of a length, and on variables, that are known at run time only. Where both are known when the program is written,
/// [`crate::Factor`] is faster, and its derivatives come for free.
pub trait DynamicFactor: Send + Sync + 'static {
    /// Writes the residual, before noise and loss, to `r`. `x`: the variables as they are stored.
    fn residual(&self, x: &[&[f64]], r: &mut [f64]);

    /// Writes the residual and its Jacobian, and returns true; or returns false where derivatives are not known, which are then taken by
    /// central differences.
    fn linearize(&self, _x: &[&[f64]], _r: &mut [f64], _jacobian: &mut Jacobian<'_>) -> bool {
        false
    }
}

/// Names a node of any type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnyKey(u32);

impl<V> From<Key<V>> for AnyKey {
    fn from(key: Key<V>) -> Self {
        AnyKey(key.index)
    }
}

/// The noise and the loss of a factor that was just added.
pub struct DynamicSettings<'a> {
    /// Names the factor.
    pub key: FactorKey,
    placed: &'a mut Placed,
}

impl DynamicSettings<'_> {
    /// One standard deviation for every component, in the residual's unit.
    pub fn sigma(self, sigma: f64) -> Self {
        self.placed.weights.fill(1.0 / sigma);
        self
    }

    /// One standard deviation per component; those that are missing stay.
    pub fn sigmas(self, sigmas: &[f64]) -> Self {
        self.placed.weights.iter_mut().zip(sigmas).for_each(|(weight, sigma)| *weight = 1.0 / sigma);
        self
    }

    /// The loss; its width is in standard deviations.
    pub fn loss(self, loss: Loss) -> Self {
        self.placed.loss = loss;
        self
    }
}

impl Graph {
    /// Adds a factor of `rows` components on one to eight nodes, with unit noise and the squared loss until told otherwise.
    ///
    /// Errors: [`Error::Arguments`] where there are none or more.
    pub fn dynamic_factor(
        &mut self,
        factor: impl DynamicFactor,
        rows: usize,
        on: &[AnyKey],
    ) -> Result<DynamicSettings<'_>, Error> {
        if on.is_empty() || on.len() > MOST {
            return Err(Error::Arguments { found: on.len(), most: MOST });
        }
        self.revision += 1;
        let next = self.factors.len();
        let pool = *self.factor_pools.entry(TypeId::of::<DynamicPool>()).or_insert(next);
        if pool == next {
            self.factors.push(Box::new(DynamicPool::default()));
        }
        let typed = self.factors[pool].as_any_mut().downcast_mut::<DynamicPool>().expect("a pool is found by its type");
        let place = typed.placed.len();
        typed.placed.push(Placed {
            factor: Box::new(factor),
            nodes: on.iter().map(|key| key.0).collect(),
            weights: vec![1.0; rows],
            loss: Loss::Squared,
        });
        let key = FactorKey { pool: pool as u32, place: place as u32 };
        self.order.push(key);
        Ok(DynamicSettings { key, placed: &mut typed.placed[place] })
    }
}

struct Placed {
    factor: Box<dyn DynamicFactor>,
    nodes: Vec<u32>,
    /// 1/σ per component.
    weights: Vec<f64>,
    loss: Loss,
}

impl Placed {
    fn whiten(&self, r: &mut [f64]) {
        r.iter_mut().zip(&self.weights).for_each(|(r, weight)| *r *= weight);
    }

    /// Writes √ρ' r/σ and its Jacobian, and returns ρ.
    fn linearize(&self, nodes: &[Node], x: &[&[f64]], r: &mut [f64], jacobian: Jacobian<'_>, graduation: f64) -> f64 {
        let Jacobian { data, columns, width } = jacobian;
        let mut jacobian = Jacobian { data: &mut *data, columns, width };
        if !self.factor.linearize(x, r, &mut jacobian) {
            self.differences(nodes, x, r, &mut jacobian);
        }
        compact(data, width, columns);
        self.whiten(r);
        let (rho, slope) = self.loss.evaluate(squared(r), graduation);
        let root = slope.sqrt();
        r.iter_mut().for_each(|r| *r *= root);
        for (row, weight) in data.chunks_exact_mut(width).zip(&self.weights) {
            row.iter_mut().for_each(|x| *x *= weight * root);
        }
        rho
    }

    /// The residual, and its Jacobian by central differences.
    fn differences(&self, nodes: &[Node], x: &[&[f64]], r: &mut [f64], jacobian: &mut Jacobian<'_>) {
        self.factor.residual(x, r);
        let mut moved: Vec<Vec<f64>> = x.iter().map(|x| x.to_vec()).collect();
        let mut sides = [vec![0.0; r.len()], vec![0.0; r.len()]];
        for (k, &id) in self.nodes.iter().enumerate() {
            let node = &nodes[id as usize];
            let mut delta = vec![0.0; node.tangent];
            for i in (0..node.tangent).filter(|i| jacobian.wanted_coordinate(k, *i)).collect::<Vec<_>>() {
                // A coordinate that is added has a size of its own, a turn has that of a radian.
                let size = if node.ambient == node.tangent { x[k][i].abs().max(1.0) } else { 1.0 };
                let step = STEP * size;
                for (side, sign) in sides.iter_mut().zip([1.0, -1.0]) {
                    delta[i] = sign * step;
                    (node.retract)(x[k], &delta, &mut moved[k]);
                    let arguments: Vec<&[f64]> = moved.iter().map(Vec::as_slice).collect();
                    self.factor.residual(&arguments, side);
                }
                delta[i] = 0.0;
                let [above, below] = &sides;
                for (row, (above, below)) in above.iter().zip(below).enumerate() {
                    jacobian.row(row, k)[i] = (above - below) / (2.0 * step);
                }
            }
            moved[k].copy_from_slice(x[k]);
        }
    }
}

/// Step of the differences, the cube root of the rounding: where their own error and that of rounding are equal.
const STEP: f64 = 6.055e-6;

#[derive(Default)]
struct DynamicPool {
    placed: Vec<Placed>,
}

impl FactorPool for DynamicPool {
    fn nodes(&self, place: usize) -> &[u32] {
        &self.placed[place].nodes
    }

    fn residual(&self, place: usize, x: &[&[f64]]) -> Vec<f64> {
        let placed = &self.placed[place];
        let mut r = vec![0.0; placed.weights.len()];
        placed.factor.residual(x, &mut r);
        placed.whiten(&mut r);
        r
    }

    fn loss(&self, place: usize) -> Loss {
        self.placed[place].loss
    }

    fn linearize(&self, place: usize, graph: &Graph, x: &[&[f64]], columns: &[Columns<'_>]) -> (Vec<f64>, Vec<f64>) {
        let (placed, width) = (&self.placed[place], width(columns));
        let (mut r, mut data) = (vec![0.0; placed.weights.len()], vec![0.0; placed.weights.len() * width]);
        placed.linearize(&graph.nodes, x, &mut r, Jacobian { data: &mut data, columns, width }, graph.graduation);
        (r, data)
    }

    fn is_prior(&self) -> bool {
        false
    }

    fn run(&self, range: Range<usize>, run: &mut Run<'_>) {
        let mut batch = std::mem::take(&mut run.scratch.batch);
        let mut residual = std::mem::take(&mut run.scratch.residual);
        let mut arguments = Arguments::none();
        let nodes = run.nodes;
        for placed in &self.placed[range] {
            run.look_up(&placed.nodes, &mut arguments);
            let n = placed.nodes.len();
            let (x, columns) = (&arguments.x[..n], &arguments.columns[..n]);
            let rows = placed.weights.len();
            let r = grown(&mut residual, rows);
            if run.want == Want::Cost || arguments.active == 0 {
                placed.factor.residual(x, r);
                placed.whiten(r);
                run.cost += 0.5 * placed.loss.evaluate(squared(r), run.graduation).0;
                run.skip(n);
                continue;
            }
            let width = arguments.width;
            let data = batch.room(run, &placed.nodes, &arguments, rows);
            let jacobian = Jacobian { data, columns, width };
            run.cost += 0.5 * placed.linearize(nodes, x, r, jacobian, run.graduation);
            batch.push(&placed.nodes, &arguments, r);
            // The next may be of another size.
            batch.flush(run);
        }
        run.scratch.batch = batch;
        run.scratch.residual = residual;
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
}
