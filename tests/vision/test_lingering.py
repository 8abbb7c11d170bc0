"""The ground beneath what hardly leaves its place."""

import cv2
import numpy as np
import pytest

from vidsindy_lite.vision.candidates import Plate, tolerance
from vidsindy_lite.vision.lingering import Place, _compactness, _ground, lingering, uncover
from vidsindy_lite.vision.pixels import lengths


@pytest.mark.parametrize("pan", [0, 2])
@pytest.mark.parametrize(("radius", "lingers"), [(3, True), (6, True), (16, False)])
def test_the_ground_beneath_what_lingers(pan, radius, lingers):
    rng = np.random.default_rng(0)
    scene = cv2.GaussianBlur(rng.uniform(0, 255, (200, 300, 3)).astype(np.float32), (0, 0), 4)
    scene = np.clip(128 + 5 * (scene - 128), 60, 200).astype(np.uint8)
    samples, maps = [], []
    for k in range(21):
        image, angle = scene.copy(), 2 * np.pi * k / 21
        place = np.array([130, 90]) + radius * np.array([np.cos(angle), np.sin(angle)])
        centre = tuple(np.rint(16 * place).astype(int).tolist())
        cv2.circle(image, centre, 16 * 9, (20, 20, 240), -1, cv2.LINE_AA, 4)
        samples.append(image[20:170, 20 + pan * k : 200 + pan * k])
        maps.append([[1, 0, pan * k], [0, 1, 0], [0, 0, 1.0]])
    samples, maps, known = np.array(samples), np.array(maps), np.ones(21, bool)
    plate = Plate(samples, maps, known)
    places = lingering(plate, samples, maps, known, tolerance(plate, 0.0))
    assert [place.holds(np.array([110, 70])) for place in places] == [True] * lingers
    uncover(plate, samples, maps, known, places)
    view, _ = plate.seen_from(maps[0], np.zeros(2), (180, 150))
    near, true = view[40:100, 80:140].astype(int), scene[60:120, 100:160]
    assert np.median(np.abs(near - true)) == 0
    # Of the target of 254 pixels no more is left than a trace where its middle meets its rim.
    assert (np.abs(near - [20, 20, 240]).sum(axis=2) < 100).sum() <= 20


def test_a_place_holds_the_points_of_its_rim_and_middle():
    """Of a place at (10, 20), four wide and three high, rim to the left and middle to the right."""
    rim, middle = np.zeros((3, 4), bool), np.zeros((3, 4), bool)
    rim[:, 0], middle[1, 3] = True, True
    place = Place(np.array([10, 20]), rim, middle)
    held = [(10, 20), (10, 22), (13, 21), (10.4, 19.6)]
    other = [(9, 20), (10, 19), (10, 23), (13, 20), (14, 21), (11, 21)]
    assert [place.holds(np.array(p)) for p in held + other] == [True] * 4 + [False] * 6


def test_a_disc_is_compact_and_a_line_is_not():
    v, u = np.mgrid[:80, :120]
    disc, ring = np.hypot(u - 41, v - 37) < 30, np.hypot(u - 41, v - 37) < 20
    line = (v == 40) & (u >= 10) & (u < 110)
    assert _compactness(disc[None]) == pytest.approx(1, abs=0.005)
    # A ring's moment is pi (R^4 - r^4) / 2 for an area of pi (R^2 - r^2).
    expected = (30**2 - 20**2) / (30**2 + 20**2)
    assert _compactness((disc & ~ring)[None]) == pytest.approx(expected, rel=0.02)
    # And that of a line of n pixels (n^2 + 1) / 12 for each of them.
    assert _compactness(line[None]) == pytest.approx(6 * 100 / (np.pi * (100**2 + 1)), rel=1e-3)
    # Of two masks the larger counts more, by its area.
    both = np.stack([disc, line])
    parts = [(mask.sum(), _compactness(mask[None])) for mask in both]
    mean = sum(area * share for area, share in parts) / sum(area for area, _ in parts)
    assert _compactness(both) == pytest.approx(mean)


def test_the_rim_shows_the_ground_of_the_views_that_are_like_the_surroundings():
    """Two of four views show the ground at the left half of the rim, the others at the right."""
    ground = np.full((21, 21, 3), 100, np.uint8)
    v, u = np.mgrid[:21, :21]
    apart = np.hypot(u - 10, v - 10)
    rim, middle = (apart <= 7) & (apart > 3), apart <= 3
    views = np.stack([ground] * 4)
    for k, view in enumerate(views):
        view[middle | (rim & ((u < 10) == (k < 2)))] = (20, 20, 240)
        view[rim & ((u < 10) == (k >= 2))] += np.uint8(10 * (k % 2))  # their mean is 105
    shown = ground.copy()
    shown[middle | rim] = (20, 20, 240)
    found = _ground(shown, views, Place(np.zeros(2, int), rim, middle))
    assert (found[rim] == 105).all()
    assert (found[apart > 7] == 100).all()
    np.testing.assert_allclose(found[middle], 105, atol=2)
    assert (shown[rim] == (20, 20, 240)).all()  # the image itself stays as it is


