//! Writes closed outlines as DXF of AutoCAD 2000 (AC1015), the first release with LWPOLYLINE and `$INSUNITS`, and one that
//! every program reads. AutoCAD refuses a file of this release without handles, owners, and these tables, blocks and dictionaries.

use std::fmt::Display;

/// Writes closed outlines, holes included, on named layers.
///
/// An outline of two points is a line. Coordinates are finite numbers in units of `unit` metres; the file is in
/// millimetres. Outlines with less than two points are left out. Characters that DXF forbids in names of layers
/// become `_`.
pub fn write(layers: &[(String, Vec<Vec<[f64; 2]>>)], unit: f64) -> String {
    let scale = unit / MILLIMETRE;
    let mut names: Vec<String> = layers.iter().map(|(name, _)| layer_name(name)).collect();
    let mut out = Output { text: String::new(), handle: FIRST_FREE };
    let mut body = Output { text: String::new(), handle: FIRST_FREE + names.len() + OF_TABLES };
    for (name, (_, outlines)) in names.iter().zip(layers) {
        outlines
            .iter()
            .filter(|points| points.len() > 1)
            .for_each(|points| body.outline(name, points, scale));
    }
    names.sort();
    names.dedup();
    out.header(layers, scale, body.handle);
    out.tables(&names);
    out.blocks();
    out.section("ENTITIES");
    out.text.push_str(&body.text);
    out.end();
    out.objects();
    out.text.push_str("0\nEOF\n");
    out.text
}

/// The length of the unit of the file, m.
const MILLIMETRE: f64 = 1e-3;

/// Handles, in hexadecimal in the file, that others refer to.
const MODEL_SPACE: usize = 0x1f;
const PAPER_SPACE: usize = 0x1b;
const ROOT: usize = 0xc;
const GROUPS: usize = 0xd;

/// Handles of tables come before, those of what is in them from here on.
const FIRST_FREE: usize = 0x100;

/// More handles than tables and blocks without layers need.
const OF_TABLES: usize = 0x100;

struct Output {
    text: String,
    /// The next free handle.
    handle: usize,
}

impl Output {
    fn pair(&mut self, code: u16, value: impl Display) {
        self.text.push_str(&format!("{code}\n{value}\n"));
    }

    fn pairs(&mut self, pairs: &[(u16, &str)]) {
        pairs.iter().for_each(|(code, value)| self.pair(*code, value));
    }

    fn reals(&mut self, code: u16, values: &[f64]) {
        for (i, value) in (0..).zip(values) {
            self.pair(code + 10 * i, number(*value));
        }
    }

    fn section(&mut self, name: &str) {
        self.pairs(&[(0, "SECTION"), (2, name)]);
    }

    fn end(&mut self) {
        self.pair(0, "ENDSEC");
    }

    fn header(&mut self, layers: &[(String, Vec<Vec<[f64; 2]>>)], scale: f64, next_handle: usize) {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in layers.iter().flat_map(|(_, outlines)| outlines).flatten() {
            for i in 0..2 {
                low[i] = low[i].min(point[i] * scale);
                high[i] = high[i].max(point[i] * scale);
            }
        }
        self.section("HEADER");
        self.pairs(&[(9, "$ACADVER"), (1, "AC1015"), (9, "$HANDSEED")]);
        self.pair(5, hexadecimal(next_handle));
        // 4: millimetres; 1: metric line types.
        self.pairs(&[(9, "$INSUNITS"), (70, "4"), (9, "$MEASUREMENT"), (70, "1")]);
        if low[0] <= high[0] {
            self.pair(9, "$EXTMIN");
            self.reals(10, &[low[0], low[1], 0.0]);
            self.pair(9, "$EXTMAX");
            self.reals(10, &[high[0], high[1], 0.0]);
        }
        self.end();
        self.section("CLASSES");
        self.end();
    }

    fn tables(&mut self, layers: &[String]) {
        self.section("TABLES");
        self.table("VPORT", 0x8, 0);
        self.table_end();
        self.table("LTYPE", 0x5, 3);
        for name in ["ByBlock", "ByLayer", "Continuous"] {
            self.entry("LTYPE", 0x5, "AcDbLinetypeTableRecord", name);
            self.pairs(&[(70, "0"), (3, ""), (72, "65"), (73, "0"), (40, "0.0")]);
        }
        self.table_end();
        let own = layers.iter().filter(|name| *name != "0");
        self.table("LAYER", 0x2, own.clone().count() + 1);
        for name in std::iter::once("0").chain(own.map(String::as_str)) {
            self.entry("LAYER", 0x2, "AcDbLayerTableRecord", name);
            self.pairs(&[(70, "0"), (62, "7"), (6, "Continuous")]);
        }
        self.table_end();
        self.table("STYLE", 0x3, 1);
        self.entry("STYLE", 0x3, "AcDbTextStyleTableRecord", "Standard");
        self.pairs(&[
            (70, "0"),
            (40, "0.0"),
            (41, "1.0"),
            (50, "0.0"),
            (71, "0"),
            (42, "2.5"),
            (3, "txt"),
            (4, ""),
        ]);
        self.table_end();
        self.table("VIEW", 0x6, 0);
        self.table_end();
        self.table("UCS", 0x7, 0);
        self.table_end();
        self.table("APPID", 0x9, 1);
        self.entry("APPID", 0x9, "AcDbRegAppTableRecord", "ACAD");
        self.pair(70, 0);
        self.table_end();
        self.table("DIMSTYLE", 0xa, 0);
        self.pairs(&[(100, "AcDbDimStyleTable"), (71, "0")]);
        self.table_end();
        self.table("BLOCK_RECORD", 0x1, 2);
        for (name, handle) in [("*Model_Space", MODEL_SPACE), ("*Paper_Space", PAPER_SPACE)] {
            self.entry_with("BLOCK_RECORD", 0x1, "AcDbBlockTableRecord", name, handle);
        }
        self.table_end();
        self.end();
    }

