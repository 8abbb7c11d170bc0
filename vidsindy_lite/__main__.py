"""The command line, ``python -m vidsindy_lite COMMAND``; ``--help`` lists the commands."""

import argparse
import inspect
import io
import re
import signal
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from . import __version__


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    # As they are written in one step, at the end; and until it is known which command it is.
    options = argparse.Namespace(typed={}, kept="files are as they were")
    if isinstance(sys.stdout, io.TextIOWrapper):  # not every terminal knows all characters
        sys.stdout.reconfigure(errors="replace")
    try:
        _parser().parse_args(arguments, options)
        return options.work(options)
    except KeyboardInterrupt as stop:
        print(f"\nstopped; {str(stop) or options.kept}", file=sys.stderr)
        return 130
    except (ValueError, OSError) as error:
        name, colon, rest = str(error).partition(":")
        name = options.typed.get(name.partition("[")[0], name)
        print(f"error: {name}{colon}{rest}", file=sys.stderr)
        return 2


def _parser() -> argparse.ArgumentParser:
    """What ``__main__.toml`` describes; --help of a command shows the docstring of its function."""
    parser = _Parser(
        prog="python -m vidsindy_lite",
        description="From three videos of a moving target to its governing equations.",
        epilog="`python -m vidsindy_lite discover --help` says more, and so do the others.",
    )
    parser.add_argument("--version", action="version", version=f"vidsindy_lite {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    described = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
    for name, command in described.items():
        shown = inspect.getdoc(COMMANDS[name]) or ""
        text, *below = re.split(r"\n\n(?=examples:|exit status:)", shown, maxsplit=1)
        one = commands.add_parser(
            name,
            help=command.pop("help"),
            description=text,
            epilog=below[0] if below else None,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        for kind in _RULES:
            one.register("type", kind.__name__, kind)
        for option, settings in command.pop("options").items():
            one.add_argument(option, **settings)
        one.set_defaults(work=COMMANDS[name], usual=one.get_default, **command)
    return parser


class _Parser(argparse.ArgumentParser):
    """A parser that refuses as the package does: argument, rule and value in one line."""

    def __init__(self, *args: Any, **settings: Any) -> None:
        super().__init__(*args, **settings)
        self._negative_number_matcher = re.compile(r"-[\d.]")  # of lists of numbers, too

    def error(self, message: str) -> NoReturn:
        told = re.fullmatch(r"(.*)invalid choice: (.*) \(choose from (.*)\)", message)
        if told:
            known = told[3].replace("'", "")
            message = f"{told[1]}must be one of {known}, got {told[2]}"
        for kind, rule in _RULES.items():
            message = message.replace(f"invalid {kind.__name__!r} value: ", f"must be {rule}, got ")
        raise ValueError(message.removeprefix("argument ").removeprefix("--"))


def numbers(text: str) -> list[float]:
    """Numbers with commas between them."""
    return [float(part) for part in text.split(",")]


def size(text: str) -> tuple[int, int]:
    """Width and height in pixels."""
    width, height = text.split("x")
    return int(width), int(height)


# What the values of options are made by, and have to be.
_RULES: dict[Any, str] = {
    int: "an integer", float: "a number", numbers: "numbers with commas between them",
    size: "two integers like 1920x1080",
}  # fmt: skip


# ------------------------------------------------------ the commands, whose docstrings --help shows


def _discover(options: argparse.Namespace) -> int:
    """Find the equations of motion of one target in your own videos, and write a report.

    Of a motion in a plane that faces the camera, such as a throw, a swing or a weight on a spring,
    one video is enough: --length gives the scale by two marks in its first frame, (u right, v
    down) in pixels, and the metres between them in that plane; without it, places are in pixels.
    The report has g, or the period of small swings, with their errors. For all else:

    There is one video per camera of the rig file, in its order: cameras at rest, one thing that
    moves. They may start at different times, differ in length and in frame rate; the first one is
    the clock. A video may be a file, a folder of images, or a pattern of their names in quotes.
    Who has tracked the target elsewhere gives --tracks in place of videos: text files as DLTdv,
    Argus, Tracker, Kinovea, TrackMate, DeepLabCut, SLEAP, detectors and this command write them.

    examples:
      python -m vidsindy_lite discover swing.mp4 --length 120,80,125,410,0.45
      python -m vidsindy_lite rig-template --output rig.toml           and fill it in
      python -m vidsindy_lite discover a.mp4 b.mp4 c.mp4 --rig rig.toml
      python -m vidsindy_lite discover a.mp4 b.mp4 c.mp4               nothing known of the cameras
      python -m vidsindy_lite discover a.mp4 b.mp4 c.mp4 --rig rig.toml --lag 0,7,0 --degree 2
      python -m vidsindy_lite discover "a/%04d.png" "b/%04d.png" c/ --rig rig.toml --fps 240
      python -m vidsindy_lite discover --tracks a.csv b.csv c.csv --rig rig.toml --fps 30

    The folder then holds report.html (one page, images included), result.json (the same as data),
    tracks.csv and, of several cameras, rig.toml (as they were learned), beside whatever else is
    there. If tracks were found but no law, it holds a picture of them; if anything else fails, what
    it held before.

    exit status: 0 if there is no reason to doubt the law, 1 if there is (the report says which),
    2 if there is no law; the error says why.
    """
    from .cameras import Rig, list_lags
    from .companion.report import check_folder_is_free, write_refusal, write_report
    from .dynamics import Library, check_library
    from .pipeline import Refused, Stopped
    from .plane import TABLES

    if options.library is not None:
        options.library = Library.parse(options.library)
    if bool(options.videos) == bool(options.tracks):
        raise ValueError("videos: give either one video per camera, or --tracks")
    for one in options.videos:
        if Path(one).suffix.lower() in TABLES:
            raise ValueError(f"videos: must be films, tracks come after --tracks, got '{one}'")
    given = options.tracks or options.videos
    check_folder_is_free(options.out, [*given, *filter(None, [options.rig])])
    alone = options.rig is None and len(given) == 1
    if options.rig is None and not alone and (options.tracks or len(given) == 2):
        raise ValueError("rig: must be given for several tracks or two videos, got none")
    several = "--tracks and a rig" if options.tracks else "several videos"
    kind = "one camera alone" if alone else several
    asked = {name: getattr(options, name) for name in options.kinds[kind]}
    for name in sum(options.kinds.values(), []):
        if name not in asked and (value := getattr(options, name)) != options.usual(name):
            fitting = " or ".join(one for one, names in options.kinds.items() if name in names)
            raise ValueError(f"{name}: must be given with {fitting}, got {value}")
    rig, videos = Rig.load(options.rig) if options.rig else None, options.videos or None
    told = asked | {"frames in a unit of time": options.fps, "fps": None}
    if not alone:
        told |= {
            "rig file": options.rig or "none",
            "library": str(check_library(options.degree, options.library)), "degree": None,
            "lags": "learned" if options.lags is None else options.lags,
            "tracks": ", ".join(options.tracks or ()) or None,
        }  # fmt: skip
    told = {name: value for name, value in told.items() if value is not None}
    try:
        found = _found(options, rig, kind, asked)
    except (Refused, Stopped) as refused:
        if isinstance(refused, Stopped) and not videos:  # its tracks are there already
            raise KeyboardInterrupt from None
        try:
            page = write_refusal(refused, videos, rig, options.out, told)
        except (ValueError, OSError) as error:
            raise ValueError(f"{refused}; the tracks could not be drawn: {error}") from None
        if isinstance(refused, Stopped):
            raise KeyboardInterrupt(f"the tracks are kept beside {page}") from None
        raise ValueError(f"{refused}; the tracks are drawn in {page}") from None
    lags = "" if alone else f"; lags of the videos: {list_lags(found.lags.frames)} frames"
    try:
        page = write_report(found, videos, options.out, told)
    finally:  # if the report cannot be written, or nobody reads what is printed, it is not lost
        print(f"{found}\nstatus: {found.status}{lags}", flush=True)
    print(f"report: {page}")
    return 0 if found.status == "ok" else 1


def _found(options: argparse.Namespace, rig: Any, kind: str, asked: dict[str, Any]) -> Any:
    """The law that videos or tracks obey, or a motion in a plane in the film of one camera."""
    from .checks import check_positive, check_vector
    from .pipeline import discover_from_tracks, discover_from_videos
    from .plane import discover_from_video
    from .vision import Hint, frame_clock, load_hints

    if options.order != "auto":
        asked["order"] = int(options.order)
    if kind == "--tracks and a rig":
        return discover_from_tracks(options.tracks, rig, **asked)
    if kind == "one camera alone":
        if asked.get("hint") is not None:
            frame, *box = check_vector("hint", options.hint, 5).tolist()
            asked["hint"] = Hint(frame=frame if frame % 1 else int(frame), box=tuple(box))
        (path,) = options.tracks or options.videos
        return discover_from_video(path, **asked)
    fps, t = asked.pop("fps"), None
    if fps is not None:
        t = frame_clock(options.videos[0]) / check_positive("fps", fps)
    hints = load_hints(options.rig) if options.rig else None
    return discover_from_videos(options.videos, rig, t, hints=hints, **asked)


def _pick(options: argparse.Namespace) -> int:
    """Write a page on which you show the target, if the tracker takes something else for it.

    Open the page in any browser, without a network: a box that is drawn around the target in one
    frame becomes a line for the rig file, and one for Python.

    examples:
      python -m vidsindy_lite pick a.mp4 b.mp4 c.mp4
    """
    from .companion.report import write_pick_page

    print(f"open {write_pick_page(options.videos, options.out)} in a browser")
    return 0


def _rig_template(options: argparse.Namespace) -> int:
    """Print a rig file with a comment on every value, to be filled in with what you measured."""
    from .cameras import rig_template

    return _write(rig_template(options.cameras, options.model, options.size), options.output)


def _rig_import(options: argparse.Namespace) -> int:
    """Print the rig file of what other tools have calibrated: perspective cameras, lenses included.

    Files of Anipose, Pose2Sim, Caliscope (.toml), OpenCV (.yaml, .xml, .json, .npz with K, dist, R
    or rvec, t), DLT coefficients of DLTdv, Argus and easyWand (.csv), or projection matrices
    (.csv, .npy); one file of all cameras or one per camera, in the order of the videos.

    examples:
      python -m vidsindy_lite rig-import calibration.toml --output rig.toml
      python -m vidsindy_lite rig-import dltCoefs.csv --size 1920x1080 > rig.toml
    """
    from .cameras import read_calibration

    rig = read_calibration(options.files, options.size)
    for warning in rig.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    return _write(rig.text(), options.output)


def _write(text: str, output: str | None) -> int:
    """Text for the terminal, or in UTF-8 for a file."""
    from .checks import check_output
    from .storage import write_file

    if output is None:
        print(text, end="")
        return 0
    path = check_output("output", output)
    if path.is_file():  # perhaps one that was filled in by hand
        raise ValueError(f"output: must be a new file, got '{path}'")
    write_file(path, text.encode())
    return 0


def _run(options: argparse.Namespace) -> int:
    """Execute the notebooks through papermill, three at a time, and refresh what differs.

    The full profile refreshes the executed notebooks (notebooks/*.ipynb) and figures/ of the
    repository: a file is written where a number differs by more than its tolerance, or a picture so
    that one sees it. The quick profile is the same code on small problems, with the same layout, in
    build/quick/. A failing notebook is reported with its cell and traceback, and the others go on.
    What this clone has executed with the same code is not executed again.

    examples:
      python -m vidsindy_lite run                        everything, at full size
      python -m vidsindy_lite run --profile quick        everything, in minutes, into build/quick/
      python -m vidsindy_lite run 03                     one notebook, by its number ...
      python -m vidsindy_lite run 03_camera_learning 04  ... or its name, or several

    exit status: 0 if every notebook ran to its end, 1 if not,
    2 if the command makes no sense.
    """
    from .companion.run import run

    outcomes = run(options.notebooks, options.profile, force=options.force)
    failed = [outcome.notebook for outcome in outcomes if outcome.error]
    changed = sum(len(outcome.changed) for outcome in outcomes)
    print(f"\n{changed} outputs changed; failed: {', '.join(failed) or 'none'}")
    return 1 if failed else 0


def _demo(options: argparse.Namespace) -> int:
    """Film a target that obeys a known law with three cameras, and find the law again.

    Two of the cameras are forgotten, too, and learned from the video files: this is the whole
    pipeline in less than a minute.
    """
    from .checks import check_choice, check_integer
    from .pipeline import discover_from_videos
    from .study import SYSTEMS, film, score

    check_choice("system", options.system, SYSTEMS)
    check_integer("frames", options.frames, 2)
    with tempfile.TemporaryDirectory() as folder:
        print(f"filming {options.system}: three videos of {options.frames} frames ...", flush=True)
        shot = film(options.system, folder, options.frames, options.seed)
        forgotten = shot.rig.uncalibrated(keep=0)
        found = discover_from_videos(shot.paths, forgotten, shot.t, seed=options.seed)
    law = found.discovery
    print("the law, in the frame of the cameras:")
    print(found)
    print(f"the same around the origin ({', '.join(f'{value:.4f}' for value in law.offset)}):")
    print(law.equations("native"))
    print(f"against the truth: {score(law, shot.truth)}")
    return 0


def _train(options: argparse.Namespace) -> int:
    """Train the learned detector from scratch on frames that the package renders.

    Its weights (detector.pt) and the log of the training (detector.json) go into the package. This
    takes a few minutes on one core.
    """
    from .vision import network

    output = network.WEIGHTS if options.output is None else options.output
    steps = network.STEPS if options.steps is None else options.steps
    record = network.train(output, options.seed, steps)
    print(f"{record['frames']} frames, loss {record['loss'][0]} to {record['loss'][-1]}: {output}")
    return 0


def _compare(options: argparse.Namespace) -> int:
    """Compare the numbers of two folders of figures, and show on a page what differs.

    exit status: 0 if all numbers agree, 1 if not, 2 if there is nothing to compare.
    """
    from .companion.compare import write_differences

    found = write_differences(options.committed, options.regenerated, options.output)
    for name, place in found.items():
        print(f"{name}: {place}")
    print(f"{len(found)} with other numbers")
    return 1 if found else 0


COMMANDS = {
    "discover": _discover, "pick": _pick, "rig-template": _rig_template, "rig-import": _rig_import,
    "run": _run, "demo": _demo, "train-detector": _train, "compare": _compare,
}  # fmt: skip


if __name__ == "__main__":
    # As Ctrl-C does, SIGTERM lets a command clean up: a run leaves no kernels behind.
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))
    sys.exit(main())
