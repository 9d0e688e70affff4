"""Tiny releases of an engine as local wheels, an environment cache of their own, and pip that knows nothing else."""

import os
import shutil
import sys
import zipfile
from importlib.metadata import distribution
from pathlib import Path

import pytest

from adapters import registry
from validation import identity
from validation.records.store import Store
from validation.releases import choosing, environments

HERE = Path(__file__).parent
#: The engine itself; what a release does differently replaces the lines of `CHANGES`.
ENGINE = (HERE / "toy_physics.py").read_text()
#: Release -> what is different there.
CHANGES = {
    "1.0.0": (),
    "1.1.0": (("KEEPS = 1.0", 'raise ImportError("libtoy.so.1: cannot open shared object file")'),),
    "1.2.0": (('FASTEST = float("inf")', "FASTEST = 3.0"),),
    "2.0.0": (("KEEPS = 1.0", "KEEPS = 0.9"),),
}


def write_wheel(folder, name, version, files, requires=()):
    """A wheel of pure Python, or of anything that is there."""
    info = f"{name}-{version}.dist-info"
    metadata = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
    metadata += "".join(f"Requires-Dist: {each}\n" for each in requires)
    wheel = "Wheel-Version: 1.0\nGenerator: tests\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    contents = {**files, f"{info}/METADATA": metadata, f"{info}/WHEEL": wheel}
    contents[f"{info}/RECORD"] = "".join(f"{path},,\n" for path in (*contents, f"{info}/RECORD"))
    with zipfile.ZipFile(folder / f"{name}-{version}-py3-none-any.whl", "w") as archive:
        for path, content in contents.items():
            archive.writestr(path, content)


@pytest.fixture(scope="session")
def released(tmp_path_factory):
    """`released(version, files)`: a folder with all releases of `toyphysics`, and one of numpy."""

    def made(numpy, files):
        folder = tmp_path_factory.mktemp("wheels")
        for version, changes in CHANGES.items():
            source = ENGINE.replace("VERSION", version)
            for old, new in changes:
                assert old in source
                source = source.replace(old, new)
            write_wheel(folder, "toyphysics", version, {"toyphysics.py": source})
        write_wheel(folder, "numpy", numpy, files)
        return folder

    return made


#: Parts of numpy's distribution that are not installed: what nothing here imports would be compiled for each release.
LEFT_OUT = {"__pycache__", "..", "tests", "distutils", "f2py", "polynomial", "testing"}


@pytest.fixture(scope="session")
def wheels(released):
    """All releases of `toyphysics`, and what they need of the numpy that is installed here."""
    numpy = distribution("numpy")
    kept = [f for f in numpy.files if "dist-info" not in str(f) and not LEFT_OUT & set(f.parts)]
    return released(numpy.version, {str(f): f.locate().read_bytes() for f in kept})


@pytest.fixture(scope="session")
def shared_cache(tmp_path_factory):
    """Cache folder that tests share which only use environments; those of all workers of pytest-xdist."""
    own = tmp_path_factory.getbasetemp()
    return (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "environments"


@pytest.fixture
def local(wheels, shared_cache, monkeypatch):
    """Pip finds the local wheels and nothing else; caches lie in a folder of the tests."""
    for name, value in {
        "PIP_NO_INDEX": "1",
        "PIP_FIND_LINKS": str(wheels),
        "PIP_CONFIG_FILE": "/dev/null",
        "XDG_CACHE_HOME": str(shared_cache),
    }.items():
        monkeypatch.setenv(name, value)
    choosing.offered.cache_clear()
    yield shared_cache
    choosing.offered.cache_clear()


@pytest.fixture
def own_cache(local, tmp_path, monkeypatch):
    """A cache folder of this test alone, for those that damage or count."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def copied(own_cache, shared_cache, monkeypatch):
    """`copied(release)`: an environment of this test alone, copied from the shared one, which is built once."""

    def made(release):
        with monkeypatch.context() as shared:
            shared.setenv("XDG_CACHE_HOME", str(shared_cache))
            first = environments.build(release).path
        shutil.copytree(first, environments.folder() / first.name, symlinks=True)
        return environments.existing(release)

    return made


@pytest.fixture
def toy(local, tmp_path_factory, monkeypatch):
    """The adapter `toy` is installed here; its engine is not."""
    folder = tmp_path_factory.mktemp("plugin")
    shutil.copy(HERE / "toy_plugin.py", folder)
    info = folder / "toy_plugin-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: toy-plugin\nVersion: 1\n")
    (info / "entry_points.txt").write_text(f"[{registry.GROUP}]\ntoy = toy_plugin:ToyEngine\n")
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setenv("PYTHONPATH", str(folder))
    registry.forget()
    identity.adapter_hash.cache_clear()
    yield folder
    registry.forget()
    identity.adapter_hash.cache_clear()
    sys.modules.pop("toy_plugin", None)


@pytest.fixture
def store(tmp_path):
    """A store of results in a folder of its own."""
    found = Store(tmp_path / "out")
    yield found
    found.close()
