"""The progress bar of a run."""

import time as clock
from typing import Any


class Progress:
    """A progress bar, created after a second: creating one costs as much as a short run."""

    def __init__(self, name: str, total: int, unit: str = "step") -> None:
        self._name, self._total, self._unit, self._started = name, total, unit, clock.perf_counter()
        self._bar: Any = None

    def __enter__(self) -> "Progress":
        return self

    def __exit__(self, *error: object) -> None:
        if self._bar is not None:
            self._bar.close()

    def update(self, step: int) -> None:
        """Show the number of steps taken, or of other units."""
        if self._bar is not None:
            self._bar.update(step - self._bar.n)
        elif clock.perf_counter() - self._started > 1:
            from tqdm import tqdm

            self._bar = tqdm(total=self._total, initial=step, desc=self._name, unit=self._unit)


class NoBar:
    """No progress bar."""

    def __enter__(self) -> "NoBar":
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def update(self, step: int) -> None:
        pass


NO_BAR = NoBar()
