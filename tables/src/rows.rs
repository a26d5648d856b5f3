//! Rows of a function before they are put in order.

/// A row: its kind, and its fields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Row {
    /// One of [`kind`](crate::kind), or [`COSINE`].
    pub kind: usize,
    /// Values are named by the rows that compute them. Fields that the kind does not have are zero.
    pub fields: [usize; 3],
}

/// The rows of a function. Operands precede.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rows {
    /// The rows that compute values.
    pub list: Vec<Row>,
    /// Entries of each output that are not zero, in ascending order of their indices: rows and indices.
    pub outputs: Vec<Vec<(usize, usize)>>,
}

/// The kind of the row after each sine and cosine, which stands for the second of its values.
pub const COSINE: usize = usize::MAX;
