"""`python -m tests.fuzz.faults`: processes that are killed, discs that are full, two writers of one file, workers that die.

    python -m tests.fuzz.faults --kills 50 --only runs ensembles sweeps

Not part of the tests. After each fault the same call must give the right result, bit for bit, or a clear error: a part of a file is
never taken for the whole. Prints a line for each kind of fault, and ends with 1 if one was wrong.
"""

import argparse
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from compare import sweep
from discs import Problem, load, simulate, simulate_many
from discs.chains.twist import untwisting_chain
from discs.files.archive import SUFFIXES
from discs.files.results import read

SECONDS = 120


def problem(i: int = 0, duration: float = 40.0) -> Problem:
    return untwisting_chain(9 + i % 3, twist=0.3 + 0.02 * i, duration=duration)


def a_run(path: Path) -> bytes:
    """A run with a checkpoint, its frames as bytes."""
    run = simulate(problem(), dt=0.002, frames=2001, engine="compiled", progress=False, checkpoint=path)
    return run.x.tobytes() + run.omega.tobytes() + run.energy.tobytes()


def an_ensemble(path: Path, executor: Any = None) -> bytes:
    """Forty runs in parts, with a checkpoint."""
    problems = [problem(i, 5.0 + 0.5 * (i % 5)) for i in range(40)]
    runs = simulate_many(
        problems, "rk4", 0.002, 3, engine="compiled", progress=False, checkpoint=path, threads=1, executor=executor
    )
    assert not runs.failed, runs.failed
    return b"".join(run.x.tobytes() + run.omega.tobytes() for run in runs)


def end(case: float) -> list[float]:
    """The last places of a run."""
    short = untwisting_chain(9, twist=case, duration=20.0)
    return [float(x) for x in simulate(short, dt=0.01, frames=1, engine="compiled", progress=False).x[-1]]


def a_sweep(path: Path) -> bytes:
    found = sweep(end, [0.01 * i for i in range(20, 60)], archive=path, progress=False)
    assert not any(result.error for result in found)
    return np.array([result.value for result in found]).tobytes()


JOBS: dict[str, tuple[Callable[[Path], bytes], str]] = {
    "runs": (a_run, "run.nc"),
    "ensembles": (an_ensemble, "runs.jsonl"),
    "sweeps": (a_sweep, "sweep.jsonl"),
}


def child(name: str, path: Path, **more: Any) -> "subprocess.Popen[bytes]":
    command = [sys.executable, "-W", "ignore", "-m", "tests.fuzz.faults", "--child", name, "--path", str(path)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True, **more)


def written(path: Path) -> int:
    """How much a run has written: bytes of its lines, or frames."""
    if path.suffix in SUFFIXES:
        try:
            found = load(path)
        except (ValueError, OSError):
            return 0
        return found.t.size
    return path.stat().st_size if path.exists() else 0


def forked(job: Callable[[Path], bytes], path: Path) -> int:
    """Begin a job in a process of its own, which has what this one has imported; it writes its result beside the file."""
    pid = os.fork()
    if pid:
        return pid
    try:
        os.setsid()
        Path(f"{path}.out").write_bytes(job(path))
        os._exit(0)
    except BaseException as error:
        print(repr(error)[:500], flush=True)
        os._exit(1)


def kills(name: str, count: int, rng: random.Random) -> tuple[str, int]:
    """Kill a job at random moments, again and again, until it has ended; then begin another. Results are those of one unbroken."""
    job, file = JOBS[name]
    with tempfile.TemporaryDirectory() as folder:
        whole = job(Path(folder, f"whole-{file}"))
        done, wrong, late, number = 0, 0, 0, 0
        while done < count:
            path, ended = Path(folder, f"{number}-{file}"), False
            while done < count and not ended:
                pid, begun, had = forked(job, path), time.monotonic(), written(path)
                while not ended and written(path) == had and time.monotonic() - begun < SECONDS:
                    time.sleep(0.01)
                    ended = os.waitpid(pid, os.WNOHANG)[0] == pid
                if not ended:
                    time.sleep(rng.expovariate(3.0))
                    ended = os.waitpid(pid, os.WNOHANG)[0] == pid
                if ended:
                    out = Path(f"{path}.out")
                    wrong += not out.exists() or out.read_bytes() != whole
                else:
                    os.killpg(pid, signal.SIGKILL)
                    os.waitpid(pid, 0)
                    done += 1
                    late += written(path) > had
            wrong += job(path) != whole
            number += 1
    return (
        f"{done} kills -9 of {name} ({late} after something new was written), {number} restarted to the end: {wrong} wrong",
        wrong,
    )


