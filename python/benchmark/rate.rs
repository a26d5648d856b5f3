//! Accelerations per second from Rust, of a model that `lamc derive` wrote: `rate MODEL.lamc COUNT`. The comparison for
//! `rate.py`, which calls the same machine code from Python.

use std::error::Error;
use std::time::Instant;

use lamc::pipeline::Compiled;
use lamc_runtime::{Mechanism, acceleration, assemble, project};
use lamc_workbench::execution::Jit;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("MODEL.lamc is missing")?;
    let count: usize = arguments.next().ok_or("COUNT is missing")?.parse()?;
    let system = Jit::new(&Compiled::from_bytes(&std::fs::read(path)?)?.program);
    let (mut state, mut room) = (system.initial(), system.workspace());
    let n = state.q.len();
    let pinned: Vec<bool> = (0..n).map(|joint| system.is_pinned(joint)).collect();
    assemble(&system, 0.0, &mut state.q, &pinned, &mut room)?;
    project(&system, 0.0, &mut state.q, &mut state.u, &mut room)?;
    // As Python hands them over and gets them back: rows in memory.
    let q: Vec<f64> = (0..count).flat_map(|_| state.q.iter().copied()).collect();
    let u = vec![0.0; count * n];
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let mut rates = vec![0.0; count * n];
        let begin = Instant::now();
        for row in 0..count {
            let at = row * n..(row + 1) * n;
            acceleration(&system, 0.0, &q[at.clone()], &u[at.clone()], &mut room, &mut rates[at])?;
        }
        best = best.min(begin.elapsed().as_secs_f64());
    }
    println!("{:.1}", best / count as f64 * 1e9);
    Ok(())
}
