"""What has numba compile kernels in less time: work that it does for code of other kinds is left out or done once.

The machine code is the same, byte for byte. None of this is offered by numba: it rests on the release that
`constraints.txt` names, and names that another release lacks fail at import or at the first kernel.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from types import SimpleNamespace
from typing import Any

import llvmlite.binding as llvm
from numba.core import compiler, inline_closurecall, transforms, types
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.types.functions import BaseFunction

# numba's type hints do not know that methods can be replaced.
Flags: Any = compiler.Flags
Functions: Any = BaseFunction
Processor: Any = PostProcessor
Inlining: Any = inline_closurecall

#: Passes that change nothing in kernels, each of which goes through all statements and has the lives of all variables
#: found anew: kernels have no ``with``, no functions in functions, no expressions of arrays, nothing compiled for a
#: constant.
NOT_NEEDED = frozenset(
    [
        "WithLifting",
        "InlineClosureLikes",
        "RewriteDynamicRaises",
        "MakeFunctionToJitFunction",
        "FindLiterallyCalls",
        "LiteralUnroll",
        "LiteralPropagationSubPipelinePass",
        "InlineOverloads",
        "NopythonRewrites",
        "DumpParforDiagnostics",
    ]
)

#: Objects made between two searches for garbage while a kernel compiles: with Python's own 700 a fifth of the time went
#: into searches through all that is being compiled (87 s of CPU for the planar located step, 69 s now, 67 s without
#: any), for .66 GB of memory instead of .55.
BETWEEN_COLLECTIONS = 1_000_000


@contextmanager
def sparing() -> Iterator[None]:
    """Have numba compile in less time while the block runs."""
    with ExitStack() as stack:
        for spared in (few_collections, flags_soon_compared, scalars_typed_once, unwatched_lock, lives_when_asked):
            stack.enter_context(spared())
        yield


@contextmanager
def few_collections() -> Iterator[None]:
    """Have Python search for garbage seldom."""
    thresholds = gc.get_threshold()
    gc.set_threshold(max(thresholds[0], BETWEEN_COLLECTIONS) if thresholds[0] else 0, *thresholds[1:])
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)


@contextmanager
def flags_soon_compared() -> Iterator[None]:
    """Have numba compare flags by those that are set in either: all others are what they are by default.

    It looks them up for every call in every function, under a hash that is the same for all, and made two tables of
    some forty options for each comparison: a fifteenth of the time.
    """
    compared = Flags.__eq__

    def equal(one: Any, other: Any) -> Any:
        if type(one) is not type(other):
            return compared(one, other)
        mine, its = one._values, other._values
        return mine == its or all(getattr(one, name) == getattr(other, name) for name in mine.keys() | its.keys())

    hashed, same = Flags.__hash__, hash(Flags())
    Flags.__eq__ = equal
    Flags.__hash__ = lambda flags: same
    try:
        yield
    finally:
        Flags.__eq__ = compared
        Flags.__hash__ = hashed


#: What is operated on by itself.
SCALARS = (types.Integer, types.Float, types.Boolean)

#: What calls with scalars return, by function and types.
typed: dict[Any, Any] = {}


@contextmanager
def scalars_typed_once() -> Iterator[None]:
    """Have numba find out once what an operator, or a function of numbers, returns for scalars of given types.

    For each ``a + b`` it tries all that the operator can mean for arrays and others first, and keeps why that failed.
    """
    resolve = Functions.get_call_type

    def get_call_type(function: Any, context: Any, args: Any, keywords: Any) -> Any:
        if keywords or not all(isinstance(kind, SCALARS) for kind in args):
            return resolve(function, context, args, keywords)
        key = id(function), id(context), tuple(args)
        if key not in typed:  # with who is meant, so that no other has its number
            typed[key] = function, context, resolve(function, context, args, keywords)
        return typed[key][-1]

    Functions.get_call_type = get_call_type
    try:
        yield
    finally:
        Functions.get_call_type = resolve


@contextmanager
def unwatched_lock() -> Iterator[None]:
    """Have nobody told of each call into LLVM that it begins and ends.

    numba adds up how long LLVM's lock was held, anew for each function that is being compiled when it is asked for.
    """
    lock = llvm.ffi.lib._lock
    watching, lock._cblist = lock._cblist, []
    try:
        yield
    finally:
        lock._cblist = watching


@contextmanager
def lives_when_asked() -> Iterator[None]:
    """Have the lives of variables found where they are asked for, and what is spliced not copied before.

    numba finds after each pass which variables live where each block begins, for Python's objects and generators only;
    and of a function that it reads anew for each place it is spliced into, it keeps two copies.
    """
    run, copying = Processor.run, Inlining.copy

    def without_entries(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> Any:
        found = self.func_ir
        if found.is_generator:  # not ours, and of another thread
            return run(self, emit_dels, extend_lifetimes)
        found.blocks = transforms.canonicalize_cfg(found.blocks)
        found.variable_lifetime, found.generator_info = VariableLifetime(found.blocks), None
        return self._insert_var_dels(extend_lifetimes=extend_lifetimes) if emit_dels else None

    Processor.run = without_entries
    Inlining.copy = SimpleNamespace(deepcopy=lambda block: block)
    try:
        yield
    finally:
        Processor.run, Inlining.copy = run, copying
