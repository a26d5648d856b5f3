//! What the colour of a line means.
//!
//! The colours are those of Origami Simulator (Ghassaei, Demaine and Gershenfeld 2018): black is the border,
//! red a mountain, blue a valley, green a cut, yellow a line of a triangulation, magenta a crease that nothing
//! drives. Programs and printers change them a little (Illustrator's red is `#ed1c24`, its black `#231f20`), so
//! a colour counts as the nearest of these by its hue:
//!
//! | hue, degrees | role |
//! |---|---|
//! | 330 to 30 | red: mountain |
//! | 30 to 45 | orange: none |
//! | 45 to 90 | yellow: flat |
//! | 90 to 150 | green: cut |
//! | 150 to 195 | cyan: none |
//! | 195 to 270 | blue: valley |
//! | 270 to 330 | magenta: hinge |
//!
//! The border between cyan and blue is not in the middle, because the blues of print (`#0071bc`) lean towards
//! cyan. The yellows of print (`#ffde17`) lean towards orange, but orange itself (`#ff8800`) is neither red nor
//! yellow. Crease patterns use cyan and greys for auxiliary lines, so these have no role and are ignored, as are
//! orange and white. Black is what is dark without a clear hue.

use crate::drawing::Role;

/// Up to this value of its largest channel, of 255, a colour without a clear hue is black.
const DARK: u8 = 80;

/// The difference of its largest and its smallest channel that gives a dark colour a clear hue.
const CLEAR: u8 = 40;

/// The least saturation, per 255, of a colour with a clear hue.
const SATURATED: u32 = 64;

/// Returns the role of a colour: red, green, blue. None for white, greys, cyan and orange.
pub(crate) fn role_of([red, green, blue]: [u8; 3]) -> Option<Role> {
    let largest = red.max(green).max(blue);
    let range = largest - red.min(green).min(blue);
    if range < CLEAR || u32::from(range) * 255 < SATURATED * u32::from(largest) {
        return (largest <= DARK).then_some(Role::Border);
    }
    let (r, g, b) = (f64::from(red), f64::from(green), f64::from(blue));
    let sixth = if largest == red {
        (g - b) / f64::from(range)
    } else if largest == green {
        2.0 + (b - r) / f64::from(range)
    } else {
        4.0 + (r - g) / f64::from(range)
    };
    role_of_hue(60.0 * if sixth < 0.0 { sixth + 6.0 } else { sixth })
}

/// Returns the role of a hue, degrees from 0 to 360.
pub(crate) fn role_of_hue(hue: f64) -> Option<Role> {
    match hue {
        h if h < 30.0 => Some(Role::Mountain),
        h if h < 45.0 => None,
        h if h < 90.0 => Some(Role::Flat),
        h if h < 150.0 => Some(Role::Cut),
        h if h < 195.0 => None,
        h if h < 270.0 => Some(Role::Valley),
        h if h < 330.0 => Some(Role::Hinge),
        _ => Some(Role::Mountain),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(colours: &[u32], role: Option<Role>) {
        for colour in colours {
            let [_, red, green, blue] = colour.to_be_bytes();
            assert_eq!(role_of([red, green, blue]), role, "#{colour:06x}");
        }
    }

    #[test]
    fn colours_of_real_files() {
        check(&[0x00_0000, 0x23_1f20, 0x33_3333, 0x1a_1a1a, 0x22_2233], Some(Role::Border));
        check(
            &[0xff_0000, 0xed_1c24, 0xcc_0000, 0x80_0000, 0xff_6666, 0xc1_272d],
            Some(Role::Mountain),
        );
        check(
            &[0x00_00ff, 0x2e_3192, 0x00_71bc, 0x00_0080, 0x66_66ff, 0x1f_77b4],
            Some(Role::Valley),
        );
        check(&[0x00_ff00, 0x00_8000, 0x39_b54a, 0x00_a651], Some(Role::Cut));
        check(&[0xff_ff00, 0xff_f200, 0xff_de17], Some(Role::Flat));
        check(&[0xff_00ff, 0xec_008c, 0x92_278f], Some(Role::Hinge));
        check(&[0xff_8800, 0xff_a500], None);
        check(&[0xff_ffff, 0x80_8080, 0xcc_cccc, 0x00_ffff, 0x00_c8c8, 0x99_9a99], None);
    }
}
