//! The time of one call: open chains of any length, and the examples without a module in `generated`.
//! `bash tests/peers/bench` writes the modules and runs this.

#[path = "../../generated/benches/cost/mod.rs"]
mod cost;

use cost::mechanism;
use criterion::{Criterion, criterion_group, criterion_main};

macro_rules! modules {
    ($($module:ident $model:ident $path:literal),+ $(,)?) => {
        $(
            #[allow(dead_code, reason = "not all of a module is measured")]
            #[path = $path]
            mod $module;
        )+
        fn all(criterion: &mut Criterion) {
            $(mechanism::<$module::$model, { $module::NQ }>(
                stringify!($module),
                criterion,
            );)+
        }
    };
}

modules! {
    chain1 Chain1 "../../target/peers/bench/chain1.rs",
    chain2 Chain2 "../../target/peers/bench/chain2.rs",
    chain3 Chain3 "../../target/peers/bench/chain3.rs",
    chain6 Chain6 "../../target/peers/bench/chain6.rs",
    chain12 Chain12 "../../target/peers/bench/chain12.rs",
    chain24 Chain24 "../../target/peers/bench/chain24.rs",
    chain48 Chain48 "../../target/peers/bench/chain48.rs",
    chain96 Chain96 "../../target/peers/bench/chain96.rs",
    miura Miura "../../target/peers/bench/miura.rs",
    sixbar_markers SixbarMarkers "../../target/peers/bench/sixbar_markers.rs",
}

criterion_group!(benches, all);
criterion_main!(benches);
