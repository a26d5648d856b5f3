//! The instructions of a firmware image, and where each of them may lead.

use std::collections::BTreeMap;
use std::error::Error;
use std::ops::Range;

use capstone::arch::arm::{
    ArchExtraMode, ArchMode, ArmCC, ArmInsnDetail, ArmOperand, ArmOperandType,
};
use capstone::arch::{BuildsCapstone, BuildsCapstoneExtraMode, DetailsArchInsn};
use capstone::{Capstone, Insn, RegId};
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};

/// Where an instruction leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// To the next one.
    Next,
    /// To another one of the same function, or, of a function without a frame of its own left, into another function.
    Jump(u32),
    /// To another one or to the next one.
    Branch(u32),
    /// Into a function, then to the next one.
    Call(u32),
    /// Out of the function.
    Return,
    /// Out of the function, or to the next one.
    MaybeReturn,
}

/// An instruction.
#[derive(Clone, Copy, Debug)]
pub struct Instruction {
    pub length: u32,
    pub flow: Flow,
    /// By how many bytes the stack grows.
    pub pushed: i64,
}

/// A firmware image for a Cortex-M.
pub struct Image {
    /// Name and addresses of each function, by its address.
    pub functions: BTreeMap<u32, (String, Range<u32>)>,
    pub instructions: BTreeMap<u32, Instruction>,
}

impl Image {
    /// Reads an ELF image.
    ///
    /// # Errors
    /// It is none, or an instruction leads nobody knows where.
    pub fn read(bytes: &[u8]) -> Result<Self, Box<dyn Error>> {
        let file = object::File::parse(bytes)?;
        let mut functions = BTreeMap::new();
        for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text) {
            // The lowest bit of an address says that the instructions are those of Thumb.
            let begin = u32::try_from(symbol.address())? & !1;
            let end = begin + u32::try_from(symbol.size())?;
            let name = symbol.name()?.to_owned();
            if symbol.size() > 0 || !functions.contains_key(&begin) {
                functions.insert(begin, (name, begin..end));
            }
        }
        let engine = Capstone::new()
            .arm()
            .mode(ArchMode::Thumb)
            .extra_mode([ArchExtraMode::MClass].into_iter())
            .detail(true)
            .build()?;
        let mut instructions = BTreeMap::new();
        for section in file.sections().filter(|section| section.kind() == object::SectionKind::Text)
        {
            let (data, base) = (section.data()?, u32::try_from(section.address())?);
            for range in code(&file, base..base + u32::try_from(data.len())?) {
                let part = &data[(range.start - base) as usize..(range.end - base) as usize];
                for found in engine.disasm_all(part, u64::from(range.start))?.iter() {
                    let instruction = instruction(&engine, found)?;
                    instructions.insert(u32::try_from(found.address())?, instruction);
                }
            }
        }
        Ok(Self { functions, instructions })
    }

    /// The function of this name.
    pub fn function(&self, wanted: &str) -> Option<u32> {
        self.functions.iter().find(|(_, (name, _))| name == wanted).map(|(&begin, _)| begin)
    }
}

/// The parts of a section that are instructions: the symbols `$t` and `$d` begin instructions and data.
fn code(file: &object::File<'_>, section: Range<u32>) -> Vec<Range<u32>> {
    let mut marks = BTreeMap::new();
    for symbol in file.symbols() {
        let (Ok(name), Ok(address)) = (symbol.name(), u32::try_from(symbol.address())) else {
            continue;
        };
        if section.contains(&address) && (name.starts_with("$t") || name.starts_with("$d")) {
            marks.insert(address, name.starts_with("$t"));
        }
    }
    let ends = marks.keys().skip(1).copied().chain([section.end]);
    marks
        .iter()
        .zip(ends)
        .filter(|((_, is_code), _)| **is_code)
        .map(|((&begin, _), end)| begin..end)
        .collect()
}

fn instruction(engine: &Capstone, found: &Insn<'_>) -> Result<Instruction, Box<dyn Error>> {
    let detail = engine.insn_detail(found)?;
    let arch = detail.arch_detail();
    let detail = arch.arm().ok_or("not an instruction for Arm")?;
    let operands: Vec<ArmOperand> = detail.operands().collect();
    let name = found.mnemonic().unwrap_or_default();
    let name = name.split('.').next().unwrap_or_default();
    let reader = Reader { engine, found, detail, operands };
    Ok(Instruction {
        length: u32::try_from(found.bytes().len())?,
        flow: reader.flow(name)?,
        pushed: reader.pushed(name)?,
    })
}

