"""`python -m discs.kernels`: compile all kernels ahead, once per machine, so that no run waits for it.

Those of gradients and Lyapunov exponents are among them (`discs.analysis.swept`). With `--tested` those that the short suite
runs: midpoint and Gauss methods for every chain (true curvature: midpoint), all kinds for the field law, without tangents.
"""

import argparse
import subprocess
import sys
from typing import Any

from discs.analysis.swept import prepare
from discs.chains.chain import Chain, SteeredChain
from discs.chains.rolling import ROLLING
from discs.integrators import METHODS, FixedStep, Integrator
from discs.kernels.slaved_lanes import MANY
from discs.problem import Problem, State
from discs.running.ensemble import simulate_many
from discs.simulation import simulate

ONES = ("length", "density", "spin_inertia", "torsion_stiffness", "bending_stiffness", "radius")
STEERED = ("heading_inertia", "stretch_stiffness", "shear_stiffness")


def sharing(law: str, tested: bool = False) -> list[list[Integrator]]:
    """All methods with a compiled form, or those whose kernels for chains of this law are tested.

    They are grouped by the kernels that they share: those with parameters of one type, and the adaptive ones that go step by step.
    """
    found: dict[type, list[Integrator]] = {}
    for method in (cls() for cls in METHODS.values()):
        if method.compiles:
            adaptive = type(method) if method.runs_whole else Integrator
            found.setdefault(type(method.parameters) if isinstance(method, FixedStep) else adaptive, []).append(method)
    some = TESTED[law] if tested else METHODS
    return [methods for methods in found.values() if any(method.name in some for method in methods)]


KINDS = {"slaved": (*ROLLING, "true"), "own": ("own",)}  # of chains; "true" is the true curvature with the unit law
TESTED = {  # by the short suite
    "field": tuple(METHODS),
    "unit": ("midpoint", "gauss6"),
    "true": ("midpoint",),
    "own": ("midpoint", "gauss6"),
}
SIZES = {"few": 9, "many": MANY}  # discs; many with slaved headings have kernels of their own, those in lanes


def compile_for(law: str, size: str, tested: bool) -> None:
    """Compile every kernel for one kind of chain, or those that are tested: slaved headings with a law, or "own" headings."""
    steered = law == "own"
    true = law == "true"
    slaved = "true curvature" if true else f"{law} law"
    words = "discs with own headings" if steered else f"discs with slaved headings, {slaved}"
    kind: dict[str, Any] = {"rolling": "unit", "curvature": "true"} if true else {"rolling": law}
    values: dict[str, Any] = dict.fromkeys(ONES + STEERED if steered else ONES, 1.0)
    n = SIZES[size]
    chain: Chain | SteeredChain = SteeredChain(n=n, **values) if steered else Chain(n=n, **values, **kind)
    problem = Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s, phi=0 * chain.s if steered else None), 0.01)  # at rest
    for methods in sharing(law, tested):
        first = methods[0]
        if n == MANY and not (isinstance(first, FixedStep) and first.in_lanes and problem.system.lanes):
            continue
        in_lanes = n != MANY and isinstance(first, FixedStep) and first.in_lanes
        if in_lanes and (not tested or (law, first.name) == ("field", "midpoint")):
            simulate_many([problem] * 3, first, 0.005, threads=1, progress=False)
            print(f"{words}, side by side: {', '.join(method.name for method in methods)} compiled", flush=True)
        for want in ((), "velocity"):  # frames asked for have kernels of their own
            simulate(problem, first, 0.005, frames=1, want=want, progress=False, engine="compiled")
        how = ", in lanes" if n == MANY else ""
        print(f"{words}{how}: {', '.join(method.name for method in methods)} compiled", flush=True)
        for method in [] if tested else methods:
            if method.name == "gauss4" or (method.name == "midpoint" and problem.system.quadratic):
                prepare(problem, method)
                print(f"{words}{how}: gradients by steps like those of {method.name} compiled", flush=True)


if __name__ == "__main__":
    asked = argparse.ArgumentParser(prog="python -m discs.kernels", description="Compile all kernels ahead, once per machine.")
    asked.add_argument(
        "kinds",
        nargs="*",
        metavar="KIND",
        help=f"of chains, {' or '.join(KINDS)}, or a law; without any all, side by side",
    )
    asked.add_argument("--discs", choices=SIZES, help="only those of few discs, or of many, in lanes (default: both)")
    asked.add_argument("--tested", action="store_true", help="only those that the short suite runs")
    given = asked.parse_args()
    laws = {law: (law,) for kind in KINDS.values() for law in kind}
    if unknown := set(given.kinds) - (KINDS | laws).keys():
        asked.error(f"KIND is {' or '.join(KINDS | laws)}; got {', '.join(sorted(unknown))}")
    for law in (law for kind in given.kinds for law in (KINDS | laws)[kind]):
        for size in [given.discs] if given.discs else SIZES:
            compile_for(law, size, given.tested)
    if not given.kinds:  # side by side
        command = [sys.executable, "-m", "discs.kernels", *["--tested"] * given.tested]
        kinds = [(law, size) for size in ([given.discs] if given.discs else SIZES) for law in laws]
        running = [subprocess.Popen([*command, law, "--discs", size]) for law, size in kinds]
        sys.exit(max(process.wait() for process in running))
