"""Vectors of LANES numbers in compiled code: numba has no type for them, and a processor computes with all lanes at once.

In plain Python a vector is an array (LANES,). In compiled code it is one value, which LLVM keeps in registers; +, -, *, / and a
change of sign take vectors, or a vector and a number; `abs` and `numpy.sqrt` take one. So a formula for numbers, a law of rolling
for instance, serves for vectors too.
"""

from typing import Any

import numpy as np

from discs.kernels.compiled import later, part

LANES = 8


def zero():
    """A vector of zeros."""
    return np.zeros(LANES)


def load(a, i):
    """The entries of a (n,), contiguous, from i on, as a vector."""
    return a[i : i + LANES].copy()


def store(a, i, v):
    """Put a vector into a (n,), contiguous, from i on."""
    a[i : i + LANES] = v


def larger(v, w):
    """The larger entries; those of w where v is not a number."""
    return np.where(v > w, v, w)


def before(v):
    """Each entry moved to the next lane, the last one to the first lane."""
    return np.roll(v, 1)


def after(v):
    """Each entry moved to the lane before, the first one to the last lane."""
    return np.roll(v, -1)


@part
def largest(v, spare):
    """The largest entry of a vector; `spare` (LANES,) is overwritten."""
    store(spare, 0, v)
    m = spare[0]
    for i in range(1, LANES):
        m = spare[i] if spare[i] > m else m
    return m


def _forms() -> None:
    import operator

    from llvmlite import ir
    from numba.core import cgutils, types
    from numba.core.typing.templates import AbstractTemplate, infer_global, signature
    from numba.extending import intrinsic, lower_builtin, models, overload, register_model

    values = ir.VectorType(ir.DoubleType(), LANES)

    class Vector(types.Type):
        def __init__(self) -> None:
            super().__init__("vector")

    @register_model(Vector)
    class _Model(models.PrimitiveModel):
        def __init__(self, manager: Any, kind: Any) -> None:
            super().__init__(manager, kind, values)

    vector = Vector()

    def spread(context: Any, builder: Any, value: Any, kind: Any) -> Any:
        """The value of a number in all lanes."""
        if isinstance(kind, Vector):
            return value
        number = context.cast(builder, value, kind, types.float64)
        first = builder.insert_element(ir.Constant(values, ir.Undefined), number, ir.IntType(32)(0))
        everywhere = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        return builder.shuffle_vector(first, ir.Constant(values, ir.Undefined), everywhere)

    class Arithmetic(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if any(isinstance(a, Vector) for a in args) and all(isinstance(a, Vector | types.Number) for a in args):
                return signature(vector, *args)
            return None

    def lower(what: Any, name: str, count: int) -> None:
        infer_global(what)(Arithmetic)

        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            given = [spread(context, builder, value, kind) for value, kind in zip(args, sig.args, strict=True)]
            return getattr(builder, name)(*given, flags=("contract",))

        kinds = ((Vector, Vector), (Vector, types.Number), (types.Number, Vector)) if count == 2 else ((Vector,),)
        for kind in kinds:
            lower_builtin(what, *kind)(emit)

    for what, name in ((operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"), (operator.truediv, "fdiv")):
        lower(what, name, 2)
    lower(operator.neg, "fneg", 1)

    def place(context: Any, builder: Any, kind: Any, a: Any, i: Any) -> Any:
        data = context.make_array(kind)(context, builder, a).data
        return builder.bitcast(builder.gep(data, [i]), ir.PointerType(values))

    @intrinsic
    def _zero(typing: Any) -> Any:
        return vector(), lambda context, builder, sig, args: ir.Constant(values, [0.0] * LANES)

    @intrinsic
    def _load(typing: Any, a: Any, i: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            found = builder.load(place(context, builder, sig.args[0], *args))
            found.align = 8
            return found

        return vector(a, types.intp), emit

    @intrinsic
    def _store(typing: Any, a: Any, i: Any, v: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            builder.store(args[2], place(context, builder, sig.args[0], *args[:2])).align = 8
            return context.get_dummy_value()

        return types.void(a, types.intp, v), emit

    @intrinsic
    def _larger(typing: Any, v: Any, w: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return builder.select(builder.fcmp_ordered(">", *args), *args)

        return vector(v, w), emit

    def turn(by: int) -> Any:
        from_ = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [(lane + by) % LANES for lane in range(LANES)])

        @intrinsic
        def turned(typing: Any, v: Any) -> Any:
            return vector(v), lambda context, builder, sig, args: builder.shuffle_vector(args[0], args[0], from_)

        return turned

    def unary(name: str) -> Any:
        @intrinsic
        def function(typing: Any, v: Any) -> Any:
            def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
                kind = ir.FunctionType(values, [values])
                called = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64")
                return builder.call(called, args)

            return vector(v), emit

        return function

    root, size, back, on = unary("sqrt"), unary("fabs"), turn(-1), turn(1)
    overload(zero)(lambda: lambda: _zero())
    overload(load)(lambda a, i: lambda a, i: _load(a, i))
    overload(store)(lambda a, i, v: lambda a, i, v: _store(a, i, v))
    overload(larger)(lambda v, w: lambda v, w: _larger(v, w))
    overload(before)(lambda v: lambda v: back(v))
    overload(after)(lambda v: lambda v: on(v))
    overload(np.sqrt)(lambda x: (lambda x: root(x)) if isinstance(x, Vector) else None)
    overload(abs)(lambda x: (lambda x: size(x)) if isinstance(x, Vector) else None)


later(_forms)
