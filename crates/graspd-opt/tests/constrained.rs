//! The differential method of multipliers against closed-form solutions of constrained problems.

use graspd_opt::{
    AdamSettings, Constraint, InequalityForm, Mdmm, MdmmSettings, OptimizationError, Outcome,
    Schedule, Status,
};
use proptest::prelude::*;

/// The solver's tolerance is 1e-8 on derivatives; solutions of these well-conditioned problems follow to about that.
const CLOSE: f64 = 1e-6;

fn solver<'a>() -> Mdmm<'a> {
    Mdmm::new(MdmmSettings::default()).unwrap()
}

/// The function c . x, with its gradient.
fn linear(coefficients: &[f64]) -> impl FnMut(&[f64], &mut [f64]) -> f64 + '_ {
    move |x, gradient| {
        gradient.copy_from_slice(coefficients);
        x.iter().zip(coefficients).map(|(x, c)| x * c).sum()
    }
}
/// The squared distance from a point, with its gradient.
fn squared_distance(from: &[f64]) -> impl FnMut(&[f64], &mut [f64]) -> f64 + '_ {
    move |x, gradient| {
        let mut sum = 0.0;
        for i in 0..x.len() {
            gradient[i] = 2.0 * (x[i] - from[i]);
            sum += (x[i] - from[i]).powi(2);
        }
        sum
    }
}

fn assert_solution(outcome: &Outcome, x: &[f64], multipliers: &[f64]) {
    assert_eq!(outcome.status, Status::Converged, "{outcome:?}");
    for (actual, expected) in outcome.x.iter().zip(x) {
        assert!((actual - expected).abs() < CLOSE, "{outcome:?}");
    }
    for (actual, expected) in outcome.multipliers.iter().zip(multipliers) {
        assert!((actual - expected).abs() < CLOSE, "{outcome:?}");
    }
    assert_eq!(outcome.multipliers.len(), multipliers.len());
}

#[test]
fn no_constraint() {
    let outcome = solver().minimize(&[4.0], squared_distance(&[2.0])).unwrap();
    assert_solution(&outcome, &[2.0], &[]);
}

#[test]
fn equality() {
    let outcome = solver()
        .subject_to(Constraint::equal_to(1.0), linear(&[1.0, 1.0]))
        .unwrap()
        .minimize(&[3.0, -1.0], squared_distance(&[0.0, 0.0]))
        .unwrap();
    assert_solution(&outcome, &[0.5, 0.5], &[-1.0]);
    assert!((outcome.value - 0.5).abs() < CLOSE);
}

#[test]
fn only_damping_settles_an_objective_without_curvature() {
    // Minimise x subject to x = 1: undamped, x and the multiplier circle the solution for ever.
    let minimize = |damping: f64| {
        let constraint = Constraint::equal_to(1.0).with_damping(damping);
        solver()
            .subject_to(constraint, linear(&[1.0]))
            .unwrap()
            .minimize(&[3.0], linear(&[1.0]))
            .unwrap()
    };
    assert_solution(&minimize(1.0), &[1.0], &[-1.0]);
    assert_ne!(minimize(0.0).status, Status::Converged);
}

#[test]
fn inequality_active() {
    let outcome = solver()
        .subject_to(Constraint::less_than(1.0), linear(&[1.0]))
        .unwrap()
        .minimize(&[4.0], squared_distance(&[2.0]))
        .unwrap();
    assert_solution(&outcome, &[1.0], &[2.0]);
}

#[test]
fn inequality_inactive() {
    // From a start that violates it, so that the multiplier rises first.
    let outcome = solver()
        .subject_to(Constraint::less_than(3.0), linear(&[1.0]))
        .unwrap()
        .minimize(&[8.0], squared_distance(&[2.0]))
        .unwrap();
    assert_solution(&outcome, &[2.0], &[0.0]);
}

#[test]
fn max_form_holds_the_limit_to_within_a_step() {
    let settings = MdmmSettings {
        rate: Schedule::constant(0.02)
            .and_then(|rate| rate.with_exponential_decay(2000, 10_000, 1e-6))
            .unwrap(),
        max_steps: 10_000,
        ..MdmmSettings::default()
    };
    let outcome = Mdmm::new(settings)
        .unwrap()
        .subject_to(
            Constraint::less_than(1.0).with_form(InequalityForm::Max),
            linear(&[1.0]),
        )
        .unwrap()
        .minimize(&[4.0], squared_distance(&[2.0]))
        .unwrap();
    // The last rate is 2e-8 and the derivatives at most 2 + lambda.
    assert!((outcome.x[0] - 1.0).abs() < CLOSE, "{outcome:?}");
    assert!(outcome.multipliers[0] >= 2.0 - CLOSE, "{outcome:?}");
}

