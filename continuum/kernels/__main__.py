"""`python -m continuum.kernels`: compile the kernels of the field once per machine, so that no run waits for it."""

from continuum.scenes import steered_rod, untwisting_rod
from continuum.solver import solve
from discs.chains.rolling import ROLLING
from discs.kernels.background import wait_for_kernels

if __name__ == "__main__":
    wait_for_kernels()
    for law in ROLLING:
        solve(untwisting_rod(law, duration=0.1), 1e-3, progress=False)
        print(f"rolling rod as a field, {law} law: gauss8 compiled", flush=True)
    solve(steered_rod(duration=0.1), 1e-3, progress=False)
    print("rod with headings of its own: rates compiled", flush=True)
