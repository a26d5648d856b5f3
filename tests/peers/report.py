"""Results as Markdown, as plots, and in docs/PERFORMANCE.md."""

import math
import re

import bound
import peers as p

DOCUMENT = p.WORKSPACE / "docs" / "PERFORMANCE.md"
FIGURES = p.WORKSPACE / "docs" / "figures"
COLUMNS = ("CasADi", "CasADi by hand", "MuJoCo", "Pinocchio, g++", "Pinocchio, clang++")
NAMES = {
    "sixbar": "six-bar",
    "free_sixbar": "free six-bar",
}
# Of sheets: kind, its name, the largest exponent of the number of hinges with which times grow, and the sheets between which
# it is taken.
GROWTH = (
    ("miura", "Miura", 1.1, ("6x6", "20x20")),
    ("yoshimura", "Yoshimura", 1.5, ("4x5", "12x12")),
)
# How many times as long Pinocchio's lcaba takes at least.
TIMES_LCABA = {
    "miura3x3": 15, "miura4x4": 20, "miura6x6": 20, "miura8x8": 25, "miura12x12": 40,
    "yoshimura4x5": 5, "yoshimura8x8": 5,
}  # fmt: skip
# How many accelerations a step of RK4 with its projection takes at most.
MOST_OF_STEP = 6
# What eight contact points may add to an acceleration, ns.
MOST_MORE = 150


def operations_of_sheet(found):
    """Operations of an acceleration that the compiler writes; "+" where the runtime forms matrices beside them."""
    reduction = found["operations"].get("reduction", {"total": 0})["total"]
    return f"{reduction} +" if reduction else found["operations"]["acceleration"]["total"]


def operations(check):
    """Operation counts per function out of `lamc check`."""
    counts = {}
    pattern = r"^  (\w+) +(\d+) operations: (\d+) add, (\d+) mul, (\d+) div, (\d+) sin_cos"
    for name, *numbers in re.findall(pattern, check, re.MULTILINE):
        keys = ("total", "add", "mul", "div", "sin_cos")
        counts[name] = dict(zip(keys, map(int, numbers)))
    return counts


def line(name, found):
    peers = ", ".join(
        f"{label} {entry['ns']:.0f} ns ({entry['ratio']:.2f})"
        for label, entry in found["peers"].items()
    )
    return f"{name}: {peers}"


def entries(found, label):
    """All entries whose label begins with this name."""
    peers = found["peers"].items()
    return [e for name, e in peers if name == label or name.startswith(f"{label}, ")]


def fastest(entries):
    return min(entries, key=lambda e: e["ns"], default=None)


def entry(found, label):
    """The fastest entry with this name."""
    return fastest(entries(found, label))


def table(head, rows):
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "\n".join("| " + " | ".join(map(str, cells)) + " |" for cells in lines)


def number(x):
    """Three digits, or all digits before the decimal point."""
    return f"{x:.0f}" if x >= 99.95 else f"{x:.3g}"


def ratios(results):
    rows = []
    for name, found in results["mechanisms"].items():
        row = [NAMES.get(name, name), number(found["peers"]["lamc"]["ns"])]
        for label in COLUMNS:
            peer = entry(found, label)
            row.append("" if peer is None else f"{number(peer['ns'])} ({peer['ratio']:.1f})")
        rows.append(row)
    return table(["ns (times lamc's)", "lamc", *COLUMNS], rows)


def own(results):
    rows = []
    for name, found in results["mechanisms"].items():
        counted = found["operations"]["acceleration"]["total"]
        cells = [
            f"{found['lamc'][f]['ratio']:.1f}"
            for f in ("chained_accelerations", "rk4_steps", "rodas_steps", "jacobians")
        ]
        seconds = [f"{found[key]:.2f}" for key in ("derivation_s", "compilation_s")]
        gcc = entry(found, "CasADi")
        gcc = f"{gcc['compilation']:.2f}" if gcc else ""
        size = f"{found['module_bytes'] / 1e3:.0f}"
        rows.append([NAMES.get(name, name), counted, *cells, size, *seconds, gcc])
    head = [
        "", "operations", "waiting", "RK4 step", "RODASP step", "derivatives", "module, kB", "derivation, s", "rustc, s",
        "gcc of CasADi, s",
    ]  # fmt: skip
    return table(head, rows)