#[test]
fn a_multiplier_that_moves_by_adamax() {
    let settings = MdmmSettings {
        rate: Schedule::constant(0.01)
            .and_then(|rate| rate.with_exponential_decay(2000, 8000, 1e-5))
            .unwrap(),
        max_steps: 8000,
        ..MdmmSettings::default()
    };
    let constraint = Constraint::less_than(1.0)
        .with_adamax(AdamSettings::default())
        .unwrap();
    let outcome = Mdmm::new(settings)
        .unwrap()
        .subject_to(constraint, linear(&[1.0, 1.0]))
        .unwrap()
        .minimize(&[3.0, -1.0], squared_distance(&[1.0, 1.0]))
        .unwrap();
    // Adamax-type steps end about one last rate (1e-7) away, times the number of steps at about that rate.
    for x in &outcome.x {
        assert!((x - 0.5).abs() < 1e-4, "{outcome:?}");
    }
    assert!((outcome.multipliers[0] - 1.0).abs() < 1e-3, "{outcome:?}");
}

#[test]
fn one_of_two_constraints_active() {
    // x + y > 2 holds the minimum up, x + y < 10 does not matter.
    let outcome = solver()
        .subject_to(Constraint::less_than(-2.0), linear(&[-1.0, -1.0]))
        .unwrap()
        .subject_to(Constraint::less_than(10.0), linear(&[1.0, 1.0]))
        .unwrap()
        .minimize(&[9.0, 9.0], squared_distance(&[0.0, 0.0]))
        .unwrap();
    assert_solution(&outcome, &[1.0, 1.0], &[2.0, 0.0]);
}

#[test]
fn two_constraints_active() {
    // x + y > 2 and x < 0.5: 2x - a + b = 0, 2y - a = 0.
    let outcome = solver()
        .subject_to(Constraint::less_than(-2.0), linear(&[-1.0, -1.0]))
        .unwrap()
        .subject_to(Constraint::less_than(0.5), linear(&[1.0, 0.0]))
        .unwrap()
        .minimize(&[0.0, 0.0], squared_distance(&[0.0, 0.0]))
        .unwrap();
    assert_solution(&outcome, &[0.5, 1.5], &[3.0, 2.0]);
}

#[test]
fn equality_and_inequality() {
    // x + y = 1 and x < 0.2: 2x + a + b = 0, 2y + a = 0.
    let outcome = solver()
        .subject_to(Constraint::equal_to(1.0), linear(&[1.0, 1.0]))
        .unwrap()
        .subject_to(Constraint::less_than(0.2), linear(&[1.0, 0.0]))
        .unwrap()
        .minimize(&[0.0, 0.0], squared_distance(&[0.0, 0.0]))
        .unwrap();
    assert_solution(&outcome, &[0.2, 0.8], &[-1.6, 1.2]);
}

#[test]
fn nonconvex_circle() {
    // Maximise x + y on the unit circle: -1 + 2 x lambda = 0.
    let outcome = solver()
        .subject_to(Constraint::equal_to(1.0), squared_distance(&[0.0, 0.0]))
        .unwrap()
        .minimize(&[0.9, -0.1], linear(&[-1.0, -1.0]))
        .unwrap();
    let half = 0.5_f64.sqrt();
    assert_solution(&outcome, &[half, half], &[half]);
}

#[test]
fn multiplier_is_the_price_of_the_limit() {
    let optimum = |limit: f64| {
        solver()
            .subject_to(Constraint::less_than(limit), linear(&[2.0, 1.0]))
            .unwrap()
            .minimize(&[0.0, 0.0], squared_distance(&[3.0, 1.0]))
            .unwrap()
    };
    let step = 1e-3;
    let slope = (optimum(1.0 + step).value - optimum(1.0 - step).value) / (2.0 * step);
    // The optimal value is quadratic in the limit: central differences are exact up to the solver's 1e-8 / step.
    assert!((slope + optimum(1.0).multipliers[0]).abs() < 1e-4);
}

