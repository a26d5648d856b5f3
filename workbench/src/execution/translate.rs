//! A function of the program -> machine code over an array of cells.
//!
//! The code comes in parts of bounded length, so that the time to compile grows as the program
//! does. What one part computes and another needs goes through a cell, as do what the function
//! reads, its constants and its outputs; everything else stays in registers.

use std::collections::HashMap;
use std::mem;
use std::ops::Range;

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::types::F64;
use cranelift_codegen::ir::{self, AbiParam, FuncRef, InstBuilder, MemFlags, Signature};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::JITModule;
use cranelift_module::{Linkage, Module, ModuleError};

use super::Code;
use lamc::arithmetic;
use lamc::program::{Function, Op, Value};

/// What there is, or why the machine code cannot be had.
pub(super) type Translated<T> = Result<T, Box<ModuleError>>;

/// Operations of a part.
const PART: usize = 1000;

/// Defines functions of the host and lists them with their names and addresses.
macro_rules! host_functions {
    ($($name:ident($($x:ident),*) => $value:expr;)*) => {
        $(extern "C" fn $name($($x: f64),*) -> f64 {
            $value
        })*
        /// What machine code calls: the functions of [`Op::evaluate`].
        pub(super) const HOST_FUNCTIONS: &[(&str, fn() -> *const u8)] =
            &[$((concat!("lamc_", stringify!($name)), || $name as *const u8)),*];
    };
}

host_functions! {
    sin(x) => arithmetic::sin(x);
    cos(x) => arithmetic::cos(x);
    tan(x) => arithmetic::tan(x);
    exp(x) => arithmetic::exp(x);
    tanh(x) => arithmetic::tanh(x);
    ln(x) => arithmetic::ln(x);
    pow(x, y) => arithmetic::pow(x, y);
    atan2(y, x) => arithmetic::atan2(y, x);
}

/// The name of the host's function for an operation.
fn host_function(op: Op) -> Option<&'static str> {
    Some(match op {
        Op::Sin(_) => "lamc_sin",
        Op::Cos(_) => "lamc_cos",
        Op::Tan(_) => "lamc_tan",
        Op::Exp(_) => "lamc_exp",
        Op::Tanh(_) => "lamc_tanh",
        Op::Ln(_) => "lamc_ln",
        Op::Pow(..) => "lamc_pow",
        Op::Atan2(..) => "lamc_atan2",
        _ => return None,
    })
}

/// Compiles a function.
pub(super) fn function(module: &mut JITModule, function: &Function) -> Translated<Code> {
    let layout = Layout::new(function);
    let mut context = module.make_context();
    let mut builder = FunctionBuilderContext::new();
    let mut names = Vec::new();
    for range in parts(function.instructions.len()) {
        context.func.signature = module.make_signature();
        context.func.signature.params.push(AbiParam::new(module.isa().pointer_type()));
        let mut builder = FunctionBuilder::new(&mut context.func, &mut builder);
        Part::new(module, &mut builder, &layout, function).write(range)?;
        builder.finalize();
        let name = module.declare_anonymous_function(&context.func.signature)?;
        module.define_function(name, &mut context)?;
        module.clear_context(&mut context);
        names.push(name);
    }
    module.finalize_definitions()?;
    let address = |name| module.get_finalized_function(name);
    // SAFETY: the addresses are those of functions that take one pointer and return nothing, by
    // the calling convention of the host.
    #[allow(unsafe_code)]
    let code = |name| unsafe {
        mem::transmute::<*const u8, unsafe extern "C" fn(*mut f64)>(address(name))
    };
    Ok(Code {
        parts: names.into_iter().map(code).collect(),
        loads: layout.loads,
        cells: layout.initial.into(),
        outputs: layout.outputs,
    })
}

fn parts(instructions: usize) -> impl Iterator<Item = Range<usize>> {
    (0..instructions).step_by(PART).map(move |from| from..instructions.min(from + PART))
}

/// Which values have a cell.
struct Layout {
    loads: Vec<lamc::program::Slot>,
    /// Of each value, where it has one.
    cells: Vec<Option<usize>>,
    /// Constants where they belong, zeros elsewhere.
    initial: Vec<f64>,
    outputs: Vec<Vec<usize>>,
}

impl Layout {
    fn new(function: &Function) -> Self {
        let instructions = &function.instructions;
        let mut layout = Self {
            loads: Vec::new(),
            cells: vec![None; instructions.len()],
            initial: Vec::new(),
            outputs: Vec::new(),
        };
        for (index, instruction) in instructions.iter().enumerate() {
            if let Op::Load(slot) = instruction.op {
                layout.loads.push(slot);
                layout.cell(Value(index), 0.0);
            }
        }
        for (index, instruction) in instructions.iter().enumerate() {
            if let Op::Const(number) = instruction.op {
                layout.cell(Value(index), number);
            }
            for operand in instruction.op.operands() {
                if operand.index() / PART != index / PART {
                    layout.cell(operand, 0.0);
                }
            }
        }
        let mut outputs = Vec::new();
        for output in &function.outputs {
            outputs.push(output.entries.iter().map(|&entry| layout.cell(entry, 0.0)).collect());
        }
        layout.outputs = outputs;
        layout
    }

    /// The cell of a value, a new one if it has none.
    fn cell(&mut self, value: Value, initial: f64) -> usize {
        *self.cells[value.index()].get_or_insert_with(|| {
            self.initial.push(initial);
            self.initial.len() - 1
        })
    }
}

