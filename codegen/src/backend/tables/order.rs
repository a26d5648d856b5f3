//! The order of rows: those farthest from the results come first, so that neighbours do not wait for each other and
//! few values are kept; rows of one kind at one distance are a group, by operands.
//!
//! Products and sums go on as long as there are any, then everything else that can be computed: a run of rows ends
//! where its kind does.

use std::collections::{BTreeMap, BTreeSet};

use lamc_runtime::table::{fields, kind};

use super::rows::{COSINE, Row, Rows};

/// Rows of one kind, with the positions of values in the order of computation as operands.
#[derive(Debug)]
pub struct Group {
    pub kind: usize,
    pub rows: Vec<[usize; 3]>,
}

/// Returns the groups of a function in their order.
pub fn groups(rows: &Rows) -> Vec<Group> {
    let mut order = Order::of(rows);
    while order.place_next() {}
    for (index, entries) in rows.outputs.iter().enumerate().filter(|(_, list)| !list.is_empty()) {
        let entries = entries.iter().map(|&(row, index)| [order.positions[row], index, 0]);
        order.groups.push(Group { kind: kind::OUTPUT + index, rows: entries.collect() });
    }
    order.groups
}

/// Rows that are ready, by distance from the results.
type Ready = BTreeMap<usize, BTreeSet<usize>>;

struct Order<'a> {
    rows: &'a [Row],
    users: Vec<Vec<usize>>,
    /// By row: how many operands are not placed.
    missing: Vec<usize>,
    /// By row: length of the longest chain of users.
    heights: Vec<usize>,
    products: Ready,
    others: Ready,
    /// By row: its value's place in the order.
    positions: Vec<usize>,
    placed: usize,
    groups: Vec<Group>,
}

fn is_product(row: Row) -> bool {
    (kind::MUL..=kind::MUL_ADD).contains(&row.kind)
}

/// The operands of a row, each once.
fn operands(row: Row) -> BTreeSet<usize> {
    let count = match row.kind {
        kind::NUMBER | kind::ARGUMENT | COSINE => 0,
        kind => fields(kind),
    };
    row.fields[..count].iter().copied().collect()
}

impl<'a> Order<'a> {
    fn of(rows: &'a Rows) -> Self {
        let rows = &rows.list;
        let mut users = vec![Vec::new(); rows.len()];
        let mut missing = vec![0; rows.len()];
        for (index, &row) in rows.iter().enumerate() {
            let operands = operands(row);
            missing[index] = operands.len();
            operands.into_iter().for_each(|operand| users[operand].push(index));
        }
        let mut heights = vec![0; rows.len()];
        for index in (0..rows.len()).rev() {
            let above = users[index].iter().map(|&user| heights[user] + 1).max();
            heights[index] = heights[index].max(above.unwrap_or(0));
            if rows[index].kind == COSINE {
                heights[index - 1] = heights[index];
            }
        }
        let positions = vec![usize::MAX; rows.len()];
        let (products, others) = (Ready::new(), Ready::new());
        let groups = Vec::new();
        let mut order =
            Self { rows, users, missing, heights, products, others, positions, placed: 0, groups };
        order.place_sources();
        order
    }

    /// Places numbers, then arguments, each in the order of their indices.
    fn place_sources(&mut self) {
        for source in [kind::NUMBER, kind::ARGUMENT] {
            let of_kind = |&index: &usize| self.rows[index].kind == source;
            let mut list: Vec<usize> = (0..self.rows.len()).filter(of_kind).collect();
            list.sort_by_key(|&index| self.rows[index].fields);
            let rows = list.iter().map(|&index| (self.rows[index].fields, index)).collect();
            self.place(source, rows);
        }
    }

    /// Places the rows that come next; false if there are none.
    fn place_next(&mut self) -> bool {
        let next = match self.products.pop_last() {
            Some((_, next)) => next,
            None => std::mem::take(&mut self.others).into_values().flatten().collect(),
        };
        let mut kinds: BTreeMap<usize, Vec<([usize; 3], usize)>> = BTreeMap::new();
        for index in next.iter().copied() {
            let Row { kind, fields: mut row } = self.rows[index];
            row[..fields(kind)].iter_mut().for_each(|field| *field = self.positions[*field]);
            // The later factor or term first: both orders give the same bits.
            if matches!(kind, kind::MUL | kind::ADD | kind::MUL_ADD) && row[0] < row[1] {
                row.swap(0, 1);
            }
            kinds.entry(kind).or_default().push((row, index));
        }
        for (kind, mut rows) in kinds {
            rows.sort();
            self.place(kind, rows);
        }
        !next.is_empty()
    }

    fn place(&mut self, kind: usize, rows: Vec<([usize; 3], usize)>) {
        if rows.is_empty() {
            return;
        }
        for &(_, index) in &rows {
            self.give_position(index);
            if kind == kind::SINE_COSINE {
                self.give_position(index + 1);
            }
        }
        let rows = rows.into_iter().map(|(row, _)| row).collect();
        self.groups.push(Group { kind, rows });
    }

    fn give_position(&mut self, index: usize) {
        self.positions[index] = self.placed;
        self.placed += 1;
        for user in std::mem::take(&mut self.users[index]) {
            self.missing[user] -= 1;
            if self.missing[user] == 0 {
                let row = self.rows[user];
                let ready = if is_product(row) { &mut self.products } else { &mut self.others };
                ready.entry(self.heights[user]).or_default().insert(user);
            }
        }
    }
}
