"""Energy by kind: the terms of the Hamiltonian one by one, computed from the frames of a run.

With r. = e omega and the shares of the discs in weights w, the kinetic energy is the sum over the discs of w rho |r.|^2/2
(translation), w alpha omega^2/2 (rolling) and, for own headings, w J phi.^2/2 (turning). V is the sum of the energies of the
springs, see `discs.chains.links` and `discs.chains.steered`.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from discs.arrays import Float
from discs.problem import Problem


def energy_by_kind(problem: Problem | None, run: Mapping[str, Any]) -> dict[str, Float]:
    """The energy of each kind, (F,); `run` has the arrays of a `Solution` by their names. ValueError if it lacks some."""
    if problem is None or "scene" in run["stats"]:
        raise ValueError(
            "energy_by_kind is of runs of discs, which know their problem: take simulate(problem, ...); of a field take "
            'solve(scene, want=("energy_density",))'
        )
    system = problem.system
    if any(run[name] is None for name in system.rates[2:]):
        raise ValueError(
            "this run lacks phi_rate, the rates of its headings, as archives of an older version do: compute it again for "
            "energy_by_kind"
        )
    found = []
    for frame, time in enumerate(run["t"]):
        at = np.array([run[name][frame] for name in system.rows])
        shape, turned = system.shape(at), [run[name][frame] for name in system.rates[2:]]
        if run["x_rate"] is None:
            moved = system.contact(shape) * run["omega"][frame]
        else:
            moved = run["x_rate"][frame], run["y_rate"][frame]
        kinetic = 0.5 * (system.weights * np.array([*moved, *turned]) ** 2).sum(axis=1)
        parts = {"translation": kinetic[0] + kinetic[1], "rolling": kinetic[2]}
        if len(kinetic) > 3:
            parts["turning"] = kinetic[3]
        parts |= system.springs(shape)
        if system.load is not None:
            parts["loads"] = system.load.potential(float(time), at)
        found.append(parts)
    return {kind: np.array([parts[kind] for parts in found]) for kind in found[0]}
