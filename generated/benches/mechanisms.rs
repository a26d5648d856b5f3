//! What one call costs through the compiled modules: `cargo bench -p lamc-generated`.
//!
//! Ratios within one run mean more than times: everything is printed beside the acceleration of
//! the same mechanism.

mod cost;

use cost::mechanism;
use criterion::{Criterion, criterion_group, criterion_main};
use lamc_generated::{
    fourbar::Fourbar, pendulum::Pendulum, sixbar::Sixbar, triple_pendulum::TriplePendulum,
};

fn all(criterion: &mut Criterion) {
    mechanism::<Pendulum<f64>, 1>("pendulum", criterion);
    mechanism::<TriplePendulum<f64>, 3>("triple pendulum", criterion);
    mechanism::<Fourbar<f64>, 4>("four-bar", criterion);
    mechanism::<Sixbar<f64>, 6>("six-bar", criterion);
}

criterion_group!(benches, all);
criterion_main!(benches);
