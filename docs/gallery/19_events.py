"""Events: the run ends when the first disc reaches a line."""

from discs import simulate
from discs.chains.twist import untwisting_chain
from discs.events import Line

line = Line(point=(0, 1), normal=(0, 1), disc=0, terminal=True)
run = simulate(untwisting_chain(16), dt=0.01, events=[line])
ax = run.plot_motion(instants=3)
ax.axhline(1.0, color="k", linestyle=":")
ax.set_title(f"disc 0 reaches the line at t = {run.t[-1]:.4f}")
ax.figure.savefig("19_events.png")
