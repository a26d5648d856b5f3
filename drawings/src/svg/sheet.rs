//! Style sheets: the rules of all `<style>` elements.
//!
//! Selectors of elements, classes and identifiers, with the combinators for descendants and children, are what
//! Illustrator, Inkscape and scripts write. Rules with other selectors, and those in `@media` and the like, are
//! left out and listed. simplecss would read more, but panics in debug builds at `> a {}`, copies all
//! declarations for each selector of a list, and takes exponential time for nested descendants.

use std::collections::HashMap;

use roxmltree::Node;

use crate::limits;

/// A declaration: property, value, and whether it is important.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Declaration<'a> {
    pub name: &'a str,
    pub value: &'a str,
    pub important: bool,
}

/// What one element must be: `tag.class.class#id`.
#[derive(Clone, Debug, Default)]
struct Compound<'a> {
    tag: Option<&'a str>,
    id: Option<&'a str>,
    classes: Vec<&'a str>,
}

#[derive(Debug)]
struct Rule<'a> {
    /// From the element itself outwards; true if the next one must be the parent, not just an ancestor.
    compounds: Vec<(Compound<'a>, bool)>,
    /// Identifiers, classes, tags.
    specificity: [usize; 3],
    block: usize,
}

/// The rules of a drawing.
#[derive(Debug, Default)]
pub(super) struct Sheet<'a> {
    rules: Vec<Rule<'a>>,
    blocks: Vec<Vec<Declaration<'a>>>,
    /// Rules by what the element itself must have: `#id`, `.class`, its tag, or nothing.
    index: HashMap<(char, &'a str), Vec<usize>>,
    /// Selectors and at-rules that are left out.
    pub unread: Vec<&'a str>,
}

/// Returns a sheet without its comments.
pub(super) fn without_comments(css: &str) -> String {
    let mut clean = String::with_capacity(css.len());
    let mut rest = css;
    while let Some((before, comment)) = rest.split_once("/*") {
        clean.push_str(before);
        clean.push(' ');
        rest = comment.split_once("*/").map_or("", |(_, after)| after);
    }
    clean.push_str(rest);
    clean
}

impl<'a> Sheet<'a> {
    /// Reads sheets without comments.
    pub(super) fn of(css: &'a str) -> Sheet<'a> {
        let mut sheet = Sheet::default();
        let mut rest = css;
        while let Some(end) = rest.find(['{', ';'])
            && sheet.rules.len() <= limits::RULES
        {
            let head =
                rest[..end].trim().trim_start_matches("<!--").trim_start_matches("-->").trim();
            if head.starts_with('@') {
                sheet.unread.push(head.split(char::is_whitespace).next().unwrap_or(head));
                rest = &rest[end..];
                rest = if rest.starts_with('{') { after_block(rest) } else { &rest[1..] };
            } else if rest[end..].starts_with('{') {
                let (body, after) =
                    rest[end + 1..].split_once('}').unwrap_or((&rest[end + 1..], ""));
                let block = sheet.blocks.len();
                sheet.blocks.push(declarations(body).collect());
                head.split(',').for_each(|selector| sheet.add(selector.trim(), block));
                rest = after;
            } else {
                rest = &rest[end + 1..];
            }
        }
        sheet
    }

    /// The number of rules.
    pub(super) fn len(&self) -> usize {
        self.rules.len()
    }

    fn add(&mut self, selector: &'a str, block: usize) {
        let Some(compounds) = compounds(selector) else {
            self.unread.push(selector);
            return;
        };
        let mut specificity = [0; 3];
        for (compound, _) in &compounds {
            specificity[0] += usize::from(compound.id.is_some());
            specificity[1] += compound.classes.len();
            specificity[2] += usize::from(compound.tag.is_some());
        }
        let own = &compounds[0].0;
        let key = match (own.id, own.classes.first(), own.tag) {
            (Some(id), ..) => ('#', id),
            (None, Some(class), _) => ('.', *class),
            (None, None, Some(tag)) => ('t', tag),
            (None, None, None) => ('*', ""),
        };
        self.index.entry(key).or_default().push(self.rules.len());
        self.rules.push(Rule { compounds, specificity, block });
    }

    /// Returns the declarations for an element, the weakest first, and how many rules were tried.
    pub(super) fn matching(&self, node: Node) -> (Vec<Declaration<'a>>, usize) {
        if self.rules.is_empty() {
            return (Vec::new(), 0);
        }
        let mut candidates: Vec<usize> = Vec::new();
        let mut collect =
            |kind, name| candidates.extend(self.index.get(&(kind, name)).into_iter().flatten());
        collect('*', "");
        collect('t', node.tag_name().name());
        classes(node).for_each(|class| collect('.', class));
        node.attribute("id").into_iter().for_each(|id| collect('#', id));
        let mut tried = candidates.len();
        candidates.retain(|i| matches(&self.rules[*i].compounds, node, &mut tried));
        candidates.sort_by_key(|i| (self.rules[*i].specificity, *i));
        candidates.dedup();
        let found = candidates
            .iter()
            .flat_map(|i| self.blocks[self.rules[*i].block].iter().copied())
            .collect();
        (found, tried)
    }
}

/// The declarations of a block, or of the attribute `style`.
pub(super) fn declarations(body: &str) -> impl Iterator<Item = Declaration<'_>> {
    body.split(';').filter_map(|part| {
        let (name, value) = part.split_once(':')?;
        let (value, important) = match value.rsplit_once('!') {
            Some((value, word)) if word.trim() == "important" => (value, true),
            _ => (value, false),
        };
        Some(Declaration { name: name.trim(), value: value.trim(), important })
    })
}

