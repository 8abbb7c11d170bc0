"""The scoreboard: benchmarks that others use, and errors that are no white noise.

A contest is data, as a frozen dataclass that says how they are made, and the methods that get
them::

    outcomes = sweep(run_contest, [FlowContest("Lorenz", "drift 0.2 %"), ...])
    table = standings(outcomes)

* `OdeContest`: an equation of ODEBench from one of its two starts;
* `LorenzContest`: a cell of the Lorenz grid, noise against length;
* `FlowContest`: a chaotic flow with one of the `ERRORS` or `MOTIONS`.

All methods get the same samples, the same degree and the defaults; the thresholds of the baselines
are chosen by one rule, without the truth (see `baselines`).

An `Ablation` takes the solver apart: while a contest runs, what does the work of one of its
mechanisms is replaced by what does nothing. So the solver itself needs no switches::

    table = ablation_table(sweep(run_ablation, ablations(contests)))

The 63 equations of ODEBench stand in ``odebench.toml``, typed from their formulas. A polynomial one
is a `PolynomialSystem`, the type of what is found, with coefficients that are formulas of its
parameters; of the others only the right-hand side is known, and no law of a polynomial library can
be right.

References
----------
S. d'Ascoli, S. Becker, A. Mathis, P. Schwaller, N. Kilbertus, ODEFormer: symbolic regression of
dynamical systems with transformers, ICLR 2024.
S. H. Strogatz, Nonlinear Dynamics and Chaos, CRC Press 2018.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import product
from types import CodeType
from typing import TYPE_CHECKING, Any, NamedTuple
from unittest.mock import patch

import numpy as np

from ..arrays import Floats
from ..checks import check_choice
from ..dynamics import Discovery, PolynomialSystem, noise, path, solver
from . import corruption
from .metrics import score
from .paper import FLOWS, Benchmark, read_toml
from .trials import find_law

if TYPE_CHECKING:  # pandas is imported where a frame is made
    from pandas import DataFrame

# --------------------------------------------------------------------------------------- ODEBench

TIMES = np.linspace(0, 10, 512)  #: Of the samples of every equation.

_NAMES = {name: getattr(np, name) for name in ("sin", "cos", "tan", "exp", "log", "abs")}


@dataclass(frozen=True, eq=False)
class Equation:
    """One equation of ODEBench.

    Parameters
    ----------
    number : int
        From 1 to 63.
    name, source : str
    rate : callable
        Time derivative (d,) of a state (d,).
    law : PolynomialSystem or None
        The same as data, if it is a polynomial.
    starts : tuple of tuple of float
        The two initial states.
    """

    number: int
    name: str
    source: str
    rate: Callable[[Floats], Floats]
    law: PolynomialSystem | None
    starts: tuple[tuple[float, ...], ...]

    @property
    def is_cubic(self) -> bool:
        """Is it a polynomial of degree 3 at most?"""
        return self.law is not None and bool(self.law.exponents.sum(axis=1).max() <= 3)


def _value(formula: str | CodeType, values: Mapping[str, Any]) -> Any:
    """Value of a formula of this package's file, for which its names have these values."""
    return eval(formula, {"__builtins__": {}, **_NAMES}, dict(values))


def _equation(number: str, record: Mapping[str, Any]) -> Equation:
    """An equation from its record; a parameter may be a fraction: "8/3"."""
    parameters = {name: _value(str(v), {}) for name, v in record["parameters"].items()}
    law, rates = None, {k: compile(v, k, "eval") for k, v in record.get("rates", {}).items()}
    if "terms" in record:
        law = PolynomialSystem.from_terms({
            variable: {term: _value(text, parameters) for term, text in terms.items()}
            for variable, terms in record["terms"].items()
        })  # fmt: skip

    def rate(x: Floats) -> Floats:
        values = parameters | dict(zip(rates, x, strict=True))
        return np.array([_value(formula, values) for formula in rates.values()])

    starts = tuple(tuple(map(float, start)) for start in record["starts"])
    return Equation(int(number), record["name"], record["source"], law or rate, law, starts)


