//! Plans as they are read.

use super::super::plan::{Distribution, Simulate, Target, Task};
use lamc::source::SourceModel;

use super::*;
use crate::simulation::Method;

fn read(text: &str) -> Result<Plan, Diagnostics> {
    let (compiled, system) = compiled(ROD);
    Plan::read(&file(text), &Quantities::of(&compiled, &system, &[]), AngleUnit::default())
}

#[test]
fn a_plan_has_units_tolerances_and_defaults() {
    let plan = read(
        "
        grid: { input.motor: [0, 0.5mN*m] }
        vary:
          k: { normal: 5% }
          b: { uniform: 1e-6 }
          initial.hinge: { uniform: [10deg, 20deg] }
        samples: { count: 1_000, method: sobol }
        duration: 500 ms",
    );
    let plan = plan.unwrap_or_else(|found| panic!("{found}"));
    assert_eq!(plan.axes[0].values, [0.0, 0.5e-3]);
    assert_eq!(plan.runs(), 2000);
    let normal = Distribution::Normal([1e-3, 0.05 * 1e-3]);
    assert_eq!(plan.varied[0].distribution, normal);
    assert_eq!(plan.varied[1].distribution, Distribution::Uniform([4e-6 - 1e-6, 4e-6 + 1e-6]));
    assert_eq!(plan.varied[2].quantity.target, Target::Initial(0));
    assert_eq!(plan.varied[2].quantity.value, 0.4);
    let Task::Simulate(Simulate { settings, rate, settling_band, end, energy, motion, .. }) =
        plan.task
    else {
        panic!("{:?}", plan.task)
    };
    assert_eq!((settings.duration, settings.tolerance, rate), (0.5, 1e-8, 100.0));
    assert_eq!((settings.method, settling_band, plan.seed), (Method::Auto, 0.02, 0));
    assert!(end && energy && !motion);
}

#[test]
fn whole_numbers_are_written_in_every_way() {
    for (text, count) in [("1e4", 10_000), ("10.0", 10), ("1_000", 1000), ("7", 7)] {
        let plan =
            read(&format!("{{ vary: {{ k: {{ normal: 5% }} }}, samples: {{ count: {text} }} }}"));
        assert_eq!(plan.map(|plan| plan.samples).ok(), Some(count), "{text}");
    }
    for text in ["1.5", "-1", "1e300", "nan", "ten"] {
        let plan =
            read(&format!("{{ vary: {{ k: {{ normal: 5% }} }}, samples: {{ count: {text} }} }}"));
        assert!(plan.is_err(), "{text}");
    }
}

#[test]
fn an_input_that_a_formula_replaced_cannot_vary() {
    let prescribe = |model: &mut SourceModel| model.prescribe("motor", "1e-4*sin(20*t)");
    let text = file(ROD);
    let model = pipeline::read(&text, prescribe).unwrap();
    let derived = model.derive(|_, _| ()).unwrap();
    let compiled = model.compiled(derived);
    let quantities = Quantities::of(&compiled, &Jit::new(&compiled.program), &[]);
    let plan = |text| Plan::read(&file(text), &quantities, AngleUnit::default());
    let found = plan("{ grid: { input.motor: [0, 1e-4] } }").unwrap_err();
    assert!(
        found.0[0].message.contains("nothing in the model depends on `input.motor`"),
        "{found}"
    );
    assert!(plan("{ grid: { k: [1e-3] } }").is_ok());
}

#[test]
fn an_empty_plan_is_told_what_a_plan_needs() {
    let found = read("").unwrap_err();
    assert_eq!(found.0[0].hint.as_deref(), Some("give a `grid`, or `vary` and `samples`"));
}

#[test]
fn each_distribution_is_about_the_value_that_the_model_has_now() {
    let (compiled, mut system) = compiled(ROD);
    system.set_parameter("k", 0.01).unwrap();
    let quantities = Quantities::of(&compiled, &system, &[(0, -0.2)]);
    let text =
        "{ vary: { k: { uniform: 10% }, initial.hinge: { normal: 10% } }, samples: { count: 2 } }";
    let plan = Plan::read(&file(text), &quantities, AngleUnit::default())
        .unwrap_or_else(|found| panic!("{found}"));
    assert_eq!(plan.varied[0].distribution, Distribution::Uniform([0.01 - 1e-3, 0.01 + 1e-3]));
    assert_eq!(plan.varied[1].distribution, Distribution::Normal([-0.2, 0.2 * 0.1]));
}

/// Each key with its example.
#[test]
fn the_examples_of_the_reference_are_plans() {
    let model = ROD.replace("hinge", "j0").replace("k: 1 mN*m/rad", "k: 1e-3");
    let (compiled, system) = compiled(&model);
    let quantities = Quantities::of(&compiled, &system, &[]);
    let rest = "vary: { b: { normal: 1e-7 } }\nsamples: { count: 2 }\n";
    for mapping in plan::MAPPINGS {
        for key in mapping.keys {
            let entry = format!("{}: {}", key.name, key.example);
            let text = match (mapping.name, key.name) {
                ("plan", "vary") => format!("{entry}\nsamples: {{ count: 2 }}"),
                ("plan", "samples") => format!("{entry}\nvary: {{ b: {{ normal: 1e-7 }} }}"),
                ("plan", _) => format!("{entry}\n{rest}"),
                ("axis", "spacing") => {
                    format!("grid: {{ k: {{ from: 1, to: 2, count: 3, {entry} }} }}")
                }
                ("axis", _) => "grid: { initial.j0: { from: 10deg, to: 60deg, count: 6 } }".into(),
                ("distribution", _) => {
                    format!("vary: {{ k: {{ {entry} }} }}\nsamples: {{ count: 2 }}")
                }
                ("samples", "count") => {
                    format!("samples: {{ {entry} }}\nvary: {{ k: {{ normal: 1% }} }}")
                }
                ("samples", _) => {
                    format!("samples: {{ count: 4, {entry} }}\nvary: {{ k: {{ normal: 1% }} }}")
                }
                other => panic!("no example of {other:?}"),
            };
            let read = Plan::read(&file(&text), &quantities, AngleUnit::default());
            assert!(read.is_ok(), "{text}\n{}", read.unwrap_err());
        }
    }
}

#[test]
fn shards_divide_all_runs() {
    for (all, of) in [(10_u64, 3_u64), (7, 100), (100_000_000, 999)] {
        let mut next = 0;
        for index in 1..=of {
            let runs = Shard { index, of }.runs(all);
            assert_eq!(runs.start, next);
            assert!(runs.end - runs.start <= all.div_ceil(of));
            next = runs.end;
        }
        assert_eq!(next, all);
    }
    assert_eq!(Shard::read("3/100"), Some(Shard { index: 3, of: 100 }));
    for wrong in ["0/3", "4/3", "3", "a/b", "1/0", "-1/2", ""] {
        assert_eq!(Shard::read(wrong), None, "{wrong}");
    }
}
