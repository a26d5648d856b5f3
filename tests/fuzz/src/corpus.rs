//! Inputs of the fuzzer in a file: each on one line, without newlines and bytes that are not ASCII.

/// Returns the line of an input.
pub fn line(input: &[u8]) -> String {
    input.escape_ascii().to_string()
}

/// Returns the input of a line, `None` if the line is not one of [`line`].
pub fn input(line: &str) -> Option<Vec<u8>> {
    let mut input = Vec::new();
    let mut rest = line.bytes();
    while let Some(byte) = rest.next() {
        input.push(match byte {
            b'\\' => match rest.next()? {
                b'n' => b'\n',
                b'r' => b'\r',
                b't' => b'\t',
                b'x' => {
                    let mut digit = || char::from(rest.next()?).to_digit(16);
                    u8::try_from(16 * digit()? + digit()?).ok()?
                }
                same => same,
            },
            byte => byte,
        });
    }
    Some(input)
}
