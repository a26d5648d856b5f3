//! `lamc hinge MODEL`: stiffness and damping of a hinge from a model or from measurements.

use std::fmt::Write;

use clap::{Args, Subcommand};
use lamc::laminate::flexure::Beam;
use lamc::laminate::flexure::sharifzadeh2018::Coefficients;
use lamc::source::read_in;
use lamc_workbench::execution::Jit;
use lamc_workbench::identify::family;
use lamc_workbench::identify::swing::Swing;

use super::fit::{Report, read, summary};
use super::paths::Paths;
use super::{Outcome, compiled, fail, misused, output, read_numbers};

#[derive(Subcommand)]
pub enum Command {
    /// Stiffness and linear range of a strip in bending
    Beam(BeamArguments),
    /// Stiffness and damping by the polynomials of DETC2018-86359
    Sharifzadeh2018(PolynomialArguments),
    /// Stiffness and damping from a recorded swing
    Fit(FitArguments),
    /// Polynomials of a family of hinges from a table of measured ones
    Family(FamilyArguments),
}

#[derive(Args)]
pub struct BeamArguments {
    /// Young's modulus: 4383.27MPa
    #[arg(long, value_parser = pressure, value_name = "PRESSURE")]
    youngs_modulus: f64,
    /// Thickness of the strip: 0.127mm
    #[arg(long, value_parser = length, value_name = "LENGTH")]
    thickness: f64,
    /// Free length across the gap between the plates
    #[arg(long, value_parser = length, value_name = "LENGTH")]
    length: f64,
    /// Width along the hinge line
    #[arg(long, value_parser = length, value_name = "LENGTH")]
    width: f64,
    /// Part of the width that is cut out
    #[arg(long, value_parser = length, value_name = "LENGTH", default_value = "0")]
    gaps: f64,
    /// Stress at which the material yields: the linear range follows from it
    #[arg(long, value_parser = pressure, value_name = "PRESSURE")]
    yield_stress: Option<f64>,
    /// Distance from the hinge at which a force acts
    #[arg(long, value_parser = length, value_name = "LENGTH", requires = "yield_stress")]
    arm: Option<f64>,
}

#[derive(Args)]
pub struct PolynomialArguments {
    /// Length l of the hinge
    #[arg(long, value_parser = length, value_name = "LENGTH")]
    length: f64,
    /// Width w of the hinge
    #[arg(long, value_parser = length, value_name = "LENGTH")]
    width: f64,
    /// Area a of the body that swings: 50cm^2; without it the damping by the air is left out
    #[arg(long, value_parser = area, value_name = "AREA")]
    area: Option<f64>,
    /// Use the coefficients as printed, not as corrected
    #[arg(long)]
    printed: bool,
}

#[derive(Args)]
pub struct FamilyArguments {
    /// Specimens as CSV: `l [mm]`, `w [mm]`, `a [cm^2]`, `k [N*m/rad]`, `b [N*m*s/rad]`
    table: String,
    /// Name of the family in model files
    #[arg(long)]
    name: String,
    /// Where to write the entry for `hinge_models`; `-` writes standard output
    #[arg(short, long, value_name = "FILE")]
    output: String,
}

#[derive(Args)]
pub struct FitArguments {
    /// The swing as CSV: `t [s]` and `theta [deg]` or `theta [rad]`, zero where the body hangs
    /// straight down; `-` reads standard input
    data: String,
    /// Moment of inertia about the centre of mass: 25kg*mm^2
    #[arg(long, value_parser = moment, value_name = "INERTIA")]
    inertia: f64,
    /// Mass of the body that swings
    #[arg(long, value_parser = mass, value_name = "MASS")]
    mass: f64,
    /// From the hinge to the centre of mass
    #[arg(long, value_parser = length, value_name = "LENGTH")]
    arm: f64,
    /// Gravity, m/s^2
    #[arg(long, default_value_t = 9.81, value_name = "M/S^2")]
    gravity: f64,
    #[command(flatten)]
    report: Report,
}

fn moment(text: &str) -> Result<f64, String> {
    read_in(text, "kg*m^2")
}

fn mass(text: &str) -> Result<f64, String> {
    read_in(text, "kg")
}

fn pressure(text: &str) -> Result<f64, String> {
    read_in(text, "Pa")
}

fn length(text: &str) -> Result<f64, String> {
    read_in(text, "m")
}

fn area(text: &str) -> Result<f64, String> {
    read_in(text, "m^2")
}

pub fn run(command: &Command) -> Outcome {
    match command {
        Command::Beam(arguments) => beam(arguments),
        Command::Sharifzadeh2018(arguments) => sharifzadeh2018(arguments),
        Command::Fit(arguments) => swing(arguments),
        Command::Family(arguments) => family_of(arguments),
    }
}

