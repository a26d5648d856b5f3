//! Files that want to harm: each gives an error or a drawing, quickly, and never a panic.

use std::fmt::Write;
use std::time::{Duration, Instant};

use lamc_drawings::{Cause, Drawing, Fault, Format, Reading, dxf, read};

/// What a hostile file may take: 2 s, and as much again because tests share the machine.
const QUICK: Duration = Duration::from_secs(4);

const HEAD: &str = "<svg xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink' stroke='red'>";

fn timed(format: Format, bytes: &[u8]) -> Result<Drawing, Vec<Fault>> {
    let start = Instant::now();
    let found = read(format, bytes, &Reading::default());
    let (took, head) = (start.elapsed(), String::from_utf8_lossy(&bytes[..bytes.len().min(100)]));
    assert!(took < QUICK, "{took:?} for {} bytes: {head}", bytes.len());
    for place in found.iter().flat_map(|d| &d.strokes).map(|s| s.place) {
        assert!(place.start <= place.end && place.end <= bytes.len(), "{place:?} is not in {head}");
    }
    for fault in found.iter().flat_map(|_| None).chain(found.as_ref().err().into_iter().flatten()) {
        assert!(
            fault.place.is_none_or(|p| p.start <= p.end && p.end <= bytes.len()),
            "{fault:?} is not in {head}"
        );
    }
    found
}

fn refuse(text: &str, cause: Cause) {
    match timed(Format::Svg, text.as_bytes()) {
        Ok(_) => panic!("{} is read", &text[..text.len().min(200)]),
        Err(faults) => assert_eq!(faults[0].cause, cause, "{}", faults[0].message),
    }
}

fn lines(count: usize, line: impl Fn(usize) -> String) -> String {
    (0..count).fold(String::new(), |text, i| text + &line(i))
}

#[test]
fn bombs_of_entities() {
    let mut laughs = "<!DOCTYPE svg [<!ENTITY a0 'ha'>".to_string();
    for i in 1..12 {
        write!(laughs, "<!ENTITY a{i} '{}'>", format!("&a{};", i - 1).repeat(10)).unwrap();
    }
    refuse(&format!("{laughs}]>{HEAD}<text>&a11;</text></svg>"), Cause::Limit);
    let quadratic = format!(
        "<!DOCTYPE svg [<!ENTITY a '{}'>]>{HEAD}{}</svg>",
        "x".repeat(1 << 20),
        "&a;".repeat(1 << 20)
    );
    refuse(&quadratic, Cause::Limit);
    let markup = "<!DOCTYPE svg [<!ENTITY a '<g><g>'>]>";
    refuse(&format!("{markup}{HEAD}&a;</svg>"), Cause::Limit);
}

#[test]
fn deep_and_wide_trees() {
    for depth in [10_000, 200_000] {
        refuse(
            &format!("{HEAD}{}<line x2='1'/>{}</svg>", "<g>".repeat(depth), "</g>".repeat(depth)),
            Cause::Limit,
        );
        refuse(&format!("{HEAD}{}", "<g>".repeat(depth)), Cause::Syntax);
    }
    let attributes = lines(100_000, |i| format!(" a{i}=''"));
    refuse(&format!("{HEAD}<g{attributes}/></svg>"), Cause::Limit);
    let namespaces = lines(20_000, |i| format!("<g xmlns:a{i}='{i}'>"));
    refuse(&format!("{HEAD}{namespaces}"), Cause::Limit);
    refuse(&format!("{HEAD}{}</svg>", "<g/>".repeat(600_000)), Cause::Limit);
    refuse(&format!("{HEAD}<path d='M0 0{}'/></svg>", "h1".repeat(1_100_000)), Cause::Limit);
    refuse(
        &format!("{HEAD}<path d='M0 0{}'/></svg>", "c1 2 3 4 5 6".repeat(1_100_000)),
        Cause::Limit,
    );
}

#[test]
fn clones_without_end() {
    refuse(&format!("{HEAD}<g id='a'><use href='#a'/></g></svg>"), Cause::Syntax);
    refuse(
        &format!("{HEAD}<use id='a' xlink:href='#b'/><use id='b' xlink:href='#a'/></svg>"),
        Cause::Syntax,
    );
    let bomb =
        lines(30, |i| format!("<g id='a{}'><use href='#a{i}'/><use href='#a{i}'/></g>", i + 1));
    refuse(&format!("{HEAD}<g id='a0'/>{bomb}</svg>"), Cause::Limit);
    refuse(&format!("{HEAD}<path id='a0' d='M0 0h1'/>{bomb}</svg>"), Cause::Limit);
    let long = "M0 0".repeat(100_000);
    let uses = "<use href='#a'/>".repeat(100_000);
    refuse(&format!("{HEAD}<path id='a' d='{long}'/>{uses}</svg>"), Cause::Limit);
}

