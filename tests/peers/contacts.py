"""Robots on the ground: what eight contact points cost lamc, and the same robots by MuJoCo with contacts on.

The two programs compute different forces. lamc's are a law of depth and velocity (docs/CONTACT.md), part of the equations.
MuJoCo's are the minimum of a convex function of the accelerations (E. Todorov, "Convex and analytically-invertible
dynamics with contacts and constraints", 2014), which its solver finds by iterations. Therefore accelerations are not
compared as they are. What is checked before anything is timed, at every state:

- both find the same points behind the plane, at the same places;
- without contacts, both compute the same accelerations;
- with lamc's contact forces applied to MuJoCo's bodies as outer forces, MuJoCo computes lamc's accelerations.

MuJoCo's loops are soft and leave out what speeds contribute: the six-bar's accelerations are compared at rest.
"""

import ctypes
import statistics

import numpy as np
import peers as p
import report
from model import Model
from timing import measured

STATES = 64
# Relative: of trees, and of the six-bar, whose loop yields by 1e-5 under contact forces.
TOLERANCE, SOFT = 1e-8, 3e-5
# Places of contact points, m.
PLACE = 1e-8
POINTS = 8
# Rest angles of joints of the six-bar, deg.
RESTS = {"west_south_west": -80, "south_east_east": 70}


def robots():
    """Names of the robots' types, and their models."""
    plate = (p.HERE / "plate.yaml").read_text()
    sixbar = (p.WORKSPACE / "examples" / "sixbar.yaml").read_text()
    [before, _] = sixbar.split("# A rough guess")
    assert before.count("fixed: true") == 1, "the six-bar has one fixed body"
    free = before.replace("fixed: true", "free: true")
    # Springs that keep it folded: near the flat state, which is singular, MuJoCo's loop differs too much.
    for joint, rest in RESTS.items():
        above, below = free.split(f"  {joint}:\n")
        free = f"{above}  {joint}:\n{below.replace('stiffness:', f'rest: {rest}, stiffness:', 1)}"
    on_the_ground = free + (p.HERE / "sixbar_contacts.yaml").read_text()
    return {"plate": ("Plate", plate), "free_sixbar": ("Sixbar", on_the_ground)}


def compare(options):
    """Checks and times all robots."""
    return {name: robot(name, *found, options) for name, found in robots().items()}


def robot(name, kind, text, options):
    path, bare = p.WORK / f"{name}_contacts.yaml", p.WORK / f"{name}_bare.yaml"
    path.write_text(text)
    bare.write_text(text.split("\ncontacts:\n")[0] + "\n")
    exported = p.WORK / f"{name}_contacts.json"
    exported.write_text(p.output(options.peers, "contacts", path, STATES))
    model = Model(exported, aligned=False)
    lamc = Lamc(options.lamc, kind, path, bare)
    functions = {
        "lamc": lamc.function("accelerations"),
        "lamc, no contacts": lamc.function("bare_accelerations"),
        "lamc, step": lamc.function("rk4_steps"),
        "lamc, no contacts, step": lamc.function("bare_rk4_steps"),
    }
    error = difference(functions["lamc"].results(model.q, model.u), model.acceleration)
    assert error <= 1e-9, f"{name}: the module differs from its interpreter by {error:.1e}"
    touching, found = mujoco_functions(name, model, functions["lamc, no contacts"])
    functions |= found
    times = measured(functions, model, options.quick)
    own = lambda label: np.array(times["lamc, step" if ", step" in label else "lamc"])
    more = np.array(times["lamc"]) - np.array(times["lamc, no contacts"])
    return {
        "states": len(model.q),
        "touching": touching,
        "operations": lamc.operations,
        "ns": {label: statistics.median(of) for label, of in times.items()},
        "more_ns": float(np.median(more)),
        "ratio": {label: float(np.median(np.array(of) / own(label))) for label, of in times.items()},
    }


