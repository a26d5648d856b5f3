//! The program as text: one line per instruction, stable between runs, under the heading of its
//! [`Section`](super::Section).

use std::fmt;

use super::ir::{Function, Moving, Op, Program, Slot};

impl fmt::Display for Program {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "program {}", self.interface.name)?;
        for function in &self.functions {
            writeln!(f)?;
            self.function(function, f)?;
        }
        Ok(())
    }
}

impl Program {
    fn function(&self, function: &Function, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let signature = function.kind.signature();
        let inputs: Vec<_> =
            function.kind.inputs(&self.interface).map(|input| input.name()).collect();
        writeln!(f, "function {}({})  ; {}", signature.name, inputs.join(", "), function.cost())?;
        let mut section = None;
        for (index, instruction) in function.instructions.iter().enumerate() {
            if section.replace(instruction.section) != Some(instruction.section) {
                let heading = instruction.section.heading(&self.interface.nodes);
                writeln!(f, "  ; {heading}")?;
            }
            write!(f, "  v{index} = {}", instruction.op.mnemonic())?;
            match instruction.op {
                Op::Const(number) => write!(f, " {number:?}")?,
                Op::Load(slot) => write!(f, " {}", self.slot(slot))?,
                op => {
                    for (position, operand) in op.operands().enumerate() {
                        let separator = if position == 0 { " " } else { ", " };
                        write!(f, "{separator}v{}", operand.index())?;
                    }
                }
            }
            match &instruction.name {
                Some(name) => writeln!(f, "  ; {name}")?,
                None => writeln!(f)?,
            }
        }
        for output in &function.outputs {
            write!(f, "  {} {}x{} =", output.name, output.rows, output.columns)?;
            for entry in &output.entries {
                write!(f, " v{}", entry.index())?;
            }
            writeln!(f)?;
        }
        Ok(())
    }

    fn slot(&self, slot: Slot) -> String {
        let interface = &self.interface;
        let (argument, index) = slot.place();
        let element = match slot {
            Slot::Position(id) => interface.coordinate_name(id),
            Slot::Rate(id)
            | Slot::Acceleration(id)
            | Slot::Change(Moving::Position(id) | Moving::Rate(id)) => interface.speed_name(id),
            Slot::Parameter(id) | Slot::Change(Moving::Parameter(id)) => {
                interface.parameters[id.index()].name.clone()
            }
            Slot::Input(id) | Slot::Change(Moving::Input(id)) => {
                interface.inputs[id.index()].clone()
            }
            Slot::Multiplier(_) | Slot::Memory(_) | Slot::Drawn(_) => index.to_string(),
            Slot::Time | Slot::Change(Moving::Time) => return argument.name().to_owned(),
        };
        format!("{}.{element}", argument.name())
    }
}
