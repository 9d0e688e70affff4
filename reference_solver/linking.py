"""How kernels become machine code: what only kernels call is carried to them as it is, and optimised there once.

numba makes machine code of every function by itself, all that it calls included and optimised anew. For kernels of
hundreds of functions, ten calls deep, this costs several times what compiling does. Here a function that only kernels
call ends as a module of its own that is neither linked, optimised nor translated; a kernel links all modules it needs,
directly or not, and is optimised as a whole.

numba has no public way to say so: this rests on its lowering pass and its code library, as of the releases that
`structures.TRIED` names. On any other release nothing imports this module (`compilation.py`).
"""

from __future__ import annotations

import copy
import gc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from numba.core import config as numba_config
from numba.core import types
from numba.core.caching import UserProvidedCacheLocator
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.cpu import CPUContext
from numba.core.typed_passes import NativeLowering

from reference_solver.structure_types import Convention

# numba's type hints do not know its configuration's attributes.
config: Any = numba_config

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
#: into searches through all that is being compiled.
BETWEEN_COLLECTIONS = 1_000_000


class Module(JITCodeLibrary):
    """The code of one function, to be linked into others."""

    def finalize(self) -> None:
        """Keep the module as it is."""
        self._raise_if_finalized()
        self._finalized = True


class Program(JITCodeLibrary):
    """The code of a kernel with all that it calls."""

    def _optimize_final_module(self) -> None:
        """Optimise once, with loops as they are.

        Two passes of numba's own, one of them for what counts references, unrolled and vectorised loops that run a few
        times each: a third more machine code, and no faster (docs/solver/performance.md).
        """
        options = llvm.create_pipeline_tuning_options(config.OPT)
        options.loop_vectorization = options.slp_vectorization = False
        options.loop_unrolling = options.loop_interleaving = False
        builder = llvm.create_pass_builder(self._codegen._tm, options)
        builder.getModulePassManager().run(self._final_module, builder)

    def finalize(self) -> None:
        """Link what is called by what is called as well, callers first: what nobody asked for yet is not linked."""
        known: set[Any] = set()
        ordered: list[Any] = []

        def visit(library: Any) -> None:
            if library in known:
                return
            known.add(library)
            if isinstance(library, Module):
                for other in library._linking_libraries:
                    visit(other)
            ordered.append(library)

        for library in self._linking_libraries:
            visit(library)
        self._linking_libraries = ordered[::-1]
        super().finalize()
        missing = [f.name for f in self._final_module.functions if f.is_declaration and f.name.startswith("_ZN")]
        if missing:
            raise AssertionError(f"{self.name}: not linked: {', '.join(missing)}")


@register_pass(mutates_CFG=True, analysis_only=False)
class ModuleLowering(NativeLowering):
    """Lower a function to a `Module`."""

    _name = "module_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower without making the function callable from Python."""
        state.library = Module(state.targetctx.codegen(), state.func_id.func_qualname)
        context, state.targetctx = state.targetctx, conventional(state.targetctx)
        state.targetctx.get_executable = not_callable
        try:
            return bool(super().run_pass(state))
        finally:
            state.targetctx = context


@register_pass(mutates_CFG=True, analysis_only=False)
class ProgramLowering(NativeLowering):
    """Lower a function to a `Program`."""

    _name = "program_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower with all code that is called."""
        state.library = Program(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        context, state.targetctx = state.targetctx, conventional(state.targetctx)
        try:
            return bool(super().run_pass(state))
        finally:
            state.targetctx = context


class Context(CPUContext):
    """numba's context with our convention for structures."""

    @property
    def call_conv(self) -> Convention:
        """How functions are called."""
        return Convention(self)

    def refresh(self) -> None:
        """Look for nothing new: what is compiled declares nothing, and its own pipeline has looked before.

        numba does so whenever a function is none of its builtins, some ten thousand times.
        """


def conventional(context: Any) -> Any:
    """Return numba's context with our convention for structures."""
    ours = copy.copy(context)
    ours.__class__ = Context
    return ours


def not_callable(library: Any, description: Any, environment: Any) -> Any:
    """Return what stands for the machine code: a builtin of its own, as numba demands, that refuses any arguments."""
    return f"{description.qualname} is called by kernels only".index


class Carried(CompilerBase):
    """Compiles functions that only kernels call."""

    def define_pipelines(self) -> list[Any]:
        """Return numba's own passes, the lowering apart."""
        return [with_lowering(self.state, ModuleLowering)]


class Whole(CompilerBase):
    """Compiles kernels."""

    def compile_extra(self, func: Any) -> Any:
        """Compile, and all that is called, with few searches for garbage."""
        thresholds = gc.get_threshold()
        gc.set_threshold(max(thresholds[0], BETWEEN_COLLECTIONS) if thresholds[0] else 0, *thresholds[1:])
        try:
            return super().compile_extra(func)
        finally:
            gc.set_threshold(*thresholds)

    def define_pipelines(self) -> list[Any]:
        """Return numba's own passes, the lowering apart."""
        return [with_lowering(self.state, ProgramLowering)]


def with_lowering(state: Any, lowering: type) -> Any:
    """Return numba's passes with another lowering, and without those that kernels do not need."""
    passes = DefaultPassBuilder.define_nopython_pipeline(state)
    needed = [(step, text) for step, text in passes.passes if step.__name__ not in NOT_NEEDED]
    passes.passes = [(lowering, text) if step is NativeLowering else (step, text) for step, text in needed]
    passes._finalized = False
    passes.finalize()
    return passes


def once_for_all_constants(function: Any) -> Any:
    """Have calls with a constant call the function that is there for variables.

    numba compiles a function anew for every constant that a call hands over: a fourth of the
    time. What a constant saves at run time LLVM finds by itself where it splices the call.
    """
    if hasattr(function, "py_func"):
        resolve = function.get_call_template

        def get_call_template(args: Any, keywords: Any) -> Any:
            plain = {name: types.unliteral(kind) for name, kind in dict(keywords).items()}
            return resolve(tuple(map(types.unliteral, args)), plain)

        function.get_call_template = get_call_template
    return function


class PerModule(UserProvidedCacheLocator):
    """Keeps a kernel below its module's name: checkouts and installations of the same sources share machine code.

    numba keeps it below a hash of where the source lies. What decides here is what the source says, and the folder's
    name covers all of that.
    """

    def __init__(self, function: Callable[..., object], file: str) -> None:
        super().__init__(function, file)
        self._cache_path = str(Path(config.CACHE_DIR) / function.__module__)


#: How numba is told of `PerModule`, by its settings.
LOCATION = {"CACHE_LOCATOR_CLASSES": f"{PerModule.__module__}.{PerModule.__qualname__}"}

#: What numba is told of kernels beyond what it offers to all, and of what only kernels call.
KERNEL: Any = {
    "pipeline_class": Whole,
    "_nrt": False,  # kernels allocate nothing; counting references to arrays cost two thirds of the time
    "no_cfunc_wrapper": True,
}
INNER: Any = KERNEL | {"pipeline_class": Carried, "no_cpython_wrapper": True}
