//! Where every block of the normal equations lives, found once per structure and reused by every pass.
//!
//! Factors that meet in derived nodes belong together, because a derived node is substituted once all of its factors are in.
//! Such groups are packed into *chunks*, each of about the same work. A node that only one chunk touches has its blocks in
//! that chunk's own arena; blocks between nodes that several chunks touch are in a shared arena, of which each chunk
//! fills its own copy, summed in a fixed order. The chunks depend on the graph alone, so the sum does too, on any number of
//! threads.
use crate::accumulate::{Offset, Place};
use crate::chunks::{Owner, chunks, owners, parents};
use crate::graph::{Graph, Role};
use crate::groups::{Group, Ties, groups};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

pub(crate) struct Layout {
    pub places: Vec<Place>,
    pub chunks: Vec<Chunk>,
    /// Length of the shared arena.
    pub shared: usize,
    /// Free nodes with at least one free coordinate, in order: (node, first column in the system).
    pub free: Vec<(u32, usize)>,
    /// The chunk whose arena a free node's part of b is in, if its offset is private.
    pub gradient_chunks: Vec<u32>,
    /// Columns of the system.
    pub columns: usize,
    /// Blocks between free nodes, (row node, column node) with row <= column, in order.
    pub blocks: Vec<Block>,
}

/// A block of the system that remains once derived nodes are substituted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    pub row: u32,
    pub column: u32,
    /// The chunk whose arena it is in, if its offset is private.
    pub chunk: u32,
    pub offset: Offset,
}

/// Part of the graph that one thread works through.
#[derive(Default)]
pub(crate) struct Chunk {
    /// Consecutive factors of one pool.
    pub runs: Vec<(u32, Range<usize>)>,
    /// Blocks of the factors, in the order of the runs.
    pub offsets: Vec<Offset>,
    /// Derived nodes, in order of creation.
    pub functions: Vec<FunctionPlan>,
    /// The same, as they are substituted.
    pub groups: Vec<Group>,
    /// Length of the chunk's own arena, and of its derived values.
    pub private: usize,
    pub derived: usize,
}

/// How one derived node is evaluated.
pub(crate) struct FunctionPlan {
    pub pool: u32,
    pub place: u32,
    pub node: u32,
    /// Where its Jacobian goes in the chunk's arena (see [`crate::groups::Ties`]).
    pub jacobian: usize,
}

impl Layout {
    pub fn new(graph: &Graph) -> Self {
        let mut places = places(graph);
        let (chunk_of_factor, chunk_of_derived, chunk_count) = chunks(graph);
        let owner = owners(graph, &places, &chunk_of_factor, &chunk_of_derived);
        let mut builder = Builder {
            places: &mut places,
            owner,
            shared: BTreeMap::new(),
            shared_len: 0,
            blocks: Vec::new(),
            near: vec![Vec::new(); graph.nodes.len()],
        };
        for (node, _) in graph.nodes.iter().enumerate() {
            if builder.owner[node] == Owner::Shared && builder.places[node].active > 0 {
                builder.places[node].gradient = Offset::shared(builder.shared_len);
                builder.shared_len += usize::from(builder.places[node].active);
            }
        }
        let mut members: Vec<(Vec<usize>, Vec<usize>)> = vec![Default::default(); chunk_count];
        for (factor, &chunk) in chunk_of_factor.iter().enumerate() {
            members[chunk].0.push(factor);
        }
        for (derived, &chunk) in chunk_of_derived.iter().enumerate() {
            if let Some(chunk) = chunk {
                members[chunk].1.push(derived);
            }
        }
        let chunks = members
            .iter()
            .enumerate()
            .map(|(c, (factors, derived))| builder.chunk(graph, c, factors, derived))
            .collect();
        let (shared, mut blocks) = (builder.shared_len, std::mem::take(&mut builder.blocks));
        for (&(row, column), &offset) in &builder.shared {
            blocks.push(Block { row, column, chunk: u32::MAX, offset });
        }
        let is_free = |node: u32| graph.nodes[node as usize].role == Role::Free;
        blocks.retain(|block| is_free(block.row) && is_free(block.column));
        blocks.sort_unstable_by_key(|block| (block.column, block.row));
        let owner = builder.owner;
        let mut columns = 0;
        let mut free = Vec::new();
        let mut gradient_chunks = Vec::new();
        for (node, place) in places.iter().enumerate() {
            if graph.nodes[node].role == Role::Free && place.active > 0 && place.gradient != Offset::NONE {
                free.push((node as u32, columns));
                gradient_chunks.push(match owner[node] {
                    Owner::Chunk(chunk) => chunk as u32,
                    _ => u32::MAX,
                });
                columns += usize::from(place.active);
            }
        }
        Layout { places, chunks, shared, free, gradient_chunks, columns, blocks }
    }

