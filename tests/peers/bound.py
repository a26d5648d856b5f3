"""A lower bound of the time: instructions of a compiled function, issue width, llvm-mca."""

import re
import shutil
import subprocess
import sys

# Zen 4: two pipes multiply and fuse, two others add, one of the former divides (AMD, Software
# Optimization Guide for the AMD Zen 4 Microarchitecture, 57647, section 2.11 and its table of
# instruction latencies).
MULTIPLIERS, ADDERS = 2, 2
DIVISION = 5
KINDS = {
    "fused": r"vfn?m(add|sub)",
    "multiplied": r"vmul[sp][sd]",
    "added": r"v(add|sub)[sp][sd]",
    "divided": r"v(div|sqrt)[sp][sd]",
    "moved": r"v?mov(u|a|s|d|q)",
    "called": r"call",
}


def disassembled(library, name):
    """The instructions of the function whose name ends so, with those of what it calls: the sines.

    What these call in turn is for angles beyond all bounds and left out.
    """
    text = subprocess.run(
        ["objdump", "--disassemble", "--no-show-raw-insn", "--demangle", str(library)],
        check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    functions = {}
    for address, symbol, body in re.findall(r"^(\w+) <(.*)>:\n((?:.+\n)+)", text, re.MULTILINE):
        lines = [line.split("\t", 1)[1].split("#")[0].strip() for line in body.splitlines()]
        functions[int(address, 16)] = symbol, lines
    named = [lines for symbol, lines in functions.values() if symbol.endswith(name)]
    if len(named) != 1:
        sys.exit(f"{library} has {len(named)} functions {name}")
    [own] = named
    found = []
    for instruction in own:
        found.append(instruction)
        call = re.match(r"call +([0-9a-f]+) ", instruction)
        if call and int(call[1], 16) in functions:
            found += functions[int(call[1], 16)][1]
    return found


def counts(instructions):
    found = {kind: 0 for kind in KINDS}
    for instruction in instructions:
        for kind, pattern in KINDS.items():
            found[kind] += re.match(pattern, instruction) is not None
    return {"total": len(instructions), **found}


def cycles(count):
    """A lower bound: every pipe is busy in every cycle."""
    multiplied = count["fused"] + count["multiplied"] + DIVISION * count["divided"]
    return max(
        multiplied / MULTIPLIERS,
        count["added"] / ADDERS,
        (multiplied + count["added"]) / (MULTIPLIERS + ADDERS),
    )


def mca(instructions):
    """Cycles by llvm-mca: of the busiest pipe, of one evaluation after another, of one alone. None
    if no llvm-mca supports this processor."""
    tools = [f"llvm-mca-{version}" for version in range(30, 15, -1)] + ["llvm-mca"]
    tool = next(filter(shutil.which, tools), None)
    if tool is None:
        return None
    # Branches and calls are left out: the rest is straight-line code.
    straight = [i for i in instructions if not re.match(r"(call|j\w+|ret|nop|int3|cs|data16)", i)]

    def simulated(iterations):
        done = subprocess.run(
            [tool, "-mcpu=native", f"-iterations={iterations}"], check=False,
            input="\n".join(straight), capture_output=True, text=True,
        )  # fmt: skip
        found = dict(re.findall(r"^([A-Z][\w ]+): +([\d.]+)$", done.stdout, re.MULTILINE))
        if "Total Cycles" not in found:
            return None
        return float(found["Total Cycles"]) / iterations, float(found["Block RThroughput"])

    streamed, alone = simulated(100), simulated(1)
    version = subprocess.run([tool, "--version"], check=True, capture_output=True, text=True).stdout
    return streamed and {
        "pipes": streamed[1],
        "streamed": streamed[0],
        "alone": alone[0],
        "version": re.search(r"LLVM version \S+", version)[0],
    }
