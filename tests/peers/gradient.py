"""The gradient of a motion of the six-bar: lamc beside CasADi.

Both take 200 steps of the classical Runge-Kutta method from the same state, and differentiate the sum of the last q and u by the
initial state and by the stiffness, damping and angle of rest of each hinge. lamc closes the loop after every step; CasADi's
motion does without, which is less work. CasADi's reverse mode (J. Andersson et al., "CasADi", 2019) goes through the steps
as `mapaccum` has them, in C by CasADi's code generator. What both compute is compared before times are.
"""

import json
import statistics
import time

import numpy as np
import peers as p
from model import Model

ROUNDS = 201
# The loop opens by the error of the method, which is all that differs.
TOLERANCE = 1e-6
FIXED = "stiffness: 0.0114, damping: 3.5e-06"
# A state away from rest: the export gives one in motion.
STATES = 1


def compare(options):
    """Checks and times both; prints what comes of it."""
    try:
        import casadi  # noqa: F401
    except ImportError as error:
        p.missing("CasADi", error)
        return
    path = p.WORK / "sixbar_gradient.yaml"
    text = (p.WORKSPACE / "examples" / "sixbar.yaml").read_text()
    assert text.count(FIXED) == 6
    names = [f"{letter}{joint}" for joint in range(6) for letter in "kbr"]
    for joint in range(6):
        own = f"stiffness: k{joint}, damping: b{joint}, rest: r{joint}"
        text = text.replace(FIXED, own, 1)
    values = dict(zip(names, 6 * [0.0114, 3.5e-6, 0.0]))
    path.write_text(text + f"\nparameters: {json.dumps(values)}\n")
    exported = p.WORK / "sixbar_gradient.json"
    exported.write_text(p.output(options.peers, "export", p.WORKSPACE / "examples" / "sixbar.yaml", STATES))
    gradients = options.peers.replace("peers", "gradients")
    lamc = json.loads(p.output(gradients, path, exported))
    casadi = casadi_gradient(exported, names, values, lamc)
    again = json.loads(p.output(gradients, path, exported))
    ours = {key: statistics.mean([lamc[key], again[key]]) for key in ("motion", "gradient")}
    rows = (("lamc", ours), ("CasADi", casadi))
    print(f"\n{'six-bar, 200 steps':20} {'motion':>10} {'gradient':>10} {'ratio':>6}")
    for label, times in rows:
        motion, gradient = (1e6 * times[key] for key in ("motion", "gradient"))
        print(f"{label:20} {motion:7.0f} us {gradient:7.0f} us {gradient / motion:6.2f}")
    print(f"CasADi's gradient takes {casadi['gradient'] / ours['gradient']:.1f} times as long as lamc's")


def casadi_gradient(exported, names, values, lamc):
    """Times of the motion and the gradient in C by CasADi, after a comparison with lamc's numbers."""
    import casadi as ca
    from casadi_code import Mechanics

    model = Model(exported)
    parameters = ca.SX.sym("p", len(names))
    by_name = dict(zip(names, ca.vertsplit(parameters)))
    for letter, attribute in zip("kbr", ("stiffness", "damping", "rest")):
        setattr(model, attribute, ca.vertcat(*(by_name[f"{letter}{j}"] for j in range(model.n))))
    mechanics = Mechanics(model, True)
    rate = mechanics.factored_acceleration(mechanics.closure_by_recursion)
    state = ca.vertcat(mechanics.q, mechanics.u)
    rates = ca.Function("rates", [state, parameters], [ca.vertcat(mechanics.u, rate)], {"cse": True})
    y, fixed = ca.MX.sym("y", 2 * model.n), ca.MX.sym("p", len(names))
    h = lamc["duration"] / lamc["steps"]
    k1 = rates(y, fixed)
    k2 = rates(y + h / 2 * k1, fixed)
    k3 = rates(y + h / 2 * k2, fixed)
    k4 = rates(y + h * k3, fixed)
    step = ca.Function("step", [y, fixed], [y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
    steps = lamc["steps"]
    ends = step.mapaccum("all", steps)(y, ca.repmat(fixed, 1, steps))
    last = ends[:, -1]
    motion = ca.Function("motion", [y, fixed], [last])
    total = ca.sum1(last)
    by_state, by_fixed = (ca.gradient(total, x) for x in (y, fixed))
    gradient = ca.Function("gradient", [y, fixed], [last, by_state, by_fixed])

    generator = ca.CodeGenerator("sixbar_gradient_casadi.c")
    generator.add(motion)
    generator.add(gradient)
    generator.generate(f"{p.WORK}/")
    source, library = p.WORK / "sixbar_gradient_casadi.c", p.WORK / "libsixbar_gradient_casadi.so"
    p.run("gcc", *p.C_FLAGS, source, "-o", library, "-lm")
    native = [ca.external(name, str(library)) for name in ("motion", "gradient")]
    at = np.concatenate([model.q[0], model.u[0]]), np.array([values[name] for name in names])
    end, by_state, by_fixed = (np.array(x).ravel() for x in native[1](*at))
    compared = (
        ("last state", end, lamc["q"] + lamc["u"]),
        ("parameters", by_fixed, lamc["by_parameters"]),
    )
    for what, theirs, ours in compared:
        error = np.abs(theirs - ours).max() / np.abs(ours).max()
        print(f"CasADi and lamc differ by {error:.1e} of the largest: {what}")
        assert error <= TOLERANCE, f"{what}: {theirs} is not {ours}"
    times = [[], []]
    for _ in range(ROUNDS):
        for function, spent in zip(native, times):
            buffer, evaluate = buffered(function, at)
            begin = time.perf_counter()
            evaluate()
            spent.append(time.perf_counter() - begin)
            del buffer
    return dict(zip(("motion", "gradient"), map(statistics.median, times)))


def buffered(function, arguments):
    """A call without conversions of its arguments."""
    buffer, evaluate = function.buffer()
    keep = [np.array(x, dtype=float) for x in arguments]
    for k, x in enumerate(keep):
        buffer.set_arg(k, memoryview(x))
    for k in range(function.n_out()):
        out = np.zeros(function.size_out(k)[0])
        buffer.set_res(k, memoryview(out))
        keep.append(out)
    return (buffer, keep), evaluate
