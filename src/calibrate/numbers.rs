//! The free numbers of a rig in one order, and their covariance.
use super::graph::{Built, Freedom, row};
use crate::factors::Intrinsics;
use handeye_solvers::{Covariance, DynamicVector, FactorKey, Key, Pose, Vector};
use nalgebra::DMatrix;

/// What of a rig a number belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Base,
    Chain,
    Camera(usize),
    Lens(usize),
    Feature(usize),
}

/// A part with its free coordinates.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    pub part: Part,
    pub free: Vec<usize>,
    /// Column of the first of them.
    pub first: usize,
}

/// Free numbers, part by part.
#[derive(Clone, Debug)]
pub(crate) struct Numbers {
    pub blocks: Vec<Block>,
    pub len: usize,
}

impl Numbers {
    pub fn new(freedom: &Freedom) -> Self {
        let mut numbers = Numbers { blocks: Vec::new(), len: 0 };
        numbers.add(Part::Base, &freedom.base);
        numbers.add(Part::Chain, &freedom.parameters);
        for (camera, (pose, lens)) in freedom.cameras.iter().zip(&freedom.intrinsics).enumerate() {
            numbers.add(Part::Camera(camera), pose);
            numbers.add(Part::Lens(camera), lens);
        }
        for (feature, held) in freedom.features.iter().enumerate() {
            numbers.add(Part::Feature(feature), held);
        }
        numbers
    }

    fn add(&mut self, part: Part, held: &[bool]) {
        let free: Vec<usize> = (0..held.len()).filter(|&k| !held[k]).collect();
        if !free.is_empty() {
            let first = self.len;
            self.len += free.len();
            self.blocks.push(Block { part, free, first });
        }
    }

    /// Every number: its part and which coordinate of it.
    pub fn iter(&self) -> impl Iterator<Item = (Part, usize)> {
        self.blocks.iter().flat_map(|block| block.free.iter().map(|&k| (block.part, k)))
    }

    /// Coordinates of a part that are free, and their columns.
    pub fn columns(&self, part: Part) -> impl Iterator<Item = (usize, usize)> {
        let block = self.blocks.iter().find(|block| block.part == part);
        block.into_iter().flat_map(|block| block.free.iter().enumerate().map(|(i, &k)| (k, block.first + i)))
    }

    /// Whitened derivatives of a factor by all of them.
    pub fn jacobian(&self, built: &Built, covariance: &Covariance<'_>, factor: FactorKey) -> DMatrix<f64> {
        let of_nodes = covariance.jacobian(factor);
        let rows = of_nodes.first().map_or(0, |(_, j)| j.nrows());
        let mut jacobian = DMatrix::zeros(rows, self.len);
        for block in &self.blocks {
            let node = block.part.node(built);
            if let Some((_, j)) = of_nodes.iter().find(|(of, _)| *of == node) {
                jacobian.columns_mut(block.first, j.ncols()).copy_from(j);
            }
        }
        jacobian
    }

    /// Covariance of all of them.
    pub fn covariance(&self, built: &Built, covariance: &mut Covariance<'_>) -> DMatrix<f64> {
        let mut sigma = DMatrix::zeros(self.len, self.len);
        for a in &self.blocks {
            for b in self.blocks.iter().filter(|b| b.first <= a.first) {
                let block = a.part.key(built).covariance_with(b.part.key(built), covariance);
                for (i, &x) in a.free.iter().enumerate() {
                    for (k, &y) in b.free.iter().enumerate() {
                        sigma[(a.first + i, b.first + k)] = block[(x, y)];
                        sigma[(b.first + k, a.first + i)] = block[(x, y)];
                    }
                }
            }
        }
        sigma
    }
}

impl Part {
    /// True where a coordinate is a length.
    pub fn is_length(self, coordinate: usize) -> bool {
        match self {
            Part::Base | Part::Camera(_) => coordinate >= 3,
            Part::Chain => matches!(coordinate % row(1), 1 | 2),
            Part::Lens(_) => false,
            Part::Feature(_) => true,
        }
    }

    /// Its node, by [`Key::index`].
    pub fn node(self, built: &Built) -> usize {
        match self.key(built) {
            AnyKey::Pose(key) => key.index(),
            AnyKey::Parameters(key) => key.index(),
            AnyKey::Lens(key) => key.index(),
            AnyKey::Point(key) => key.index(),
        }
    }

    fn key(self, built: &Built) -> AnyKey {
        match self {
            Part::Base => AnyKey::Pose(built.base),
            Part::Chain => AnyKey::Parameters(built.parameters),
            Part::Camera(camera) => AnyKey::Pose(built.cameras[camera].0),
            Part::Lens(camera) => AnyKey::Lens(built.cameras[camera].1),
            Part::Feature(feature) => AnyKey::Point(built.features[feature]),
        }
    }
}

/// The key of a node of the rig.
#[derive(Clone, Copy)]
enum AnyKey {
    Pose(Key<Pose>),
    Parameters(Key<DynamicVector>),
    Lens(Key<Intrinsics>),
    Point(Key<Vector<3>>),
}

impl AnyKey {
    fn covariance_with(self, other: AnyKey, covariance: &mut Covariance<'_>) -> DMatrix<f64> {
        fn of<A>(a: Key<A>, other: AnyKey, covariance: &mut Covariance<'_>) -> DMatrix<f64> {
            match other {
                AnyKey::Pose(b) => covariance.between(a, b),
                AnyKey::Parameters(b) => covariance.between(a, b),
                AnyKey::Lens(b) => covariance.between(a, b),
                AnyKey::Point(b) => covariance.between(a, b),
            }
        }
        match self {
            AnyKey::Pose(a) => of(a, other, covariance),
            AnyKey::Parameters(a) => of(a, other, covariance),
            AnyKey::Lens(a) => of(a, other, covariance),
            AnyKey::Point(a) => of(a, other, covariance),
        }
    }
}
