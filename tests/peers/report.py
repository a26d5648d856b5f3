"""Results as Markdown, as plots, and as docs/PERFORMANCE.md."""

import re

import peers as p


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
        f"{label} {entry['ns']:.0f} ns ({entry['ratio']:.1f})"
        for label, entry in found["peers"].items()
    )
    return f"{name}: {peers}"


def best(found, prefix):
    """The fastest whose name begins so."""
    entries = [e for label, e in found["peers"].items() if label.startswith(prefix)]
    return min(entries, key=lambda entry: entry["ns"], default=None)


COLUMNS = {
    "CasADi": lambda found: found["peers"].get("CasADi"),
    "CasADi by hand": lambda found: best(found, "CasADi by hand"),
    "MuJoCo": lambda found: best(found, "MuJoCo"),
    "Pinocchio": lambda found: best(found, "Pinocchio"),
}


def table(head, rows):
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "\n".join("| " + " | ".join(map(str, cells)) + " |" for cells in lines)


def significant(x, digits=3):
    """With as many digits as are worth reading."""
    if x >= 10 ** (digits - 1):
        return f"{x:.0f}"
    return f"{x:#.{digits}g}".rstrip(".")


def ratios(results):
    rows = []
    for name, found in results["mechanisms"].items():
        row = [name, significant(found["peers"]["lamc"]["ns"])]
        for column in COLUMNS.values():
            entry = column(found)
            cell = "" if entry is None else f"{significant(entry['ns'])} ({entry['ratio']:.1f})"
            row.append(cell)
        rows.append(row)
    return table(["ns (ratio)", "lamc", *COLUMNS], rows)


def own(results):
    rows = []
    for name, found in results["mechanisms"].items():
        cells = [f"{found['lamc'][f]['ratio']:.1f}" for f in ("rk4_steps", "jacobians")]
        seconds = [f"{found[key]:.2f}" for key in ("derivation_s", "compilation_s")]
        rows.append([name, *cells, *seconds, f"{found['module_bytes'] / 1e3:.0f}"])
    head = ["", "RK4 step", "derivatives", "derivation, s", "rustc, s", "module, kB"]
    return table(head, rows)


def tables(results):
    return f"{ratios(results)}\n\n{own(results)}\n"
