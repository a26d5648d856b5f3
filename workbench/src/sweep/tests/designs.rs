//! The values of runs.

use std::collections::BTreeSet;

use super::super::plan::{Distribution, Quantity, Sampler, Target, Task, Varied};
use super::*;

/// A plan that draws so many quantities between 0 and 1.
fn plan(sampler: Sampler, quantities: &[&str], samples: u64, seed: u64) -> Plan {
    let varied = |name: &&str| Varied {
        quantity: Quantity {
            name: (*name).to_owned(),
            target: Target::Parameter(0),
            value: 1.0,
            dimension: None,
            has_effect: true,
        },
        distribution: Distribution::Uniform([0.0, 1.0]),
    };
    let task = Task::Equilibrium { end: true, energy: false, frequencies: false };
    let varied = quantities.iter().map(varied).collect();
    Plan { task, axes: Vec::new(), varied, sampler, samples, seed }
}

fn values(plan: &Plan) -> Vec<Vec<f64>> {
    let design = Design::new(plan);
    (0..plan.runs()).map(|run| design.values(run)).collect()
}

/// Numbers of the parts, of so many equal ones, in which the values of a dimension lie.
fn parts(values: &[Vec<f64>], dimension: usize, parts: usize) -> BTreeSet<usize> {
    values.iter().map(|value| (value[dimension] * parts as f64) as usize).collect()
}

#[test]
fn a_latin_hypercube_has_one_value_in_each_part() {
    let values = values(&plan(Sampler::LatinHypercube, &["a", "b", "c"], 1000, 3));
    for dimension in 0..3 {
        assert_eq!(parts(&values, dimension, 1000).len(), 1000);
    }
    // Independent quantities: the correlation of 1000 pairs is about 1/sqrt(1000).
    let correlation =
        values.iter().map(|it| (it[0] - 0.5) * (it[1] - 0.5) * 12.0).sum::<f64>() / 1e3;
    assert!(correlation.abs() < 0.15, "{correlation}");
}

#[test]
fn sobols_points_are_even_in_every_dimension_and_in_the_first_two_together() {
    let names: Vec<String> = (0..40).map(|index| format!("p{index}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let values = values(&plan(Sampler::Sobol, &names, 1024, 5));
    for dimension in 0..names.len() {
        assert_eq!(parts(&values, dimension, 1024).len(), 1024, "dimension {dimension}");
    }
    // The first two dimensions are a (0, 10, 2)-net: each box of area 2^-10 has one point.
    for wide in 0..=10 {
        let boxes: BTreeSet<_> = values
            .iter()
            .map(|it| {
                (
                    (it[0] * f64::from(1 << wide)) as u32,
                    (it[1] * f64::from(1 << (10 - wide))) as u32,
                )
            })
            .collect();
        assert_eq!(boxes.len(), 1024, "boxes of width 2^-{wide}");
    }
}

/// Without the shift, they are those that Joe and Kuo print on their page (`sobol.cc`, `new-joe-kuo-6.21201`).
#[test]
fn sobols_points_are_those_of_joe_and_kuo() {
    let published = [
        [0.0, 0.0, 0.0],
        [0.5, 0.5, 0.5],
        [0.75, 0.25, 0.25],
        [0.25, 0.75, 0.75],
        [0.375, 0.375, 0.625],
        [0.875, 0.875, 0.125],
        [0.625, 0.125, 0.875],
        [0.125, 0.625, 0.375],
        [0.1875, 0.3125, 0.9375],
        [0.6875, 0.8125, 0.4375],
    ];
    let found = values(&plan(Sampler::Sobol, &["a", "b", "c"], 10, 0));
    // The first point shows the shift.
    let bits = |value: f64| (value * (1_u64 << 52) as f64) as u64;
    for (point, published) in found.iter().zip(published) {
        for dimension in 0..3 {
            let unshifted = bits(point[dimension]) ^ bits(found[0][dimension]);
            assert_eq!(unshifted, bits(published[dimension]), "{point:?}");
        }
    }
}

#[test]
fn a_quantity_has_the_same_samples_beside_others_and_other_ones_with_another_seed() {
    for sampler in [Sampler::Random, Sampler::LatinHypercube] {
        let first = |names, seed| -> Vec<u64> {
            values(&plan(sampler, names, 50, seed)).iter().map(|it| it[0].to_bits()).collect()
        };
        assert_eq!(first(&["k", "b"], 7), first(&["k", "motor", "b"], 7));
        assert_ne!(first(&["k"], 7), first(&["k"], 8));
        assert_ne!(first(&["k"], 7), first(&["b"], 7));
    }
}

#[test]
fn the_last_axis_of_a_grid_changes_fastest_and_each_point_has_all_samples() {
    let text = "
        grid: { k: [1e-3, 2e-3], initial.hinge: { from: 0.1, to: 0.3, count: 3 } }
        vary: { b: { uniform: [1e-6, 5e-6] } }
        samples: { count: 4 }";
    let (compiled, system) = compiled(ROD);
    let quantities = Quantities::of(&compiled, &system, &[]);
    let values = values(&Plan::read(&file(text), &quantities, AngleUnit::default()).unwrap());
    assert_eq!(values.len(), 2 * 3 * 4);
    let mut expected = Vec::new();
    for k in [1e-3, 2e-3] {
        for q in [0.1, 0.2, 0.3] {
            expected.extend((0..4).map(|sample| (k, q, sample)));
        }
    }
    for (value, (k, q, sample)) in values.iter().zip(expected) {
        assert_eq!(value[0], k);
        assert!((value[1] - q).abs() < 1e-15, "{value:?}");
        assert_eq!(value[2].to_bits(), values[sample][2].to_bits());
        assert!((1e-6..5e-6).contains(&value[2]), "{value:?}");
    }
}

#[test]
fn distributions_have_the_quantiles_of_tables() {
    let normal = Distribution::Normal([10.0, 2.0]);
    // Abramowitz and Stegun, table 26.5.
    for (share, deviations) in [
        (0.5, 0.0),
        (0.975, 1.959_963_984_540),
        (0.05, -1.644_853_626_951),
        (1e-9, -5.997_807_015_008),
    ] {
        let found = (normal.at(share) - 10.0) / 2.0;
        assert!((found - deviations).abs() < 1e-11, "{share}: {found}");
    }
    let uniform = Distribution::Uniform([-1.0, 3.0]);
    assert_eq!([0.0, 0.25, 1.0].map(|share| uniform.at(share)), [-1.0, 0.0, 3.0]);
    let decades = Distribution::LogUniform([-1e-3, -10.0]);
    assert!((decades.at(0.5) + 0.1).abs() < 1e-15, "{}", decades.at(0.5));
}
