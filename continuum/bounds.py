"""Error bounds: the largest error allowed in each quantity, by name."""

from collections.abc import Mapping

from discs import checks

FIELDS = ("x", "y", "theta", "omega")
HEADINGS = ("phi", "phi_rate")  # of a `SteeredRod`
LEAST = 1e-12  # smallest tolerance: some thousand times the rounding of a position


def bounds(tol: float | Mapping[str, float], steered: bool, more: tuple[str, ...] = ()) -> dict[str, float]:
    """The error bounds that `tol` of `continuum.solve` sets: a number for positions and angles, a mapping for what it names.

    more : names of wanted quantities, which a mapping may bind, too.
    """
    fields = (*FIELDS, *HEADINGS) if steered else FIELDS
    known, usual = (*fields, *more), tuple(name for name in fields if name not in ("omega", "phi_rate"))
    return checks.tolerances(tol, known, usual, LEAST)


def over(errors: Mapping[str, float], bound: Mapping[str, float]) -> float:
    """The largest ratio of an error to its bound; at most 1 if all bounds are met."""
    return max(errors[name] / limit for name, limit in bound.items())


def missed(errors: Mapping[str, float], bound: Mapping[str, float], where: str) -> str:
    """The message for errors above their bounds. `where` names the resolution, such as "on 361 functions"."""
    name = max(bound, key=lambda name: errors[name] / bound[name])
    return (
        f"tol = {bound[name]:g} is not reached {where}, where the estimated error is {errors[name]:.1e} (in {name}); "
        "ask for a larger tol"
    )
