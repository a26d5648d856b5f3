//! Runs the motion on an emulated board and reports, as JSON through semihosting, the final
//! state and what was measured.

#![no_std]
#![no_main]

use core::arch::{asm, global_asm};
use core::panic::PanicInfo;
use core::ptr;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{Peripherals, SYST};
use cortex_m::singleton;
use cortex_m_semihosting::{debug, hprint, hprintln};
use lamc_embedded_firmware::Work;
use lamc_embedded_motion::Task as _;

/// SysTick counts down from here.
const RELOAD: u32 = 0x00ff_ffff;

/// Steps whose stack is measured.
const STACK_STEPS: u32 = 100;

/// The pattern that unused stack is painted with.
const PAINT: u32 = 0xc5c5_c5c5;

// A loop of two instructions per turn.
global_asm!(".thumb_func", ".global spin", "spin:", "1: subs r0, r0, #1", "bne 1b", "bx lr",);

unsafe extern "C" {
    /// End of the static data: the lowest address the stack may grow to.
    static mut __sheap: u32;

    fn spin(turns: u32);
}

#[cortex_m_rt::entry]
fn main() -> ! {
    debug::exit(match report() {
        Ok(()) => debug::EXIT_SUCCESS,
        Err(reason) => {
            hprintln!("{}", reason);
            debug::EXIT_FAILURE
        }
    });
    loop {
        cortex_m::asm::wfi();
    }
}

fn report() -> Result<(), &'static str> {
    let mut systick = Peripherals::take().ok_or("the peripherals are taken")?.SYST;
    systick.set_clock_source(SystClkSource::Core);
    systick.set_reload(RELOAD);
    systick.clear_current();
    systick.enable_counter();

    // SAFETY: `spin` touches nothing but its argument's register.
    let [short, long] = [10_000, 20_000].map(|n| ticks(&mut systick, || unsafe { spin(n) }).1);

    let motion = singleton!(: Option<Work> = None).ok_or("the motion is taken")?;
    let (assembled, assembly_stack) = depth(Work::assembled);
    let motion = motion.insert(assembled.map_err(|_| "the robot was not assembled")?);

    let (mut stack, mut sum, mut most) = (0, 0, 0);
    for _ in 0..Work::STEPS {
        let (done, taken) = ticks(&mut systick, || motion.step());
        done.map_err(|_| "a step failed")?;
        sum += u64::from(taken);
        most = most.max(taken);
    }
    hprint!("{}\"coordinates\": [", '{');
    for (i, value) in motion.coordinates().enumerate() {
        let separator = if i == 0 { "" } else { ", " };
        hprint!("{}\"{:016x}\"", separator, f64::from(value).to_bits());
    }
    hprint!("], \"ticks\": {{\"spin_10000\": {}, \"spin_20000\": {}", short, long);
    hprint!(", \"steps\": {}, \"longest_step\": {}}}", sum, most);
    // Continues the motion to measure the stack of a step: painting takes longer than the step.
    for _ in 0..STACK_STEPS {
        let (done, used) = depth(|| motion.step());
        done.map_err(|_| "a step failed")?;
        stack = stack.max(used);
    }
    hprintln!(", \"stack\": {{\"assembly\": {}, \"step\": {}}}}}", assembly_stack, stack);
    Ok(())
}

/// The result of a call and its ticks.
#[inline(never)]
fn ticks<T>(_: &mut SYST, call: impl FnOnce() -> T) -> (T, u32) {
    let before = SYST::get_current();
    let result = call();
    let after = SYST::get_current();
    (result, before.wrapping_sub(after) & RELOAD)
}

/// The result of a call and its bytes of stack.
#[inline(never)]
fn depth<T>(call: impl FnOnce() -> T) -> (T, usize) {
    let bottom = &raw mut __sheap;
    let top: *mut u32;
    // SAFETY: reads the stack pointer.
    unsafe { asm!("mov {}, sp", out(reg) top, options(nomem, nostack, preserves_flags)) };
    let words = (top as usize - bottom as usize) / size_of::<u32>();
    // SAFETY: between the static data and the stack pointer nothing is in use; no interrupt is on.
    (0..words).for_each(|i| unsafe { ptr::write_volatile(bottom.add(i), PAINT) });
    let result = call();
    // SAFETY: as above.
    let unused = (0..words).take_while(|&i| unsafe { ptr::read_volatile(bottom.add(i)) } == PAINT);
    (result, (words - unused.count()) * size_of::<u32>())
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    hprintln!("{}", info);
    debug::exit(debug::EXIT_FAILURE);
    loop {}
}
