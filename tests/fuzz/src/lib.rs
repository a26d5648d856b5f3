//! What the fuzzer calls: the stages that read a model, up to its loops.

#![allow(dead_code, unused_imports, reason = "the compiler's own files, of which a part is used")]

#[path = "../../../codegen/src/arithmetic.rs"]
pub mod arithmetic;
#[path = "../../../codegen/src/laminate/mod.rs"]
pub mod laminate;
#[path = "../../../codegen/src/source/mod.rs"]
pub mod source;
#[path = "../../../codegen/src/topology/mod.rs"]
pub mod topology;

use source::{Diagnostics, SourceFile};

/// Reads a model, as the compiler does before the algebra; diagnostics are rendered, and a model that is read
/// is written and read again.
pub fn read(text: &str) {
    let file = SourceFile { path: "model.yaml".into(), text: text.to_owned() };
    if let Err(problems) = analysed(&file) {
        assert!(!problems.0.is_empty(), "a refusal says why");
        let _ = problems.render(&file, false);
    }
}

fn analysed(file: &SourceFile) -> Result<(), Diagnostics> {
    let (model, warnings) = source::parse(file)?;
    let _ = warnings.render(file, false);
    let written = SourceFile { path: "again.yaml".into(), text: source::to_yaml(&model) };
    if let Err(problems) = source::parse(&written) {
        panic!(
            "what was written cannot be read:\n{}\n{}",
            written.text,
            problems.render(&written, false)
        );
    }
    let mechanism = laminate::build(&model, &mut Diagnostics::default())?;
    topology::build(mechanism)?;
    Ok(())
}
