"""Where a target is in frames that show only a part of it."""

import cv2
import numpy as np
import pytest

from vidsindy_lite import Hint, track, write_video
from vidsindy_lite.vision.candidates import Plate
from vidsindy_lite.vision.recalling import (
    _FAR,
    Look,
    Template,
    _carry_on,
    _curve,
    _fill,
    _looks,
    _peak,
    _template,
    recalled,
)
from vidsindy_lite.vision.reel import Reel
from vidsindy_lite.vision.refining import Lens, View

N = 60
TRUTH = np.column_stack([30 + 4.4 * np.arange(N), 110 - 25 * np.sin(np.arange(N) / 15)])
HINT = Hint(frame=10, box=(*(TRUTH[10] - 12), 25, 25))


def plain(path, truth, radius, shown=N):
    """A film of a red disc before a grey wall, with its lens, light and views of the whole."""
    frames = np.full((N, 200, 320, 3), 120, np.uint8)
    for frame, place in zip(frames[:shown], truth, strict=False):
        cv2.circle(frame, tuple(np.rint(16 * place).astype(int)), 16 * radius, (30, 30, 210),
                   -1, cv2.LINE_AA, 4)  # fmt: skip
    maps = np.tile(np.eye(3), (N, 1, 1))
    lens = Lens(Plate(np.full((3, 200, 320, 3), 120, np.uint8), maps[:3], np.ones(3, bool)), 1.0)
    square = radius * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    area = round(np.pi * radius**2)
    views = [View(place, area, np.zeros(3), True, place + square) for place in truth]
    return write_video(path, iter(frames)), lens, [np.ones(3, np.float32)] * N, maps, views


def film(path, post, wall):
    """A red ball that flies behind a post, or before a wall of its colour, past other things."""
    rng = np.random.default_rng(0)
    ground = cv2.GaussianBlur(rng.uniform(0, 255, (200, 320, 3)).astype(np.float32), (0, 0), 4)
    ground = 60 + ground / 2
    if wall:
        ground[:, 150:162] = (30, 30, 210)

    def frames():
        for i in range(N):
            frame = ground.copy()
            cv2.circle(frame, tuple(np.rint(16 * TRUTH[i]).astype(int)), 16 * 11, (30, 30, 210),
                       -1, cv2.LINE_AA, 4)  # fmt: skip
            frame[:, 150 : 150 + post] = (60, 80, 90)
            noise = rng.normal(0, 3, frame.shape)
            yield np.clip((1 + 0.1 * np.sin(i)) * frame + noise, 0, 255).astype(np.uint8)

    return write_video(path, frames())


@pytest.mark.parametrize(("post", "wall"), [(14, False), (0, True)], ids=["post", "wall"])
def test_what_is_seen_in_part_is_where_its_motion_leads(tmp_path, post, wall):
    path = film(tmp_path / "clip.mov", post, wall)
    error, hinted = (
        np.linalg.norm(track(path, target=hint).pixels - TRUTH, axis=1) for hint in (None, HINT)
    )
    for found in (error, hinted):
        assert np.isfinite(found).mean() >= 0.95
        assert np.nanmax(found) < 1
    assert np.isfinite(hinted[np.isfinite(error)]).all()


def test_what_is_hidden_altogether_stays_a_gap(tmp_path):
    path = film(tmp_path / "clip.mov", 60, False)
    error = np.linalg.norm(track(path, target=HINT).pixels - TRUTH, axis=1)
    hidden = (TRUTH[:, 0] > 150 + 13) & (TRUTH[:, 0] < 210 - 13)
    assert hidden.sum() > 5
    assert np.isnan(error[hidden]).all()
    assert np.nanmax(error) < 3


def test_beyond_its_views_a_target_is_carried_on_as_long_as_it_is_found(tmp_path):
    path, lens, lights, maps, views = plain(tmp_path / "clip.mov", TRUTH, 11, shown=54)
    pixels = TRUTH.copy()
    pixels[:8], pixels[45:] = np.nan, np.nan
    places = recalled(Reel(path), lens, lights, pixels, maps, views, told=True)
    found = np.isfinite(places[:, 0])
    np.testing.assert_array_equal(np.flatnonzero(found), [*range(8), *range(45, 54)])
    assert np.linalg.norm(places[found] - TRUTH[found], axis=1).max() < 0.5
    assert np.isnan(recalled(Reel(path), lens, lights, pixels, maps, views, told=False)).all()
    pixels[20:45] = np.nan  # farther than a view is carried
    places = recalled(Reel(path), lens, lights, pixels, maps, views, told=True)
    np.testing.assert_array_equal(
        np.flatnonzero(np.isfinite(places[:, 0])), [*range(8), *range(20, 20 + _FAR)]
    )


