"""The command line: ``python -m vidsindy_lite run``."""

import argparse
import sys
from collections.abc import Sequence

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


if __name__ == "__main__":
    sys.exit(main())
