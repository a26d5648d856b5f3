//! Text templates (tera) that `lamc` fills in, and the parts of the viewer page. Templates hold
//! layout, never decisions.

/// Header comment of a generated Rust module.
pub const RUST_HEADER: &str = include_str!("rust_header.tera");

/// The viewer page: `title`, `style`, `three`, `script`, `data` (JSON without `<`), `live`.
pub const VIEWER: &str = include_str!("viewer.html.tera");
/// Its style sheet.
pub const VIEWER_STYLE: &str = include_str!("viewer.css");
/// Its script.
pub const VIEWER_SCRIPT: &str = include_str!("viewer.js");
/// The parts of three.js that the script uses (MIT licence), as `three/make` bundles them.
pub const THREE: &str = include_str!("three.min.js");

/// Header of a generated C module: also of a Rust module that exports the same functions.
pub const C_HEADER: &str = include_str!("c_header.tera");

/// A generated C module: the mechanism's functions, then the runtime's algorithms in C.
pub const C_SOURCE: &str = include_str!("c_source.tera");

/// The runtime's constants as macros of C.
pub const C_CONSTANTS: &str = include_str!("c_constants.tera");

/// The runtime's algorithms in C, a file for each subject. They compile one by one as they are, with
/// `c/algorithms.h` and a `mechanism.h`; a generated module contains those that it needs.
pub mod c {
    macro_rules! files {
        ($($name:ident = $path:literal;)+) => {
            $(#[doc = concat!("`", $path, "`")] pub const $name: &str = include_str!($path);)+
        };
    }

    files! {
        TYPES = "c/types.h";
        NUMBERS = "c/numbers.c";
        LINEAR_ALGEBRA = "c/linear_algebra.c";
        CHOLESKY = "c/cholesky.c";
        FREE_BODIES = "c/free_bodies.c";
        PSEUDOINVERSE = "c/pseudoinverse.c";
        INDEPENDENT = "c/independent.c";
        RANK = "c/rank.c";
        CLOSURE_ROWS = "c/closure_rows.c";
        PASSAGE = "c/passage.c";
        ELIMINATION = "c/elimination.c";
        REDUCTION = "c/reduction.c";
        ACCELERATION = "c/acceleration.c";
        MOTORS = "c/motors.c";
        PROJECTION = "c/projection.c";
        PROJECTION_WITHOUT_CONSTRAINTS = "c/projection_without_constraints.c";
        RUNGE_KUTTA = "c/runge_kutta.c";
        FIXED_STEP = "c/fixed_step.c";
        LIMITS = "c/limits.c";
        ASSEMBLY_STEPS = "c/assembly_steps.c";
        ASSEMBLY = "c/assembly.c";
        ASSEMBLY_WITHOUT_LOOPS = "c/assembly_without_loops.c";
        INITIAL = "c/initial.c";
    }
}

/// Python around a generated C module.
pub const PYTHON: &str = include_str!("python.py.tera");

/// An FMU's C code around a generated C module, less what is of one version of FMI.
pub const FMU_MODEL: &str = include_str!("fmu_model.c.tera");

/// The functions of FMI 2.0; includes `model`.
pub const FMI2: &str = include_str!("fmi2.c.tera");

/// The functions of FMI 3.0; includes `model`.
pub const FMI3: &str = include_str!("fmi3.c.tera");

/// The units of a model description, of either version.
pub const FMU_UNITS: &str = include_str!("fmu_units.xml.tera");

/// The model description of FMI 2.0; includes `units`.
pub const FMI2_DESCRIPTION: &str = include_str!("fmi2_description.xml.tera");

/// The model description of FMI 3.0; includes `units`.
pub const FMI3_DESCRIPTION: &str = include_str!("fmi3_description.xml.tera");

/// How an FMU of FMI 3.0 is built.
pub const FMI3_BUILD: &str = include_str!("fmi3_build.xml.tera");
