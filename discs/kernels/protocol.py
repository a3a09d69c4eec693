"""The interface of compiled chains, methods, laws and loads: stubs with a form for each type of their first argument.

`chain` and `method` are NamedTuples of parameters. Arrays: positions and moves (rows, n); momenta (columns, n), one column for roll
and, for steered discs, one for turning. `work` is the result of `workspace`: arrays that the functions of a chain share, among them
the shape of the base position. Moves are relative to the base position.
"""

from discs.kernels.compiled import stub


@stub
def workspace(chain):
    """The workspace of a chain."""


@stub
def place(chain, i):
    """The entry of disc i in the arrays of a chain."""


@stub
def enter(chain, state):
    """A state in the order of the chain: a new one, or itself if that is the order of the discs."""


@stub
def leave(chain, own, state):
    """Copy a state in the order of the chain to one in the order of the discs."""


@stub
def settle(chain, work, hi, lo):
    """Make hi + lo the base position."""


@stub
def basis(chain, work, move, c):
    """c = C after a move from the base."""


@stub
def pullback(chain, work, state, t, move, c, p, g):
    """g = C^T (grad V - f) after a move from the base, the positions of `state`, with this C; f at the time t and v = C p.

    f is without what motors do.
    """


@stub
def book_motors(chain, work, state, t, h, p, move):
    """Book the work of motors in a midpoint step from `state`, with the middle t, after its last sweep."""


@stub
def gradient(chain, work, move, g):
    """g = grad V, (rows, n), after a move from the base."""


@stub
def frame(chain, work, state, c, v, q, rates, told):
    """Record a state, the base position: q (rows, n), the `rates` of the rows from theta on, and energy and largest slip, `told`.

    c, v : workspace like positions.
    """


@stub
def sweep(chain, work, state, t, h, p, move, first):
    """One sweep (the `first` or a later one) of a midpoint step from `state` at the time t: changes p and the half step `move`.

    Returns the largest change of the move, in units of its scale.
    """


@stub
def factors(chain, g, count):
    """Workspace for `count` matrices of `precondition`, real or complex as g."""


@stub
def pick(chain, matrices, j):
    """One of the matrices of `factors`."""


@stub
def stiffness(chain, work, move, c, matrix):
    """matrix = C^T (grad^2 V) C after a move, with this C, real; grad^2 V without the part due to prestress."""


@stub
def precondition(chain, stiff, state, t, move, c, d, g, matrix):
    """matrix = factors of I + d C^T D C + g C^T (grad^2 V) C. `stiff` is the result of `stiffness`, D the damping of the load, at
    the time t after a move from the positions of `state`."""


@stub
def correct(chain, matrix, r):
    """Solve the system of `precondition`, by its factors, for the right side r (columns, n), in place."""


@stub
def potential(chain, work):
    """V at the base position."""


@stub
def vanishing(chain):
    """Whether a heading can vanish, for a chain or a law of rolling."""


@stub
def lost(chain, work, slope):
    """A disc whose heading vanishes on the straight line from `slope` (2, n) to the slopes of the base position, or -1. On return
    `slope` holds the slopes of the base position.
    """


# Several configurations, the stages of a step: `moves` and `v` (stages, rows, n), `p` and `g` (stages, columns, n). For discs they
# are computed one after the other (`discs.kernels.shared`), for fields all at once (`continuum.kernels.spectral`).


@stub
def bases(chain, work, moves, c):
    """c = C after each of `moves` from the base position."""


@stub
def forwards(chain, work, c, p, v):
    """v = C p at each stage."""


@stub
def forces(chain, work, state, t, moves, c, p, g):
    """g = C^T (grad V - f) after each of `moves`, as in `pullback`; t (stages,)."""


# Functions of a chain for collocation; `room` is the `Room`, `method` the parameters of `discs.integrators.collocation`


@stub
def stages(chain, method, rows, columns):
    """Workspace: c of the stages, for `bases`, and the arrays that `begin`, `solve` and `moved` share."""


@stub
def begin(chain, work, method, room, before, h):
    """v = a first guess of the rates of the stages, for the momenta of `before`. Also prepares the matrices of `solve`."""


@stub
def solve(chain, method, room, h):
    """room.force = the change of the momenta of the stages: the solution for room.rest, with the same C in all sweeps."""


