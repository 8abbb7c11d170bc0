"""The most plausible path through candidates: what it gains and what it pays."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import one_a_frame

from vidsindy_lite.vision.candidates import Candidate
from vidsindy_lite.vision.linking import TOLD, Sightings, _prices, best_path, worth


def test_a_path_prefers_what_travels_smoothly_and_bridges_gaps():
    def one(u, v, quality=0.9):
        centre = np.array([u, v], float)
        box = np.array([u - 4, v - 4, 9, 9])
        return Candidate(centre, box, 60.0, np.array([30.0, 30, 200]), quality)

    rng = np.random.default_rng(0)
    found = [[one(10 + 5 * i, 50), one(*rng.uniform(0, 200, 2), 0.6)] for i in range(30)]
    found[12] = found[13] = []
    places = [np.array([c.centre for c in f]).reshape(-1, 2) for f in found]
    seen = Sightings.of(found, places, 400.0)
    rows, value = best_path(seen)
    np.testing.assert_array_equal(seen.frame[rows], [i for i in range(30) if i not in (12, 13)])
    np.testing.assert_array_equal(seen.which[rows], 0)
    assert value > 15
    assert best_path(seen.only(np.zeros(0, int)))[1] == 0


def test_a_path_ends_where_nothing_that_follows_is_worth_it():
    places = np.column_stack([10 + 5 * np.arange(20), np.full(20, 50)])
    for low, last in ((0.1, 11), (0.2, 19)):  # a candidate below a quality of .15 has no worth
        rows, value = best_path(one_a_frame(places, np.where(np.arange(20) < 12, 0.9, low)))
        assert rows[-1] == last
        assert value == pytest.approx(12 * 0.75 + (last - 11) * 0.05, abs=0.1)


def test_the_faster_a_target_the_further_it_may_turn():
    def price(step, turn):
        places = np.column_stack([50 + step * np.arange(20), np.full(20, 100.0)])
        straight = best_path(one_a_frame(places, np.full(20, 0.9)))[1]
        places[10:, 1] += turn
        rows, value = best_path(one_a_frame(places, np.full(20, 0.9)))
        assert len(rows) == 20
        return straight - value

    assert price(40, 12) < 0.6
    assert price(2, 12) > 1


def test_the_longer_nothing_is_seen_the_less_it_is_worth_to_go_on():
    values = []
    for gap in (0, 1, 2, 5, 10):
        places = np.column_stack([50 + 5 * np.arange(20 + gap), np.full(20 + gap, 100.0)])
        kept = np.append(np.arange(10), np.arange(10 + gap, 20 + gap))
        rows, value = best_path(one_a_frame(places, np.full(20 + gap, 0.9)).only(kept))
        assert len(rows) == 20  # it does go on
        values.append(value)
    assert (np.diff(values) < -0.01).all()


def priced(speed, moving, *, gap=1, step=(0, 0), size=1.0, colour=0.0, qualities=(1, 1)):
    """What it costs to go on from a candidate of 8 pixels in an image whose diagonal is 100."""
    seen = Sightings(
        np.array([0, gap]), np.zeros(2, int), np.array([[0, 0], step], float),
        8 * np.array([1, size]), np.array([[0, 0, 0], [colour, 0, 0]], float),
        np.array(qualities, float),
        np.zeros((2, 4)), 100.0,
    )  # fmt: skip
    old, new = np.array([0]), np.array([1])
    price = _prices(seen, old, new, np.array([speed], float), np.array([moving]))
    assert price.shape == (1, 1)
    return price.item()


def test_prices_by_hand():
    # On the way: free. Off by 9 where 2 + 8 / 2 + 6 / 2 = 9 are ordinary: 2 (1 - exp(-1/2)).
    unusual = 2 * (1 - np.exp(-0.5))
    assert priced((6, 0), True, step=(6, 0)) == pytest.approx(0)
    assert priced((6, 0), True, step=(6, 9)) == pytest.approx(unusual)
    # A first step may be of 6 % of the diagonal and two sizes: 6 + 16 = 22.
    assert priced((0, 0), False, step=(0, 22)) == pytest.approx(unusual)
    # And of two sizes for each frame of a gap: 6 + 3 x 16 = 54.
    assert priced((0, 0), False, gap=3, step=(54, 0)) == pytest.approx(0.42 + unusual)
    # After a gap of three frames: .3 + 3 x .04, and more may happen in it: 2 + 4 + 9 = 15.
    assert priced((6, 0), True, gap=3, step=(18, 0)) == pytest.approx(0.42)
    assert priced((6, 0), True, gap=3, step=(18, 15)) == pytest.approx(0.42 + unusual)
    # Half or twice as wide, and another colour, of at most 2.
    assert priced((0, 0), True, size=2) == pytest.approx(np.log(2))
    assert priced((0, 0), True, size=0.5) == pytest.approx(np.log(2))
    assert priced((0, 0), True, colour=30) == pytest.approx(0.5)
    assert priced((0, 0), True, colour=250) == pytest.approx(2)


@pytest.mark.parametrize("which", [0, 1])
def test_nothing_jumps_to_or_from_what_somebody_points_at(which):
    assert priced((6, 0), True, step=(6, 90)) == pytest.approx(2)
    qualities = np.where(np.arange(2) == which, TOLD, 1.0)
    assert priced((6, 0), True, step=(6, 90), qualities=qualities) == pytest.approx((90 / 9) ** 2)
    assert priced((6, 0), True, step=(6, 0), qualities=qualities) == pytest.approx(0)


@pytest.mark.parametrize(("gap", "bridged"), [(20, True), (21, False)])
def test_what_is_longer_ago_than_the_memory_is_another_path(gap, bridged):
    places = np.column_stack([50 + 5 * np.arange(20 + gap), np.full(20 + gap, 100.0)])
    kept = np.append(np.arange(10), np.arange(9 + gap, 20 + gap))
    rows, _ = best_path(one_a_frame(places, np.full(20 + gap, 0.9)).only(kept))
    assert rows.tolist() == list(range(0 if bridged else 10, 21))


@pytest.mark.parametrize("seed", range(4))
def test_no_path_is_worth_more_than_the_best(seed):
    """Of two candidates in each of five frames, all paths are tried; so few states are all kept."""
    rng = np.random.default_rng(seed)
    found = [
        [Candidate(rng.uniform(0, 40, 2), np.zeros(4), rng.uniform(40, 80),
                   rng.uniform(0, 99, 3), rng.uniform(0.3, 1)) for _ in range(2)]
        for _ in range(5)
    ]  # fmt: skip
    seen = Sightings.of(found, [np.array([c.centre for c in some]) for some in found], 80.0)
    values = {}

    def follow(path, value, speed, moving):
        values[tuple(path)] = value
        for j in range(len(seen.frame)):
            if seen.frame[j] <= seen.frame[path[-1]]:
                continue
            one = np.array([path[-1]])
            price = _prices(seen, one, np.array([j]), speed[None], np.array([moving])).item()
            gap = seen.frame[j] - seen.frame[path[-1]]
            step = (seen.centre[j] - seen.centre[path[-1]]) / gap
            follow([*path, j], value - price + seen.quality[j] - 0.15, step, True)

    for j in range(len(seen.frame)):
        follow([j], seen.quality[j] - 0.15, np.zeros(2), False)
    rows, value = best_path(seen)
    assert value == pytest.approx(max(values.values()))
    assert tuple(rows.tolist()) == max(values, key=values.get)


def test_a_speed_is_that_of_a_frame_also_behind_a_gap():
    """Of an even motion that is not seen in two frames, only the start and the gap are paid."""
    places = np.column_stack([20.0 * np.arange(12), np.full(12, 100.0)])
    kept = np.delete(np.arange(12), [4, 5])
    rows, value = best_path(one_a_frame(places, np.full(12, 0.9)).only(kept))
    assert len(rows) == 10
    start = 2 * (1 - np.exp(-0.5 * (20 / (60 + 2 * np.sqrt(60))) ** 2))
    assert value == pytest.approx(10 * 0.75 - start - (0.3 + 3 * 0.04))


@pytest.mark.parametrize("crowd", [1, 4])
def test_the_worth_of_a_path_is_the_value_that_it_was_found_by(crowd):
    for seed in range(5):
        rng, k = np.random.default_rng(seed), np.arange(40)
        places = np.column_stack([50 + 5 * k, 100 + 20 * np.sin(k / 5)]).repeat(crowd, axis=0)
        places += rng.normal(0, 3, places.shape)
        seen = one_a_frame(places, rng.uniform(0.4, 1, len(places)))
        seen = replace(seen, frame=np.arange(len(places)) // crowd)
        seen = seen.only(np.flatnonzero(~np.isin(seen.frame, [7, 8, 30])))
        rows, value = best_path(seen)
        assert len(rows) > 10
        assert worth(seen, rows) == pytest.approx(value)
        assert worth(seen, rows[:1]) == pytest.approx(seen.quality[rows[0]] - 0.15)
