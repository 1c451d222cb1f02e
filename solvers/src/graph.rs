//! The factor graph: free, held and derived nodes, and the factors on them.
use crate::pool::{FactorPool, FunctionPool, Pool, PriorPool, squared};
use crate::product::add_scaled;
use crate::scalar::{Dual, LANES, derivatives, seed};
use crate::{Error, Factor, Function, Key, Loss, Noise, Variable, Variables};
use std::any::TypeId;
use std::collections::BTreeMap;

/// A Bayesian network with deterministic nodes, and where its nodes are now.
///
/// A node is *free* (estimated), *held* (constant) or *derived* (computed from other nodes). A factor is a residual on
/// nodes of any kind. What is free can be changed at any time with [`Graph::hold`], [`Graph::release`] and
/// [`Graph::hold_coordinates`]: a stage of a calibration is a table of what is free.
#[derive(Default)]
pub struct Graph {
    pub(crate) nodes: Vec<Node>,
    pub(crate) values: Vec<f64>,
    pub(crate) factors: Vec<Box<dyn FactorPool>>,
    pub(crate) functions: Vec<Box<dyn FunctionPool>>,
    /// Every factor as (pool, place in the pool), in the order of adding.
    pub(crate) order: Vec<FactorKey>,
    /// Every derived node's function as (pool, place in the pool), in the order of adding.
    pub(crate) derived: Vec<DerivedNode>,
    pub(crate) factor_pools: BTreeMap<TypeId, usize>,
    function_pools: BTreeMap<TypeId, usize>,
    /// Changes whenever the structure does, so that a workspace knows that it is out of date.
    pub(crate) revision: u64,
    /// See [`Loss::evaluate`].
    pub(crate) graduation: f64,
}

/// A node: where it is stored, and which coordinates of its step are free.
pub(crate) struct Node {
    pub role: Role,
    pub start: usize,
    pub ambient: usize,
    pub tangent: usize,
    /// Free coordinates, ascending, where not all of them are.
    pub free: Option<Vec<u16>>,
    pub retract: fn(&[f64], &[f64], &mut [f64]),
    pub transport: Transport,
}

/// See [`transport`].
type Transport = fn(&[f64], &[f64], &[f64], &mut [f64]);

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Role {
    Free,
    Held,
    /// Index into [`Graph::derived`].
    Derived(u32),
}

pub(crate) struct DerivedNode {
    pub pool: u32,
    pub place: u32,
    pub node: u32,
}

/// Names a factor of a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct FactorKey {
    pub(crate) pool: u32,
    pub(crate) place: u32,
}

impl Graph {
    /// A graph without nodes.
    pub fn new() -> Self {
        Graph { graduation: 1.0, ..Graph::default() }
    }

    /// Adds a node that is estimated, starting at `value`.
    pub fn free<V: Variable<Over<f64> = V>>(&mut self, value: V) -> Key<V> {
        self.add(Role::Free, value)
    }

    /// Adds a node that stays at `value`.
    pub fn held<V: Variable<Over<f64> = V>>(&mut self, value: V) -> Key<V> {
        self.add(Role::Held, value)
    }

    /// Adds a node that is computed from others.
    pub fn derive<F: Function>(&mut self, function: F, on: <F::On as Variables>::Keys) -> Key<F::Output> {
        let nodes = F::On::nodes(on);
        let inputs: Vec<Vec<f64>> = nodes.as_ref().iter().map(|&node| self.stored(node)).collect();
        let x: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
        let value = function.compute::<f64>(F::On::seed(&x, |_, _| 0.0));
        let key = self.add(Role::Derived(self.derived.len() as u32), value);
        let (place, pool) = crate::pool::push_function(&mut self.functions, &mut self.function_pools, function, nodes);
        self.derived.push(DerivedNode { pool, place, node: key.index });
        key
    }

