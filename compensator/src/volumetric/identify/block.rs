//! One error function in the design: its nodes, and parameters that keep the conventions.

use nalgebra::{DMatrix, SymmetricEigen};

use super::{Axis, FunctionPlan, IdentifyError, Plan};
use crate::volumetric::function::{Pieces, Shape};
use crate::volumetric::model::ErrorName;

/// One function's nodes and how its parameters make their values.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub(super) name: ErrorName,
    pub(super) nodes: Vec<f64>,
    /// What a value of 1 at one node alone makes of all places, by node.
    influences: Vec<Pieces>,
    /// nodes × parameters; its columns keep the conventions.
    pub(super) basis: DMatrix<f64>,
    /// The first of its parameters.
    pub(super) first: usize,
}

impl Block {
    /// The value at `position` per parameter.
    pub(super) fn row(&self, position: f64) -> Vec<f64> {
        let values = self.weights(position);
        let column = |column: usize| {
            let shares = self.basis.column(column).into_iter().zip(&values);
            shares.map(|(share, value)| share * value).sum()
        };
        (0..self.basis.ncols()).map(column).collect()
    }
}

impl Block {
    /// Of which axis's position it is.
    pub(super) fn axis(&self) -> Axis {
        axis_of(self.name)
    }

    /// Whether `position` is within its nodes.
    pub(super) fn reaches(&self, position: f64) -> bool {
        let (first, last) = (self.nodes[0], self.nodes[self.nodes.len() - 1]);
        position >= first && position <= last
    }

    /// How much each node's value counts at `position`.
    pub(super) fn weights(&self, position: f64) -> Vec<f64> {
        self.influences.iter().map(|it| it.at(position)).collect()
    }
}

/// What a value of 1 at each node alone makes of all places. Monotone cubics are not the sum of
/// what their nodes make: straight lines stand for them.
fn influences(nodes: &[f64], shape: Shape) -> Vec<Pieces> {
    let shape = match shape {
        Shape::Linear | Shape::MonotoneCubic => Shape::Linear,
        Shape::Spline => Shape::Spline,
    };
    let of = |node: usize| {
        let mut values = vec![0.0; nodes.len()];
        values[node] = 1.0;
        Pieces::new(nodes, &values, shape).expect("the nodes were checked")
    };
    (0..nodes.len()).map(of).collect()
}

pub(super) fn axis_of(name: ErrorName) -> Axis {
    match name {
        ErrorName::Along(axis, _) | ErrorName::About(axis, _) => axis,
    }
}

pub(super) fn block(
    plan: &Plan,
    function: &FunctionPlan,
    first: usize,
) -> Result<Block, IdentifyError> {
    let name = function.name;
    let nodes: Vec<f64> = function.nodes.iter().map(|it| it.value()).collect();
    let is_straightness = matches!(name, ErrorName::Along(axis, along) if axis != along);
    let least = if is_straightness { 3 } else { 2 };
    let ordered = nodes.windows(2).all(|it| it[0] < it[1]);
    let finite = nodes.iter().all(|it| it.is_finite());
    if nodes.len() < least || !ordered || !finite {
        return Err(IdentifyError::Nodes { name, least });
    }
    let count = nodes.len();
    let influences = influences(&nodes, plan.shape);
    let conditions = if is_straightness {
        let middle = (nodes[0] + nodes[count - 1]) / 2.0;
        let span = nodes[count - 1] - nodes[0];
        DMatrix::from_fn(2, count, |row, at| {
            if row == 0 {
                1.0
            } else {
                (nodes[at] - middle) / span
            }
        })
    } else {
        let zero = plan.zero.along(axis_of(name));
        if zero.value() < nodes[0] || zero.value() > nodes[count - 1] {
            return Err(IdentifyError::Zero { name, zero });
        }
        DMatrix::from_fn(1, count, |_, at| influences[at].at(zero.value()))
    };
    Ok(Block {
        name,
        basis: kernel(&conditions),
        influences,
        nodes,
        first,
    })
}

/// Orthonormal columns that span all values for which the conditions (independent rows) hold.
pub(super) fn kernel(conditions: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, count) = conditions.shape();
    let gram = conditions * conditions.transpose();
    let inverse = gram.try_inverse().expect("the conditions are independent");
    let onto = DMatrix::identity(count, count) - conditions.transpose() * inverse * conditions;
    let eigen = SymmetricEigen::new(onto);
    let mut order: Vec<usize> = (0..count).collect();
    // Eigenvalues are 0 for the conditions and 1 for the rest.
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    order.truncate(count - rows);
    eigen.eigenvectors.select_columns(&order)
}
