//! Typed keys, and the tuples of variables that factors and functions are written on.
use crate::{Scalar, Variable};
use std::marker::PhantomData;

/// Names a node of a graph and remembers its type, so that a swapped argument does not compile.
///
/// ```compile_fail
/// use handeye_solvers::{Factor, Graph, Pose, Scalar, Vector};
/// struct Sees;
/// impl Factor<1> for Sees {
///     type On = (Pose, Vector<3>);
///     fn residual<T: Scalar>(&self, (pose, point): (Pose<T>, Vector<3, T>)) -> [T; 1] {
///         [pose.transform(&point).z]
///     }
/// }
/// let mut graph = Graph::new();
/// let pose = graph.free(Pose::identity());
/// let point = graph.free(Vector::<3>::zeros());
/// graph.factor(Sees, (point, pose)); // expected `Key<Pose>`, found `Key<Matrix<f64, Const<3>, ...>>`
/// ```
pub struct Key<V> {
    pub(crate) index: u32,
    variable: PhantomData<fn() -> V>,
}

impl<V> Key<V> {
    pub(crate) fn new(index: usize) -> Self {
        Key { index: u32::try_from(index).expect("a graph has fewer than 2^32 nodes"), variable: PhantomData }
    }

    /// Which node it is, in the order in which nodes were added.
    pub fn index(self) -> usize {
        self.index as usize
    }
}

impl<V> Clone for Key<V> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<V> Copy for Key<V> {}

impl<V> PartialEq for Key<V> {
    fn eq(&self, other: &Self) -> bool {
        self.index == other.index
    }
}

impl<V> Eq for Key<V> {}

impl<V> std::fmt::Debug for Key<V> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Key({})", self.index)
    }
}

/// A tuple of one to eight variables.
pub trait Variables: 'static {
    /// One key per variable.
    type Keys: Copy + Send + Sync + 'static;
    /// Node indices, as many as there are variables.
    type Nodes: AsRef<[u32]> + Copy + Send + Sync + 'static;
    /// The tuple over another scalar.
    type Over<T: Scalar>;

    /// The nodes that the keys name.
    fn nodes(keys: Self::Keys) -> Self::Nodes;

    /// The tuple with each variable moved to first order: `x[k]` is how the k-th is stored, `delta(k, i)` the i-th number
    /// of its step.
    fn seed<T: Scalar>(x: &[&[f64]], delta: impl Fn(usize, usize) -> T) -> Self::Over<T>;

    /// Each variable as it is stored, and how many numbers its step has.
    fn stored(&self) -> Vec<(Vec<f64>, usize)>;

    /// Moves the k-th variable, from and to how it is stored.
    fn retract(k: usize, x: &[f64], delta: &[f64], y: &mut [f64]);
}

macro_rules! variables {
    ($($variable:ident $key:ident $k:tt),+) => {
        impl<$($variable: Variable<Over<f64> = $variable>),+> Variables for ($($variable,)+) {
            type Keys = ($(Key<$variable>,)+);
            type Nodes = [u32; [$($k),+].len()];
            type Over<T: Scalar> = ($($variable::Over<T>,)+);

            fn nodes(($($key,)+): Self::Keys) -> Self::Nodes {
                [$($key.index),+]
            }

            #[inline]
            fn seed<T: Scalar>(x: &[&[f64]], delta: impl Fn(usize, usize) -> T) -> Self::Over<T> {
                ($($variable::seed(x[$k], |i| delta($k, i)),)+)
            }

            fn stored(&self) -> Vec<(Vec<f64>, usize)> {
                vec![$({
                    let mut x = vec![0.0; self.$k.ambient()];
                    $variable::store(&self.$k, &mut x);
                    (x, self.$k.tangent())
                }),+]
            }

            fn retract(k: usize, x: &[f64], delta: &[f64], y: &mut [f64]) {
                match k {
                    $($k => $variable::store(&$variable::retract::<f64>(x, |i| delta[i]), y),)+
                    _ => unreachable!("a tuple has no such variable"),
                }
            }
        }
    };
}

variables!(A a 0);
variables!(A a 0, B b 1);
variables!(A a 0, B b 1, C c 2);
variables!(A a 0, B b 1, C c 2, D d 3);
variables!(A a 0, B b 1, C c 2, D d 3, E e 4);
variables!(A a 0, B b 1, C c 2, D d 3, E e 4, F f 5);
variables!(A a 0, B b 1, C c 2, D d 3, E e 4, F f 5, G g 6);
variables!(A a 0, B b 1, C c 2, D d 3, E e 4, F f 5, G g 6, H h 7);
