//! What the algorithms cost on one mechanism, by criterion.

#[path = "../../../tests/src/uniform.rs"]
#[allow(dead_code, reason = "a benchmark uses its part")]
mod uniform;

use std::hint::black_box;
use std::time::Instant;

use criterion::{BatchSize, Criterion};
use lamc_runtime::plumbing::jacobian;
use lamc_runtime::{Integrator, Mechanism, Rk4, Rodas, assemble, equilibrium, project};
use uniform::Random;

/// More hinges take tenths of a second for some algorithms, and seconds for the equilibrium.
const LARGE: usize = 24;

/// Every algorithm on a mechanism.
pub fn mechanism<M, const N: usize>(name: &str, criterion: &mut Criterion)
where
    M: Mechanism<Scalar = f64, Coordinates = [f64; N], Speeds = [f64; N]> + Default,
{
    let model = M::default();
    let mut numbers = Random::new(2026);
    let mut state = model.assembled().expect("the example closes");
    for (u, _) in state.u.iter_mut().zip(0..N) {
        *u = numbers.range(-1.0, 1.0);
    }
    let mut workspace = model.workspace();
    project(&model, 0.0, &mut state.q, &mut state.u, workspace.as_mut()).expect("it projects");

    let mut group = criterion.benchmark_group(name);
    if N > LARGE {
        group.sample_size(10);
    }
    group.bench_function("acceleration", |b| {
        b.iter(|| model.acceleration(0.0, black_box(&state.q), black_box(&state.u)));
    });
    group.bench_function("jacobian", |b| {
        b.iter(|| jacobian::<M, N>(&model, 0.0, black_box(&state.q), black_box(&state.u)));
    });
    let mut rk4 = Rk4::new(&model);
    group.bench_function("rk4 step with projection", |b| {
        b.iter_batched_ref(|| state, |state| rk4.step(&model, state, 1e-4), BatchSize::SmallInput);
    });
    let mut rodas = Rodas::new(&model);
    group.bench_function("rodas step", |b| {
        b.iter_batched_ref(
            || state,
            |state| rodas.step(&model, state, 1e-4),
            BatchSize::SmallInput,
        );
    });
    if N <= LARGE {
        group.bench_function("equilibrium", |b| {
            b.iter_batched_ref(
                || state.q,
                |q| equilibrium(&model, 0.0, q, workspace.as_mut()),
                BatchSize::SmallInput,
            );
        });
    }
    if model.dimensions().rows == 0 {
        // Nothing has to be assembled.
        return group.finish();
    }
    let mut guesses = Random::new(1);
    group.bench_function("assembly from a rough guess", |b| {
        b.iter_batched_ref(
            || std::array::from_fn::<f64, N, _>(|_| 0.5 * guesses.normal()),
            |q| assemble(&model, 0.0, q, &[false; N], workspace.as_mut()),
            BatchSize::SmallInput,
        );
    });
    group.finish();

    // Criterion reports means; guesses differ, and what matters of them is the median.
    let mut times: Vec<f64> = (0..1000)
        .map(|_| {
            let mut q: [f64; N] = std::array::from_fn(|_| 0.5 * guesses.normal());
            let begin = Instant::now();
            let _ = black_box(assemble(&model, 0.0, &mut q, &[false; N], workspace.as_mut()));
            begin.elapsed().as_secs_f64() * 1e6
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!(
        "{name}: assembly of 1000 guesses: median {:.2} us, 95% {:.2} us",
        times[500], times[950]
    );
}
