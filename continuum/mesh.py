"""The rod on a mesh: second-order finite differences in s, which read as rolling discs."""

from continuum.rod import Scene
from discs import Chain, Problem, State, checks, stencils


def semidiscretise(scene: Scene, n: int, ends: str) -> Problem:
    """The field equations of a scene on n nodes, as the problem of n discs that they are.

    A node with its share of length is a disc, a finite difference of the potential is a spring: with the stencils of
    `discs.stencils` the energy is that of a chain, and the constraint that of rolling discs. A closed scene makes a ring
    whatever `ends` says.

    Parameters
    ----------
    n : nodes, both ends counted, or all around a ring.
    ends : "consistent" (second order), "springs" (first order) or "paper" (the paper's, first order).
    """
    checks.choice("ends", ends, stencils.ENDS)
    if ends == "ring" and not scene.closed:
        raise ValueError("ends='ring' needs a closed scene; this one has two free ends: take 'springs' or 'consistent'")
    rod = scene.rod
    chain = Chain(
        n=n,
        length=rod.length,
        density=rod.density,
        spin_inertia=rod.spin_inertia,
        torsion_stiffness=rod.torsion_stiffness,
        bending_stiffness=rod.bending_stiffness,
        radius=rod.radius,
        rolling=scene.rolling,
        ends="ring" if scene.closed else ends,
        shift=scene.shift,
    )
    fields = scene.initial(chain.s)
    if not isinstance(fields, tuple) or len(fields) != 4:
        raise ValueError(f"the scene's initial fields must be x, y, theta and omega; got {type(fields).__name__} {fields!r:.60}")
    return Problem(chain, State(*fields), scene.duration)
