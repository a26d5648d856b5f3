//! The program as text: one line per instruction, stable between runs, under the heading of its
//! [`Section`](crate::kane::Section).

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
        writeln!(f, "function {:?}  ; {}", function.kind, function.cost())?;
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
        match slot {
            Slot::Time => "t".to_owned(),
            Slot::Position(id) => format!("q.{}", interface.joints[id.index()].name),
            Slot::Rate(id) => format!("u.{}", interface.joints[id.index()].name),
            Slot::Parameter(id) => interface.parameters[id.index()].name.clone(),
            Slot::Input(id) => interface.inputs[id.index()].clone(),
            Slot::Acceleration(id) => format!("a.{}", interface.joints[id.index()].name),
            Slot::Multiplier(row) => format!("lambda.{row}"),
            Slot::Change(moving) => format!(
                "d_{}",
                self.slot(match moving {
                    Moving::Time => Slot::Time,
                    Moving::Position(id) => Slot::Position(id),
                    Moving::Rate(id) => Slot::Rate(id),
                    Moving::Parameter(id) => Slot::Parameter(id),
                    Moving::Input(id) => Slot::Input(id),
                })
            ),
        }
    }
}
