//! The macro that reads the text of tables while a module is compiled. `lamc_runtime` exports it.
//!
//! The compiler of Rust interprets constant functions, which would take minutes for the tables of a large sheet. A macro runs
//! as machine code.

use lamc_tables::{Words, decode, words};
use proc_macro::{Delimiter, Group, Ident, Literal, Punct, Spacing, Span, TokenStream, TokenTree};

/// Defines a table for each name, `pub static NAME: Table<'static, CELLS>`: `tables! { POSES ENERGY "text" }`. The text is a string
/// literal that the compiler of lamc has written; it may be continued on further lines.
#[proc_macro]
pub fn tables(input: TokenStream) -> TokenStream {
    match read(input) {
        Ok(items) => items,
        Err(reason) => error(reason),
    }
}

fn read(input: TokenStream) -> Result<TokenStream, &'static str> {
    let (mut names, mut text) = (Vec::new(), None);
    for token in input {
        match token {
            TokenTree::Ident(name) if text.is_none() => names.push(name),
            TokenTree::Literal(literal) if text.is_none() => text = Some(literal.to_string()),
            _ => return Err("names of tables and one text are expected"),
        }
    }
    let text = text.ok_or("there is no text")?;
    // Quotation marks, and what continues the literal on the next line, are no digits of the text.
    let is_digit = |byte: &u8| byte.is_ascii_graphic() && !b"\"\\".contains(byte);
    let text: Vec<u8> = text.into_bytes().into_iter().filter(is_digit).collect();
    let functions = decode(&text, names.len()).map_err(|_| "the text is damaged")?;
    let items = names.into_iter().zip(functions);
    Ok(items.flat_map(|(name, rows)| item(name, &words(&rows))).collect())
}

/// `pub static NAME: ::lamc_runtime::table::Table<'static, CELLS> = ::lamc_runtime::table::Table::new(b"...");`
fn item(name: Ident, words: &Words) -> TokenStream {
    let cells = words.power_of_two();
    let bytes = TokenTree::Literal(Literal::byte_string(&words.bytes(cells)));
    let arguments = TokenTree::Group(Group::new(Delimiter::Parenthesis, bytes.into()));
    let mut item = tokens("pub static");
    item.extend([TokenTree::Ident(name)]);
    item.extend(tokens(&format!(
        ": ::lamc_runtime::table::Table<'static, {cells}> = ::lamc_runtime::table::Table::new",
    )));
    item.extend([arguments, TokenTree::Punct(Punct::new(';', Spacing::Alone))]);
    item
}

fn error(reason: &str) -> TokenStream {
    let reason = TokenTree::Literal(Literal::string(&format!("tables of lamc: {reason}")));
    let arguments = TokenTree::Group(Group::new(Delimiter::Parenthesis, reason.into()));
    let mut item: TokenStream =
        TokenTree::Ident(Ident::new("compile_error", Span::call_site())).into();
    item.extend(tokens("!"));
    item.extend([arguments]);
    item.extend(tokens(";"));
    item
}

fn tokens(text: &str) -> TokenStream {
    match text.parse() {
        Ok(tokens) => tokens,
        Err(_) => unreachable!("`{text}` is Rust"),
    }
}
