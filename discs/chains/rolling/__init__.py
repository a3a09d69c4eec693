"""Laws of rolling, one file each: how far a disc with a slaved heading travels as it rolls. `law` says what each must give."""

from discs.chains.rolling.field import FieldLaw
from discs.chains.rolling.law import RollingLaw, stretching
from discs.chains.rolling.unit import UnitLaw

ROLLING: dict[str, RollingLaw] = {law.name: law for law in (FieldLaw(), UnitLaw())}

__all__ = ["ROLLING", "RollingLaw", "stretching"]
