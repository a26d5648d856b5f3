//! The order of rows: those farthest from the results come first, so that neighbours do not wait for each other and
//! few values are kept; rows of one kind at one distance are a group, by operands.
//!
//! Products and sums go on as long as there are any, then everything else that can be computed: a run of rows ends
//! where its kind does.

use std::collections::BTreeMap;

use crate::kind::{self, operands};
use crate::rows::{COSINE, Row, Rows};

/// Rows of one kind, with the positions of values in the order of computation as operands.
#[derive(Debug)]
pub struct Group {
    pub kind: usize,
    pub rows: Vec<[usize; 3]>,
}

/// Returns the groups of a function in their order.
pub fn groups(rows: &Rows) -> Vec<Group> {
    let mut order = Order::of(&rows.list);
    while order.place_next() {}
    for (index, entries) in rows.outputs.iter().enumerate().filter(|(_, list)| !list.is_empty()) {
        let entries = entries.iter().map(|&(row, index)| [order.positions[row], index, 0]);
        order.groups.push(Group { kind: kind::OUTPUT + index, rows: entries.collect() });
    }
    order.groups
}

struct Order<'a> {
    rows: &'a [Row],
    /// The users of all rows, and where those of each row begin.
    users: Vec<usize>,
    users_from: Vec<usize>,
    /// By row: how many operands are not placed.
    missing: Vec<usize>,
    /// By row: length of the longest chain of users.
    heights: Vec<usize>,
    /// Products that are ready, by distance from the results; none is farther than `farthest`.
    products: Vec<Vec<usize>>,
    farthest: usize,
    /// Other rows that are ready.
    others: Vec<usize>,
    /// By row: its value's place in the order.
    positions: Vec<usize>,
    placed: usize,
    groups: Vec<Group>,
}

fn is_product(row: Row) -> bool {
    (kind::MUL..=kind::MUL_ADD).contains(&row.kind)
}

/// The rows that a row needs.
fn needed(row: &Row) -> &[usize] {
    match row.kind {
        COSINE => &[],
        kind => &row.fields[..operands(kind)],
    }
}

impl<'a> Order<'a> {
    fn of(rows: &'a [Row]) -> Self {
        let mut users_from = vec![0; rows.len() + 1];
        rows.iter().flat_map(needed).for_each(|&operand| users_from[operand + 1] += 1);
        for index in 0..rows.len() {
            users_from[index + 1] += users_from[index];
        }
        let (mut users, mut next) = (vec![0; users_from[rows.len()]], users_from.clone());
        for (index, row) in rows.iter().enumerate() {
            for &operand in needed(row) {
                users[next[operand]] = index;
                next[operand] += 1;
            }
        }
        let mut heights = vec![0; rows.len()];
        for index in (0..rows.len()).rev() {
            let above = &users[users_from[index]..users_from[index + 1]];
            let above = above.iter().map(|&user| heights[user] + 1).max();
            heights[index] = heights[index].max(above.unwrap_or(0));
            if rows[index].kind == COSINE {
                heights[index - 1] = heights[index];
            }
        }
        let most = heights.iter().copied().max().unwrap_or(0);
        let mut order = Self {
            rows,
            users,
            users_from,
            missing: rows.iter().map(|row| needed(row).len()).collect(),
            heights,
            products: vec![Vec::new(); most + 1],
            farthest: 0,
            others: Vec::new(),
            positions: vec![usize::MAX; rows.len()],
            placed: 0,
            groups: Vec::new(),
        };
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

    /// The rows that come next.
    fn next(&mut self) -> Vec<usize> {
        while self.farthest > 0 && self.products[self.farthest].is_empty() {
            self.farthest -= 1;
        }
        match std::mem::take(&mut self.products[self.farthest]) {
            next if next.is_empty() => std::mem::take(&mut self.others),
            next => next,
        }
    }

    /// Places the rows that come next; false if there are none.
    fn place_next(&mut self) -> bool {
        let next = self.next();
        let mut kinds: BTreeMap<usize, Vec<([usize; 3], usize)>> = BTreeMap::new();
        for index in next.iter().copied() {
            let Row { kind, fields: mut row } = self.rows[index];
            row[..operands(kind)].iter_mut().for_each(|field| *field = self.positions[*field]);
            // The later factor or term first: both orders give the same bits.
            if matches!(kind, kind::MUL | kind::ADD | kind::MUL_ADD) && row[0] < row[1] {
                row.swap(0, 1);
            }
            kinds.entry(kind).or_default().push((row, index));
        }
        for (kind, mut rows) in kinds {
            rows.sort_unstable();
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
        for at in self.users_from[index]..self.users_from[index + 1] {
            let user = self.users[at];
            self.missing[user] -= 1;
            if self.missing[user] == 0 {
                if is_product(self.rows[user]) {
                    self.farthest = self.farthest.max(self.heights[user]);
                    self.products[self.heights[user]].push(user);
                } else {
                    self.others.push(user);
                }
            }
        }
    }
}
