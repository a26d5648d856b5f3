//! The longest way through a function: its basic blocks, its loops from the inside out, and the functions it calls.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;

use petgraph::algo::tarjan_scc;
use petgraph::prelude::DiGraphMap;

use crate::image::{Flow, Image};

/// Instructions without a branch in or out but at the ends.
#[derive(Clone, Debug, Default)]
pub struct Block {
    /// The address of each instruction.
    pub addresses: Vec<u32>,
    /// Where it leads within the function.
    pub next: Vec<u32>,
    /// Functions that it calls, or ends in.
    pub calls: Vec<Call>,
    /// Bytes of stack at most within it, from the call on.
    pub stack: i64,
}

/// A call of a function.
#[derive(Clone, Copy, Debug)]
pub struct Call {
    pub function: u32,
    /// Of the instruction that calls.
    pub address: u32,
    /// Bytes of stack at the call.
    pub depth: i64,
}

/// The basic blocks of a function, by their addresses.
pub type Blocks = BTreeMap<u32, Block>;

/// The basic blocks of the function that begins here.
///
/// # Errors
/// It leads to bytes that are no instructions, or its stack depends on the way.
pub fn blocks(image: &Image, begin: u32) -> Result<Blocks, Box<dyn Error>> {
    let (name, range) = image.functions.get(&begin).ok_or("no function begins there")?;
    let mut leaders = BTreeSet::from([begin]);
    let mut reached = BTreeSet::new();
    let mut open = vec![begin];
    while let Some(at) = open.pop() {
        if !reached.insert(at) {
            continue;
        }
        let instruction = image
            .instructions
            .get(&at)
            .ok_or_else(|| format!("{name}: no instruction at {at:#x}"))?;
        let next = at + instruction.length;
        let target = match instruction.flow {
            Flow::Jump(target) | Flow::Branch(target) if range.contains(&target) => Some(target),
            _ => None,
        };
        let goes_on = !matches!(instruction.flow, Flow::Jump(_) | Flow::Return);
        if !matches!(instruction.flow, Flow::Next | Flow::Call(_)) {
            leaders.extend(target);
            leaders.extend(goes_on.then_some(next));
        }
        open.extend(target);
        open.extend(goes_on.then_some(next));
    }
    let mut blocks = Blocks::new();
    for &leader in leaders.iter().filter(|leader| reached.contains(leader)) {
        blocks.insert(leader, block(image, range, leader, &leaders));
    }
    set_stack(image, name, begin, &mut blocks)?;
    Ok(blocks)
}

fn block(
    image: &Image,
    range: &std::ops::Range<u32>,
    leader: u32,
    leaders: &BTreeSet<u32>,
) -> Block {
    let mut block = Block::default();
    let mut at = leader;
    loop {
        block.addresses.push(at);
        let instruction = image.instructions[&at];
        let next = at + instruction.length;
        match instruction.flow {
            Flow::Next => {}
            Flow::Call(function) => block.calls.push(Call { function, address: at, depth: 0 }),
            Flow::Jump(target) | Flow::Branch(target) => {
                // A jump into another function is a call at the end.
                match range.contains(&target) {
                    true => block.next.push(target),
                    false => block.calls.push(Call { function: target, address: at, depth: 0 }),
                }
                if matches!(instruction.flow, Flow::Branch(_)) {
                    block.next.push(next);
                }
                break block;
            }
            Flow::Return => break block,
            Flow::MaybeReturn => {
                block.next.push(next);
                break block;
            }
        }
        if leaders.contains(&next) {
            block.next.push(next);
            break block;
        }
        at = next;
    }
}

