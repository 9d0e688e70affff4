"""Files are written whole or not at all."""

import os
from pathlib import Path

import numpy as np
import pytest

from adapters.trajectory import Trajectory, load_trajectory
from adapters.whole import write


def test_file_that_cannot_be_written_whole(tmp_path):
    path = tmp_path / "rows.csv"
    write(path, "old")
    with pytest.raises(UnicodeEncodeError):
        write(path, "new \ud800")
    assert path.read_text() == "old" and os.listdir(tmp_path) == ["rows.csv"]
    write(path, "new")
    assert path.read_text() == "new"


def test_a_link_and_a_device(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "file")
    write(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "file").read_text() == "text"
    (tmp_path / "loop").symlink_to("loop")
    write(tmp_path / "loop", "text")
    assert (tmp_path / "loop").read_text() == "text"
    write(Path(os.devnull), "text")
    assert not Path(os.devnull).is_file()


def test_trajectory_read_while_another_is_written(tmp_path):
    path = tmp_path / "kept.npz"
    path.write_bytes(b"old")
    found = Trajectory(np.array([0.0]), np.zeros((1, 1, 3)), np.zeros((1, 1, 3)), None, 0.1, "completed")
    with path.open("rb") as reader:
        found.save(path)
        assert reader.read() == b"old"
    assert load_trajectory(path).state_hash() == found.state_hash()
