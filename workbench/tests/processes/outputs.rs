//! The commands that write files.

use std::path::Path;
use std::process::Command;

use super::common::{example, lamc};

/// A command, and the files that it writes into its folder.
pub struct Written {
    pub arguments: &'static [&'static str],
    pub files: &'static [&'static str],
}

/// Every kind of file, but for those of `lamc sweep`, which goes on where it was interrupted.
pub const ALL: [Written; 9] = [
    Written {
        arguments: &[
            "@sixbar.yaml",
            "--no-cache",
            "-o",
            "m.rs",
            "--c",
            "m.c",
            "--header",
            "m.h",
            "--python",
            "m.py",
            "--fmu",
            "m.fmu",
        ],
        files: &["m.rs", "m.c", "m.h", "m.py", "m.fmu"],
    },
    Written {
        arguments: &["@sixbar.yaml", "--no-cache", "-o", "m.rs", "--header", "m.h", "--extern-c"],
        files: &["m.rs", "m.h"],
    },
    Written {
        arguments: &["derive", "@miura_sheet.yaml", "--no-cache", "-o", "m.lamc"],
        files: &["m.lamc"],
    },
    Written {
        arguments: &[
            "simulate",
            "@sixbar.yaml",
            "--duration",
            "0.2",
            "--csv",
            "m.csv",
            "--npz",
            "m.npz",
            "--plot",
            "p.svg",
            "--view",
            "m.html",
            "--png",
            "m.png",
            "--obj",
            "m.obj",
            "--stl",
            "m.stl",
            "--fold-out",
            "m.fold",
        ],
        files: &["m.csv", "m.npz", "p.svg", "m.html", "m.png", "m.obj", "m.stl", "m.fold"],
    },
    Written {
        arguments: &[
            "simulate",
            "@pendulum.yaml",
            "--duration",
            "0.3",
            "--video",
            "m.mp4",
            "--size",
            "320x240",
        ],
        files: &["m.mp4"],
    },
    Written {
        arguments: &[
            "fold",
            "@fold/honeycomb.yaml",
            "--steps",
            "5",
            "--csv",
            "m.csv",
            "--state",
            "m.yaml",
        ],
        files: &["m.csv", "m.yaml"],
    },
    Written { arguments: &["import", "@fold/honeycomb.svg", "-o", "m.yaml"], files: &["m.yaml"] },
    Written {
        arguments: &["cut", "@sixbar.yaml", "--svg", "m.svg", "--dxf", "m.dxf"],
        files: &["m.svg", "m.dxf"],
    },
    Written {
        arguments: &[
            "optimise",
            "@optimise/chebyshev.yaml",
            "@optimise/chebyshev_goals.yaml",
            "-o",
            "m.yaml",
        ],
        files: &["m.yaml"],
    },
];

impl Written {
    /// The command that writes them into a folder; `@` in an argument stands for the folder of examples.
    pub fn command(&self, folder: &Path) -> Command {
        let mut command = lamc();
        command.current_dir(folder);
        for argument in self.arguments {
            match argument.strip_prefix('@') {
                Some(name) => command.arg(example(name)),
                None => command.arg(argument),
            };
        }
        command
    }
}
