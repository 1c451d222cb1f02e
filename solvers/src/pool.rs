//! Factors and functions of one type side by side, behind one call per run of them.
use crate::accumulate::{Arguments, Run, Want};
use crate::graph::Graph;
use crate::jacobian::{Columns, Jacobian, compact, forward, width};
use crate::scalar::Dual;
use crate::{Factor, Function, Loss, Noise, Variable, Variables};
use std::any::{Any, TypeId};
use std::collections::BTreeMap;
use std::ops::Range;

/// Factors take at most this many variables (see [`Variables`]).
pub(crate) const MOST: usize = 8;

/// All factors of one type.
pub(crate) trait FactorPool: Any + Send + Sync {
    fn nodes(&self, place: usize) -> &[u32];
    /// The whitened residual r/σ.
    fn residual(&self, place: usize, x: &[&[f64]]) -> Vec<f64>;
    fn loss(&self, place: usize) -> Loss;
    /// √ρ' r/σ, of which the normal equations are made, and its Jacobian by rows, where free columns come first in each argument.
    fn linearize(&self, place: usize, graph: &Graph, x: &[&[f64]], columns: &[Columns<'_>]) -> (Vec<f64>, Vec<f64>);
    /// True for Gaussian priors, which are not data.
    fn is_prior(&self) -> bool;
    /// Adds the cost of a range of factors and, if wanted, their normal equations.
    fn run(&self, range: Range<usize>, run: &mut Run<'_>);
    fn as_any_mut(&mut self) -> &mut dyn Any;
}

/// All functions of one type.
pub(crate) trait FunctionPool: Any + Send + Sync {
    fn nodes(&self, place: usize) -> &[u32];
    fn evaluate(&self, place: usize, x: &[&[f64]], y: &mut [f64], jacobian: Option<&mut Jacobian<'_>>);
    fn as_any_mut(&mut self) -> &mut dyn Any;
}

struct Placed<F: Factor<M>, const M: usize> {
    factor: F,
    nodes: <F::On as Variables>::Nodes,
    noise: Noise<M>,
    loss: Loss,
}

pub(crate) struct Pool<F: Factor<M>, const M: usize> {
    placed: Vec<Placed<F, M>>,
}

impl<F: Factor<M>, const M: usize> Default for Pool<F, M> {
    fn default() -> Self {
        Pool { placed: Vec::new() }
    }
}

impl<F: Factor<M>, const M: usize> Pool<F, M> {
    pub fn push(&mut self, factor: F, nodes: <F::On as Variables>::Nodes) -> (u32, (&mut Noise<M>, &mut Loss)) {
        let place = self.placed.len();
        self.placed.push(Placed { factor, nodes, noise: Noise::Isotropic(1.0), loss: Loss::Squared });
        let placed = &mut self.placed[place];
        (place as u32, (&mut placed.noise, &mut placed.loss))
    }
}

impl<F: Factor<M>, const M: usize> Placed<F, M> {
    /// Writes the Jacobian of √ρ' r/σ, and returns that and ρ.
    #[inline]
    fn linearize(&self, x: &[&[f64]], jacobian: Jacobian<'_>, graduation: f64) -> ([f64; M], f64) {
        let Jacobian { data, columns, width } = jacobian;
        let mut r = self.factor.evaluate(x, Some(&mut Jacobian { data: &mut *data, columns, width }));
        compact(data, width, columns);
        self.noise.whiten(&mut r, Some((&mut *data, width)));
        let (rho, slope) = self.loss.evaluate(squared(&r), graduation);
        if slope != 1.0 {
            let root = slope.sqrt();
            r.iter_mut().for_each(|x| *x *= root);
            data[..M * width].iter_mut().for_each(|x| *x *= root);
        }
        (r, rho)
    }
}

impl<F: Factor<M>, const M: usize> FactorPool for Pool<F, M> {
    fn nodes(&self, place: usize) -> &[u32] {
        self.placed[place].nodes.as_ref()
    }

    fn residual(&self, place: usize, x: &[&[f64]]) -> Vec<f64> {
        let placed = &self.placed[place];
        let mut r = placed.factor.evaluate(x, None);
        placed.noise.whiten(&mut r, None);
        r.to_vec()
    }

    fn loss(&self, place: usize) -> Loss {
        self.placed[place].loss
    }

    fn linearize(&self, place: usize, graph: &Graph, x: &[&[f64]], columns: &[Columns<'_>]) -> (Vec<f64>, Vec<f64>) {
        let width = width(columns);
        let mut data = vec![0.0; M * width];
        let jacobian = Jacobian { data: &mut data, columns, width };
        let (r, _) = self.placed[place].linearize(x, jacobian, graph.graduation);
        (r.to_vec(), data)
    }

    fn is_prior(&self) -> bool {
        false
    }

    fn run(&self, range: Range<usize>, run: &mut Run<'_>) {
        let mut batch = std::mem::take(&mut run.scratch.batch);
        let mut arguments = Arguments::none();
        for placed in &self.placed[range] {
            let nodes = placed.nodes.as_ref();
            run.look_up(nodes, &mut arguments);
            let (x, columns) = (&arguments.x[..nodes.len()], &arguments.columns[..nodes.len()]);
            if run.want == Want::Cost || arguments.active == 0 {
                batch.flush(run);
                let mut r = placed.factor.evaluate(x, None);
                placed.noise.whiten(&mut r, None);
                run.cost += 0.5 * placed.loss.evaluate(squared(&r), run.graduation).0;
                run.skip(nodes.len());
                continue;
            }
            let data = batch.room(run, nodes, &arguments, M);
            let jacobian = Jacobian { data, columns, width: arguments.width };
            let (r, rho) = placed.linearize(x, jacobian, run.graduation);
            run.cost += 0.5 * rho;
            batch.push(nodes, &arguments, &r);
        }
        batch.flush(run);
        run.scratch.batch = batch;
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
}

/// The first `len` numbers of a buffer that only ever grows.
#[inline]
pub(crate) fn grown(buffer: &mut Vec<f64>, len: usize) -> &mut [f64] {
    if buffer.len() < len {
        buffer.resize(len, 0.0);
    }
    &mut buffer[..len]
}

#[inline]
pub(crate) fn squared(r: &[f64]) -> f64 {
    r.iter().map(|x| x * x).sum()
}

/// Gaussian priors on one type of variable: r = (x ⊟ mean) / σ, coordinate by coordinate.
pub(crate) struct PriorPool<V> {
    placed: Vec<PlacedPrior>,
    variable: std::marker::PhantomData<fn() -> V>,
}

struct PlacedPrior {
    node: [u32; 1],
    mean: Vec<f64>,
    /// 1/σ per coordinate, 0 where σ is infinite.
    weights: Vec<f64>,
}

impl<V> Default for PriorPool<V> {
    fn default() -> Self {
        PriorPool { placed: Vec::new(), variable: std::marker::PhantomData }
    }
}

impl<V: Variable<Over<f64> = V>> PriorPool<V> {
    pub fn push(&mut self, node: u32, mean: &V, sigmas: &[f64]) -> u32 {
        let mut stored = vec![0.0; mean.ambient()];
        V::store(mean, &mut stored);
        let mut weights: Vec<f64> = sigmas.iter().map(|sigma| 1.0 / sigma).collect();
        weights.resize(mean.tangent(), 0.0);
        self.placed.push(PlacedPrior { node: [node], mean: stored, weights });
        self.placed.len() as u32 - 1
    }

    fn whitened(&self, prior: &PlacedPrior, x: &[f64], r: &mut [f64]) {
        V::local::<f64>(&prior.mean, &V::load(x), r);
        for (r, w) in r.iter_mut().zip(&prior.weights) {
            *r *= w;
        }
    }

    fn differentiate(&self, prior: &PlacedPrior, x: &[f64], jacobian: Jacobian<'_>, steps: &mut Vec<Dual>) {
        let Jacobian { data, columns, width } = jacobian;
        steps.resize(prior.weights.len(), Dual::from(0.0));
        forward::<(V,)>(&[x], &mut Jacobian { data: &mut *data, columns, width }, steps, |(y,), steps| {
            V::local(&prior.mean, &y, steps)
        });
        compact(data, width, columns);
        for (row, w) in prior.weights.iter().enumerate() {
            data[row * width..(row + 1) * width].iter_mut().for_each(|x| *x *= w);
        }
    }
}

impl<V: Variable<Over<f64> = V>> FactorPool for PriorPool<V> {
    fn nodes(&self, place: usize) -> &[u32] {
        &self.placed[place].node
    }

    fn residual(&self, place: usize, x: &[&[f64]]) -> Vec<f64> {
        let prior = &self.placed[place];
        let mut r = vec![0.0; prior.weights.len()];
        self.whitened(prior, x[0], &mut r);
        r
    }

    fn loss(&self, _place: usize) -> Loss {
        Loss::Squared
    }

    fn linearize(&self, place: usize, _graph: &Graph, x: &[&[f64]], columns: &[Columns<'_>]) -> (Vec<f64>, Vec<f64>) {
        let (prior, width) = (&self.placed[place], width(columns));
        let mut data = vec![0.0; prior.weights.len() * width];
        let jacobian = Jacobian { data: &mut data, columns, width };
        self.differentiate(prior, x[0], jacobian, &mut Vec::new());
        (self.residual(place, x), data)
    }

    fn is_prior(&self) -> bool {
        true
    }

    fn run(&self, range: Range<usize>, run: &mut Run<'_>) {
        let mut batch = std::mem::take(&mut run.scratch.batch);
        let mut residual = std::mem::take(&mut run.scratch.residual);
        let mut steps = std::mem::take(&mut run.scratch.steps);
        let mut arguments = Arguments::none();
        for prior in &self.placed[range] {
            run.look_up(&prior.node, &mut arguments);
            let rows = prior.weights.len();
            let r = grown(&mut residual, rows);
            self.whitened(prior, arguments.x[0], r);
            run.cost += 0.5 * squared(r);
            if run.want == Want::Cost || arguments.active == 0 {
                batch.flush(run);
                run.skip(1);
                continue;
            }
            let columns = &arguments.columns[..1];
            let data = batch.room(run, &prior.node, &arguments, rows);
            let jacobian = Jacobian { data, columns, width: arguments.width };
            self.differentiate(prior, arguments.x[0], jacobian, &mut steps);
            batch.push(&prior.node, &arguments, r);
        }
        batch.flush(run);
        run.scratch.batch = batch;
        run.scratch.residual = residual;
        run.scratch.steps = steps;
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
}

struct PlacedFunctions<F: Function> {
    placed: Vec<(F, <F::On as Variables>::Nodes)>,
}

impl<F: Function> FunctionPool for PlacedFunctions<F> {
    fn nodes(&self, place: usize) -> &[u32] {
        self.placed[place].1.as_ref()
    }

    fn evaluate(&self, place: usize, x: &[&[f64]], y: &mut [f64], jacobian: Option<&mut Jacobian<'_>>) {
        self.placed[place].0.evaluate(x, y, jacobian);
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
}

/// Puts a function beside the others of its type; returns (place, pool).
pub(crate) fn push_function<F: Function>(
    pools: &mut Vec<Box<dyn FunctionPool>>,
    index: &mut BTreeMap<TypeId, usize>,
    function: F,
    nodes: <F::On as Variables>::Nodes,
) -> (u32, u32) {
    let next = pools.len();
    let pool = *index.entry(TypeId::of::<F>()).or_insert(next);
    if pool == next {
        pools.push(Box::new(PlacedFunctions::<F> { placed: Vec::new() }));
    }
    let typed = pools[pool].as_any_mut().downcast_mut::<PlacedFunctions<F>>().expect("a pool is found by its type");
    typed.placed.push((function, nodes));
    (typed.placed.len() as u32 - 1, pool as u32)
}
