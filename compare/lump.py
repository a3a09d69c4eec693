"""The correspondence: a rod lumped into discs."""

from continuum.mesh import semidiscretise, unseen
from continuum.rod import Scene
from discs import Problem
from discs.warn import warn


def lump(scene: Scene, n: int, ends: str = "springs", degree: int = 1) -> Problem:
    """The rod of a scene as n discs.

    Disc i stands at s_i = i k for a share w_i of the length (k, and k/2 at free ends) and carries that share's mass and
    spin inertia; the springs between discs hold the rod's torsion and bending energy. Loads of the scene become those of the discs.
    Parameters that vary along the rod are sampled: density, spin inertia and radius at the discs, the stiffnesses of links at their
    middles, that of bends at their discs. Each sum is then a trapezoidal or midpoint sum of the field's integral, so errors fall as
    for a uniform rod; see `continuum.mesh.places`.

    Parameters
    ----------
    scene : the rod.
    n : number of discs, at least 3 with free ends (4 if consistent) and 5 on a closed rod.
    ends : "springs", the chain one would build: errors fall like 1/n; "consistent", with the end half-cells' bending and the inner
        headings' truncation error: errors fall like 1/n**2; "paper", "springs" with end discs of full weight. A closed scene gives
        a ring of discs.
    degree : 2 for discs with headings of their own in elements of three, `discs.chains.elements`: errors fall like 1/n**4 instead
        of 1/n**2. n is then odd, on a closed rod even.

    Returns
    -------
    The problem. A warning is given if the discs are too few to resolve the initial fields (`continuum.mesh.unseen`), or if the
    fields have jumps or noise, so that more discs do not converge.
    """
    problem = semidiscretise(scene, n, ends, degree)
    if warning := unseen(scene, problem):
        warn(warning)
    return problem
