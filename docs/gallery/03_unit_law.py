"""The unit law: discs that roll like wheels, however the line is stretched. From above at the end, beside the field law."""

from discs import simulate
from discs.chains.twist import untwisting_chain

runs = {law: simulate(untwisting_chain(33, law, twist=1.0), dt=0.02, frames=2) for law in ("field", "unit")}
ax = runs["field"].plot_motion(instants=1)
for law, run in runs.items():
    ax.plot(run.x[-1], run.y[-1], label=f"{law} law")
ax.legend()
ax.figure.savefig("03_unit_law.png")
