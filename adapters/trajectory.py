"""Trajectories: records of the step loop, the same for every engine."""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Array, Contacts
from adapters.whole import write

Finish = Literal["completed", "diverged"]
#: A value from a trajectory, or None and the reason.
Measured = tuple[float | None, str]


@dataclass(frozen=True)
class Sampling:
    """Recording options of the step loop.

    Parameters
    ----------
    stride
        Steps between two samples of the state.
    contacts_from
        Contacts and impulses are recorded at every sample after this time [s]; None records none. Engines
        report the impulses of their last step only, so recording them needs stride 1.

    Raises
    ------
    ValueError
        For a stride below 1, or one above 1 where contacts are recorded.
    """

    stride: int = 1
    contacts_from: float | None = None

    def __post_init__(self) -> None:
        if isinstance(self.stride, bool) or not isinstance(self.stride, int) or self.stride < 1:
            raise ValueError(f"stride: {self.stride!r} must be a whole number of steps, at least 1")
        if self.contacts_from is not None and self.stride != 1:
            raise ValueError(f"stride: {self.stride} must be 1 where contacts are recorded")


@dataclass(frozen=True)
class ContactRecord:
    """Contacts of many samples, flat; sample s owns rows ``offset[s]:offset[s + 1]`` of `rows`.

    ``step`` (s,): index of the trajectory sample that each contact sample belongs to.
    """

    step: NDArray[np.int64]
    offset: NDArray[np.int64]
    rows: Contacts

    def between(self, a: int, b: int) -> tuple[NDArray[np.int64], Array]:
        """Sample index and impulse on the body with the higher index, for all contacts of bodies a and b."""
        first, second = min(a, b), max(a, b)
        chosen = np.flatnonzero((self.rows.a == first) & (self.rows.b == second))
        sample = np.searchsorted(self.offset, chosen, side="right") - 1
        return sample, self.rows.impulse[chosen]

    def impulse_between(self, a: int, b: int) -> Array:
        """Sum of the impulses on the higher-indexed body at each contact sample, (s, d) [N s]."""
        total = np.zeros((len(self.step), self.rows.impulse.shape[1]))
        sample, impulse = self.between(a, b)
        np.add.at(total, sample, impulse)
        return total

    def impulse_on(self, body: int) -> Array:
        """Sum of the impulses of all its contacts on one body at each contact sample, (s, d) [N s]."""
        order, bodies = self._by_body
        chosen = order[slice(*np.searchsorted(bodies, [body, body + 1]))]
        row = chosen % len(self.rows.b)
        sign = np.where(chosen < len(self.rows.b), 1.0, -1.0)  # b stands first below, and a is pushed the other way
        total = np.zeros((len(self.step), self.rows.impulse.shape[1]))
        np.add.at(total, np.searchsorted(self.offset, row, side="right") - 1, sign[:, None] * self.rows.impulse[row])
        return total

    @cached_property
    def _by_body(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Rows in the order of the bodies that they push, each row twice, and those bodies."""
        both = np.concatenate([self.rows.b, self.rows.a])
        order = np.argsort(both, kind="stable")
        return order, both[order]


@dataclass(frozen=True)
class Trajectory:
    """What an engine did with a scene.

    Parameters
    ----------
    t
        Sample times [s], (s,); t[0] = 0 is the state the engine holds before its first step.
    pose, twist
        (s, n, 3) and (s, n, 3) planar, (s, n, 7) and (s, n, 6) spatial.
    contacts
        Recorded contacts, or None.
    dt
        The step [s].
    finish, reason
        ``diverged`` and why, if the state stopped being finite or exploded; samples end there.
    out_of_plane
        Farthest that any point of a lifted planar scene has left its plane at a sample [m]; None where none is lifted.
    """

    t: Array
    pose: Array
    twist: Array
    contacts: ContactRecord | None
    dt: float
    finish: Finish
    reason: str = ""
    initial_change: tuple[str, ...] = ()
    readback: dict[str, Any] = field(default_factory=dict)
    certificate: dict[str, Any] = field(default_factory=dict)
    out_of_plane: float | None = None
    wall_time: float = 0.0

    def __repr__(self) -> str:
        """What it holds, in place of thousands of numbers."""
        contacts = "contacts not recorded" if self.contacts is None else f"{len(self.contacts.rows.a)} contacts"
        until = f"{len(self.t)} samples until {self.t[-1]:.6g} s" if len(self.t) else "no samples"
        return f"<{self.finish}: {self.pose.shape[1]} bodies in {self.dimension}-D, {until}, {contacts}>"

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return 2 if self.pose.shape[2] == 3 else 3

    def state_hash(self) -> str:
        """Sixteen hex digits over the bits of all sampled times, poses and twists (-0.0 counts as 0.0)."""
        digest = hashlib.sha256()
        for array in (self.t, self.pose, self.twist):
            digest.update(np.ascontiguousarray(array + 0.0).tobytes())
        return digest.hexdigest()[:16]

    def save(self, path: Path) -> None:
        """Write as a plain ``.npz`` (no pickles), metadata as JSON inside."""
        arrays: dict[str, Any] = {"t": self.t, "pose": self.pose, "twist": self.twist}
        if self.contacts is not None:
            rows = self.contacts.rows
            arrays |= {"contact_step": self.contacts.step, "contact_offset": self.contacts.offset}
            arrays |= {f"contact_{k}": getattr(rows, k) for k in ("a", "b", "point", "normal", "impulse", "gap")}
        meta = {
            key: getattr(self, key)
            for key in ("dt", "finish", "reason", "initial_change", "readback", "certificate", "out_of_plane")
        }
        arrays["meta"] = np.array(json.dumps(meta, default=str))
        stream = io.BytesIO()
        np.savez_compressed(stream, **arrays)
        write(path, stream.getvalue())


def load_trajectory(path: Path) -> Trajectory:
    """Read what `Trajectory.save` wrote."""
    with np.load(path, allow_pickle=False) as data:
        meta = json.loads(str(data["meta"]))
        contacts = None
        if "contact_step" in data:
            rows = Contacts(*(data[f"contact_{k}"] for k in ("a", "b", "point", "normal", "impulse", "gap")))
            contacts = ContactRecord(data["contact_step"], data["contact_offset"], rows)
        meta["initial_change"] = tuple(meta["initial_change"])
        return Trajectory(data["t"], data["pose"], data["twist"], contacts, **meta)
