//! States of a motion for other programs: FOLD, OBJ, STL.

use clap::Args;
use lamc::laminate::Mechanism;
use lamc_workbench::export::{fold, obj, stl};
use lamc_workbench::motion::Motion;
use lamc_workbench::scene::Scene;

use super::paths::Paths;
use super::{Outcome, fail, output, warn};

/// What to write.
#[derive(Args)]
pub struct Shapes {
    /// Write the crease pattern and every sample of the motion as a FOLD file with frames; `-` writes
    /// standard output
    #[arg(long, value_name = "FILE")]
    fold_out: Option<String>,
    /// Write the bodies at the end of the motion as OBJ, in millimetres; `-` writes standard output
    #[arg(long, value_name = "FILE")]
    obj: Option<String>,
    /// Write the bodies at the end of the motion as binary STL, in millimetres
    #[arg(long, value_name = "FILE")]
    stl: Option<String>,
}

impl Shapes {
    /// Refuses names that belong to other formats.
    pub fn check(&self) -> Outcome {
        for (path, extension) in [(&self.fold_out, "fold"), (&self.obj, "obj"), (&self.stl, "stl")]
        {
            output::has_extension(path.as_ref(), extension)?;
        }
        Ok(())
    }

    /// Adds what is to be written.
    pub fn paths<'a>(&'a self, paths: Paths<'a>) -> Paths<'a> {
        paths
            .output("--fold-out", &self.fold_out)
            .output("--obj", &self.obj)
            .output("--stl", &self.stl)
    }

    /// Writes what was asked for.
    pub fn write(&self, mechanism: &Mechanism, motion: &Motion) -> Outcome {
        if let Some(path) = &self.fold_out {
            let folded = fold(mechanism, motion).map_err(fail)?;
            for joint in &folded.missing {
                warn(format_args!(
                    "{path} has no crease for the hinge `{joint}`, because the plates of its two bodies have no \
                     common edge"
                ));
            }
            output::write(path, &folded.text)?;
        }
        if self.obj.is_none() && self.stl.is_none() {
            return Ok(());
        }
        let scene = Scene::new(mechanism);
        let end = motion.samples.last().map_or(&[][..], |sample| &sample.poses);
        if let Some(path) = &self.obj {
            output::write(path, &obj(&scene, end))?;
        }
        match &self.stl {
            Some(path) => output::write(path, &stl(&scene, end)),
            None => Ok(()),
        }
    }
}
