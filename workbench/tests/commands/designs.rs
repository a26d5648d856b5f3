//! The best design of an optimisation as a file and as a picture.

use std::fs;

use super::common::{example, folder, run};
use super::pictures::read_png;

/// Both halves of a picture, byte by byte.
fn halves((width, height, pixels): (u32, u32, Vec<u8>)) -> [Vec<u8>; 2] {
    assert_eq!((width, height), (1280, 560));
    let rows = pixels.chunks_exact(3 * 1280);
    let half = |side: usize| {
        rows.clone().flat_map(|row| &row[3 * 640 * side..][..3 * 640]).copied().collect()
    };
    [half(0), half(1)]
}

#[test]
fn the_best_model_is_its_file_with_other_values() {
    let (_guard, folder) = folder();
    let [model, goals] = ["optimise/chebyshev.yaml", "optimise/chebyshev_goals.yaml"].map(example);
    let [best, again, first, second] = ["best.yaml", "again.yaml", "first.png", "second.png"]
        .map(|name| folder.join(name).display().to_string());
    assert!(run(&["optimise", &model, &goals, "-o", &best, "--png", &first]).status.success());
    let [before, after] = [&model, &best].map(|path| fs::read_to_string(path).unwrap());
    let changed: Vec<(&str, &str)> =
        before.lines().zip(after.lines()).filter(|(before, after)| before != after).collect();
    // The parameters that vary, each on a line of its own.
    let is_varied = |line: &str| line.contains("coupler: {") || line.contains("height: {");
    assert_eq!((changed.len(), before.lines().count()), (2, after.lines().count()));
    assert!(changed.iter().all(|(line, with)| is_varied(line) && with.contains(" mm, range: [")));
    // From the best design on nothing changes.
    assert!(run(&["optimise", &best, &goals, "-o", &again, "--png", &second]).status.success());
    let [left, right] = halves(read_png(first.as_ref()));
    assert!(left != right);
    let [left, right] = halves(read_png(second.as_ref()));
    let apart = left.iter().zip(&right).filter(|(a, b)| a.abs_diff(**b) > 8).count();
    assert!(apart * 1000 < left.len(), "{apart} of {} numbers differ", left.len());
}