#: The equations by number.
ODEBENCH: dict[int, Equation] = {
    int(number): _equation(number, record) for number, record in read_toml("odebench.toml").items()
}


#: The law of `baselines.candidates` whose path comes closest to the clean one: what SINDy can do if
#: the truth chooses its threshold and its derivatives.
ORACLE = "SINDy, oracle"
#: Gauss-Newton (`dynamics.discover`), the baselines of the paper's tables, and an oracle. Model-A
#: is SINDy as a careful user has it: derivatives of a smoothing spline.
CONTESTANTS = ("Gauss-Newton", "PySINDy", "E-SINDy", "WeakSINDy", "Model-A", ORACLE)

# --------------------------------------------------------------------------------- kinds of errors

Error = Callable[[Floats, np.random.Generator], Floats]


def _outliers(x: Floats, rng: np.random.Generator) -> Floats:
    return corruption.add_outliers(corruption.add_noise(x, 0.02, rng), 0.02, rng)


#: Errors of a measurement; a percentage is that of the spread (of the signal for noise that grows,
#: of the samples for outliers, of the step for jitter, of the range for bent space).
ERRORS: dict[str, Error] = {
    "white noise 20 %": lambda x, rng: corruption.add_noise(x, 0.2, rng),
    "noise that grows 5 %": lambda x, rng: corruption.add_proportional_noise(x, 0.05, rng),
    "outliers 2 %": _outliers,
    "correlated noise 5 %": lambda x, rng: corruption.add_correlated_noise(x, 0.05, rng),
    "averaged noise 5 %": lambda x, rng: corruption.add_averaged_noise(x, 0.05, rng),
    "64 values": lambda x, rng: corruption.quantise(x, 1 / 64, rng),
    "clock jitter 30 %": lambda x, rng: corruption.jitter(x, 0.3, rng),
    "drift 0.2 %": lambda x, rng: corruption.add_drift(x, 0.002, rng),
    "bent space 0.3 %": lambda x, rng: corruption.distort(x, 0.003, rng),
}

Motion = Callable[[Benchmark, Floats, Floats, np.random.Generator], Floats]


def _coarse(flow: Benchmark, t: Floats, spread: Floats, rng: np.random.Generator) -> Floats:
    atol = 1e-4 * float(spread.min())
    return corruption.coarse_path(flow, t, flow.x0, "RK45", rtol=1e-4, atol=atol)


def _kicked(
    level: float, flow: Benchmark, t: Floats, spread: Floats, rng: np.random.Generator
) -> Floats:
    return corruption.kicked_path(flow, t, flow.x0, level * spread / flow.period**0.5, rng)


#: Motions that are not quite those of the law: a careless integrator, kicks in percent of the
#: spread a period.
MOTIONS: dict[str, Motion] = {
    "coarse steps": _coarse,
    "kicks 1 %": partial(_kicked, 0.01),
    "kicks 5 %": partial(_kicked, 0.05),
}

# --------------------------------------------------------------------------------------- contests


class Data(NamedTuple):
    """What the methods get, and what they cannot see.

    Parameters
    ----------
    t, x : ndarray, shapes (n,) and (n, d)
    degree : int
        Of the candidate terms.
    truth : PolynomialSystem or None
        None if no polynomial is right.
    clean : tuple of ndarray, or None
        Times and states of the motion without errors, if a law is to follow it from its start.
    origin : {"learn", "data"}
        Whether the law's own origin is sought, or known to be that of the data; see `discover`.
    """

    t: Floats
    x: Floats
    degree: int
    truth: PolynomialSystem | None
    clean: tuple[Floats, Floats] | None = None
    origin: str = "learn"