    fn add<V: Variable<Over<f64> = V>>(&mut self, role: Role, value: V) -> Key<V> {
        self.revision += 1;
        let key = Key::new(self.nodes.len());
        let (start, ambient) = (self.values.len(), value.ambient());
        let (tangent, retract, transport) = (value.tangent(), retract::<V> as _, transport::<V> as _);
        self.nodes.push(Node { role, start, ambient, tangent, free: None, retract, transport });
        if !matches!(role, Role::Derived(_)) {
            self.values.resize(start + ambient, 0.0);
            V::store(&value, &mut self.values[start..]);
        }
        key
    }

    /// Adds a factor, with unit noise and the squared loss until told otherwise.
    pub fn factor<F: Factor<M>, const M: usize>(
        &mut self,
        factor: F,
        on: <F::On as Variables>::Keys,
    ) -> FactorSettings<'_, M> {
        self.revision += 1;
        let next = self.factors.len();
        let pool = *self.factor_pools.entry(TypeId::of::<(F, [(); M])>()).or_insert(next);
        if pool == next {
            self.factors.push(Box::new(Pool::<F, M>::default()));
        }
        let typed = self.factors[pool].as_any_mut().downcast_mut::<Pool<F, M>>().expect("a pool is found by its type");
        let (place, settings) = typed.push(factor, F::On::nodes(on));
        let key = FactorKey { pool: pool as u32, place };
        self.order.push(key);
        FactorSettings { key, noise: settings.0, loss: settings.1 }
    }

    /// Adds a Gaussian prior: the step from `mean` to the node has these standard deviations, one per coordinate of the
    /// step; an infinite one leaves its coordinate alone. Priors are told apart from data where directions are diagnosed.
    pub fn prior<V: Variable<Over<f64> = V>>(&mut self, node: Key<V>, mean: &V, sigmas: &[f64]) -> FactorKey {
        self.revision += 1;
        let next = self.factors.len();
        let pool = *self.factor_pools.entry(TypeId::of::<PriorPool<V>>()).or_insert(next);
        if pool == next {
            self.factors.push(Box::new(PriorPool::<V>::default()));
        }
        let typed =
            self.factors[pool].as_any_mut().downcast_mut::<PriorPool<V>>().expect("a pool is found by its type");
        let key = FactorKey { pool: pool as u32, place: typed.push(node.index, mean, sigmas) };
        self.order.push(key);
        key
    }

    /// Makes a free node constant; of a derived node, nothing changes.
    pub fn hold<V>(&mut self, node: Key<V>) {
        self.change_role(node.index, Role::Free, Role::Held);
    }

    /// Makes a held node free in all its coordinates.
    pub fn release<V>(&mut self, node: Key<V>) {
        self.change_role(node.index, Role::Held, Role::Free);
        self.nodes[node.index()].free = None;
    }

    /// Holds some coordinates of a free node's step (such as one number of a vector) and frees its others.
    pub fn hold_coordinates<V>(&mut self, node: Key<V>, held: &[usize]) {
        self.revision += 1;
        let node = &mut self.nodes[node.index()];
        let free: Vec<u16> = (0..node.tangent).filter(|i| !held.contains(i)).map(|i| i as u16).collect();
        node.free = (free.len() < node.tangent).then_some(free);
    }

    fn change_role(&mut self, node: u32, from: Role, to: Role) {
        let node = &mut self.nodes[node as usize];
        if node.role == from {
            node.role = to;
            self.revision += 1;
        }
    }

    /// Where a node is now.
    pub fn value<V: Variable>(&self, node: Key<V>) -> V {
        V::load(&self.stored(node.index))
    }

    /// Moves a free or held node; a derived one follows its parents and stays where they put it.
    pub fn set<V: Variable<Over<f64> = V>>(&mut self, node: Key<V>, value: &V) {
        let place = &self.nodes[node.index()];
        if !matches!(place.role, Role::Derived(_)) {
            V::store(value, &mut self.values[place.start..place.start + place.ambient]);
        }
    }

    /// How many factors there are.
    pub fn factor_count(&self) -> usize {
        self.order.len()
    }

    /// Squared norm of a factor's whitened residual, |r/σ|², where the nodes are now.
    pub fn squared_norm(&self, factor: FactorKey) -> f64 {
        let pool = &self.factors[factor.pool as usize];
        let place = factor.place as usize;
        let inputs: Vec<Vec<f64>> = pool.nodes(place).iter().map(|&node| self.stored(node)).collect();
        let x: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
        squared(&pool.residual(place, &x))
    }

    /// The node as it is stored, computed where it is derived.
    pub(crate) fn stored(&self, node: u32) -> Vec<f64> {
        let place = &self.nodes[node as usize];
        let Role::Derived(derived) = place.role else {
            return self.values[place.start..place.start + place.ambient].to_vec();
        };
        let derived = &self.derived[derived as usize];
        let pool = &self.functions[derived.pool as usize];
        let inputs: Vec<Vec<f64>> = pool.nodes(derived.place as usize).iter().map(|&node| self.stored(node)).collect();
        let x: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
        let mut y = vec![0.0; place.ambient];
        pool.evaluate(derived.place as usize, &x, &mut y, None);
        y
    }

    /// Which factor made a cost that is not finite.
    pub(crate) fn first_not_finite(&self, cost: f64) -> Error {
        let norm = |(factor, &key): (usize, &FactorKey)| (factor, self.squared_norm(key));
        match self.order.iter().enumerate().map(norm).find(|(_, value)| !value.is_finite()) {
            Some((factor, value)) => Error::NotFinite { factor, value },
            None => Error::NotFinite { factor: 0, value: cost },
        }
    }

    /// Sum of ρ(|r/σ|²)/2 over all factors, where the nodes are now.
    pub fn cost(&self) -> f64 {
        crate::Workspace::new(self).cost(self, &self.values)
    }
}