@stub
def moved(chain, method, room, sweep, h):
    """The largest move of the stages by a sweep, number `sweep` from 0, in units of the scale. May improve p and v."""


@stub
def refine(chain, work, method, room, before, h, sweep):
    """One sweep of a step from `before`, number `sweep` from 0: changes p and v of the stages; returns what `moved` does."""


@stub
def finish(chain, work, method, room, before, h):
    """After the last sweep of a step from `before`: book the work of loads, at the positions and velocities of the last stages."""


@stub
def spend(chain, state, t, weight, move, v, scale):
    """Book the work of the loads of a chain, and what they dissipate, in a time `weight` around t, after a move from the positions
    of `state`, at the velocities `scale` v.

    Also for a load, `chain.load`.
    """


# Functions of a method, for the driver


@stub
def room(method, chain, state):
    """The workspace of a method, for states like `state`."""


@stub
def step(method, chain, work, room, before, after, t, h):
    """A step from `before` at the time t to `after`, a time h later; returns its `Cost`.

    On entry `before` is the base position; it is not changed. On return `after` is the base position.
    """


@stub
def most(chain, x):
    """The largest x of the threads that share a chain; x itself if there is one, see `discs.kernels.parts`."""


@stub
def added(chain, x):
    """The sum of their x."""


@stub
def halted(chain, size):
    """As `discs.kernels.interrupts.interrupted`, for all of them at once."""


@stub
def jumps(method):
    """Whether stages may jump across r' = 0, as in explicit steps; vanishing headings are then detected by the velocity."""


# A state: `discs.skew.Phase`, or the memory of a method of several steps


@stub
def like(state):
    """A new state with arrays of the same shapes, not filled."""


@stub
def take(state, to):
    """Copy a state to `to`."""


@stub
def kinetic(state, chain, h):
    """Kinetic energy; for a method of several steps, half a step h later."""


@stub
def rate(state, chain, work, c, tau, move):
    """move = tau times the velocities at a state, the base position; c is workspace for C."""


@stub
def kick(before, after, chain, work, t, h, c, g, defect):
    """defect = 12 times the defect of a step h from the time t, from the change of the force; see `discs.running.step_error`.

    `after` is the base position; c and g are workspace like C and C^T grad V.
    """


# A law of rolling, `chain.rolling`; `vanishing` too


@stub
def contact(law, radius, half, x, y):
    """e = f J (a, b) and |e|^2 for r' = half (x, y): returns a, b, f, |e|^2. radius, x, y are numbers or `vectors`."""


@stub
def jet(law, z, z1, z2):
    """h, h', h'' from z, z', z'', complex numbers; as `discs.chains.rolling.law.RollingLaw.jet`."""


# A link law, `chain.links`; links (3, n + 1) as in `discs.kernels.slaved`


@stub
def elastic(law, d):
    """V of links."""


@stub
def tension(law, ends, before, d, g):
    """g = mean derivative of V by the links, over a step from `before` with middle d; the derivative at d if they are the same.

    The tensions of ghost links are added to the links that define them.
    """


@stub
def assemble(law, ends, before, d, c, one, g, matrix):
    """matrix = entries of `one` I + g C^T (grad^2 V) C for that step; they affect only the convergence of sweeps."""


# A load, `chain.load`


@stub
def loaded(load):
    """Whether there are loads; if not, their arrays have no rows."""


@stub
def push(load, state, t, move, c, p, factor, g):
    """g += factor C^T f, with f after a move from the positions of `state`, at the time t and v = C p."""


@stub
def driven(load):
    """Whether there are motors."""


@stub
def hold(load, t, c, p, factor, g):
    """g += factor C^T f with f of what stands for motors in linear systems, see `discs.loads.motor`."""


@stub
def react(load, gained, p):
    """Book the work of motors, whose torques changed the momenta by `gained` while the mean momenta were p."""


@stub
def guide(load, c, d, g, roll, roll_beside, turn, turn_beside):
    """Add the matrix d C^T D C + g C^T (stiffness) C to the entries of rolls and, for steered discs, of turns.

    roll, turn : (n,), the diagonal. roll_beside, turn_beside : (n,), entries of a disc and the next one.
    """


@stub
def stiffen(load, state, t, move, c, d, g, matrix):
    """Add d C^T D C + g C^T S C, for what else the load has of D and S, to a matrix of `discs.kernels.slaved_matrix`."""