@pytest.mark.parametrize("sharp", [1.0, 30.0])
def test_without_a_hint_a_gap_is_filled_where_its_motion_is_known_to_two_pixels(tmp_path, sharp):
    at = np.arange(N)
    truth = np.column_stack([30 + 4.4 * at, 100 + sharp * np.tanh((at - 30) / 4)])
    path, lens, lights, maps, views = plain(tmp_path / "clip.mov", truth, 25)
    pixels = truth.copy()
    pixels[28:33] = np.nan
    for told in (True, False):
        places = recalled(Reel(path), lens, lights, pixels, maps, views, told=told)
        assert np.isfinite(places[28:33, 0]).all() == (told or sharp < 2)


def test_only_frames_in_and_beside_gaps_are_looked_at(tmp_path):
    class Picked(Reel):
        def pick(self, numbers):
            self.numbers = list(numbers)
            return super().pick(numbers)

    path, lens, lights, maps, views = plain(tmp_path / "clip.mov", TRUTH, 11)
    pixels = TRUTH.copy()
    pixels[28:31] = np.nan
    reel = Picked(path)
    places = recalled(reel, lens, lights, pixels, maps, views, told=False)
    assert reel.numbers == [27, 28, 29, 30, 31]
    np.testing.assert_allclose(places[28:31], TRUTH[28:31], atol=0.5)


RNG = np.random.default_rng(0)
GROUND = np.full((90, 140, 3), 100, np.uint8)
THING = RNG.integers(0, 255, (10, 16, 3), np.uint8)  # 16 pixels wide, 10 high
ONES = np.ones(3, np.float32)


def seen(left, top, share=1.0, corner=(0, 0), gain=ONES):
    """A look at a plain ground, with the thing there."""
    frame = GROUND.astype(float)
    frame[top : top + 10, left : left + 16] += share * (THING - 100.0)
    now = np.rint(frame * gain).clip(0, 255).astype(np.uint8)
    return Look(now, GROUND, np.array(corner), np.asarray(gain, np.float32))


TEMPLATE = Template(THING.astype(np.float32), np.ones((10, 16), np.float32), np.array([6.5, 5.0]))


def test_a_look_is_compared_in_the_light_of_its_ground():
    look = Look(np.full((2, 3, 3), 90, np.uint8), GROUND, np.zeros(2), np.float32([0.5, 2, 1]))
    np.testing.assert_allclose(look.levels(), np.tile([180, 45, 90], (2, 3, 1)))
    found, _ = TEMPLATE.found(seen(60, 40, gain=(0.8, 0.5, 0.9)), np.array([66.5, 45]))
    np.testing.assert_allclose(found, (66.5, 45), atol=0.3)


@pytest.mark.parametrize("corner", [(0, 0), (30, 15), (-7, 4)])
@pytest.mark.parametrize(
    ("off", "there"),
    # Half of its shorter side and four pixels: nine pixels to each side.
    [((0, 0), 1), ((8, 0), 1), ((-8, 0), 1), ((0, 8), 1), ((0, -8), 1), ((8, -8), 1),
     ((13, 0), 0), ((-13, 0), 0), ((0, 13), 0), ((0, -13), 0)],
)  # fmt: skip
def test_a_template_is_found_about_where_it_is_expected(corner, off, there):
    place = np.array([50 + 6.5, 40 + 5.0]) + corner
    found = TEMPLATE.found(seen(50, 40, corner=corner), place - off)
    assert (found is not None) == bool(there)
    if found:
        np.testing.assert_allclose(found[0], place, atol=0.3)
        np.testing.assert_array_equal(found[1].image, THING)
        np.testing.assert_allclose(found[1].centre, TEMPLATE.centre, atol=0.3)


@pytest.mark.parametrize("place", [(-40, 45), (66, -40), (250, 45), (66, 200), (2, 45), (139, 45)])
def test_a_template_is_not_found_where_the_look_has_no_room_for_it(place):
    assert TEMPLATE.found(seen(60, 40), np.array(place, float)) is None


