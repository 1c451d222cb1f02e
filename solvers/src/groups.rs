//! Finds derived nodes that are substituted together, and lays out where their products go.
//!
//! Many derived nodes often share some parents and each have others of their own, one set per moment. What factors say of
//! them is moved to the shared parents by one large product over all of them, and to each one's own by a small one.
use crate::accumulate::{Offset, Place};
use crate::chunks::parents;
use crate::graph::Graph;
use std::collections::BTreeMap;
use std::ops::Range;

/// Most rows of a group's product: what it reads stays in the cache.
const ROWS: usize = 96;

/// Blocks of a derived node and of what it is tied to.
pub(crate) struct Ties {
    /// Index into the graph's derived nodes.
    pub derived: usize,
    pub node: u32,
    /// Its Jacobian G (rows: its step, columns: free coordinates of its parents) in the chunk's arena.
    pub jacobian: usize,
    /// Its own block of H.
    pub diagonal: Offset,
    /// Blocks between its parents: one per pair (a, b) with a <= b, NONE where one is held.
    pub parents: Vec<Offset>,
    /// Nodes that it shares factors with: the block with each, and that node's block with each parent.
    pub neighbours: Vec<(u32, Offset, Vec<Offset>)>,
}

/// Derived nodes that are substituted together.
///
/// Each has a matrix G of `rows` x `width`, by its parents' free coordinates, and a matrix S of `rows` x `columns`: H_dd G,
/// followed by H_dx for every node x that one of the group shares a factor with.
pub(crate) struct Group {
    pub rows: usize,
    pub width: usize,
    pub columns: usize,
    /// Columns of G between the first and the last parent that all members have in common, and likewise of the others.
    pub common: Range<usize>,
    pub own: Range<usize>,
    /// Where the sum of Gᵀ S over all members goes, as far as common parents are concerned.
    pub targets: Vec<Target>,
    pub members: Vec<Member>,
}

/// One derived node of a group.
pub(crate) struct Member {
    /// G, in the chunk's arena.
    pub jacobian: usize,
    pub diagonal: Offset,
    pub gradient: Offset,
    /// b of each parent, and its columns of G.
    pub parents: Vec<(Offset, Span)>,
    pub sources: Vec<Source>,
    /// Where Gᵀ S of this member goes, as far as parents of its own are concerned.
    pub targets: Vec<Target>,
}

/// First column, and how many.
#[derive(Clone, Copy)]
pub(crate) struct Span {
    pub start: usize,
    pub len: usize,
}

/// A block H_dx, and its columns of S.
pub(crate) struct Source {
    pub block: Offset,
    pub columns: Span,
    /// Whether the block has x's coordinates as rows.
    pub transposed: bool,
}

/// A block that part of a product is added to: columns of G by columns of S.
pub(crate) struct Target {
    pub block: Offset,
    pub rows: Span,
    pub columns: Span,
    pub way: Way,
}

/// How a product is added to a block.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Way {
    AsItIs,
    Transposed,
    /// The two nodes are one, so that H_xd G comes with Gᵀ H_dx.
    Both,
}

impl Way {
    /// The node with the smaller index has the rows of a block.
    fn of(row: u32, column: u32) -> Self {
        match row.cmp(&column) {
            std::cmp::Ordering::Less => Way::AsItIs,
            std::cmp::Ordering::Equal => Way::Both,
            std::cmp::Ordering::Greater => Way::Transposed,
        }
    }
}

/// Groups of derived nodes, in order of creation.
pub(crate) fn groups(graph: &Graph, places: &[Place], ties: &[Ties]) -> Vec<Group> {
    let mut groups = Vec::new();
    let mut first = 0;
    while first < ties.len() {
        let mut draft = Draft::new(graph, places, &ties[first]);
        let mut end = first + 1;
        while end < ties.len() && draft.admits(&ties[first..end], &ties[end]) {
            draft.add(&ties[first..end], &ties[end]);
            end += 1;
        }
        groups.push(draft.finish(&ties[first..end]));
        first = end;
    }
    groups
}

/// A group that is being put together.
struct Draft<'a> {
    graph: &'a Graph,
    places: &'a [Place],
    /// Whether all members so far have the same node for a parent.
    common: Vec<bool>,
    /// First column of S for every node x.
    near: BTreeMap<u32, usize>,
    columns: usize,
}

impl<'a> Draft<'a> {
    fn new(graph: &'a Graph, places: &'a [Place], first: &Ties) -> Self {
        let nodes = parents(graph, first.derived as u32);
        let mut draft = Draft { graph, places, common: vec![true; nodes.len()], near: BTreeMap::new(), columns: 0 };
        draft.columns = nodes.iter().map(|&parent| draft.dim(parent)).sum();
        draft.add_near(first);
        draft
    }

    fn dim(&self, node: u32) -> usize {
        usize::from(self.places[node as usize].active)
    }

