//! The kinds of rows, by their numbers in words and texts.

#![allow(missing_docs, reason = "each is the operation of its name")]

/// Field: index of a number of the model.
pub const NUMBER: usize = 0;
/// Fields: index of an argument, index in it.
pub const ARGUMENT: usize = 1;
/// Two values: sine and cosine of one angle.
pub const SINE_COSINE: usize = 2;
pub const MUL: usize = 3;
pub const ADD: usize = 4;
pub const SUB: usize = 5;
pub const NEG: usize = 6;
/// Fields a, b, c: a b + c.
pub const MUL_ADD: usize = 7;
pub const DIV: usize = 8;
pub const MIN: usize = 9;
pub const MAX: usize = 10;
pub const POW: usize = 11;
pub const ATAN2: usize = 12;
pub const SQRT: usize = 13;
pub const TAN: usize = 14;
pub const EXP: usize = 15;
pub const ABS: usize = 16;
pub const TANH: usize = 17;
pub const LN: usize = 18;
pub const STEP: usize = 19;
/// Fields: a value, the index in the output at which it is written. The next kinds write the next outputs.
pub const OUTPUT: usize = 20;

/// In words, the kinds from here on are sums of one, two, .. products, c + a b + a b + .. in this order; they take the numbers of
/// the rows that become such sums.
pub const PRODUCTS: usize = MUL;
/// Products of a sum, at most.
pub const MOST_PRODUCTS: usize = 4;

/// How many products a kind of word sums, less one; nothing if it is no sum of products.
pub fn sum(kind: usize) -> Option<usize> {
    kind.checked_sub(PRODUCTS).filter(|&length| length < MOST_PRODUCTS)
}

/// Values that every table computes first: 1, -1 and -0, by which sums, differences and products become rows.
pub const FIRST_NUMBERS: [f64; 3] = [1.0, -1.0, -0.0];

/// Bits of a field of a word.
pub const FIELD: u32 = 16;

/// How far the second field of a word is shifted in a sum of products of a table with so many cells, a power of two: no bits are
/// above it, so that it needs no mask.
pub const fn shift(cells: usize) -> u32 {
    u32::BITS - cells.trailing_zeros()
}

/// How many fields the rows of a kind have.
pub const fn fields(kind: usize) -> usize {
    match kind {
        MUL_ADD => 3,
        NUMBER | SINE_COSINE | NEG | SQRT..=STEP => 1,
        _ => 2,
    }
}

/// How many of the fields are values; these come first.
pub const fn operands(kind: usize) -> usize {
    match kind {
        NUMBER | ARGUMENT => 0,
        _ if kind >= OUTPUT => 1,
        _ => fields(kind),
    }
}