#[test]
fn style_sheets_that_take_long() {
    let nested = format!("<style>{} x{{stroke:red}}</style>", "g ".repeat(14));
    let deep = format!("{}<line x2='1'/>{}", "<g>".repeat(150), "</g>".repeat(150));
    let _: Result<_, _> =
        timed(Format::Svg, format!("{HEAD}{nested}{}</svg>", deep.repeat(300)).as_bytes());
    let rules = lines(20_000, |_| "*.a{stroke:red}".into());
    let classes = "<line class='a' x2='1'/>".repeat(20_000);
    refuse(&format!("{HEAD}<style>{rules}</style>{classes}</svg>"), Cause::Limit);
    let list =
        format!("<style>{}b{{{}}}</style>", "a,".repeat(15_000), "stroke:red;".repeat(100_000));
    let _: Result<_, _> =
        timed(Format::Svg, format!("{HEAD}{list}<line x2='1'/></svg>").as_bytes());
    refuse(&format!("{HEAD}<style>{}</style></svg>", "a{}".repeat(100_000)), Cause::Limit);
    refuse(&format!("{HEAD}<style>{}</style></svg>", "a".repeat(3 << 20)), Cause::Limit);
}

#[test]
fn numbers_that_are_none() {
    for number in [
        "NaN",
        "inf",
        "-Infinity",
        "1e309",
        "1e300",
        "-1e10",
        "0x10",
        "1e",
        "--1",
        "9".repeat(400).as_str(),
    ] {
        refuse(&format!("{HEAD}<line x2='{number}'/></svg>"), Cause::Number);
        refuse(&format!("{HEAD}<circle r='5' cx='{number}'/></svg>"), Cause::Number);
        let text = format!("0\nSECTION\n2\nENTITIES\n0\nLINE\n11\n{number}\n0\nENDSEC\n0\nEOF\n");
        assert_eq!(
            timed(Format::Dxf, text.as_bytes()).unwrap_err()[0].cause,
            Cause::Number,
            "{number}"
        );
    }
    // Twice in one element, once for each of two.
    let faults = |text: &str| timed(Format::Svg, text.as_bytes()).unwrap_err().len();
    assert_eq!(faults(&format!("{HEAD}<path d='M0 0H1e10V1e10'/><path d='M0 0H1e11'/></svg>")), 2);
    let tiny = Reading { flatness: Some(1e-300), ..Reading::default() };
    for shape in ["<circle r='1e8'/>", "<path d='M0 0C0 1e8 1e8 1e8 1e8 0'/>"] {
        let start = Instant::now();
        let faults =
            read(Format::Svg, format!("{HEAD}{shape}</svg>").as_bytes(), &tiny).unwrap_err();
        assert!(
            faults[0].cause == Cause::Limit && start.elapsed() < QUICK,
            "{faults:?} in {:?}",
            start.elapsed()
        );
    }
}

/// Arcs of huge circles, and curves smaller than the last digit of their coordinates.
#[test]
fn curves_at_the_limits_of_numbers() {
    let arc = |radius: &str| format!("{HEAD}<path d='M0 0A{radius} {radius} 0 0 1 100 7'/></svg>");
    refuse(&arc("1e200"), Cause::Number);
    for radius in ["1e13", "1e15", "1e17", "1e100"] {
        let path = arc(radius);
        let ends: Vec<_> =
            timed(Format::Svg, path.as_bytes()).unwrap().strokes.iter().map(|s| s.ends).collect();
        assert_eq!(ends, [[[0.0, 0.0], [100.0, -7.0]]], "{radius}");
    }
    // Its points are one point.
    refuse(&format!("{HEAD}<circle cx='1e8' cy='1e8' r='1e-9'/></svg>"), Cause::Empty);
    let bulge = |bulge: &str| {
        let line = format!("0\nLWPOLYLINE\n10\n0\n20\n0\n42\n{bulge}\n10\n1\n20\n1\n");
        timed(Format::Dxf, format!("0\nSECTION\n2\nENTITIES\n{line}0\nENDSEC\n0\nEOF\n").as_bytes())
    };
    assert_eq!(bulge("1e-5").unwrap().strokes.len(), 1);
    assert_eq!(bulge("1e20").unwrap_err()[0].cause, Cause::Number);
    assert_eq!(bulge("1e300").unwrap_err()[0].cause, Cause::Number);
}

