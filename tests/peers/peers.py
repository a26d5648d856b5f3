"""The programs that are compared, each as a shared library built for this processor."""

import ctypes
import importlib.util
import os
import resource
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from model import Model

HERE = Path(__file__).parent
WORKSPACE = HERE.parent.parent
WORK = WORKSPACE / "target" / "peers"
EIGEN = Path("/usr/include/eigen3")
# Proximal iterations of Pinocchio at most, and the weights of the proximal term that its algorithms may have: with a greater one
# lcaba loses fewer digits to rounding, and needs more iterations.
ITERATIONS = 20
WEIGHTS = {"constraintDynamics": (1e-6,), "lcaba": (1e-1, 1.0, 10.0), "aba": (1e-6,)}
# Loops up to which programs are compared that have full matrices of all loops: constraintDynamics and MuJoCo, whose times grow
# as the third power of their number; and up to which lcaba is, whose memory does: 3.5 GB for 225 loops.
LOOPS = 60
LOOPS_OF_LCABA = 132
C_FLAGS = ["-O3", "-march=native", "-fno-semantic-interposition", "-shared", "-fPIC"]


@dataclass
class Peer:
    """A program: its name, its order of joints, the allowed difference from lamc's interpreter, and the call: q, u,
    out, states, repeats."""

    name: str
    order: list
    tolerance: float
    call: object
    # Whether it is compared at rest only.
    at_rest: bool = False

    def error(self, model):
        """Largest difference relative to the largest component of each state; infinite if a result is not finite."""
        u = np.zeros_like(model.u) if self.at_rest else model.u
        expected = model.acceleration_at_rest if self.at_rest else model.acceleration
        out = np.zeros_like(model.q)
        self.run(model.q, u, out, 1)
        difference = np.abs(out - expected[:, self.order]).max(axis=1)
        error = (difference / np.abs(expected).max(axis=1)).max()
        return error if np.isfinite(error) else np.inf

    def run(self, q, u, out, repeats):
        """Nanoseconds of processor time per state."""
        q, u = (np.ascontiguousarray(x[:, self.order]) for x in (q, u))
        begin = time.thread_time_ns()
        self.call(
            pointer(q), pointer(u), pointer(out), ctypes.c_long(len(q)), ctypes.c_long(repeats)
        )
        return (time.thread_time_ns() - begin) / (len(q) * repeats)


def pointer(array):
    return array.ctypes.data_as(ctypes.c_void_p)


def missing(name, why):
    print(f"NOT COMPARED: {name}: {why}", file=sys.stderr)


def run(*command, **options):
    """Seconds of processor time the command took."""
    begin = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [str(word) for word in command]
    done = subprocess.run(command, check=False, capture_output=True, text=True, **options)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    return end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime


def output(*command):
    return subprocess.run(
        list(map(str, command)), check=True, capture_output=True, text=True
    ).stdout


def outdated(target, *sources):
    return not target.exists() or any(
        source.stat().st_mtime > target.stat().st_mtime for source in sources
    )


class Lamc:
    """The module that lamc writes, compiled for this processor, and the time of both."""

    def __init__(self, lamc, name, path):
        module = WORK / f"{name}.rs"
        self.derivation = run(lamc, path, "-o", module, "--scalar", "f64")
        camel = "".join(word.capitalize() for word in name.split("_"))
        named, library = WORK / f"{name}_model.rs", WORK / f"lib{name}.so"
        named.write_text(f'mod module {{ include!("{module}"); }}\nuse module::{camel} as Model;\n')
        self.compilation = compiled(HERE / "lamc.rs", named, library, name)
        self.path, self.library = library, ctypes.CDLL(str(library))
        self.bytes = module.stat().st_size

    def peer(self, model):
        return Peer("lamc", list(range(model.n)), 1e-9, self.library.accelerations)

    def other(self, model, function):
        """Another function of the module, timed in the same way."""
        return Peer(function, list(range(model.n)), 1e-9, getattr(self.library, function))


def compiled(source, model, library, name):
    """Compiles a crate around modules of lamc, which `model` names. Returns seconds of processor time."""
    runtime = WORK / "runtime" / "release"
    return run(
        os.environ.get("RUSTC", "rustc"), "--edition", "2024", "--crate-type", "cdylib",
        "-A", "warnings", "-C", "opt-level=3", "-C", "target-cpu=native",
        "--crate-name", name, "--extern", f"lamc_runtime={runtime / 'liblamc_runtime.rlib'}",
        "-L", f"dependency={runtime / 'deps'}", "-o", library, source,
        env={**os.environ, "MODEL": str(model)},
    )  # fmt: skip


