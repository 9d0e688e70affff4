"""One colour per engine: readable on light and dark paper, and told apart by colour-blind readers."""

from itertools import combinations

import numpy as np
import pytest

from adapters import registry
from adapters.engine import ROLES
from reports.palette import INK, MARKS, OTHERS, PAPER, colours_of, dash_of, heat, shape_of

#: Engines that are set apart bring no colour: the band between both papers holds no more than five that stay apart.
ENGINES = {name: colour for name, colour in colours_of(registry.names()).items() if not registry.facts(name).apart}

#: Machado, Oliveira and Fernandes, IEEE TVCG 15 (2009) 1291: full protanopia, deuteranopia, tritanopia, in linear RGB.
VISION = {
    "normal": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
#: Just noticeable differences of Oklab are near 0.02; five of them part small marks that do not touch.
APART = 0.1


def linear(colour):
    c = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def luminance(colour):
    return float(linear(colour) @ [0.2126, 0.7152, 0.0722])


def oklab(rgb):
    """B. Ottosson, A perceptual color space for image processing (2020)."""
    lms = np.cbrt(np.array([[0.4122214708, 0.5363325363, 0.0514459929], [0.2119034982, 0.6806995451, 0.1073969566],
                            [0.0883024619, 0.2817188376, 0.6299787005]]) @ np.clip(rgb, 0.0, 1.0))  # fmt: skip
    return np.array([[0.2104542553, 0.7936177850, -0.0040720468], [1.9779984951, -2.4285922050, 0.4505937099],
                     [0.0259040371, 0.7827717662, -0.8086757660]]) @ lms  # fmt: skip


@pytest.mark.parametrize("colour", sorted({*ENGINES.values(), *OTHERS}))
@pytest.mark.parametrize("paper", PAPER.values())
def test_contrast_of_colours(colour, paper):
    """WCAG 2.2, 1.4.11: graphics need 3:1."""
    bright, dark = sorted((luminance(colour), luminance(paper)), reverse=True)
    assert (bright + 0.05) / (dark + 0.05) >= 3.0


@pytest.mark.parametrize("vision", VISION)
def test_engine_colours_distinct_in_colour_blindness(vision):
    seen = {name: oklab(VISION[vision] @ linear(colour)) for name, colour in ENGINES.items()}
    for a, b in combinations(seen, 2):
        assert np.linalg.norm(seen[a] - seen[b]) >= APART, (a, b)


@pytest.mark.parametrize("scheme", PAPER)
def test_readable_number_on_the_shade_of_a_failing_share(scheme):
    """WCAG 2.2, 1.4.3: text needs 4.5:1, on every shade; from one shade to the next light runs one way only."""
    shades = [heat(scheme, k) for k in range(21)]
    assert shades[0] == PAPER[scheme]
    for shade in shades:
        bright, dark = sorted((luminance(shade), luminance(INK[scheme])), reverse=True)
        assert (bright + 0.05) / (dark + 0.05) >= 4.5, shade
    steps = np.diff([luminance(shade) for shade in shades])
    assert np.all(steps < 0.0) if scheme == "light" else np.all(steps > 0.0)
    hues = [np.arctan2(*oklab(linear(shade))[:0:-1]) for shade in shades[1:]]
    assert np.ptp(hues) < np.radians(20.0)


def test_engine_colour_independent_of_other_engines():
    assert colours_of(["bullet"])["bullet"] == colours_of(["mujoco", "bullet", "toy"])["bullet"]
    others = colours_of(["zeta", "alpha", "bullet"])
    assert others["alpha"] == OTHERS[0] and others["zeta"] == OTHERS[1]


def test_profiles_of_one_engine_differ_in_shape_and_dash():
    for engine in filter(registry.adapter, registry.names()):
        adapter = registry.adapter(engine)
        # Profiles without a role share one mark.
        roles = {adapter.facts.roles.get(profile) for profile in adapter.profiles}
        assert len({shape_of(p) for p in adapter.profiles}) == len({dash_of(p) for p in adapter.profiles}) == len(roles)
    assert shape_of("of somebody") not in {shape for shape, _ in MARKS.values()}


def test_colour_of_an_engine_set_apart():
    apart = [name for name in registry.names() if registry.facts(name).apart]
    assert apart and not [name for name in apart if registry.facts(name).colour]


def test_marks_of_roles_and_colours_of_our_engines():
    assert set(MARKS) == set(ROLES)
    ours = [name for name in ENGINES if registry.is_ours(registry.entry(name))]
    assert not {ENGINES[name] for name in ours} & set(OTHERS) and len({ENGINES[name] for name in ours}) == len(ours)