/// Whether the first compound fits the element, and the others its ancestors.
fn matches(compounds: &[(Compound, bool)], node: Node, tried: &mut usize) -> bool {
    *tried += 1;
    let Some(((own, child), outer)) = compounds.split_first() else { return true };
    if !own.fits(node) {
        return false;
    }
    if outer.is_empty() {
        return true;
    }
    let mut ancestor = node.parent_element();
    while let Some(element) = ancestor {
        if *tried > TRIES {
            return false;
        }
        if matches(outer, element, tried) {
            return true;
        }
        ancestor = if *child { None } else { element.parent_element() };
    }
    false
}

/// The classes of an element. A list longer than any program writes is not read, because it would be searched
/// for each rule.
fn classes<'n>(node: Node<'n, '_>) -> impl Iterator<Item = &'n str> {
    node.attribute("class")
        .filter(|list| list.len() <= 1000)
        .into_iter()
        .flat_map(str::split_ascii_whitespace)
}

/// Steps for one element and all its rules, at most: a selector of descendants can take many.
pub(super) const TRIES: usize = 50_000;

/// Elements that one selector names, at most.
const COMPOUNDS: usize = 16;

impl Compound<'_> {
    fn fits(&self, node: Node) -> bool {
        let has = |class: &&str| classes(node).any(|c| c == *class);
        self.tag.is_none_or(|tag| node.tag_name().name() == tag)
            && self.id.is_none_or(|id| node.attribute("id") == Some(id))
            && self.classes.iter().all(has)
    }
}

/// The compounds of a selector, the element itself first. None if it has something else than tags, classes,
/// identifiers, descendants and children.
fn compounds(selector: &str) -> Option<Vec<(Compound<'_>, bool)>> {
    let mut found: Vec<(Compound, bool)> = Vec::new();
    let mut child = false;
    for word in selector.split_inclusive(|c: char| c == '>' || c.is_ascii_whitespace()) {
        let (name, ends_with_child) = match word.strip_suffix('>') {
            Some(name) => (name, true),
            None => (word.trim_ascii_end(), false),
        };
        if !name.is_empty() {
            found.push((compound(name)?, child));
            child = false;
        }
        if ends_with_child && (child || found.is_empty()) {
            return None;
        }
        child |= ends_with_child;
    }
    found.reverse();
    (!found.is_empty() && found.len() <= COMPOUNDS && !child).then_some(found)
}

fn compound(text: &str) -> Option<Compound<'_>> {
    let mut found = Compound::default();
    let start = text.find(['.', '#']).unwrap_or(text.len());
    match &text[..start] {
        "" | "*" => (),
        tag => found.tag = Some(identifier(tag)?),
    }
    let mut rest = &text[start..];
    while let Some(kind) = rest.chars().next() {
        let end = rest[1..].find(['.', '#']).map_or(rest.len(), |i| i + 1);
        let name = identifier(&rest[1..end])?;
        if kind == '#' {
            found.id = Some(name);
        } else {
            found.classes.push(name);
        }
        rest = &rest[end..];
    }
    Some(found)
}

fn identifier(text: &str) -> Option<&str> {
    let is_name = |c: char| c.is_alphanumeric() || c == '-' || c == '_' || !c.is_ascii();
    (!text.is_empty() && text.chars().all(is_name)).then_some(text)
}

/// What follows the block that `text` starts with.
fn after_block(text: &str) -> &str {
    let mut open = 0_usize;
    for (i, byte) in text.bytes().enumerate() {
        match byte {
            b'{' => open += 1,
            b'}' => open = open.saturating_sub(1),
            _ => continue,
        }
        if open == 0 {
            return &text[i + 1..];
        }
    }
    ""
}
