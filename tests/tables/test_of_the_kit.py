"""Scenes of the conformance kit, what faults spoil and what is said of them, and what probes read, is kept."""

import pytest
from made import KIT
from telling import check


@pytest.mark.parametrize("name", KIT)
def test_scenes_faults_words_and_readings_are_as_they_were_kept(name):
    check(name, KIT[name], share=1e-7, nothing=1e-10)
