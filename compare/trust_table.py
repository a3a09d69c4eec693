"""The table of `compare.trust`: tolerances, errors and estimates of random scenes."""

from dataclasses import dataclass
from pathlib import Path
from textwrap import shorten
from typing import NamedTuple

import numpy as np

from compare.sweeps import Result
from compare.tables import markdown, write_csv

OUTCOMES = ("within", "ABOVE", "refused", "cut off", "no reference")
LEAST = 5.0  # the error of a reference is at most the tolerance over this
MOST = 20.0  # largest ratio of estimate to error; above it a row is listed as cautious


class Row(NamedTuple):
    """A scene computed by `solve` or `simulate`.

    scene : seed and index. kind, law, words, duration : of the scene; words describe its initial fields. by : "solve" or
        "simulate".
    tol : the tolerance, absolute for fields, relative to the largest value of each quantity for discs. outcome : one of OUTCOMES.
    error, estimate : the largest over positions and angles, in the units of tol; NaN if unknown. ratio : estimate over error, NaN
        if the error is too small to be known. seconds : processor time. reference, reference_error : the reference, and its error.
    unlike : difference of the chains from the finer field, over the error of the chains. says : text of the refusal, or warnings.
    shown : result of the chains after a refusal. limited : `limited_by` of the stats of a run; empty for fields.
    """

    scene: str
    kind: str
    law: str
    words: str
    duration: float
    by: str
    tol: float
    outcome: str
    error: float = np.nan
    estimate: float = np.nan
    ratio: float = np.nan
    seconds: float = np.nan
    reference: str = ""
    reference_error: float = np.nan
    unlike: float = np.nan
    says: str = ""
    shown: str = ""
    limited: str = ""

    @property
    def counts(self) -> bool:
        """Whether the ratio counts: it is known, and only the tolerance limits the run."""
        return bool(np.isfinite(self.ratio)) and self.limited in ("", "tolerance")


@dataclass(frozen=True)
class Trust:
    """The results. rows : two for each scene. failed : cases of the sweep that raised an error."""

    rows: list[Row]
    failed: list[Result]

    def of(self, by: str) -> list[Row]:
        """The rows of "solve" or "simulate"."""
        return [row for row in self.rows if row.by == by]

    def table(self) -> str:
        """All rows as a table in Markdown, with the texts of refusals."""
        head = (
            "scene",
            "kind",
            "law",
            "initial fields",
            "t",
            "by",
            "tol",
            "outcome",
            "error",
            "estimate",
            "ratio",
            "s",
            "reference",
            "says",
        )
        lines = []
        for r in self.rows:
            numbers = [_shown(v) for v in (r.error, r.estimate)]
            ratio = f"{r.ratio:.2g}" if np.isfinite(r.ratio) else "–"
            reference = f"{r.reference} {r.reference_error:.0e}" if r.reference else "–"
            says = shorten("; ".join(filter(None, [r.says, r.shown])), 300).replace("|", "\\|")
            cells = (r.scene, r.kind, r.law, r.words.replace("|", "\\|"), f"{r.duration:.3g}", r.by, f"{r.tol:.1e}", r.outcome)
            lines.append([*cells, *numbers, ratio, f"{r.seconds:.2g}", reference, says])
        return markdown(head, lines)

    def summary(self) -> str:
        """Counts, quantiles of estimate over error, and exceeded tolerances, as a table in Markdown."""
        head = ("", *OUTCOMES, "estimate/error: least", "median", "90 %", "largest", "tol/error: median", "s: median", "largest")
        counted = []
        for by in ("solve", "simulate"):
            rows = self.of(by)
            counts = [str(sum(r.outcome == outcome for r in rows)) for outcome in OUTCOMES]
            ratios = np.array([r.ratio for r in rows if r.counts] or [np.nan])
            spare = np.array([r.tol / r.error for r in rows if r.error > 0] or [np.nan])
            seconds = np.array([r.seconds for r in rows] or [np.nan])
            quantiles = [f"{np.quantile(ratios, p):.2g}" for p in (0.0, 0.5, 0.9, 1.0)]
            cells = [by, *counts, *quantiles, f"{np.median(spare):.2g}", f"{np.median(seconds):.2g}", f"{seconds.max():.2g}"]
            counted.append(cells)
        lines = [markdown(head, counted)]
        kinds = {r.reference for r in self.rows if r.reference}
        lines.append("\nReferences: " + ", ".join(f"{k} {sum(r.reference == k for r in self.rows)}" for k in sorted(kinds)) + ".")
        for r in self.rows:
            if r.outcome == "ABOVE":
                lines.append(f"* above: {r.scene} ({r.kind}, {r.law}, {r.by}), tol {r.tol:.1e}, error {r.error:.1e}")
            if r.counts and r.ratio > MOST:
                words = f"estimate over error {r.ratio:.0f}, tolerance over estimate {r.tol / r.estimate:.2g}"
                lines.append(f"* cautious: {r.scene} ({r.kind}, {r.law}, {r.by}), {words}")
            if r.unlike > LEAST:
                lines.append(f"* unlike the chains: {r.scene} ({r.kind}, {r.law}), difference {r.unlike:.0f} times their error")
            if r.outcome == "refused":
                lines.append(f"* refused: {r.scene} ({r.kind}, {r.law}, {r.by}), tol {r.tol:.1e}: {r.says} ({r.shown})")
        lines += [f"* broken: {r.case}: {r.error}" for r in self.failed]
        return "\n".join(lines)

    def save(self, path: str | Path) -> None:
        """Write all rows to a CSV file."""
        write_csv(path, [Row._fields, *self.rows])


def _shown(value: float) -> str:
    return f"{value:.1e}" if np.isfinite(value) else "–"
