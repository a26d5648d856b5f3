//! `lamc cut`, and states for other programs: the files and their contents, and what is refused.

use std::fs;

use lamc_drawings::{Drawing, Format, Reading, read};
use serde_json::Value;

use crate::common::{SWING, example, files, folder, run, text, told};

fn drawing(format: Format, bytes: &[u8]) -> Drawing {
    read(format, bytes, &Reading::default()).unwrap_or_else(|faults| panic!("{faults:?}"))
}

/// The length of all strokes, in millimetres.
fn length(drawing: &Drawing) -> f64 {
    let along = |[a, b]: [[f64; 2]; 2]| (b[0] - a[0]).hypot(b[1] - a[1]);
    let unit = drawing.unit.unwrap_or(f64::NAN);
    drawing.strokes.iter().map(|stroke| along(stroke.ends)).sum::<f64>() * unit * 1e3
}

/// A slit of 30 mm from the rim and one of 20 mm within a facet are cut, whether the model has the drawing or
/// what was imported from it.
#[test]
fn slits_of_a_drawing_are_cut() {
    let (_guard, folder) = folder();
    let path = |name: &str| folder.join(name).display().to_string();
    let lines = "<rect width='100' height='60' stroke='#000'/><path d='M50 0v60' stroke='#f00'/>\
                 <path d='M0 30h30M60 10h20' stroke='#0f0'/>";
    let sheet =
        "<svg xmlns='http://www.w3.org/2000/svg' width='100mm' height='60mm' viewBox='0 0 100 60'>";
    fs::write(path("sheet.svg"), format!("{sheet}{lines}</svg>")).unwrap();
    let model = "materials: { card: { density: 700, thickness: 3e-4 } }\nlayup: [card]\n\
                 pattern: { file: sheet.svg, crease: { stiffness: 0.1 } }\n";
    fs::write(path("drawn.yaml"), model).unwrap();
    let output = run(&["import", &path("sheet.svg"), "-o", &path("imported.yaml")]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    for model in ["drawn.yaml", "imported.yaml"] {
        for (option, format) in [("--svg", Format::Svg), ("--dxf", Format::Dxf)] {
            let output = run(&["cut", &path(model), option, "-"]);
            assert_eq!((output.status.code(), told(&output)), (Some(0), String::new()));
            let found = length(&drawing(format, &output.stdout));
            assert!(
                (found - (2.0 * 160.0 + 30.0 + 20.0)).abs() < 1e-3,
                "{model} {option}: {found}"
            );
        }
    }
}

/// Both formats hold the same lines, of the length that the summary says.
#[test]
fn svg_and_dxf_are_read_again() {
    let (_guard, folder) = folder();
    let [svg, dxf] =
        ["svg", "dxf"].map(|kind| folder.join(format!("m_#.{kind}")).display().to_string());
    let model = example("miura.yaml");
    let output = run(&[
        "cut",
        &model,
        "--svg",
        &svg,
        "--dxf",
        &dxf,
        "--kerf",
        "0.1mm",
        "--perforate",
        "2mm:1mm",
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let mut names = files(&folder);
    names.sort();
    let kinds = ["dxf", "svg"];
    let layers = ["1_card", "2_polyester", "3_card"];
    let expected: Vec<_> =
        layers.iter().flat_map(|l| kinds.map(|kind| format!("m_{l}.{kind}"))).collect();
    assert_eq!(names, expected);
    for row in
        text(&output.stdout).lines().filter(|row| row.starts_with(|c: char| c.is_ascii_digit()))
    {
        let words: Vec<_> = row.split_whitespace().collect();
        let cut: f64 = words[5].parse().unwrap();
        for (kind, format) in [("svg", Format::Svg), ("dxf", Format::Dxf)] {
            let bytes = fs::read(folder.join(format!("m_{}.{kind}", words[0]))).unwrap();
            let found = length(&drawing(format, &bytes));
            assert!(
                (found - cut).abs() < 0.1,
                "{}.{kind}: {found} mm instead of {cut} mm",
                words[0]
            );
        }
    }
}

/// Without `#` one file holds all layers, also on standard output.
#[test]
fn one_file_holds_all_layers() {
    let output = run(&["cut", &example("miura.yaml"), "--svg", "-"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let svg = text(&output.stdout);
    for layer in ["1_card", "2_polyester", "3_card"] {
        assert!(svg.contains(&format!("<g id=\"{layer}\"")), "{svg}");
    }
    let lengths = 2.0 * 1840.0 + 480.0;
    assert!((length(&drawing(Format::Svg, svg.as_bytes())) - lengths).abs() < 0.1);
}

#[test]
fn what_cannot_be_cut_is_refused() {
    let (_guard, folder) = folder();
    let at = |name: &str| folder.join(name).display().to_string();
    fs::write(folder.join("swing.yaml"), SWING.replace("TORQUE", "motor")).unwrap();
    let miura = example("miura.yaml");
    fs::copy(&miura, folder.join("model.svg")).unwrap();
    for (arguments, code, words) in [
        (vec![at("swing.yaml"), "--svg".into(), at("a.svg")], 1, "the model has no plates"),
        (
            vec![miura.clone(), "--svg".into(), at("a.svg"), "--kerf=30mm".into()],
            1,
            "is larger than a piece of layer 1",
        ),
        (
            vec![miura.clone(), "--svg".into(), at("a.svg"), "--kerf=1.5mm".into()],
            1,
            "closer to each other than the kerf",
        ),
        (
            vec![miura.clone(), "--svg".into(), at("a.svg"), "--film=foil".into()],
            1,
            "of the material `foil`",
        ),
        (
            vec![miura.clone(), "--svg".into(), at("a.svg"), "--perforate=2mm".into()],
            2,
            "two lengths, as in `2mm:1mm`",
        ),
        (
            vec![miura.clone(), "--svg".into(), at("a.svg"), "--registration=0".into()],
            2,
            "must not be zero",
        ),
        (
            vec![miura.clone(), "--svg".into(), at("a.svg"), "--kerf=1s".into()],
            2,
            "expected a number",
        ),
        (vec![miura.clone(), "--svg".into(), at("a.dxf")], 2, "does not end in .svg"),
        (
            vec![at("model.svg"), "--svg".into(), at("model.svg")],
            2,
            "the input would be overwritten",
        ),
        (vec![miura.clone()], 2, "--svg"),
    ] {
        let mut all = vec!["cut"];
        all.extend(arguments.iter().map(String::as_str));
        let output = run(&all);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", text(&output.stderr));
        assert!(told(&output).contains(words), "{arguments:?}: {}", text(&output.stderr));
    }
    let mut names = files(&folder);
    names.sort();
    assert_eq!(names, ["model.svg", "swing.yaml"], "a refused cut wrote a file");
}

#[test]
fn states_are_written_for_other_programs() {
    let (_guard, folder) = folder();
    let [fold, obj, stl] =
        ["fold", "obj", "stl"].map(|kind| folder.join(format!("m.{kind}")).display().to_string());
    let model = example("miura.yaml");
    let arguments = [
        "simulate",
        &model,
        "--duration",
        "0.1",
        "--rate",
        "20",
        "--fold-out",
        &fold,
        "--obj",
        &obj,
        "--stl",
        &stl,
    ];
    let output = run(&arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let file: Value = serde_json::from_slice(&fs::read(&fold).unwrap()).unwrap();
    let count = |list: &Value| list.as_array().map_or(0, Vec::len);
    let lists = ["vertices_coords", "edges_vertices", "faces_vertices", "file_frames"];
    assert_eq!(lists.map(|key| count(&file[key])), [25, 40, 16, 3]);
    // The sheet stays whole: hinged facets agree on where their vertices are, so no edge changes its length.
    let place = |list: &Value, vertex: &Value| -> Vec<f64> {
        let at = &list[vertex.as_u64().unwrap() as usize];
        at.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let length = |list: &Value, edge: &Value| {
        let [a, b] = [0, 1].map(|end| place(list, &edge[end]));
        a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    };
    for frame in file["file_frames"].as_array().unwrap() {
        for edge in file["edges_vertices"].as_array().unwrap() {
            let [flat, folded] =
                [&file, frame].map(|frame| length(&frame["vertices_coords"], edge));
            assert!((flat - folded).abs() < 1e-9, "{edge}: {flat} m became {folded} m");
        }
    }
    assert!(fs::read_to_string(&obj).unwrap().contains("o facet_11\n"));
    let bytes = fs::read(&stl).unwrap();
    assert_eq!(
        bytes.len(),
        84 + 50 * u32::from_le_bytes(bytes[80..84].try_into().unwrap()) as usize
    );
    let overlapping =
        format!("{}/../tests/data/drawings/drawn_sarrus.cad.joints", env!("CARGO_MANIFEST_DIR"));
    let output = run(&["simulate", &overlapping, "--duration", "0.01", "--fold-out", &fold]);
    assert_eq!(output.status.code(), Some(1));
    assert!(told(&output).contains("overlap in the flat state"), "{}", text(&output.stderr));
}
