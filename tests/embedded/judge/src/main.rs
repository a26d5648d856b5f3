//! Compares the reports of targets with the results of this machine, and checks the limits of firmware.
//!
//! Each argument is a row of the table that is printed: `NAME;MOTION;REPORT;ELF`, where ELF may be
//! left out. A name that ends in `!` is held to the limits. MOTION is `sixbar-f32`, `sixbar-f64`, `jumper-f32` or
//! `estimate-f32`, and may
//! be followed by `=` and the report of a reference, to compare with instead of Rust on this machine.
//! `docs/EMBEDDED.md` must have about the same numbers.

#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "`!(a <= b)` is how NaN is meant to fail")]

mod page;

use std::error::Error;
use std::process::ExitCode;
use std::{env, fs};

use lamc_embedded_motion::{Estimation, Motion, Robot, Task};
use lamc_generated::{jumper::Jumper, sixbar::Sixbar};
use lamc_runtime::{Arithmetic, Scalar};
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, elf};
use serde::Deserialize;

/// Instructions of a step, at most.
const INSTRUCTIONS: f64 = 15_000.0;
/// Bytes of flash, at most.
const FLASH: u64 = 44 * 1024;
/// Bytes of stack, at most.
const STACK: u64 = 4 * 1024;

/// How far motions in `f32` are from those in `f64` after their second, measured on this machine. The six-bar in C from the
/// same initial state: 8.6e-5 rad or rad/s.
const SIXBAR_IN_SINGLE: f64 = 8.6e-5;
/// The jumper: 3.4e-4 m, by which it comes to rest elsewhere, as each impact of its landing multiplies small differences.
const JUMPER_IN_SINGLE: f64 = 3.4e-4;

/// How near the estimate of a stiffness has to come, as a share of it.
const NEAR: f32 = 1e-3;

/// What a row is compared with.
struct Expected {
    coordinates: Vec<f64>,
    /// The largest difference that is allowed.
    allowed: f64,
    steps: u32,
}

impl Expected {
    /// The motion in Rust on this machine.
    fn new<M: Robot>(allowed: f64) -> Result<Self, Box<dyn Error>> {
        let mut motion = Motion::<M>::assembled().map_err(|error| format!("{error:?}"))?;
        let mut contacts = vec![M::Scalar::ZERO; 6 * motion.contacts()];
        let mut pushed = 0;
        for _ in 0..M::STEPS {
            motion.step().map_err(|error| format!("{error:?}"))?;
            motion.write_contacts(&mut contacts).map_err(|error| format!("{error:?}"))?;
            // Of six numbers per point, the last is the upward force.
            pushed += u32::from(contacts.chunks(6).any(|point| point[5] > M::Scalar::ZERO));
        }
        // A robot with contacts has to leave the ground and to return to it.
        if motion.contacts() > 0 && (pushed < M::STEPS / 10 || pushed > M::STEPS * 9 / 10) {
            return Err(format!("the ground pushes in {pushed} of {} steps", M::STEPS).into());
        }
        let coordinates = motion.coordinates().map(M::Scalar::to_f64).collect();
        Ok(Self { coordinates, allowed, steps: M::STEPS })
    }

    /// The estimation of a stiffness on this machine, which has to come near to the true one and to know how near.
    fn estimation() -> Result<Self, Box<dyn Error>> {
        let mut estimation =
            Estimation::<f32>::assembled().map_err(|error| format!("{error:?}"))?;
        for _ in 0..Estimation::<f32>::STEPS {
            estimation.step().map_err(|error| format!("{error:?}"))?;
        }
        let (stiffness, deviation) = estimation.stiffness();
        let error = (stiffness - 1.0).abs();
        if !(error <= NEAR && error <= 3.0 * deviation && deviation <= NEAR) {
            return Err(
                format!("the stiffness is {stiffness} +- {deviation} of the true one").into()
            );
        }
        let coordinates = estimation.coordinates().map(f64::from).collect();
        Ok(Self { coordinates, allowed: 1e-4, steps: Estimation::<f32>::STEPS })
    }

    /// The motion of this name, and the allowed difference of C from a reference.
    fn of(motion: &str) -> Result<(Self, f64), Box<dyn Error>> {
        Ok(match motion {
            // Of C only the platform's sine and cosine differ (`c/run` checks the rest bit by bit): a result may be as far
            // from the exact one as that of this machine is.
            "sixbar-f32" => (Self::new::<Sixbar<f32>>(1e-4)?, 2.0 * SIXBAR_IN_SINGLE),
            "sixbar-f64" => (Self::new::<Sixbar<f64>>(1e-9)?, 1e-9),
            "jumper-f32" => (Self::new::<Jumper<f32>>(1e-4)?, 2.0 * JUMPER_IN_SINGLE),
            "estimate-f32" => (Self::estimation()?, 1e-4),
            _ => return Err(format!("there is no motion {motion}").into()),
        })
    }
}

/// The report of a target.
#[derive(Deserialize)]
struct Report {
    /// q (rad), then u (rad/s): the bits of an `f64`, in hexadecimal.
    coordinates: Vec<String>,
    ticks: Option<Ticks>,
    stack: Option<Stack>,
}

/// Ticks of a clock that counts executed instructions.
#[derive(Deserialize)]
struct Ticks {
    /// Ticks of a loop of two instructions, repeated ten thousand times.
    spin_10000: f64,
    /// Ticks of twice as many repetitions.
    spin_20000: f64,
    /// Ticks of all steps together.
    steps: f64,
    longest_step: f64,
}

/// Bytes of stack.
#[derive(Deserialize)]
struct Stack {
    assembly: u64,
    step: u64,
}

