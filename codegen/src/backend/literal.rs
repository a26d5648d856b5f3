//! Numbers as Rust and C write them.

use std::fmt::Debug;

/// The shortest digits that read back as the same number, of a magnitude; Rust's `{:?}` chooses
/// exponents well but for the zeros in front.
pub fn digits(magnitude: impl Debug + Into<f64> + Copy) -> String {
    let plain = format!("{magnitude:?}");
    let value: f64 = magnitude.into();
    match plain.strip_prefix("0.") {
        // Rust would write up to five leading zeros.
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
