//! From a drawing to a model, from there to a file for other programs, and back: the same mechanism.
//!
//! The sheets are random strips: a rectangle with creases from one side to the other, so that every angle of every
//! crease is possible, turned by any angle, with a hole and a slit.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;

use lamc::laminate::{self, Mechanism};
use lamc::source::{self, Diagnostics, SourceFile};
use lamc_drawings::{Format, Pattern, Reading, read};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::common::{files, folder, run, text};

/// How far lengths and angles may be off, as a share of the size of the sheet and of a radian.
const EXACT: f64 = 1e-9;

type Point = [f64; 2];

/// A sheet as SVG, in millimetres.
fn sheet(rng: &mut ChaCha8Rng) -> String {
    let [width, height] = [rng.random_range(60.0..200.0), rng.random_range(30.0..120.0)];
    let (s, c) = rng.random_range(0.0..TAU).sin_cos();
    let mut svg = String::from("<svg width=\"600mm\" viewBox=\"0 0 600 600\">\n");
    let mut line = |ends: [Point; 2], look: &str| {
        let [[x1, y1], [x2, y2]] =
            ends.map(|[x, y]| [300.0 + c * x - s * y, 300.0 + s * x + c * y]);
        writeln!(svg, "<line x1='{x1}' y1='{y1}' x2='{x2}' y2='{y2}' {look}/>").unwrap();
    };
    let mut ring = |points: &[Point], colour: &str| {
        for (from, to) in points.iter().zip(points.iter().cycle().skip(1)) {
            line([*from, *to], &format!("stroke='{colour}'"));
        }
    };
    ring(&[[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]], "#000");
    let count = rng.random_range(1..7);
    let step = width / f64::from(count + 1);
    let [left, right] = [0.2 * step, width - 0.2 * step];
    if rng.random_bool(0.5) {
        ring(
            &[[right, 0.3 * height], [width - 0.1 * step, 0.5 * height], [right, 0.7 * height]],
            "#0f0",
        );
    }
    if rng.random_bool(0.5) {
        line([[left, 0.0], [left, 0.4 * height]], "stroke='#0f0'");
    }
    for crease in 1..=count {
        let [a, b] = [0, 1].map(|_| step * (f64::from(crease) + rng.random_range(-0.35..0.35)));
        let share = rng.random_range(0.3..0.7);
        let middle = [a + share * (b - a), share * height];
        let look = match rng.random_range(0..4) {
            0 => "stroke='magenta'".to_owned(),
            1 => "stroke='red'".to_owned(),
            2 => format!("stroke='red' opacity='{}'", rng.random_range(0.01..1.0)),
            _ => format!("stroke='blue' opacity='{}'", rng.random_range(0.01..1.0)),
        };
        line([[a, 0.0], middle], &look);
        line([[b, height], middle], &look);
    }
    svg + "</svg>\n"
}

/// Runs a command that must succeed.
fn done(arguments: &[&str]) -> String {
    let output = run(arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stderr)
}

fn mechanism(path: &str) -> Mechanism {
    let file = SourceFile::read(path).unwrap_or_else(|error| panic!("{error}"));
    let parsed = source::parse(&file)
        .and_then(|(model, _)| laminate::build(&model, &mut Diagnostics::default()));
    parsed.unwrap_or_else(|errors| panic!("{}", errors.render(&file, false)))
}

/// What a body is, by its name: its mass, and its centre of mass and inertia as lengths and as a mass times them.
fn bodies(mechanism: &Mechanism) -> BTreeMap<&str, (bool, Vec<f64>)> {
    let of = |body: &laminate::Body| {
        let properties = &body.mass_properties;
        let density = properties.mass.max(f64::MIN_POSITIVE);
        let inertia = properties.inertia.iter().map(|entry| (entry.abs() / density).sqrt());
        let area = (properties.mass / (700.0 * 3e-4)).sqrt();
        (body.fixed, properties.com.iter().copied().chain(inertia).chain([area]).collect())
    };
    mechanism.bodies.iter().map(|body| (body.name.as_str(), of(body))).collect()
}