/// Sizes of firmware that contains nothing but the motion, bytes.
struct Image {
    flash: u64,
    ram: u64,
    /// Routines of `f64` in software.
    double: Vec<String>,
    /// What only code that can panic links.
    panics: Vec<String>,
}

fn main() -> ExitCode {
    println!(
        "| | largest difference | instructions per step | longest step | flash | static RAM | stack: assembly | step |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let mut sound = true;
    for row in env::args().skip(1) {
        match judge(&row) {
            Ok(complaints) => {
                for complaint in complaints {
                    sound = false;
                    eprintln!("{row}: {complaint}");
                }
            }
            Err(error) => {
                sound = false;
                eprintln!("{row}: {error}");
            }
        }
    }
    if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Prints a row and returns its failures.
fn judge(row: &str) -> Result<Vec<String>, Box<dyn Error>> {
    let mut fields = row.split(';');
    let mut field = |what| fields.next().ok_or(format!("there is no {what}"));
    let (name, motion, path) = (field("name")?, field("motion")?, field("report")?);
    let image = field("image").ok().map(image).transpose()?;
    let report = report(path)?;
    let (name, limited) = name.strip_suffix('!').map_or((name, false), |name| (name, true));
    let mut complaints = Vec::new();

    let got = coordinates(&report)?;
    let (motion, reference) = match motion.split_once('=') {
        Some((motion, path)) => (motion, Some(coordinates(&self::report(path)?)?)),
        None => (motion, None),
    };
    let ours = reference.is_none();
    let (mut expected, allowed_of_c) = Expected::of(motion)?;
    if let Some(reference) = reference {
        (expected.coordinates, expected.allowed) = (reference, allowed_of_c);
    }
    let Expected { coordinates: expected, allowed, steps } = expected;
    if got.len() != expected.len() {
        return Err(format!("{} coordinates instead of {}", got.len(), expected.len()).into());
    }
    let difference = got.iter().zip(&expected).fold(0.0_f64, |most, (got, expected)| {
        let difference = (got - expected).abs();
        if difference > most || difference.is_nan() { difference } else { most }
    });
    if !(difference <= allowed) {
        complaints.push(format!("differs by {difference:e}, allowed is {allowed:e}"));
    }
    let mut line = format!("| {name} | {difference:.1e} |");

    let mut check = |what: &str, value: f64, most: f64| {
        if limited && !(value <= most) {
            complaints.push(format!("{what} {value} exceeds {most}"));
        }
    };
    match &report.ticks {
        Some(ticks) => {
            // Checks the rate of the clock, and that reading it takes almost no time.
            let per_tick = 20_000.0 / (ticks.spin_20000 - ticks.spin_10000);
            let error = ticks.spin_10000 * per_tick - 20_000.0;
            if !(error.abs() <= 20.0) {
                return Err(format!("a known loop is off by {error} instructions").into());
            }
            let longest = ticks.longest_step * per_tick;
            check("instructions", longest, INSTRUCTIONS);
            let mean = ticks.steps * per_tick / f64::from(steps);
            line += &format!(" {mean:.0} | {longest:.0} |");
        }
        None => line += " | |",
    }
    match &image {
        Some(image) => {
            check("flash", image.flash as f64, FLASH as f64);
            line += &format!(" {} | {} |", image.flash, image.ram);
        }
        None => line += " | |",
    }
    match &report.stack {
        Some(stack) => {
            check("stack", stack.assembly.max(stack.step) as f64, STACK as f64);
            line += &format!(" {} | {} |", stack.assembly, stack.step);
        }
        None => line += " | |",
    }
    println!("{line}");
    complaints.extend(page::complaint(&line));
    if ours && let Some(image) = image {
        if motion.ends_with("f32") && !image.double.is_empty() {
            complaints.push(format!("contains arithmetic of f64: {}", image.double.join(", ")));
        }
        if !image.panics.is_empty() {
            complaints.push(format!("can panic: {}", image.panics.join(", ")));
        }
    }
    Ok(complaints)
}

fn report(path: &str) -> Result<Report, Box<dyn Error>> {
    let text = fs::read_to_string(path).map_err(|error| format!("{path}: {error}"))?;
    serde_json::from_str(&text).map_err(|error| format!("{path}: {error}\n{text}").into())
}

fn coordinates(report: &Report) -> Result<Vec<f64>, Box<dyn Error>> {
    let number = |bits: &String| Ok(f64::from_bits(u64::from_str_radix(bits, 16)?));
    report.coordinates.iter().map(number).collect()
}

/// Sizes of an executable's sections.
fn image(path: &str) -> Result<Image, Box<dyn Error>> {
    let bytes = fs::read(path).map_err(|error| format!("{path}: {error}"))?;
    let file = object::File::parse(&*bytes)?;
    let mut image = Image { flash: 0, ram: 0, double: Vec::new(), panics: Vec::new() };
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
        if sh_flags & u64::from(elf::SHF_ALLOC) == 0 {
            continue;
        }
        let stored = section.file_range().is_some();
        image.flash += if stored { section.size() } else { 0 };
        image.ram += if sh_flags & u64::from(elf::SHF_WRITE) != 0 { section.size() } else { 0 };
    }
    let symbols: Vec<&str> = file.symbols().filter_map(|symbol| symbol.name().ok()).collect();
    if !symbols.contains(&"main") {
        return Err(format!("{path} has no table of symbols").into());
    }
    for symbol in symbols {
        if symbol.starts_with("__aeabi_d") || symbol.ends_with("2d") {
            image.double.push(symbol.to_owned());
        }
        // The panic handler, which the linker removes if nothing calls it, and the functions that lead to it.
        if ["rust_begin_unwind", "panicking", "_fail"].iter().any(|part| symbol.contains(part)) {
            image.panics.push(symbol.to_owned());
        }
    }
    Ok(image)
}