def native(command, *arguments):
    """The output of a cargo command, built in release mode for this processor."""
    target = ["--release", "--locked", "--target-dir", WORK / "runtime"]
    flags = {**os.environ, "RUSTFLAGS": "-C target-cpu=native"}
    words = map(str, ["cargo", command, *target, *arguments])
    done = subprocess.run(
        list(words), check=True, stdout=subprocess.PIPE, text=True, cwd=WORKSPACE, env=flags
    )
    return done.stdout


def casadi_peers(name, path, largest):
    """CasADi as an expert uses it in the drawing's frames, and tuned by hand: hinge-aligned frames,
    origins slid along the hinge lines, closure by recursion, the better of two eliminations."""
    try:
        import casadi as ca
    except ImportError as error:
        missing("CasADi", error)
        return {}
    from casadi_code import Mechanics

    peers = {}

    def add(label, tag, aligned, acceleration):
        model = Model(path, aligned)
        mechanics = Mechanics(model, aligned)
        function = ca.Function(
            "f", [mechanics.q, mechanics.u], [acceleration(mechanics)], {"cse": True}
        )
        stem = WORK / f"{name}_{tag}"
        generator = ca.CodeGenerator(f"{stem.name}.c")
        generator.add(function)
        generator.generate(f"{WORK}/")
        source = WORK / f"{name}_{tag}_states.c"
        source.write_text(STATES.format(
            code=f"{stem.name}.c", n=model.n, args=function.sz_arg(), results=function.sz_res(),
            work=function.sz_w() + 1, integers=function.sz_iw() + 1,
        ))  # fmt: skip
        library = WORK / f"lib{name}_{tag}.so"
        seconds = run("gcc", *C_FLAGS, source, "-o", library, "-lm")
        call = ctypes.CDLL(str(library)).accelerations
        peers[label] = (
            Peer(label, list(range(model.n)), 1e-9, call),
            {"instructions": function.n_instructions(), "compilation": seconds},
        )

    model = Model(path)
    if len(model.loops) > 1:
        missing("CasADi", f"rows of the loops of {name} depend on each other")
        return {}
    if model.loops:
        by_hand = [("recursion", lambda m: m.factored_acceleration(m.closure_by_recursion))]
        expert = lambda m: m.factored_acceleration(m.closure_by_differentiation)
    else:
        by_hand = [
            ("articulated", Mechanics.articulated_acceleration),
            ("factored", Mechanics.factored_acceleration),
        ]
        expert = Mechanics.factored_acceleration
    if model.n <= largest:
        add("CasADi", "casadi", False, expert)
    else:
        by_hand = by_hand[:1]
    for tag, acceleration in by_hand:
        add(f"CasADi by hand, {tag}", f"casadi_{tag}", True, acceleration)
    return peers


STATES = """#include "{code}"
void accelerations(const double *q, const double *u, double *a, long states, long repeats) {{
    static casadi_real w[{work}];
    static casadi_int iw[{integers}];
    const double *arg[{args}];
    double *res[{results}];
    for (long repeat = 0; repeat < repeats; repeat++) {{
        for (long state = 0; state < states; state++) {{
            arg[0] = q + {n} * state;
            arg[1] = u + {n} * state;
            res[0] = a + {n} * state;
            f(arg, res, iw, w, 0);
        }}
    }}
}}
"""


def mujoco_peers(name, path):
    """mj_forward, called from C. Its constraints are soft and leave out the acceleration bias of speeds: loops
    are compared at rest, with a tolerance for softness."""
    try:
        import mujoco
    except ImportError as error:
        missing("MuJoCo", error)
        return {}
    from mujoco_model import write

    model = Model(path)
    if len(model.loops) > LOOPS:
        missing("MuJoCo", f"{name} has more than {LOOPS} loops")
        return {}
    xml = WORK / f"{name}.xml"
    order = write(model, str(xml))
    lib = mujoco_library(mujoco)
    handle = ctypes.c_void_p(lib.create(str(xml).encode()))
    if not handle:
        missing("MuJoCo", f"{xml} is refused")
        return {}
    call = lambda *arguments: lib.accelerations(handle, *arguments)
    tolerance = 1e-5 if model.loops else 1e-8
    return {"MuJoCo": (Peer("MuJoCo", order, tolerance, call, at_rest=bool(model.loops)), {})}


def mujoco_library(mujoco):
    """The functions of mujoco.c."""
    folder = Path(mujoco.__file__).parent
    [engine] = folder.glob("libmujoco.so*")
    library = WORK / "libmujoco_states.so"
    if outdated(library, HERE / "mujoco.c"):
        run(
            "gcc", *C_FLAGS, f"-I{folder / 'include'}", HERE / "mujoco.c", "-o", library,
            engine, f"-Wl,-rpath,{folder}",
        )  # fmt: skip
    found = ctypes.CDLL(str(library))
    found.create.restype = ctypes.c_void_p
    return found


