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
    colour: Color,
    stroke_opacity: f64,
    /// The product over the element and the groups around it.
    opacity: f64,
    visible: bool,
    /// False for `display: none`; it is not inherited.
    pub displayed: bool,
}

impl Default for Style<'_> {
    fn default() -> Self {
        Style {
            stroke: Paint::None,
            colour: Color::black(),
            stroke_opacity: 1.0,
            opacity: 1.0,
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
        let mut own = Style { opacity: 1.0, displayed: true, ..*self };
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
        own.opacity *= self.opacity;
        (own, tried)
    }

    /// Sets a property. A value that CSS does not know changes nothing, as in a browser.
    fn set(&mut self, parent: &Style<'a>, name: &str, value: &'a str) {
        let value = value.trim();
        let inherit = value == "inherit";
        match name {
            "stroke" if inherit => self.stroke = parent.stroke,
            "stroke" => self.stroke = paint(value).unwrap_or(self.stroke),
            "color" if inherit => self.colour = parent.colour,
            "color" => self.colour = value.parse().unwrap_or(self.colour),
            "stroke-opacity" if inherit => self.stroke_opacity = parent.stroke_opacity,
            "stroke-opacity" => self.stroke_opacity = share(value).unwrap_or(self.stroke_opacity),
            "opacity" => self.opacity = share(value).unwrap_or(self.opacity),
            "visibility" if inherit => self.visible = parent.visible,
            "visibility" => self.visible = value == "visible",
            "display" => self.displayed = value != "none",
            _ => (),
        }
    }

    /// Returns the role of a line with this style and its target angle, rad.
    ///
    /// # Errors
    ///
    /// Why it is not a line of the pattern, in words that follow the name of the element.
    pub(super) fn role(&self) -> Result<(Role, Option<f64>), String> {
        if !self.visible {
            return Err("that is hidden".into());
        }
        let colour = match self.stroke {
            Paint::Color(colour) | Paint::FuncIRI(_, Some(PaintFallback::Color(colour))) => colour,
            Paint::CurrentColor | Paint::FuncIRI(_, Some(PaintFallback::CurrentColor)) => {
                self.colour
            }
            Paint::None | Paint::Inherit | Paint::FuncIRI(_, Some(PaintFallback::None)) => {
                return Err("without stroke".into());
            }
            Paint::FuncIRI(..) | Paint::ContextFill | Paint::ContextStroke => {
                return Err("with a stroke of no single colour".into());
            }
        };
        let Color { red, green, blue, alpha } = colour;
        let Some(role) = role_of([red, green, blue]) else {
            return Err(format!("with stroke #{red:02x}{green:02x}{blue:02x}"));
        };
        let opacity = self.opacity * self.stroke_opacity * (f64::from(alpha) / 255.0);
        let fold = match role {
            Role::Mountain => Some(-opacity * std::f64::consts::PI),
            Role::Valley => Some(opacity * std::f64::consts::PI),
            _ => None,
        };
        Ok((role, fold))
    }
}

/// A paint. The colour of an ICC profile, which follows the one of the screen, is left out.
fn paint(value: &str) -> Option<Paint<'_>> {
    let value = value.split_once("icc-color(").map_or(value, |(screen, _)| screen.trim_end());
    match value {
        "currentcolor" => Some(Paint::CurrentColor),
        _ => Paint::from_str(value).ok(),
    }
}

/// A number from 0 to 1, or a percentage.
fn share(value: &str) -> Option<f64> {
    let number: f64 = match value.strip_suffix('%') {
        Some(percent) => percent.trim_end().parse::<f64>().ok()? / 100.0,
        None => value.parse().ok()?,
    };
    (!number.is_nan()).then(|| number.clamp(0.0, 1.0))
}
