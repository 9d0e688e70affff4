"""MJCF that is written for releases without ``MjSpec``: MuJoCo reads back every option that was said."""

import pytest

mujoco = pytest.importorskip("mujoco")


def written(**said):
    """Options of the model that MuJoCo compiles from the text, and the text."""
    from adapters.mujoco.releases import Mjcf

    model = Mjcf(mujoco)
    model.option.integrator, model.option.cone = mujoco.mjtIntegrator.mjINT_EULER, mujoco.mjtCone.mjCONE_PYRAMIDAL
    vars(model.option).update(said)
    text = model.text()
    return mujoco.MjModel.from_xml_string(text).opt, text


def kinds(kind):
    return [each for each in kind.__members__.values() if isinstance(each, kind)]


@pytest.mark.parametrize(
    ("name", "kind"), [("solver", mujoco.mjtSolver), ("integrator", mujoco.mjtIntegrator), ("cone", mujoco.mjtCone)]
)
def test_every_solver_integrator_and_cone_reads_back(name, kind):
    known = [each for each in kinds(kind) if "DISCRETE" not in str(each)]  # MJCF has no word for that one yet
    assert len(known) > 1
    for each in known:
        for value in (each, int(each)):
            assert getattr(written(**{name: value})[0], name) == int(each), each


def test_disabled_options_read_back_bit_by_bit():
    bits = [int(each) for each in mujoco.mjtDisableBit.__members__.values() if int(each).bit_count() == 1]
    assert len(bits) > 10
    for flags in (*bits, bits[0] | bits[-1], sum(bits)):
        found, text = written(disableflags=flags)
        assert found.disableflags == flags and text.count('="disable"') == flags.bit_count()
    found, text = written(disableflags=0)
    assert found.disableflags == 0 and "<flag" not in text and "solver" not in text


def test_numbers_read_back_to_the_last_bit():
    said = {"timestep": 1.0 / 240.0, "gravity": [0.1, 0.0, -9.81], "impratio": 1.0 / 3.0, "iterations": 77,
            "tolerance": 1e-13, "noslip_iterations": 3}  # fmt: skip
    found, text = written(**said)
    for name, value in said.items():
        told = getattr(found, name)
        assert (list(told) if name == "gravity" else told) == value, name
    assert text.endswith("</mujoco>\n") and "<asset" not in text and "<contact" not in text and "<keyframe" not in text
    assert '<compiler angle="radian"' in text


@pytest.mark.parametrize("solver", ["Newton", "CG", "PGS"])
def test_written_model_with_a_solver_of_its_own(solver, tmp_path):
    """Profile `model` brings what its file says: a bug report of it ended in a traceback."""
    from click.testing import CliRunner

    from reports.command import main

    file = tmp_path / "model.xml"
    file.write_text(
        f'<mujoco><option solver="{solver}"/><worldbody><geom type="plane" size="1 1 1"/>'
        '<body pos="0 0 1"><freejoint/><geom size=".5"/></body></worldbody></mujoco>'
    )
    call = ["export", str(file), "--to", "mjcf", "--engine", "mujoco", "--profile", "model"]
    told = CliRunner().invoke(main, call)
    assert told.exit_code == 0, told.output
    found = mujoco.MjModel.from_xml_string(told.stdout).opt.solver
    assert found == getattr(mujoco.mjtSolver, f"mjSOL_{solver.upper()}")
