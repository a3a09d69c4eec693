"""MuJoCo: discs on a plane that roll by friction at a regularised contact; see `compare.peers.mujoco_discs`.

A contact of finite stiffness lets discs creep: slip is the friction force times the mobility (1 - d)/(d m impratio). So the result
has two errors, one of the step, of order 2, and one of the contact, proportional to 1/impratio. Each is measured by itself.
"""

import numpy as np

from compare.crosschecks.both import compared, ours
from compare.crosschecks.stated import Stated
from compare.crosschecks.table import Row, order
from compare.peers.mujoco_discs import mujoco_peer

STEPS = np.array([2000, 4000, 8000])
STIFFNESSES = np.array([1e-2, 1e-1, 1e0])  # impratio


def rows() -> list[Row]:
    """Unit law and own headings."""
    found = []
    for law in ("unit", "own"):
        stated = Stated(law, 6)
        ends = [mujoco_peer(stated.problem()).run(steps, np.inf) for steps in STEPS]
        errors = [float(np.abs(end.q - ours(stated).q).max()) for end in ends]
        soft = [mujoco_peer(stated.problem(), stiffer=ratio).run(STEPS[-1], np.inf).q for ratio in STIFFNESSES]
        slips = [float(np.abs(q - ends[-1].q).max()) for q in soft]
        slope = f"{order(stated.duration / STEPS, errors):.2f} in the step; {order(1 / STIFFNESSES, slips):.2f} in the mobility"
        differs = "friction at a soft contact for rolling; forces of springs from `discs`"
        fields = compared(stated, ends[-1].q)
        found.append(Row("MuJoCo friction", **fields, order=slope, their_seconds=ends[-1].seconds, differs=differs))
    return found
