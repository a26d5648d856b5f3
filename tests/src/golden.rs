//! Pinned text: outputs that are committed and compared byte for byte.
//!
//! With the environment variable `LAMC_BLESS=1` a test writes what it finds instead of failing; `cargo
//! xtask bless` does so for all. Read the difference before you commit it.

use std::path::Path;
use std::{env, fs};

use similar::TextDiff;

/// Whether the text is the one pinned in the file; if not, prints the difference. When blessing, writes the
/// file first.
///
/// # Panics
/// If the file cannot be written.
pub fn is_pinned(path: &Path, text: &str) -> bool {
    let pinned = fs::read_to_string(path).unwrap_or_default();
    if pinned == text {
        return true;
    }
    let diff = TextDiff::from_lines(pinned.as_str(), text);
    println!("{}:\n{}", path.display(), diff.unified_diff().header("pinned", "found"));
    let blesses = env::var_os("LAMC_BLESS").is_some_and(|value| value == "1");
    if blesses {
        fs::write(path, text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
    blesses
}

/// Fails and prints the difference if the text is not the one that the file pins.
///
/// # Panics
/// If the texts differ.
pub fn assert_pinned(path: &Path, text: &str) {
    let pinned = is_pinned(path, text);
    assert!(pinned, "{} differs; `cargo xtask bless` rewrites it", path.display());
}
