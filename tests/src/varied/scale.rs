//! How large a mechanism is, and how its numbers are written.

use std::f64::consts::TAU;

use crate::random::Random;

/// Size of a drawing before it is scaled, m.
const SIZE: f64 = 0.2;

/// Decades of the size of a model, m.
const SIZES: [f64; 2] = [-6.0, 3.0];

/// Digits of a rounded drawing: from a hundredth of a millimetre to a nanometre in 100 mm.
const DIGITS: [usize; 2] = [4, 8];

/// Scales, turns and rounds.
pub struct Scale {
    /// Metres per metre of the drawing.
    factor: f64,
    /// Cosine and sine of the turn in the plane.
    turn: [f64; 2],
    /// Decimals of coordinates, if they are rounded.
    decimals: Option<usize>,
    /// Of lengths without a unit.
    pub unit: &'static str,
    /// m.
    metres: f64,
    /// Whether angles are in degrees.
    pub degrees: bool,
    /// Torques over those that gravity makes, by decades.
    strength: f64,
    /// Decades over which masses vary from body to body.
    pub decades: f64,
}

impl Scale {
    /// A random one. A loop that is rounded coarsely is another mechanism: only those that close are
    /// bound to be fine.
    pub fn random(random: &mut Random, closes: bool) -> Self {
        let factor = 10_f64.powf(random.range(SIZES[0], SIZES[1])) / SIZE;
        let (unit, metres) = match random.below(4) {
            0 => ("um", 1e-6),
            1 => ("in", 0.0254),
            2 => ("m", 1.0),
            _ => ("mm", 1e-3),
        };
        let angle = random.range(0.0, TAU);
        let is_rounded = random.chance(0.5);
        let least = DIGITS[0] + usize::from(closes);
        let digits = least + random.below(DIGITS[1] + 1 - least);
        let leading = (SIZE * factor / metres).log10().floor() as i32;
        // Units that would need digits in front of the point are not rounded.
        let decimals = usize::try_from(digits as i32 - leading).ok().filter(|_| is_rounded);
        Self {
            factor,
            turn: [angle.cos(), angle.sin()],
            decimals,
            unit,
            metres,
            degrees: random.chance(0.5),
            strength: 10_f64.powf(random.range(-1.0, 1.0)),
            decades: if random.chance(0.3) { 10.0 } else { 0.0 },
        }
    }

    /// A length that is not part of the drawing's coordinates, in the unit of the file.
    pub fn exact(&self, metres: f64) -> f64 {
        metres * self.factor / self.metres
    }

    /// A length of the mechanism, m, from one of a mechanism of 0.2 m.
    pub fn length(&self, metres: f64) -> f64 {
        metres * self.factor
    }

    /// A moment of inertia, kg m^2, as a share of that of a plate of 1 g in a mechanism of 0.2 m.
    pub fn rotor(&self, share: f64) -> f64 {
        share * 1e-6 * self.factor.powi(5)
    }

    /// The unit's number of metres: for what has the unit m, whatever the drawing's.
    pub fn metres(&self, metres: f64) -> f64 {
        metres / self.metres
    }

    /// Coordinates in the plane, turned and rounded, as they are written.
    pub fn drawn(&self, [x, y]: [f64; 2]) -> [String; 2] {
        let [cos, sin] = self.turn;
        [cos * x - sin * y, sin * x + cos * y].map(|value| {
            let value = self.exact(value);
            match self.decimals {
                Some(decimals) => format!("{value:.decimals$}"),
                None => format!("{value:?}"),
            }
        })
    }

    /// Half a unit of the last decimal.
    pub fn tolerance(&self) -> Option<f64> {
        self.decimals.map(|decimals| 0.5 * 10_f64.powi(-(decimals as i32)))
    }

    /// A mass, kg, from one of a mechanism of 0.2 m.
    pub fn mass(&self, random: &mut Random, kilograms: f64) -> f64 {
        let exponent = self.decades * random.range(-0.5, 0.5);
        kilograms * self.factor.powi(3) * 10_f64.powf(exponent)
    }

    /// A moment of inertia, kg m^2, from the mass as written and a square of lengths.
    pub fn inertia(&self, mass: f64, square: f64) -> f64 {
        mass * square * self.factor.powi(2)
    }

    /// A force of the order of the weight of a plate of 1 g in a mechanism of 0.2 m, N.
    pub fn force(&self, share: f64) -> f64 {
        share * 1e-2 * self.factor.powi(3) * self.strength
    }

    /// A torque of the order of that weight's, N m.
    pub fn torque(&self, share: f64) -> f64 {
        self.force(share) * SIZE * self.factor
    }

    /// An angle in the unit of the file, from rad.
    pub fn angle(&self, radians: f64) -> f64 {
        if self.degrees { radians.to_degrees() } else { radians }
    }
}
