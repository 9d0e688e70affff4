"""Engines that are programs: what a wrong, silent or dying one does to its case; the package for one."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

from adapters import pipe, registry
from adapters.conformance import check_adapter
from adapters.engine import EngineError
from adapters.pipe import PipeEngine, process
from adapters.scene import Body, Disc, HalfSpace, Pair, Scene
from adapters.stepping import run
from adapters.trajectory import Sampling
from reports.command import main
from validation.catalogue import CATALOGUE
from validation.cells import Outcome, Slot
from validation.workers import run_cells

ROOT = Path(__file__).parents[2]
#: A ball that hangs over a floor whatever is asked; FAULT runs before the answer to WHEN is written.
PROGRAM = """
import json, math, os, signal, subprocess, sys, time
HELLO = {"protocol": 1, "name": "faulty", "version": "1", "facts": {"title": "Faulty", "dimensions": [2],
         "scheme": {"order": "none", "position_offset": 0}, "customary_dt": 0.01},
         "profiles": {"plain": {"iterations": {"value": 5, "because": "any"}}}}
def contact(**other):
    return {"bodies": [0, 1], "point": [0, 0], "normal": [0, 1], "impulse": None, "gap": None} | other
for line in sys.stdin:
    asked = json.loads(line)
    state = {"pose": [[0, 0, 0], [0, 1, 0]], "twist": [[0, 0, 0], [0, 0, 0]], "contacts": []}
    answers = {"hello": HELLO, "refuses": {"refuses": None}, "build": state | {"readback": {}}, "step": state}
    answer = {"id": asked["id"], **answers[asked["ask"]]}
    if asked["ask"] == "WHEN":
        pass
        FAULT
    print(json.dumps(answer), flush=True)
