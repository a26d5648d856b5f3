//! Drawings as today's programs save them, drawn by us.

use lamc_drawings::{Drawing, Format, Reading, Role, read};

fn drawing(name: &str, text: &str) -> Drawing {
    let format = Format::of(name, text.as_bytes()).unwrap();
    read(format, text.as_bytes(), &Reading::default())
        .unwrap_or_else(|faults| panic!("{name}: {faults:?}"))
}

/// Compares roles, ends to 1e-9, target angles in degrees, the unit, and what is ignored.
fn check(
    name: &str,
    text: &str,
    unit: Option<f64>,
    lines: &[(Role, [f64; 4], Option<f64>)],
    ignored: &[(&str, usize)],
) {
    let found = drawing(name, text);
    assert_eq!(found.strokes.len(), lines.len(), "{name}: {:?}", found.strokes);
    for (stroke, (role, ends, fold)) in found.strokes.iter().zip(lines) {
        let near = |a: &f64, b: &f64| (a - b).abs() < 1e-9;
        let same = stroke.ends.as_flattened().iter().zip(ends).all(|(a, b)| near(a, b));
        let angle = stroke.fold.map(f64::to_degrees);
        assert!(stroke.role == *role && same, "{name}: {stroke:?} is not {role:?} {ends:?}");
        assert!(
            angle.is_some() == fold.is_some() && angle.zip(*fold).is_none_or(|(a, b)| near(&a, &b)),
            "{name}: {angle:?}"
        );
        let source = &text[stroke.place.start..stroke.place.end];
        assert!(source.starts_with(['<', 'L', 'A', 'C']), "{name}: a place is {source}");
    }
    let listed: Vec<_> = found.ignored.iter().map(|i| (i.what.as_str(), i.count)).collect();
    assert_eq!((found.unit, listed.as_slice()), (unit, ignored), "{name}");
}

/// Inkscape 1: millimetres, layers (one hidden), text, a clone, a path without stroke, and a guide.
const INKSCAPE: &str = r##"<?xml version="1.0" encoding="UTF-8" standalone="no"?>
<!-- Created with Inkscape (http://www.inkscape.org/) -->
<svg width="80mm" height="60mm" viewBox="0 0 80 60" version="1.1" id="svg1"
   inkscape:version="1.3" sodipodi:docname="flap.svg"
   xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"
   xmlns:sodipodi="http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"
   xmlns:xlink="http://www.w3.org/1999/xlink"
   xmlns="http://www.w3.org/2000/svg">
  <sodipodi:namedview id="namedview1" pagecolor="#ffffff" inkscape:document-units="mm">
    <sodipodi:guide position="40,30" orientation="0,-1" id="guide1" />
  </sodipodi:namedview>
  <defs id="defs1"><linearGradient id="linearGradient1" /></defs>
  <g inkscape:label="Sheet" inkscape:groupmode="layer" id="layer1" transform="translate(10,10)">
    <rect style="fill:#ffffff;stroke:#000000;stroke-width:0.264583" id="rect1" width="40" height="20" x="0" y="0" />
    <path style="fill:none;stroke:#ff0000;stroke-width:0.264583px;stroke-opacity:0.5" d="M 20,0 V 20" id="path1" />
    <use x="0" y="0" xlink:href="#path1" id="use1" transform="translate(10)" />
    <text xml:space="preserve" style="font-size:3.17px;fill:#000000" x="2" y="4" id="text1"><tspan
         sodipodi:role="line" id="tspan1" x="2" y="4">flap</tspan></text>
    <path style="fill:#cccccc" d="m 1,1 h 2 v 2 z" id="path2" />
  </g>
  <g inkscape:groupmode="layer" id="layer2" inkscape:label="Notes" style="display:none">
    <path style="stroke:#0000ff" d="M 0,0 80,60" id="path3" />
  </g>
  <g inkscape:groupmode="layer" id="layer3" inkscape:label="Cuts" style="display:inline" sodipodi:insensitive="true">
    <path style="fill:none;stroke:#00ff00" id="path4" d="m 15,15 c 0,0 5,0 5,0" sodipodi:nodetypes="cc" />
  </g>
</svg>
"##;

/// Illustrator: entities, a `switch` with data of its own, classes, and colours of print.
const ILLUSTRATOR: &str = r##"<?xml version="1.0" encoding="utf-8"?>
<!-- Generator: Adobe Illustrator 27.0, SVG Export Plug-In . SVG Version: 6.00 Build 0)  -->
<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd" [
	<!ENTITY ns_extend "http://ns.adobe.com/Extensibility/1.0/">
	<!ENTITY ns_ai "http://ns.adobe.com/AdobeIllustrator/10.0/">
]>
<svg version="1.1" id="Layer_1" xmlns:x="&ns_extend;" xmlns:i="&ns_ai;" xmlns="http://www.w3.org/2000/svg"
	 x="0px" y="0px" viewBox="0 0 612 792" style="enable-background:new 0 0 612 792;" xml:space="preserve">
