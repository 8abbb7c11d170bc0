"""Films that are folders of images."""

import re

import cv2
import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite.vision import frame_clock, video_info


def fill(folder, names, size=(32, 24)):
    folder.mkdir(exist_ok=True, parents=True)
    for i, name in enumerate(names):
        image = np.full((*size[::-1], 3), 10 * (i % 25), np.uint8)
        (folder / name).write_bytes(cv2.imencode(".png", image)[1].tobytes())
    return folder


def shades(path):
    return [int(frame[0, 0, 0]) for frame in vl.read_video(path)]


@pytest.mark.parametrize("place", ["shots", "弾む球", "it's $5"])
def test_a_folder_is_a_film_in_the_order_of_its_numbers(tmp_path, place):
    folder = fill(tmp_path / place, [f"f{i}.png" for i in range(1, 13)])
    (folder / "notes.txt").write_text("no image")
    (folder / ".hidden.png").write_text("no image")
    assert shades(folder) == [10 * i for i in range(12)]
    assert video_info(folder) == (12, 0, (32, 24))
    assert frame_clock(folder).tolist() == list(range(12))
    assert vl.read_frame(folder, 10)[0, 0, 0] == 100
    with pytest.raises(ValueError, match="number: .* must have that frame, got 12"):
        vl.read_frame(folder, 12)


@pytest.mark.parametrize("pattern", ["a_%04d.png", "a_%d.png", "a_*.png", "a_????.png"])
def test_a_pattern_leaves_the_others_aside(tmp_path, pattern):
    fill(tmp_path / "shots", [f"b_{i:04d}.png" for i in range(3)])
    fill(tmp_path / "shots", [f"a_{i:04d}.png" for i in range(7)])
    assert shades(tmp_path / "shots" / pattern) == [10 * i for i in range(7)]


def test_a_missing_image_is_a_dropped_frame(tmp_path):
    folder = fill(tmp_path / "shots", [f"{i:03d}.png" for i in (100, 110, 130, 140, 150)])
    assert frame_clock(folder).tolist() == [0, 1, 3, 4, 5]


def test_names_without_numbers_are_in_the_order_of_letters(tmp_path):
    folder = fill(tmp_path / "shots", ["a.png", "b.png", "c.png"])
    assert shades(folder) == [0, 10, 20]


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ([], "path: must be a video file, or a folder of images, got .* without any"),
        (["a1.png", "b1.png", "b2.png"], "must have its own number, got .*1.png and .*1.png"),
        (["0033.png", "0066.png", "0101.png"], "the numbers of images must count frames"),
        (["1.png", "2.png", "900.png", "1800.png", "2700.png"], "must count frames"),
    ],
)
def test_folders_that_are_no_film(tmp_path, names, message):
    folder = fill(tmp_path / "shots", names)
    for read in (vl.read_video, video_info, frame_clock):
        with pytest.raises(ValueError, match=message):
            read(folder)


def test_a_pattern_that_nothing_fits(tmp_path):
    path = tmp_path / "none" / "a_%04d.png"
    with pytest.raises(
        FileNotFoundError, match=re.escape(f"nor images of that name, got '{path}'")
    ):
        vl.read_video(path)


def test_images_that_cannot_be_read(tmp_path):
    folder = fill(tmp_path / "shots", ["1.png", "2.png", "3.png"])
    (folder / "2.png").write_bytes(b"")
    with pytest.raises(ValueError, match=r"must be an image that OpenCV can read, got .*2\.png"):
        shades(folder)
    fill(folder, ["2.png"], size=(8, 8))
    with pytest.raises(ValueError, match=r"one size, \(32, 24\), got \(8, 8\) in .*2\.png"):
        shades(folder)


def test_a_folder_is_tracked_as_the_video_is(tmp_path):
    track = np.linspace([40, 40], [200, 160], 40)
    scene = vl.Scene(background="sky", size=14, image_size=(256, 200))
    video = vl.render_video(tmp_path / "a.mov", track, scene)
    (tmp_path / "a").mkdir()
    for i, frame in enumerate(vl.read_video(video)):
        cv2.imwrite(str(tmp_path / "a" / f"{i:05d}.png"), frame[..., ::-1])
    np.testing.assert_array_equal(vl.track(tmp_path / "a").pixels, vl.track(video).pixels)


def pages(dtype, shift=0):
    """A bright disc that goes to and fro, 40 images."""
    for k in range(40):
        page = np.full((60, 80), 90, np.uint8)
        cv2.circle(
            page, (round(40 + 25 * np.cos(k / 5)), round(30 + 17 * np.sin(k / 5))), 5, 230, -1
        )
        yield page.astype(dtype) << shift


@pytest.mark.parametrize("name", ["film.tif", "弾む.TIFF"])
def test_pages_of_one_tiff_are_a_film(tmp_path, name):
    cv2.imwritemulti(str(tmp_path / "a.tif"), list(pages(np.uint8)))
    path = (tmp_path / "a.tif").rename(tmp_path / name)
    assert video_info(path)[::2] == (40, (80, 60))
    film = [page[..., 0] for page in vl.read_video(path)]
    np.testing.assert_array_equal(film, list(pages(np.uint8)))
    assert len(vl.track(path).pixels) == 40
    (tmp_path / "bad.tif").write_bytes(path.read_bytes()[:100])
    with pytest.raises(ValueError, match=r"path: must hold .* frame, got none in '.*bad.tif'"):
        video_info(tmp_path / "bad.tif")


@pytest.mark.parametrize("bits", [10, 12, 16])
def test_images_of_fewer_bits_than_they_have_room_for(tmp_path, bits):
    (tmp_path / "film").mkdir()
    for k, page in enumerate(pages(np.uint16, bits - 8)):
        cv2.imwrite(str(tmp_path / "film" / f"{k:03d}.png"), page)
    film = [page[..., 0] for page in vl.read_video(tmp_path / "film")]
    np.testing.assert_array_equal(film, list(pages(np.uint8)))


def test_one_image_is_no_film(tmp_path):
    (tmp_path / "one").mkdir()
    cv2.imwrite(str(tmp_path / "one" / "1.png"), np.zeros((10, 10, 3), np.uint8))
    with pytest.raises(ValueError, match="path: must hold two frames or more, got one in"):
        vl.track(tmp_path / "one")


def test_images_of_real_numbers_are_refused(tmp_path):
    cv2.imwritemulti(str(tmp_path / "a.tif"), [np.zeros((9, 9), np.float32)] * 3)
    with pytest.raises(ValueError, match="path: must be an image that OpenCV can read"):
        video_info(tmp_path / "a.tif")
