//! Codes of the YAML syntax, before the text is read as a model.

codes! {
    FILE_TOO_LARGE "file-too-large"
        "A model has more than 16 MiB, or another file that lamc reads has more than 256 MiB. The position is \
         that of the first byte that is not read."
        "Check that this is the right file. Remove what is not needed, or divide a long measurement."
        no example "the file would be larger than 16 MiB";
    NOT_UTF8 "not-utf8"
        "The file has bytes that are not text in UTF-8. It may have been saved in another encoding, or it is \
         not a text."
        "Save the file as UTF-8."
        no example "an example would not be text";
    EMPTY_FILE "empty-file"
        "The file contains only blanks and comments."
        "Describe a mechanism. A model needs at least `bodies` and `joints`.";
    YAML_SYNTAX "yaml-syntax"
        "The text is not valid YAML. Frequent reasons are a bracket that is not closed, a \
         missing comma or colon, and different indentation within one mapping."
        "Look at the marked position and at the lines before it: the parser often notices a \
         mistake only some lines later.";
    SEVERAL_DOCUMENTS "several-documents"
        "The file has a second YAML document, which starts at a line `---`."
        "Keep one mechanism in a file and remove the line.";
    TOO_DEEP "too-deep"
        "Lists and mappings are nested more than 64 levels deep after aliases have been \
         expanded."
        "Write the value with less nesting. A model needs about ten levels.";
    TOO_LARGE "too-large"
        "The file has more than one million values after aliases have been expanded. A long text counts as one \
         value for each 64 bytes."
        "Write the values out. Aliases of aliases multiply the number of values.";
    UNKNOWN_ALIAS "unknown-alias"
        "An alias `*name` has no anchor `&name` before it."
        "Put `&name` in front of the value that the alias refers to, above the alias.";
    SELF_ALIAS "self-alias"
        "An alias is inside the value that it refers to, so the value would contain itself."
        "Write the value out.";
    BAD_MERGE "bad-merge"
        "The merge key `<<` inserts the entries of other mappings, but its value is neither a \
         mapping nor a list of mappings."
        "Write `<<: *name` with an anchor `&name` in front of a mapping.";
    DUPLICATE_KEY "duplicate-key"
        "One mapping has the same key twice."
        "Remove one of the two, or give it another name.";
    BAD_KEY "bad-key"
        "The key of a mapping is a list or a mapping."
        "Write a plain name before the colon.";
    UNEXPECTED_TAG "unexpected-tag"
        "A value has a YAML tag, such as `!rigid`. The schema has no tags."
        "Remove the tag.";
}
