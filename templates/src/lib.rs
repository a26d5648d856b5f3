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
