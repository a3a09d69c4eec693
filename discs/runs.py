"""The result of `simulate_many`: many runs."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from discs.arrays import Float
from discs.files import schema
from discs.problem import Problem
from discs.running.outcome import Block
from discs.solution import Solution

if TYPE_CHECKING:
    import xarray


class Runs(Sequence[Solution]):
    """Many runs: `runs[i]` is the `Solution` of problem i; if it failed, its error is raised.

    Where all runs that did not fail have as many discs and frames at the same times, `runs.t` is (F,), and every quantity of a
    `Solution` is an array with the runs as its first axis, as `runs.x` (B, F, N), with NaN where a run failed.

    Attributes
    ----------
    problems : the problems.
    failed : the errors of the runs that failed, by number.
    warned : the warnings of runs, by number.
    """

    def __init__(
        self,
        problems: Sequence[Problem],
        blocks: Sequence[Block],
        failed: Mapping[int, Exception],
        warned: Mapping[int, Sequence[str]],
    ) -> None:
        self.problems, self.failed, self.warned, self._blocks = tuple(problems), failed, warned, tuple(blocks)

    @cached_property
    def _places(self) -> dict[int, tuple[Block, int]]:
        return {number: (block, j) for block in self._blocks for j, number in enumerate(block.runs)}

    def __len__(self) -> int:
        return len(self.problems)

    @overload
    def __getitem__(self, index: int) -> Solution: ...

    @overload
    def __getitem__(self, index: slice) -> list[Solution]: ...

    def __getitem__(self, index: int | slice) -> Solution | list[Solution]:
        if isinstance(index, slice):
            return [self[i] for i in range(len(self))[index]]
        number = range(len(self))[index]
        if number in self.failed:
            raise self.failed[number]
        block, j = self._places[number]
        rows: dict[str, Any] = {name: value[j] for name, value in block.rows.items()}
        problem, estimate = self.problems[number], block.estimates[j]
        return Solution(t=block.t, s=problem.chain.s, stats=block.stats[j], problem=problem, error_estimate=estimate, **rows)

    def __iter__(self) -> Iterator[Solution]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        return f"Runs({len(self)} runs, {len(self.failed)} failed, {len(self.warned)} with warnings)"

    @cached_property
    def t(self) -> Float:
        """Times of the frames, (F,); ValueError if they differ from run to run."""
        return self._common.t

    @cached_property
    def _common(self) -> Block:
        """A block like all others, but for its number of runs."""
        if not self._blocks:
            raise ValueError(f"all runs failed; the first: {next(iter(self.failed.values()))}")
        first = self._blocks[0]
        shapes = {name: value.shape[1:] for name, value in first.rows.items()}
        for block in self._blocks:
            if not np.array_equal(block.t, first.t):
                raise ValueError(f"runs {first.runs[0]} and {block.runs[0]} have frames at different times: take them one by one")
            if {name: value.shape[1:] for name, value in block.rows.items()} != shapes:
                raise ValueError(
                    f"runs {first.runs[0]} and {block.runs[0]} differ in the number of discs or in what they record: take them one "
                    "by one"
                )
        return first

    def __getattr__(self, name: str) -> Float:
        """A quantity of all runs, (B, F, ...)."""
        if name.startswith("_") or name not in schema.QUANTITIES:
            raise AttributeError(f"Runs has no {name!r}")
        if name not in self._common.rows:
            raise AttributeError(f"these runs did not record {name!r}; they have {', '.join(self._common.rows)}")
        found = np.full((len(self), *self._common.rows[name].shape[1:]), np.nan)
        for block in self._blocks:
            found[block.runs] = block.rows[name]
        self.__dict__[name] = found
        return found

    def to_xarray(self) -> "xarray.Dataset":
        """An xarray dataset with the dimensions (run, time, disc), units and long names as of one run.

        A run that failed is NaN, with its words in `error` (run,); `warning` (run,) has those of warnings. ValueError if runs
        differ in their frames or number of discs.
        """
        import xarray

        first, runs = self._common, range(len(self))
        data: dict[str, Any] = {}
        for name in first.rows:
            dims = schema.dimensions(name)
            told = {key: value for key, value in schema.attributes(name, dims).items() if key != "coordinates"}
            data[name] = (("run", *dims), getattr(self, name), told)
        error = [f"{type(self.failed[i]).__name__}: {self.failed[i]}" if i in self.failed else "" for i in runs]
        warning = ["; ".join(self.warned.get(i, ())) for i in runs]
        data["error"] = ("run", np.array(error, object), {"long_name": "why a run failed, or nothing"})
        data["warning"] = ("run", np.array(warning, object), {"long_name": "warnings of a run, or nothing"})
        places = np.array([problem.chain.s for problem in self.problems])
        same = bool((places == places[0]).all())
        coords = {
            "run": ("run", np.arange(len(self)), {"long_name": "number of the run"}),
            "time": ("time", first.t, schema.attributes("time", ("time",))),
            "s": ("disc" if same else ("run", "disc"), places[0] if same else places, schema.attributes("s", ("disc",))),
        }
        stats = first.stats[0]
        attrs = {"title": f"{len(self)} runs of {places.shape[1]} rolling discs", "unit_system": schema.UNITS}
        attrs |= {"settings": stats["settings"], "versions": schema.as_text(schema.versions())}
        return xarray.Dataset(data, coords, attrs)
