//! Refuses XML whose reading would take too much memory or time, before it is read.
//!
//! roxmltree has limits for nested entities, but not for these: a long entity used often, an element with a
//! hundred thousand attributes (it compares each with each), a hundred thousand namespaces (it copies them for
//! each element that declares one).

use std::collections::HashSet;
use std::ops::Range;

use crate::drawing::Place;
use crate::fault::{Cause, Fault};
use crate::limits;

/// What is counted.
#[derive(Default)]
struct Count<'a> {
    tags: usize,
    prefixes: HashSet<&'a [u8]>,
    entities: usize,
    /// The longest declaration of an entity, bytes.
    longest: usize,
}

/// Bytes of a prefix that tell it from others.
const NAME: usize = 64;

/// Checks a text.
///
/// # Errors
///
/// The first limit that the text exceeds, with the position of the tag.
pub(super) fn check(text: &str) -> Result<(), Fault> {
    let number = |byte| text.bytes().filter(|b| *b == byte).count();
    for (byte, most) in [(b'<', 2 * limits::TAGS), (b'=', limits::EQUAL_SIGNS)] {
        if number(byte) > most {
            return Err(limit(
                &format!("the file has more than {most} `{}`", char::from(byte)),
                0..0,
                None,
            ));
        }
    }
    let mut count = Count::default();
    let mut at = 0;
    while let Some(tag) = text.as_bytes()[at..].iter().position(|b| *b == b'<').map(|i| at + i) {
        let rest = &text[tag..];
        at = if rest.starts_with("<!--") {
            after(text, tag + 4, "-->")
        } else if rest.starts_with("<![CDATA[") {
            after(text, tag + 9, "]]>")
        } else if rest.starts_with("<?") {
            after(text, tag + 2, "?>")
        } else if rest.starts_with("<!ENTITY") {
            count.entity(text, tag)?
        } else if rest.starts_with("<!DOCTYPE") {
            scan(text, tag + 9, b"[>", |_, _| ())
        } else if rest.starts_with("<!") {
            after(text, tag + 2, ">")
        } else if rest.starts_with("</") {
            tag + 2
        } else {
            count.tag(text, tag)?
        };
    }
    if count.entities > 0 {
        let references = number(b'&');
        // Each reference is looked for among all entities.
        if references.saturating_mul(count.longest + count.entities) > limits::EXPANSION {
            return Err(limit("the entities of this file make it too long", 0..0, None));
        }
    }
    Ok(())
}

impl<'a> Count<'a> {
    fn tag(&mut self, text: &'a str, start: usize) -> Result<usize, Fault> {
        let mut attributes = 0;
        let prefixes = &mut self.prefixes;
        let end = scan(text, start + 1, b"<>", |at, byte| match byte {
            b'=' => attributes += 1,
            b':' if text.as_bytes()[..at].ends_with(b"xmlns")
                && prefixes.len() <= limits::PREFIXES =>
            {
                let name = &text.as_bytes()[at + 1..text.len().min(at + 1 + NAME)];
                let end = name.iter().position(|b| *b == b'=' || b.is_ascii_whitespace());
                prefixes.insert(&name[..end.unwrap_or(name.len())]);
            }
            _ => (),
        });
        self.tags += 1;
        let exceeded = [
            (self.tags, limits::TAGS, "tags"),
            (attributes, limits::ATTRIBUTES_OF_A_TAG, "attributes in one tag"),
            (self.prefixes.len(), limits::PREFIXES, "prefixes of namespaces"),
        ];
        match exceeded.iter().find(|(number, most, _)| number > most) {
            Some((_, most, what)) => {
                Err(limit(&format!("the file has more than {most} {what}"), start..start + 1, None))
            }
            None => Ok(end),
        }
    }

    fn entity(&mut self, text: &str, start: usize) -> Result<usize, Fault> {
        self.entities += 1;
        let end = scan(text, start + 8, b">", |_, _| ());
        let declaration = &text[start + 1..end];
        self.longest = self.longest.max(declaration.len());
        let nested =
            declaration.match_indices('&').any(|(i, _)| !declaration[i + 1..].starts_with('#'));
        if nested || declaration.contains('<') {
            let hint = "lamc reads entities of plain text, such as those of Illustrator";
            return Err(limit(
                "an entity contains markup or other entities",
                start..end,
                Some(hint),
            ));
        }
        Ok(end)
    }
}

