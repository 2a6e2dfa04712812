//! Reverse mode: a record of the operations of one computation, and the sweep back through it.

#[cfg(test)]
mod tests;

use std::cell::{Cell, RefCell};
use std::fmt;
use std::marker::PhantomData;

use crate::{Real, Var};

/// Stands for a parent that is a constant or missing.
const NONE: u32 = u32::MAX;

/// One operation: which values went into it, and its derivative with respect to each.
#[derive(Clone, Copy, Debug)]
struct Node<T> {
    parents: [u32; 2],
    slopes: [T; 2],
}

/// The memory that a computation is recorded in, kept for the next one.
///
/// A computation runs inside [`Tape::scope`]. Its lifetime `'t` is one that exists nowhere else, so the compiler
/// rejects a [`Var`] that leaves its scope or meets one of another tape:
///
/// ```
/// use graspd_ad::Tape;
///
/// let mut tape = Tape::new();
/// let slope = tape.scope(|recording| {
///     let x = recording.variable(3.0);
///     recording.adjoints(x * x).of(x)
/// });
/// assert_eq!(slope, 6.0);
/// ```
/// A variable cannot leave its scope,
/// ```compile_fail
/// let mut tape = graspd_ad::Tape::<f64>::new();
/// let x = tape.scope(|recording| recording.variable(3.0));
/// ```
/// nor meet one of another tape,
/// ```compile_fail,E0521
/// let (mut one, mut other) = (graspd_ad::Tape::<f64>::new(), graspd_ad::Tape::<f64>::new());
/// one.scope(|one| other.scope(|other| {
///     let _ = one.variable(3.0) * other.variable(4.0);
/// }));
/// ```
/// (while variables of one tape do),
/// ```
/// let mut one = graspd_ad::Tape::<f64>::new();
/// one.scope(|one| {
///     let _ = one.variable(3.0) * one.variable(4.0);
/// });
/// ```
/// nor can another thread's: neither the variable nor the recording can be sent there,
/// ```compile_fail,E0277
/// graspd_ad::Tape::<f64>::new().scope(|recording| {
///     let x = recording.variable(3.0);
///     std::thread::scope(|threads| threads.spawn(move || x.value()).join());
/// });
/// ```
/// ```compile_fail,E0277
/// fn shared<T: Sync>() {}
/// shared::<graspd_ad::Tape<f64>>();
/// ```
/// though a tape that is not recording may move to another thread.
/// ```
/// fn sent<T: Send>() {}
/// sent::<graspd_ad::Tape<f64>>();
/// ```
///
/// The base `T` is a plain float, or a [`Dual`](crate::Dual) over one, which makes second derivatives.
#[derive(Default)]
pub struct Tape<T = f64> {
    nodes: RefCell<Vec<Node<T>>>,
    /// Memory for the next sweep.
    spare: Cell<Vec<T>>,
}

impl<T: Real<Mask = bool> + 'static> Tape<T> {
    /// An empty tape.
    pub fn new() -> Self {
        Self {
            nodes: RefCell::new(Vec::new()),
            spare: Cell::new(Vec::new()),
        }
    }

    /// Records one computation, forgetting the one before but keeping its memory.
    pub fn scope<R>(&mut self, computation: impl for<'t> FnOnce(Recording<'t, T>) -> R) -> R {
        self.nodes.get_mut().clear();
        computation(Recording {
            tape: self,
            brand: PhantomData,
        })
    }

    fn push(&self, parents: [u32; 2], slopes: [T; 2]) -> u32 {
        let mut nodes = self.nodes.borrow_mut();
        let index = u32::try_from(nodes.len())
            .ok()
            .filter(|&index| index != NONE)
            .expect("2^32 operations take 100 GB");
        nodes.push(Node { parents, slopes });
        index
    }
}

impl<T> fmt::Debug for Tape<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let operations = self.nodes.borrow().len();
        formatter
            .debug_struct("Tape")
            .field("operations", &operations)
            .finish()
    }
}

/// Makes a lifetime neither longer nor shorter than the scope it was made for.
pub(crate) type Brand<'t> = PhantomData<Cell<&'t ()>>;