def full(folder: Path, fill: bool) -> Counter[str]:
    """What writers say on a disc that is full, and whether what was there is still there."""
    said: Counter[str] = Counter()
    run = simulate(problem(duration=1.0), dt=0.05, frames=201, engine="plain", progress=False)
    for ending in (".nc", ".csv", ".vtkhdf"):
        path = folder / f"kept{ending}"
        simulate(problem(1, duration=1.0), dt=0.05, frames=2, engine="plain", progress=False).save(path)
    sweep(abs, [1.0], archive=folder / "sweep.jsonl", progress=False)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    if fill:
        with open(folder / "filler", "wb", buffering=0) as filler:
            try:
                while filler.write(bytes(4096)):
                    pass
            except OSError:
                pass
    calls: dict[str, Callable[[], Any]] = {
        f"save {ending}": lambda ending=ending: run.save(folder / f"kept{ending}")  # type: ignore[misc]
        for ending in (".nc", ".csv", ".vtkhdf")
    }
    calls["new checkpoint"] = lambda: a_run(folder / "new.nc")
    calls["new ensemble"] = lambda: an_ensemble(folder / "new.jsonl")
    calls["more of a sweep"] = lambda: sweep(abs, [2.0 + i for i in range(2000)], archive=folder / "sweep.jsonl", progress=False)
    for name, call in calls.items():
        try:
            call()
            said[f"{name}: written"] += 1
        except (ValueError, OSError) as error:
            words = str(error)
            clear = any(
                text in words for text in ("No space left", "cannot be written", "can be written", "free on its disc", "Read-only")
            )
            said[f"{name}: {'clear' if clear else 'UNCLEAR: ' + words[:200]}"] += 1
    for name, content in before.items():
        now = (folder / name).read_bytes()
        kept = now == content if name != "sweep.jsonl" else now.startswith(content) or bool(read(folder / name))
        said["kept" if kept else f"LOST {name}"] += 1
    left = [path.name for path in folder.iterdir() if path.name.startswith(".discs-partial")]
    said["LEFT BEHIND"] += len(left)
    return +said


def full_disc() -> tuple[str, int]:
    """On a tmpfs of 512 kB, if one can be mounted."""
    with tempfile.TemporaryDirectory() as folder:
        if subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=512k", "tmpfs", folder], capture_output=True, check=False
        ).returncode:
            return "full disc: no tmpfs can be mounted here", 0
        try:
            said = full(Path(folder), fill=True)
        finally:
            subprocess.run(["umount", folder], check=False)
    return f"full disc: {dict(said)}", sum(said[name] for name in said if name.split(":")[-1].strip()[:4].isupper())


def read_only() -> tuple[str, int]:
    """A folder on a file system that was mounted read-only (root may write to any other folder)."""
    with tempfile.TemporaryDirectory() as folder:
        if subprocess.run(["mount", "-t", "tmpfs", "tmpfs", folder], capture_output=True, check=False).returncode:
            return "read-only folder: no tmpfs can be mounted here", 0
        try:
            path = Path(folder, "run.nc")
            whole = a_run(path)
            (Path(folder) / "empty").mkdir()
            subprocess.run(["mount", "-o", "remount,ro", folder], check=True)
            said, same = Counter[str](), a_run(path) == whole
            calls = (
                lambda: a_run(path.with_name("new.nc")),
                lambda: an_ensemble(path.with_name("new.jsonl")),
                lambda: load(path).save(path),
            )
            for call in calls:
                try:
                    call()
                    said["WRITTEN"] += 1
                except (ValueError, OSError) as error:
                    said["clear" if "Read-only file system" in str(error) else f"UNCLEAR: {error}"] += 1
        finally:
            subprocess.run(["umount", folder], check=False)
    wrong = (not same) + said["WRITTEN"] + sum(said[name] for name in said if name.startswith("UNCLEAR"))
    return f"read-only folder: {dict(said)}; a finished run there is read: {same}", wrong


