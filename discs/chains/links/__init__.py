"""Link laws, one file each: the elastic energy of discs with slaved headings. `law` defines the interface."""

from discs import checks
from discs.chains.links.law import LinkLaw
from discs.chains.links.linear import LinearCurvature
from discs.chains.links.true import TrueCurvature

CURVATURE: dict[str, type[LinkLaw]] = {law.name: law for law in (LinearCurvature, TrueCurvature)}


def find(curvature: str, stretching: object) -> type[LinkLaw]:
    """The law of this name; ValueError if it is unknown, or takes no stretch stiffness where one is given."""
    law = CURVATURE[checks.choice("curvature", curvature, CURVATURE)]
    if stretching and not law.stretches:
        fitting = " or ".join(repr(name) for name, other in CURVATURE.items() if other.stretches)
        raise ValueError(f"stretch_stiffness goes with curvature={fitting}; with {curvature!r} it must be 0")
    return law


__all__ = ["CURVATURE", "LinearCurvature", "LinkLaw", "find"]