class Function:
    """A function of states whose coordinates and speeds have an order of their own."""

    def __init__(self, call, to_q=lambda q: q, order=slice(None)):
        self.call, self.to_q, self.order = call, to_q, order

    def run(self, q, u, out, repeats):
        """Nanoseconds of processor time per state."""
        q, u = (np.ascontiguousarray(x) for x in (self.to_q(q), u[:, self.order]))
        count = [ctypes.c_long(len(q)), ctypes.c_long(repeats)]
        begin = p.time.thread_time_ns()
        self.call(p.pointer(q), p.pointer(u), p.pointer(out), *count)
        return (p.time.thread_time_ns() - begin) / (len(q) * repeats)

    def results(self, q, u):
        """What it computes, in lamc's order."""
        out = np.full_like(u, np.nan)
        self.run(q, u, out, 1)
        ordered = np.empty_like(out)
        ordered[:, self.order] = out
        return ordered


def difference(found, expected):
    """The largest difference relative to the largest component of each state; infinite if a result is not finite."""
    error = (np.abs(found - expected).max(axis=1) / np.abs(expected).max(axis=1)).max()
    return error if np.isfinite(error) else np.inf


class Lamc:
    """The modules with and without contacts, compiled for this processor."""

    def __init__(self, lamc, kind, path, bare):
        modules = [(path, p.WORK / f"{path.stem}.rs"), (bare, p.WORK / f"{bare.stem}.rs")]
        for source, module in modules:
            only = ["--functions", "acceleration,projection"]
            p.run(lamc, source, "-o", module, "--scalar", "f64", *only)
        named, library = p.WORK / f"{path.stem}_model.rs", p.WORK / f"lib{path.stem}.so"
        named.write_text("".join(
            f'mod {name} {{ include!("{module}"); }}\nuse {name}::{kind} as {short};\n'
            for name, short, (_, module) in zip(("module", "bare"), ("Model", "Bare"), modules)
        ))  # fmt: skip
        p.compiled(p.HERE / "contacts.rs", named, library, path.stem)
        self.library = ctypes.CDLL(str(library))
        counts = [report.operations(p.output(lamc, "check", source)) for source, _ in modules]
        self.operations = [count["acceleration"]["total"] for count in counts]

    def function(self, name):
        return Function(getattr(self.library, name))


def mujoco_functions(name, model, bare):
    """Numbers of touching points, and the functions of MuJoCo. Its solver starts from the solution of the same state, the
    best that a simulation with short steps can do for it."""
    try:
        import mujoco
    except ImportError as error:
        p.missing("MuJoCo", error)
        return [], {}
    from mujoco_model import write

    engine = p.mujoco_library(mujoco)
    xml = p.WORK / f"{name}_contacts.xml"
    order = write(model, str(xml))
    simulated = Simulated(mujoco, xml, model, order)
    touching = simulated.check(name, bare)
    variants = {"MuJoCo": xml, "MuJoCo, no contacts": p.WORK / f"{name}_bare.xml"}
    write(model, str(variants["MuJoCo, no contacts"]), touches=False)
    if name == "plate":
        variants["MuJoCo, box"] = p.WORK / f"{name}_box.xml"
        write(model, str(variants["MuJoCo, box"]), boxes=[box(model)])
        boxed = Simulated(mujoco, variants["MuJoCo, box"], model, order)
        assert boxed.counts() == touching, "MuJoCo's box touches at other numbers of points"
    functions = {}
    for label, path in variants.items():
        handle = ctypes.c_void_p(engine.create(str(path).encode()))
        functions |= simulated.functions(label, engine, handle, model)
    return touching, functions


def box(model):
    """The half sizes and the centre of the box whose corners touch, on the only node."""
    corners = np.array([point["at"] for point in model.contact["points"]]) - model.nodes[0].origin
    low, high = corners.min(axis=0), corners.max(axis=0)
    return 0, (high - low) / 2, (high + low) / 2


