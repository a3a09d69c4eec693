"""The integrators, by name."""

from discs import checks
from discs.integrators.base import Integrator, OneStep, Work
from discs.integrators.composition import Suzuki4
from discs.integrators.leapfrog import Leapfrog
from discs.integrators.midpoint import Midpoint
from discs.integrators.rk4 import RK4

METHODS: dict[str, type[Integrator]] = {cls.name: cls for cls in (Midpoint, Suzuki4, RK4, Leapfrog)}


def find(method: str | Integrator) -> Integrator:
    """The integrator of a name, with its default settings; an integrator is returned as it is."""
    if isinstance(method, Integrator):
        return method
    return METHODS[checks.choice("method", method, METHODS)]()


__all__ = ["METHODS", "RK4", "Integrator", "Leapfrog", "Midpoint", "OneStep", "Suzuki4", "Work", "find"]
