//! The sections of a DXF file: header variables, layers, blocks and entities.

use std::collections::HashMap;

use super::entity::{self, Colour, Entity, Kind};
use super::pairs::{Pair, Pairs, fault};
use crate::curve::Point;
use crate::drawing::Place;
use crate::fault::{Cause, Fault};
use crate::limits;

/// Names in lower case, each once: DXF does not tell `Cut` from `CUT`.
#[derive(Default)]
pub(super) struct Names {
    numbers: HashMap<String, usize>,
    names: Vec<String>,
}

impl Names {
    /// Returns the number of a name.
    pub(super) fn number(&mut self, name: &str) -> usize {
        let key = name.to_lowercase();
        *self.numbers.entry(key).or_insert_with(|| {
            self.names.push(name.to_string());
            self.names.len() - 1
        })
    }

    /// Returns a name as the file writes it the first time.
    pub(super) fn name(&self, number: usize) -> &str {
        &self.names[number]
    }
}

/// A layer of the table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer {
    pub colour: Colour,
    /// Off or frozen.
    pub hidden: bool,
}

/// A block.
#[derive(Default)]
pub(super) struct Block {
    pub base: Point,
    pub entities: Vec<Entity>,
}

/// What a file contains.
#[derive(Default)]
pub(super) struct File {
    /// The header variable `$INSUNITS`.
    pub units: Option<i64>,
    /// Names of layers and blocks.
    pub names: Names,
    /// Layers by the number of their name.
    pub layers: HashMap<usize, Layer>,
    /// Blocks by the number of their name.
    pub blocks: HashMap<usize, Block>,
    /// The entities of the drawing itself.
    pub entities: Vec<Entity>,
    /// Entities and vertices that are stored.
    stored: usize,
}

/// A pair with code 0 and those up to the next one.
pub(super) struct Record<'a> {
    pub kind: String,
    pub place: Place,
    pub pairs: Vec<Pair<'a>>,
}

impl<'a> Record<'a> {
    /// The first pair with a code.
    pub(super) fn find(&self, code: i32) -> Option<&Pair<'a>> {
        self.pairs.iter().find(|p| p.code == code)
    }

    /// The number of the first pair with a code.
    pub(super) fn real(&self, code: i32) -> Result<Option<f64>, Fault> {
        self.find(code).map(Pair::real).transpose()
    }

    /// The integer of the first pair with a code.
    pub(super) fn integer(&self, code: i32) -> Result<Option<i64>, Fault> {
        self.find(code).map(Pair::integer).transpose()
    }

    /// The text of the first pair with a code.
    pub(super) fn text(&self, code: i32) -> String {
        self.find(code).map(|p| entity::decoded(&p.text())).unwrap_or_default()
    }
}

/// Reads one record after the other, and reuses its memory.
struct Records<'a> {
    pairs: Pairs<'a>,
    next: Option<Pair<'a>>,
}

impl<'a> Records<'a> {
    /// Replaces a record by the next one. Returns false at the end.
    fn read(&mut self, record: &mut Record<'a>) -> Result<bool, Fault> {
        let Some(first) = self.next.take() else { return Ok(false) };
        if first.code != 0 {
            let message = format!("group {} stands where a record begins with group 0", first.code);
            return Err(fault(Cause::Syntax, message, first.place));
        }
        record.kind = first.text().to_uppercase();
        record.place = first.place;
        record.pairs.clear();
        // What follows the end is not read: some programs leave trash there.
        while record.kind != END
            && let Some(pair) = self.pairs.next()?
        {
            if pair.code == 0 {
                self.next = Some(pair);
                break;
            }
            if record.pairs.len() >= limits::PAIRS_OF_A_RECORD {
                let message = format!(
                    "this {} has more than {} groups",
                    record.kind,
                    limits::PAIRS_OF_A_RECORD
                );
                return Err(fault(Cause::Limit, message, record.place));
            }
            record.place.end = pair.place.end;
            record.pairs.push(pair);
        }
        Ok(true)
    }
}

/// The last record.
const END: &str = "EOF";

/// Where in the file a record is.
#[derive(Clone, Copy, PartialEq)]
enum Section {
    /// Before or between sections.
    Outside,
    Tables,
    Blocks,
    Entities,
    Other,
}