    /// First column of a free node in the system.
    pub fn column(&self, node: u32) -> usize {
        self.column_of(node).expect("the node is in the system")
    }

    /// The same, `None` where no factor says anything about the node.
    pub fn column_of(&self, node: u32) -> Option<usize> {
        let place = self.free.binary_search_by_key(&node, |&(node, _)| node).ok()?;
        Some(self.free[place].1)
    }
}

fn places(graph: &Graph) -> Vec<Place> {
    let mut places: Vec<Place> = Vec::with_capacity(graph.nodes.len());
    for node in &graph.nodes {
        let active = match node.role {
            Role::Held => 0,
            Role::Free => node.free.as_ref().map_or(node.tangent, Vec::len),
            // A function of held nodes alone is a constant.
            Role::Derived(derived) => {
                let constant = parents(graph, derived).iter().all(|&parent| places[parent as usize].active == 0);
                if constant { 0 } else { node.tangent }
            }
        };
        places.push(Place {
            derived: matches!(node.role, Role::Derived(_)),
            start: node.start as u32,
            ambient: node.ambient as u16,
            tangent: node.tangent as u16,
            active: active as u16,
            gradient: Offset::NONE,
        });
    }
    places
}

struct Builder<'a> {
    places: &'a mut Vec<Place>,
    owner: Vec<Owner>,
    shared: BTreeMap<(u32, u32), Offset>,
    shared_len: usize,
    /// Private blocks of all chunks so far.
    blocks: Vec<Block>,
    /// Of [`Pattern::near`], empty between chunks.
    near: Vec<Vec<(u32, Offset)>>,
}

/// Blocks of one chunk.
struct Pattern {
    /// By node: every node that it has a block with, in order, and where that is.
    near: Vec<Vec<(u32, Offset)>>,
    len: usize,
}

impl Pattern {
    fn find(&self, a: u32, b: u32) -> Result<Offset, usize> {
        let near = &self.near[a as usize];
        near.binary_search_by_key(&b, |&(other, _)| other).map(|place| near[place].1)
    }

    fn insert(&mut self, a: u32, b: u32, offset: Offset) {
        if let Err(place) = self.find(a, b) {
            self.near[a as usize].insert(place, (b, offset));
        }
    }
}

