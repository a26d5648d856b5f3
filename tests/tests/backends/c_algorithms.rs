//! The runtime's algorithms in C, as they stand in `templates/src/c`: each file compiles by itself without a
//! warning, and together they move a dummy mechanism and fail as the documentation says.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use lamc::backend::c::{self, Real};
use lamc_runtime::constants::ALL;
use lamc_runtime::plumbing::may_be_reduced;
use lamc_tests::workspace;

use super::c::{STRICT, compilers, successful};

/// Flags that files compiled by themselves can bear beside those of generated modules.
const STRICTER: [&str; 2] = ["-Wundef", "-Wmissing-prototypes"];

/// Loops, driven joints and free bodies of the dummy mechanism, and whether it is solved by independent speeds.
#[derive(Clone, Copy, Debug)]
struct Dummy {
    loops: bool,
    drives: bool,
    free: bool,
    real: Real,
    reduced: bool,
}

impl Dummy {
    /// Every combination; mechanisms with loops and without free bodies have independent speeds.
    fn all() -> impl Iterator<Item = Self> {
        let all = (0..32).map(|bits| Self {
            loops: bits & 1 != 0,
            drives: bits & 2 != 0,
            free: bits & 4 != 0,
            real: if bits & 8 != 0 { Real::Float } else { Real::Double },
            reduced: bits & 16 != 0,
        });
        all.filter(|dummy| !dummy.reduced || (dummy.loops && !dummy.free))
    }

    /// The flags of a compiler; `constants` is the folder of the header of constants.
    fn flags(self, constants: &Path) -> Vec<String> {
        let mut flags: Vec<String> =
            STRICT.iter().chain(&STRICTER).map(|&flag| flag.into()).collect();
        flags.push(format!("-DLOOPS={}", u8::from(self.loops)));
        flags.push(format!("-DDRIVES={}", u8::from(self.drives)));
        flags.push(format!("-DFREE_COUNT={}", u8::from(self.free)));
        flags.push(format!("-DIS_REDUCED={}", u8::from(self.reduced)));
        let may_be_reduced = self.reduced || may_be_reduced(self.loops.into(), self.free);
        flags.push(format!("-DMAY_BE_REDUCED={}", u8::from(may_be_reduced)));
        if self.real == Real::Float {
            flags.push("-DSINGLE".into());
        }
        let folders = [constants.to_owned(), dummy_folder(), algorithms_folder()];
        flags.extend(folders.map(|folder| format!("-I{}", folder.display())));
        flags
    }

    /// The files that such a mechanism needs.
    fn files(self) -> Vec<PathBuf> {
        let constrained = self.loops || self.drives;
        let is_needed = |name: &str| match name {
            "pseudoinverse" | "independent" | "rank" | "closure_rows" | "passage"
            | "projection" => constrained,
            "projection_without_constraints" => !constrained,
            "elimination" | "reduction" => self.reduced,
            "motors" => self.drives,
            "free_bodies" => self.free,
            "assembly" | "assembly_steps" => self.loops,
            "assembly_without_loops" => !self.loops,
            _ => true,
        };
        let mut files = c_files();
        files.retain(|path| is_needed(path.file_stem().unwrap().to_str().unwrap()));
        files
    }
}

pub(super) fn algorithms_folder() -> PathBuf {
    workspace().join("templates/src/c")
}

fn dummy_folder() -> PathBuf {
    workspace().join("tests/c/dummy")
}

/// The C files of the algorithms.
pub(super) fn c_files() -> Vec<PathBuf> {
    let entries = fs::read_dir(algorithms_folder()).unwrap();
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "c"));
    files.sort();
    assert!(files.len() > 15, "{} files: this looks in the wrong place", files.len());
    files
}

/// A folder with the header of constants for a type of number.
fn constants_header(real: Real) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("constants.h"), c::constants(ALL, real)).unwrap();
    folder
}

#[test]
fn every_file_compiles_by_itself_without_a_warning() {
    let compilers = compilers();
    let ways: [(&str, &[&str]); 3] = [
        // What may be uninitialised gcc knows only when it optimises.
        ("gcc", &["-O1", "-c", "-o", "/dev/null"]),
        ("clang", &["-fsyntax-only"]),
        ("arm-none-eabi-gcc", &["-ffreestanding", "-fsyntax-only"]),
    ];
    for dummy in Dummy::all() {
        let constants = constants_header(dummy.real);
        for file in dummy.files() {
            // With and without functions that solve by elimination, where a file asks for that.
            let asks = fs::read_to_string(&file).unwrap().contains("_IS_DIRECT");
            let direct = &["-DDIRECT=0", "-DDIRECT=1"][..if asks { 2 } else { 1 }];
            for (compiler, flags) in ways.iter().filter(|(name, _)| compilers.contains(name)) {
                for direct in direct {
                    let mut command = Command::new(compiler);
                    command.args(dummy.flags(constants.path())).arg(direct).args(*flags).arg(&file);
                    successful(
                        &mut command,
                        &format!("{compiler} on {} ({dummy:?})", file.display()),
                    );
                }
            }
        }
    }
}

