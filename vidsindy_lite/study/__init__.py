"""The paper's world: its systems, what was filmed of them, who found which law, and how well.

::

    systems ----> films -------> trials -----------> tables
    Table S1      three videos,  noise or gaps,      one row a trial,
                  observed       one method's law    rows of the paper's tables

* `systems`, `corruption`: the seven benchmarks and other flows; noise and gaps as the paper names
  them, and the errors that measurements have.
* `films`: three videos of a benchmark, and what is observed in them.
* `trials`, `baselines`, `spline_ado`: who finds the law: `discover`, the methods of the paper's
  tables, the paper's own optimiser.
* `metrics`, `cramer_rao`, `tables`: how good a law is, could be, and many of them side by side.
* `scoreboard`, `odebench`, `rivals`: benchmarks that others use, and what they publish of them.
* `ablation`: our solver without each of its mechanisms.
* `published`: the paper's numbers, as data.
* `sweeps`: many tasks in parallel, each computed once.
* `plots`: figures that several notebooks or the report have, and the look of all.

The names below are at hand at once. Modules that need large libraries are imported by name, as in
``from vidsindy_lite.study import baselines, plots``: `baselines` needs pysindy, `spline_ado` torch,
`plots` matplotlib.
"""

from .ablation import ablation_table, ablations, run_ablation
from .corruption import add_noise, drop_blocks, drop_fibers
from .films import SAMPLES_PER_PERIOD, FilmTask, film, run_film
from .metrics import Score, pulls, score, term_errors, trajectory_error
from .odebench import ODEBENCH
from .published import ABLATION, DATASETS_CLAIMED, LAB, LAWS, SCORES, SYSTEMS_S1
from .rivals import LORENZ_GRID, R2_GIVEN, R2_RATES, R2_SOURCE
from .scoreboard import CONTESTANTS, ERRORS, MOTIONS, FlowContest, LorenzContest, OdeContest
from .scoreboard import run_contest, standings
from .sweeps import sweep
from .systems import FLOWS, REFERENCE_OFFSET, SYSTEMS, Benchmark
from .tables import LEAST, by_condition, rate, significant, summary, tabulate
from .trials import METHODS, Trial, Weights, grid, run_trial, run_trials, run_weights, trial_path
