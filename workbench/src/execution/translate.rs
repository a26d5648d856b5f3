//! Translation of a function of the program to machine code over an array of cells.
//!
//! The code comes in parts of bounded length, so that the time to compile grows as the program
//! does. What one part computes and another needs goes through a cell, as do what the function
//! reads, its constants and its outputs; everything else stays in registers.

use std::collections::HashMap;
use std::mem;

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::types::{F64, Type};
use cranelift_codegen::ir::{
    self, AbiParam, FuncRef, InstBuilder, MemFlags, Signature, StackSlot, StackSlotData,
    StackSlotKind,
};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::JITModule;
use cranelift_module::{Linkage, Module, ModuleError};

use super::Code;
use lamc::arithmetic;
use lamc::program::{Angle, Function, Op, Parts, Slot, Value, angles};

/// A result, or the reason why there is no machine code.
pub(super) type Translated<T> = Result<T, Box<ModuleError>>;

/// The largest number of operations in a part.
const PART: usize = 1000;

/// The name of [`sin_cos`].
const SIN_COS: &str = "lamc_sin_cos";

/// Defines functions of the host and lists them with their names and addresses.
macro_rules! host_functions {
    ($($name:ident($($x:ident),*) => $value:expr;)*) => {
        $(extern "C" fn $name($($x: f64),*) -> f64 {
            $value
        })*
        /// The functions of the host that machine code calls: those of [`Op::evaluate`].
        pub(super) const HOST_FUNCTIONS: &[(&str, fn() -> *const u8)] = &[
            $((concat!("lamc_", stringify!($name)), || $name as *const u8),)*
            (SIN_COS, || sin_cos as *const u8),
        ];
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
fn function_of_host(op: Op) -> Option<&'static str> {
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

/// Writes the sine and the cosine of an angle next to each other, because nearly all code that needs one needs
/// the other.
#[allow(unsafe_code)]
unsafe extern "C" fn sin_cos(angle: f64, out: *mut [f64; 2]) {
    let (sine, cosine) = arithmetic::sin_cos(angle);
    // SAFETY: machine code hands over the address of a place of this size on its stack.
    unsafe { *out = [sine, cosine] }
}

/// Compiles a function.
pub(super) fn function(module: &mut JITModule, function: &Function) -> Translated<Code> {
    let layout = Layout::new(function);
    let mut context = module.make_context();
    let mut builder = FunctionBuilderContext::new();
    let mut names = Vec::new();
    for part in layout.parts.instructions() {
        context.func.signature = module.make_signature();
        context.func.signature.params.push(AbiParam::new(module.isa().pointer_type()));
        let mut builder = FunctionBuilder::new(&mut context.func, &mut builder);
        Part::new(module, &mut builder, &layout, function).write(&part)?;
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
        initial: layout.initial,
        outputs: layout.outputs,
    })
}

/// The values that have a cell: first those that are read, then constants and outputs, then those that one part
/// computes for another.
struct Layout {
    parts: Parts,
    loads: Vec<Slot>,
    /// The cell of each value that has one.
    cells: Vec<Option<usize>>,
    /// The initial cells: constants in their places, zeros elsewhere.
    initial: Vec<f64>,
    outputs: Vec<Vec<usize>>,
    /// For each angle whose sine and cosine are both needed, these two values.
    pairs: HashMap<Value, [Value; 2]>,
}

impl Layout {
    fn new(function: &Function) -> Self {
        let instructions = &function.instructions;
        let both = |pair: Angle| Some((pair.angle, [pair.sine?, pair.cosine?]));
        let mut layout = Self {
            parts: Parts::of_at_most(function, PART),
            loads: Vec::new(),
            cells: vec![None; instructions.len()],
            initial: Vec::new(),
            outputs: Vec::new(),
            pairs: angles(function).into_iter().filter_map(both).collect(),
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
        }
        let mut outputs = Vec::new();
        for output in &function.outputs {
            outputs.push(output.entries.iter().map(|&entry| layout.cell(entry, 0.0)).collect());
        }
        layout.outputs = outputs;
        // Cells of outputs are never used again, so that other parts may read these, too.
        let shared = layout.initial.len();
        for &(value, cell) in layout.parts.list.iter().flat_map(|part| &part.leaves) {
            layout.cells[value.index()].get_or_insert(shared + cell);
        }
        layout.initial.resize(shared + layout.parts.cells, 0.0);
        layout
    }

    /// Returns the cell of a value, and creates it if there is none.
    fn cell(&mut self, value: Value, initial: f64) -> usize {
        *self.cells[value.index()].get_or_insert_with(|| {
            self.initial.push(initial);
            self.initial.len() - 1
        })
    }
}

/// A part of a function while it is written.
struct Part<'a, 'b> {
    module: &'a mut JITModule,
    builder: &'a mut FunctionBuilder<'b>,
    layout: &'a Layout,
    function: &'a Function,
    /// The address of the first cell.
    base: ir::Value,
    /// The values that are in registers.
    known: HashMap<usize, ir::Value>,
    host: HashMap<&'static str, FuncRef>,
    /// The place on the stack to which [`sin_cos`] writes.
    pair: Option<StackSlot>,
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
        Self { module, builder, layout, function, base, known, host, pair: None }
    }

    fn write(mut self, instructions: &[Value]) -> Translated<()> {
        for &value in instructions {
            let op = self.function.instructions[value.index()].op;
            let is_done = self.known.contains_key(&value.index());
            if is_done || matches!(op, Op::Load(_) | Op::Const(_)) {
                continue;
            }
            if let Op::Sin(angle) | Op::Cos(angle) = op
                && let Some(&pair) = self.layout.pairs.get(&angle)
                && pair.contains(&value)
            {
                let results = self.sine_and_cosine(angle)?;
                for (value, result) in pair.into_iter().zip(results) {
                    self.keep(value, result)?;
                }
            } else {
                let result = self.operation(op)?;
                self.keep(value, result)?;
            }
        }
        self.builder.ins().return_(&[]);
        Ok(())
    }

    /// Remembers a value, and puts it into its cell if it has one.
    fn keep(&mut self, value: Value, result: ir::Value) -> Translated<()> {
        self.known.insert(value.index(), result);
        if let Some(cell) = self.layout.cells[value.index()] {
            self.builder.ins().store(MemFlags::trusted(), result, self.base, offset(cell)?);
        }
        Ok(())
    }

    /// Returns a value that was computed in this part, or loads it from its cell.
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

    /// Sine and cosine of an angle, by one call.
    fn sine_and_cosine(&mut self, angle: Value) -> Translated<[ir::Value; 2]> {
        let angle = self.value(angle)?;
        let pointer = self.module.isa().pointer_type();
        let size = size_of::<[f64; 2]>();
        let place = *self.pair.get_or_insert_with(|| {
            let alignment = align_of::<f64>().trailing_zeros() as u8;
            let data = StackSlotData::new(StackSlotKind::ExplicitSlot, size as u32, alignment);
            self.builder.create_sized_stack_slot(data)
        });
        let address = self.builder.ins().stack_addr(pointer, place, 0);
        let function = self.host_function(SIN_COS, &[F64, pointer], &[])?;
        self.builder.ins().call(function, &[angle, address]);
        Ok([0, size_of::<f64>() as i32].map(|at| self.builder.ins().stack_load(F64, place, at)))
    }

    fn operation(&mut self, op: Op) -> Translated<ir::Value> {
        let operands = op.operands().map(|operand| self.value(operand));
        let operands = operands.collect::<Translated<Vec<_>>>()?;
        if let Some(name) = function_of_host(op) {
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
        let function = self.host_function(name, &[F64, F64][..operands.len()], &[F64])?;
        let call = self.builder.ins().call(function, operands);
        Ok(self.builder.inst_results(call)[0])
    }

    /// A function of the host with these parameters and results, declared once in each part.
    fn host_function(
        &mut self,
        name: &'static str,
        parameters: &[Type],
        results: &[Type],
    ) -> Translated<FuncRef> {
        if let Some(&function) = self.host.get(name) {
            return Ok(function);
        }
        let mut signature: Signature = self.module.make_signature();
        signature.params.extend(parameters.iter().copied().map(AbiParam::new));
        signature.returns.extend(results.iter().copied().map(AbiParam::new));
        let id = self.module.declare_function(name, Linkage::Import, &signature)?;
        let function = self.module.declare_func_in_func(id, self.builder.func);
        self.host.insert(name, function);
        Ok(function)
    }
}

/// The offset of a cell, in bytes.
fn offset(cell: usize) -> Translated<i32> {
    i32::try_from(cell * size_of::<f64>())
        .map_err(|error| ModuleError::Backend(error.into()).into())
}