def film(*, turn, size, at=(43, 31), ground=(60, 80), pan=0):
    """21 samples of a disc on its way around a place of a plain ground, their maps, all known."""
    samples, maps = [], []
    for k in range(21):
        image, angle = np.full((*ground, 3), 100, np.uint8), 2 * np.pi * k / 21
        u, v = at[0] + turn[0] * np.cos(angle) - pan * k, at[1] + turn[1] * np.sin(angle)
        centre = round(16 * u), round(16 * v)
        cv2.circle(image, centre, round(16 * size), (20, 20, 240), -1, cv2.LINE_AA, 4)
        samples.append(image)
        maps.append([[1, 0, pan * k], [0, 1, 0], [0, 0, 1.0]])
    samples, maps = np.array(samples), np.array(maps, float)
    return Plate(samples, maps, np.ones(21, bool)), samples, maps, np.ones(21, bool)


def places_in(film):
    return lingering(*film, tolerance(film[0], 0.0))


@pytest.mark.parametrize("pan", [0, 1])
def test_a_place_is_that_of_a_thing_and_four_pixels_around_it_in_the_first_frame(pan):
    """Of a disc of 13 pixels that swings by 4 to the sides, and by 2 up and down."""
    (place,) = places_in(film(turn=(4, 2), size=6, pan=pan))
    covered = np.argwhere(place.rim | place.middle)
    # In columns 33 to 53 and rows 23 to 39, its soft outline included.
    np.testing.assert_allclose(place.corner, [33 - 4, 23 - 4], atol=1)
    np.testing.assert_allclose(place.rim.shape, [17 + 8, 21 + 8], atol=2)
    np.testing.assert_array_equal(covered.min(axis=0), [4, 4])
    np.testing.assert_array_equal(covered.max(axis=0), np.array(place.rim.shape) - 5)
    assert not (place.rim & place.middle).any()


def test_a_place_at_the_border_of_the_image_ends_there():
    (place,) = places_in(film(turn=(4, 3), size=7, at=(9, 50)))
    assert place.corner[0] == 0
    assert place.corner[1] + place.rim.shape[0] == 60
    assert 34 <= place.corner[1] <= 37
    assert 24 <= place.rim.shape[1] <= 27


@pytest.mark.parametrize(("size", "ground", "lingers"), [(12, (60, 80), 1), (12, (46, 60), 0)])
def test_what_fills_much_of_the_image_does_not_linger(size, ground, lingers):
    # Its surroundings, 31 x 31 pixels, are 20 % of the one image and 35 % of the other.
    at = (ground[1] // 2, ground[0] // 2)
    assert len(places_in(film(turn=(3, 3), size=size, at=at, ground=ground))) == lingers


def test_a_ball_that_runs_around_plain_ground_does_not_linger():
    assert places_in(film(turn=(12, 10), size=4)) == []


@pytest.mark.parametrize(("turn", "lingers"), [(4, 1), (6, 1), (7.5, 0)])
def test_what_differs_nearly_as_a_whole_from_a_median_of_it_does_not_linger(turn, lingers):
    # Of a disc of 17 pixels that swings by 15, only a few show all the time.
    assert len(places_in(film(turn=(turn, turn), size=8))) == lingers


def test_all_squares_are_equally_compact():
    """A square's moment is area^2 / 6, which is pi / 3 of that of a disc."""
    for side in (1, 2, 3, 7):
        mask = np.zeros((12, 17), bool)
        mask[3 : 3 + side, 5 : 5 + side] = True
        assert _compactness(mask[None]) == pytest.approx(3 / np.pi)


@pytest.mark.parametrize(("at", "corner"), [((40, 30), (11, 7)), ((72, 50), (24, 15))])
def test_a_place_of_reduced_frames_is_uncovered_in_whole_ones_of_an_odd_size(at, corner):
    """Frames of 61 x 83 pixels, which were reduced by 2: the second place ends a pixel beyond."""
    plate, *seen = film(turn=(6, 4), size=9, at=at, ground=(61, 83))
    v, u = np.mgrid[:16, :18]
    middle = np.hypot(u - (at[0] / 2 - corner[0]), v - (at[1] / 2 - corner[1])) < 3.5
    rim = ~middle & (u > 0) & (v > 0)
    assert (lengths(plate.image - np.float32(100)) > 50).sum() > 100
    uncover(plate, *seen, [Place(np.array(corner), rim, middle)], 2)
    assert lengths(plate.image - np.float32(100)).max() < 10