/// Goes to the first of `ends` outside of quotes, and calls `see` with what is outside of quotes before it.
/// Returns the position of a `<` itself, and else the position after the end.
fn scan(text: &str, from: usize, ends: &[u8], mut see: impl FnMut(usize, u8)) -> usize {
    let bytes = text.as_bytes();
    let mut at = from;
    while let Some(byte) = bytes.get(at) {
        match byte {
            b'"' | b'\'' => match bytes[at + 1..].iter().position(|b| b == byte) {
                Some(length) => at += length + 1,
                None => return bytes.len(),
            },
            b'<' if ends.contains(byte) => return at,
            end if ends.contains(end) => return at + 1,
            _ => see(at, *byte),
        }
        at += 1;
    }
    bytes.len()
}

fn after(text: &str, from: usize, end: &str) -> usize {
    text[from..].find(end).map_or(text.len(), |i| from + i + end.len())
}

fn limit(message: &str, place: Range<usize>, hint: Option<&str>) -> Fault {
    Fault {
        cause: Cause::Limit,
        message: message.to_string(),
        place: (!place.is_empty()).then_some(Place { start: place.start, end: place.end }),
        at: Vec::new(),
        hint: hint.map(str::to_string),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn accept(text: &str) {
        assert_eq!(check(text), Ok(()), "{}", &text[..text.len().min(200)]);
    }

    fn refuse(text: &str, message: &str, place: Option<Range<usize>>) {
        let fault = check(text).unwrap_err();
        assert!(fault.message.contains(message), "{} is not about {message}", fault.message);
        assert_eq!(fault.place, place.map(|p| Place { start: p.start, end: p.end }));
    }

    #[test]
    fn files_of_real_programs_pass() {
        accept(
            "<!DOCTYPE svg PUBLIC \"a\" \"b\" [<!ENTITY ns_svg \"http://www.w3.org/2000/svg\">]><svg xmlns=\"&ns_svg;\"/>",
        );
        accept("<svg><!-- it's <a \" --><![CDATA[ ' <b ]]><?php ' ?><g a='\"' b=\"'\"/></svg>");
        accept(&format!("<svg d='{}'/>", "=".repeat(100_000)));
        accept("");
        accept("<");
        accept("<!ENTITY");
        accept("<a b='");
    }

    #[test]
    fn bombs_are_refused() {
        refuse(
            "<!DOCTYPE s [<!ENTITY a 'ha'><!ENTITY b '&a;&a;'>]><s/>",
            "other entities",
            Some(29..49),
        );
        refuse("<!DOCTYPE s [<!ENTITY a '<g>'>]><s/>", "markup", Some(13..30));
        let long = format!(
            "<!DOCTYPE s [<!ENTITY a '{}'>]><s>{}</s>",
            "x".repeat(50_000),
            "&a;".repeat(1000)
        );
        refuse(&long, "too long", None);
        let attributes: String = (0..1000).map(|i| format!(" a{i}=''")).collect();
        refuse(&format!("<s><g{attributes}/></s>"), "attributes in one tag", Some(3..4));
        let hidden: String = (0..1000).map(|i| format!(" a{i}='>'")).collect();
        refuse(&format!("<!ELEMENT '><s><g{hidden}/></s>"), "attributes in one tag", Some(15..16));
        refuse(
            &"<g/>".repeat(limits::TAGS + 1),
            "tags",
            Some(4 * limits::TAGS..4 * limits::TAGS + 1),
        );
        let prefixes: String = (0..101).map(|i| format!("<g xmlns:a{i}='u{i}'>")).collect();
        refuse(
            &prefixes,
            "prefixes",
            Some(prefixes.len() - "<g xmlns:a100='u100'>".len()..prefixes.len() - 20),
        );
    }
}
