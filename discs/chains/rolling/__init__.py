"""Laws of rolling, one file each: the travel of a disc with slaved heading per angle of roll. `law` defines the interface."""

from discs.chains.rolling.field import FieldLaw
from discs.chains.rolling.law import RollingLaw, stretching
from discs.chains.rolling.unit import UnitLaw

ROLLING: dict[str, RollingLaw] = {law.name: law for law in (FieldLaw(), UnitLaw())}

__all__ = ["ROLLING", "RollingLaw", "stretching"]