/// A part being written.
struct Part<'a, 'b> {
    module: &'a mut JITModule,
    builder: &'a mut FunctionBuilder<'b>,
    layout: &'a Layout,
    function: &'a Function,
    /// Where the cells begin.
    base: ir::Value,
    /// Values in registers.
    known: HashMap<usize, ir::Value>,
    host: HashMap<&'static str, FuncRef>,
}

impl<'a, 'b> Part<'a, 'b> {
    fn new(
        module: &'a mut JITModule,
        builder: &'a mut FunctionBuilder<'b>,
        layout: &'a Layout,
        function: &'a Function,
    ) -> Self {
        let block = builder.create_block();
        builder.append_block_params_for_function_params(block);
        builder.switch_to_block(block);
        builder.seal_block(block);
        let base = builder.block_params(block)[0];
        let (known, host) = (HashMap::new(), HashMap::new());
        Self { module, builder, layout, function, base, known, host }
    }

    fn write(mut self, range: Range<usize>) -> Translated<()> {
        for index in range {
            let op = self.function.instructions[index].op;
            if matches!(op, Op::Load(_) | Op::Const(_)) {
                continue;
            }
            let value = self.operation(op)?;
            self.known.insert(index, value);
            if let Some(cell) = self.layout.cells[index] {
                let offset = offset(cell)?;
                self.builder.ins().store(MemFlags::trusted(), value, self.base, offset);
            }
        }
        self.builder.ins().return_(&[]);
        Ok(())
    }

    /// A value computed in this part, or from its cell.
    fn value(&mut self, value: Value) -> Translated<ir::Value> {
        if let Some(&known) = self.known.get(&value.index()) {
            return Ok(known);
        }
        let Some(cell) = self.layout.cells[value.index()] else {
            unreachable!("what another part computes has a cell");
        };
        let read = self.builder.ins().load(F64, MemFlags::trusted(), self.base, offset(cell)?);
        self.known.insert(value.index(), read);
        Ok(read)
    }

    fn operation(&mut self, op: Op) -> Translated<ir::Value> {
        let operands = op.operands().map(|operand| self.value(operand));
        let operands = operands.collect::<Translated<Vec<_>>>()?;
        if let Some(name) = host_function(op) {
            return self.call(name, &operands);
        }
        let (x, y) = (operands[0], operands[operands.len() - 1]);
        Ok(match op {
            Op::Neg(_) => self.builder.ins().fneg(x),
            Op::Add(..) => self.builder.ins().fadd(x, y),
            Op::Sub(..) => self.builder.ins().fsub(x, y),
            Op::Mul(..) => self.builder.ins().fmul(x, y),
            Op::Div(..) => self.builder.ins().fdiv(x, y),
            Op::Sqrt(_) => self.builder.ins().sqrt(x),
            Op::Abs(_) => self.builder.ins().fabs(x),
            Op::Step(_) => {
                let [zero, one] = [0.0, 1.0].map(|number| self.builder.ins().f64const(number));
                let not_negative = self.choose(FloatCC::GreaterThanOrEqual, [x, zero], one, x);
                self.choose(FloatCC::LessThan, [x, zero], zero, not_negative)
            }
            // The sum is NaN if either is.
            Op::Min(..) => {
                let sum = self.builder.ins().fadd(x, y);
                let second = self.choose(FloatCC::LessThan, [y, x], y, sum);
                self.choose(FloatCC::LessThanOrEqual, [x, y], x, second)
            }
            Op::Max(..) => {
                let sum = self.builder.ins().fadd(x, y);
                let second = self.choose(FloatCC::GreaterThan, [y, x], y, sum);
                self.choose(FloatCC::GreaterThanOrEqual, [x, y], x, second)
            }
            Op::Const(_) | Op::Load(_) => unreachable!("constants and loads have cells"),
            Op::Sin(_)
            | Op::Cos(_)
            | Op::Tan(_)
            | Op::Exp(_)
            | Op::Tanh(_)
            | Op::Ln(_)
            | Op::Pow(..)
            | Op::Atan2(..) => unreachable!("the host's functions are called"),
        })
    }

    /// `then` where the comparison holds, else `otherwise`.
    fn choose(
        &mut self,
        comparison: FloatCC,
        [x, y]: [ir::Value; 2],
        then: ir::Value,
        otherwise: ir::Value,
    ) -> ir::Value {
        let holds = self.builder.ins().fcmp(comparison, x, y);
        self.builder.ins().select(holds, then, otherwise)
    }

    fn call(&mut self, name: &'static str, operands: &[ir::Value]) -> Translated<ir::Value> {
        let function = match self.host.get(name) {
            Some(&function) => function,
            None => {
                let mut signature: Signature = self.module.make_signature();
                signature.params.resize(operands.len(), AbiParam::new(F64));
                signature.returns.push(AbiParam::new(F64));
                let id = self.module.declare_function(name, Linkage::Import, &signature)?;
                let function = self.module.declare_func_in_func(id, self.builder.func);
                self.host.insert(name, function);
                function
            }
        };
        let call = self.builder.ins().call(function, operands);
        Ok(self.builder.inst_results(call)[0])
    }
}

/// Bytes from the first cell.
fn offset(cell: usize) -> Translated<i32> {
    i32::try_from(cell * size_of::<f64>())
        .map_err(|error| ModuleError::Backend(error.into()).into())
}
