"""The folder of figures as a whole: its index page, run times, and a check that it adds up."""

from collections.abc import Mapping
from pathlib import Path

from ..stamp import write_file
from .artifacts import INDEX, as_table
from .pages import page
from .records import RUN_TIMES, json_bytes, read_json, read_records

# So that a regeneration adds little to the history, in bytes.
LARGEST_FILE, LARGEST_FOLDER = 600_000, 10_000_000


def files_of(folder: Path, notebook: str) -> list[str]:
    """Names of the files that a notebook's figures and tables consist of."""
    records = [r for r in read_records(folder).values() if r["notebook"] == notebook]
    return [name for record in records for name in _files(record)]


def load_run_times(folder: Path) -> dict[str, float]:
    """Seconds that each notebook ran, two digits: what `record_run_time` has recorded."""
    return {name: entry["seconds"] for name, entry in _run_times(folder).items()}


def record_run_time(folder: Path, notebook: str, stamp: str, seconds: float) -> None:
    """Record how long a notebook ran, unless a run of the same code (stamp) already did."""
    times = _run_times(folder)
    if times.get(notebook, {}).get("stamp") != stamp:
        times[notebook] = {"seconds": float(f"{seconds:.2g}"), "stamp": stamp}
        write_file(folder / RUN_TIMES, json_bytes(dict(sorted(times.items()))))


def write_index(folder: Path) -> Path:
    """Write the folder's index page (README.md, which code hosts show) from the registry."""
    records, times = read_records(folder), load_run_times(folder)
    made: dict[str, list[dict]] = {
        notebook: [record for record in records.values() if record["notebook"] == notebook]
        for notebook in sorted({record["notebook"] for record in records.values()} | set(times))
    }
    tables = {
        name: as_table(record)._repr_markdown_()
        for name, record in records.items()
        if record["kind"] == "table"
    }
    write_file(folder / INDEX, page("registry.md", made=made, times=times, tables=tables).encode())
    return folder / INDEX


def check_folder(folder: Path, stamps: Mapping[str, str | None] | None = None) -> list[str]:
    """What is wrong with a folder of figures; an empty list means nothing.

    Parameters
    ----------
    folder : path
    stamps : mapping of notebook to stamp, optional
        The notebooks there are, each with the stamp that its figures and tables must carry; None
        accepts any. Without the mapping, origins are not checked.

    Returns
    -------
    list of str
        One line per registered file that is missing, file that nothing registers, record of a
        notebook that is not there, record made by other code than the stamp's, file that is too
        large, and SVG that holds a picture of pixels.
    """
    records = read_records(folder).values()
    expected = {INDEX, *(name for record in records for name in _files(record))}
    expected |= {RUN_TIMES} if (folder / RUN_TIMES).exists() else set()
    present = {path.name for path in folder.glob("*") if not path.name.startswith(".")}
    problems = [f"{name}: registered, but missing" for name in sorted(expected - present)]
    problems += [f"{name}: nothing registers it" for name in sorted(present - expected)]
    if stamps is not None:
        problems += [f"{r['id']}: {why}" for r in records if (why := _stale(r, stamps))]
    return problems + _too_large(folder)


def prune(folder: Path, stamps: Mapping[str, str | None]) -> None:
    """Remove the figures and tables that no notebook writes any longer, and their run times.

    Parameters
    ----------
    folder : path
    stamps : mapping of notebook to stamp
        As in `check_folder`: what it would report as made by nobody, or by other code, goes.
    """
    for record in read_records(folder).values():
        if _stale(record, stamps):
            for name in _files(record):
                (folder / name).unlink(missing_ok=True)
    times = _run_times(folder)
    if times.keys() - stamps.keys():
        write_file(folder / RUN_TIMES, json_bytes({n: t for n, t in times.items() if n in stamps}))


# ------------------------------------------------------------------------------------------ details


def _files(record: dict) -> list[str]:
    """Names of the files that a figure or table consists of."""
    return [f"{record['id']}.json", *record["files"]]


def _stale(record: dict, stamps: Mapping[str, str | None]) -> str:
    """Why no notebook makes a figure or table any longer; empty if one does."""
    notebook = record["notebook"]
    if notebook not in stamps:
        return f"no notebook {notebook!r} to make it"
    current = stamps[notebook] in (None, record["stamp"])
    return "" if current else f"{notebook} has changed since it was made"


def _run_times(folder: Path) -> dict[str, dict]:
    """Seconds and stamp by notebook; what is damaged counts as never recorded."""
    entries = read_json(folder / RUN_TIMES).items()
    return {
        notebook: entry
        for notebook, entry in entries
        if isinstance(entry, dict) and isinstance(entry.get("seconds"), int | float)
    }


def _too_large(folder: Path) -> list[str]:
    """What would swell the history."""
    sizes = {path: path.stat().st_size for path in sorted(folder.glob("*")) if path.is_file()}
    problems = []
    for path, size in sizes.items():
        if size > LARGEST_FILE:
            problems.append(f"{path.name}: {size} bytes, at most {LARGEST_FILE}")
        if path.suffix == ".svg" and b"<image" in path.read_bytes():
            problems.append(f"{path.name}: holds a picture of pixels")
    if (total := sum(sizes.values())) > LARGEST_FOLDER:
        problems.append(f"all files: {total} bytes, at most {LARGEST_FOLDER}")
    return problems
