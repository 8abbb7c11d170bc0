"""Trials as pandas frames: one row a trial, and from these the rows of the paper's tables.

A mean over five trials hangs on the worst of them: tables show medians with the range beside them,
and count by trial, for all methods alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from .trials import CORRUPTIONS, TrialResult

LEAST = 1e-5
"""Relative l2 error below which a few grey levels in the videos decide: tables give it as that."""

if TYPE_CHECKING:  # pandas is imported where a frame is made
    from pandas import DataFrame, Series


def tabulate(results: Iterable[TrialResult]) -> DataFrame:
    """Results of trials as a frame.

    Parameters
    ----------
    results : iterable of TrialResult

    Returns
    -------
    DataFrame
        One row a trial, in the given order. Its columns are the fields of `Trial`, the fields and
        properties of `Score` but for the array, and those of `TrialResult` that are not among
        them: wrong_terms, verdict, law, pulls and so on.
    """
    import pandas

    return pandas.DataFrame([_row(result) for result in results])


def _row(result: TrialResult) -> dict[str, object]:
    fields = vars(result) | vars(result.score) | vars(result.trial)  # "trial" is now its number
    properties = {
        "exact": result.score.exact,
        "max_coefficient_error": result.score.max_coefficient_error,
        "wrong_terms": result.wrong_terms,
        "verdict": result.verdict,
    }
    left_out = ("score", "coefficient_errors")
    return {name: fields[name] for name in fields if name not in left_out} | properties


def by_condition(trials: DataFrame) -> DataFrame:
    """The trials condition by condition, each beginning with level 0: its clean trials.

    Parameters
    ----------
    trials : DataFrame
        See `tabulate`.

    Returns
    -------
    DataFrame
        The clean trials stand in it once for each other condition that there is, by its name.
    """
    import pandas

    clean = trials[trials.condition == "clean"]
    parts = [
        pandas.concat([clean.assign(condition=name), noisy]).sort_values("level", kind="stable")
        for name in CORRUPTIONS
        if len(noisy := trials[trials.condition == name])
    ]
    return pandas.concat(parts, ignore_index=True) if parts else trials[:0]


def summary(trials: DataFrame, by: str | list[str]) -> DataFrame:
    """Repeated trials as rows of the paper's tables, in its units.

    Parameters
    ----------
    trials : DataFrame
        See `tabulate`.
    by : str or list of str
        Columns whose values tell the groups; they are the first columns of the result.

    Returns
    -------
    DataFrame
        One row a group, in the order of their first trials: in how many trials the terms are the
        true ones and no others; wrong terms, missing or false, trial by trial; median and range of
        the relative l2 error, medians of precision and recall; exact laws that are doubted and
        wrong ones that are not, None for methods without a status; trials whose cameras could not
        be learned; processor time of a trial.
        Errors have two significant digits, and one below `LEAST` is given as that: the rest is
        rounding noise.
    """

    def percent(value: float) -> float:
        return significant(100 * max(value, LEAST))

    def count(verdict: str) -> Callable[[Series], int | None]:
        silent = ("None", "refused")
        return lambda v: None if v.str.endswith(silent).all() else int((v == verdict).sum())

    rows = trials.groupby(by, sort=False).agg(
        **{
            "exact": ("exact", rate),
            "wrong terms": ("wrong_terms", lambda values: " ".join(map(str, values))),
            "l2 (e-2)": ("l2", lambda values: percent(values.median())),
            "least": ("l2", lambda values: percent(values.min())),
            "most": ("l2", lambda values: percent(values.max())),
            "precision (%)": ("precision", lambda values: round(100 * values.median(), 2)),
            "recall (%)": ("recall", lambda values: round(100 * values.median(), 2)),
            "exact, doubted": ("verdict", count("exact, suspect")),
            "wrong, ok": ("verdict", count("wrong, ok")),
            "no path": ("verdict", lambda v: int(v.str.endswith("refused").sum())),
            "seconds": ("seconds", "median"),
        }
    )
    rows[["exact, doubted", "wrong, ok"]] = rows[["exact, doubted", "wrong, ok"]].astype(object)
    return rows.reset_index()


def rate(happened: Series) -> str:
    """How often something happened, as text: "4 of 5"."""
    return f"{int(happened.sum())} of {len(happened)}"


def significant(value: float, digits: int = 2, least: float = 0.0) -> float:
    """A number rounded to so many significant digits; what is below the least is given as that."""
    return float(f"{value if abs(value) > least else least:.{digits - 1}e}")