/// The second mechanism is the first one.
fn check_same(first: &Mechanism, second: &Mechanism, case: u64) {
    let near = |a: f64, b: f64| {
        assert!((a - b).abs() <= EXACT * first.size.max(1.0), "case {case}: {a}, {b}")
    };
    let [all, again] = [first, second].map(bodies);
    assert_eq!(all.keys().collect::<Vec<_>>(), again.keys().collect::<Vec<_>>(), "case {case}");
    for ((fixed, lengths), (fixed_again, lengths_again)) in all.values().zip(again.values()) {
        assert_eq!(fixed, fixed_again, "case {case}");
        lengths.iter().zip(lengths_again).for_each(|(a, b)| near(*a / first.size, *b / first.size));
    }
    assert_eq!(first.joints.len(), second.joints.len(), "case {case}");
    for joint in &first.joints {
        let other = second.joints.iter().find(|other| other.name == joint.name);
        let other = other.unwrap_or_else(|| panic!("case {case}: {} is lost", joint.name));
        let names = |mechanism: &Mechanism, joint: &laminate::Joint| {
            joint.bodies.map(|body| mechanism.bodies[body.index()].name.clone())
        };
        let (pair, mut pair_again) = (names(first, joint), names(second, other));
        // A hinge may run the other way, with its bodies exchanged.
        let (mut point, mut direction) = (other.point, other.direction);
        if pair != pair_again {
            pair_again.reverse();
            (point, direction) = (point + direction * other.length, -direction);
        }
        assert_eq!(pair, pair_again, "case {case}: {}", joint.name);
        near((point - joint.point).norm() / first.size, 0.0);
        near((direction - joint.direction).norm(), 0.0);
        near(other.length / first.size, joint.length / first.size);
        assert_eq!(joint.fold.is_some(), other.fold.is_some(), "case {case}: {}", joint.name);
        near(joint.fold.unwrap_or(0.0), other.fold.unwrap_or(0.0));
    }
}

/// A folded sheet comes back with its facets, its hinge lines and the angles of its finished fold.
#[test]
fn fold_keeps_the_mechanism() {
    for case in 0..24 {
        let (_guard, folder) = folder();
        let path = |name: &str| folder.join(name).display().to_string();
        fs::write(folder.join("a.svg"), sheet(&mut ChaCha8Rng::seed_from_u64(case))).unwrap();
        done(&["import", &path("a.svg"), "-o", &path("a.yaml")]);
        let first = mechanism(&path("a.yaml"));
        // Without a crease that has an angle of its own there is nothing to fold.
        if first.joints.iter().all(|joint| joint.fold.is_none()) {
            continue;
        }
        done(&[
            "fold",
            &path("a.yaml"),
            "--to",
            "60%",
            "--steps",
            "3",
            "--fold-out",
            &path("a.fold"),
        ]);
        done(&["import", &path("a.fold"), "-o", &path("b.yaml")]);
        check_same(&first, &mechanism(&path("b.yaml")), case);
    }
}

/// What the laser cuts out of a layer has the area of its bodies there: the mass of the model over that of a square
/// metre, for card on both sides of a film.
#[test]
fn cuts_have_the_area_of_the_bodies() {
    /// Mass of a square metre of card and of film, kg: `lamc import` says what it assumes.
    const CARD: f64 = 700.0 * 3e-4;
    const FILM: f64 = 1380.0 * 5e-5;
    for case in 0..8 {
        let (_guard, folder) = folder();
        let path = |name: &str| folder.join(name).display().to_string();
        fs::write(folder.join("a.svg"), sheet(&mut ChaCha8Rng::seed_from_u64(case))).unwrap();
        done(&["import", &path("a.svg"), "-o", &path("a.yaml"), "--crease-width", "1mm"]);
        let model = mechanism(&path("a.yaml"));
        let mass: f64 = model.bodies.iter().map(|body| body.mass_properties.mass).sum();
        done(&["cut", &path("a.yaml"), "--svg", &path("#.svg"), "--dxf", &path("#.dxf")]);
        // SVG has four decimals of a millimetre; unions are computed on a grid of 2^-30 of the sheet.
        for (kind, format, digits) in [("svg", Format::Svg, 1e-4), ("dxf", Format::Dxf, 3e-7)] {
            let mut found = 0.0;
            for name in
                files(&folder).iter().filter(|name| name.ends_with(kind) && *name != "a.svg")
            {
                let bytes = fs::read(folder.join(name)).unwrap();
                let drawing = read(format, &bytes, &Reading::default()).unwrap();
                let pattern = Pattern::of(&drawing, Some(1e-3)).unwrap();
                let area: f64 = pattern.facets.iter().map(|facet| pattern.area(facet)).sum();
                let sheet = if name.contains("card") { CARD } else { FILM };
                found += area * drawing.unit.unwrap().powi(2) * sheet;
            }
            // Each corner is rounded by half a digit, along outlines of less than 10 m in all.
            let rounding = digits * 1e-3 * 10.0 * (2.0 * CARD + FILM);
            assert!(
                (found - mass).abs() <= rounding + EXACT * mass,
                "case {case}, {kind}: {found}, {mass}"
            );
        }
    }
}
