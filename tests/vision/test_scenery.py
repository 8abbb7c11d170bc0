"""Drawn backgrounds look as they did: figures and weights rest on them."""

import numpy as np
import pytest

from vidsindy_lite.vision import rendering as scenery

# Blue, green, red of pixels [25::65, 30::60] of an image of 256 x 192, seed 7.
LOOKS = {
    "plain": (
        "158 154 150 162 158 154 167 163 159 172 168 164 158 154 150 162 158 154 167 163 159 "
        "172 168 164 158 154 150 162 158 154 167 163 159 172 168 164"
    ),
    "sky": (
        "215 171 135 214 170 134 216 172 136 202 158 122 222 190 163 203 171 144 203 171 144 "
        "214 182 155 230 210 193 207 187 170 207 187 170 207 187 170"
    ),
    "hills": (
        "215 171 135 214 170 134 216 172 136 202 158 122 222 190 163 203 171 144 164 152 138 "
        "164 152 138 67 101 87 75 109 95 57 91 77 75 109 95"
    ),
    "sea": (
        "215 171 135 214 170 134 216 172 136 202 158 122 153 127 83 155 129 85 153 127 83 "
        "153 127 83 139 113 69 144 118 74 139 113 69 145 119 75"
    ),
    "wood": (
        "102 136 172 111 145 181 108 142 178 103 137 173 93 127 163 93 127 163 74 108 144 82 "
        "116 152 112 146 182 98 132 168 98 132 168 96 130 166"
    ),
    "bricks": (
        "87 101 139 89 103 137 81 95 139 93 107 146 93 107 142 98 112 150 93 107 137 96 110 "
        "142 105 119 162 91 105 148 84 98 138 80 94 130"
    ),
    "bark": (
        "36 52 70 51 67 85 35 51 69 33 49 67 30 46 64 48 64 82 61 77 95 44 60 78 39 55 73 44 "
        "60 78 43 59 77 26 42 60"
    ),
    "leaves": (
        "44 74 52 54 84 62 42 72 50 19 49 27 34 64 42 48 78 56 46 76 54 37 67 45 55 85 63 47 "
        "77 55 26 56 34 47 77 55"
    ),
}
# Is there tree at pixels [7::15, 3::12] of a rectangle of 120 x 160, seed 7?
TREE = (
    "0 0 0 0 0 0 1 1 0 0 0 0 1 1 1 1 1 1 1 0 0 1 1 1 1 1 1 1 1 0 1 1 1 1 1 1 1 1 1 1 0 1 "
    "1 1 1 1 1 1 1 1 0 0 1 1 1 1 1 1 1 0 0 0 0 1 1 1 1 1 0 0 0 0 0 0 1 1 0 0 0 0 0 0 0 0 "
    "1 1 0 0 0 0 0 0 0 0 1 1 0 0 0 0 0 0 0 0 1 1 0 0 0 0"
)


def numbers(text):
    return np.array(text.split(), float)


@pytest.mark.parametrize("name", LOOKS)
def test_what_is_drawn_looks_as_it_did(name):
    draw = scenery.BACKGROUNDS.get(name) or getattr(scenery, name)
    image = draw(np.random.default_rng(7), (256, 192))
    assert image.dtype == np.uint8
    np.testing.assert_allclose(image[25::65, 30::60, ::-1].ravel(), numbers(LOOKS[name]), atol=2)


def test_a_tree_stands_where_it_did():
    image, here = scenery.tree(np.random.default_rng(7), (120, 160))
    assert image.shape == (160, 120, 3)
    assert np.array_equal(here[7::15, 3::12].ravel(), numbers(TREE) > 0)


def test_joints_part_all_bricks():
    """A pale line of three pixels above each course, and before each brick of it."""
    image = scenery.BACKGROUNDS["bricks"](np.random.default_rng(7), (256, 192)).astype(int)
    red = image[..., 0] - image[..., 2] > 30
    rows, columns = np.mgrid[:192, :256]
    shifts = 32 * (rows // 32 % 2)  # every second course begins half a brick on
    np.testing.assert_array_equal(red, (rows % 32 >= 3) & ((columns + shifts) % 64 >= 3))


def test_joints_are_pale_and_not_all_the_same():
    """As they were, in the second row of each course: green, from 161 to 175."""
    image = scenery.BACKGROUNDS["bricks"](np.random.default_rng(7), (256, 192))
    joints = (
        "166 173 164 165 171 172 167 166 170 166 165 169 173 166 169 166 167 163 165 170 173 168 "
        "166 164"
    )
    np.testing.assert_allclose(image[1::32, 30::60, 1].ravel(), numbers(joints), atol=2)
    plain = image[1::32].astype(int)
    assert (plain[..., 2] - plain[..., 1] == -8).all()
    assert (plain[..., 0] - plain[..., 1] == 6).all()
    assert 161 <= plain[..., 1].min() < 164
    assert 173 < plain[..., 1].max() <= 175
