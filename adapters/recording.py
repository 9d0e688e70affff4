"""A run as a script: an adapter builds its world, and its calls are written as lines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from adapters.scene import Body, Scene
from adapters.script import literal

#: Types of values from an engine that are used unchanged.
PLAIN = (int, float, str, type(None), np.number, np.ndarray)
#: A longer line is written argument by argument.
LONG = 120


class Recording:
    """Lines of a script so far, and the rules for writing calls and values.

    Parameters
    ----------
    names
        Variables, by the last words of the calls and attributes that they hold: several with commas for unpacked
        values, "" for calls that are separate lines. Unnamed values are written where they are used, a call only once.
    dt
        The step; it is written as ``DT``.
    others
        Text for objects of our own classes.
    """

    def __init__(self, names: Mapping[str, str], dt: float, others: Mapping[type, str]) -> None:
        self.names = {word: name for name, words in names.items() for word in words.split()}
        self.dt, self.others = dt, others
        self.lines: list[str] = []
        #: Results of calls, written where they are used.
        self.unnamed: list[Recorded] = []
        #: Whether calls are made, or only written.
        self.calls = True
        #: Number of uses of each name; a repeated name is another variable, except for ``name = name.call()``.
        self.given: Counter[str] = Counter()

    def text(self, value: Any) -> str:
        """Text of a value."""
        if isinstance(value, Recorded):
            return _inside(value)[2]
        if value is self.dt:
            return "DT"
        if isinstance(value, np.ndarray) and value.dtype == np.float32:
            return f"np.array({literal(value.astype(str).astype(float))}, np.float32)"
        if isinstance(value, np.ndarray):
            return f"np.array({literal(value)})"
        if isinstance(value, list):
            return f"[{', '.join(map(self.text, value))}]"
        if isinstance(value, tuple):
            return f"({', '.join(map(self.text, value))}{',' if len(value) == 1 else ''})"
        return self.others.get(type(value)) or literal(value)

    def found(self, word: str, text: str, value: Any, once: bool) -> Any:
        """The value of ``text``, for further use; ``word`` is its last call or attribute, ``once`` marks calls."""
        name = self.names.get(word)
        if name and not text.startswith(f"{name}."):
            self.given[name] += 1
            number = str(self.given[name]) if self.given[name] > 1 else ""
            name = ", ".join(part + number for part in name.split(", "))
        if name is not None or (once and value is None):
            self.lines.append(f"{name} = {text}" if name else text)
        if name and "," in name:
            return tuple(Recorded(self, *part) for part in zip(value, name.split(", "), strict=True))
        if _is_plain(value):
            return value
        made = Recorded(self, value, name or text, once and name is None)
        self.unnamed += [made] if once and name is None else []
        return made


class Recorded:
    """An object of an engine and its text in a script: operations on it are done and written."""

    def __init__(self, recording: Recording, value: Any, text: str, once: bool = False) -> None:
        self.__dict__.update(_recording=recording, _value=value, _text=text, _once=once, _used=False)

    def __getattr__(self, name: str) -> Any:
        recording, value, text = _inside(self)
        found, text = getattr(value, name), f"{text}.{name}"
        return recording.found("" if callable(found) else name, text, found, False)

    def __setattr__(self, name: str, new: Any) -> None:
        recording, value, text = _inside(self)
        recording.lines.append(f"{text}.{name} = {recording.text(new)}")
        setattr(value, name, _real(new))

    def __getitem__(self, key: Any) -> Any:
        recording, value, text = _inside(self)
        return recording.found("", f"{text}[{recording.text(key)}]", value[_real(key)], False)

    def __call__(self, *given: Any, **named: Any) -> Any:
        """Call the engine."""
        recording, value, text = _inside(self)
        arguments = [*map(recording.text, given), *(f"{key}={recording.text(new)}" for key, new in named.items())]
        found = value(*map(_real, given), **{k: _real(new) for k, new in named.items()}) if recording.calls else None
        call = f"{text}({', '.join(arguments)})"
        if len(call) > LONG and named:
            call = "\n    ".join([f"{text}(", *(f"{argument}," for argument in arguments)]) + "\n)"
        return recording.found(text.rpartition(".")[2], call, found, True)


def _is_plain(value: Any) -> bool:
    return isinstance(value, PLAIN) or (isinstance(value, tuple) and all(map(_is_plain, value)))


def _inside(recorded: Recorded) -> tuple[Recording, Any, str]:
    held = recorded.__dict__
    assert not (held["_once"] and held["_used"]), f"{held['_text']} is used twice and needs a name"
    held["_used"] = True
    return held["_recording"], held["_value"], held["_text"]


def _real(value: Any) -> Any:
    """An argument for the engine."""
    if isinstance(value, Recorded):
        return value.__dict__["_value"]
    return type(value)(map(_real, value)) if type(value) in (list, tuple) else value


def written(
    simulation: Any,
    module: Any,
    name: str,
    names: Mapping[str, str],
    world: tuple[Scene, float, Mapping[str, Any]],
    others: Mapping[type, str] = MappingProxyType({}),
) -> tuple[list[str], list[str]]:
    """Lines that build a world with its ``bodies`` by name, and lines of a step, which is not made.

    Parameters
    ----------
    simulation
        Class of an adapter's worlds, called with ``(scene, dt, settings, module)``, whose ``_made(index, body)`` makes
        a body.
    module, name
        The engine, and how it is imported.
    names, others
        See `Recording`.
    world
        Scene, step [s] and settings.
    """
    recording = Recording(names, world[1], others)
    lasting = recording.given  # parts of a body are not needed for the next one

    class Written(simulation):
        def _made(self, index: int, asked: Body) -> Any:
            recording.lines += [""] if recording.lines[-1] else []
            recording.given = Counter(lasting)
            made = super()._made(index, asked)
            recording.lines += [f"bodies[{asked.name!r}] = {recording.text(made)}", ""]
            made.__dict__["_text"] = f"bodies[{asked.name!r}]"
            recording.given = lasting
            return made

    made = Written(*world, Recorded(recording, module, name))
    lost = [_inside(each)[2] for each in recording.unnamed if not each.__dict__["_used"]]
    assert not lost, f"{lost} are not used, and each needs a name"
    lines, recording.lines, recording.calls = recording.lines, [], False
    made.advance(1)
    step, recording.lines, recording.calls = recording.lines, [], True
    made.close()
    return lines[:-1] if not lines[-1] else lines, step
