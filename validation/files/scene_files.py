"""Scene files (TOML or JSON), checked completely when read.

Their format is in `scene_format`; `stated` turns them into canonical scenes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from adapters.plain import one_line, wrong_fields
from adapters.scene import Scene, SceneError
from validation.canonical import CanonicalScene
from validation.files import model_files
from validation.files.scene_format import SceneModel, stated
from validation.files.scene_text import parsed, read_text
from validation.files.stated import Stated, canonical_of

#: Identifiers of the schema language and of the schema; the number is that of `SceneModel.format`.
DIALECT, SCHEMA_ID = "https://json-schema.org/draft/2020-12/schema", "urn:contact-crosscheck:scene:1"


def json_schema() -> dict[str, Any]:
    """JSON Schema of a scene file, for editors."""
    return {"$schema": DIALECT, "$id": SCHEMA_ID, **SceneModel.model_json_schema()}


def load_scene(path: Path) -> Scene:
    """Read and check a scene file; raises as `load_stated`."""
    return load_stated(path).scene


def load_stated(path: Path) -> Stated:
    """Read and check a scene file, with notes and the author's checks.

    Raises
    ------
    SceneError
        One line with the file and every wrong field.
    """
    return stated_from_text(read_text(path), path)


def stated_from_text(text: str, path: Path) -> Stated:
    """Check the text of the scene file from ``path``; raises as `load_stated`."""
    shown = one_line(path)
    try:
        model = SceneModel.model_validate(parsed(text, path))
    except ValidationError as errors:
        raise SceneError(f"{shown}: {wrong_fields(errors, 'file')}") from None
    try:
        return stated(model)
    except (SceneError, ArithmeticError) as error:  # overflow: numbers too large for masses and moments
        raise SceneError(f"{shown}: {one_line(error)}") from None


def canonical_from_file(path: Path) -> CanonicalScene:
    """Wrap a scene file so that it runs like a scene of the catalogue."""
    return canonical_from_text(read_text(path), path)


def canonical_from_text(text: str, path: Path) -> CanonicalScene:
    """Wrap the text of the scene file from ``path``; raises as `load_stated`."""
    if path.suffix.lower() not in (".toml", ".json"):
        return model_files.canonical_from_text(text, path)
    return canonical_of(stated_from_text(text, path), f"Scene file {path.name}")
