"""The scenes of the project: one file each, named here in the order in which they are shown.

``validation/scenes/NAME.py`` ends in ``SCENE = CanonicalScene(name="NAME", ...)``; `validation.catalogue` loads it.
Other packages bring theirs through the entry point group ``contact_crosscheck.scenes``.
"""

from __future__ import annotations

OURS = (
    "impact",
    "bounce",
    "stack",
    "incline",
    "head_on",
    "off_centre",
    "flat_box",
    "stacked_balls",
    "cradle",
    "galperin",
    "heavy_on_light",
    "v_groove",
    "pinch",
    "slide",
    "slide_to_roll",
    "oblique",
    "roll_incline",
    "rolling_spin",
    "masse",
    "pivot",
    "rocking_block",
    "tumble",
    "pair_matrix",
    "rocker",
    "hilltop",
    "thin_wall",
    "overhang",
    "ladder",
    "pyramid",
    "seam",
    "far_origin",
    "scales",
    "overlap",
    "position_correction",
    "pressed_box",
    "shove",
    "tilt_table",
    "long_rest",
    "closing_wall",
    "rack",
    "edge_drop",
    "kane",
    "domino",
    "painleve",
)
