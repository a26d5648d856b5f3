//! Firmware that contains nothing but the motion: its flash is that of model, runtime and start-up code.

#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;
use cortex_m::singleton;
use lamc_embedded_firmware::Work;
use lamc_embedded_motion::Task as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    if let Ok(assembled) = Work::assembled()
        && let Some(motion) = singleton!(: Option<Work> = None)
    {
        let motion = motion.insert(assembled);
        while motion.step().is_ok() {
            motion.coordinates().for_each(|number| _ = black_box(number));
        }
    }
    halt()
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    halt()
}

fn halt() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}
