"""The paper's world: its systems, what was filmed of them, who found which law, and how well.

::

    paper ------> trials
    Table S1      films: three videos, observed; noise or gaps in them,
                  and one method's law; rows of the paper's tables

* `paper`: what the paper prints, and its seven systems, as data; others of the scoreboard's flows.
* `corruption`: noise and gaps as the paper names them, and the errors that measurements have.
* `trials`: three videos of a benchmark, what is observed in them, and what a method finds in that.
* `baselines`, `spline_ado`: the methods of the paper's tables, the paper's own optimiser.
* `metrics`: how good a law is, and could be.
* `scoreboard`: benchmarks that others use, and our solver without each mechanism.
* `sweeps`: many tasks in parallel, each computed once.
* `plots`: figures that several notebooks or the report have, and the look of all.

The names below are at hand at once. Modules that need large libraries are imported by name, as in
``from vidsindy_lite.study import baselines, plots``: `baselines` needs pysindy, `plots` matplotlib.
"""

from .corruption import add_noise, drop_blocks, drop_fibers
from .metrics import Score, cramer_rao_bound, pulls, score, term_errors, trajectory_error
from .paper import ABLATION, DATASETS_CLAIMED, FLOWS, LAB, LAWS, REFERENCE_OFFSET, RIVALS, SCORES
from .paper import SYSTEMS, SYSTEMS_S1, Benchmark
from .scoreboard import CONTESTANTS, ERRORS, MOTIONS, ODEBENCH, FlowContest, LorenzContest
from .scoreboard import OdeContest, ablation_table, ablations, run_ablation, run_contest, standings
from .sweeps import sweep
from .trials import LEAST, METHODS, SAMPLES_PER_PERIOD, FilmTask, Trial, Weights, by_condition
from .trials import film, grid, rate, run_film, run_trial, run_trials, run_weights, significant
from .trials import summary, tabulate, trial_path
