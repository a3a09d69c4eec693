"""What acts on the discs besides their springs and the ground: generalised forces f(t, q, v)."""

from discs.loads.linear import Linear
from discs.loads.total import Total, total
from discs.skew import Load

__all__ = ["Linear", "Load", "Total", "total"]
