"""The paper's world: its systems, what was filmed of them, who found which law, and how well.

::

    paper ------> films -------> trials
    Table S1      three videos,  noise or gaps, one method's law;
                  observed       rows of the paper's tables

* `paper`: what the paper prints, and its seven systems, as data; others of the scoreboard's flows.
* `corruption`: noise and gaps as the paper names them, and the errors that measurements have.
* `films`: three videos of a benchmark, and what is observed in them.
* `trials`, `baselines`, `spline_ado`: who finds the law: `discover`, the methods of the paper's
  tables, the paper's own optimiser.
* `metrics`: how good a law is, and could be.
* `scoreboard`: benchmarks that others use, and our solver without each mechanism.
* `sweeps`: many tasks in parallel, each computed once.
* `plots`: figures that several notebooks or the report have, and the look of all.

The names below are at hand at once. Modules that need large libraries are imported by name, as in
``from vidsindy_lite.study import baselines, plots``: `baselines` needs pysindy, `plots` matplotlib.
"""

from .corruption import add_noise, drop_blocks, drop_fibers
from .films import SAMPLES_PER_PERIOD, FilmTask, film, run_film
from .metrics import Score, cramer_rao_bound, pulls, score, term_errors, trajectory_error
from .paper import ABLATION, DATASETS_CLAIMED, FLOWS, LAB, LAWS, REFERENCE_OFFSET, RIVALS, SCORES
from .paper import SYSTEMS, SYSTEMS_S1, Benchmark
from .scoreboard import CONTESTANTS, ERRORS, MOTIONS, ODEBENCH, FlowContest, LorenzContest
from .scoreboard import OdeContest, ablation_table, ablations, run_ablation, run_contest, standings
from .sweeps import sweep
from .trials import LEAST, METHODS, Trial, Weights, by_condition, grid, rate, run_trial, run_trials
from .trials import run_weights, significant, summary, tabulate, trial_path
