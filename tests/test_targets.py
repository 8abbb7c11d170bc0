"""Two like-coloured targets from three films to one law: who drives whom, and by what terms."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

import vidsindy_lite as vl
from vidsindy_lite.__main__ import main
from vidsindy_lite.companion.report import write_refusal, write_report
from vidsindy_lite.pipeline import Refused, _driven, check_found
from vidsindy_lite.vision import Track

FRAMES, STEP = 200, 0.05
OWN = np.array([[-0.02, -1.1, 0.0], [1.1, -0.02, 0.7], [0.0, -0.7, -0.02]])
COUPLED = np.block([[OWN, np.zeros((3, 3))], [0.4 * np.eye(3), 1.3 * OWN]])
"""The first target turns by itself, the second is pulled along."""


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    """Three films, the rig, and the true paths side by side."""
    folder = tmp_path_factory.mktemp("films")
    start = np.array([1.0, 0.2, -0.5, -0.9, 0.6, 0.8])
    x = np.array([expm(COUPLED * STEP * i) @ start for i in range(FRAMES)])
    rig = vl.Rig.around(np.concatenate((x[:, :3], x[:, 3:])), image_size=(256, 256))
    paths = []
    for i, camera in enumerate(rig.cameras):
        track = np.hstack([camera.project(one) for one in (x[:, :3], x[:, 3:])])
        look = {"image_size": (256, 256), "shape": "disc", "size": 9.0, "colour": "red"}
        scene = vl.Scene.random(np.random.default_rng(i), **look)
        paths.append(vl.render_video(folder / f"{i}.mov", track, scene, fps=1 / STEP))
    return paths, rig, x


@pytest.fixture(scope="module")
def found(films):
    """As if the tracker had seen the targets of each film, in an order of its own."""
    paths, rig, x = films

    def seen(path, count):
        camera, rng = rig.cameras[int(path.stem)], np.random.default_rng(int(path.stem))
        both = [camera.project(one) for one in (x[:, 3:], x[:, :3])][:: rng.choice([1, -1])]
        both = [one + 0.05 * rng.normal(size=one.shape) for one in both]
        return tuple(Track(one, np.ones(FRAMES), "motion") for one in both)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vl.vision, "track_targets", seen)
        with pytest.raises(ValueError, match=r"got \(0, 4, 0\) .* where \(0, 0, 0\) do: give"):
            vl.observe(paths, rig, targets=2, lags=(0, 4, 0))
        return vl.discover_from_videos(paths, rig.uncalibrated(keep=0), targets=2, degree=1)


@pytest.mark.slow
def test_films_of_both_give_their_paths(films, found):
    seen = vl.observe(films[0], films[1].uncalibrated(keep=0), targets=2)
    assert np.nanmax(np.abs(seen.x - found.x)) < 0.03
    assert np.isfinite(seen.x).all(axis=1).mean() > 0.9


def test_the_law_of_both_is_exact(films, found):
    x = films[2]
    order = [0, 1, 2, 3, 4, 5]
    if np.nanmax(np.abs(found.x - x)) > 0.1:  # which target comes first is not said
        order = [3, 4, 5, 0, 1, 2]
    assert np.nanmax(np.abs(found.x - x[:, order])) < 0.02
    assert np.isfinite(found.x).all(axis=1).mean() > 0.9
    law = found.discovery.system
    linear = np.flatnonzero(law.exponents.sum(axis=1) == 1)
    linear = linear[law.exponents[linear].argmax(axis=1).argsort()]
    truth = COUPLED[np.ix_(order, order)]
    np.testing.assert_array_equal(law.support[linear].T, truth != 0)
    np.testing.assert_allclose(law.coefficients[linear].T, truth, atol=5e-3)
    first, second = (1, 2) if order[0] == 0 else (2, 1)
    assert found.driven.startswith(f"{first} moves independently; {first} drives {second} by ")
    assert found.driven in str(found)
    assert found.targets == 2
    assert [track.shape for track in found.tracks] == [(FRAMES, 4)] * 3
    assert found.systematic.shape[1:] == (FRAMES, 6)
    assert np.nanmax(np.abs(np.hstack(found.residuals))) < 0.5
    np.testing.assert_allclose(found.t, np.arange(FRAMES) * STEP, atol=1e-9)


def test_the_report_shows_both(films, found, tmp_path):
    page = write_report(found, films[0], tmp_path / "report").read_text("utf-8")
    assert "drives" in page
    data = json.loads((tmp_path / "report" / "result.json").read_text("utf-8"))
    assert np.shape(data["tracks"]) == (3, FRAMES, 4)
    head = (tmp_path / "report" / "tracks.csv").read_text("utf-8").splitlines()[0]
    assert head == "t,u1a,v1a,u1b,v1b,u2a,v2a,u2b,v2b,u3a,v3a,u3b,v3b"
    refused = Refused("no law", "law", found.tracks)
    assert write_refusal(refused, films[0], films[1], tmp_path / "refused").is_file()


@pytest.mark.parametrize(("order", "given"), [("1", 1), ("2", 2), ("auto", "auto")])
def test_the_command_passes_targets_and_order(films, tmp_path, monkeypatch, capsys, order, given):
    def called(*_, **options):
        raise ValueError(f"called with {options['targets']!r} and {options['order']!r}")

    monkeypatch.setattr("vidsindy_lite.pipeline.discover_from_videos", called)
    films[1].save(tmp_path / "rig.toml")
    options = ["--rig", str(tmp_path / "rig.toml"), "--out", str(tmp_path / "report")]
    main(["discover", *map(str, films[0]), *options, "--targets", "2", "--order", order])
    assert f"called with 2 and {given!r}" in capsys.readouterr().err
    assert main(["discover", "--tracks", "a.csv", *options, "--targets", "2"]) == 2
    assert "targets: must be given with several videos, got 2" in capsys.readouterr().err


def test_laws_of_second_order_name_their_targets_by_places_and_velocities():
    names = [f"x{i}" for i in range(1, 7)]
    equations = {name: {f"v{name}": 1.0} for name in names}
    equations |= {f"v{name}": {name: -1.0} for name in names}
    equations["vx1"] |= {"x4": 0.5}
    equations["vx5"] |= {"vx2": 0.1}
    law = vl.PolynomialSystem.from_terms(equations)
    assert _driven(law) == "1 drives 2 by vx2 in x5''; 2 drives 1 by x4 in x1''"
    del equations["vx5"]["vx2"], equations["vx1"]["x4"]
    assert _driven(vl.PolynomialSystem.from_terms(equations)) == "1 and 2 move independently"


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"targets": 0}, "targets: must be an integer of at least 1"),
        ({"detector": "learned"}, "targets: 2 are found by detector='auto' alone"),
        ({"hints": [vl.Hint(frame=0, box=(1, 1, 9, 9)), None, None]}, "targets: 2 are found by"),
        ({"hints": vl.Hint(frame=0, box=(1, 1, 9, 9))}, "hints: must be a list, one per video"),
        ({"rig": None}, "targets: 2 need three cameras .* got 0 of known ones"),
        ({"targets": 1, "hints": [None]}, "hints: must be one per video, got 1 for 3"),
    ],
)
def test_what_several_targets_need(films, changed, message):
    paths, rig, _ = films
    with pytest.raises(ValueError, match=message):
        vl.observe(paths, **({"rig": rig, "targets": 2} | changed))


def test_a_film_that_shows_fewer_is_refused_with_all_tracks():
    both = np.arange(40.0).reshape(10, 4)
    one = both.copy()
    one[:, 2:] = np.nan
    with pytest.raises(Refused, match="b.mov must show 2 moving targets, got 1 in any") as refused:
        check_found([both, one], ["a.mov", "b.mov"], 2, [[], []])
    assert refused.value.step == "track"
    assert len(refused.value.tracks) == 2
    with pytest.raises(
        Refused, match="b.mov must show one .*, got none in any frame: no red; what m"
    ):
        check_found([both[:, :2], one[:, 2:]], ["a.mov", "b.mov"], 1, [[], ["no red"]])
    check_found([both, both], ["a.mov", "b.mov"], 2, [[], []])


def test_two_views_cannot_tell_targets_apart(films):
    paths, rig, _ = films
    with pytest.raises(ValueError, match="targets: 2 need three .* got 2 of known ones"):
        vl.observe(paths[:2], replace(rig, cameras=rig.cameras[:2]), targets=2)
