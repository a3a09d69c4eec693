"""`python -m continuum.kernels`: compile the field's kernels now, once on a machine, so that no run has to wait for it."""

from continuum.scenes import untwisting_rod
from continuum.solver import solve

if __name__ == "__main__":
    solve(untwisting_rod(duration=0.1), 1e-3, progress=False)
    print("rolling rod as a field: gauss8 compiled", flush=True)
