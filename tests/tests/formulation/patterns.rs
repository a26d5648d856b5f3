//! Drawings as mechanisms: what a pattern gives has the motion of the drawn sheet.

use std::fs;

use lamc::pipeline::analyse;
use lamc::source::SourceFile;
use lamc::source::pattern::{Options, import};
use lamc_tests::workspace;

#[test]
fn a_miura_sheet_of_a_drawing_has_one_degree_of_freedom() {
    let drawing = workspace().join("examples/miura_sheet.svg");
    let model = workspace().join("examples/miura_sheet.yaml").display().to_string();
    let bytes = fs::read(&drawing).unwrap();
    let mut models = vec![SourceFile::read(&model).unwrap()];
    for crease_width in [0.0, 1e-3] {
        let options = Options { crease_width, ..Options::default() };
        let imported = import("miura_sheet.svg", bytes.clone(), "sheet", &options);
        assert!(imported.found.0.is_empty(), "{}", imported.found);
        let summary = "9 facets, 12 creases: 6 mountain, 6 valley, 0 flat; 12 border edges, 0 cuts";
        assert_eq!(imported.summary.as_deref(), Some(summary));
        assert!(imported.explanation.is_some_and(|svg| svg.starts_with("<svg")));
        models.push(SourceFile { path: "sheet.yaml".into(), text: imported.yaml.unwrap() });
    }
    for file in models {
        let (topology, found) =
            analyse(&file).unwrap_or_else(|errors| panic!("{}", errors.render(&file, false)));
        assert!(found.0.is_empty(), "{}", found.render(&file, false));
        assert_eq!(topology.mobility, 1);
        assert_eq!((topology.mechanism.bodies.len(), topology.mechanism.joints.len()), (9, 12));
    }
}
