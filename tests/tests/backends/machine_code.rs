//! The assembly that rustc generates for the functions: it contains no panic and thus no bounds check, no call
//! of `fma`, and fused instructions if the target has them.

use std::fs;
use std::path::Path;
use std::process::Command;

use lamc::backend::identifiers::type_name;
use lamc::backend::rust::Options;
use lamc::pipeline::{Compiled, rust_module};
use lamc::program::Selection;
use lamc_tests::chain::chain;
use lamc_tests::{compile, compile_text, workspace};

/// Calls every function of a module.
const CALLS: &str = "
use lamc_runtime::plumbing::{Balance, EquationsMut, Margin, ProjectionMut, exactly};
use lamc_runtime::{Change, Error, JacobianMut, Mechanism};

#[allow(clippy::too_many_arguments)]
pub fn write_all(
    model: &MODEL, at: Balance<'_, f64>, change: Change<'_, f64>, a: &mut [f64], b: &mut [f64],
    c: &mut [f64], d: &mut [f64],
) -> Result<f64, Error> {
    let (t, q, u) = (at.t, at.q, at.u);
    model.write_equations(t, q, u, EquationsMut { mass: a, forcing: b, jacobian: c, gamma: d })?;
    model.write_closure(q, a, b)?;
    model.write_reactions(at, a)?;
    model.write_tangent(at, change, b, c)?;
    let conditioning = |margin: Option<Margin<f64>>| margin.map_or(0.0, |margin| margin.conditioning);
    let trusted = conditioning(model.write_acceleration(t, q, u, d)?);
    let out = ProjectionMut { residual: a, positions: b, speeds: c };
    let closed = conditioning(model.write_projection(q, u, out)?);
    let out = JacobianMut { acceleration: a, dq: b, du: c, dt: d };
    let derivatives = conditioning(model.write_jacobian(t, q, u, out)?);
    let (q, u) = (exactly(q)?, exactly(u)?);
    let energy = Mechanism::energy(model, t, q, u)?;
    let point = Mechanism::points(model, q)?.first().map_or(0.0, |point| point[0]);
    let seen = Mechanism::poses(model, q)?[0][0] + point;
    Ok(trusted + closed + derivatives + energy.kinetic + energy.potential + seen)
}
";

#[test]
fn functions_never_panic_and_fuse_where_the_target_can() {
    // The second is long enough to come in parts.
    let models = [compile(&workspace().join("examples/sixbar.yaml")), compile_text(&chain(24))];
    let functions = Selection::named(["all"]).unwrap();
    let options = Options { functions, ..Options::default() };
    let texts: Vec<String> =
        models.iter().map(|model| rust_module(model, &options).unwrap()).collect();
    assert!(!texts[0].contains("_part_1(") && texts[1].contains("_part_1("));
    let folder = tempfile::tempdir().unwrap();
    write_package(folder.path(), &models, &texts);
    let plain = assembly(folder.path(), "");
    inspect(&plain);
    if cfg!(target_arch = "x86_64") {
        assert_eq!(fused(&plain), 0, "the plain target has no such instructions");
        let modern = assembly(folder.path(), "-C target-cpu=x86-64-v3");
        inspect(&modern);
        // One instruction does up to four of them.
        let asked = texts.iter().map(|text| text.matches("mul_add(").count()).sum::<usize>();
        let found = fused(&modern);
        println!("{found} instructions for {asked} fused products");
        assert!(found > asked / 4, "{found} instructions for {asked} fused products");
    }
}

/// Nothing panics, and no library multiplies and adds.
fn inspect(assembly: &str) {
    assert!(assembly.contains("write_all"), "the functions are not in it");
    let calls: Vec<&str> = assembly
        .lines()
        .map(str::trim)
        .filter(|line| ["call", "jmp", "bl\t", "b\t"].iter().any(|call| line.starts_with(call)))
        .collect();
    assert!(calls.iter().any(|call| call.contains("sin_cos")), "no calls are recognised");
    for call in calls {
        assert!(!call.contains("panic") && !call.contains("fail"), "{call}");
        let target = call.split_whitespace().last().unwrap_or_default();
        let symbol = target.trim_start_matches(['*', '_']).split(['@', '(']).next();
        assert!(!matches!(symbol, Some("fma" | "fmaf")), "{call}");
    }
}

/// How many fused multiply-adds of x86-64 there are.
fn fused(assembly: &str) -> usize {
    let mnemonics = assembly.lines().filter_map(|line| line.split_whitespace().next());
    let is_fused = |word: &&str| word.starts_with("vfm") || word.starts_with("vfnm");
    mnemonics.filter(is_fused).count()
}

fn write_package(folder: &Path, models: &[Compiled], texts: &[String]) {
    let source = folder.join("src");
    fs::create_dir_all(&source).unwrap();
    let mut library = String::new();
    for (index, (model, text)) in models.iter().zip(texts).enumerate() {
        let name = type_name(&model.program.interface.name);
        let calls = CALLS.replace("MODEL", &format!("{name}<f64>"));
        fs::write(source.join(format!("m{index}.rs")), format!("{text}{calls}")).unwrap();
        library.push_str(&format!("pub mod m{index};\n"));
    }
    fs::write(source.join("lib.rs"), library).unwrap();
    let runtime = workspace().join("runtime").canonicalize().unwrap();
    let manifest = format!(
        "[package]\nname = \"inspected\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n\
         [dependencies]\nlamc-runtime = {{ path = {runtime:?}, features = [\"std\"] }}\n\n\
         [profile.release]\nopt-level = 3\ncodegen-units = 1\n\n[workspace]\n"
    );
    fs::write(folder.join("Cargo.toml"), manifest).unwrap();
}

/// The assembly of the modules, with these flags.
fn assembly(folder: &Path, flags: &str) -> String {
    let target = folder.join("target");
    let output = Command::new(env!("CARGO"))
        .args(["rustc", "--release", "--offline", "--lib", "--", "--emit", "asm"])
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", &target)
        .env("RUSTFLAGS", flags)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut found: Vec<_> = fs::read_dir(target.join("release/deps"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "s"))
        .collect();
    found.sort_by_key(|path| fs::metadata(path).and_then(|data| data.modified()).unwrap());
    fs::read_to_string(found.last().unwrap()).unwrap()
}