def pinocchio_library(compiler, prefix, quick):
    """None if Pinocchio is not installed."""
    library = WORK / f"libpinocchio_{compiler}.so"
    if not outdated(library, HERE / "pinocchio.cpp"):
        return library
    if quick:
        missing(f"Pinocchio, {compiler}", "--quick does not wait for its compilation")
    elif not EIGEN.is_dir():
        missing("Pinocchio", f"no {EIGEN}")
    elif shutil.which(compiler) is None:
        missing(f"Pinocchio, {compiler}", "there is no such compiler")
    else:
        print(f"compiling Pinocchio with {compiler}, which takes some minutes", file=sys.stderr)
        run(
            compiler, "-std=c++17", *C_FLAGS, "-DNDEBUG", "-w",
            "-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
            "-isystem", prefix / "include", "-isystem", EIGEN,
            HERE / "pinocchio.cpp", "-o", library,
            f"-L{prefix / 'lib'}", f"-Wl,-rpath,{prefix / 'lib'}", "-lpinocchio_default",
        )  # fmt: skip
        return library
    return None


def pinocchio_peers(name, path, quick):
    """aba for trees; for loops constraintDynamics and lcaba, whose constraints are proximal: as few
    iterations as reach the tolerance with one of the weights."""
    found = importlib.util.find_spec("pinocchio")
    if found is None:
        missing("Pinocchio", "no package of this name")
        return {}
    prefix = Path(found.origin).parents[4]
    model = Model(path)
    order = model.depth_first()
    at = {node: k for k, node in enumerate(order)}
    nodes = [model.nodes[i] for i in order]
    joints = [node.joint for node in nodes]
    ends = [[at[loop[end]] for end in ("original", "ghost")] for loop in model.loops]
    pairs = [(loop["ghost"], loop["original"]) for loop in model.loops]
    parents = [-1 if node.parent is None else at[node.parent] for node in nodes]
    doubles = lambda xs: np.ascontiguousarray(np.array(xs, dtype=float))
    integers = lambda xs: np.ascontiguousarray(np.array(xs, dtype=np.int32))
    arrays = [
        integers(parents), doubles([node.turn for node in nodes]),
        doubles([node.offset for node in nodes]), doubles([node.mass for node in nodes]),
        doubles([node.com for node in nodes]), doubles([node.inertia for node in nodes]),
        doubles(model.stiffness[joints]), doubles(model.damping[joints]),
        doubles(model.rest[joints]), doubles(model.gravity),
    ]  # fmt: skip
    loops = [
        integers(ends), doubles([model.between(*pair) for pair in pairs]),
        doubles([model.offset(*pair) for pair in pairs]),
    ]  # fmt: skip
    peers = {}

    def peer(compiler, lib, algorithm, function, mu, iterations, tolerance):
        handle = ctypes.c_void_p(lib.create(
            len(nodes), *map(pointer, arrays), len(model.loops), *map(pointer, loops),
            ctypes.c_double(mu), ctypes.c_double(1e-12), iterations,
        ))  # fmt: skip
        lib.prepare(handle, function)
        call = lambda *arguments: lib.accelerations(handle, function, *arguments)
        call.release = lambda: lib.destroy(handle)
        return Peer(f"Pinocchio, {compiler}, {algorithm}", joints, tolerance, call)

    def add(compiler, lib, algorithm, function, tolerance, most):
        choices = [(k, mu) for k in range(1, most + 1) for mu in WEIGHTS[algorithm]]
        for iterations, mu in choices:
            found = peer(compiler, lib, algorithm, function, mu, iterations, tolerance)
            if found.error(model) <= tolerance or (iterations, mu) == choices[-1]:
                break
            # lcaba needs gigabytes for the largest sheets.
            found.call.release()
        peers[found.name] = (found, {"iterations": iterations})

    for compiler in ("g++", "clang++"):
        library = pinocchio_library(compiler, prefix, quick)
        if library is None:
            continue
        lib = ctypes.CDLL(str(library))
        lib.create.restype = ctypes.c_void_p
        if model.loops:
            if len(model.loops) <= LOOPS:
                add(compiler, lib, "constraintDynamics", 1, tolerance=1e-7, most=ITERATIONS)
            if len(model.loops) <= LOOPS_OF_LCABA:
                add(compiler, lib, "lcaba", 2, tolerance=1e-7, most=ITERATIONS)
        else:
            add(compiler, lib, "aba", 0, tolerance=1e-8, most=1)
    return peers
