//! The firmware's model on a workstation: half a second of the gait.

use firmware_leg::{Model, STEP};

fn main() -> Result<(), lamc_runtime::Error> {
    let mut model = Model::new()?;
    for tick in 1..=500 {
        let phase = 4.0 * std::f32::consts::PI * tick as f32 * STEP;
        let toe = model.advance(0.8 + 0.35 * phase.sin(), 0.8 + 0.35 * phase.cos(), 0.05)?;
        if tick % 100 == 0 {
            println!("{:.1} s: toe at {:6.2} {:6.2} mm", tick as f32 * STEP, toe[0] * 1e3, toe[2] * 1e3);
        }
    }
    Ok(())
}