#[test]
fn first_step_by_hand() {
    // At x = 4 the limit 1 is exceeded by 3, and the multiplier rises by its own rate times that.
    let settings = MdmmSettings {
        multiplier_rate_ratio: 5.0,
        rate: Schedule::constant(0.02).unwrap(),
        max_steps: 1,
        ..MdmmSettings::default()
    };
    let outcome = Mdmm::new(settings)
        .unwrap()
        .subject_to(Constraint::less_than(1.0), linear(&[1.0]))
        .unwrap()
        .minimize(&[4.0], squared_distance(&[2.0]))
        .unwrap();
    // The gradient is 2 (4 - 2) + damping 3.
    assert!((outcome.x[0] - (4.0 - 0.02 * 7.0)).abs() < CLOSE);
    assert!((outcome.multipliers[0] - 0.1 * 3.0).abs() < CLOSE);
    assert!((outcome.infeasibility - 2.86).abs() < CLOSE);
}

#[test]
fn outcomes_other_than_convergence() {
    let settings = MdmmSettings {
        max_steps: 3,
        ..MdmmSettings::default()
    };
    let outcome = Mdmm::new(settings)
        .unwrap()
        .minimize(&[4.0], squared_distance(&[2.0]))
        .unwrap();
    assert_eq!((outcome.status, outcome.steps), (Status::StepLimit, 3));

    let diverging = MdmmSettings {
        rate: Schedule::constant(10.0).unwrap(),
        ..MdmmSettings::default()
    };
    let outcome = Mdmm::new(diverging)
        .unwrap()
        .minimize(&[4.0], squared_distance(&[2.0]))
        .unwrap();
    assert_eq!(outcome.status, Status::NotFinite);

    let outcome = solver()
        .subject_to(
            Constraint::less_than(1.0),
            |_: &[f64], gradient: &mut [f64]| {
                gradient.fill(0.0);
                f64::NAN
            },
        )
        .unwrap()
        .minimize(&[4.0], squared_distance(&[2.0]))
        .unwrap();
    assert_eq!((outcome.status, outcome.steps), (Status::NotFinite, 0));
    assert_eq!(outcome.x, [4.0]);
}

#[test]
fn bad_arguments_are_named() {
    let message = |error: OptimizationError| error.to_string();
    let constrain = |constraint: Constraint| {
        let result = solver().subject_to(constraint, linear(&[1.0]));
        message(result.err().unwrap())
    };
    assert!(constrain(Constraint::less_than(f64::NAN)).contains("limit"));
    assert!(constrain(Constraint::equal_to(f64::INFINITY)).contains("target"));
    assert!(constrain(Constraint::less_than(1.0).with_damping(-1.0)).contains("damping"));

    let start = |start: &[f64]| {
        let result = solver().minimize(start, linear(&[1.0]));
        message(result.err().unwrap())
    };
    assert!(start(&[]).contains("start is empty"));
    assert!(start(&[f64::NAN]).contains("start"));

    let settings = MdmmSettings {
        multiplier_rate_ratio: 0.0,
        ..MdmmSettings::default()
    };
    assert!(message(Mdmm::new(settings).err().unwrap()).contains("multiplier_rate_ratio"));
}

/// Solves a dense linear system by elimination with partial pivoting.
fn solve(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();
    for column in 0..n {
        let pivot = (column..n)
            .max_by(|&a, &b| matrix[a][column].abs().total_cmp(&matrix[b][column].abs()))
            .unwrap();
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        for row in column + 1..n {
            let factor = matrix[row][column] / matrix[column][column];
            for k in column..n {
                matrix[row][k] -= factor * matrix[column][k];
            }
            right[row] -= factor * right[column];
        }
    }
    for row in (0..n).rev() {
        for k in row + 1..n {
            right[row] -= matrix[row][k] * right[k];
        }
        right[row] /= matrix[row][row];
    }
    right
}

/// Minimise x.Qx/2 - b.x with Q = F^T F + I, on a hyperplane a.x = d.
#[derive(Clone, Debug)]
struct QuadraticProgramme {
    hessian: Vec<Vec<f64>>,
    linear: Vec<f64>,
    normal: Vec<f64>,
    offset: f64,
}