    fn parents(&self, ties: &Ties) -> &'a [u32] {
        parents(self.graph, ties.derived as u32)
    }

    fn add_near(&mut self, ties: &Ties) {
        for &(other, ..) in &ties.neighbours {
            let next = self.columns;
            let start = *self.near.entry(other).or_insert(next);
            if start == next {
                self.columns += self.dim(other);
            }
        }
    }

    /// Parents that the members would have in common with one more.
    fn common_with(&self, first: &Ties, next: &Ties) -> Vec<bool> {
        let pairs = self.parents(first).iter().zip(self.parents(next));
        pairs.zip(&self.common).map(|((a, b), common)| *common && a == b).collect()
    }

    /// Whether one more fits: as large as the others, tied to none of them, to much the same nodes, and from the same
    /// parents as far as they have any in common.
    fn admits(&self, members: &[Ties], next: &Ties) -> bool {
        let (first, nodes) = (&members[0], self.parents(next));
        let pool = |ties: &Ties| self.graph.derived[ties.derived].pool;
        let dims = |ties: &Ties| self.parents(ties).iter().map(|&parent| self.dim(parent));
        if pool(first) != pool(next) || self.dim(first.node) != self.dim(next.node) || !dims(first).eq(dims(next)) {
            return false;
        }
        let is_member = |node: u32| members.binary_search_by_key(&node, |ties| ties.node).is_ok();
        let tied = nodes.iter().any(|&node| is_member(node)) || next.neighbours.iter().any(|&(x, ..)| is_member(x));
        let own: usize = next.neighbours.iter().map(|&(x, ..)| self.dim(x)).sum::<usize>() + dims(next).sum::<usize>();
        let common = self.common_with(first, next);
        !tied
            && (members.len() + 1) * self.dim(next.node) <= ROWS
            && self.columns <= 2 * own
            && common.iter().zip(nodes).any(|(common, &node)| *common && self.dim(node) > 0)
            && (members.len() == 1 || common == self.common)
    }

    fn add(&mut self, members: &[Ties], next: &Ties) {
        if members.len() == 1 {
            self.common = self.common_with(&members[0], next);
        }
        self.add_near(next);
    }

    fn finish(self, members: &[Ties]) -> Group {
        let spans = self.spans(&members[0]);
        let hull = |common: bool| {
            let mut chosen = spans.iter().zip(&self.common).filter(|(span, c)| **c == common && span.len > 0);
            let Some((first, _)) = chosen.next() else { return 0..0 };
            let last = chosen.next_back().map_or(first, |(last, _)| last);
            first.start..last.start + last.len
        };
        let (mut targets, mut known) = (BTreeMap::new(), Vec::with_capacity(members.len()));
        for ties in members {
            known.push(self.member(ties, &spans, &mut targets));
        }
        Group {
            rows: self.dim(members[0].node),
            width: spans.iter().map(|span| span.len).sum(),
            columns: self.columns,
            common: hull(true),
            own: hull(false),
            targets: targets.into_values().collect(),
            members: known,
        }
    }

    /// Columns of G for each parent.
    fn spans(&self, ties: &Ties) -> Vec<Span> {
        let mut start = 0;
        let span = |&node: &u32| {
            start += self.dim(node);
            Span { start: start - self.dim(node), len: self.dim(node) }
        };
        self.parents(ties).iter().map(span).collect()
    }

    /// `targets`: those of common parents so far, by columns of G and of S.
    fn member(&self, ties: &Ties, spans: &[Span], targets: &mut BTreeMap<(usize, usize), Target>) -> Member {
        let nodes = self.parents(ties);
        let mut own = Vec::new();
        let mut add = |common: bool, target: Target| {
            if target.block == Offset::NONE {
                return;
            }
            if common {
                targets.insert((target.rows.start, target.columns.start), target);
            } else {
                own.push(target);
            }
        };
        let mut blocks = ties.parents.iter();
        for a in 0..nodes.len() {
            for b in a..nodes.len() {
                let block = *blocks.next().expect("there is a block for each pair of parents");
                // A pair of a common parent and one of the member's own is part of the member's product.
                let (row, column) = if self.common[a] && !self.common[b] { (b, a) } else { (a, b) };
                let way = if a == b { Way::AsItIs } else { Way::of(nodes[row], nodes[column]) };
                let common = self.common[a] && self.common[b];
                add(common, Target { block, rows: spans[row], columns: spans[column], way });
            }
        }
        let mut sources = Vec::with_capacity(ties.neighbours.len());
        for (other, block, with_parents) in &ties.neighbours {
            let columns = Span { start: self.near[other], len: self.dim(*other) };
            sources.push(Source { block: *block, columns, transposed: *other < ties.node });
            for (a, &block) in with_parents.iter().enumerate() {
                add(self.common[a], Target { block, rows: spans[a], columns, way: Way::of(nodes[a], *other) });
            }
        }
        let gradient = |node: u32| self.places[node as usize].gradient;
        Member {
            jacobian: ties.jacobian,
            diagonal: ties.diagonal,
            gradient: gradient(ties.node),
            parents: nodes.iter().zip(spans).filter(|(_, s)| s.len > 0).map(|(&n, s)| (gradient(n), *s)).collect(),
            sources,
            targets: own,
        }
    }
}