/// Reads a file.
///
/// # Errors
///
/// The first mistake: after it, the pairs may be out of step.
pub(super) fn parse(bytes: &[u8]) -> Result<File, Fault> {
    let mut pairs = Pairs::new(bytes);
    let next = pairs.next()?;
    let mut records = Records { pairs, next };
    let mut record = Record { kind: String::new(), place: Place::default(), pairs: Vec::new() };
    let mut file = File::default();
    let mut section = Section::Outside;
    let mut block = None;
    while records.read(&mut record)? {
        match (record.kind.as_str(), section) {
            (END, Section::Outside) => return Ok(file),
            ("SECTION", Section::Outside) => section = file.section(&record)?,
            ("ENDSEC", _) => section = Section::Outside,
            (kind, Section::Outside) => {
                return Err(fault(
                    Cause::Syntax,
                    format!("`{kind}` stands outside of sections"),
                    record.place,
                ));
            }
            ("LAYER", Section::Tables) => file.layer(&record)?,
            ("BLOCK", Section::Blocks) => block = Some(file.block(&record)?),
            ("ENDBLK", Section::Blocks) => block = None,
            (_, Section::Blocks | Section::Entities) => file.entity(&record, block)?,
            _ => (),
        }
    }
    if section == Section::Outside && file.stored > 0 {
        return Ok(file);
    }
    let place = Place { start: bytes.len(), end: bytes.len() };
    Err(Fault {
        hint: Some("the file is cut off: export it again".into()),
        ..fault(Cause::Syntax, "the file ends before its last section does".into(), place)
    })
}

impl File {
    fn section(&mut self, record: &Record) -> Result<Section, Fault> {
        Ok(match record.text(2).to_uppercase().as_str() {
            "HEADER" => {
                let variable =
                    record.pairs.iter().position(|p| p.code == 9 && p.text() == "$INSUNITS");
                let value = variable.and_then(|i| record.pairs.get(i + 1));
                self.units = value.map(Pair::integer).transpose()?;
                Section::Other
            }
            "TABLES" => Section::Tables,
            "BLOCKS" => Section::Blocks,
            "ENTITIES" => Section::Entities,
            _ => Section::Other,
        })
    }

    fn layer(&mut self, record: &Record) -> Result<(), Fault> {
        const FROZEN: i64 = 1;
        let number = self.names.number(&record.text(2));
        let index = record.integer(62)?.unwrap_or(7);
        let colour = match record.integer(420)? {
            Some(colour) => entity::true_colour(colour),
            None => entity::indexed(index),
        };
        let hidden = index < 0 || record.integer(70)?.unwrap_or(0) & FROZEN != 0;
        self.layers.insert(number, Layer { colour, hidden });
        self.store(1, record.place)
    }

    fn block(&mut self, record: &Record) -> Result<usize, Fault> {
        let number = self.names.number(&record.text(2));
        let base = [record.real(10)?.unwrap_or(0.0), record.real(20)?.unwrap_or(0.0)];
        self.blocks.insert(number, Block { base, entities: Vec::new() });
        self.store(1, record.place)?;
        Ok(number)
    }

    fn entity(&mut self, record: &Record, block: Option<usize>) -> Result<(), Fault> {
        let entities = match block {
            Some(number) => &mut self.blocks.entry(number).or_default().entities,
            None => &mut self.entities,
        };
        let size = match record.kind.as_str() {
            // The ends of polylines and of attributes.
            "SEQEND" => 0,
            // A vertex belongs to the polyline before it.
            "VERTEX" => match entities.last_mut() {
                Some(Entity { kind: Kind::Chain(chain), place, .. }) if chain.open_for_vertices => {
                    place.end = record.place.end;
                    entity::vertex(record, chain)?;
                    1
                }
                _ => 0,
            },
            _ => {
                let entity = entity::read(record, &mut self.names)?;
                let size = entity.size();
                entities.push(entity);
                size
            }
        };
        self.store(size, record.place)
    }

    fn store(&mut self, size: usize, place: Place) -> Result<(), Fault> {
        self.stored += size;
        if self.stored <= limits::STROKES {
            return Ok(());
        }
        Err(fault(
            Cause::Limit,
            format!("the file has more than {} entities and vertices", limits::STROKES),
            place,
        ))
    }
}
