"""`python -m continuum.kernels`: compile the kernels of the field once per machine, so that no run waits for it."""

from dataclasses import replace

from continuum.scenes import untwisting_rod
from continuum.solver import solve
from discs.chains.rolling import ROLLING
from discs.kernels.background import wait_for_kernels
from discs.loads import Damping

if __name__ == "__main__":
    wait_for_kernels()
    for law in ROLLING:
        scene = untwisting_rod(law, duration=0.1)
        for loads in ((), (Damping(rolling=0.1),)):
            solve(replace(scene, loads=loads), 1e-3, progress=False)
            print(f"rolling rod as a field, {law} law{', loaded' * bool(loads)}: gauss8 compiled", flush=True)