@pytest.mark.parametrize(("share", "there"), [(0.7, True), (0.51, False), (0.3, False)])
def test_a_template_must_explain_enough_of_what_has_changed(share, there):
    # Of a thing seen through by a share s, (1 - s)^2 is left of s^2: at most six tenths.
    found = TEMPLATE.found(seen(60, 40, share), np.array([65.0, 46]))
    assert (found is not None) == there


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.4, -0.3), (-0.25, 0.45)])
def test_a_template_is_found_to_a_fraction_of_a_pixel(shift):
    v, u = np.mgrid[:90, :140]
    frames = []
    for x, y in ((70.0, 45.0), (73 + shift[0], 41 + shift[1])):
        spot = 120 * np.exp(-((u - x) ** 2) / 30 - (v - y) ** 2 / 18)
        frames.append((100 + spot[..., None] * [0.3, 0.6, 1]).round().astype(np.uint8))
    image = frames[0][34:57, 58:83].astype(np.float32)
    template = Template(image, np.ones((23, 25), np.float32), np.array([12.0, 11]))
    look = Look(frames[1], GROUND, np.array([20, 10]), ONES)
    found, here = template.found(look, np.array([94.0, 52]))
    np.testing.assert_allclose(found, [93 + shift[0], 51 + shift[1]], atol=0.06)
    np.testing.assert_allclose(here.centre, [12 + shift[0], 11 + shift[1]], atol=0.06)


def test_the_peak_of_a_curve_is_that_of_its_parabola():
    for top in (1.7, 2.0, 2.4):
        values = np.array(5 - 3 * (np.arange(5) - top) ** 2, np.float32)
        assert _peak(values, 2) == pytest.approx(top - 2, abs=1e-5)
    assert _peak(np.float32([3, 2, 1]), 0) == 0
    assert _peak(np.float32([1, 2, 3]), 2) == 0
    assert _peak(np.float32([2, 2, 2]), 1) == 0


def view_of(left, top, right, bottom, area=None):
    """A view of a rectangle, by its first and last pixels."""
    outline = np.array([[left, top], [right, top], [right, bottom], [left, bottom]], float)
    size = (right - left + 1) * (bottom - top + 1) if area is None else area
    return View(outline.mean(axis=0), size, np.zeros(3), True, outline)


def test_a_template_is_what_a_view_shows_and_three_pixels_around_it():
    look = Look(RNG.integers(0, 255, (60, 80, 3), np.uint8), GROUND, np.array([100, 50]), 2 * ONES)
    view = view_of(120, 65, 131, 70)
    template = _template({7: look}, [None] * 7 + [view], 7)
    np.testing.assert_array_equal(template.image, look.now[12:24, 17:35] / np.float32(2))
    assert (template.mask == 1).all()
    np.testing.assert_array_equal(template.centre, [8.5, 5.5])
    slim = View(view.centroid, 1, np.zeros(3), True, np.array([[120.0, 65], [131, 65], [120, 70]]))
    mask = _template({7: look}, [None] * 7 + [slim], 7).mask
    assert mask.shape == (12, 18)
    assert mask[3, 3] == mask[8, 3] == mask[3, 14] == mask[0, 0] == 1
    assert mask[11, 17] == mask[8, 14] == 0
    assert _template({}, [view], 0) is None
    assert _template({0: look}, [None], 0) is None


@pytest.mark.parametrize(
    ("box", "there"),
    [((103, 53, 110, 60), 1), ((102, 53, 110, 60), 0), ((103, 52, 110, 60), 0),
     ((160, 99, 176, 106), 1), ((160, 99, 177, 106), 0), ((160, 99, 176, 107), 0)],
)  # fmt: skip
def test_a_view_that_reaches_beyond_its_look_is_no_template(box, there):
    look = Look(np.zeros((60, 80, 3), np.uint8), GROUND, np.array([100, 50]), ONES)
    assert (_template({0: look}, [view_of(*box)], 0) is not None) == bool(there)


def test_a_curve_through_places_is_a_polynomial_of_the_time():
    frames, at = np.array([-4, -3, -1, 0, 5, 6, 8]), np.array([1, 2, 3])
    cubic = [np.polynomial.Polynomial(c) for c in ([70, 3, 0.4, -0.1], [20, -5, 0.2, 0.03])]
    places = np.column_stack([c(frames) for c in cubic])
    wanted = np.column_stack([c(at) for c in cubic])
    np.testing.assert_allclose(_curve(frames, places, at, 3), wanted)
    rough = np.column_stack([np.polyval(np.polyfit(frames, x, 2), at) for x in places.T])
    np.testing.assert_allclose(_curve(frames, places, at, 2), rough)
    two = _curve(np.array([0, 4]), np.array([[10.0, 20], [18, 12]]), np.array([1, 3]), 3)
    np.testing.assert_allclose(two, [[12, 18], [16, 14]])


def moved(n, u, v):
    """Maps of n frames, of which each lies by so much to the right of and below the last one."""
    maps = np.tile(np.eye(3), (n, 1, 1))
    maps[:, :2, 2] = np.arange(n)[:, None] * [u, v]
    return maps


