"""`python -m discs.kernels`: compile all kernels ahead, once per machine, so that no run waits for it."""

import subprocess
import sys
from typing import Any

from discs.chains.chain import Chain, SteeredChain
from discs.chains.rolling import ROLLING
from discs.integrators import METHODS, FixedStep, Integrator
from discs.problem import Problem, State
from discs.simulation import simulate

ONES = ("length", "density", "spin_inertia", "torsion_stiffness", "bending_stiffness", "radius")
STEERED = ("heading_inertia", "stretch_stiffness", "shear_stiffness")


def sharing() -> list[list[Integrator]]:
    """All methods with a compiled form, grouped by the kernels that they share: those with parameters of one type, and the adaptive
    ones."""
    found: dict[type, list[Integrator]] = {}
    for method in (cls() for cls in METHODS.values()):
        if method.compiles:
            found.setdefault(type(method.parameters) if isinstance(method, FixedStep) else Integrator, []).append(method)
    return list(found.values())


KINDS = {"slaved": tuple(ROLLING), "own": ("own",)}  # of chains; laws in one process share what does not depend on the law


def compile_for(law: str) -> None:
    """Compile every kernel for one kind of chain: slaved headings with this law of rolling, or "own" headings."""
    steered = law == "own"
    values: dict[str, Any] = {"n": 9} | dict.fromkeys(ONES + STEERED if steered else ONES, 1.0)
    chain: Chain | SteeredChain = SteeredChain(**values) if steered else Chain(**values, rolling=law)
    words = "discs with own headings" if steered else f"discs with slaved headings, {law} law"
    problem = Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s, phi=0 * chain.s if steered else None), 0.01)  # at rest
    for methods in sharing():
        simulate(problem, methods[0], 0.005, frames=1, progress=False)
        print(f"{words}: {', '.join(method.name for method in methods)} compiled", flush=True)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        for law in KINDS[sys.argv[1]]:
            compile_for(law)
    else:  # in parallel, one process each
        both = [subprocess.Popen([sys.executable, "-m", "discs.kernels", kind]) for kind in KINDS]
        sys.exit(max(process.wait() for process in both))
