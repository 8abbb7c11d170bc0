"""The command line: ``python -m vidsindy_lite`` with a command: run, demo, site or compare."""

import argparse
import sys
import tempfile
from collections.abc import Sequence

from .systems import SYSTEMS

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


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    options = _parser().parse_args(arguments)
    try:
        return options.command(options)
    except (ValueError, FileNotFoundError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m vidsindy_lite",
        description="From three videos of a moving target to its governing equations.",
        epilog="`python -m vidsindy_lite run --help` says more.",
    )
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    run = commands.add_parser(
        "run",
        help="execute the notebooks, regenerate figures and tables",
        description=RUN_DESCRIPTION,
        epilog=RUN_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    run.add_argument(
        "notebooks", nargs="*", metavar="NOTEBOOK", help="number, name or path (default: all)"
    )
    run.add_argument(
        "--profile", choices=("full", "quick"), default="full", help="size (default: full)"
    )
    run.add_argument(
        "--output",
        metavar="DIR",
        help="folder for notebooks/ and figures/ (default: the repository, or build/quick)",
    )
    run.add_argument(
        "--force",
        action="store_true",
        help="execute also what is up to date: same code, executed here, outputs in place",
    )
    run.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="scheduler of a Dask cluster, e.g. tcp://10.0.0.1:8786, that the sweeps run on",
    )
    run.set_defaults(command=_run)

    demo = commands.add_parser(
        "demo",
        help="from three videos to the first equation, in a minute",
        description=DEMO_DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    demo.add_argument("--system", choices=SYSTEMS, default="Lorenz", help="default: Lorenz")
    demo.add_argument("--frames", type=int, default=500, help="per camera (default: 500)")
    demo.add_argument("--seed", type=int, default=0, help="of scenes and noise (default: 0)")
    demo.set_defaults(command=_demo)

    site = commands.add_parser(
        "site",
        help="README, notebooks, figures and reference as web pages",
        description="Write README, notebooks, figures and reference as web pages for offline use.",
    )
    site.add_argument(
        "--output", metavar="DIR", default="build/site", help="folder (default: build/site)"
    )
    site.set_defaults(command=_site)

    compare = commands.add_parser(
        "compare",
        help="two folders of figures, by their numbers",
        description="Compare the numbers of two folders of figures, and lay out what differs.",
        epilog="exit status: 0 if all numbers agree, 1 if not.",
    )
    compare.add_argument("committed", metavar="COMMITTED", help="a folder like figures/")
    compare.add_argument("regenerated", metavar="REGENERATED", help="the same from another run")
    compare.add_argument(
        "--output", metavar="DIR", required=True, help="for both sides, with a page"
    )
    compare.set_defaults(command=_compare)
    return parser


def _run(options: argparse.Namespace) -> int:
    from vidsindy_lite import runner  # papermill takes a second to import; --help need not wait

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
    from vidsindy_lite import discover_from_videos, score
    from vidsindy_lite.experiments import film

    with tempfile.TemporaryDirectory() as folder:
        print(f"filming {options.system}: three videos of {options.frames} frames ...", flush=True)
        shot = film(options.system, folder, options.frames, options.seed)
        found = discover_from_videos(
            shot.paths, shot.rig.uncalibrated(keep=0), shot.t, seed=options.seed, progress=True
        )
    print("the law, in the frame of the cameras:")
    print(found)
    print(f"the same around the origin ({', '.join(f'{value:.4f}' for value in found.offset)}):")
    print(found.equations("native"))
    print(f"against the truth: {score(found, shot.truth)}")
    return 0


def _site(options: argparse.Namespace) -> int:
    from vidsindy_lite.site import build_site

    pages = build_site(options.output)
    print(f"{len(pages)} pages: open {options.output}/index.html")
    return 0


def _compare(options: argparse.Namespace) -> int:
    from vidsindy_lite.compare import side_by_side

    found = side_by_side(options.committed, options.regenerated, options.output)
    for name, place in found.items():
        print(f"{name}: {place}")
    print(f"{len(found)} with other numbers")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
