"""Loads: generalised forces f(t, q, v) on the discs, besides those of springs and ground."""

from discs.loads.linear import Linear
from discs.loads.sums import Total, total
from discs.skew import Load

__all__ = ["Linear", "Load", "Total", "total"]
