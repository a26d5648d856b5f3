//! Number literals for Rust and C.

use std::fmt::Debug;

/// Returns the shortest digits of a magnitude that read back as the same number. Rust's `{:?}` chooses
/// between plain and exponent notation well, except that it writes leading zeros after the decimal
/// point.
pub fn digits(magnitude: impl Debug + Into<f64> + Copy) -> String {
    let plain = format!("{magnitude:?}");
    let value: f64 = magnitude.into();
    match plain.strip_prefix("0.") {
        // Rust would write up to five leading zeros here.
        Some(fraction) if value != 0.0 && value < 1e-2 => {
            let digits = fraction.trim_start_matches('0');
            let exponent = fraction.len() - digits.len() + 1;
            let (first, rest) = digits.split_at(1);
            let point = if rest.is_empty() { "" } else { "." };
            format!("{first}{point}{rest}e-{exponent}")
        }
        _ => plain,
    }
}

#[cfg(test)]
mod tests {
    use super::digits;

    #[test]
    fn digits_are_short_and_read_back() {
        for (number, text) in
            [(0.0, "0.0"), (0.5, "0.5"), (0.0025, "2.5e-3"), (1e-5, "1e-5"), (1e300, "1e300")]
        {
            assert_eq!(digits(number), text);
            assert_eq!(text.parse(), Ok(number));
        }
        assert_eq!(digits(0.1_f32), "0.1");
    }
}