def limits(results):
    """The bound of the six-bar: cycles by issue width, by llvm-mca, measured."""
    found = results["mechanisms"]["sixbar"]
    clock, count = results["machine"]["clock"], found["instructions"]
    least, measured = bound.cycles(count), found["peers"]["lamc"]["ns"] * clock
    rows = [
        ["instructions", count["total"]],
        *([kind, count[kind]] for kind in bound.KINDS),
        ["clock, GHz", f"{clock:.2f}"],
        ["cycles at least, by issue width", f"{least:.0f}"],
        ["ns at least", f"{least / clock:.0f}"],
    ]
    if found["mca"]:
        version = found["mca"]["version"]
        rows += [
            [f"cycles by llvm-mca ({version}), {what}", f"{found['mca'][key]:.0f}"]
            for what, key in (
                ("busiest pipe", "pipes"), ("one after another", "streamed"), ("alone", "alone"),
            )
        ]  # fmt: skip
    rows += [
        ["cycles measured", f"{measured:.0f}"],
        ["measured over least", f"{measured / least:.1f}"],
    ]
    return table(["six-bar", ""], rows)


def goals(results):
    """Targets, and what is reached. Rows without a measurement are left out."""
    mechanisms = results["mechanisms"]

    def ratio(name, label):
        found = mechanisms.get(name)
        peer = found and entry(found, label)
        return peer and peer["ratio"]

    def own_time(name):
        return mechanisms[name]["peers"]["lamc"]["ns"] if name in mechanisms else None

    def of(name, key):
        return mechanisms[name][key] if name in mechanisms else None

    six = mechanisms["sixbar"]
    ends = own_time("chain96"), own_time("chain24")
    least = bound.cycles(six["instructions"]) / results["machine"]["clock"]
    lcaba = ratio("sixbar", "Pinocchio, g++, lcaba")
    rk4, waiting = (
        six["lamc"][f]["ratio"] for f in ("rk4_steps", "chained_accelerations")
    )
    aims = [
        ("six-bar: times faster than CasADi", ">=", 3, ratio("sixbar", "CasADi")),
        ("six-bar: than CasADi by hand", ">=", 1.6, ratio("sixbar", "CasADi by hand")),
        ("six-bar: than MuJoCo", ">=", 30, ratio("sixbar", "MuJoCo")),
        ("six-bar: than Pinocchio's lcaba, g++", ">=", 25, lcaba),
        ("chain of 6: than CasADi", ">=", 2, ratio("chain6", "CasADi")),
        ("chain of 12: than CasADi", ">=", 2, ratio("chain12", "CasADi")),
        ("chain of 24: than CasADi", ">=", 4, ratio("chain24", "CasADi")),
        ("chain of 48: than Pinocchio's aba, g++", ">=", 4, ratio("chain48", "Pinocchio, g++")),
        ("96 hinges over 24", "<=", 4.6, ends[0] / ends[1] if all(ends) else None),
        ("six-bar: RK4 step over evaluation", "<=", 5.5, rk4),
        ("six-bar: RK4 step over evaluation that waits for the last", "<=", 5.5, rk4 / waiting),
        (
            "six-bar: acceleration in a lane of four",
            ">=",
            2.5,
            results["lanes"].get("acceleration"),
        ),
        ("six-bar: over its bound", "<=", 2, six["peers"]["lamc"]["ns"] / least),
        ("96 hinges: derivation, s", "<=", 5, of("chain96", "derivation_s")),
        ("96 hinges: rustc, s", "<=", 20, of("chain96", "compilation_s")),
    ]
    return targets(aims)


def targets(aims):
    """What is aimed at, and what is reached: those that were measured."""
    rows = []
    for what, sense, aim, reached in aims:
        if reached is not None:
            missed = reached < aim if sense == ">=" else reached > aim
            rows.append(
                [what, f"{sense} {aim}", f"{reached:.3g}" + (" (not met)" if missed else "")]
            )
    return table(["", "target", "reached"], rows)


