//! The order of the sections.

use super::super::sections::sections;
use super::*;

proptest! {
    /// Operands precede their uses for all sections, and every section is contiguous.
    #[test]
    fn sections_stand_together(mut function in functions()) {
        let phases = [Phase::Formula, Phase::Velocity, Phase::MassMatrix];
        for (index, instruction) in function.instructions.iter_mut().enumerate() {
            instruction.section = Section::mechanism(phases[index % phases.len()]);
        }
        let ordered = sections(function.clone());
        prop_assert_eq!(ordered.instructions.len(), function.instructions.len());
        let mut done = Vec::new();
        let mut current = None;
        for (index, instruction) in ordered.instructions.iter().enumerate() {
            prop_assert!(instruction.op.operands().all(|operand| operand < Value(index)));
            if matches!(instruction.op, Op::Const(_) | Op::Load(_)) {
                continue;
            }
            if current != Some(instruction.section) {
                done.extend(current.replace(instruction.section));
            }
            prop_assert!(!done.contains(&instruction.section), "{:?} twice", instruction.section);
        }
    }
}

/// A section that was interrupted is put together; the first one stays first.
#[test]
fn what_was_interleaved_is_put_in_order() {
    let [first, second] = [Phase::Velocity, Phase::MassMatrix].map(Section::mechanism);
    let load = Op::Load(Slot::Position(CoordinateId(0)));
    let ops = [
        (load, first),
        (Op::Sin(Value(0)), first),
        (Op::Cos(Value(0)), second),
        (Op::Sqrt(Value(1)), first),
        (Op::Exp(Value(2)), second),
    ];
    let ordered = sections(function(ops, vec![Value(3), Value(4), Value(1), Value(2)]));
    let order: Vec<_> = ordered.instructions[1..].iter().map(|i| i.section).collect();
    assert_eq!(order, [first, first, second, second]);
}
