"""Times of programs that compute the same, in turns."""

import numpy as np


def measured(functions, model, quick):
    """Time per state, ns, in each round: every program has one batch in a round, and each round begins with another program."""
    batch, rounds = (3e5, 7) if quick else (2e6, 61)
    out = np.zeros_like(model.q)
    portions = {label: portion(function, model, batch) for label, function in functions.items()}
    times = {label: [] for label in functions}
    labels = list(functions)
    for k in range(rounds):
        for label in labels[k % len(labels) :] + labels[: k % len(labels)]:
            states, repeats = portions[label]
            q, u = model.q[:states], model.u[:states]
            times[label].append(functions[label].run(q, u, out, repeats))
    return times


def portion(function, model, batch):
    """The number of states, and of repetitions, that take about as long as a batch, ns."""
    out = np.zeros_like(model.q)
    states, repeats = 1, 1
    while True:
        # The first run of all reads the code from the disk.
        spent = min(
            function.run(model.q[:states], model.u[:states], out, repeats) * states * repeats
            for _ in range(2)
        )
        if spent > batch / 1.4:
            return states, repeats
        if states < len(model.q):
            states *= 2
        else:
            repeats *= 2