/// What the dummy's program prints, line by line: a name and words.
fn run_dummy(dummy: Dummy) -> Vec<(String, Vec<String>)> {
    let constants = constants_header(dummy.real);
    let program = constants.path().join("dummy");
    let mut command = Command::new("gcc");
    command
        .args(dummy.flags(constants.path()))
        .args(["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"])
        .args(dummy.files())
        .arg(dummy_folder().join("mechanism.c"))
        .args(["-lm", "-o"])
        .arg(&program);
    successful(&mut command, &format!("the dummy mechanism ({dummy:?})"));
    let output = successful(&mut Command::new(&program), &format!("{dummy:?}"));
    let words = |line: &str| line.split(' ').map(str::to_owned).collect::<Vec<_>>();
    output.lines().map(words).map(|line| (line[0].clone(), line[1..].to_vec())).collect()
}

#[test]
fn the_files_move_a_dummy_mechanism() {
    if !compilers().contains(&"gcc") {
        return;
    }
    for dummy in Dummy::all() {
        let lines = run_dummy(dummy);
        assert_eq!(lines[0].0, "motion", "{dummy:?}");
        let numbers: Vec<f64> = lines[0].1.iter().map(|word| word.parse().unwrap()).collect();
        let [status, gain, open, speed, off] = numbers[..] else { panic!("{:?}", lines[0]) };
        assert_eq!(status, 0.0, "{dummy:?}");
        assert!(speed > 0.01, "{dummy:?}: at rest");
        // Motors do work.
        let [of_energy, of_loops, of_free] =
            if dummy.real == Real::Float { [1e-4, 2e-6, 1e-3] } else { [1e-11, 1e-14, 1e-12] };
        assert!(dummy.drives || gain.abs() < of_energy, "{dummy:?}: energy changes by {gain:e}");
        // Elimination closes to 1e-12 of the size, 3 m, or 16 epsilon.
        let of_elimination = if dummy.real == Real::Float { 6e-6 } else { 3e-12 };
        let of_loops = if dummy.reduced { of_elimination } else { of_loops };
        assert!(open < of_loops, "{dummy:?}: open by {open:e}");
        assert!(off < of_free, "{dummy:?}: the free body is off by {off:e}");
    }
}

/// A step that fails takes no more than docs/C.md says, in evaluations of the equations, and is tried again
/// for values that are not finite only.
#[test]
fn the_worst_case_of_a_step_is_bounded() {
    if !compilers().contains(&"gcc") {
        return;
    }
    // Independent speeds are tried before the equations, and not counted.
    for dummy in Dummy::all().filter(|dummy| !dummy.reduced) {
        let constrained = dummy.loops || dummy.drives;
        // Four stages; a projection evaluates the mass matrix once more.
        let (stages, projections) = (4, usize::from(constrained));
        // All pieces of 1, 2, 4, 8 and 16; the last of each fails before its projection.
        let (attempts, rounds) = (31, 5);
        let whole = stages + projections;
        let worst = attempts * whole - rounds * projections;
        let expected = [
            ("succeeds", 0, whole, "moved"),
            ("not_finite_at_once", 2, rounds, "untouched"),
            ("not_finite_at_the_end", 2, worst, "untouched"),
            ("mass_matrix", 1, 1, "untouched"),
            ("mass_matrix_at_the_end", 1, stages, "untouched"),
            if dummy.loops {
                ("not_closed", 3, whole, "untouched")
            } else {
                ("not_closed", 0, whole, "moved")
            },
            if dummy.loops && dummy.drives {
                ("drive_out_of_reach", 3, whole, "untouched")
            } else {
                ("drive_out_of_reach", 0, whole, "moved")
            },
        ];
        let lines = run_dummy(dummy);
        assert_eq!(lines.len(), expected.len() + 1);
        for ((name, words), (due, status, evaluations, state)) in lines[1..].iter().zip(expected) {
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            let due_words = [&*status.to_string(), &*evaluations.to_string(), state];
            assert_eq!((name.as_str(), &words[..]), (due, &due_words[..]), "{dummy:?}");
        }
    }
}
