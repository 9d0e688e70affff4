"""A plugin with a switch per fault: Chipmunk behind an adapter that misbehaves in the way its profile is called.

Installed as somebody else's package by the fixture `faulty`; nothing of the project imports it.
"""

import ctypes
import gc
import json
import math
import os
import signal
import socket
import stat
import subprocess
import sys
import threading
import time
from dataclasses import replace
from typing import ClassVar

import numpy as np

from adapters.chipmunk import ChipmunkEngine
from adapters.engine import Contacts, Engine, EngineFacts, Setting


class Mute(Exception):
    """An error that cannot even say what it is."""

    def __str__(self):
        raise RuntimeError("no text")


class Bad(BaseException):
    """Not an Exception."""


def abort():
    os.abort()


def segfault():
    ctypes.string_at(0)


def leave_at_once():
    os._exit(7)


def leave():
    sys.exit(0)


def interrupt():
    raise KeyboardInterrupt


def close_generator():
    raise GeneratorExit


def raise_base():
    raise Bad("not an Exception")


def raise_mute():
    raise Mute


def raise_steering():
    raise RuntimeError("\x1b[2J\x00\ud800 first\r\nsecond")


def raise_long():
    raise RuntimeError("x" * 10**7)


def signal_real_time():
    os.kill(os.getpid(), signal.SIGRTMIN + 5)


def signal_kill():
    os.kill(os.getpid(), signal.SIGKILL)


def signal_trap():
    os.kill(os.getpid(), signal.SIGTRAP)


def recurse():
    recurse()


def leak():
    hoard = []
    while True:
        hoard.append(bytearray(2**28))


def hang():
    while True:
        time.sleep(3600)


def print_much():
    for _ in range(100):
        os.write(1, b"\x1b[31m=cmd" + b"x" * 2**20)
    raise RuntimeError("after a line of 100 MB")


def print_binary():
    os.write(2, bytes(range(256)) * 64)
    raise RuntimeError("after binary output")


def round_up():
    ctypes.CDLL("libm.so.6").fesetround(0x800)


def trap_floats():
    ctypes.CDLL("libm.so.6").feenableexcept(4)


def ignore_numpy_errors():
    np.seterr(all="ignore")


def close_streams():
    os.close(1)
    os.close(2)
    sys.stdout = None


def close_stream_objects():
    sys.stdout.close()
    sys.stderr.close()


def close_files():
    os.closerange(3, 256)


def open_files():
    for _ in range(200):
        os.open(os.devnull, os.O_RDONLY)


def limit_files():
    import resource

    resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3))


def limit_file_size():
    import resource

    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))


def change_environment():
    os.environ["OMP_NUM_THREADS"] = "many"
    os.environ.pop("PATH", None)


def change_folder():
    os.chdir("/")


def change_mask():
    os.umask(0o777)


def handle_signals():
    signal.signal(signal.SIGALRM, lambda *_: os._exit(3))
    signal.setitimer(signal.ITIMER_REAL, 3600.0)


def block_signals():
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGINT})


def patch_math():
    math.hypot = lambda *values: 42.0


def patch_numpy():
    np.linalg.norm = lambda *values, **options: 42.0


def patch_loop():
    import adapters.stepping

    adapters.stepping.step_count = lambda duration, dt: 1


def patch_class():
    from adapters.trajectory import Trajectory

    Trajectory.state_hash = lambda self: "0" * 16


def patch_json():
    json.dumps = lambda *values, **options: "{}"


def patch_module():
    sys.modules["validation.metrics"] = None


def stop_collecting():
    gc.disable()


def lower_recursion():
    sys.setrecursionlimit(200)


def clear_path():
    sys.path.clear()


def leave_thread():
    threading.Thread(target=time.sleep, args=(3600,)).start()


def leave_child():
    subprocess.Popen(["sleep", "3600"])


def leave_session():
    subprocess.Popen(["sleep", "3601"], start_new_session=True)


def half_answer():
    """The length of a long answer on each open socket, and no more."""
    for number in sockets():
        os.write(number, (10**6).to_bytes(4, "big"))


def shut_sockets():
    """Nothing more can be read from them: the next case ends the process."""
    for number in sockets():
        with socket.socket(fileno=os.dup(number)) as ours:
            ours.shutdown(socket.SHUT_RD)


def clear_modules():
    sys.modules.clear()


def change_later():
    def change():
        time.sleep(0.05)
        patch_numpy(), patch_math()

    threading.Thread(target=change, daemon=True).start()


def sockets():
    for number in range(3, 64):
        try:
            if stat.S_ISSOCK(os.fstat(number).st_mode):
                yield number
        except OSError:
            continue


def fork():
    """Two processes come back to their caller from here, as from a library that starts a server of its own."""
    os.fork()


def answer_for_another():
    """A sound answer on each open socket, for a case of an engine that was never asked."""
    slot = {"scene": "impact", "params": {"v": 2.0}, "dimension": 2, "engine": "chipmunk", "profile": "tuned",
            "dt": 1 / 240, "iterations": None, "ulp": 0}  # fmt: skip
    told = {"slot": slot, "cell": "c", "scene_version": 1, "engine_version": "7", "outcome": "ok", "reason": "",
            "metrics": {"rebound_ratio": [12345.0, ""]}, "state_hash": "0" * 16, "settings": [], "receipts": [],
            "readback": {}, "certificate": {}, "initial_change": [], "log": ""}  # fmt: skip
    answer = json.dumps({"observation": told, "recording": None, "changed": "", "unwritten": None}).encode()
    for number in sockets():
        os.write(number, len(answer).to_bytes(4, "big") + answer)


