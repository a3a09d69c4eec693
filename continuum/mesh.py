"""The rod on a mesh: second-order finite differences in s, which are the equations of rolling discs."""

from dataclasses import replace
from typing import Any

import numpy as np

from continuum.initial import resolve
from continuum.parameters import sample
from continuum.pieces import POINTS
from continuum.rod import PARAMETERS, Scene, SteeredRod
from discs import Chain, Problem, State, SteeredChain, checks
from discs.arrays import Float
from discs.chains import elements, stencils
from discs.files.schema import ROD
from discs.loads import Damping
from discs.loads.binding import nonzero

UNSEEN = 1 / 4  # of an energy: discs that miss more than this do not resolve the initial fields


def viscous(scene: Scene, *springs: str) -> bool:
    """Whether these springs, "torsion" or "bending", are viscous: stiff on a fine mesh, where steps back in time amplify."""
    return any(nonzero(getattr(load, spring)) for load in scene.loads if isinstance(load, Damping) for spring in springs)


def semidiscretise(scene: Scene, n: int, ends: str, degree: int = 1) -> Problem:
    """The field equations of a scene on n nodes, as the problem of n discs.

    A node with its share of length is a disc, a finite difference of the potential is a spring. With the stencils of
    `discs.chains.stencils` the energy is that of a chain, and the constraint that of rolling discs. A closed scene gives a ring for
    any `ends`. Steered discs (of a `SteeredRod`) have one kind of free ends, "springs".

    Parameters
    ----------
    n : number of nodes, both ends counted, or all around a ring.
    ends : "consistent" (second order), "springs" (first order) or "paper" (the paper's, first order).
    degree : 2 for steered discs as quadratic elements (`discs.chains.elements`), of order four instead of two.
    """
    if not isinstance(scene, Scene):
        raise ValueError(f"a Scene is wanted, such as untwisting_rod(); got {type(scene).__name__}")
    checks.choice("ends", ends, stencils.ENDS)
    if ends == "ring" and not scene.closed:
        raise ValueError("ends='ring' needs a closed scene; this one has two free ends: take 'springs' or 'consistent'")
    rod, ends = scene.rod, "ring" if scene.closed else ends
    names = [name for name in PARAMETERS if hasattr(rod, name)]
    # a varying parameter stands in by 1 until the chain knows its places
    common = {name: 1.0 if name in rod.varying else getattr(rod, name) for name in names} | {"length": rod.length}
    chain: Chain | SteeredChain
    if isinstance(rod, SteeredRod):
        chain = SteeredChain(n=n, ends=ends, shift=scene.shift, turns=scene.turns, degree=degree, **common)
    else:
        elements.refuse(degree)
        chain = Chain(n=n, ends=ends, shift=scene.shift, rolling=scene.rolling, curvature=rod.curvature, **common)
    if rod.varying:
        at = places(chain)
        sampled: dict[str, Any] = {name: sample(name, function, at[name]) for name, function in rod.varying.items()}
        chain = replace(chain, **sampled)
    return Problem(chain, State(**scene.fields(chain.s)), scene.duration, scene.loads)


def places(chain: Chain | SteeredChain) -> dict[str, Float]:
    """Where a rod's parameters are taken for a chain, by name.

    Every sum of the discs is then a quadrature of order 2 of an integral of the field, by the trapezoidal rule (at discs and bends,
    with half shares at free ends) or by midpoints (of links), and its terms, differences about these places, are of order 2 too:

        int (alpha + rho |e|^2) omega psi   ->  sum over discs, rho, alpha and R (of e) at the discs,
        int beta theta' psi'                ->  sum over links, beta at their middles, and so K phi' chi', A, G of own headings,
        int K r'' . (e psi)''               ->  sum over bends, K at their discs; consistent ends have bends with K(0), K(length).

    Of degree 2 (`discs.chains.elements`) the rules are Simpson's for discs and Gauss's for strain points, of order 4.

    Smooth functions multiply the terms, so this holds as for a uniform rod. The end conditions of the field need nothing more: they
    are natural, and a consistent end has the trapezoidal sum, ghost disc included, of the integral that they follow from. Averages
    over shares would change the parameters by O(k^2), and no order.
    """
    rows = {"disc": chain.s, "link": chain.middles, "bend": chain.bends if isinstance(chain, Chain) else chain.middles}
    return {name: np.minimum(rows[ROD[name].dims[0]], chain.length) for name in PARAMETERS}  # places are rounded