"""
SCENE = Scene(
    "hanging", 1, 2,
    (Body("floor", HalfSpace((0.0, 1.0)), motion="fixed"), Body("ball", Disc(0.5), pose=(0.0, 1.0, 0.0))),
    (Pair(),), (0.0, -9.81), 0.05,
)  # fmt: skip


@pytest.fixture
def faulty(tmp_path, monkeypatch):
    """`faulty(when, fault, scene)` runs a scene on the program with that fault."""

    class Faulty(PipeEngine):
        command = (sys.executable, "engine.py")
        folder = tmp_path

    def drive(when, fault, scene=SCENE):
        (tmp_path / "engine.py").write_text(PROGRAM.replace("WHEN", when).replace("FAULT", fault))
        engine = Faulty()
        return run(engine, scene, 0.01, {"iterations": 5}, Sampling(1, 0.0))

    yield drive
    pipe._idle.clear()


def test_program_without_a_fault(faulty):
    found = faulty("step", "answer['contacts'] = [contact(impulse=[None, 2], gap=-1e-3)]")
    assert found.finish == "completed" and found.pose[-1, 1].tolist() == [0, 1, 0]
    rows = found.contacts.rows
    assert rows.impulse[0, 1] == 2 and rows.gap[0] == -1e-3 and str(rows.impulse[0, 0]) == "nan"


FAULTS = [
    # lines
    ("step", "print('a debug print')", "step: not a table of JSON: 'a debug print'"),
    ("step", "answer = [1]", "step: not a table of JSON: '[1]'"),
    ("step", "print()", "step: not a table of JSON: ''"),
    ("step", "sys.stdout.buffer.write(bytes([255, 254, 10]))", "step: not a table of JSON: "),
    ("step", "print('[' * 10**5)", "step: not a table of JSON: '[[["),
    ("step", "print('{\"id\": 4, \"pose\": ' + '9' * 5000 + '}')", "step: not a table of JSON: '{\"id\": 4"),
    ("step", "answer['id'] = 7", "step: id: 7 was answered to question 4"),
    ("step", "answer['id'] = True", "step: id: True was answered to question 4"),
    ("step", "del answer['id']", "step: id: None was answered to question 4"),
    ("step", "sys.stdout.write(2 * (json.dumps(answer) + chr(10)))", "step: more than was asked for was answered"),
    ("step", "print(json.dumps(answer), flush=True); time.sleep(.05)", "step: id: 4 was answered to question 5"),
    ("step", "print('x' * (2**26 + 9), end='', flush=True); time.sleep(99)", "step: a line of more than 64 MiB"),
    # fields
    ("step", "answer['pose'][1][0] = math.nan", "step: pose.1.0: must be a finite number"),
    ("step", "answer['twist'][0][2] = -math.inf", "step: twist.0.2: must be a finite number"),
    ("step", "answer['pose'][1][0] = '1'", "step: pose.1.0: must be a number"),
    ("step", "answer['pose'][1][0] = True", "step: pose.1.0: must be a number"),
    ("step", "answer['pose'][1] = 0.5", "step: pose.1: "),
    ("step", "answer['pose'][1][0] = 10**400", "step: pose.1.0: must be a number"),
    ("step", "del answer['twist']", "step: twist: is missing"),
    ("step", "answer['contact'] = []", "step: contact: there is no such field"),
    ("step", "answer['pose'].pop()", "step: pose: 1 rows, one for each of the 2 bodies is needed"),
    ("step", "answer['twist'][1].append(0)", "step: twist.1: 4 numbers, 3 are needed"),
    ("step", "answer['contacts'] = None", "step: contacts: "),
    ("step", "answer['contacts'] = [contact(), contact(bodies=[0, 2])]", "step: contacts.1.bodies: 0 and 2 must be"),
    ("step", "answer['contacts'] = [contact(bodies=[1, 1])]", "step: contacts.0.bodies: 1 and 1 must be two different"),
    ("step", "answer['contacts'] = [contact(normal=[0, 1, 0])]", "step: contacts.0.normal: 3 numbers, 2 are needed"),
    ("step", "answer['contacts'] = [contact(impulse=[0, math.nan])]", "step: contacts.0.impulse.1: must be a finite"),
    ("build", "answer['pose'][1][1] = None", "build: pose.1.1: null, but the start of a world is known"),
    ("build", "answer = {'id': 3, 'error': 'iterations: 5 are too few'}", "build: iterations: 5 are too few"),
    ("refuses", "answer['refuses'] = 0", "refuses: refuses: must be a text"),
    ("hello", "answer['protocol'] = 2", "hello: protocol: must be 1"),
    ("hello", "answer['facts']['dimensions'] = [4]", "hello: facts.dimensions.0: must be 2 or 3"),
    ("hello", "answer['facts']['customary_dt'] = 0", "hello: facts.customary_dt: must be greater than 0"),
    ("hello", "answer['facts']['abilities'] = ['flight']", "hello: facts.abilities.0: must be "),
    ("hello", "answer['profiles'] = {}", "hello: profiles: "),
    ("hello", "del answer['profiles']['plain']['iterations']['because']", "hello: profiles.plain.iterations.because:"),
    # ends
    ("hello", "sys.exit('cannot find its licence')", "hello: the process ended with exit code 1: cannot find its lic"),
    ("step", "answer = answer['nothing']", "step: the process ended with exit code 1: KeyError: 'nothing'"),
    ("step", "os.kill(os.getpid(), signal.SIGSEGV)", "step: the process was killed by SIGSEGV"),
    ("step", "print('half', end='', flush=True); os._exit(0)", "step: the process ended with exit code 0"),
    ("step", "subprocess.Popen(['sleep', '99']); os._exit(3)", "step: the process ended with exit code 3"),
    ("step", "os.close(1); time.sleep(99)", "step: the process closed its output"),
]  # fmt: skip


@pytest.fixture
def impatient(monkeypatch):
    """Two seconds for an answer."""
    monkeypatch.setattr(process.Process.ask, "__defaults__", (2.0,))


@pytest.mark.parametrize(("when", "fault", "said"), FAULTS, ids=[said for *_, said in FAULTS])
def test_fault_of_a_program_as_one_line_that_names_the_field(faulty, monkeypatch, when, fault, said):
    monkeypatch.setattr(process, "ALIVE", 0.1)
    monkeypatch.setattr(process, "ENDING", 0.2)
    with pytest.raises(EngineError) as error:
        faulty(when, fault)
    assert str(error.value).startswith(said) and len(str(error.value).splitlines()) == 1
    assert len(str(error.value)) < 600


def test_null_of_a_state_as_divergence(faulty):
    found = faulty("step", "answer['twist'][1][1] = None")
    assert found.finish == "diverged" and found.reason == "the state is not finite at t = 0.01 s"


def test_flood_of_standard_error_without_effect(faulty):
    assert faulty("step", "sys.stderr.write('noise ' * 10**6)").finish == "completed"


def test_silence(faulty, impatient):
    with pytest.raises(EngineError, match="step: no answer after 2 s"):
        faulty("step", "time.sleep(99)")


def test_question_that_is_not_read(faulty, impatient):
    """Longer than a pipe holds, so that writing it would wait for ever."""
    many = tuple(Body(f"ball{k}", Disc(0.5), pose=(2.0 * k, 1.0, 0.0)) for k in range(900))
    scene = Scene("many", 1, 2, many, (Pair(),), (0.0, 0.0), 0.05)
    with pytest.raises(EngineError, match="build: no answer after 2 s"):
        faulty("refuses", "print(json.dumps(answer), flush=True); time.sleep(99)", scene)


def test_program_that_is_not_installed(tmp_path):
    class Absent(PipeEngine):
        command = ("no-such-program", "engine.py")

    with pytest.raises(ImportError, match="no-such-program: No such file"):
        Absent()
    Absent.command = "python3 engine.py"
    with pytest.raises(EngineError, match=r"command: 'python3 engine\.py' must be a tuple"):
        Absent()


def installed(folder, name, class_name):
    """What an installer makes of the package in ``folder``, and the environment in which it is found."""
    info = folder / f"crosscheck_{name}-0.1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: crosscheck-{name}\nVersion: 0.1\n")
    (info / "entry_points.txt").write_text(f"[{registry.GROUP}]\n{name} = crosscheck_{name}:{class_name}\n")
    return os.environ | {"PYTHONPATH": os.pathsep.join((str(folder), str(ROOT)))}


@pytest.fixture
def written(tmp_path, monkeypatch):
    """`written(name, class_name)`: folder of the package that ``--pipe`` writes, as if installed."""

    def write(name, class_name):
        done = CliRunner().invoke(main, ["new-adapter", name, "--pipe", "--into", str(tmp_path)])
        assert done.exit_code == 0, done.output
        environment = installed(tmp_path / name, name, class_name)
        monkeypatch.setenv("PYTHONPATH", environment["PYTHONPATH"])
        monkeypatch.syspath_prepend(str(tmp_path / name))
        registry.forget()
        return tmp_path / name / f"crosscheck_{name}"

    yield write
    monkeypatch.undo()
    registry.forget()
    pipe._idle.clear()


def test_written_program_conforms_and_runs_in_workers(written):
    folder = written("piped", "Piped")
    texts = {path.name: path.read_text() for path in folder.iterdir()}
    assert set(texts) == {"__init__.py", "engine.py", "PROTOCOL.txt"} and '"ask": "build"' in texts["PROTOCOL.txt"]
    assert len(texts["engine.py"].splitlines()) < 140 and len(texts["PROTOCOL.txt"].splitlines()) < 60
    project = tomllib.loads((folder.parent / "pyproject.toml").read_text())["project"]
    assert project["entry-points"][registry.GROUP] == {"piped": "crosscheck_piped:Piped"}
    code = "from crosscheck_piped import Piped; from adapters.conformance import check_adapter; import sys; "
    code += "found = [str(each) for each in check_adapter(Piped()) if not each.holds]; sys.exit('; '.join(found) or 0)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (observation,) = run_cells([Slot("impact", (), 2, "piped", "plain", 1 / 240)])
    assert observation.outcome is Outcome.OK and observation.engine_version == "0.1"


@pytest.mark.few(2)
@pytest.mark.parametrize(
    ("fault", "outcome", "said"),
    [("sys.exit('it gave up')", Outcome.CRASHED, "step: the process ended with exit code 1: it gave up"),
     ("while True: pass", Outcome.TIMED_OUT, "no answer after 5 s"),
     ("world.x = 'x' * 10**10", Outcome.CRASHED, "step: the process ended with exit code 1: MemoryError")],
)  # fmt: skip
def test_failing_program_in_a_worker(written, fault, outcome, said):
    program = written("piped", "Piped") / "engine.py"
    program.write_text(program.read_text().replace("            world.step()", f"            {fault}"))
    slots = [Slot("impact", (("e", e),), 2, "piped", "plain", 1 / 240) for e in (0.5, 0.7)]
    found = list(run_cells(slots, timeout=5.0 if outcome is Outcome.TIMED_OUT else 300.0, memory=2**32))
    assert [each.outcome for each in found] == [outcome, outcome] and all(said in each.reason for each in found)


def test_changed_program_as_another_identity(written):
    from validation.identity import adapter_hash

    program, found = written("piped", "Piped") / "engine.py", []
    for text in (program.read_text(), program.read_text() + "# changed\n", program.read_text()):
        program.write_text(text)
        adapter_hash.cache_clear()
        found.append(adapter_hash("piped"))
    adapter_hash.cache_clear()
    assert found[0] == found[2] != found[1]


@pytest.mark.long
def test_javascript_engine_conforms_and_passes_a_scene(written):
    """The example of the documentation, on a package of npm."""
    if shutil.which("npm") is None:
        pytest.skip("needs node and npm")
    folder = written("rapierjs", "Rapierjs")
    get = ["npm", "install", "--no-audit", "--no-fund", "--ignore-scripts", "@dimforge/rapier2d-compat@0.21.0"]
    done = subprocess.run(get, cwd=folder, capture_output=True, text=True)
    if done.returncode and "CI" not in os.environ:
        pytest.skip("npm cannot get the engine")
    assert done.returncode == 0, done.stderr
    shutil.copy(ROOT / "docs/howto/rapier.mjs", folder / "engine.mjs")
    command = '("node", "--disable-wasm-trap-handler", "engine.mjs")'
    adapter = folder / "__init__.py"
    adapter.write_text(adapter.read_text().replace('("python3", "engine.py")', command))
    import crosscheck_rapierjs

    found = check_adapter(crosscheck_rapierjs.Rapierjs())
    assert [str(each) for each in found if not each.holds] == []
    assert [each.check for each in found if each.status == "expected"] == ["spin"]
    slots = [Slot("slide", (), 2, "rapierjs", "default", 1 / 240), Slot("slide", (), 3, "rapierjs", "default", 1 / 240)]
    planar, spatial = sorted(run_cells(slots), key=lambda each: each.slot.dimension)
    assert planar.outcome is Outcome.OK and spatial.outcome is Outcome.UNSUPPORTED
    scene = CATALOGUE["slide"].scene(2)
    (check,) = (each for each in CATALOGUE["slide"].checks(scene, 1 / 240) if each.metric == "stopping_distance")
    assert abs(planar.metrics["stopping_distance"][0] - check.truth) <= check.bound


def test_no_process_is_left_over(faulty):
    pipe._idle.clear()  # other tests may have left some
    faulty("step", "pass")
    (waiting,) = pipe._idle.values()
    pids = [each._popen.pid for each in waiting]
    assert len(pids) == 1
    waiting.clear()
    assert not Path(f"/proc/{pids[0]}").exists()
