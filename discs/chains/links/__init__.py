"""Link laws, one file each: the springs of discs with slaved headings, by their strains. `law` says what each must give."""

from discs import checks
from discs.chains.links.law import LinkLaw
from discs.chains.links.linear import LinearCurvature
from discs.chains.links.true import TrueCurvature

CURVATURE: dict[str, type[LinkLaw]] = {law.name: law for law in (LinearCurvature, TrueCurvature)}


def find(curvature: str, stretching: object) -> type[LinkLaw]:
    """The law of this name; ValueError for an unknown one, and for one that takes no stretch stiffness where there is some."""
    law = CURVATURE[checks.choice("curvature", curvature, CURVATURE)]
    if stretching and not law.stretches:
        fitting = " or ".join(repr(name) for name, other in CURVATURE.items() if other.stretches)
        raise ValueError(f"stretch_stiffness goes with curvature={fitting}; with {curvature!r} it must be 0")
    return law


__all__ = ["CURVATURE", "LinkLaw", "find"]
