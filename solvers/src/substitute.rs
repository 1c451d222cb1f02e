//! Substitutes derived nodes: what factors say of one is moved to what it is derived from.
use crate::accumulate::{Run, Want};
use crate::groups::{Group, Member, Target, Way};
use crate::pool::grown;
use crate::product::{Strip, add_product, add_scaled};
use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use std::ops::Range;

/// Moves all that H and b say of derived nodes d = f(P) to their parents P, with G = ∂d/∂P:
///
///   b_P += Gᵀ b_d      H_PP += Gᵀ H_dd G      H_Px += Gᵀ H_dx for every other node x
///
/// and, where x is itself a parent, H_xx += Gᵀ H_dx + H_xd G. With S = [H_dd G, H_dx, ...], all of H is Gᵀ S; where parents
/// are common to a group of derived nodes, the G and the S of all of them stand below each other in one product.
pub(crate) fn substitute(group: &Group, run: &mut Run<'_>) {
    for member in &group.members {
        substitute_gradient(group, member, run);
    }
    if run.want < Want::Equations {
        return;
    }
    let &Group { rows, width, columns, .. } = group;
    let mut scratch = std::mem::take(&mut run.scratch.product);
    let stacked = rows * group.members.len();
    let (g, rest) = grown(&mut scratch, stacked * (width + columns) + width * columns).split_at_mut(stacked * width);
    let (s, product) = rest.split_at_mut(stacked * columns);
    s.fill(0.0);
    for ((member, g), s) in
        group.members.iter().zip(g.chunks_exact_mut(rows * width)).zip(s.chunks_exact_mut(rows * columns))
    {
        gather(group, member, run, g, s);
        multiply(group, &group.own, g, s, product);
        scatter(&member.targets, &group.own, product, run);
    }
    multiply(group, &group.common, g, s, product);
    scatter(&group.targets, &group.common, product, run);
    run.scratch.product = scratch;
}

/// b_P += Gᵀ b_d.
fn substitute_gradient(group: &Group, member: &Member, run: &mut Run<'_>) {
    let &Group { rows, width, .. } = group;
    let mut scratch = std::mem::take(&mut run.scratch.product);
    let (g, b) = grown(&mut scratch, rows * (width + 1)).split_at_mut(rows * width);
    g.copy_from_slice(&run.private[member.jacobian..member.jacobian + rows * width]);
    b[..rows].copy_from_slice(run.block(member.gradient, rows));
    for &(gradient, span) in &member.parents {
        let strip = Strip { matrix: g, width, start: span.start, len: span.len };
        add_product(run.block(gradient, span.len), strip, Strip { matrix: &b[..rows], width: 1, start: 0, len: 1 });
    }
    run.scratch.product = scratch;
}

/// Fills G and S of one derived node, both by rows.
fn gather(group: &Group, member: &Member, run: &mut Run<'_>, g: &mut [f64], s: &mut [f64]) {
    let &Group { rows, width, columns, .. } = group;
    g.copy_from_slice(&run.private[member.jacobian..member.jacobian + rows * width]);
    let h = run.block(member.diagonal, rows * rows);
    for (i, s) in s.chunks_exact_mut(columns).enumerate() {
        for (k, g) in g.chunks_exact(width).enumerate() {
            add_scaled(&mut s[..width], h[i + k * rows], g);
        }
    }
    for source in &member.sources {
        let len = source.columns.len;
        let block = run.block(source.block, rows * len);
        for (i, s) in s.chunks_exact_mut(columns).enumerate() {
            for (j, s) in s[source.columns.start..][..len].iter_mut().enumerate() {
                *s = if source.transposed { block[j + i * len] } else { block[i + j * rows] };
            }
        }
    }
}

/// Gᵀ S by columns, for some columns of G.
fn multiply(group: &Group, of: &Range<usize>, g: &[f64], s: &[f64], product: &mut [f64]) {
    if of.is_empty() {
        return;
    }
    let g = MatRef::from_row_major_slice(g, g.len() / group.width, group.width).subcols(of.start, of.len());
    let s = MatRef::from_row_major_slice(s, s.len() / group.columns, group.columns);
    let product = &mut product[..of.len() * group.columns];
    let product = MatMut::from_column_major_slice_mut(product, of.len(), group.columns);
    matmul(product, Accum::Replace, g.transpose(), s, 1.0, Par::Seq);
}

/// Adds the parts of a product to their blocks.
fn scatter(targets: &[Target], of: &Range<usize>, product: &[f64], run: &mut Run<'_>) {
    for target in targets {
        let (rows, columns) = (target.rows.len, target.columns.len);
        let block = run.block(target.block, rows * columns);
        for j in 0..columns {
            let start = (target.columns.start + j) * of.len() + target.rows.start - of.start;
            let from = &product[start..start + rows];
            if target.way != Way::Transposed {
                add_scaled(&mut block[j * rows..(j + 1) * rows], 1.0, from);
            }
            if target.way != Way::AsItIs {
                for (i, from) in from.iter().enumerate() {
                    block[j + i * columns] += from;
                }
            }
        }
    }
}