@dataclass(frozen=True)
class OdeContest:
    """An equation of ODEBench, with its noise and its dropped samples.

    Parameters
    ----------
    number : int
        Of the equation.
    start : int
        Which of its two initial states.
    noise : float
        Samples are multiplied by ``1 + noise * normal``.
    dropped : float
        Share of the samples that are left out.
    tight : bool
        Integrated to twelve digits; else as the stored trajectories of the benchmark are.
    methods : tuple of str
        Of `CONTESTANTS`.
    seed : int
    """

    number: int
    start: int = 0
    noise: float = 0.0
    dropped: float = 0.0
    tight: bool = False
    methods: tuple[str, ...] = ("Gauss-Newton",)
    seed: int = 0

    def __post_init__(self) -> None:
        if self.number not in ODEBENCH or self.start not in (0, 1):
            raise ValueError(
                f"number: must be of ODEBench, 1 to {max(ODEBENCH)}, and start 0 or 1, "
                f"got {self.number}, {self.start}"
            )

    @property
    def condition(self) -> str:
        """The same for all that belong to one row of a table."""
        words = ["tight" if self.tight else "stored"]
        words += [f"noise {100 * self.noise:g} %"] if self.noise else []
        words += [f"{100 * self.dropped:g} % dropped"] if self.dropped else []
        return ", ".join(words)

    @property
    def name(self) -> str:
        return f"{self.number} {ODEBENCH[self.number].name}"

    def data(self) -> Data:
        """As the benchmark makes them."""
        equation = ODEBENCH[self.number]
        x0 = equation.starts[self.start]
        if self.tight and equation.law is not None:
            clean = equation.law.simulate(TIMES, np.array(x0))
        else:
            clean = corruption.coarse_path(equation.rate, TIMES, x0)
        rng = np.random.default_rng([self.seed, self.number, self.start])
        kept = np.sort(rng.permutation(len(TIMES))[: round((1 - self.dropped) * len(TIMES))])
        x = corruption.add_proportional_noise(clean[kept], self.noise, rng)
        return Data(TIMES[kept], x, 3, equation.law, (TIMES, clean))


@dataclass(frozen=True)
class LorenzContest:
    """A draw of the Lorenz grid: start (-8, 8, 27), steps of 0.01, degree 2.

    Parameters
    ----------
    length : float
        Time units.
    noise : float
        Standard deviation over that of all coordinates together.
    seed : int
    methods
        See `OdeContest`.
    origin
        See `Data`.
    """

    length: float
    noise: float
    seed: int = 0
    methods: tuple[str, ...] = ("Gauss-Newton",)
    origin: str = "learn"

    def __post_init__(self) -> None:
        check_choice("origin", self.origin, ("learn", "data"))

    @property
    def condition(self) -> str:
        return f"noise {100 * self.noise:g} %"

    @property
    def name(self) -> str:
        return f"{self.length:g} time units"

    def data(self) -> Data:
        law = FLOWS["Lorenz"]
        t = np.arange(round(100 * self.length)) / 100
        clean = law.simulate(t, np.array([-8.0, 8.0, 27.0]))
        rng = np.random.default_rng([self.seed, round(1000 * self.noise), round(100 * self.length)])
        x = clean + self.noise * clean.std() * rng.standard_normal(clean.shape)
        return Data(t, x, 2, law, origin=self.origin)


@dataclass(frozen=True)
class FlowContest:
    """A chaotic flow with errors of one kind, seen from an origin that nobody knows.

    Parameters
    ----------
    flow : str
        Of `FLOWS`.
    error : str
        Of `ERRORS` or `MOTIONS`.
    samples : int
        A hundred a period.
    methods, seed
        See `OdeContest`.
    """

    flow: str
    error: str
    samples: int = 1500
    methods: tuple[str, ...] = ("Gauss-Newton",)
    seed: int = 0

    def __post_init__(self) -> None:
        check_choice("flow", self.flow, FLOWS)
        check_choice("error", self.error, (*ERRORS, *MOTIONS))

    @property
    def condition(self) -> str:
        return self.error

    @property
    def name(self) -> str:
        return self.flow

    def data(self) -> Data:
        flow = FLOWS[self.flow]
        rng = np.random.default_rng([self.seed, *f"{self.flow} {self.error}".encode()])
        t, x = flow.trajectory(self.samples)
        spread = x.std(axis=0)
        if self.error in MOTIONS:
            x = MOTIONS[self.error](flow, t, spread, rng)
        # Up to two standard deviations away, with few digits, the same for all errors.
        place = np.random.default_rng([self.seed, *self.flow.encode()]).uniform(-2, 2, flow.d)
        origin = np.round(place * spread, 2)
        x = x + origin
        return Data(
            t, ERRORS[self.error](x, rng) if self.error in ERRORS else x, 3, flow.shift(origin)
        )


