//! Rust sources for the rules: files, and their imports.

use std::fs;
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// A file or a folder in the root of a crate's sources.
pub struct Entry {
    pub name: String,
    pub is_folder: bool,
}

/// The Rust files in a folder, by the names of their modules, and the folders with Rust files.
pub fn entries(folder: &Path) -> Vec<Entry> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let is_folder = path.is_dir();
        if is_folder && rust_files(&path).is_empty() {
            continue;
        }
        if is_folder || path.extension().is_some_and(|extension| extension == "rs") {
            let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
            // `name.rs` beside `name/` is one module.
            if is_folder || !folder.join(&name).is_dir() {
                found.push(Entry { name, is_folder });
            }
        }
    }
    found
}

/// All Rust files in a folder and the folders within.
pub fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

/// Whether a file holds tests alone, by its path within the sources of its crate.
pub fn is_test(file: &Path) -> bool {
    file.with_extension("").iter().any(|part| part == "tests")
}

/// The entries of a crate's root that a file names by `crate::..` or `super::..`, in `use` or
/// elsewhere. What is compiled for tests only is left out.
pub fn imports(root: &Path, file: &Path) -> Vec<String> {
    let text = fs::read_to_string(file).unwrap();
    imports_of(&text, module(file.strip_prefix(root).unwrap()))
}

fn imports_of(text: &str, module: Vec<String>) -> Vec<String> {
    let tokens: TokenStream = text.parse().expect("a file that compiles");
    let mut found = Vec::new();
    names(tokens, &module, &mut found);
    found
}

/// The path of a file's module in its crate.
fn module(file: &Path) -> Vec<String> {
    let mut path: Vec<String> =
        file.with_extension("").iter().map(|part| part.to_str().unwrap().to_owned()).collect();
    if path.last().is_some_and(|name| matches!(name.as_str(), "mod" | "lib" | "main")) {
        path.pop();
    }
    path
}

/// Adds the first segment of each path within the crate, from its root.
fn names(tokens: TokenStream, module: &[String], found: &mut Vec<String>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut i = 0;
    while i < tokens.len() {
        if is_test_attribute(&tokens[i..]) {
            i = after_item(&tokens, i + 2);
            continue;
        }
        let is_segment = i > 1 && is_path_separator(&tokens[i - 2..i]);
        match &tokens[i] {
            TokenTree::Ident(name) if name == "mod" => {
                if let [_, TokenTree::Ident(name), TokenTree::Group(body), ..] = &tokens[i..] {
                    let inner = [module, &[name.to_string()]].concat();
                    names(body.stream(), &inner, found);
                    i += 2;
                }
            }
            TokenTree::Ident(name) if !is_segment && (name == "crate" || name == "super") => {
                let start = if name == "crate" { &[][..] } else { parent(module) };
                segments(&tokens[i + 1..], start.to_vec(), found);
            }
            TokenTree::Group(group) => names(group.stream(), module, found),
            _ => {}
        }
        i += 1;
    }
}

/// Follows a path on from the module `at`; a group in braces holds several.
fn segments(tokens: &[TokenTree], at: Vec<String>, found: &mut Vec<String>) {
    let next = is_path_separator(tokens).then(|| tokens.get(2)).flatten();
    match next {
        Some(TokenTree::Ident(name)) if name == "super" => {
            segments(&tokens[3..], parent(&at).to_vec(), found);
        }
        _ if !at.is_empty() => found.push(at[0].clone()),
        Some(TokenTree::Ident(name)) => found.push(name.to_string()),
        Some(TokenTree::Group(group)) => found.extend(first_names(group.stream())),
        _ => {}
    }
}

/// The first name of each path in a list of them.
fn first_names(list: TokenStream) -> Vec<String> {
    let mut found = Vec::new();
    let mut is_first = true;
    for token in list {
        match token {
            TokenTree::Ident(name) if is_first => {
                found.push(name.to_string());
                is_first = false;
            }
            TokenTree::Punct(comma) if comma.as_char() == ',' => is_first = true,
            _ => {}
        }
    }
    found
}

fn parent(module: &[String]) -> &[String] {
    module.split_last().map_or(&[], |(_, parent)| parent)
}

/// `::`.
fn is_path_separator(tokens: &[TokenTree]) -> bool {
    let is_colon = |token: &TokenTree| matches!(token, TokenTree::Punct(p) if p.as_char() == ':');
    matches!(tokens, [first, second, ..] if is_colon(first) && is_colon(second))
}

/// `#[cfg(test)]`.
fn is_test_attribute(tokens: &[TokenTree]) -> bool {
    match tokens {
        [TokenTree::Punct(hash), TokenTree::Group(group), ..] if hash.as_char() == '#' => {
            group.stream().to_string().replace(' ', "") == "cfg(test)"
        }
        _ => false,
    }
}

/// Past the item that begins at `i`: its body in braces, or its semicolon.
fn after_item(tokens: &[TokenTree], i: usize) -> usize {
    let ends = |token: &TokenTree| match token {
        TokenTree::Punct(p) => p.as_char() == ';',
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
        _ => false,
    };
    tokens[i..].iter().position(ends).map_or(tokens.len(), |length| i + length + 1)
}

#[test]
fn imports_are_found_however_they_are_written() {
    let check = |module: &[&str], text: &str, expected: &[&str]| {
        let module = module.iter().map(|&name| name.to_owned()).collect();
        assert_eq!(imports_of(text, module), expected, "{text}");
    };
    let file: &[&str] = &["kane", "motion"];
    check(file, "use crate::source::Span;", &["source"]);
    check(file, "use crate::{source::{Span, File}, laminate as l};", &["source", "laminate"]);
    check(file, "pub(crate) use crate::backend;", &["backend"]);
    check(file, "pub(crate) fn f() -> crate::program::Op { todo!() }", &["program"]);
    check(file, "fn f() { if true { g(crate::backend::emit()) } }", &["backend"]);
    check(file, "use super::frame::Frame;", &["kane"]);
    check(file, "use super::super::backend::Text;", &["backend"]);
    check(file, "use super::super::{backend, program};", &["backend", "program"]);
    check(file, "mod inner { use super::super::super::cli; }", &["cli"]);
    check(&["kane"], "use super::backend::Text;", &["backend"]);
    check(file, "#[cfg(test)] mod tests { use crate::backend; } use crate::source;", &["source"]);
    check(file, "#[cfg(test)] use crate::backend; // crate::cli", &[]);
    check(file, "const TEXT: &str = \"crate::backend\";", &[]);
}
