"""The recipe of CONTRIBUTING, followed literally: our wheel, a fresh environment, another folder, an engine of its own.

Nothing is fetched: the environment borrows the packages that ours has, but neither our checkout nor what installs it.
"""

import os
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest

pytest.importorskip("hatchling", reason="pip install hatchling editables, which build the wheels")
if not os.environ.get("CROSSCHECK_RECIPE"):
    pytest.skip("more than a minute of CPU: make recipe", allow_module_level=True)

ROOT = Path(__file__).parents[2]
#: A rebound that loses a tenth, told by the receipt, and what that does to the heights.
DECLARES = """
    def declares(self, profile, needs, dt):
        lost = Declared(0.9 * needs.restitution, 1e-9, "a tenth of every rebound is lost")
        return {"restitution": lost} if needs.regime == "impact" else {}
"""
LAWS = '''"""What it does by design: nine tenths of every rebound."""

import numpy as np
from adapters.law import Deviation
from adapters.stepping import step_count
from adapters.trajectory import Trajectory


def law_of(metric):
    def law(scene, dt, measure):
        ball, y, v = scene.bodies[1], scene.bodies[1].pose[1] - scene.bodies[1].shape.radius, scene.bodies[1].twist[1]
        e, states = scene.material("floor", ball.name).restitution, [(y, v)]
        for _ in range(step_count(scene.duration, dt)):
            low, was, v = y <= 1e-9, v, v + scene.gravity[1] * dt
            v = max(v, -0.9 * e * min(0.0, was)) if low else v
            y += v * dt
            states.append((y, v))
        pose, twist = np.zeros((len(states), 2, 3)), np.zeros((len(states), 2, 3))
        pose[:, 1, 1], twist[:, 1, 1] = np.array(states).T
        pose[:, 1, 1] += ball.shape.radius
        told = measure(scene, Trajectory(np.arange(len(states)) * dt, pose, twist, None, dt, "completed"))[metric][0]
        return None if told is None else (told, 1e-9)

    return law


DEVIATIONS = tuple(
    Deviation("lossy", ("plain",), "bounce", f"apex[[]{n}]", law_of(f"apex[{n}]"), "a tenth is lost", "its own code")
    for n in range(1, 6)
)
'''
FAMILIES = """
[[family]]
id = "lossy-rest"
profiles = ["plain"]
scene = "bounce"
metrics = ["apex_interval_ratio", "apex_growth", "rest_time"]
reason = "a tenth of every rebound is lost, so that the ball comes to rest too early"
source = "its own code"
releases = ">=0.1"
"""


def call(folder, *command, **more):
    """Run a command as a user would; returns what it said, or fails with it."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "CROSSCHECK", "VIRTUAL_ENV"))}
    done = subprocess.run(
        [str(part) for part in command], cwd=folder, env=kept, capture_output=True, text=True, timeout=900
    )
    assert done.returncode == more.get("status", 0), done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A fresh environment with our package from its wheel; returns the folder and a function for its commands."""
    folder = tmp_path_factory.mktemp("elsewhere")
    call(folder, sys.executable, "-m", "venv", "--without-pip", folder / "venv")
    python = folder / "venv" / "bin" / "python"
    packages = next((folder / "venv" / "lib").glob("python*/site-packages"))
    # A plain line adds a folder to the path without what stands in its own .pth files: our checkout stays out.
    (packages / "borrowed.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    pip = (python, "-m", "pip", "--quiet", "--disable-pip-version-check")
    call(folder, *pip, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", folder, ROOT)
    (wheel,) = folder.glob("contact_crosscheck-*.whl")
    call(folder, *pip, "install", "--no-deps", "--force-reinstall", wheel)
    where = call(folder, python, "-c", "import adapters; print(adapters.__file__)")
    assert str(packages) in where and str(ROOT) not in where
    return folder, python, pip


@pytest.mark.timeout(1800)
def test_engine_from_the_recipe_with_a_law_and_a_finding(site):
    folder, python, pip = site
    begun, crosscheck = time.monotonic(), python.parent / "crosscheck"
    call(folder, crosscheck, "new-adapter", "lossy")
    package = folder / "lossy" / "crosscheck_lossy"
    call(folder, *pip, "install", "--no-deps", "--no-build-isolation", "--editable", folder / "lossy")
    call(folder / "lossy", python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "0", "tests")
    small = ("--engine", "lossy", "--dim", "2", "--jobs", "1", "--param", "e=0.8", "--out", folder / "out")
    assert "Every check passes" in call(folder, crosscheck, "run", "bounce", *small)

    text = (package / "__init__.py").read_text()
    old = text[text.index("    def declares") : text.index("    def build")]
    text = text.replace(old, DECLARES.lstrip("\n") + "\n").replace("import Contacts,", "import Contacts, Declared,")
    text = text.replace("bounce = pair.restitution *", "bounce = 0.9 * pair.restitution *")
    (package / "__init__.py").write_text(text)
    (package / "laws.py").write_text(LAWS)
    (package / "findings").mkdir()
    (package / "findings" / "families.toml").write_text(FAMILIES)
    small = ("--engine", "lossy", "--dim", "2", "--jobs", "1", "--quick", "--out", folder / "out")
    call(folder, crosscheck, "run", "bounce", *small, status=1)
    call(
        folder,
        crosscheck,
        "accept",
        "--engine",
        "lossy",
        "--jobs",
        "1",
        "--family",
        "lossy-rest",
        "--out",
        folder / "out",
    )
    call(folder, crosscheck, "run", "bounce", *small)
    rows = (folder / "out" / "rows.csv").read_text()
    assert ",fail,explained," in rows and ",fail,known," in rows and "a tenth is lost" in rows
    assert ",new," not in rows and ",drifted," not in rows
    print(f"from new-adapter to a run with its own law and finding: {time.monotonic() - begun:.0f} s")
