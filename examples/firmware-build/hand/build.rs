//! Writes the equations of the hand's two linkages, generic over the number type, to `OUT_DIR`.

fn main() -> Result<(), lamc::BuildError> {
    lamc::Config::new().compile_all(["../../sixbar.yaml", "../../fourbar.yaml"])?;
    Ok(())
}
