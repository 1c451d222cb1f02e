//! Divides a graph into chunks: parts of about the same work, that only meet in free nodes.
use crate::accumulate::Place;
use crate::graph::{Graph, Role};

/// Factors in a chunk, at least: about half a millisecond of work.
const CHUNK: usize = 1024;

/// The chunk of every factor and of every derived node that a factor needs, and how many chunks there are.
pub(crate) fn chunks(graph: &Graph) -> (Vec<usize>, Vec<Option<usize>>, usize) {
    // Derived nodes that a factor or another derived node joins are in one group, named by its smallest member.
    let mut group: Vec<usize> = (0..graph.derived.len()).collect();
    let derived_of = |node: u32| match graph.nodes[node as usize].role {
        Role::Derived(derived) => Some(derived as usize),
        _ => None,
    };
    for (derived, entry) in graph.derived.iter().enumerate() {
        for &parent in graph.functions[entry.pool as usize].nodes(entry.place as usize) {
            if let Some(parent) = derived_of(parent) {
                join(&mut group, derived, parent);
            }
        }
    }
    let touched = |factor: usize| {
        let key = graph.order[factor];
        graph.factors[key.pool as usize].nodes(key.place as usize).iter().filter_map(move |&node| derived_of(node))
    };
    for factor in 0..graph.order.len() {
        let mut derived = touched(factor);
        if let Some(first) = derived.next() {
            derived.for_each(|other| join(&mut group, first, other));
        }
    }
    let mut chunk_of_group: Vec<Option<usize>> = vec![None; graph.derived.len()];
    let (mut chunk, mut filled) = (0, 0);
    let mut chunk_of_factor = Vec::with_capacity(graph.order.len());
    for factor in 0..graph.order.len() {
        let root = touched(factor).next().map(|derived| root(&mut group, derived));
        let own = match root.and_then(|root| chunk_of_group[root]) {
            Some(chunk) => chunk,
            None => {
                if filled >= CHUNK {
                    chunk += 1;
                    filled = 0;
                }
                if let Some(root) = root {
                    chunk_of_group[root] = Some(chunk);
                }
                chunk
            }
        };
        filled += usize::from(own == chunk);
        chunk_of_factor.push(own);
    }
    let chunk_of_derived = (0..graph.derived.len()).map(|derived| chunk_of_group[root(&mut group, derived)]).collect();
    (chunk_of_factor, chunk_of_derived, chunk + 1)
}

fn root(group: &mut [usize], mut member: usize) -> usize {
    while group[member] != member {
        group[member] = group[group[member]];
        member = group[member];
    }
    member
}

fn join(group: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(group, a), root(group, b));
    group[a.max(b)] = a.min(b);
}

/// Which chunks touch a node.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Owner {
    Nobody,
    Chunk(usize),
    Shared,
}

pub(crate) fn owners(graph: &Graph, places: &[Place], factors: &[usize], derived: &[Option<usize>]) -> Vec<Owner> {
    let mut owner = vec![Owner::Nobody; graph.nodes.len()];
    let mut touch = |node: u32, chunk: usize| {
        let owner = &mut owner[node as usize];
        *owner = match *owner {
            Owner::Nobody => Owner::Chunk(chunk),
            Owner::Chunk(other) if other == chunk => Owner::Chunk(chunk),
            _ => Owner::Shared,
        };
    };
    for (key, &chunk) in graph.order.iter().zip(factors) {
        for &node in graph.factors[key.pool as usize].nodes(key.place as usize) {
            touch(node, chunk);
        }
    }
    for (entry, &chunk) in graph.derived.iter().zip(derived) {
        let Some(chunk) = chunk else { continue };
        touch(entry.node, chunk);
        if places[entry.node as usize].active > 0 {
            for &parent in graph.functions[entry.pool as usize].nodes(entry.place as usize) {
                touch(parent, chunk);
            }
        }
    }
    owner
}

/// What a derived node is derived from.
pub(crate) fn parents(graph: &Graph, derived: u32) -> &[u32] {
    let derived = &graph.derived[derived as usize];
    graph.functions[derived.pool as usize].nodes(derived.place as usize)
}
