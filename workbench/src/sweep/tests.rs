//! Sweeps: which values runs have, what is recorded of them, and that the file does not depend on who computed it.

mod designs;
mod plans;
mod records;
mod stores;

use std::sync::Arc;

use lamc::pipeline;
use lamc::source::SourceFile;

use super::*;

/// A rod on a hinge without gravity: I q'' + b q' + k q = torque, with I = Izz + m r^2.
const ROD: &str = "
bodies:
  base: { fixed: true }
  rod: { mass: 2 g, com: [0, -0.02, 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
gravity: [0, 0, 0]
parameters: { k: 1 mN*m/rad, b: 4e-6 }
inputs: [motor]
joints:
  hinge: { bodies: [base, rod], axis: [[0, 0], [1, 0]], stiffness: k, damping: b, torque: motor, limits: [-100 deg, 100 deg] }
initial: { q: { hinge: 0.4 } }
points: { tip: { body: rod, at: [0, -0.03, 0] } }
";
/// I of [`ROD`], kg m^2.
const INERTIA: f64 = 3e-7 + 2e-3 * 0.02 * 0.02;

/// A four-bar, for which each run closes a loop.
const FOURBAR: &str = include_str!("../../../examples/fourbar.yaml");

fn file(text: &str) -> SourceFile {
    SourceFile { path: "plan.yaml".to_owned(), text: text.to_owned() }
}

fn compiled(model: &str) -> (Arc<Compiled>, Jit) {
    let compiled = pipeline::compile(&file(model)).unwrap();
    let system = Jit::new(&compiled.program);
    (Arc::new(compiled), system)
}

fn sweep((compiled, system): &(Arc<Compiled>, Jit), plan: &str, shard: Shard) -> Sweep {
    let sweep =
        Sweep::new(compiled.clone(), system, Vec::new(), &file(plan), AngleUnit::default(), shard);
    sweep.unwrap_or_else(|problems| panic!("{}", problems.render(&file(plan), false)))
}