fn beam(given: &BeamArguments) -> Outcome {
    let positive = [
        ("--youngs-modulus", given.youngs_modulus),
        ("--thickness", given.thickness),
        ("--length", given.length),
        ("--width minus --gaps", given.width - given.gaps),
        ("--yield-stress", given.yield_stress.unwrap_or(1.0)),
        ("--arm", given.arm.unwrap_or(1.0)),
    ];
    if let Some((name, _)) = positive.iter().find(|(_, value)| *value <= 0.0) {
        return Err(misused(format_args!("{name} must be greater than zero")));
    }
    if given.gaps < 0.0 {
        return Err(misused("--gaps must not be negative"));
    }
    let beam = Beam {
        youngs_modulus: given.youngs_modulus,
        length: given.length,
        width: given.width - given.gaps,
        thickness: given.thickness,
    };
    let mut text = format!("stiffness      {:.6e} N m/rad\n", beam.stiffness());
    if let Some(stress) = given.yield_stress {
        let range = beam.linear_range(stress, given.arm.unwrap_or(1.0));
        let _ = writeln!(text, "linear within  {:.4} deg", range.angle.to_degrees());
        let _ = writeln!(text, "deflection     {:.6e} m", range.deflection);
        if let Some(arm) = given.arm {
            let _ = writeln!(text, "force          {:.6e} N at {arm} m", range.force);
        }
    }
    output::print(&text)
}

fn sharifzadeh2018(given: &PolynomialArguments) -> Outcome {
    let model = if given.printed { Coefficients::Printed } else { Coefficients::Corrected };
    let hinge = model.hinge(given.length, given.width, given.area).map_err(fail)?;
    let mut text = String::new();
    let mut line = |name: &str, value: f64, unit: &str| {
        let _ = writeln!(text, "{name:<18} {value:.6e} {unit}");
    };
    line("stiffness k(l, w)", hinge.stiffness, "N m/rad");
    line("damping b", hinge.material_damping + hinge.air_damping, "N m s/rad");
    line("  of the material", hinge.material_damping, "N m s/rad");
    if given.area.is_some() {
        line("  of the air", hinge.air_damping, "N m s/rad");
    }
    text.push_str("the fits of one variable, for comparison:\n");
    let at = [given.length, given.width, given.area.unwrap_or(0.0)];
    let mut line = |name: &str, value: f64, unit: &str| {
        let note = if value > 0.0 { "" } else { ": not valid here" };
        let _ = writeln!(text, "  {name:<16} {value:.6e} {unit}{note}");
    };
    line("k(l)", model.stiffness_by_length().value(at), "N m/rad");
    line("k(w)", model.stiffness_by_width().value(at), "N m/rad");
    line("b(l)", model.damping_by_length().value(at), "N m s/rad");
    line("b(w)", model.damping_by_width().value(at), "N m s/rad");
    if given.area.is_some() {
        line("b(a)", model.damping_by_area().value(at), "N m s/rad");
    }
    output::print(&text)
}

fn swing(given: &FitArguments) -> Outcome {
    let FitArguments { inertia, mass, arm, gravity, .. } = *given;
    given.report.check(Paths::default().input("the swing", [&given.data]))?;
    let record = read(&given.data, &["theta"], &[])?;
    let swing = Swing { inertia, mass, arm, gravity };
    let compiled = compiled(&swing.model(), None, |_| Ok(()))?;
    let system = Jit::new(&compiled.program);
    let fit = swing.by_trajectory(&system, &record).map_err(fail)?;
    given.report.write(&record, &fit, system.interface())?;
    let mut text = summary(&fit);
    let (t, theta) = record.seen(0);
    if let Some((estimates, series)) = swing.by_derivatives(&t, &theta) {
        let _ = writeln!(text, "by derivatives of a Fourier series of order {}:", series.order());
        for estimate in estimates {
            let _ = writeln!(text, "{:<24} {:>14.6e}", estimate.name, estimate.value);
        }
    }
    output::print(&text)
}

fn family_of(given: &FamilyArguments) -> Outcome {
    if let Some(reason) = family::unusable(&given.name) {
        return Err(misused(format_args!("--name: {reason}")));
    }
    let paths = Paths::default().input("the table", [&given.table]);
    paths.output("--output", [&given.output]).check()?;
    let located = |error| fail(format_args!("{}: {error}", given.table));
    let specimens = read_numbers(&given.table, family::read)?;
    let regressions = family::regress(&specimens).map_err(located)?;
    output::write(&given.output, &family::to_yaml(&given.name, &regressions, &specimens))
}
