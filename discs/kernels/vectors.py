"""Vectors of LANES numbers in compiled code: numba has no type for them, and a processor computes with all lanes at once.

In plain Python a vector is an array (LANES,). In compiled code it is one value, which LLVM keeps in registers; +, -, *, / and a
change of sign take vectors, or a vector and a number; `abs` and `numpy.sqrt` take one. So a formula for numbers, a law of rolling
for instance, serves for vectors too. From arrays of complex numbers come complex vectors, pairs of vectors in compiled code; they
take +, -, *, a change of sign, and 1/z.
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


def pair(v, w):
    """v + i w."""
    return v + 1j * w


def chosen(v, w, a, b):
    """The entries of a where v > w, elsewhere those of b."""
    return np.where(v > w, a, b)


def larger(v, w):
    """The larger entries; those of w where v is not a number."""
    return chosen(v, w, v, w)


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


@part
def total(v, spare):
    """The sum of the entries of a vector; `spare` (LANES,) is overwritten."""
    store(spare, 0, v)
    m = 0.0
    for i in range(LANES):
        m += spare[i]
    return m


def _forms() -> None:
    import operator

    from llvmlite import ir
    from numba.core import cgutils, types
    from numba.core.typing.templates import AbstractTemplate, infer_global, signature
    from numba.extending import intrinsic, lower_builtin, make_attribute_wrapper, models, overload, register_model

    values = ir.VectorType(ir.DoubleType(), LANES)

    class Vector(types.Type):
        def __init__(self) -> None:
            super().__init__("vector")

    @register_model(Vector)
    class _Model(models.PrimitiveModel):
        def __init__(self, manager: Any, kind: Any) -> None:
            super().__init__(manager, kind, values)

    class Pair(types.Type):
        def __init__(self) -> None:
            super().__init__("complex vector")

    @register_model(Pair)
    class _PairModel(models.StructModel):
        def __init__(self, manager: Any, kind: Any) -> None:
            super().__init__(manager, kind, [("real", vector), ("imag", vector)])

    vector, complex_vector = Vector(), Pair()
    for name in ("real", "imag"):
        make_attribute_wrapper(Pair, name, name)

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
            if any(isinstance(a, Vector) for a in args) and all(isinstance(a, Vector | types.Float | types.Integer) for a in args):
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

    def mixed(builder: Any, v: Any, w: Any, entries: Any) -> Any:
        """A vector of some of the 2 LANES entries of two vectors."""
        return builder.shuffle_vector(v, w, ir.Constant(ir.VectorType(ir.IntType(32), LANES), list(entries)))

    def paired(context: Any, builder: Any, real: Any, imag: Any) -> Any:
        made = cgutils.create_struct_proxy(complex_vector)(context, builder)
        made.real, made.imag = real, imag
        return made._getvalue()

    @intrinsic
    def _zero(typing: Any) -> Any:
        return vector(), lambda context, builder, sig, args: ir.Constant(values, [0.0] * LANES)

    @intrinsic
    def _pair(typing: Any, v: Any, w: Any) -> Any:
        return complex_vector(v, w), lambda context, builder, sig, args: paired(context, builder, *args)

    @intrinsic
    def _load(typing: Any, a: Any, i: Any) -> Any:
        of_complex = isinstance(a.dtype, types.Complex)

        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            start = place(context, builder, sig.args[0], *args)
            found = [builder.load(builder.gep(start, [ir.IntType(64)(k)])) for k in range(1 + of_complex)]
            for one in found:
                one.align = 8
            if not of_complex:
                return found[0]
            return paired(context, builder, *(mixed(builder, found[0], found[1], range(k, 2 * LANES, 2)) for k in range(2)))

        return (complex_vector if of_complex else vector)(a, types.intp), emit

    @intrinsic
    def _store(typing: Any, a: Any, i: Any, v: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            start, parts = place(context, builder, sig.args[0], *args[:2]), [args[2]]
            if isinstance(sig.args[2], Pair):
                given = cgutils.create_struct_proxy(complex_vector)(context, builder, args[2])
                order = [lane // 2 + lane % 2 * LANES for lane in range(2 * LANES)]
                parts = [mixed(builder, given.real, given.imag, half) for half in (order[:LANES], order[LANES:])]
            for k, value in enumerate(parts):
                builder.store(value, builder.gep(start, [ir.IntType(64)(k)])).align = 8
            return context.get_dummy_value()

        return types.void(a, types.intp, v), emit

    @intrinsic
    def _chosen(typing: Any, v: Any, w: Any, a: Any, b: Any) -> Any:
        def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return builder.select(builder.fcmp_ordered(">", *args[:2]), *args[2:])

        return vector(v, w, a, b), emit

    def turn(by: int) -> Any:
        @intrinsic
        def turned(typing: Any, v: Any) -> Any:
            places = [(lane + by) % LANES for lane in range(LANES)]
            return vector(v), lambda context, builder, sig, args: mixed(builder, args[0], args[0], places)

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
    overload(pair)(lambda v, w: lambda v, w: _pair(v, w))
    overload(chosen)(lambda v, w, a, b: lambda v, w, a, b: _chosen(v, w, a, b))
    overload(larger)(lambda v, w: lambda v, w: _chosen(v, w, v, w))
    overload(np.sqrt)(lambda x: (lambda x: root(x)) if isinstance(x, Vector) else None)
    overload(abs)(lambda x: (lambda x: size(x)) if isinstance(x, Vector) else None)

    def both(turned: Any) -> Any:
        def form(v):
            return (lambda v: _pair(turned(v.real), turned(v.imag))) if isinstance(v, Pair) else lambda v: turned(v)

        return form

    overload(before)(both(back))
    overload(after)(both(on))

    def pairs(a: Any, b: Any) -> tuple[bool, bool]:
        """Which of two arguments are complex vectors; none if another one is no vector and no number."""
        known = all(isinstance(x, Pair | Vector | types.Float | types.Integer) for x in (a, b))
        return known and isinstance(a, Pair), known and isinstance(b, Pair)

    sums: Any = {(True, True): lambda a, b: _pair(a.real + b.real, a.imag + b.imag)}
    differences: Any = {(True, True): lambda a, b: _pair(a.real - b.real, a.imag - b.imag)}
    products: Any = {
        (True, True): lambda a, b: _pair(a.real * b.real - a.imag * b.imag, a.real * b.imag + a.imag * b.real),
        (True, False): lambda a, b: _pair(a.real * b, a.imag * b),
        (False, True): lambda a, b: _pair(a * b.real, a * b.imag),
    }

    def quotient(a, z):
        scale = a / (z.real * z.real + z.imag * z.imag)
        return _pair(z.real * scale, -z.imag * scale)

    overload(operator.add)(lambda a, b: sums.get(pairs(a, b)))
    overload(operator.sub)(lambda a, b: differences.get(pairs(a, b)))
    overload(operator.mul)(lambda a, b: products.get(pairs(a, b)))
    overload(operator.truediv)(lambda a, z: quotient if pairs(a, z) == (False, True) else None)
    overload(operator.neg)(lambda a: (lambda a: _pair(-a.real, -a.imag)) if isinstance(a, Pair) else None)


later(_forms)
