"""Exudyn: rigid wheels, its rolling joint and its geometrically exact beam; and a general system with user functions of rolling.

The first, `compare.peers.exudyn_chain`, has own headings and is stated in Exudyn's items only; the second,
`compare.peers.exudyn_field`, gets the stiffness matrix from `discs` and has the field and the unit law. Both use the trapezoidal
rule, order 2. The two finest steps extrapolated leave what is not an error of that order.
"""

from collections.abc import Callable

import numpy as np

from compare.crosschecks.both import compared, ours, timed
from compare.crosschecks.stated import Stated
from compare.crosschecks.table import Row, order
from compare.peers.exudyn_chain import exudyn_steered
from compare.peers.exudyn_field import exudyn_field_peer
from discs.arrays import Float

STEPS = np.array([1000, 2000, 4000])


def rows() -> list[Row]:
    """Wheels and beams for own headings, the general system for the two laws of slaved ones."""
    return [_wheels(Stated("own", 6)), *(_general(Stated(law, 6)) for law in ("field", "unit"))]


def _wheels(stated: Stated) -> Row:
    def end(steps: float) -> Float:
        run = exudyn_steered(stated.problem(), stated.duration / steps)
        return np.array([getattr(run, row)[-1] for row in stated.rows])

    return _row("Exudyn wheels and beams", stated, end, "rigid wheels with rolling joints, its own beams")


def _general(stated: Stated) -> Row:
    def end(steps: float) -> Float:
        return exudyn_field_peer(stated.problem()).run(steps, np.inf).q

    return _row("Exudyn general system", stated, end, "stiffness matrix from `discs`; rolling by user functions")


def _row(name: str, stated: Stated, end: Callable[[float], Float], differs: str) -> Row:
    ends, seconds = zip(*(timed(end, count) for count in STEPS.tolist()), strict=True)
    errors = [float(np.abs(q - ours(stated).q).max()) for q in ends]
    slope = f"{order(stated.duration / STEPS, errors):.2f} in the step; {errors[-1]:.1e} at the finest, extrapolated here"
    extrapolated = compared(stated, (4 * ends[-1] - ends[-2]) / 3)
    return Row(name, **extrapolated, order=slope, their_seconds=sum(seconds[-2:]), differs=differs)