def limited() -> tuple[str, int]:
    """Files that may not grow beyond 20 kB (RLIMIT_FSIZE), in a process of its own."""

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    said: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for name, (_, file) in JOBS.items():
            process = child(name, Path(folder, file), preexec_fn=limit)
            _, words = process.communicate()
            last = words.decode().strip().splitlines()[-1:] or [""]
            clear = "clear" if "File too large" in last[0] or "cannot be written" in last[0] else f"UNCLEAR {last[0]}"
            said[f"{name}: {clear if process.returncode else 'fits'}"] += 1
    return f"RLIMIT_FSIZE: {dict(said)}", sum("UNCLEAR" in name for name in said)


def two_writers() -> tuple[str, int]:
    """Two processes on one file: one does it, the other is refused, or reads the finished one."""
    said: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for name, (job, file) in JOBS.items():
            whole, path = job(Path(folder, f"whole-{file}")).hex().encode(), Path(folder, file)
            both = [child(name, path) for _ in range(2)]
            for process in both:
                out, words = process.communicate()
                last = (words.decode().strip().splitlines() or [""])[-1]
                refused = "being written by another" in last or "another process" in last
                said[f"{name}: {'right' if out.strip() == whole else 'refused' if refused else 'WRONG ' + last}"] += 1
            said[f"{name}: {'file right' if job(path).hex().encode() == whole else 'FILE WRONG'}"] += 1
    return f"two processes, one file: {dict(said)}", sum("WRONG" in name for name in said)


def dead_workers(count: int, rng: random.Random) -> tuple[str, int]:
    """Workers of a Dask cluster are killed during an ensemble."""
    from distributed import Client, LocalCluster

    wrong, killed, said = 0, 0, Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        whole = an_ensemble(Path(folder, "whole.jsonl"))
        for number in range(count):
            with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
                pids = list(client.run(os.getpid).values())
                path = Path(folder, f"{number}.jsonl")
                timer = subprocess.Popen(["sh", "-c", f"sleep {rng.uniform(0.5, 4.0):.2f}; kill -9 {rng.choice(pids)}"])
                try:
                    wrong += an_ensemble(path, client.get_executor()) != whole
                    said["right"] += 1
                except Exception as error:
                    said[f"{type(error).__name__}: {str(error)[:80]}"] += 1
                    wrong += an_ensemble(path) != whole
                killed += timer.wait() == 0
    return f"{killed} Dask workers killed in {count} ensembles: {dict(said)}; {wrong} wrong", wrong


KINDS: dict[str, Callable[[int, random.Random], tuple[str, int]]] = {
    **{name: lambda count, rng, name=name: kills(name, count, rng) for name in JOBS},  # type: ignore[misc]
    "full": lambda count, rng: full_disc(),
    "read-only": lambda count, rng: read_only(),
    "limited": lambda count, rng: limited(),
    "two": lambda count, rng: two_writers(),
    "dask": lambda count, rng: dead_workers(max(1, count // 10), rng),
}


def main() -> int:
    p = argparse.ArgumentParser(prog="python -m tests.fuzz.faults", description="Faults while files are written.")
    p.add_argument("--kills", type=int, default=50)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--only", nargs="+", choices=tuple(KINDS), default=list(KINDS))
    p.add_argument("--child", choices=tuple(JOBS), help=argparse.SUPPRESS)
    p.add_argument("--path", type=Path, help=argparse.SUPPRESS)
    chosen = p.parse_args()
    if chosen.child:
        print(JOBS[chosen.child][0](chosen.path).hex())
        return 0
    found = 0
    for name in chosen.only:
        said, wrong = KINDS[name](chosen.kills, random.Random(f"{name} {chosen.seed}"))
        print(said, flush=True)
        found += wrong
    return int(found > 0)


if __name__ == "__main__":
    sys.exit(main())
