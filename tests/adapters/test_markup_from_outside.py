"""What a model says of its own bytes: they have been read as UTF-8 by then."""

import pytest

from adapters.model.markup import parsed


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1", "utf-16", "of-my-own"])
def test_a_model_with_an_encoding(encoding):
    text = f'<?xml version="1.0" encoding="{encoding}"?><model name="körper"/>'
    assert parsed(text, "model", "is no model").attributes == {"name": "körper"}
