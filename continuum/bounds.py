"""What `tol` binds: the largest error wanted of each quantity, by name."""

from collections.abc import Mapping

from discs import checks

FIELDS = ("x", "y", "theta", "omega")
HEADINGS = ("phi", "phi_rate")  # of sections with headings of their own
LEAST = 1e-12  # the least tolerance: some thousand times the rounding of a position


def bounds(tol: float | Mapping[str, float], steered: bool) -> dict[str, float]:
    """The bounds that `tol` of `continuum.solve` stands for: a number binds positions and angles, a mapping what it names."""
    known = (*FIELDS, *HEADINGS) if steered else FIELDS
    usual = tuple(name for name in known if name not in ("omega", "phi_rate"))
    return checks.tolerances(tol, known, usual, LEAST)


def over(errors: Mapping[str, float], bound: Mapping[str, float]) -> float:
    """The largest error over its bound: at most 1 where all are kept."""
    return max(errors[name] / limit for name, limit in bound.items())


def missed(errors: Mapping[str, float], bound: Mapping[str, float], where: str) -> str:
    """What to say of errors that are too large, on so many functions, say."""
    name = max(bound, key=lambda name: errors[name] / bound[name])
    return (
        f"tol = {bound[name]:g} is not reached {where}, where the estimated error is {errors[name]:.1e} (in {name}); "
        "ask for a larger tol"
    )