@pytest.mark.parametrize("step", [1, -1])
@pytest.mark.parametrize("faster", [0.0, 1.5])
def test_what_moves_fast_is_carried_on_where_its_speed_leads(step, faster):
    # By 14 pixels of the first frame from one to the next, the camera by (-3, 2): beyond reach.
    n = 8
    maps, t = moved(n, -3.0, 2.0), np.arange(n)[::step]
    pixels = np.column_stack([40.5 + 14 * t + faster * t * (t - 1) / 2, 30.0 + 2 * t])
    frame = pixels - maps[:, :2, 2]
    shift = np.array([0, 20]) - frame.min(axis=0).astype(int) * [0, 1]
    assert (frame + shift < [400, 90]).all()
    wide = np.full((90, 400, 3), 100, np.uint8)
    looks, views = {}, []
    for i, (u, v) in enumerate(frame):
        image = wide.copy()
        left, top = int(u - 7.5), int(v - 4.5 + shift[1])
        image[top : top + 10, left : left + 16] = THING
        looks[i] = Look(image, wide, -shift, ONES)
        views.append(view_of(left, top - shift[1], left + 15, top + 9 - shift[1]))
    truth = np.array([view.centroid for view in views]) + maps[:, :2, 2]
    known = t < 2
    order = range(1, n) if step == 1 else range(n - 2, -1, -1)
    places = np.full((n, 2), np.nan)
    _carry_on(places, order, looks, np.where(known[:, None], truth, np.nan), maps, views)
    np.testing.assert_array_equal(np.isfinite(places[:, 0]), ~known)
    np.testing.assert_allclose(places[~known], truth[~known], atol=0.3)
    del looks[order[4]]  # what was not looked at ends it
    places[:] = np.nan
    _carry_on(places, order, looks, np.where(known[:, None], truth, np.nan), maps, views)
    np.testing.assert_array_equal(np.flatnonzero(np.isfinite(places[:, 0])), sorted(order[1:4]))


def filled(parts, bend=0.0, shown=(), side=20.0, bound=np.inf):
    """In which frames of a gap, of frames 6 to 9 of 16, a target is found that is seen in parts.

    `parts`: by how much the middle of what is seen is off; `shown`: where all of it is.
    """
    n = 16
    at = np.arange(n)
    truth = np.column_stack([30 + 4.0 * at, 40 + 0.5 * at + bend * (at - 7.5) ** 3])
    maps = moved(n, 1.5, -1.0)
    frame = truth - maps[:, :2, 2]
    blank = np.full((90, 140, 3), 100, np.uint8)
    looks, views = {}, []
    for i, place in enumerate(frame):
        image = blank.copy()
        if i in (5, 10, *shown):
            left, top = np.rint(place - [7.5, 4.5]).astype(int)
            image[top : top + 10, left : left + 16] = THING
        looks[i] = Look(image, blank, np.zeros(2, int), ONES)
        here = place + parts.get(i, (0, 0))
        box = np.array([[-8.0, -5], [8, -5], [8, 5], [-8, 5]]) + here
        views.append(View(here, side**2, np.zeros(3), True, box))
    for i in range(6, 10):
        if i not in parts:
            views[i] = None
    pixels, places = truth.copy(), np.full((n, 2), np.nan)
    pixels[6:10] = np.nan
    _fill(places, 5, 10, looks, pixels, maps, views, bound)
    found = np.isfinite(places[:, 0])
    np.testing.assert_allclose(places[found], truth[found], atol=1e-6)
    return np.flatnonzero(found).tolist()


def test_a_gap_is_filled_where_a_part_is_seen_near_the_way():
    # Three quarters of the side of twenty pixels.
    assert filled({}) == []
    assert filled({6: (13, 0), 7: (0, 17), 8: (-10, 10), 9: (0, 0)}) == [6, 8, 9]
    assert filled({6: (13, 0), 7: (0, -17), 8: (-10, 10)}, side=30) == [6, 7, 8]


def test_a_gap_is_filled_where_the_whole_is_seen_on_the_way():
    assert filled({}, shown=(7, 8)) == [7, 8]
    assert filled({6: (1, 1)}, shown=(8,)) == [6, 8]


def test_a_gap_is_filled_where_cubic_and_parabola_agree_to_a_quarter_of_the_side():
    every = dict.fromkeys(range(6, 10), (0, 0))
    frames = np.array([-3, -2, -1, 0, 5, 6, 7, 8]) - 2.5
    gap = np.array([6, 7, 8, 9]) - 7.5
    apart = np.abs(gap**3 - np.polyval(np.polyfit(frames, frames**3, 2), gap))
    assert apart.max() == apart[0] > 1.5 * apart[1]
    bend = 5 / np.sqrt(apart[0] * apart[1])  # a quarter of the side lies between the two
    assert filled(every, bend / 3) == [6, 7, 8, 9]
    assert filled(every, bend) == [7, 8]
    assert filled(every, bend, bound=bend * apart[0] * 0.8) == []
    assert filled(every, bend, bound=bend * apart[0] * 1.2) == [7, 8]


