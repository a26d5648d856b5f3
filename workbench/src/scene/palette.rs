//! Colours of materials: the same name has the same colour in every model, unless another
//! material of the model has that colour already.

use sha2::{Digest, Sha256};

/// Red, green, blue (sRGB).
pub type Rgb = [u8; 3];

/// The colours of sheets. None of them is dark, so that edges and hinges are visible on all.
const SHEETS: [Rgb; 8] = [
    [222, 184, 135], // wood
    [111, 168, 196], // steel blue
    [226, 142, 105], // terracotta
    [143, 188, 143], // sage
    [233, 201, 106], // straw
    [176, 152, 198], // lilac
    [203, 203, 196], // paper
    [214, 134, 156], // rose
];

/// The colour of point masses and of bodies that are given by their mass alone.
pub const MASS: Rgb = [96, 108, 128];

/// The colour on a body of the ground: a mixture with grey, half and half.
pub fn grounded(color: Rgb) -> Rgb {
    color.map(|part| ((u16::from(part) + 190) / 2) as u8)
}

/// A colour for each name that occurs, in the order of first occurrence.
pub fn of_materials<'a>(names: impl Iterator<Item = &'a str>) -> Vec<(String, Rgb)> {
    let mut found: Vec<(String, Rgb)> = Vec::new();
    for name in names {
        if found.iter().any(|(known, _)| known == name) {
            continue;
        }
        // Any byte of the digest would do; with this one, the colours of common names go well together.
        let wish = usize::from(Sha256::digest(name)[5]) % SHEETS.len();
        let free = (0..SHEETS.len())
            .map(|step| SHEETS[(wish + step) % SHEETS.len()])
            .find(|color| found.iter().all(|(_, taken)| taken != color));
        found.push((name.to_owned(), free.unwrap_or(SHEETS[wish])));
    }
    found
}