<style type="text/css">
	.st0{fill:none;stroke:#231F20;stroke-miterlimit:10;}
	.st1,.st2{fill:none;stroke:#ED1C24;stroke-miterlimit:10;}
	.st2{stroke:#2E3192;opacity:0.25;}
	.st3{font-family:'MyriadPro-Regular';}
</style>
<switch>
	<foreignObject requiredExtensions="&ns_ai;" x="0" y="0" width="1" height="1"><i:pgfRef/></foreignObject>
	<g i:extraneous="self">
		<polygon class="st0" points="100.5,100 200.5,100 200.5,200 100.5,200 		"/>
		<line class="st1" x1="100.5" y1="100" x2="200.5" y2="200"/>
		<g><line class="st2" x1="200.5" y1="100" x2="100.5" y2="200"/></g>
		<text transform="matrix(1 0 0 1 90 90)" class="st3">a</text>
	</g>
</switch>
</svg>
"##;

#[test]
fn inkscape() {
    let border = |a, b, c, d| (Role::Border, [a, b, c, d], None);
    let mountain = |x: f64| (Role::Mountain, [x, -10.0, x, -30.0], Some(-90.0));
    let lines = [
        border(10.0, -10.0, 50.0, -10.0),
        border(50.0, -10.0, 50.0, -30.0),
        border(50.0, -30.0, 10.0, -30.0),
        border(10.0, -30.0, 10.0, -10.0),
        mountain(30.0),
        mountain(40.0),
        (Role::Cut, [15.0, -15.0, 20.0, -15.0], None),
    ];
    let ignored = [
        ("linearGradient", 1),
        ("text", 1),
        ("path without stroke", 1),
        ("g with display:none", 1),
    ];
    check("inkscape.svg", INKSCAPE, Some(1e-3), &lines, &ignored);
}

#[test]
fn illustrator() {
    let lines = [
        (Role::Border, [100.5, -100.0, 200.5, -100.0], None),
        (Role::Border, [200.5, -100.0, 200.5, -200.0], None),
        (Role::Border, [200.5, -200.0, 100.5, -200.0], None),
        (Role::Border, [100.5, -200.0, 100.5, -100.0], None),
        (Role::Mountain, [100.5, -100.0, 200.5, -200.0], None),
        (Role::Valley, [200.5, -100.0, 100.5, -200.0], Some(45.0)),
    ];
    check("illustrator.svg", ILLUSTRATOR, None, &lines, &[("text", 1)]);
}

/// AutoCAD's layout of pairs: codes in three columns, handles, owners and subclass markers; a comment by us.
const AUTOCAD: &str = "999\nby hand\n  0\nSECTION\n  2\nHEADER\n  9\n$ACADVER\n  1\nAC1015\n  9\n$INSUNITS\n 70\n     5\n  0\nENDSEC\n\
  0\nSECTION\n  2\nTABLES\n  0\nTABLE\n  2\nLAYER\n  5\n2\n330\n0\n100\nAcDbSymbolTable\n 70\n     2\n\
  0\nLAYER\n  5\n10\n330\n2\n100\nAcDbSymbolTableRecord\n100\nAcDbLayerTableRecord\n  2\n0\n 70\n     0\n 62\n     7\n  6\nContinuous\n\
  0\nLAYER\n  5\n2D\n330\n2\n100\nAcDbSymbolTableRecord\n100\nAcDbLayerTableRecord\n  2\nNotes\n 70\n     1\n 62\n     1\n  6\nContinuous\n\
  0\nENDTAB\n  0\nENDSEC\n  0\nSECTION\n  2\nENTITIES\n\
  0\nLINE\n  5\n3A\n330\n1F\n100\nAcDbEntity\n  8\n0\n 62\n     5\n100\nAcDbLine\n 10\n1.5\n 20\n2.25\n 30\n0.0\n 11\n-4.0\n 21\n1e1\n 31\n0.0\n\
  0\nMTEXT\n  5\n3B\n100\nAcDbEntity\n  8\n0\n100\nAcDbMText\n 10\n0.0\n 20\n0.0\n  1\nflap\n\
  0\nLINE\n  5\n3C\n100\nAcDbEntity\n  8\nNotes\n100\nAcDbLine\n 10\n0.0\n 20\n0.0\n 11\n1.0\n 21\n0.0\n\
  0\nENDSEC\n  0\nSECTION\n  2\nOBJECTS\n  0\nDICTIONARY\n  5\nC\n  0\nENDSEC\n  0\nEOF\n";

#[test]
fn autocad() {
    let lines = [(Role::Valley, [1.5, 2.25, -4.0, 10.0], None)];
    check(
        "autocad.dxf",
        AUTOCAD,
        Some(0.01),
        &lines,
        &[("MTEXT", 1), ("LINE on hidden layer Notes", 1)],
    );
    check(
        "autocad.dxf",
        &AUTOCAD.replace('\n', "\r\n"),
        Some(0.01),
        &lines,
        &[("MTEXT", 1), ("LINE on hidden layer Notes", 1)],
    );
}
