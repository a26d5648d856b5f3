//! Rows of runs as Parquet: columns with units, and row groups.

use std::collections::HashMap;
use std::io::{self, Write};
use std::sync::Arc;

use arrow_array::builder::{Float64Builder, ListBuilder};
use arrow_array::{ArrayRef, BooleanArray, Float64Array, RecordBatch, StringArray, UInt64Array};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use parquet::arrow::ArrowWriter;
use parquet::basic::Compression;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;

/// A column of numbers, flags, texts or lists of numbers, in which a cell may be empty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// The unit of its numbers, in SI.
    unit: &'static str,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Index,
    Number,
    Flag,
    Text,
    Series,
}

/// A cell of a row.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// The number of a run.
    Index(u64),
    /// A number.
    Number(Option<f64>),
    /// Yes or no.
    Flag(Option<bool>),
    /// A text.
    Text(Option<String>),
    /// A list of numbers.
    Series(Option<Vec<f64>>),
}

impl Cell {
    /// A number.
    pub fn number(number: f64) -> Self {
        Self::Number(Some(number))
    }
}

impl Column {
    /// The numbers of runs.
    pub fn index(name: impl Into<String>) -> Self {
        Self { name: name.into(), unit: "", kind: Kind::Index }
    }

    /// Numbers in a unit.
    pub fn number(name: impl Into<String>, unit: &'static str) -> Self {
        Self { name: name.into(), unit, kind: Kind::Number }
    }

    /// Yes or no.
    pub fn flag(name: impl Into<String>) -> Self {
        Self { name: name.into(), unit: "", kind: Kind::Flag }
    }

    /// Texts.
    pub fn text(name: impl Into<String>) -> Self {
        Self { name: name.into(), unit: "", kind: Kind::Text }
    }

    /// Lists of numbers in a unit.
    pub fn series(name: impl Into<String>, unit: &'static str) -> Self {
        Self { name: name.into(), unit, kind: Kind::Series }
    }

    /// An empty cell.
    pub fn empty(&self) -> Cell {
        match self.kind {
            Kind::Index | Kind::Number => Cell::Number(None),
            Kind::Flag => Cell::Flag(None),
            Kind::Text => Cell::Text(None),
            Kind::Series => Cell::Series(None),
        }
    }

    fn field(&self) -> Field {
        let data = match self.kind {
            Kind::Index => DataType::UInt64,
            Kind::Number => DataType::Float64,
            Kind::Flag => DataType::Boolean,
            Kind::Text => DataType::Utf8,
            Kind::Series => DataType::List(Arc::new(item())),
        };
        let field = Field::new(&self.name, data, self.kind != Kind::Index);
        match self.unit {
            "" => field,
            unit => field.with_metadata(HashMap::from([("unit".to_owned(), unit.to_owned())])),
        }
    }

    /// The cells of one column.
    fn array<'c>(&self, cells: impl Iterator<Item = &'c Cell>) -> ArrayRef {
        match self.kind {
            Kind::Index => Arc::new(UInt64Array::from_iter_values(cells.map(|cell| match cell {
                Cell::Index(run) => *run,
                _ => u64::MAX,
            }))),
            Kind::Number => Arc::new(cells.map(number).collect::<Float64Array>()),
            Kind::Flag => Arc::new(cells.map(flag).collect::<BooleanArray>()),
            Kind::Text => Arc::new(cells.map(text).collect::<StringArray>()),
            Kind::Series => {
                let mut lists = ListBuilder::new(Float64Builder::new()).with_field(item());
                for cell in cells {
                    if let Cell::Series(Some(numbers)) = cell {
                        lists.values().append_slice(numbers);
                    }
                    lists.append(matches!(cell, Cell::Series(Some(_))));
                }
                Arc::new(lists.finish())
            }
        }
    }
}

/// An element of a list.
fn item() -> Field {
    Field::new("item", DataType::Float64, false)
}

fn number(cell: &Cell) -> Option<f64> {
    if let Cell::Number(number) = cell { *number } else { None }
}

fn flag(cell: &Cell) -> Option<bool> {
    if let Cell::Flag(flag) = cell { *flag } else { None }
}

fn text(cell: &Cell) -> Option<&str> {
    if let Cell::Text(text) = cell { text.as_deref() } else { None }
}

/// The columns as Arrow and Parquet know them.
pub fn schema(columns: &[Column]) -> SchemaRef {
    Arc::new(Schema::new(columns.iter().map(Column::field).collect::<Vec<_>>()))
}

/// Rows with a cell for each column.
///
/// # Errors
/// Returns an error if the cells of a row are not those of the columns.
pub fn batch(columns: &[Column], rows: &[Vec<Cell>]) -> Result<RecordBatch, ParquetError> {
    if rows.iter().any(|row| row.len() != columns.len()) {
        return Err(ParquetError::General("a row does not fit the columns".to_owned()));
    }
    let arrays = columns
        .iter()
        .enumerate()
        .map(|(index, column)| column.array(rows.iter().map(|row| &row[index])));
    Ok(RecordBatch::try_new(schema(columns), arrays.collect())?)
}

/// A writer of Parquet, whose bytes depend on nothing but the rows and `notes`.
///
/// # Errors
/// Returns those of the file.
pub fn writer<W: Write + Send>(
    to: W,
    schema: SchemaRef,
    notes: &[(&str, &str)],
) -> Result<ArrowWriter<W>, ParquetError> {
    let notes = notes
        .iter()
        .map(|(key, value)| KeyValue { key: (*key).to_owned(), value: Some((*value).to_owned()) });
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(concat!("lamc ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_key_value_metadata(Some(notes.collect()));
    ArrowWriter::try_new(to, schema, Some(properties.build()))
}

/// An error of Parquet as one of the system.
pub fn as_io(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(inner) => match inner.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(other) => io::Error::other(other),
        },
        other => io::Error::other(other),
    }
}