Contest = OdeContest | LorenzContest | FlowContest

# --------------------------------------------------------------------------------------- outcomes


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a method made of a contest.

    Parameters
    ----------
    contest : Contest
    method : str
    law : PolynomialSystem or None
        None if it was refused.
    exact : bool
        Every true term and no other.
    status : str
        ``"ok"``, ``"suspect"`` or ``"refused"``; ``"silent"`` if the method does not say.
    seconds : float
        Of processor time.
    r2 : float
        Of the law's path from the true start, all coordinates together; NaN where nobody asks,
        -inf if it ends.
    """

    contest: Contest
    method: str
    law: PolynomialSystem | None
    exact: bool
    status: str
    seconds: float
    r2: float = np.nan


def run_contest(contest: Contest) -> tuple[Outcome, ...]:
    """Let all methods of a contest find the law.

    Parameters
    ----------
    contest : OdeContest, LorenzContest or FlowContest

    Returns
    -------
    tuple of Outcome
        In the order of the methods.
    """
    data = contest.data()
    return tuple(_outcome(contest, method, data) for method in contest.methods)


def _outcome(contest: Contest, method: str, data: Data) -> Outcome:
    check_choice("methods", method, CONTESTANTS)
    began = time.process_time()
    found: Discovery | PolynomialSystem
    try:
        if method == ORACLE:
            found = _chosen_by_the_truth(data, contest.seed)
        else:
            found = find_law(method, data.t, data.x, None, contest.seed, data.degree, data.origin)
    except ValueError:  # of data that no law can be found from
        return Outcome(contest, method, None, False, "refused", time.process_time() - began)
    seconds = time.process_time() - began
    law = found if isinstance(found, PolynomialSystem) else found.system
    return Outcome(
        contest,
        method,
        law,
        exact=data.truth is not None and score(law, data.truth).exact,
        status="silent" if isinstance(found, PolynomialSystem) else found.status,
        seconds=seconds,
        r2=np.nan if data.clean is None else _r2(law, *data.clean),
    )


def _chosen_by_the_truth(data: Data, seed: int) -> PolynomialSystem:
    from .baselines import candidates  # pysindy takes seconds to import

    if data.clean is None:
        raise ValueError(f"methods: {ORACLE!r} needs a contest that has a clean path")
    times, states = data.clean
    laws = candidates(data.t, data.x, data.degree, seed)

    def merit(law: PolynomialSystem) -> tuple[bool, float]:
        return data.truth is not None and score(law, data.truth).exact, _r2(law, times, states)

    return max(laws, key=merit)


def _r2(law: PolynomialSystem, t: Floats, clean: Floats) -> float:
    """Explained share of the variance of a clean path, by the law's path from the same start."""
    try:
        path = corruption.coarse_path(law, t, clean[0])
    except ValueError:
        return -np.inf
    return float(1 - ((path - clean) ** 2).sum() / ((clean - clean.mean(axis=0)) ** 2).sum())


def standings(outcomes: Iterable[Sequence[Outcome]]) -> DataFrame:
    """Outcomes as a frame, one row each.

    Parameters
    ----------
    outcomes : iterable of sequence of Outcome
        As a sweep of `run_contest` gives them.

    Returns
    -------
    DataFrame
        Columns: condition, name, level (noise and share dropped, of ODEBench), inside (the library
        holds the law), method, exact, status, seconds, r2; and the two ways in which a status can
        be wrong, "wrong, ok" and "exact, doubted".
    """
    import pandas

    return pandas.DataFrame([_row(one) for contest in outcomes for one in contest])