@np.errstate(over="ignore", invalid="ignore")  # what is too large for doubles is lost
def unseen(scene: Scene, problem: Problem) -> str:
    """The warning if the discs are too few to resolve the initial fields of a scene, or its parameters; otherwise empty.

    Consider the fields that are linear between the discs. For theta their energy is that of the springs. They are the projection in
    energy, so that

        beta/2 int theta'^2 - sum beta (theta_{i+1} - theta_i)^2/2k = beta/2 int (theta' - its slope between the discs)^2 >= 0.

    So the missing energy measures the missing part of the field, wherever the discs are. Bending and shear are compared in the same
    way. For omega (and the rate of phi) the missing part is M/2 int (omega - linear interpolation)^2, compared with
    M/2 int (omega - mean)^2. A quarter of either, which is half of a field by its root mean square, gives a warning. Parts below a
    millionth of the whole energy are ignored. The paper's twist misses 1.3 % at n = 9; a bump exp(-(s/w)^2) misses a quarter at k =
    w. A parameter p of the rod that varies is compared as omega is, int (p - linear interpolation)^2 with int (p - mean)^2.
    """
    try:
        found = resolve(scene)
    except ValueError as error:
        rough = str(error).startswith(tuple(scene.rod.varying))  # of parameters
        return f"{'more discs converge slowly' if rough else 'the discs have no limit as a field'}: {error}"
    problem = replace(problem, loads=()) if problem.loads else problem
    pi = problem.start().pi
    parts = {"potential energy": (abs(found.potential - problem.energy() + 0.5 * float(np.vdot(pi, pi))), found.potential)}
    s, w = found.quadrature(POINTS)
    fields = found.fields(s)
    rod, chain, period = scene.rod.at(s), problem.chain, scene.rod.length if scene.closed else None

    def missing(value: Float, places: Float, known: Float, weights: Float) -> tuple[float, float]:
        """Integrals over squares: of a field less what is linear between its values at some places, and less its mean."""
        about = value - (w @ value) / scene.rod.length
        lost, whole = (float(weights @ part**2) for part in (value - np.interp(s, places, known, period=period), about))
        return lost, whole

    inertia = {"omega": rod.inertia} | ({"phi_rate": rod.heading_inertia} if scene.steered else {})
    for name, moment in inertia.items():
        known = np.asarray(getattr(problem.initial, name))
        parts[f"kinetic energy of {name}"] = missing(fields[name], chain.s, known, 0.5 * moment * w)
    least = dict.fromkeys(parts, 1e-6 * found.energy)
    for name, at in places(chain).items():
        if name in scene.rod.varying:
            value = getattr(rod, name)
            parts[name] = missing(value, at, np.asarray(getattr(chain, name)), w)
            least[name] = 1e-6 * float(w @ value**2)
    missed = [name for name, (lost, whole) in parts.items() if lost > UNSEEN * whole and whole > least[name]]
    if not missed:
        return ""
    lost, whole = parts[missed[0]]
    where = ""
    enough = 2 * problem.chain.n
    if found.features:
        place, width = min(found.features, key=lambda feature: feature[1])
        where = f", which vary within {width:.2g} at s = {place:.4g}"
        enough = max(enough, int(np.ceil(2 * scene.rod.length / width)))
    enough += chain.degree == 2 and enough % 2 != chain.n % 2  # whole elements
    what = f"{missed[0]} of the rod" if missed[0] in scene.rod.varying else "initial fields"
    return (
        f"{problem.chain.n} discs are too few for the {what}{where}: they miss {lost:.3g} of {whole:.3g}, the {missed[0]}; "
        f"take n = {enough} or more"
    )
