//! Codes of files with numbers: measurements and configurations as CSV, states as JSON.

codes! {
    BAD_ROW "bad-row"
        "The text is not a table of comma-separated values: a row has more or fewer fields than the header."
        "Give every row as many fields as the header has names. An empty field is a gap in a measurement.";
    MISSING_COLUMN "missing-column"
        "A column that is needed is not in the header, or its name has a unit that cannot be read."
        "Name the columns as the message says, in the first line that is not a comment.";
    BAD_FIELD "bad-field"
        "A field of a table is not a number, or not one that is possible there."
        "Correct the number. The decimal separator is a point, and the separator of fields is a comma.";
    BAD_TIME "bad-time"
        "The time of a row is missing, or it is not greater than the time of the row before."
        "Order the rows by time, and give each a time of its own.";
    TOO_FEW_ROWS "too-few-rows"
        "A measurement has too few samples: two are needed for rotations and three for angles."
        "Measure more samples.";
    TOO_MANY_ROWS "too-many-rows"
        "A table has more than a million rows."
        "Divide the measurement, or leave out samples."
        no example "the table would have more than a million rows";
    BAD_STATES "bad-states"
        "A file of states is not JSON, or has keys other than `states` and, in each state, `q`, `u`, `t`, \
         `inputs` and `params`."
        "Write `{\"states\": [{\"q\": [0.1, 0.2], \"u\": [0, 0], \"t\": 0}]}`. All but `q` may be left out.";
    TOO_MANY_STATES "too-many-states"
        "A file has more than 100,000 states."
        "Divide the file."
        no example "the file would have more than 100,000 states";
}