/// The computation that a [`Tape`] is recording.
#[derive(Clone, Copy, Debug)]
pub struct Recording<'t, T = f64> {
    tape: &'t Tape<T>,
    brand: Brand<'t>,
}

impl<'t, T: Real<Mask = bool> + 'static> Recording<'t, T> {
    /// A new variable, to differentiate with respect to.
    pub fn variable(self, value: T) -> Var<'t, T> {
        let index = self.tape.push([NONE; 2], [T::zero(); 2]);
        Var::recorded(
            value,
            Place {
                tape: self.tape,
                index,
                brand: PhantomData,
            },
        )
    }

    /// A new variable for each value.
    pub fn variables(self, values: &[T]) -> Vec<Var<'t, T>> {
        values.iter().map(|&value| self.variable(value)).collect()
    }

    /// The derivatives of `output` with respect to everything it was computed from.
    pub fn adjoints(self, output: Var<'t, T>) -> Adjoints<'t, T> {
        self.adjoints_of([(output, T::one())])
    }

    /// The derivatives of a weighted sum of outputs, given as (output, weight): the product of the weights with
    /// the Jacobian.
    ///
    /// An operation that no output depends on passes nothing on, even if its own derivative is infinite.
    pub fn adjoints_of(
        self,
        outputs: impl IntoIterator<Item = (Var<'t, T>, T)>,
    ) -> Adjoints<'t, T> {
        let nodes = self.tape.nodes.borrow();
        let mut values = self.tape.spare.take();
        values.clear();
        values.resize(nodes.len(), T::zero());
        for (output, weight) in outputs {
            if let Some(place) = output.place() {
                values[place.index as usize] += weight;
            }
        }
        for (index, node) in nodes.iter().enumerate().rev() {
            let adjoint = values[index];
            if adjoint.is_zero() {
                continue;
            }
            for (parent, slope) in node.parents.into_iter().zip(node.slopes) {
                if parent != NONE {
                    values[parent as usize] += adjoint * slope;
                }
            }
        }
        Adjoints {
            values,
            tape: self.tape,
            brand: PhantomData,
        }
    }

    /// How many variables and operations were recorded so far.
    pub fn operations(self) -> usize {
        self.tape.nodes.borrow().len()
    }
}

/// The derivatives of an output with respect to every recorded value.
#[derive(Debug)]
pub struct Adjoints<'t, T: Real<Mask = bool>> {
    values: Vec<T>,
    tape: &'t Tape<T>,
    brand: Brand<'t>,
}

impl<'t, T: Real<Mask = bool> + 'static> Adjoints<'t, T> {
    /// The derivative with respect to a variable or an intermediate result; 0 for a constant.
    pub fn of(&self, variable: Var<'t, T>) -> T {
        let recorded = variable
            .place()
            .and_then(|place| self.values.get(place.index as usize));
        recorded.copied().unwrap_or_else(T::zero)
    }

    /// The derivatives with respect to several variables.
    pub fn of_all(&self, variables: &[Var<'t, T>]) -> Vec<T> {
        variables
            .iter()
            .map(|&variable| self.of(variable))
            .collect()
    }
}

impl<T: Real<Mask = bool>> Drop for Adjoints<'_, T> {
    fn drop(&mut self) {
        self.tape.spare.set(std::mem::take(&mut self.values));
    }
}

/// Where a value was recorded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place<'t, T> {
    tape: &'t Tape<T>,
    index: u32,
    brand: Brand<'t>,
}

impl<T> PartialEq for Place<'_, T> {
    fn eq(&self, other: &Self) -> bool {
        // The tape is the same, or the lifetimes would differ.
        self.index == other.index
    }
}

impl<'t, T: Real<Mask = bool> + 'static> Place<'t, T> {
    /// Records an operation on the value here.
    pub(crate) fn record(self, slope: T) -> Self {
        let index = self.tape.push([self.index, NONE], [slope, T::zero()]);
        Self { index, ..self }
    }

    /// Records an operation on the values here and there.
    pub(crate) fn record2(self, other: Self, slope: T, other_slope: T) -> Self {
        let index = self
            .tape
            .push([self.index, other.index], [slope, other_slope]);
        Self { index, ..self }
    }
}
