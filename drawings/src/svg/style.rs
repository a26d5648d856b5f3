//! The properties of an element that say what a line is: the cascade of attributes, style sheets and `style`.

use roxmltree::Node;
use svgtypes::{Color, Paint, PaintFallback};

use super::sheet::{Declaration, Sheet, declarations};
use crate::colour::role_of;
use crate::drawing::Role;

/// Properties of an element, with those of the groups around it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Style<'a> {
    stroke: Paint<'a>,
    /// The alpha of the stroke's colour, if it is written.
    stroke_alpha: Option<f64>,
    colour: Color,
    /// The alpha of `colour`, if it is written.
    colour_alpha: Option<f64>,
    stroke_opacity: Option<f64>,
    /// The product over the element and the groups around it; None if none of them has one.
    opacity: Option<f64>,
    visible: bool,
    /// False for `display: none`; it is not inherited.
    pub displayed: bool,
}

impl Default for Style<'_> {
    fn default() -> Self {
        Style {
            stroke: Paint::None,
            stroke_alpha: None,
            colour: Color::black(),
            colour_alpha: None,
            stroke_opacity: None,
            opacity: None,
            visible: true,
            displayed: true,
        }
    }
}

/// The attributes that are properties.
const PRESENTATION: [&str; 6] =
    ["color", "stroke", "stroke-opacity", "opacity", "visibility", "display"];

impl<'a> Style<'a> {
    /// Returns the style of an element inside something with the style `self`, and how many rules were tried.
    pub(super) fn cascade<'s: 'a>(
        &self,
        node: Node<'a, '_>,
        sheet: &Sheet<'s>,
    ) -> (Style<'a>, usize) {
        let (rules, tried) = sheet.matching(node);
        let mut own = Style { opacity: None, displayed: true, ..*self };
        for attribute in node.attributes() {
            if attribute.namespace().is_none() && PRESENTATION.contains(&attribute.name()) {
                own.set(self, attribute.name(), attribute.value());
            }
        }
        let inline = || declarations(node.attribute("style").unwrap_or_default());
        for important in [false, true] {
            let wanted = |d: &Declaration| d.important == important;
            rules.iter().copied().filter(wanted).for_each(|d| own.set(self, d.name, d.value));
            inline().filter(wanted).for_each(|d| own.set(self, d.name, d.value));
        }
        own.opacity = product([own.opacity, self.opacity]);
        (own, tried)
    }

    /// Sets a property. A value that CSS does not know changes nothing, as in a browser.
    fn set(&mut self, parent: &Style<'a>, name: &str, value: &'a str) {
        let value = value.trim();
        let inherit = value == "inherit";
        match name {
            "stroke" if inherit => {
                (self.stroke, self.stroke_alpha) = (parent.stroke, parent.stroke_alpha);
            }
            "stroke" => {
                (self.stroke, self.stroke_alpha) =
                    paint(value).unwrap_or((self.stroke, self.stroke_alpha));
            }
            "color" if inherit => {
                (self.colour, self.colour_alpha) = (parent.colour, parent.colour_alpha);
            }
            "color" => {
                if let Ok(colour) = value.parse() {
                    (self.colour, self.colour_alpha) = (colour, alpha(value));
                }
            }
            "stroke-opacity" if inherit => self.stroke_opacity = parent.stroke_opacity,
            "stroke-opacity" => self.stroke_opacity = share(value).or(self.stroke_opacity),
            "opacity" => self.opacity = share(value).or(self.opacity),
            "visibility" if inherit => self.visible = parent.visible,
            "visibility" => self.visible = value == "visible",
            "display" => self.displayed = value != "none",
            _ => (),
        }
    }

    /// Returns the role of a line with this style and its target angle, rad: None without an opacity.
    ///
    /// # Errors
    ///
    /// Why it is not a line of the pattern, in words that follow the name of the element.
    pub(super) fn role(&self) -> Result<(Role, Option<f64>), String> {
        if !self.visible {
            return Err("that is hidden".into());
        }
        let (colour, alpha) = match self.stroke {
            Paint::Color(colour) | Paint::FuncIRI(_, Some(PaintFallback::Color(colour))) => {
                (colour, self.stroke_alpha)
            }
            Paint::CurrentColor | Paint::FuncIRI(_, Some(PaintFallback::CurrentColor)) => {
                (self.colour, self.colour_alpha)
            }
            Paint::None | Paint::Inherit | Paint::FuncIRI(_, Some(PaintFallback::None)) => {
                return Err("without stroke".into());
            }
            Paint::FuncIRI(..) | Paint::ContextFill | Paint::ContextStroke => {
                return Err("with a stroke of no single colour".into());
            }
        };
        let Color { red, green, blue, .. } = colour;
        let Some(role) = role_of([red, green, blue]) else {
            return Err(format!("with stroke #{red:02x}{green:02x}{blue:02x}"));
        };
        let opacity = product([self.opacity, self.stroke_opacity, alpha]);
        let finished = match role {
            Role::Mountain => -std::f64::consts::PI,
            Role::Valley => std::f64::consts::PI,
            _ => return Ok((role, None)),
        };
        Ok((role, opacity.map(|opacity| opacity * finished)))
    }
}

/// A paint and the alpha of its colour. The colour of an ICC profile, which follows the one of the screen, is
/// left out.
fn paint(value: &str) -> Option<(Paint<'_>, Option<f64>)> {
    let value = value.split_once("icc-color(").map_or(value, |(screen, _)| screen.trim_end());
    let paint = match value {
        "currentcolor" => Paint::CurrentColor,
        _ => Paint::from_str(value).ok()?,
    };
    Some((paint, alpha(value)))
}

/// The product of the factors that are given; None if none is.
fn product<const N: usize>(factors: [Option<f64>; N]) -> Option<f64> {
    factors.into_iter().flatten().reduce(|product, factor| product * factor)
}

/// The alpha that a colour writes: after a slash or as the fourth number of a function, or as the last digits
/// of `#rgba` and `#rrggbbaa`. The parser of colours rounds it to 8 bits, which is half a degree of an angle.
fn alpha(value: &str) -> Option<f64> {
    if let Some(function) = value.strip_suffix(')') {
        let (_, arguments) = function.rsplit_once('(')?;
        let last = match arguments.rsplit_once('/') {
            Some((_, last)) => last,
            None => arguments.splitn(4, ',').nth(3)?,
        };
        return share(last.trim());
    }
    let digits = value.rsplit_once('#')?.1;
    let (written, largest) = match digits.len() {
        4 => (digits.get(3..)?, 15.0),
        8 => (digits.get(6..)?, 255.0),
        _ => return None,
    };
    Some(f64::from(u8::from_str_radix(written, 16).ok()?) / largest)
}

/// A number from 0 to 1, or a percentage.
fn share(value: &str) -> Option<f64> {
    let number: f64 = match value.strip_suffix('%') {
        Some(percent) => percent.trim_end().parse::<f64>().ok()? / 100.0,
        None => value.parse().ok()?,
    };
    (!number.is_nan()).then(|| number.clamp(0.0, 1.0))
}