def _row(one: Outcome) -> dict[str, object]:
    contest, level, inside = one.contest, None, True
    if isinstance(contest, OdeContest):
        level, inside = (contest.noise, contest.dropped), ODEBENCH[contest.number].is_cubic
    return {
        "condition": contest.condition,
        "name": contest.name,
        "level": level,
        "inside": inside,
        "method": one.method,
        "exact": one.exact,
        "status": one.status,
        "wrong, ok": not one.exact and one.status == "ok",
        "exact, doubted": one.exact and one.status == "suspect",
        "seconds": one.seconds,
        "r2": one.r2,
    }


# -------------------------------------------------------------------------------------- ablation

NOTHING = "nothing"  #: The solver as it is.


def _first_law_alone(problem: Any, fit: Any, history: Any) -> Any:
    fit = path.polish(problem, fit, history)
    return fit, path.follow(problem, fit), True


def _first_start_alone(problem: Any, fit: Any, history: Any) -> Any:
    return (*path.persistent(problem, fit, history)[:2], True)


#: Of each mechanism, what takes the place of what.
WITHOUT: dict[str, tuple[tuple[Any, str, Any], ...]] = {
    NOTHING: (),
    "support path": ((solver, "persistent", _first_law_alone),),
    "second start": ((solver, "persistent", _first_start_alone),),
    "first tolerance": tuple((where, "TOLERATED", 0.0) for where in (path, noise)),
    "floor for smooth errors": ((path, "SMOOTH", 0.0),),
    "integrated autocorrelation time": ((noise, "effective_noise", noise.residual_noise),
                                        (path, "effective_noise", noise.residual_noise)),
    "errors of the times": ((path, "time_inflation", lambda fit: 1.0),),
    "weights from the smoother": ((noise, "smoother_weights", lambda problem, *_: problem),),
    "noise told by all terms": ((solver, "views", lambda pose: [noise.smoother_weights(pose())]),),
    "process noise": ((solver, "with_process_noise", lambda *_: None),),
    "free offset": ((path, "framed", lambda problem, fit, *_: fit),),
    "richer laws": ((path, "deepest", lambda problem, around, history: around),),
}  # fmt: skip


@dataclass(frozen=True)
class Ablation:
    """A contest without a mechanism.

    Parameters
    ----------
    contest : OdeContest, LorenzContest or FlowContest
        Of whose methods ours alone is asked.
    without : str
        One of `WITHOUT`.
    """

    contest: Contest
    without: str = NOTHING

    def __post_init__(self) -> None:
        check_choice("without", self.without, WITHOUT)


def ablations(contests: Iterable[Contest]) -> Iterator[Ablation]:
    """Every contest without every mechanism, and with all of them."""
    return (Ablation(contest, without) for contest, without in product(contests, WITHOUT))


def run_ablation(task: Ablation) -> tuple[str, Outcome]:
    """Let the solver find the law of a contest without a mechanism.

    Returns
    -------
    without : str
    outcome : Outcome
    """
    with ExitStack() as replaced:
        for module, name, other in WITHOUT[task.without]:
            replaced.enter_context(patch.object(module, name, other))
        (outcome,) = run_contest(task.contest)
    return task.without, outcome


def ablation_table(results: Iterable[tuple[str, Outcome]]) -> DataFrame:
    """Results as a frame, one row a mechanism that is off.

    Parameters
    ----------
    results : iterable of (str, Outcome)
        As a sweep of `run_ablation` gives them.

    Returns
    -------
    DataFrame
        Columns: cases, exact, lost (exact with it and not without), gained (the other way round),
        "wrong, ok", and seconds of processor time together.
    """
    import pandas

    table = pandas.DataFrame([
        {
            "without": without, "contest": one.contest, "cases": 1, "exact": one.exact,
            "wrong, ok": not one.exact and one.status == "ok", "seconds": one.seconds,
        }
        for without, one in results
    ])  # fmt: skip
    whole = table.contest.map(table[table.without == NOTHING].set_index("contest").exact)
    table["lost"], table["gained"] = whole & ~table.exact, ~whole & table.exact
    columns = ["cases", "exact", "lost", "gained", "wrong, ok", "seconds"]
    return table.groupby("without", sort=False)[columns].sum()
