//! An element of order 3, to show that what is general takes one: it only states its nodes and basis.

use super::{Barycentric, Element};

/// The cubic triangle with 10 nodes.
pub(crate) struct Cubic;

impl Cubic {
    /// Per node the factors of its basis function: l_corner - shift, and the scale of their product.
    fn factors(node: usize) -> ([(usize, f64); 3], f64) {
        let third = 1.0 / 3.0;
        if node < 3 {
            ([(node, 0.0), (node, third), (node, 2.0 * third)], 4.5)
        } else if node < 9 {
            let edge = (node - 3) / 2;
            let (a, b) = (edge, (edge + 1) % 3);
            let twice = if (node - 3).is_multiple_of(2) { a } else { b };
            ([(a, 0.0), (b, 0.0), (twice, third)], 13.5)
        } else {
            ([(0, 0.0), (1, 0.0), (2, 0.0)], 27.0)
        }
    }
}

impl Element<10> for Cubic {
    const ORDER: u32 = 3;
    const NODES: [Barycentric; 10] = {
        let (a, b, c) = (2.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0);
        [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [a, b, 0.0],
            [b, a, 0.0],
            [0.0, a, b],
            [0.0, b, a],
            [b, 0.0, a],
            [a, 0.0, b],
            [b, b, c],
        ]
    };

    fn basis(l: Barycentric) -> [f64; 10] {
        std::array::from_fn(|n| {
            let (factors, scale) = Self::factors(n);
            scale * factors.iter().map(|(k, shift)| l[*k] - shift).product::<f64>()
        })
    }

    fn gradients(l: Barycentric) -> [[f64; 2]; 10] {
        std::array::from_fn(|n| {
            let (factors, scale) = Self::factors(n);
            let mut along = [0.0; 3];
            for (i, (corner, _)) in factors.iter().enumerate() {
                let others = (0..3).filter(|j| *j != i).map(|j| l[factors[j].0] - factors[j].1);
                along[*corner] += scale * others.product::<f64>();
            }
            [along[1] - along[0], along[2] - along[0]]
        })
    }
}
