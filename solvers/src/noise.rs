//! Noise of a residual: what whitens it.

/// The noise of a factor's residual of dimension `M`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise<const M: usize> {
    /// One standard deviation for every component, stored as 1/σ.
    Isotropic(f64),
    /// One standard deviation per component, stored as 1/σ.
    Diagonal([f64; M]),
    /// W with r ↦ W r white: any W with WᵀW = Σ⁻¹, by rows.
    Full([[f64; M]; M]),
}

impl<const M: usize> Noise<M> {
    /// Whitens the residual in place, and the rows of its Jacobian, which are `width` wide.
    #[inline]
    pub(crate) fn whiten(&self, r: &mut [f64; M], jacobian: Option<(&mut [f64], usize)>) {
        match self {
            Noise::Isotropic(w) if *w == 1.0 => {}
            Noise::Isotropic(w) => {
                r.iter_mut().for_each(|x| *x *= w);
                if let Some((data, width)) = jacobian {
                    data[..M * width].iter_mut().for_each(|x| *x *= w);
                }
            }
            Noise::Diagonal(w) => {
                for (x, w) in r.iter_mut().zip(w) {
                    *x *= w;
                }
                if let Some((data, width)) = jacobian {
                    for (m, w) in w.iter().enumerate() {
                        data[m * width..(m + 1) * width].iter_mut().for_each(|x| *x *= w);
                    }
                }
            }
            Noise::Full(w) => {
                *r = multiply(w, r);
                if let Some((data, width)) = jacobian {
                    for column in 0..width {
                        let old = std::array::from_fn(|m| data[m * width + column]);
                        for (m, value) in multiply(w, &old).into_iter().enumerate() {
                            data[m * width + column] = value;
                        }
                    }
                }
            }
        }
    }
}

fn multiply<const M: usize>(w: &[[f64; M]; M], r: &[f64; M]) -> [f64; M] {
    std::array::from_fn(|i| w[i].iter().zip(r).map(|(a, b)| a * b).sum())
}
