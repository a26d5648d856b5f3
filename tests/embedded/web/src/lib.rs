//! The motion for WebAssembly: `motion_f32` and `motion_f64` write the final state into the memory of the
//! module and return its address, or 0.

#![no_std]

use core::panic::PanicInfo;
use core::ptr;
use core::sync::atomic::{AtomicU64, Ordering};

use lamc_embedded_motion::{Motion, Robot, Task as _};
use lamc_generated::sixbar::Sixbar;
use lamc_runtime::Scalar;

/// Coordinates: q (rad), then u (rad/s), as bits of `f64`.
static COORDINATES: [AtomicU64; 12] = [const { AtomicU64::new(0) }; 12];

/// In `f32`.
#[unsafe(no_mangle)]
pub extern "C" fn motion_f32() -> *const AtomicU64 {
    run::<Sixbar<f32>>()
}

/// In `f64`.
#[unsafe(no_mangle)]
pub extern "C" fn motion_f64() -> *const AtomicU64 {
    run::<Sixbar<f64>>()
}

fn run<M: Robot>() -> *const AtomicU64 {
    let Ok(mut motion) = Motion::<M>::assembled() else { return ptr::null() };
    for _ in 0..M::STEPS {
        if motion.step().is_err() {
            return ptr::null();
        }
    }
    for (place, value) in COORDINATES.iter().zip(motion.coordinates()) {
        place.store(value.to_f64().to_bits(), Ordering::Relaxed);
    }
    COORDINATES.as_ptr()
}

#[cfg(target_family = "wasm")]
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    core::arch::wasm32::unreachable()
}
