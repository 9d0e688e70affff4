"""What numba is to know of structures (`structures.py`): their types, layout, fields, and how they are handed over."""

from __future__ import annotations

import hashlib
from inspect import signature
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.callconv import CPUCallConv
from numba.core.datamodel import models, register_default
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_builtin,
    lower_getattr_generic,
    type_callable,
    typeof_impl,
    unbox,
)

from reference_solver.structures import DECLARED, LISTENERS, Kind

BYTE, WORD = ir.IntType(8), ir.IntType(64)
#: Bytes of one word: no number of a structure takes more.
SIZE = 8


class Structure(types.Type):
    """The type of a structure, known by its class and what it holds."""

    def __init__(self, kind: Any, members: Any) -> None:
        self.instance_class, self.members = kind, tuple(types.unliteral(member) for member in members)
        # Types are looked up by the hash of their key, some millions of times: names of members stand for members.
        self.digest = hashlib.sha256(" ".join((kind.__module__, *map(str, self.members))).encode()).hexdigest()
        super().__init__(f"{kind.__name__}_{self.digest[:12]}")

    @property
    def key(self) -> Any:
        """What tells one from another."""
        return self.instance_class, self.digest

    def place(self, field: str) -> int:
        """Return the index of a field."""
        return int(self.instance_class._fields.index(field))


@typeof_impl.register(Kind)
def no_named_tuple(value: Any, c: Any) -> None:
    """Leave what a structure's class is to its constructor."""


def register(kind: Any) -> None:
    """Tell numba of a structure."""

    @typeof_impl.register(kind)
    def typed(value: Any, c: Any) -> Structure:
        return Structure(kind, [typeof_impl(member, c) for member in value])

    @type_callable(kind)
    def constructor(context: Any) -> Any:
        def typer(*members: Any) -> Structure | None:
            return Structure(kind, members) if len(members) == len(kind._fields) else None

        typer.pysig = signature(kind.__base__)  # type: ignore[attr-defined]
        return typer

    lower_builtin(kind, types.VarArg(types.Any))(constructed)


@register_default(Structure)
class StructureModel(models.PrimitiveModel):
    """A pointer to words; each member begins at one."""

    def __init__(self, manager: Any, structure: Structure) -> None:
        super().__init__(manager, structure, BYTE.as_pointer())
        self.offsets = [0]
        for member in structure.members:
            self.offsets.append(self.offsets[-1] + words(manager[member]))
        self.block = ir.ArrayType(WORD, self.offsets[-1])

    def get_return_type(self) -> Any:
        """Return all of it: memory of who returns it is gone."""
        return self.block

    def as_return(self, builder: Any, value: Any) -> Any:
        """Read all of it."""
        return builder.load(builder.bitcast(value, self.block.as_pointer()))

    def from_return(self, builder: Any, value: Any) -> Any:
        """Keep what was returned."""
        memory = cgutils.alloca_once(builder, self.block)
        builder.store(value, memory)
        return builder.bitcast(memory, BYTE.as_pointer())

    def allocate(self, builder: Any) -> Any:
        """Return memory for one, for as long as the function runs."""
        return builder.bitcast(cgutils.alloca_once(builder, self.block), BYTE.as_pointer())

    def at(self, builder: Any, pointer: Any, k: int) -> Any:
        """Return the address of member k."""
        return builder.gep(pointer, [WORD(SIZE * self.offsets[k])], inbounds=True)

    def put(self, context: Any, builder: Any, pointer: Any, k: int, value: Any) -> None:
        """Write member k."""
        member, address = self._fe_type.members[k], self.at(builder, pointer, k)
        if isinstance(member, Structure):
            size = WORD(SIZE * (self.offsets[k + 1] - self.offsets[k]))
            cgutils.raw_memcpy(builder, address, value, size, 1)
        else:
            builder.store(value, builder.bitcast(address, value.type.as_pointer()))


def words(model: Any) -> int:
    """Words that a value takes: one for each number of it."""
    return model.offsets[-1] if isinstance(model, StructureModel) else numbers(model.get_value_type())


def numbers(kind: Any) -> int:
    """Numbers in a type of LLVM's."""
    if isinstance(kind, ir.ArrayType):
        return int(kind.count) * numbers(kind.element)
    if isinstance(kind, ir.LiteralStructType):
        return sum(map(numbers, kind.elements))
    return 1


def constructed(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    """Lay a structure out."""
    model = context.data_model_manager[sig.return_type]
    pointer = model.allocate(builder)
    for k, (value, given, member) in enumerate(zip(values, sig.args, sig.return_type.members, strict=True)):
        model.put(context, builder, pointer, k, context.cast(builder, value, given, member))
    return pointer


@infer_getattr
class Fields(AttributeTemplate):
    """Types of what a structure holds."""

    key = Structure

    def generic_resolve(self, typ: Structure, attr: str) -> Any:  # type: ignore[override]
        """Return the type of a field; None if there is no such field."""
        return typ.members[typ.place(attr)] if attr in typ.instance_class._fields else None


@lower_getattr_generic(Structure)
def field(context: Any, builder: Any, typ: Structure, value: Any, attr: str) -> Any:
    """Read a field; one that is a structure is where it is."""
    k = typ.place(attr)
    model, member = context.data_model_manager[typ], typ.members[k]
    address = model.at(builder, value, k)
    if isinstance(member, Structure):
        return address
    kind = context.get_value_type(member)
    return impl_ret_borrowed(context, builder, member, builder.load(builder.bitcast(address, kind.as_pointer())))


@unbox(Structure)
def from_tuple(typ: Structure, obj: Any, c: Any) -> NativeValue:
    """Lay out a tuple of Python's."""
    model = c.context.data_model_manager[typ]
    pointer = model.allocate(c.builder)
    failed = cgutils.false_bit
    for k, member in enumerate(typ.members):
        native = c.unbox(member, c.pyapi.tuple_getitem(obj, k))
        model.put(c.context, c.builder, pointer, k, native.value)
        failed = c.builder.or_(failed, native.is_error)
    return NativeValue(pointer, is_error=failed)


class Convention(CPUCallConv):
    """Calls of kernels: memory of structures is read and by nothing else written to while a function runs."""

    def decorate_function(self, fn: Any, args: Any, fe_argtypes: Any, noalias: bool = False) -> None:
        """Say so of each structure."""
        super().decorate_function(fn, args, fe_argtypes, noalias=noalias)
        packer = self._get_arg_packer(fe_argtypes)
        places = packer._unflattener.unflatten(list(self.get_arguments(fn)))
        for typ, argument in zip(fe_argtypes, places, strict=True):
            if isinstance(typ, Structure):
                for attribute in ("noalias", "captures(none)"):
                    argument.add_attribute(attribute)


for kind in DECLARED:
    register(kind)
LISTENERS.append(register)