class Still(Plate):
    """A plain plate that remembers its windows."""

    def seen_from(self, here, corner, size, step=1):
        self.windows.append([*map(int, corner), *map(int, size)])
        return super().seen_from(here, corner, size, step)


class Film:
    """A reel of blank frames."""

    def pick(self, numbers):
        return iter([np.zeros((150, 250, 3), np.uint8)] * len(numbers))


def test_the_window_grows_with_the_target_and_beyond_its_views_with_its_speed():
    ground = np.zeros((3, 150, 250, 3), np.uint8)
    plate = Still(ground, np.tile(np.eye(3), (3, 1, 1)), np.ones(3, bool))
    plate.windows = []
    at = np.arange(12)
    pixels = np.column_stack([80 + 4.0 * at, 60 + 3.0 * at])  # five pixels a frame
    pixels[[0, 1, 5, 6, 11]] = np.nan
    views = [view_of(u - 5, v - 7, u + 5, v + 7) if u == u else None for u, v in pixels]
    lights = [np.full(3, 1 + 0.1 * i, np.float32) for i in range(12)]
    looks = _looks(Film(), Lens(plate, 1.0), lights, pixels, moved(12, 0.0, 0.0), views)
    assert list(looks) == [0, 1, 2, 4, 5, 6, 7, 10, 11]
    for i, window in zip(looks, plate.windows, strict=True):
        # Twice the longer side, 14, and four pixels, 32 in all; outside, five more a frame.
        outside = {0: 10, 1: 5, 11: 5}.get(i, 0)
        u, v = np.array([80, 60]) + np.array([4, 3]) * np.clip(i, 2, 10)
        low = [max(x - 32 - outside, 0) for x in (u, v)]
        high = [min(x + 33 + outside, side) for x, side in zip((u, v), (250, 150), strict=True)]
        assert window == [*low, high[0] - low[0], high[1] - low[1]]
        np.testing.assert_array_equal(looks[i].corner, low)
        assert looks[i].now.shape == looks[i].ground.shape == (window[3], window[2], 3)
        assert looks[i].gain is lights[i]


def test_a_moving_camera_sees_a_target_elsewhere_in_its_frames():
    ground = np.zeros((3, 150, 250, 3), np.uint8)
    plate = Still(ground, np.tile(np.eye(3), (3, 1, 1)), np.ones(3, bool))
    plate.windows = []
    pixels = np.array([[90.0, 70], [np.nan, np.nan], [94, 68]])
    views = [view_of(85, 65, 95, 75)] * 3
    looks = _looks(Film(), Lens(plate, 1.0), [ONES] * 3, pixels, moved(3, 11.0, -6.0), views)
    # 24 pixels around (90, 70), (92 - 11, 69 + 6) and (94 - 22, 68 + 12).
    assert [look.corner.tolist() for look in looks.values()] == [[66, 46], [57, 51], [48, 56]]


def test_where_there_is_no_gap_no_frame_is_looked_at():
    pixels = np.column_stack([np.arange(9.0), np.arange(9.0)])
    for told in (True, False):
        places = recalled(None, None, [], pixels, moved(9, 0, 0), [], told=told)
        assert np.isnan(places).all()
    pixels[:2] = pixels[7:] = np.nan  # what lies before and behind is no gap, if nobody pointed
    assert np.isnan(recalled(None, None, [], pixels, moved(9, 0, 0), [], told=False)).all()


@pytest.mark.parametrize(("move", "window"), [((-400, -300), (249, 149)), ((400, 300), (0, 0))])
def test_of_what_is_out_of_view_one_pixel_of_the_border_is_looked_at(move, window):
    ground = np.zeros((3, 150, 250, 3), np.uint8)
    plate = Still(ground, np.tile(np.eye(3), (3, 1, 1)), np.ones(3, bool))
    plate.windows = []
    maps = moved(3, 0.0, 0.0)
    maps[1, :2, 2] = move
    pixels = np.array([[90.0, 70], [np.nan, np.nan], [94, 68]])
    _looks(Film(), Lens(plate, 1.0), [ONES] * 3, pixels, maps, [view_of(85, 65, 95, 75)] * 3)
    assert plate.windows[1] == [*window, 1, 1]
