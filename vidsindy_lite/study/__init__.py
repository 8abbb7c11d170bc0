"""The paper's world: systems, films, trials, baselines, scores."""

from .baselines import BASELINES, ensemble, stlsq
from .corruption import add_noise, drop_fibers
from .metrics import Score, pulls, score, summary, term_errors, trajectory_error
from .paper_ado import discover_paper, stridge
from .published import ABLATION, DATASETS_CLAIMED, LAB, LAWS, SCORES, SYSTEMS_S1
from .realistic import DISTURBANCES, START, SceneTask, run
from .sweeps import sweep
from .systems import REFERENCE_OFFSET, SYSTEMS, Benchmark
from .trials import (
    METHODS,
    SAMPLES_PER_PERIOD,
    FilmTask,
    by_level,
    film,
    grid,
    record,
    run_trial,
    select,
)

__all__ = [
    "ABLATION",
    "BASELINES",
    "Benchmark",
    "DATASETS_CLAIMED",
    "DISTURBANCES",
    "FilmTask",
    "LAB",
    "LAWS",
    "METHODS",
    "REFERENCE_OFFSET",
    "SAMPLES_PER_PERIOD",
    "SCORES",
    "START",
    "SYSTEMS",
    "SYSTEMS_S1",
    "SceneTask",
    "Score",
    "add_noise",
    "by_level",
    "discover_paper",
    "drop_fibers",
    "ensemble",
    "film",
    "grid",
    "pulls",
    "record",
    "run",
    "run_trial",
    "score",
    "select",
    "stlsq",
    "summary",
    "stridge",
    "sweep",
    "term_errors",
    "trajectory_error",
]
