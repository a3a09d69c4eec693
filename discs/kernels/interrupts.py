"""Ctrl-C within compiled code."""

from typing import Any

from discs.kernels.compiled import PART, later

POLLED = 1_000_000  # numbers of a state that sweeps and steps may pass between two polls of Ctrl-C: about 10 ms


def interrupted(size: int) -> bool:
    """Whether Ctrl-C was pressed; a kernel then returns at once, with -1 steps. `size` : numbers of the state in a sweep or step.

    Every `POLLED` numbers Python is asked, under its lock, which kernels do not hold. The answer clears the signal, so the caller
    has to raise it again, see `discs.integrators.base.FixedStep`. Only the main thread is told. Plain Python needs no polling.
    """
    return False


def _tell_of_interrupts() -> None:
    from llvmlite import ir
    from numba.core import types
    from numba.extending import intrinsic, overload

    occurred = types.ExternalFunction("PyOS_InterruptOccurred", types.int32())
    lock = types.ExternalFunction("PyGILState_Ensure", types.int32())
    unlock = types.ExternalFunction("PyGILState_Release", types.void(types.int32))

    @intrinsic
    def due(typing: Any, size: Any) -> Any:
        """Whether POLLED numbers were passed since the last poll; `size` more are."""

        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            whole, name = ir.IntType(64), "discs.passed"
            if name not in builder.module.globals:
                made = ir.GlobalVariable(builder.module, whole, name)
                made.linkage, made.initializer = "internal", whole(0)
            passed = builder.module.globals[name]
            total = builder.add(builder.load(passed), args[0])
            late = builder.icmp_signed(">", total, whole(POLLED))
            builder.store(builder.select(late, whole(0), total), passed)
            return late

        return types.boolean(types.int64), emit

    @overload(interrupted, jit_options=PART)
    def _interrupted(size):
        def poll(size):
            if not due(size):
                return False
            held = lock()
            found = occurred()
            unlock(held)
            return bool(found != 0)

        return poll


later(_tell_of_interrupts)