#: What is done once while a world is built.
DEEDS = {
    deed.__name__: deed
    for deed in (
        abort, segfault, leave_at_once, leave, interrupt, close_generator, raise_base, raise_mute, raise_steering,
        raise_long, signal_real_time, signal_kill, signal_trap, recurse, leak, print_much, print_binary, round_up,
        trap_floats, ignore_numpy_errors, close_streams, close_stream_objects, close_files, open_files, limit_files,
        limit_file_size, change_environment, change_folder, change_mask, handle_signals, block_signals, patch_math,
        patch_numpy, patch_loop, patch_class, patch_json, patch_module, stop_collecting, lower_recursion, clear_path,
        leave_thread, leave_child, leave_session, hang, fork, answer_for_another, half_answer, shut_sockets,
        clear_modules, change_later,
    )
}  # fmt: skip


class Odd:
    """Behind the simulation: values that are not what they should be."""

    def __init__(self, inner, fault):
        self.inner, self.fault, self.samples = inner, fault, 0
        odd = {"long_change": ("\x1b[31m" + "x" * 10**6,), "change_number": 7}
        self.initial_change = odd.get(fault, ())

    def __getattr__(self, name):
        return getattr(self.inner, name)

    def pose(self):
        self.samples += 1
        pose = self.inner.pose()
        if self.fault == "pose_nan" and self.samples > 3:
            pose = pose * math.nan
        if self.fault == "pose_shape":
            pose = pose[:, :2]
        if self.fault == "pose_uneven":
            return [[1.0], [1.0, 2.0]]
        if self.fault == "pose_text":
            return [["here"] * 3] * len(pose)
        if self.fault == "pose_jumps" and self.samples > 3:
            pose = pose + 1e308
        return pose

    def twist(self):
        return None if self.fault == "twist_none" else self.inner.twist()

    def record(self, samples, stride, contacts):
        """States are read one by one, from here."""

    def contacts(self):
        if self.fault == "contacts_flat":
            return replace(self.inner.contacts(), point=np.zeros(3))
        if self.fault == "contacts_beyond":
            return Contacts(np.array([0]), np.array([5]), *(np.zeros((1, 2)) for _ in range(3)), np.zeros(1))
        return 7 if self.fault == "contacts_number" else self.inner.contacts()

    def readback(self):
        cyclic = {}
        cyclic["me"] = cyclic
        odd = {
            "readback_list": [1, 2],
            "readback_cyclic": cyclic,
            "readback_odd": {1: math.nan, "b": {2, 3}, "c": Mute(), "d": np.float32(3), "e": 10**400, "f": "\x00" * 9},
            "readback_large": {str(k): "x" * 1000 for k in range(100000)},
        }
        return odd.get(self.fault) or self.inner.readback()

    def certificate(self):
        odd = {"certificate_list": ["certified"], "certificate_number": {"certified": False, "reasons": 7}}
        return odd.get(self.fault, {})


ODD = (
    "pose_nan", "pose_shape", "pose_text", "pose_uneven", "pose_jumps", "twist_none", "contacts_number",
    "contacts_flat", "contacts_beyond", "readback_list", "readback_cyclic", "readback_odd", "readback_large",
    "certificate_list", "certificate_number", "long_change", "change_number",
)  # fmt: skip
ASKED = (
    "settings_none", "settings_words", "settings_nan", "settings_object", "settings_raise", "settings_leave",
    "refusal_number", "refusal_long", "refusal_raise", "declares_none", "build_none",
)  # fmt: skip


def rule(fault):
    """Settings of a profile: those of Chipmunk, and the name of the fault."""

    def settings(needs, dt):
        if fault == "settings_none":
            return None
        if fault == "settings_words":
            return ["iterations"]
        if fault == "settings_raise":
            raise RuntimeError("no\nsettings")
        if fault == "settings_leave":
            sys.exit(0)
        own = list(ChipmunkEngine.profiles["tuned"](needs, dt))
        if fault == "settings_nan":
            own.append(Setting("odd", math.nan, "to be odd"))
        if fault == "settings_object":
            own.append(Setting("odd", Mute(), "to be odd"))
        return [*own, Setting("fault", fault, "to test what it costs")]

    return settings


class FaultyEngine(Engine):
    """Chipmunk with a fault."""

    facts = EngineFacts("faulty", "Faulty", "faulty", frozenset({2}), ChipmunkEngine.facts.scheme, 1 / 240)
    profiles: ClassVar = {fault: rule(fault) for fault in ("none", *DEEDS, *ODD, *ASKED)}

    def version(self):
        return "6.6.6"

    def refuses(self, scene, profile):
        if profile == "refusal_raise":
            raise SystemExit("refused to say")
        return {"refusal_number": 7, "refusal_long": "no\x1b[0m " + "x" * 10**6}.get(profile)

    def declares(self, profile, needs, dt):
        return None if profile == "declares_none" else ChipmunkEngine().declares("tuned", needs, dt)

    def build(self, scene, dt, settings):
        own = {name: value for name, value in settings.items() if name not in ("fault", "odd")}
        fault = settings["fault"]
        if fault in DEEDS:
            DEEDS[fault]()
        if fault == "build_none":
            return None
        made = ChipmunkEngine().build(scene, dt, own)
        return Odd(made, fault) if fault in ODD else made