def differences(results):
    rows = []
    for name, found in results["mechanisms"].items():
        row = [NAMES.get(name, name)]
        for label in ("lamc", *COLUMNS):
            all_of = [e["difference"] for e in entries(found, label)]
            row.append(f"{max(all_of):.0e}" if all_of else "")
        rows.append(row)
    return table(["", "lamc", *COLUMNS], rows)


def sheets(results):
    """Sheets, their growth, and targets."""
    rows = []
    for name, found in results["sheets"].items():
        own, lcaba = found["peers"]["lamc"], entry_of(found, "lcaba")
        others = [entry(found, "MuJoCo"), lcaba, entry_of(found, "constraintDynamics")]
        cells = [f"{number(e['ns'] / 1e3)} ({e['ratio']:.1f})" if e else "" for e in others]
        step = found["lamc"]["rk4_steps"]["ratio"]
        iterations = lcaba["iterations"] if lcaba else ""
        rows.append([
            sheet(name), found["n"], found["loops"], operations_of_sheet(found),
            number(own["ns"] / 1e3), f"{step:.1f}", *cells[:2], iterations, cells[2],
            f"{own['difference']:.0e}",
        ])  # fmt: skip
    head = [
        "us (times lamc's)", "hinges", "loops", "operations", "lamc", "RK4 step, accelerations", "MuJoCo", "Pinocchio, lcaba",
        "its iterations", "Pinocchio, constraintDynamics", "difference of lamc",
    ]  # fmt: skip
    return f"{machine(results)}\n\n{table(head, rows)}\n\n{sheet_goals(results)}"


def entry_of(found, algorithm):
    """The fastest entry of an algorithm, by whichever compiler."""
    return fastest(e for name, e in found["peers"].items() if name.endswith(algorithm))


def sheet(name):
    """miura3x3 as Miura 3x3."""
    for kind, shown, *_ in GROWTH:
        name = name.replace(kind, f"{shown} ")
    return name


def sheet_goals(results):
    """Targets of sheets."""
    found = results["sheets"]
    aims = []
    for name, least in TIMES_LCABA.items():
        peer = entry_of(found[name], "lcaba") if name in found else None
        if peer:
            aims.append((f"{sheet(name)}: times faster than lcaba", ">=", least, peer["ratio"]))
    for kind, shown, most, ends in GROWTH:
        small, large = (found.get(f"{kind}{end}") for end in ends)
        if small and large:
            times = math.log(large["peers"]["lamc"]["ns"] / small["peers"]["lamc"]["ns"])
            exponent = times / math.log(large["n"] / small["n"])
            what = f"{shown} {ends[0]} to {ends[1]}: time by hinges to the power of"
            aims.append((what, "<=", most, exponent))
    steps = [one["lamc"]["rk4_steps"]["ratio"] for one in found.values()]
    if steps:
        aims.append(("RK4 step over evaluation, most of all sheets", "<=", MOST_OF_STEP, max(steps)))
    return targets(aims)


def contacts(results):
    """Robots on the ground, of which the rows have what eight contact points cost and what MuJoCo takes."""
    labels = [
        "lamc, no contacts",
        "MuJoCo, no contacts",
        "lamc, eight points",
        "MuJoCo, eight spheres",
        "MuJoCo, a box",
    ]
    rows = []
    for name, found in results["contacts"].items():
        touching, ns = found["touching"], found["ns"]
        mean = sum(touching) / max(len(touching), 1)
        span = f"{min(touching)} to {max(touching)}, mean {mean:.1f}" if touching else ""
        for what, suffix in (("acceleration", ""), ("RK4 step", ", step")):
            row = [f"{NAMES.get(name, name)}: {what}", span]
            for label in labels[:2]:
                row.append(number(ns[label + suffix]) if label + suffix in ns else "")
            row.append(number(ns[f"lamc{suffix}"]))
            for label in (f"MuJoCo{suffix}", f"MuJoCo, box{suffix}"):
                ratio = found["ratio"].get(label)
                row.append("" if ratio is None else f"{number(ns[label])} ({ratio:.1f})")
            rows.append(row)
    shown = table(["ns (times lamc's)", "points that touch", *labels], rows)
    return f"{machine(results)}\n\n{shown}\n\n{contact_goals(results)}"


