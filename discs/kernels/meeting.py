"""Threads that share a chain meet: none goes on before all have come (a barrier); then each can read what others wrote before.

A thread that waits spins, as a meeting takes 0.25 µs and waking up takes 5. If the others do not come soon, other work may run.
"""

import os
import platform
import time
from typing import Any

from discs.kernels.compiled import PART, later

LINE = 8  # numbers of a cache line, of which each thread has one to itself
SPINS = 2000  # before other work may run, some 50 µs
GONE = 1 << 62  # the count of a thread that will not come again


def meet(arrived, me):
    """Wait until all threads have called this as often as thread number `me`. arrived : (LINE T,) integers, counts of each."""
    arrived[LINE * me] += 1
    for other in range(0, arrived.size, LINE):
        while arrived[other] < arrived[LINE * me]:
            time.sleep(0)


def _forms() -> None:
    from llvmlite import ir
    from numba.core import cgutils, types
    from numba.extending import intrinsic, overload

    intel = platform.machine().lower() in ("x86_64", "amd64", "i386", "i686")
    give_way = types.ExternalFunction("sched_yield", types.int32()) if os.name == "posix" else None

    def entry(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.gep(context.make_array(sig.args[0])(context, builder, args[0]).data, [args[1]])

    @intrinsic
    def seen(typing: Any, a: Any, i: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return builder.load_atomic(entry(context, builder, sig, args), "acquire", 8)

        return types.int64(a, types.intp), emit

    @intrinsic
    def show(typing: Any, a: Any, i: Any, value: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            builder.store_atomic(args[2], entry(context, builder, sig, args), "release", 8)
            return context.get_dummy_value()

        return types.void(a, types.intp, types.int64), emit

    @intrinsic
    def rest(typing: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            if intel:
                kind = ir.FunctionType(ir.VoidType(), [])
                builder.call(cgutils.get_or_insert_function(builder.module, kind, "llvm.x86.sse2.pause"), [])
            return context.get_dummy_value()

        return types.void(), emit

    @overload(meet, jit_options=PART)
    def _meet(arrived, me):
        def wait(arrived, me):
            count = seen(arrived, LINE * me) + 1
            show(arrived, LINE * me, count)
            for other in range(0, arrived.size, LINE):
                spins = 0
                while seen(arrived, other) < count:
                    rest()
                    spins += 1
                    if give_way is not None and spins > SPINS:
                        give_way()

        return wait


later(_forms)