struct Reader<'a> {
    engine: &'a Capstone,
    found: &'a Insn<'a>,
    detail: &'a ArmInsnDetail<'a>,
    operands: Vec<ArmOperand>,
}

impl Reader<'_> {
    /// The name of a register.
    fn name(&self, register: RegId) -> String {
        self.engine.reg_name(register).unwrap_or_default()
    }

    /// The names of the registers among the operands.
    fn registers(&self) -> Vec<String> {
        let registers = self.operands.iter().filter_map(|operand| match operand.op_type {
            ArmOperandType::Reg(register) => Some(self.name(register)),
            _ => None,
        });
        registers.collect()
    }

    fn immediate(&self) -> Option<i64> {
        self.operands.iter().rev().find_map(|operand| match operand.op_type {
            ArmOperandType::Imm(value) => Some(i64::from(value)),
            _ => None,
        })
    }

    fn unknown(&self) -> Box<dyn Error> {
        format!("it is not known where this leads: {}", self.found).into()
    }

    fn flow(&self, name: &str) -> Result<Flow, Box<dyn Error>> {
        let is_certain = matches!(self.detail.cc(), ArmCC::ARM_CC_AL | ArmCC::ARM_CC_INVALID);
        let target = || self.immediate().map(|target| target as u32 & !1).ok_or(self.unknown());
        let left = if is_certain { Flow::Return } else { Flow::MaybeReturn };
        let registers = self.registers();
        Ok(match name {
            "cbz" | "cbnz" => Flow::Branch(target()?),
            "bl" => Flow::Call(target()?),
            "bx" if registers == ["lr"] => left,
            "bx" | "blx" | "tbb" | "tbh" => return Err(self.unknown()),
            _ if name.starts_with('b') && self.is_jump() => match is_certain {
                true => Flow::Jump(target()?),
                false => Flow::Branch(target()?),
            },
            "ldr" if registers.first().is_some_and(|register| register == "pc") => {
                if self.is_on_stack() { left } else { return Err(self.unknown()) }
            }
            _ if self.writes_counter(name, &registers) => left,
            _ => Flow::Next,
        })
    }

    /// Whether this is a branch to an address that it contains.
    fn is_jump(&self) -> bool {
        matches!(self.operands.as_slice(), [ArmOperand { op_type: ArmOperandType::Imm(_), .. }])
    }

    /// Whether this addresses the stack.
    fn is_on_stack(&self) -> bool {
        self.operands.iter().any(|operand| match operand.op_type {
            ArmOperandType::Mem(address) => self.name(address.base()) == "sp",
            _ => false,
        })
    }

    /// Whether this loads several registers, and the return address among them.
    fn writes_counter(&self, name: &str, registers: &[String]) -> bool {
        let loads = name.starts_with("pop") || name.starts_with("ldm");
        loads && registers.iter().any(|register| register == "pc")
    }

    fn pushed(&self, name: &str) -> Result<i64, Box<dyn Error>> {
        let registers = self.registers();
        let width = |register: &String| if register.starts_with('d') { 8 } else { 4 };
        let bytes: i64 = registers.iter().map(width).sum();
        let on_stack = registers.first().is_some_and(|register| register == "sp");
        let stored = bytes - 4;
        let is = |prefix: &str| name.starts_with(prefix);
        Ok(match () {
            () if is("push") || is("vpush") => bytes,
            () if is("pop") || is("vpop") => -bytes,
            () if on_stack && (is("stmdb") || is("vstmdb")) => stored,
            () if on_stack && (is("ldm") || is("vldm")) && self.detail.writeback() => -stored,
            () if is("sub") && on_stack => self.immediate().ok_or(self.unknown())?,
            () if is("add") && on_stack => -self.immediate().ok_or(self.unknown())?,
            () if is("mov") && on_stack => return Err(self.unknown()),
            () if (is("str") || is("ldr")) && self.detail.writeback() => self.moved(),
            () => 0,
        })
    }

    /// The bytes by which a load or a store moves the stack pointer that it addresses.
    fn moved(&self) -> i64 {
        let address = self.operands.iter().find_map(|operand| match operand.op_type {
            ArmOperandType::Mem(address) => Some(address),
            _ => None,
        });
        match address {
            Some(address) if self.name(address.base()) == "sp" => {
                // Before the access it is part of the address, after it an operand of its own.
                -self.immediate().unwrap_or(i64::from(address.disp()))
            }
            _ => 0,
        }
    }
}
