"""The command line, ``python -m vidsindy_lite COMMAND``; ``--help`` lists the commands."""

import argparse
import inspect
import re
import signal
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from . import __version__


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    options = argparse.Namespace(typed={}, kept=_KEPT)  # until it is known which command it is
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
    parser = _Parser(
        prog="python -m vidsindy_lite",
        description="From three videos of a moving target to its governing equations.",
        epilog="`python -m vidsindy_lite discover --help` says more, and so do the others.",
    )
    parser.add_argument("--version", action="version", version=f"vidsindy_lite {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for name, command in COMMANDS.items():
        told = inspect.getdoc(command.work) or ""
        text, *below = re.split(r"\n\n(?=examples:|exit status:)", told, maxsplit=1)
        one = commands.add_parser(
            name,
            help=command.help,
            description=text,
            epilog=below[0] if below else None,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        for option, settings in command.options.items():
            one.add_argument(option, **settings)
        usual = one.get_default
        one.set_defaults(work=command.work, typed=command.typed, kept=command.kept, usual=usual)
    return parser


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
    from .companion.report import PAGE, check_folder_is_free, write_refusal, write_report
    from .dynamics import Library, check_library
    from .pipeline import Refused, Stopped
    from .vision import check_detector

    if options.library is not None:
        options.library = Library.parse(options.library)
    if bool(options.videos) == bool(options.tracks):
        raise ValueError("videos: give either one video per camera, or --tracks")
    if options.individual is not None and not options.tracks:
        raise ValueError(f"individual: must be given with --tracks, got {options.individual!r}")
    if options.tracks and options.targets != 1:
        raise ValueError(f"targets: must be 1 with --tracks, got {options.targets}")
    check_detector(options.detector)
    check_folder_is_free(options.out)
    alone = options.rig is None and len(options.videos) == 1
    if options.rig is None and len(options.videos) in (0, 2):
        raise ValueError("rig: must be given for tracks or two videos, got none")
    for name in _OF_A_RIG if alone else _OF_ONE_VIDEO:
        if (value := getattr(options, name)) != options.usual(name):
            rule = f"must be given with {'several videos' if alone else 'one video alone'}"
            raise ValueError(f"{name}: {rule}, got {value}")
    rig, videos = Rig.load(options.rig) if options.rig else None, options.videos or None
    told = {"seed": options.seed, "order": options.order}
    if alone:
        told |= {name: getattr(options, name) for name in ("degree", *_OF_ONE_VIDEO)}
    else:
        told |= {
            "rig file": options.rig or "none",
            "library": str(check_library(options.degree, options.library)),
            "origin": options.origin, "orientation": options.orientation,
            "lags": "learned" if options.lag is None else options.lag,
            "targets": None if options.targets == 1 else options.targets,
        }  # fmt: skip
    told |= {"detector": options.detector} if videos else {"tracks": ", ".join(options.tracks)}
    told["frames in a unit of time"] = options.fps
    told = {name: value for name, value in told.items() if value is not None}
    try:
        found = _found(options, rig, alone)
    except (Refused, Stopped) as refused:
        if isinstance(refused, Stopped) and not videos:  # its tracks are there already
            raise KeyboardInterrupt from None
        try:
            write_refusal(refused, videos, rig, options.out, told)
        except (ValueError, OSError) as error:
            raise ValueError(f"{refused}; the tracks could not be drawn: {error}") from None
        page = Path(options.out) / PAGE
        if isinstance(refused, Stopped):
            raise KeyboardInterrupt(f"the tracks are kept beside {page}") from None
        raise ValueError(f"{refused}; the tracks are drawn in {page}") from None
    # First the law: if the report cannot be written, it is not lost.
    lags = "" if alone else f"; lags of the videos: {list_lags(found.lags.frames)} frames"
    print(f"{found}\nstatus: {found.status}{lags}", flush=True)
    write_report(found, videos, options.out, told)
    print(f"report: {Path(options.out) / PAGE}")
    return 0 if found.status == "ok" else 1


def _found(options: argparse.Namespace, rig: Any, alone: bool) -> Any:
    """The law that videos or tracks obey, or a motion in a plane in the film of one camera."""
    from .checks import check_positive, check_vector
    from .pipeline import discover_from_tracks, discover_from_videos
    from .plane import discover_from_video
    from .vision import Hint, frame_clock, load_hints

    def given(*names: str) -> dict[str, Any]:
        return {name: getattr(options, name) for name in names}

    order = "auto" if options.order == "auto" else int(options.order)
    shared = given("degree", "seed") | {"order": order}
    if alone:
        shared |= given("fps", "detector", *_OF_ONE_VIDEO)
        if options.hint is not None:
            frame, *box = check_vector("hint", options.hint, 5)
            shared["hint"] = Hint(frame=int(frame), box=tuple(box))
        return discover_from_video(options.videos[0], **shared)
    shared |= given("library", "origin", "orientation") | {"lags": options.lag}
    if options.tracks:
        return discover_from_tracks(options.tracks, rig, **shared, **given("individual", "fps"))
    t = None
    if options.fps is not None:
        t = frame_clock(options.videos[0]) / check_positive("fps", options.fps)
    hints = load_hints(options.rig) if options.rig else None
    return discover_from_videos(
        options.videos, rig, t, hints=hints, **shared, **given("detector", "targets")
    )


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
    else:
        write_file(check_output("output", output), text.encode())
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


# ------------------------------------------------------------------------------------ their options


class _Parser(argparse.ArgumentParser):
    """A parser that refuses as the package does: argument, rule and value in one line."""

    def error(self, message: str) -> NoReturn:
        told = re.fullmatch(r"(.*)invalid choice: (.*) \(choose from (.*)\)", message)
        if told:
            known = told[3].replace("'", "")
            message = f"{told[1]}must be one of {known}, got {told[2]}"
        for kind, rule in _RULES.items():
            message = message.replace(f"invalid {kind} value: ", f"must be {rule}, got ")
        raise ValueError(message.removeprefix("argument ").removeprefix("--"))


def numbers(text: str) -> list[float]:
    """Numbers with commas between them."""
    return [float(part) for part in text.split(",")]


def size(text: str) -> tuple[int, int]:
    """Width and height in pixels."""
    width, height = text.split("x")
    return int(width), int(height)


_RULES = {
    "int": "an integer", "float": "a number", "numbers": "numbers with commas between them",
    "size": "two integers like 1920x1080",
}  # fmt: skip


def _choice(default: str, known: Sequence[str], what: str) -> dict[str, Any]:
    """An option that has one of a few values."""
    return {"default": default, "choices": known, "help": what}


def _count(default: int | None, what: str) -> dict[str, Any]:
    """An option that is an integer."""
    return {"default": default, "type": int, "help": what}


def _words(metavar: str, what: str, **more: object) -> dict[str, Any]:
    """An argument or an option that is text, or is made of it."""
    return {"metavar": metavar, "help": what, **more}


_OF_ONE_VIDEO = ("length", "length_error", "up", "corners", "hint")
_OF_A_RIG = ("library", "lag", "targets", "origin", "orientation")
_KEPT = "files are as they were"  # as they are written in one step, at the end


class _Command(NamedTuple):
    """What a command does, a line on it, and what `add_argument` takes for each of its options.

    What messages call by its name in the package, ``typed`` calls as the user does; ``kept`` says
    what there is after an interruption.
    """

    work: Callable[[argparse.Namespace], int]
    help: str
    options: dict[str, dict[str, Any]]
    typed: dict[str, str] = {}
    kept: str = _KEPT


COMMANDS = {
    "discover": _Command(_discover, "from your own videos and a rig file to a report on the law", {
        "videos": _words("VIDEO", "one per camera of the rig", nargs="*"),
        "--tracks": _words(
            "FILE", "text files of tracks, one per camera of the rig or one of all, in place of "
            "videos", nargs="+"
        ),
        "--individual": _words(
            "NAME", "which of several targets of these files, by its name there"
        ),
        "--rig": _words(
            "FILE", "where the cameras stand; without it, three or more are learned from the "
            "videos alone, or one video is of a motion in a plane"
        ),
        "--length": _words(
            "U1,V1,U2,V2,METRES", "of one video: two marks in its first frame, pixels, and how far "
            "they are apart in the plane of the motion", type=numbers
        ),
        "--length-error": _words(
            "SHARE", "standard error of that length, as a share of it (default: 0.01)",
            type=float, default=0.01
        ),
        "--up": _words(
            "DU,DV", "of one video: the vertical in the picture, a direction or two marks, the "
            "lower one first (default: 0,-1)", type=numbers
        ),
        "--corners": _words(
            "U1,V1,...,WIDTH,HEIGHT", "of one video seen askew, in place of --length: the corners "
            "of a rectangle in that plane, from its lower left to its lower right and round, and "
            "its sides in metres", type=numbers
        ),
        "--hint": _words(
            "FRAME,U,V,WIDTH,HEIGHT", "of one video: a frame and a box around the target in it",
            type=numbers
        ),
        "--out": _words("DIR", "folder of the report (default: report)", default="report"),
        "--lag": _words(
            "0,L2,L3", "of several videos: how many frames of the first each starts later; "
            "learned by default (a first number below zero needs the form --lag=-7,0,0)",
            type=numbers
        ),
        "--fps": _words(
            "RATE", "frames of each video in one unit of time of the equations (default: as the "
            "files say, which makes it a second of video)", type=float
        ),
        "--degree": _count(None, "highest degree of the polynomials (default: 3)"),
        "--library": _words(
            "TERMS", "of several videos, in place of --degree: polynomial(N), fourier(N) with "
            "the sines and cosines of the coordinates, rational(N) with denominators, or a sum "
            "such as 'polynomial(1) + fourier(1)'; then what is known, as in "
            "'polynomial(2); x: y = 10, z = 0' (?: to be found; ...: all others)"
        ),
        "--order": _choice(
            "auto", ("1", "2", "auto"),
            "1 for x' = f(x), 2 for laws of motion, x'' = f(x, x'), auto (default) for the one to "
            "be trusted"
        ),
        "--origin": _choice(
            "learn", ("learn", "data"),
            "whether the law's own origin is sought (default) or is that of the data"
        ),
        "--orientation": _choice(
            "data", ("data", "learn"),
            "whether the axes are those of the rig (default), or turned to where the law has "
            "fewest terms: for rigs that nobody has measured"
        ),
        "--detector": _words(
            "NAME", "how to find the target: auto, background, learned, or the path of a YOLO-v8 "
            "ONNX file (default: auto)", default="auto"
        ),
        "--targets": _count(
            1, "of several videos: how many targets to find one law for (default: 1), which "
            "are told from each other by geometry"
        ),
        "--seed": _count(0, "of the search (default: 0)"),
    }, {"path": "videos", "paths": "videos", "lags": "lag"}),
    "pick": _Command(_pick, "a page on which you show the target in your videos", {
        "videos": _words("VIDEO", "a file, a folder of images, or a pattern", nargs="+"),
        "--out": _words("FILE", "the page (default: pick.html)", default="pick.html"),
    }, {"path": "videos", "paths": "videos"}),
    "rig-template": _Command(_rig_template, "print a rig file to fill in", {
        "--cameras": _count(3, "how many (default: 3)"),
        "--model": _choice(
            "perspective", ("perspective", "orthographic"),
            "perspective (default), or orthographic for far cameras with long lenses"
        ),
        "--size": _words(
            "WxH", "of the videos in pixels (default: 1920x1080)", type=size,
            default=(1920, 1080)
        ),
        "--output": _words("FILE", "write it there, in UTF-8 (default: print it)"),
    }, {"image_size": "size"}),
    "rig-import": _Command(_rig_import, "a rig file from the calibration of another tool", {
        "files": _words("FILE", "calibrations, in the order of the videos", nargs="+"),
        "--size": _words("WxH", "of the videos in pixels, if the files do not say", type=size),
        "--output": _words("FILE", "write it there, in UTF-8 (default: print it)"),
    }, {"image_size": "size", "paths": "files"}),
    "run": _Command(_run, "execute the notebooks, regenerate figures and tables", {
        "notebooks": _words("NOTEBOOK", "number, name or path (default: all)", nargs="*"),
        "--profile": _choice("full", ("full", "quick"), "size (default: full)"),
        "--force": {
            "action": "store_true",
            "help": "execute also what has been executed here with the same code",
        },
    }, kept="notebooks that have ended are kept, and results in build/cache: start it again"),
    "demo": _Command(_demo, "from three videos to the first equation, in a minute", {
        "--system": _words("NAME", "of the paper's seven (default: Lorenz)", default="Lorenz"),
        "--frames": _count(500, "per camera (default: 500)"),
        "--seed": _count(0, "of scenes and noise (default: 0)"),
    }),
    "train-detector": _Command(_train, "train the learned detector from scratch", {
        "--seed": _count(0, "of weights and frames (default: 0)"),
        "--steps": _count(None, "batches of 16 frames (default: as shipped)"),
        "--output": _words("FILE", "weights (default: those of the package)"),
    }),
    "compare": _Command(_compare, "two folders of figures, by their numbers", {
        "committed": _words("COMMITTED", "a folder like figures/"),
        "regenerated": _words("REGENERATED", "the same from another run"),
        "--output": _words(
            "FILE", "the page (default: differences.html); an earlier one is replaced",
            default="differences.html"
        ),
    }),
}  # fmt: skip


if __name__ == "__main__":
    # As Ctrl-C does, SIGTERM lets a command clean up: a run leaves no kernels behind.
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))
    sys.exit(main())
