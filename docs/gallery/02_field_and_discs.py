"""Discs and field: nine discs with consistent ends beside the rod that they approximate."""

from compare import lump
from continuum import solve, untwisting_rod
from discs import simulate

scene = untwisting_rod()
run = simulate(lump(scene, n=9, ends="consistent"), dt=0.02, frames=10)
field = solve(scene, tol=1e-4, frames=10)
ax = run.plot_motion()
ax.plot(field.x[-1], field.y[-1], "k--", label="the rod at the end")
ax.legend()
ax.figure.savefig("02_field_and_discs.png")
