"""The command line, ``python -m vidsindy_lite COMMAND``; ``--help`` lists the commands."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from .study import SYSTEMS

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

DISCOVER_DESCRIPTION = """\
Find the equations of motion of one target in your own videos, and write a report.

There is one video per camera of the rig file, in its order: cameras at rest, one thing that moves.
They may start at different times, differ in length and in frame rate; the first one is the clock.
"""

DISCOVER_EPILOG = """\
examples:
  python -m vidsindy_lite rig-template --cameras 3 > rig.toml      and fill it in
  python -m vidsindy_lite discover a.mp4 b.mp4 c.mp4 --rig rig.toml
  python -m vidsindy_lite discover a.mp4 b.mp4 c.mp4 --rig rig.toml --lag 0,7,0 --degree 2

The folder then holds report.html (one page, images included), result.json (the same as data) and
rig.toml (the learned cameras). If anything fails, it holds what it held before.

exit status: 0 if there is no reason to doubt the law, 1 if there is (the report says which),
2 if there is no report; the error says why.
"""

TEMPLATE_DESCRIPTION = """\
Print a rig file with a comment on every value, to be filled in with what you measured.
"""

RUN_DESCRIPTION = """\
Execute the notebooks through papermill, in order, and regenerate their figures and tables.

The full profile writes the executed notebooks (notebooks/*.ipynb) and figures/ of the repository;
the quick one is the same code on small problems and writes the same layout to build/quick/.
A failing notebook is reported with its cell and traceback, and the run goes on with the next.
What this clone has executed with the same code, and whose outputs are untouched, is up to date.
"""

RUN_EPILOG = """\
examples:
  python -m vidsindy_lite run                        everything, at full size
  python -m vidsindy_lite run --profile quick        everything, in minutes, into build/quick/
  python -m vidsindy_lite run 03                     one notebook, by its number ...
  python -m vidsindy_lite run 03_camera_learning 04  ... or its name, or several

exit status: 0 if every notebook ran to its end and the figures are complete, 1 if not,
2 if the command makes no sense.
"""

DEMO_DESCRIPTION = """\
Film a target that obeys a known law with three cameras, forget two of them and the law, and find
both again from the video files: the whole pipeline in less than a minute.
"""

TRAIN_DESCRIPTION = """\
Train the learned detector from scratch on frames that the package renders, and write its weights
(detector.pt) and the log of the training (detector.json) into the package. A few minutes on one
core. Stopped, it goes on from its last checkpoint when it is started again.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    options = _parser().parse_args(arguments)
    try:
        return options.command(options)
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m vidsindy_lite",
        description="From three videos of a moving target to its governing equations.",
        epilog="`python -m vidsindy_lite discover --help` says more, and so do the others.",
    )
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for add in (
        _add_discover, _add_template, _add_run, _add_demo, _add_train, _add_site, _add_compare
    ):
        add(commands)
    return parser


def _add_discover(commands: Commands) -> None:
    """Arguments of ``discover``."""
    parser = commands.add_parser(
        "discover",
        help="from your own videos and a rig file to a report on the law",
        description=DISCOVER_DESCRIPTION,
        epilog=DISCOVER_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("videos", nargs="+", metavar="VIDEO", help="one per camera of the rig")
    parser.add_argument("--rig", required=True, metavar="FILE", help="where the cameras stand")
    parser.add_argument(
        "--out", default="report", metavar="DIR", help="folder of the report (default: report)"
    )
    parser.add_argument(
        "--lag",
        type=_numbers,
        metavar="0,L2,L3",
        help="by how many frames of the first video each one starts later; the default is to learn "
        "it (a first number below zero needs the form --lag=-7,0,0)",
    )
    parser.add_argument(
        "--fps",
        type=float,
        metavar="RATE",
        help="frames of each video in one unit of time of the equations (default: as the files "
        "say, which makes it a second of video)",
    )
    parser.add_argument(
        "--degree", type=int, default=3, help="highest degree of the polynomials (default: 3)"
    )
    parser.add_argument(
        "--detector",
        default="auto",
        metavar="NAME",
        help="how to find the target: auto, background, learned, or the path of a YOLO-v8 ONNX "
        "file (default: auto)",
    )
    parser.add_argument("--seed", type=int, default=0, help="of the search (default: 0)")
    parser.set_defaults(command=_discover)


def _add_template(commands: Commands) -> None:
    """Arguments of ``rig-template``."""
    parser = commands.add_parser(
        "rig-template", help="print a rig file to fill in", description=TEMPLATE_DESCRIPTION
    )
    parser.add_argument("--cameras", type=int, default=3, help="how many (default: 3)")
    parser.add_argument(
        "--model",
        choices=("orthographic", "perspective"),
        default="orthographic",
        help="orthographic for far cameras with long lenses (default), perspective for near ones",
    )
    parser.add_argument(
        "--size",
        type=_size,
        default=(1920, 1080),
        metavar="WxH",
        help="of the videos in pixels (default: 1920x1080)",
    )
    parser.set_defaults(command=_rig_template)


def _add_run(commands: Commands) -> None:
    """Arguments of ``run``."""
    parser = commands.add_parser(
        "run",
        help="execute the notebooks, regenerate figures and tables",
        description=RUN_DESCRIPTION,
        epilog=RUN_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "notebooks", nargs="*", metavar="NOTEBOOK", help="number, name or path (default: all)"
    )
    parser.add_argument(
        "--profile", choices=("full", "quick"), default="full", help="size (default: full)"
    )
    parser.add_argument(
        "--output",
        metavar="DIR",
        help="folder for notebooks/ and figures/ (default: the repository, or build/quick)",
    )
    parser.add_argument(
        "--force",
        action="store_true",
        help="execute also what is up to date: same code, executed here, outputs in place",
    )
    parser.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="scheduler of a Dask cluster, e.g. tcp://10.0.0.1:8786, that the sweeps run on",
    )
    parser.set_defaults(command=_run)


def _add_demo(commands: Commands) -> None:
    """Arguments of ``demo``."""
    parser = commands.add_parser(
        "demo",
        help="from three videos to the first equation, in a minute",
        description=DEMO_DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--system", choices=SYSTEMS, default="Lorenz", help="default: Lorenz")
    parser.add_argument("--frames", type=int, default=500, help="per camera (default: 500)")
    parser.add_argument("--seed", type=int, default=0, help="of scenes and noise (default: 0)")
    parser.set_defaults(command=_demo)


def _add_train(commands: Commands) -> None:
    """Arguments of ``train-detector``."""
    parser = commands.add_parser(
        "train-detector",
        help="train the learned detector from scratch",
        description=TRAIN_DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seed", type=int, default=0, help="of weights and frames (default: 0)")
    parser.add_argument("--steps", type=int, help="batches of 16 frames (default: as shipped)")
    parser.add_argument("--output", metavar="FILE", help="weights (default: those of the package)")
    parser.set_defaults(command=_train)


def _add_site(commands: Commands) -> None:
    """Arguments of ``site``."""
    parser = commands.add_parser(
        "site",
        help="README, notebooks, figures and reference as web pages",
        description="Write README, notebooks, figures and reference as web pages for offline use.",
    )
    parser.add_argument(
        "--output", metavar="DIR", default="build/site", help="folder (default: build/site)"
    )
    parser.set_defaults(command=_site)


def _add_compare(commands: Commands) -> None:
    """Arguments of ``compare``."""
    parser = commands.add_parser(
        "compare",
        help="two folders of figures, by their numbers",
        description="Compare the numbers of two folders of figures, and lay out what differs.",
        epilog="exit status: 0 if all numbers agree, 1 if not, 2 if there is nothing to compare.",
    )
    parser.add_argument("committed", metavar="COMMITTED", help="a folder like figures/")
    parser.add_argument("regenerated", metavar="REGENERATED", help="the same from another run")
    parser.add_argument(
        "--output",
        metavar="DIR",
        required=True,
        help="for both sides, with a page; an earlier comparison there is replaced",
    )
    parser.set_defaults(command=_compare)


def _numbers(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"must be numbers with commas between them, got {text!r:.60}"
        ) from None


def _size(text: str) -> tuple[int, int]:
    try:
        width, height = text.split("x")
        return int(width), int(height)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"must be two integers like 1920x1080, got {text!r:.60}"
        ) from None


def _discover(options: argparse.Namespace) -> int:
    import numpy as np

    from .cameras import Rig, list_lags
    from .checks import check_positive
    from .companion.report import PAGE, check_folder_is_free, write_report
    from .pipeline import discover_from_videos
    from .vision import check_detector, video_info

    check_detector(options.detector)
    check_folder_is_free(options.out)
    rig, t = Rig.load(options.rig), None
    if options.fps is not None:
        t = np.arange(video_info(options.videos[0]).frames) / check_positive("fps", options.fps)
    found = discover_from_videos(
        options.videos,
        rig,
        t,
        lags=options.lag,
        detector=options.detector,
        degree=options.degree,
        seed=options.seed,
        progress=True,
    )
    told = {"rig file": options.rig, "degree": options.degree, "seed": options.seed}
    told |= {"lags": "learned" if options.lag is None else options.lag}
    told |= {"detector": options.detector}
    told |= {"frames in a unit of time": options.fps} if options.fps is not None else {}
    # First the law: if the report cannot be written, it is not lost.
    print(found)
    print(
        f"status: {found.status}; lags of the videos: {list_lags(found.lags.frames)} frames",
        flush=True,
    )
    write_report(found, options.videos, options.out, told)
    print(f"report: {Path(options.out) / PAGE}")
    return 0 if found.status == "ok" else 1


def _rig_template(options: argparse.Namespace) -> int:
    from .cameras import rig_template

    print(rig_template(options.cameras, options.model, options.size), end="")
    return 0


def _run(options: argparse.Namespace) -> int:
    from .companion import run as runner

    report = runner.run(
        options.notebooks,
        options.profile,
        options.output,
        force=options.force,
        dask=options.dask,
    )
    print(f"\n{report}")
    return 0 if report.ok else 1


def _demo(options: argparse.Namespace) -> int:
    from .pipeline import discover_from_videos
    from .study import film, score

    with tempfile.TemporaryDirectory() as folder:
        print(f"filming {options.system}: three videos of {options.frames} frames ...", flush=True)
        shot = film(options.system, folder, options.frames, options.seed)
        found = discover_from_videos(
            shot.paths, shot.rig.uncalibrated(keep=0), shot.t, seed=options.seed, progress=True
        )
    law = found.discovery
    print("the law, in the frame of the cameras:")
    print(found)
    print(f"the same around the origin ({', '.join(f'{value:.4f}' for value in law.offset)}):")
    print(law.equations("native"))
    print(f"against the truth: {score(law, shot.truth)}")
    return 0


def _train(options: argparse.Namespace) -> int:
    from .vision import training

    output = training.WEIGHTS if options.output is None else options.output
    steps = training.STEPS if options.steps is None else options.steps
    record = training.train(output, options.seed, steps, progress=True)
    print(f"{record['frames']} frames, loss {record['loss'][0]} to {record['loss'][-1]}: {output}")
    return 0


def _site(options: argparse.Namespace) -> int:
    from .companion.site import build_site

    pages = build_site(options.output)
    print(f"{len(pages)} pages: open {options.output}/index.html")
    return 0


def _compare(options: argparse.Namespace) -> int:
    from .companion.compare import side_by_side

    found = side_by_side(options.committed, options.regenerated, options.output)
    for name, place in found.items():
        print(f"{name}: {place}")
    print(f"{len(found)} with other numbers")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
