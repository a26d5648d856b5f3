//! The pictures of `docs/FIGURES.md` are what the commands above them draw.

use std::fs;
use std::path::Path;

use super::common::{folder, lamc, text};

#[test]
fn figures_are_what_their_commands_draw() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = fs::read_to_string(root.join("docs/FIGURES.md")).unwrap_or_default();
    let (_guard, folder) = folder();
    let mut count = 0;
    for command in page.lines().filter_map(|line| line.strip_prefix("cargo run -- ")) {
        let Some((arguments, figure)) = command.split_once(" --plot ") else {
            panic!("`{command}` draws no figure");
        };
        let drawn = folder.join("drawn.svg");
        let output =
            lamc().current_dir(&root).args(arguments.split(' ')).arg("--plot").arg(&drawn).output();
        let output = output.unwrap_or_else(|error| panic!("{error}"));
        assert!(output.status.success(), "{command}: {}", text(&output.stderr));
        let [drawn, committed] =
            [drawn, root.join(figure)].map(|path| fs::read_to_string(path).unwrap_or_default());
        // Their difference is thousands of coordinates, which help nobody.
        assert!(
            drawn == committed,
            "{figure} differs from what this draws: cargo run -- {command}"
        );
        count += 1;
    }
    assert!(count >= 4, "{count} figures");
}