/// Follows the stack pointer through the blocks.
fn set_stack(
    image: &Image,
    name: &str,
    begin: u32,
    blocks: &mut Blocks,
) -> Result<(), Box<dyn Error>> {
    let mut entered = BTreeMap::from([(begin, 0)]);
    let mut open = vec![begin];
    while let Some(at) = open.pop() {
        let mut depth: i64 = entered[&at];
        let Some(block) = blocks.get_mut(&at) else { continue };
        block.stack = depth;
        let mut after_return = None;
        for address in &block.addresses {
            let instruction = image.instructions[address];
            // A return that is not taken leaves the stack as it was.
            if instruction.flow == Flow::MaybeReturn {
                after_return = Some(depth);
            }
            depth += instruction.pushed;
            block.stack = block.stack.max(depth);
            for call in block.calls.iter_mut().filter(|call| call.address == *address) {
                call.depth = depth;
            }
        }
        let depth = after_return.unwrap_or(depth);
        for &next in &block.next.clone() {
            match entered.insert(next, depth) {
                None => open.push(next),
                Some(known) if known == depth => {}
                Some(known) => {
                    return Err(
                        format!("{name}: {known} or {depth} bytes of stack at {next:#x}").into()
                    );
                }
            }
        }
    }
    Ok(())
}

/// What is known of a loop.
pub struct Loop<'a> {
    /// The block at which it is entered.
    pub head: u32,
    pub blocks: &'a BTreeSet<u32>,
    /// Blocks from which it leads back to its head.
    pub back: Vec<u32>,
}

impl Loop<'_> {
    /// Whether it is decided at the end of each turn only whether there is another one.
    pub fn is_tested_at_end(&self, blocks: &Blocks) -> bool {
        let leaves =
            |block: u32| blocks[&block].next.iter().any(|next| !self.blocks.contains(next));
        self.back.iter().all(|&block| leaves(block))
            && (self.back == [self.head] || !leaves(self.head))
    }
}

/// The most that a way from `entry` to the end of each block costs. `cost` is that of a block, `returns` how often at most
/// a loop is led back to its head.
///
/// # Errors
/// A loop has several entries, or it is not known how often it turns.
pub fn longest(
    blocks: &Blocks,
    set: &BTreeSet<u32>,
    entry: u32,
    cost: &impl Fn(u32) -> u64,
    returns: &mut impl FnMut(&Loop<'_>) -> Result<u64, Box<dyn Error>>,
) -> Result<BTreeMap<u32, u64>, Box<dyn Error>> {
    let mut graph = DiGraphMap::<u32, ()>::new();
    for &at in set {
        graph.add_node(at);
        let inside = |next: &&u32| **next != entry && set.contains(next);
        for &next in blocks[&at].next.iter().filter(inside) {
            graph.add_edge(at, next, ());
        }
    }
    let mut found: BTreeMap<u32, u64> = BTreeMap::new();
    // The last of these components is entered first.
    for component in tarjan_scc(&graph).into_iter().rev() {
        let inner: BTreeSet<u32> = component.into_iter().collect();
        let before = |at: u32| {
            let ways = graph.neighbors_directed(at, petgraph::Incoming);
            ways.filter(|way| !inner.contains(way)).filter_map(|way| found.get(&way)).max().copied()
        };
        let entered: Vec<(u32, u64)> = inner
            .iter()
            .filter_map(|&at| if at == entry { Some((at, 0)) } else { Some((at, before(at)?)) })
            .collect();
        let [(head, spent)] = entered.as_slice() else {
            match entered.is_empty() {
                true => continue,
                false => return Err(format!("a loop with several entries: {entered:x?}").into()),
            }
        };
        let turns = |way: u32| blocks[&way].next.contains(head);
        let back: Vec<u32> = inner.iter().copied().filter(|&way| turns(way)).collect();
        if *head == entry || back.is_empty() {
            found.extend(inner.iter().map(|&at| (at, spent + cost(at))));
            continue;
        }
        let ways = longest(blocks, &inner, *head, cost, returns)?;
        let turn = back.iter().filter_map(|way| ways.get(way)).max().copied().unwrap_or(0);
        let count = returns(&Loop { head: *head, blocks: &inner, back })?;
        found.extend(ways.into_iter().map(|(at, way)| (at, spent + count * turn + way)));
    }
    Ok(found)
}
