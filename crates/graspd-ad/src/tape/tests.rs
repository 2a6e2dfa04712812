//! What a tape keeps, forgets and passes on.

use super::*;

fn wave(recording: Recording<'_>, terms: usize) -> f64 {
    let x = recording.variable(0.3);
    let mut sum = Var::constant(0.0);
    for _ in 0..terms {
        sum += (sum * x).sin() + x;
    }
    recording.adjoints(sum).of(x)
}

#[test]
fn memory_is_kept_and_the_past_forgotten() {
    let mut tape = Tape::new();
    let first = tape.scope(|recording| wave(recording, 100));
    let (nodes, adjoints) = (
        tape.nodes.get_mut().capacity(),
        tape.spare.get_mut().capacity(),
    );
    let memory = (tape.nodes.get_mut().as_ptr(), tape.spare.get_mut().as_ptr());
    assert!(nodes > 300 && adjoints > 300);
    for _ in 0..3 {
        assert_eq!(tape.scope(|recording| wave(recording, 100)), first);
        assert_eq!(tape.scope(|recording| recording.operations()), 0);
    }
    assert_eq!(
        (tape.nodes.get_mut().as_ptr(), tape.spare.get_mut().as_ptr()),
        memory
    );
}

#[test]
fn constants_are_not_recorded() {
    Tape::new().scope(|recording| {
        let x = recording.variable(2.0);
        let constant = Var::constant(3.0).exp() * Var::constant(4.0);
        assert_eq!(recording.operations(), 1);
        let y = constant * x;
        assert_eq!(recording.operations(), 2);
        let adjoints = recording.adjoints(y);
        assert_eq!(adjoints.of(constant), 0.0);
        assert_eq!(adjoints.of(x), 4.0 * 3.0_f64.exp());
        assert_eq!(recording.adjoints(constant).of(x), 0.0);
    });
}

#[test]
fn several_outputs_and_several_sweeps() {
    Tape::new().scope(|recording| {
        let x = recording.variables(&[2.0, 3.0]);
        let (product, sum) = (x[0] * x[1], x[0] + x[1]);
        let of_product = recording.adjoints(product);
        let of_sum = recording.adjoints(sum);
        assert_eq!(of_product.of_all(&x), [3.0, 2.0]);
        assert_eq!(of_sum.of_all(&x), [1.0, 1.0]);
        let later = product * sum;
        // Recorded after the sweep.
        assert_eq!(of_sum.of(later), 0.0);
        // An output may be given more than once, and intermediate results have derivatives too.
        let both = recording.adjoints_of([(later, 1.0), (sum, 10.0), (sum, 100.0)]);
        assert_eq!(both.of(product), 5.0);
        assert_eq!(both.of(sum), 116.0);
        assert_eq!(both.of_all(&x), [131.0, 126.0]);
    });
}

#[test]
fn an_unused_pole_stays_silent() {
    Tape::new().scope(|recording| {
        let x = recording.variable(0.0);
        let (pole, other) = (x.ln(), x + Var::constant(1.0));
        let chosen = Var::select(x.gt(Var::constant(0.0)), pole, other);
        assert_eq!(recording.adjoints(chosen).of(x), 1.0);
    });
}
