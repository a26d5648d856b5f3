//! Writes the leg's equations, in single precision, to `OUT_DIR`.

fn main() -> Result<(), lamc::BuildError> {
    lamc::Config::new().precision(lamc::Precision::F32).compile("../../leg/leg.yaml")?;
    Ok(())
}