fn quadratic_programme() -> impl Strategy<Value = QuadraticProgramme> {
    (2..=4_usize).prop_flat_map(|n| {
        let vector = || prop::collection::vec(-1.0..1.0_f64, n);
        let normal = vector().prop_filter("a hyperplane", |a| {
            a.iter().map(|a| a * a).sum::<f64>() > 0.25
        });
        let factor = prop::collection::vec(vector(), n);
        (factor, vector(), normal, -1.0..1.0_f64).prop_map(
            move |(factor, linear, normal, offset)| {
                let mut hessian = vec![vec![0.0; n]; n];
                for i in 0..n {
                    for j in 0..n {
                        hessian[i][j] = factor.iter().map(|row| row[i] * row[j]).sum();
                    }
                    hessian[i][i] += 1.0;
                }
                QuadraticProgramme {
                    hessian,
                    linear,
                    normal,
                    offset,
                }
            },
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The conditions Q x + lambda a = b, a.x = d are linear.
    #[test]
    fn random_quadratic_programmes(programme in quadratic_programme()) {
        let QuadraticProgramme { hessian, linear: b, normal, offset } = programme;
        let n = b.len();
        let mut matrix = hessian.clone();
        for i in 0..n {
            matrix[i].push(normal[i]);
        }
        matrix.push(normal.iter().copied().chain([0.0]).collect());
        let expected = solve(matrix, b.iter().copied().chain([offset]).collect());

        let settings = MdmmSettings { max_steps: 400_000, ..MdmmSettings::default() };
        let outcome = Mdmm::new(settings).unwrap()
            .subject_to(Constraint::equal_to(offset), linear(&normal)).unwrap()
            .minimize(&vec![0.0; n], |x: &[f64], gradient: &mut [f64]| {
                let mut value = 0.0;
                for i in 0..n {
                    let product: f64 = hessian[i].iter().zip(x).map(|(q, x)| q * x).sum();
                    gradient[i] = product - b[i];
                    value += x[i] * (0.5 * product - b[i]);
                }
                value
            }).unwrap();
        prop_assert_eq!(outcome.status, Status::Converged);
        for i in 0..n {
            prop_assert!((outcome.x[i] - expected[i]).abs() < CLOSE);
        }
        // The multiplier is determined through |a| >= 1/2 and |Q| <= 17.
        prop_assert!((outcome.multipliers[0] - expected[n]).abs() < CLOSE);
    }

    /// `weight` is the derivative of `term` by the value, and `ascend` follows its derivative by the multiplier.
    #[test]
    fn weight_and_ascent_are_the_derivatives_of_the_term(
        form in prop::sample::select(vec![InequalityForm::Slack, InequalityForm::Max]),
        is_equality in any::<bool>(),
        damping in prop::sample::select(vec![0.0, 0.5, 1.0, 3.0]),
        rise in 0.0..2.0_f64,
        earlier in -3.0..3.0_f64,
        value in -3.0..3.0_f64,
    ) {
        let bound = if is_equality { Constraint::equal_to(0.5) } else { Constraint::less_than(0.5) };
        let mut constraint = bound.with_form(form).with_damping(damping);
        // A first step gives it a multiplier (0 in one in two cases of inequalities).
        constraint.ascend(rise, earlier);
        let step = 1e-6;
        let is_near_kink = [0.5, 0.5 - constraint.multiplier() / damping]
            .iter()
            .any(|kink| (value - kink).abs() < 2.0 * step);
        prop_assume!(!is_near_kink);

        let slope = (constraint.term(value + step) - constraint.term(value - step)) / (2.0 * step);
        prop_assert!((constraint.weight(value) - slope).abs() < 1e-6, "{} {slope}", constraint.weight(value));

        let (before, multiplier, rate) = (constraint.term(value), constraint.multiplier(), 1e-6);
        let g = constraint.infeasibility(value);
        constraint.ascend(rate, value);
        let change = constraint.multiplier() - multiplier;
        let is_clamped = !is_equality && multiplier + rate * g < 0.0;
        let expected = if is_clamped { -multiplier } else { rate * g };
        prop_assert!((change - expected).abs() < 1e-12);
        let growth = constraint.term(value) - before;
        // Second order in a change of at most 5e-5.
        prop_assert!((growth - g * change).abs() < 5e-8, "{growth} {}", g * change);
    }
}