    fn table(&mut self, name: &str, handle: usize, entries: usize) {
        self.pairs(&[(0, "TABLE"), (2, name)]);
        self.pair(5, hexadecimal(handle));
        self.pairs(&[(330, "0"), (100, "AcDbSymbolTable")]);
        self.pair(70, entries);
    }

    fn table_end(&mut self) {
        self.pair(0, "ENDTAB");
    }

    fn entry(&mut self, kind: &str, table: usize, class: &str, name: &str) {
        let handle = self.next();
        self.entry_with(kind, table, class, name, handle);
    }

    fn entry_with(&mut self, kind: &str, table: usize, class: &str, name: &str, handle: usize) {
        self.pair(0, kind);
        self.pair(5, hexadecimal(handle));
        self.pair(330, hexadecimal(table));
        self.pairs(&[(100, "AcDbSymbolTableRecord"), (100, class), (2, name)]);
    }

    fn blocks(&mut self) {
        self.section("BLOCKS");
        for (name, record) in [("*Model_Space", MODEL_SPACE), ("*Paper_Space", PAPER_SPACE)] {
            for (kind, class) in [("BLOCK", "AcDbBlockBegin"), ("ENDBLK", "AcDbBlockEnd")] {
                let handle = self.next();
                self.pair(0, kind);
                self.pair(5, hexadecimal(handle));
                self.pair(330, hexadecimal(record));
                self.pairs(&[(100, "AcDbEntity"), (8, "0"), (100, class)]);
                if kind == "BLOCK" {
                    self.pairs(&[
                        (2, name),
                        (70, "0"),
                        (10, "0.0"),
                        (20, "0.0"),
                        (30, "0.0"),
                        (3, name),
                        (1, ""),
                    ]);
                }
            }
        }
        self.end();
    }

    fn outline(&mut self, layer: &str, points: &[[f64; 2]], scale: f64) {
        let handle = self.next();
        self.pair(0, "LWPOLYLINE");
        self.pair(5, hexadecimal(handle));
        self.pair(330, hexadecimal(MODEL_SPACE));
        self.pairs(&[(100, "AcDbEntity"), (8, layer), (100, "AcDbPolyline")]);
        self.pair(90, points.len());
        // 1: the last point is joined to the first. There and back again, a laser would cut a line twice.
        self.pair(70, u8::from(points.len() > 2));
        points.iter().for_each(|point| self.reals(10, &point.map(|x| x * scale)));
    }

    fn objects(&mut self) {
        self.section("OBJECTS");
        self.dictionary(ROOT, 0);
        self.pair(3, "ACAD_GROUP");
        self.pair(350, hexadecimal(GROUPS));
        self.dictionary(GROUPS, ROOT);
        self.end();
    }

    fn dictionary(&mut self, handle: usize, owner: usize) {
        self.pair(0, "DICTIONARY");
        self.pair(5, hexadecimal(handle));
        self.pair(330, hexadecimal(owner));
        self.pairs(&[(100, "AcDbDictionary"), (281, "1")]);
    }

    fn next(&mut self) -> usize {
        self.handle += 1;
        self.handle - 1
    }
}

fn hexadecimal(handle: usize) -> String {
    format!("{handle:X}")
}

/// The shortest number that reads as the same bits, with a point.
fn number(value: f64) -> String {
    let text = value.to_string();
    if text.contains('.') { text } else { format!("{text}.0") }
}

/// A name without forbidden characters; what is not ASCII is written as `\U+00E4`, as AutoCAD does.
fn layer_name(name: &str) -> String {
    let mut found = String::new();
    for c in name.chars() {
        match c {
            '<' | '>' | '/' | '\\' | '"' | ':' | ';' | '?' | '*' | '|' | '=' | '`' | ',' => {
                found.push('_')
            }
            c if c.is_control() => found.push('_'),
            c if c.is_ascii() => found.push(c),
            c => c
                .encode_utf16(&mut [0; 2])
                .iter()
                .for_each(|unit| found.push_str(&format!("\\U+{unit:04X}"))),
        }
    }
    let trimmed = found.trim();
    if trimmed.is_empty() { "0".into() } else { trimmed.to_string() }
}
