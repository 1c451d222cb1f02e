//! Substitutes derived nodes: what factors say of one is moved to what it is derived from.
use crate::accumulate::{Offset, Run, Want};
use crate::graph::Graph;
use crate::layout::FunctionPlan;
use crate::pool::grown;
use crate::product::{Strip, add_product, add_scaled};

/// Moves all that H and b say of a derived node d = f(P) to its parents P, with G = ∂d/∂P:
///
///   b_P += Gᵀ b_d      H_PP += Gᵀ H_dd G      H_Px += Gᵀ H_dx for every other node x
///
/// and, where x is itself a parent, H_xx += Gᵀ H_dx + H_xd G.
pub(crate) fn substitute(graph: &Graph, plan: &FunctionPlan, run: &mut Run<'_>) {
    let places = run.places;
    let place = &places[plan.node as usize];
    let rows = usize::from(place.active);
    if rows == 0 {
        return;
    }
    let parents = graph.functions[plan.pool as usize].nodes(plan.place as usize);
    let dim = |node: u32| usize::from(places[node as usize].active);
    let width: usize = parents.iter().map(|&parent| dim(parent)).sum();
    let mut scratch = std::mem::take(&mut run.scratch.product);
    let needed = 2 * rows * width + rows * rows + rows;
    let (g, rest) = grown(&mut scratch, needed).split_at_mut(rows * width);
    let (product, rest) = rest.split_at_mut(rows * width);
    let (h, b) = rest.split_at_mut(rows * rows);
    g.copy_from_slice(&run.private[plan.jacobian..plan.jacobian + rows * width]);
    h.copy_from_slice(run.block(plan.diagonal, rows * rows));
    b.copy_from_slice(run.block(place.gradient, rows));

    let mut start = 0;
    for &parent in parents {
        let columns = dim(parent);
        if columns > 0 {
            let gradient = run.block(places[parent as usize].gradient, columns);
            for (g, &b) in g.chunks_exact(width).zip(&*b) {
                add_scaled(gradient, b, &g[start..start + columns]);
            }
        }
        start += columns;
    }
    if run.want == Want::Gradient {
        run.scratch.product = scratch;
        return;
    }
    // product = H_dd G, by rows.
    product.fill(0.0);
    for (i, row) in product.chunks_exact_mut(width).enumerate() {
        for (k, g) in g.chunks_exact(width).enumerate() {
            add_scaled(row, h[i + k * rows], g);
        }
    }
    let mut pair = 0;
    let mut start_a = 0;
    for (a, &first) in parents.iter().enumerate() {
        let da = dim(first);
        let mut start_b = start_a;
        for &second in &parents[a..] {
            let (db, offset) = (dim(second), plan.parents[pair]);
            pair += 1;
            if offset != Offset::NONE {
                let block = run.block(offset, da * db);
                let strip = |matrix, start, len| Strip { matrix, width, start, len };
                if first <= second {
                    add_product(block, strip(g, start_a, da), strip(product, start_b, db));
                }
                if first > second || (first == second && start_a != start_b) {
                    add_product(block, strip(g, start_b, db), strip(product, start_a, da));
                }
            }
            start_b += db;
        }
        start_a += da;
    }
    for (other, own, with_parents) in &plan.neighbours {
        substitute_neighbour(graph, plan, (*other, *own), with_parents, g, width, run);
    }
    run.scratch.product = scratch;
}

/// H_Px += Gᵀ H_dx for one node x.
fn substitute_neighbour(
    graph: &Graph,
    plan: &FunctionPlan,
    (other, own): (u32, Offset),
    with_parents: &[Offset],
    g: &[f64],
    width: usize,
    run: &mut Run<'_>,
) {
    let places = run.places;
    let dim = |node: u32| usize::from(places[node as usize].active);
    let (rows, columns) = (dim(plan.node), dim(other));
    let parents = graph.functions[plan.pool as usize].nodes(plan.place as usize);
    let mut s = std::mem::take(&mut run.scratch.residual);
    // s = H_dx by rows, whichever of the two has the rows of the stored block.
    let s_rows = grown(&mut s, rows * columns);
    let block = run.block(own, rows * columns);
    for i in 0..rows {
        for j in 0..columns {
            s_rows[i * columns + j] = if plan.node < other { block[i + j * rows] } else { block[j + i * columns] };
        }
    }
    let mut start = 0;
    for (&parent, &offset) in parents.iter().zip(with_parents) {
        let d = dim(parent);
        if offset != Offset::NONE {
            let block = run.block(offset, d * columns);
            let g = Strip { matrix: g, width, start, len: d };
            let s = Strip { matrix: s_rows, width: columns, start: 0, len: columns };
            if parent <= other {
                add_product(block, g, s);
            }
            if parent >= other {
                add_product(block, s, g);
            }
        }
        start += d;
    }
    run.scratch.residual = s;
}