#[test]
fn integers_at_their_limits() {
    let line = |pairs: &str| format!("0\nLINE\n8\n0\n{pairs}10\n0\n11\n1\n");
    for code in [60, 62, 67, 70, 420] {
        for number in [i64::MIN, i64::MAX] {
            let pair = format!("{code}\n{number}\n");
            let layer = format!("0\nTABLE\n2\nLAYER\n0\nLAYER\n2\n0\n{pair}0\nENDTAB\n");
            let text = format!(
                "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n{number}\n0\nENDSEC\n0\nSECTION\n2\nTABLES\n{layer}0\nENDSEC\n\
                 0\nSECTION\n2\nENTITIES\n{}0\nENDSEC\n0\nEOF\n",
                line(&pair)
            );
            if let Ok(drawing) = timed(Format::Dxf, text.as_bytes()) {
                assert_eq!(drawing.unit, None, "{text}");
            }
        }
    }
}

/// A small file with a bit of everything.
const SVG: &str = "<?xml version='1.0'?><!DOCTYPE svg [<!ENTITY e 'red'>]>\
    <svg xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink' width='20mm' viewBox='0 0 20 20'>\
    <style>.m{stroke:red}g > .v{stroke:blue !important}</style><!-- c --><defs><path id='p' d='M0 0h1'/></defs>\
    <g transform='translate(1,2) rotate(30)' opacity='.5'><line class='m' x2='5mm'/><use class='v' xlink:href='#p' x='3'/></g>\
    <path stroke='#000' d='M0 0L5,5c1 2 3 4-5 6s1 2 3 4q1 2 3 4t1 2a1 2 30 0 1 3 4z'/><text>&e;&#228;</text>\
    <rect stroke='lime' width='3' height='4' rx='1'/><polygon stroke='hsl(60,100%,50%)' points='1,2 3,4 5,0'/></svg>";

/// The same for DXF; words are `code=value`.
fn dxf_text() -> String {
    let words = "0=SECTION 2=HEADER 9=$INSUNITS 70=4 0=ENDSEC 0=SECTION 2=TABLES 0=LAYER 2=cut 62=1 70=0 0=ENDSEC \
        0=SECTION 2=BLOCKS 0=BLOCK 2=B 10=1 20=1 0=LINE 8=0 10=0 20=0 11=1 21=0 0=ENDBLK 0=ENDSEC \
        0=SECTION 2=ENTITIES 0=LWPOLYLINE 8=cut 70=1 10=0 20=0 42=0.5 10=4 20=0 10=4 20=4 0=INSERT 2=B 41=2 50=30 70=2 44=5 \
        0=ARC 10=0 20=0 40=2 50=30 51=60 0=ELLIPSE 10=0 20=0 11=3 21=0 40=0.5 41=0 42=3 0=CIRCLE 10=1 20=1 40=1 \
        0=SPLINE 71=2 40=0 40=0 40=0 40=1 40=1 40=1 41=1 41=2 41=1 10=0 20=0 10=1 20=1 10=2 20=0 \
        0=POLYLINE 66=1 0=VERTEX 10=0 20=0 0=VERTEX 10=1 20=1 0=SEQEND 0=TEXT 1=x 0=ENDSEC 0=EOF";
    words.split_whitespace().map(|word| word.replacen('=', "\n", 1) + "\n").collect()
}

/// As binary, of the text's pairs.
fn dxf_binary(text: &str) -> Vec<u8> {
    let mut bytes = b"AutoCAD Binary DXF\r\n\x1a\0".to_vec();
    let lines: Vec<&str> = text.lines().collect();
    for pair in lines.chunks_exact(2) {
        let code: i16 = pair[0].parse().unwrap();
        bytes.extend(code.to_le_bytes());
        match code {
            0..=9 => bytes.extend([pair[1].as_bytes(), b"\0"].concat()),
            10..=59 => bytes.extend(pair[1].parse::<f64>().unwrap().to_le_bytes()),
            _ => bytes.extend(pair[1].parse::<i16>().unwrap().to_le_bytes()),
        }
    }
    bytes
}

