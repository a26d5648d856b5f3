//! An arithmetic code: decisions with probabilities become digits of base 92 (J. Rissanen, "Generalized Kraft inequality and
//! arithmetic coding", 1976; G. N. N. Martin, "Range encoding", 1979).
//!
//! A text is the digits of a number between 0 and 1. Each decision divides the interval in which the number lies at its
//! probability, and the text says in which part.

/// Base of the digits: the printable characters of ASCII without blank, `"` and `\`.
const BASE: u64 = 92;

/// Digits that both sides hold at the same time.
const HELD: u32 = 9;

/// Intervals are not longer than this.
const MOST: u64 = BASE.pow(HELD);

/// Intervals are longer than this after a digit has been written or read.
const LEAST: u64 = BASE.pow(HELD - 1);

/// Bits of a probability.
const PRECISION: u32 = 12;

/// How fast a probability follows decisions in the end: by 2^-RATE of the distance.
const RATE: u8 = 4;

/// The probability of a decision that comes again and again: it follows those that were made.
#[derive(Clone, Copy, Debug)]
pub struct Chance {
    yes: u16,
    made: u8,
}

impl Default for Chance {
    fn default() -> Self {
        Self { yes: 1 << (PRECISION - 1), made: 0 }
    }
}

impl Chance {
    /// Least distance of a probability from 0 and 1.
    const MARGIN: u16 = 24;

    fn follow(&mut self, yes: bool) {
        self.made = RATE.min(self.made + 1);
        match yes {
            true => {
                self.yes += ((1 << PRECISION) - Self::MARGIN).saturating_sub(self.yes) >> self.made
            }
            false => self.yes -= self.yes.saturating_sub(Self::MARGIN) >> self.made,
        }
    }
}

/// Writes or reads decisions.
pub trait Code {
    /// Writes `yes`, or reads it and ignores the argument; returns what was written or read.
    fn decide(&mut self, chance: &mut Chance, yes: bool) -> bool;
}

/// Writes decisions.
pub struct Writer {
    digits: Vec<u8>,
    low: u64,
    range: u64,
}

impl Writer {
    pub fn new() -> Self {
        Self { digits: Vec::new(), low: 0, range: MOST }
    }

    /// The text: of all numbers in the interval one with the fewest digits.
    pub fn finish(mut self) -> String {
        let rounded = (0..HELD).rev().map(|zeros| {
            let unit = BASE.pow(zeros);
            (self.low + self.range - 1) / unit * unit
        });
        if let Some(number) = rounded.into_iter().find(|&number| number >= self.low) {
            self.low = number;
        }
        if self.low >= MOST {
            self.carry();
        }
        (0..HELD).for_each(|_| self.shift());
        while self.digits.last() == Some(&0) {
            self.digits.pop();
        }
        self.digits.into_iter().map(character).collect()
    }

    fn shift(&mut self) {
        self.digits.push((self.low / LEAST) as u8);
        self.low = self.low % LEAST * BASE;
    }

    fn carry(&mut self) {
        self.low -= MOST;
        for digit in self.digits.iter_mut().rev() {
            *digit = (*digit + 1) % BASE as u8;
            if *digit != 0 {
                break;
            }
        }
    }
}

impl Code for Writer {
    fn decide(&mut self, chance: &mut Chance, yes: bool) -> bool {
        let part = (self.range >> PRECISION) * u64::from(chance.yes);
        if yes {
            self.range = part;
        } else {
            self.low += part;
            self.range -= part;
            if self.low >= MOST {
                self.carry();
            }
        }
        chance.follow(yes);
        while self.range <= LEAST {
            self.shift();
            self.range *= BASE;
        }
        yes
    }
}

/// Reads decisions. A text that ends early goes on with zeros.
pub struct Reader<'a> {
    digits: std::slice::Iter<'a, u8>,
    code: u64,
    range: u64,
}

impl<'a> Reader<'a> {
    pub fn new(text: &'a [u8]) -> Self {
        let mut reader = Self { digits: text.iter(), code: 0, range: MOST };
        (0..HELD).for_each(|_| reader.shift());
        reader
    }

    fn shift(&mut self) {
        let digit = self.digits.next().map_or(0, |&byte| digit(byte));
        self.code = self.code * BASE + digit;
    }
}

impl Code for Reader<'_> {
    fn decide(&mut self, chance: &mut Chance, _: bool) -> bool {
        let part = (self.range >> PRECISION) * u64::from(chance.yes);
        let yes = self.code < part;
        if yes {
            self.range = part;
        } else {
            self.code -= part;
            self.range -= part;
        }
        chance.follow(yes);
        while self.range <= LEAST {
            self.shift();
            self.range *= BASE;
        }
        yes
    }
}

/// The character of a digit: neither blank nor one that a string literal escapes.
fn character(digit: u8) -> char {
    let byte = b'!' + digit;
    let byte = byte + u8::from(byte >= b'"');
    char::from(byte + u8::from(byte >= b'\\'))
}

/// The digit of a character; of another character, some digit.
fn digit(byte: u8) -> u64 {
    let digit = byte.wrapping_sub(b'!' + u8::from(byte > b'"') + u8::from(byte > b'\\'));
    u64::from(digit) % BASE
}