def contact_goals(results):
    """What eight contact points add."""
    rows = []
    for name, found in results["contacts"].items():
        reached, (touched, bare) = found["more_ns"], found["operations"]
        missed = "" if reached <= MOST_MORE else " (not met)"
        row = [NAMES.get(name, name), f"<= {MOST_MORE}", number(reached) + missed, touched - bare]
        rows.append(row)
    return table(["eight contact points", "target, ns more", "reached", "operations more"], rows)


def machine(results):
    m = results["machine"]
    packages = ", ".join(f"{name} {version}" for name, version in m["packages"].items())
    return (
        f"{m['date']}: {m['processor']} (family {m['family']}; {', '.join(m['flags'])}), "
        f"{m['processors']} processors, {m['clock']:.2f} GHz, Linux {m['kernel']}; "
        f"{'; '.join(m['compilers'])}; {packages}. lamc built for {m['profile']}."
    )


def tables(results):
    parts = (machine, ratios, sheets, own, limits, goals, contacts)
    return "\n\n".join(f(results) for f in parts) + "\n"


def document(results):
    """Replaces the text between markers, and draws the plots."""
    replace(results, (machine, ratios, sheets, own, limits, goals, differences, contacts))
    plots(results)
    plot_sheets(results)


def replace(results, parts):
    """Replaces the text between the markers of these parts."""
    text = DOCUMENT.read_text()
    for part in parts:
        name = part.__name__
        marked = rf"(<!-- {name} -->\n).*?(\n<!-- end -->)"
        replaced = rf"\1\n{part(results)}\n\2"
        text, count = re.subn(marked, replaced, text, flags=re.DOTALL)
        assert count == 1, f"{DOCUMENT} has {count} places for {name}"
    DOCUMENT.write_text(text)


def plots(results):
    """Draws the plots."""
    chains = [found for name, found in results["mechanisms"].items() if name.startswith("chain")]
    cost = {
        label: [(c["n"], e["ns"]) for c in chains if (e := entry(c, label))]
        for label in ("lamc", *COLUMNS)
    }
    plot("cost.svg", cost, "hinges of the chain", "ns per acceleration")
    seconds = {
        "derivation": [(c["n"], c["derivation_s"]) for c in chains],
        "rustc": [(c["n"], c["compilation_s"]) for c in chains],
        "gcc of CasADi": [(c["n"], e["compilation"]) for c in chains if (e := entry(c, "CasADi"))],
    }
    plot("compile_time.svg", seconds, "hinges of the chain", "s")


def plot_sheets(results):
    """Draws the plot of sheets."""
    curves = {}
    for kind, shown, *_ in GROWTH:
        of_kind = [found for name, found in results["sheets"].items() if name.startswith(kind)]
        for label in ("lamc", "MuJoCo", "lcaba", "constraintDynamics"):
            points = [(f["n"], e["ns"] / 1e3) for f in of_kind if (e := entry_of(f, label))]
            curves[f"{shown}, {label}"] = points
    plot("sheets.svg", curves, "hinges of the sheet", "us per acceleration")


def plot(name, curves, across, unit):
    """Draws curves over the number of hinges, with logarithmic axes."""
    import matplotlib

    matplotlib.use("svg")
    # The same bytes for the same numbers.
    matplotlib.rcParams["svg.hashsalt"] = name
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8, 4))
    for label, points in curves.items():
        if points:
            axes.loglog(*zip(*points), marker="o", markersize=3, label=label)
    ticks = sorted({n for points in curves.values() for n, _ in points})
    axes.set_xticks(ticks, map(str, ticks))
    axes.minorticks_off()
    axes.set_xlabel(across)
    axes.set_ylabel(unit)
    axes.grid(alpha=0.3)
    # Beside the curves, of which it would hide some.
    axes.legend(loc="center left", bbox_to_anchor=(1, 0.5), fontsize="small")
    figure.tight_layout()
    figure.savefig(FIGURES / name, metadata={"Date": None, "Creator": None})
    pyplot.close(figure)
