"""What stands before the target, learned from where it is never seen."""

import cv2
import numpy as np
import pytest
from footage import Phone, write_phone

from vidsindy_lite import track
from vidsindy_lite.vision.refining import hidden


def view(centre, sides, post):
    """Outline, middle and area of what is seen of an ellipse on one side of a post."""
    picture = np.zeros((200, 260), np.uint8)
    ends = [np.rint(16 * np.array(x)).astype(int).tolist() for x in (centre, np.array(sides) / 2)]
    cv2.ellipse(picture, *ends, 0, 0, 360, 1, -1, cv2.LINE_8, 4)
    picture[:, slice(*post)] = 0
    count, labels, stats, centres = cv2.connectedComponentsWithStats(picture)
    part = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    outline = cv2.convexHull(np.argwhere(labels == part)[:, ::-1].astype(np.int32))[:, 0]
    return outline.astype(float), centres[part], float(stats[part, cv2.CC_STAT_AREA])


def passing(sides, post=(0, 0)):
    """Views of what passes a post several times: outlines, middles, areas, and how far off."""
    t = np.linspace(0, 2 * np.pi, 80)
    places = np.column_stack([120 - 80 * np.cos(t), 100 + 25 * np.sin(1.7 * t)])
    outlines, *rest = zip(*(view(place, sides, post) for place in places), strict=True)
    centres, areas = map(np.array, rest)
    return outlines, centres, areas, np.linalg.norm(centres - places, axis=1)


@pytest.mark.parametrize("diameter", [24, 40, 60])
def test_views_that_are_cut_by_a_post_are_of_parts(diameter):
    *seen, off = passing((diameter, diameter), post=(90, 110))
    found, cut = hidden(*seen), off > 0.02 * diameter + 0.5
    assert cut.sum() >= 6
    assert found[cut].all()
    assert found[~cut].mean() < 0.15  # those that just touch it


@pytest.mark.parametrize("sides", [(40, 40), (60, 20), (20, 60)])
def test_where_nothing_hides_the_target_all_views_are_whole(sides):
    *seen, off = passing(sides)
    assert off.max() < 0.5
    assert not hidden(*seen).any()


def test_what_touches_other_things_does_not_say_where_the_target_is_hidden():
    seen, centres, areas, _ = passing((40, 40))
    alone = np.full(80, True)
    alone[35:45], outlines = False, list(seen)  # two in one, whose outline is lean
    for i in np.flatnonzero(~alone):
        outlines[i], centres[i], areas[i] = view(centres[i], (240, 20), (0, 0))
    found = hidden(outlines, centres, areas, alone)
    assert hidden(outlines, centres, areas)[alone].any()
    assert not found[alone].any()


def test_a_large_ball_behind_a_post_is_seen_whole_or_not_at_all(tmp_path):
    phone = Phone("wood", 64, colour=(250, 225, 15), noise=4, occluder=True,
                  image_size=(320, 240), frames=60)  # fmt: skip
    truth, _ = write_phone(tmp_path / "clip.mp4", phone, 2)
    error = np.linalg.norm(track(tmp_path / "clip.mp4").pixels - truth, axis=1)
    assert np.isfinite(error).mean() > 0.4
    assert np.nanmax(error) < 1.5
