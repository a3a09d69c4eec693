"""Loads: generalised forces f(t, q, v) on the discs, besides those of springs and ground; see docs/loads.md."""

from discs.loads import signals
from discs.loads.binding import OnRod
from discs.loads.damping import Damping
from discs.loads.forces import Force, Slope, Spring, Torque
from discs.loads.linear import Linear
from discs.loads.motor import Motor
from discs.loads.own import Custom, Potential
from discs.loads.rest import Rest
from discs.loads.sums import Total, total
from discs.skew import Load

__all__ = [
    "Custom",
    "Damping",
    "Force",
    "Linear",
    "Load",
    "Motor",
    "OnRod",
    "Potential",
    "Rest",
    "Slope",
    "Spring",
    "Torque",
    "Total",
    "signals",
    "total",
]