fn samples() -> Vec<(Format, Vec<u8>)> {
    let text = dxf_text();
    let written =
        dxf::write(&[("cut".into(), vec![vec![[0.0, 0.0], [1.0, 0.0], [0.5, 1.5]]])], 1e-3);
    vec![
        (Format::Svg, SVG.into()),
        (Format::Dxf, dxf_binary(&text)),
        (Format::Dxf, text.into()),
        (Format::Dxf, written.into()),
    ]
}

#[test]
fn text_and_binary_are_the_same_drawing() {
    let [_, (_, binary), (_, text), _] = samples().try_into().unwrap();
    let ends = |bytes: &[u8]| -> Vec<_> {
        timed(Format::Dxf, bytes).unwrap().strokes.iter().map(|s| s.ends).collect()
    };
    assert_eq!(ends(&binary), ends(&text));
}

#[test]
fn files_that_are_cut_off() {
    for (format, whole) in samples() {
        let complete = timed(format, &whole).unwrap().strokes;
        for length in 0..whole.len() {
            // What is cut off after the last line of the pattern does no harm.
            if let Ok(found) = timed(format, &whole[..length]) {
                assert_eq!(found.strokes, complete, "{length} bytes of {} are read", whole.len());
            }
        }
    }
}

/// SplitMix64: Steele, Lea, Flood 2014.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        usize::try_from((z ^ (z >> 31)) % bound as u64).unwrap()
    }
}

#[test]
fn random_changes() {
    const PIECES: [&str; 24] = [
        "<", ">", "'", "\"", "&", ";", "/", "{", "}", "e", "-", ".", "1e999", "nan", "0", " ",
        "\n", "(", ")", "#", ",", "ä", "\0", "*",
    ];
    let mut random = Random(17);
    let (mut drawings, mut errors) = (0, 0);
    for (format, whole) in samples() {
        for _ in 0..5000 {
            let mut bytes = whole.clone();
            for _ in 0..=random.below(4) {
                let at = random.below(bytes.len());
                let end = (at + random.below(8)).min(bytes.len());
                match random.below(5) {
                    0 => drop(bytes.drain(at..end)),
                    1 => bytes[at] = u8::try_from(random.below(256)).unwrap(),
                    2 => bytes.truncate(at + 1),
                    3 => {
                        let copy = bytes[at..end].to_vec();
                        let to = random.below(bytes.len());
                        drop(bytes.splice(to..to, copy));
                    }
                    _ => drop(bytes.splice(at..at, PIECES[random.below(PIECES.len())].bytes())),
                }
                if bytes.is_empty() {
                    break;
                }
            }
            match timed(format, &bytes) {
                Ok(_) => drawings += 1,
                Err(_) => errors += 1,
            }
        }
    }
    assert!(
        drawings > 1000 && errors > 1000,
        "{drawings} drawings, {errors} errors: the changes are too weak or too strong"
    );
}

#[test]
fn a_hundred_thousand_honest_lines() {
    let end = |i: usize| ((i % 300) as f64 * 1.37, (i / 300) as f64 * 2.11);
    let svg_line = |i| {
        let (x, y) = end(i);
        format!(
            "<line class=\"m\" fill=\"none\" stroke=\"#FF0000\" stroke-width=\"0.5\" x1=\"{x}\" y1=\"{y}\" x2=\"{}\" y2=\"{y}\"/>\n",
            x + 1.0
        )
    };
    let svg: String = (0..100_000).map(svg_line).collect();
    let svg = format!("{HEAD}<style>.m{{stroke:blue}}</style>{svg}</svg>");
    assert_eq!(timed(Format::Svg, svg.as_bytes()).unwrap().strokes.len(), 100_000);
    let dxf_line = |i| {
        let (x, y) = end(i);
        format!(
            "  0\nLINE\n  5\n{i:X}\n100\nAcDbEntity\n  8\nfolds\n 62\n1\n100\nAcDbLine\n 10\n{x}\n 20\n{y}\n 30\n0.0\n 11\n{}\n 21\n{y}\n 31\n0.0\n",
            x + 1.0
        )
    };
    let dxf: String = (0..100_000).map(dxf_line).collect();
    let dxf = format!("0\nSECTION\n2\nENTITIES\n{dxf}0\nENDSEC\n0\nEOF\n");
    assert_eq!(timed(Format::Dxf, dxf.as_bytes()).unwrap().strokes.len(), 100_000);
}