impl Builder<'_> {
    fn chunk(&mut self, graph: &Graph, index: usize, factors: &[usize], derived: &[usize]) -> Chunk {
        let mut chunk = Chunk::default();
        let mut pattern = Pattern { near: std::mem::take(&mut self.near), len: 0 };
        for &derived in derived {
            let node = graph.derived[derived].node as usize;
            self.places[node].start = chunk.derived as u32;
            chunk.derived += graph.nodes[node].ambient;
        }
        let mut chunk_nodes = BTreeSet::new();
        let mut touch = |node: u32| {
            chunk_nodes.insert(node);
        };
        for &factor in factors {
            let key = graph.order[factor];
            graph.factors[key.pool as usize].nodes(key.place as usize).iter().for_each(|&node| touch(node));
        }
        for &derived in derived {
            touch(graph.derived[derived].node);
            parents(graph, derived as u32).iter().for_each(|&node| touch(node));
        }
        for &node in &chunk_nodes {
            let place = &mut self.places[node as usize];
            if self.owner[node as usize] == Owner::Chunk(index) && place.active > 0 {
                place.gradient = Offset::private(pattern.len);
                pattern.len += usize::from(place.active);
            }
        }
        for &factor in factors {
            let key = graph.order[factor];
            let (pool, place) = (key.pool, key.place as usize);
            match chunk.runs.last_mut() {
                Some((last, range)) if *last == pool && range.end == place => range.end += 1,
                _ => chunk.runs.push((pool, place..place + 1)),
            }
            let nodes = graph.factors[pool as usize].nodes(place);
            self.pairs(&mut pattern, nodes, &mut chunk.offsets);
        }
        // Derived nodes that were created later are substituted first: what they leave behind is laid out by then.
        let mut ties = Vec::new();
        for &derived in derived.iter().rev() {
            let entry = &graph.derived[derived];
            let (pool, place, node) = (entry.pool, entry.place, entry.node);
            chunk.functions.push(FunctionPlan { pool, place, node, jacobian: pattern.len });
            ties.extend(self.ties(graph, derived, &mut pattern));
        }
        chunk.functions.reverse();
        ties.reverse();
        chunk.groups = groups(graph, self.places, &ties);
        chunk.private = pattern.len;
        for &column in &chunk_nodes {
            for (row, offset) in pattern.near[column as usize].drain(..) {
                if row <= column && !offset.is_shared() {
                    self.blocks.push(Block { row, column, chunk: index as u32, offset });
                }
            }
        }
        self.near = pattern.near;
        chunk
    }

    /// What a derived node is tied to; `None` where it is constant.
    fn ties(&mut self, graph: &Graph, derived: usize, pattern: &mut Pattern) -> Option<Ties> {
        let (node, nodes) = (graph.derived[derived].node, parents(graph, derived as u32));
        let rows = usize::from(self.places[node as usize].active);
        if rows == 0 {
            return None;
        }
        let jacobian = pattern.len;
        let active: usize = nodes.iter().map(|&parent| usize::from(self.places[parent as usize].active)).sum();
        pattern.len += rows * active;
        let diagonal = self.offset(pattern, node, node);
        let remains = |&other: &u32| other < node || !self.places[other as usize].derived;
        let near = pattern.near[node as usize].iter().map(|&(other, _)| other);
        let near: Vec<u32> = near.filter(|other| *other != node && remains(other)).collect();
        let mut parents = Vec::new();
        self.pairs(pattern, nodes, &mut parents);
        let mut neighbours = Vec::new();
        for other in near {
            let own = self.offset(pattern, node, other);
            let with_parents = nodes.iter().map(|&parent| self.offset(pattern, parent, other)).collect();
            neighbours.push((other, own, with_parents));
        }
        Some(Ties { derived, node, jacobian, diagonal, parents, neighbours })
    }

    fn pairs(&mut self, pattern: &mut Pattern, nodes: &[u32], offsets: &mut Vec<Offset>) {
        for (a, &first) in nodes.iter().enumerate() {
            for &second in &nodes[a..] {
                offsets.push(self.offset(pattern, first, second));
            }
        }
    }

    /// The block of two nodes, laid out now if it is new.
    fn offset(&mut self, pattern: &mut Pattern, a: u32, b: u32) -> Offset {
        let size = usize::from(self.places[a as usize].active) * usize::from(self.places[b as usize].active);
        if size == 0 {
            return Offset::NONE;
        }
        // Nodes with few neighbours, such as those of one sample, tend to be the later ones.
        let (low, high) = (a.min(b), a.max(b));
        if let Ok(offset) = pattern.find(high, low) {
            return offset;
        }
        let is_shared = |node: u32| self.owner[node as usize] == Owner::Shared;
        let offset = if is_shared(a) && is_shared(b) {
            *self.shared.entry((low, high)).or_insert_with(|| {
                self.shared_len += size;
                Offset::shared(self.shared_len - size)
            })
        } else {
            pattern.len += size;
            Offset::private(pattern.len - size)
        };
        pattern.insert(high, low, offset);
        pattern.insert(low, high, offset);
        offset
    }
}
