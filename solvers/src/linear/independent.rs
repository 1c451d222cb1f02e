//! Chooses the nodes that are eliminated.
use crate::layout::Layout;
use std::collections::BTreeMap;

/// The largest block that is eliminated.
const LARGEST: usize = 16;

/// Nodes of one size that no block ties to each other, as (size, nodes in ascending order), for the size where they have
/// most columns. Nodes with few neighbours are taken first: one per moment before those that all moments share.
pub(super) fn independent(layout: &Layout) -> Option<(usize, Vec<u32>)> {
    let active = |node: u32| usize::from(layout.places[node as usize].active);
    let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); layout.places.len()];
    for block in layout.blocks.iter().filter(|block| block.row != block.column) {
        neighbours[block.row as usize].push(block.column);
        neighbours[block.column as usize].push(block.row);
    }
    let mut nodes: Vec<u32> =
        layout.free.iter().map(|&(node, _)| node).filter(|&node| active(node) <= LARGEST).collect();
    nodes.sort_by_key(|&node| (neighbours[node as usize].len(), node));
    let mut taken = vec![false; layout.places.len()];
    let mut sizes: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
    for node in nodes {
        let size = active(node);
        if !neighbours[node as usize].iter().any(|&other| taken[other as usize] && active(other) == size) {
            taken[node as usize] = true;
            sizes.entry(size).or_default().push(node);
        }
    }
    let (size, mut chosen) = sizes.into_iter().max_by_key(|(size, nodes)| size * nodes.len())?;
    chosen.sort_unstable();
    Some((size, chosen))
}
