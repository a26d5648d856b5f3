//! Writes the arm's equations, in single precision, to `OUT_DIR`.

fn main() -> Result<(), lamc::BuildError> {
    lamc::Config::new()
        .precision(lamc::Precision::F32)
        .tunable([lamc::Tunable::Stiffness])
        .compile("arm.yaml")?;
    Ok(())
}