fn retract<V: Variable>(x: &[f64], delta: &[f64], y: &mut [f64]) {
    V::store(&V::retract::<f64>(x, |i| delta[i]), y);
}

/// Turns a gradient over steps from x = x0 ⊞ δ into one over δ: Tᵀ g with T = ∂((x0 ⊞ (δ + ε)) ⊟ x)/∂ε at ε = 0.
fn transport<V: Variable<Over<f64> = V>>(x0: &[f64], delta: &[f64], x: &[f64], gradient: &mut [f64]) {
    let n = gradient.len();
    let (mut result, mut step) = (vec![0.0; n], vec![Dual::from(0.0); n]);
    for first in (0..n).step_by(LANES) {
        let moved = V::retract::<Dual>(x0, |i| match i.checked_sub(first) {
            Some(lane) if lane < LANES => seed(delta[i], lane),
            _ => Dual::from(delta[i]),
        });
        V::local(x, &moved, &mut step);
        for (step, g) in step.iter().zip(&*gradient) {
            add_scaled(&mut result[first..], *g, &derivatives(step));
        }
    }
    gradient.copy_from_slice(&result);
}

/// The noise and the loss of a factor that was just added.
pub struct FactorSettings<'a, const M: usize> {
    /// Names the factor.
    pub key: FactorKey,
    noise: &'a mut Noise<M>,
    loss: &'a mut Loss,
}

impl<const M: usize> FactorSettings<'_, M> {
    /// One standard deviation for every component, in the residual's unit.
    pub fn sigma(self, sigma: f64) -> Self {
        *self.noise = Noise::Isotropic(1.0 / sigma);
        self
    }

    /// One standard deviation per component.
    pub fn sigmas(self, sigmas: [f64; M]) -> Self {
        *self.noise = Noise::Diagonal(sigmas.map(|sigma| 1.0 / sigma));
        self
    }

    /// Any W with WᵀW the inverse of the covariance, by rows.
    pub fn whitening(self, w: [[f64; M]; M]) -> Self {
        *self.noise = Noise::Full(w);
        self
    }

    /// The loss; its width is in standard deviations.
    pub fn loss(self, loss: Loss) -> Self {
        *self.loss = loss;
        self
    }
}
