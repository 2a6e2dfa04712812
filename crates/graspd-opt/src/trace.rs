//! What happened along a run.

use graspd_settings::AT_LEAST_ONE;

use crate::OptimizationError;

/// Named scalars recorded every few steps.
///
/// ```
/// use graspd_opt::Trace;
///
/// # fn main() -> Result<(), graspd_opt::OptimizationError> {
/// let mut trace = Trace::new(&["loss", "radius"], 20, 7000)?;
/// for step in 0..7000 {
///     trace.record(step, &[1.0 / (1.0 + step as f64), 0.0]);
/// }
/// assert_eq!(trace.len(), 350);
/// assert_eq!(trace.last("loss"), Some(1.0 / 6981.0));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    names: Vec<String>,
    every: usize,
    steps: Vec<usize>,
    columns: Vec<Vec<f64>>,
}

impl Trace {
    /// An empty trace with room for a run of `run_len` steps, of which it records each `every`-th, beginning with
    /// step 0.
    ///
    /// Recording a longer run works, but then allocates.
    ///
    /// # Errors
    /// If `every` is 0 or two columns have the same name.
    pub fn new(names: &[&str], every: usize, run_len: usize) -> Result<Self, OptimizationError> {
        AT_LEAST_ONE.check("steps between the rows of a trace", &every)?;
        for (index, name) in names.iter().enumerate() {
            if names[..index].contains(name) {
                return Err(OptimizationError::DuplicateColumn {
                    name: (*name).to_owned(),
                });
            }
        }
        let capacity = run_len.div_ceil(every);
        Ok(Self {
            names: names.iter().map(|&name| name.to_owned()).collect(),
            every,
            steps: Vec::with_capacity(capacity),
            columns: names.iter().map(|_| Vec::with_capacity(capacity)).collect(),
        })
    }

    /// Whether this step is one that is recorded, for callers whose values cost something to compute.
    pub fn is_due(&self, step: usize) -> bool {
        step.is_multiple_of(self.every)
    }

    /// Records a row if the step is due; returns whether it did.
    ///
    /// # Panics
    /// If there are not as many values as columns.
    pub fn record(&mut self, step: usize, values: &[f64]) -> bool {
        assert_eq!(values.len(), self.columns.len(), "values for the columns");
        let is_due = self.is_due(step);
        if is_due {
            self.steps.push(step);
            for (column, &value) in self.columns.iter_mut().zip(values) {
                column.push(value);
            }
        }
        is_due
    }

    /// Drops all rows and keeps the room.
    pub fn clear(&mut self) {
        self.steps.clear();
        self.columns.iter_mut().for_each(Vec::clear);
    }
    /// How many rows were recorded.
    pub fn len(&self) -> usize {
        self.steps.len()
    }
    /// Whether none was.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }
    /// The step of each row, `[len]`.
    pub fn steps(&self) -> &[usize] {
        &self.steps
    }
    /// The columns' names, in order.
    pub fn names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }
    /// A column, `[len]`; `None` if there is none of this name.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let index = self.names.iter().position(|other| other == name)?;
        Some(&self.columns[index])
    }
    /// The last value of a column; `None` if there is no such column or no row.
    pub fn last(&self, name: &str) -> Option<f64> {
        self.column(name)?.last().copied()
    }
    /// The columns with their names, in order.
    pub fn columns(&self) -> impl ExactSizeIterator<Item = (&str, &[f64])> {
        self.names().zip(self.columns.iter().map(Vec::as_slice))
    }
    /// The rows as (step, values in the order of the columns).
    pub fn rows(
        &self,
    ) -> impl ExactSizeIterator<Item = (usize, impl ExactSizeIterator<Item = f64>)> {
        self.steps.iter().enumerate().map(|(row, &step)| {
            let values = self.columns.iter().map(move |column| column[row]);
            (step, values)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recorded() -> Trace {
        let mut trace = Trace::new(&["loss", "radius"], 3, 10).unwrap();
        for step in 0..10 {
            let is_recorded = trace.record(step, &[step as f64, -(step as f64)]);
            assert_eq!(is_recorded, trace.is_due(step));
        }
        trace
    }

    #[test]
    fn every_third_step_is_recorded() {
        let trace = recorded();
        assert_eq!(trace.steps(), [0, 3, 6, 9]);
        assert_eq!(trace.len(), 4);
        assert_eq!(trace.column("radius").unwrap(), [0.0, -3.0, -6.0, -9.0]);
        assert_eq!(trace.last("loss"), Some(9.0));
        assert_eq!(trace.column("lost"), None);
        assert_eq!(trace.last("lost"), None);
    }

    #[test]
    fn rows_and_columns_hold_the_same() {
        let trace = recorded();
        let rows: Vec<(usize, Vec<f64>)> = trace
            .rows()
            .map(|(step, values)| (step, values.collect()))
            .collect();
        assert_eq!(rows[2], (6, vec![6.0, -6.0]));
        let columns: Vec<_> = trace.columns().collect();
        assert_eq!(columns[0], ("loss", [0.0, 3.0, 6.0, 9.0].as_slice()));
        assert_eq!(rows.len(), trace.len());
        assert_eq!(trace.names().collect::<Vec<_>>(), ["loss", "radius"]);
    }

    #[test]
    fn the_announced_run_needs_no_more_room() {
        let mut trace = Trace::new(&["loss"], 7, 100).unwrap();
        let room = (trace.steps.as_ptr(), trace.columns[0].as_ptr());
        for round in 0..2 {
            for step in 0..100 {
                trace.record(step, &[0.0]);
            }
            assert_eq!(trace.len(), 15, "round {round}");
            assert_eq!(room, (trace.steps.as_ptr(), trace.columns[0].as_ptr()));
            trace.clear();
            assert!(trace.is_empty() && trace.last("loss").is_none());
        }
    }

    #[test]
    fn faults_are_named() {
        let fault = Trace::new(&["loss", "radius", "loss"], 1, 10).unwrap_err();
        assert!(fault.to_string().contains("\"loss\""), "{fault}");
        let fault = Trace::new(&["loss"], 0, 10).unwrap_err();
        assert!(fault.to_string().contains("between the rows"), "{fault}");
    }
}
