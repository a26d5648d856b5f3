//! A family of hinges: its polynomials against known ones, its cross-validation against fits without one
//! specimen, and its text in a mechanism.

use lamc::pipeline::compile;
use lamc::source::{SourceFile, parse, to_yaml as model_to_yaml};
use lamc_tests::random::Random;
use lamc_workbench::identify::family::{Specimen, read, regress, to_yaml};

/// 3 x 3 x 3 specimens of k = 0.01 + 0.2 w - 3 l, b = 2e-5 + 0.01 a + 4 l^2, times 1 + noise.
fn table(noise: f64) -> Vec<Specimen> {
    let mut random = Random::new(8);
    let mut specimens = Vec::new();
    for l in [1e-3, 2e-3, 3e-3] {
        for w in [0.02, 0.04, 0.07] {
            for a in [1e-3, 2e-3, 5e-3] {
                let mut off = || 1.0 + noise * random.range(-1.0, 1.0);
                let stiffness = (0.01 + 0.2 * w - 3.0 * l) * off();
                let damping = (2e-5 + 0.01 * a + 4.0 * l * l) * off();
                specimens.push(Specimen { at: [l, w, a], stiffness, damping });
            }
        }
    }
    specimens
}

#[test]
fn exact_specimens_give_their_polynomials_back() {
    let [stiffness, damping] = regress(&table(0.0)).unwrap();
    let at = [2.5e-3, 0.05, 3e-3];
    assert!((stiffness.polynomial.value(at) / (0.01 + 0.01 - 0.0075) - 1.0).abs() < 1e-10);
    assert!((damping.polynomial.value(at) / (2e-5 + 3e-5 + 2.5e-5) - 1.0).abs() < 1e-10);
    let of = |powers: [u8; 3]| {
        let terms = &stiffness.polynomial.0;
        terms.iter().find(|term| term.powers == powers).unwrap().coefficient
    };
    assert!((of([0; 3]) - 0.01).abs() < 1e-10 && (of([0, 1, 0]) - 0.2).abs() < 1e-10);
    assert!((of([1, 0, 0]) + 3.0).abs() < 1e-8 && of([0, 2, 0]).abs() < 1e-8);
    assert!(stiffness.error < 1e-12 && damping.validated < 1e-12);
}

/// The validated error from leverages is that of as many fits with one specimen left out.
#[test]
fn cross_validation_leaves_one_out() {
    let table = table(0.05);
    let [stiffness, damping] = regress(&table).unwrap();
    let (mut errors, count) = ([0.0; 2], table.len() as f64);
    for left_out in 0..table.len() {
        let mut others = table.clone();
        let specimen = others.remove(left_out);
        let [k, b] = regress(&others).unwrap();
        errors[0] += (k.polynomial.value(specimen.at) - specimen.stiffness).abs() / count;
        errors[1] += (b.polynomial.value(specimen.at) - specimen.damping).abs() / count;
    }
    for (regression, error) in [stiffness, damping].iter().zip(errors) {
        assert!(
            (regression.validated / error - 1.0).abs() < 1e-8,
            "{} {error}",
            regression.validated
        );
        assert!(regression.validated > regression.error);
    }
}

#[test]
fn a_mechanism_names_a_family() {
    let table = table(0.0);
    let family = to_yaml("tape", &regress(&table).unwrap(), &table);
    let compiled = |hinge: &str| {
        let text = format!(
            "bodies:
  base: {{ fixed: true }}
  b: {{ mass: 1, com: [1, 0, 0], inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }}
joints: {{ j: {{ bodies: [base, b], axis: [[0, 0], [0, 1]], hinge: {{ model: tape, {hinge} }} }} }}
{family}"
        );
        let file = SourceFile { path: "m.yaml".into(), text };
        let model = parse(&file).unwrap().0;
        let once = model_to_yaml(&model);
        let again = parse(&SourceFile { path: "m.yaml".into(), text: once.clone() }).unwrap().0;
        assert_eq!(once, model_to_yaml(&again));
        compile(&file).unwrap_or_else(|error| panic!("{error}"))
    };
    let inside = compiled("length: 2.5 mm, width: 50 mm, area: 30 cm^2");
    let joint = &inside.topology.mechanism.joints[0];
    assert!((joint.stiffness.constant().unwrap() / 0.0125 - 1.0).abs() < 1e-9);
    assert!((joint.damping.constant().unwrap() / 7.5e-5 - 1.0).abs() < 1e-9);
    assert!(inside.warnings.0.is_empty());
    for hinge in ["length: 2.5 mm, width: 80 mm, area: 30 cm^2", "length: 2 mm, width: 15 mm"] {
        let codes: Vec<_> = compiled(hinge).warnings.0.iter().map(|w| w.code.name).collect();
        assert_eq!(codes, ["outside-specimens"], "{hinge}");
    }
}

#[test]
fn tables_have_units() {
    let text = "specimen,l [mm],w [mm],a [cm^2],k [mN*m/rad],b\nx,1,20,30,18,6e-5\n";
    let specimens = read(text).unwrap();
    let expected = Specimen { at: [1e-3, 0.02, 3e-3], stiffness: 0.018, damping: 6e-5 };
    let close = |x: f64, y: f64| (x / y - 1.0).abs() < 1e-14;
    let [specimen] = specimens.as_slice() else { panic!("{specimens:?}") };
    assert!(specimen.at.iter().zip(expected.at).all(|(x, y)| close(*x, y)));
    assert!(close(specimen.stiffness, 0.018) && close(specimen.damping, 6e-5));
    for (text, says) in [
        ("l,w,k,b\n", "there is no column `a [m^2]`"),
        ("l [kg],w,a,k,b\n", "`l [kg]` has no unit of `l`, as in `l [m]`"),
        ("l,w,a,k,b\n1,2,3,4,-5\n", "`-5` is not a positive number"),
    ] {
        assert_eq!(read(text).unwrap_err().0[0].message, says);
    }
    // Three lengths, widths and areas make five coefficients of k.
    let all = table(0.0);
    let few = regress(&[all[0], all[13], all[26]]).unwrap_err().to_string();
    assert_eq!(few, "3 specimens are not enough to determine the 5 coefficients of stiffness");
}