class Simulated:
    """A robot in MuJoCo, with lamc's states."""

    def __init__(self, mujoco, xml, model, order):
        self.mujoco, self.model = mujoco, model
        self.engine = mujoco.MjModel.from_xml_path(str(xml))
        self.data = mujoco.MjData(self.engine)
        n, origin = model.n, model.nodes[0].origin
        # MuJoCo has the free body first, and its position in place of its displacement.
        self.order = [*range(n, n + 6), *order]
        moved = np.concatenate([origin, np.zeros(4 + n)])
        self.to_q = lambda q: q[:, [*range(n, n + 7), *order]] + moved
        self.q, self.u = self.to_q(model.q), model.u[:, self.order]

    def accelerations(self, u, forces=None):
        """Without contacts, and with these forces at lamc's contact points, in lamc's order."""
        engine, data, points = self.engine, self.data, self.model.contact["points"]
        off = int(self.mujoco.mjtDisableBit.mjDSBL_CONTACT)
        engine.opt.disableflags |= off
        found = np.empty_like(u)
        for state, q in enumerate(self.q):
            data.qpos[:], data.qvel[:] = q, u[state]
            data.qfrc_applied[:] = 0
            self.mujoco.mj_forward(engine, data)
            for point, row in zip(points, [] if forces is None else forces[state]):
                body = self.body(point)
                self.mujoco.mj_applyFT(
                    engine, data, row[3:], np.zeros(3), row[:3], body, data.qfrc_applied
                )
            self.mujoco.mj_forward(engine, data)
            found[state, self.order] = data.qacc
        data.qfrc_applied[:] = 0
        engine.opt.disableflags &= ~off
        return found

    def body(self, point):
        return self.engine.body(f"n{point['node']}").id

    def check(self, name, bare):
        """Refuses to compare robots that differ. Returns the number of points that touch at each state."""
        model, contact = self.model, self.model.contact
        rows = model.contacts.reshape(len(model.q), -1, 6)
        assert rows.shape[1] == POINTS, f"{name}: {rows.shape[1]} points instead of {POINTS}"
        heights = (rows[:, :, :3] - contact["point"]) @ contact["normal"]
        shapes = [self.engine.geom(f"p{k}").id for k in range(POINTS)]
        place, touching = 0.0, []
        for state, (q, u) in enumerate(zip(self.q, self.u)):
            self.data.qpos[:], self.data.qvel[:] = q, u
            self.mujoco.mj_forward(self.engine, self.data)
            away = self.data.geom_xpos[shapes] - rows[state, :, :3]
            place = max(place, np.abs(away).max())
            ours = set(np.flatnonzero(heights[state] < 0))
            # The plane is the other one of each pair.
            theirs = {shapes.index(id) for pair in self.data.contact.geom for id in pair if id in shapes}
            assert ours == theirs, f"{name}, state {state}: lamc has {ours} behind the plane, MuJoCo {theirs}"
            pushing = set(np.flatnonzero(np.abs(rows[state, :, 3:]).max(axis=1) > 0))
            assert pushing == ours, f"{name}, state {state}: of {ours} only {pushing} push"
            touching.append(len(ours))
        assert place <= PLACE, f"{name}: a contact point is {place:.1e} m away"
        self.check_accelerations(name, bare, rows)
        return touching

    def counts(self):
        """The number of points that touch at each state."""
        found = []
        for q, u in zip(self.q, self.u):
            self.data.qpos[:], self.data.qvel[:] = q, u
            self.mujoco.mj_forward(self.engine, self.data)
            found.append(self.data.ncon)
        return found

    def check_accelerations(self, name, bare, rows):
        model = self.model
        allowed = SOFT if model.loops else TOLERANCE
        u = np.zeros_like(model.u) if model.loops else model.u
        free = bare.results(model.q, u)
        errors = {"without contacts": difference(self.accelerations(u[:, self.order]), free)}
        expected = model.acceleration
        if model.loops:
            # The forces are those in motion; what they add to the accelerations depends on q alone.
            expected = expected - bare.results(model.q, model.u) + free
        forced = self.accelerations(u[:, self.order], rows)
        errors["with lamc's contact forces"] = difference(forced, expected)
        for what, error in errors.items():
            print(f"{name}: MuJoCo's accelerations {what} differ by {error:.1e}")
            assert error <= allowed, f"{name}: MuJoCo {what} differs by {error:.1e}"

    def functions(self, label, engine, handle, model):
        """Its acceleration and its step."""
        guesses = np.zeros_like(model.u)
        count = [ctypes.c_long(len(guesses)), ctypes.c_long(1)]
        for _ in range(2):
            q, u, start = (np.ascontiguousarray(x) for x in (self.q, self.u, guesses.copy()))
            engine.guessed_accelerations(handle, *map(p.pointer, (q, u, start, guesses)), *count)
        assert np.isfinite(guesses).all(), f"{label}: its accelerations are not finite"

        def started(function):
            call = lambda q, u, out, *count: function(handle, q, u, p.pointer(guesses), out, *count)
            return Function(call, self.to_q, self.order)

        steps = started(engine.guessed_steps)
        return {label: started(engine.guessed_accelerations), f"{label}, step": steps}
