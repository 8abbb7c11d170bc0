"""The paper's world: its systems, what was filmed of them, who found which law, and how well.

::

    systems ----> films -------> trials
    Table S1      three videos,  noise or gaps, one method's law;
                  observed       rows of the paper's tables

* `systems`, `corruption`: the seven benchmarks and other flows; noise and gaps as the paper names
  them, and the errors that measurements have.
* `films`: three videos of a benchmark, and what is observed in them.
* `trials`, `baselines`, `spline_ado`: who finds the law: `discover`, the methods of the paper's
  tables, the paper's own optimiser.
* `metrics`, `cramer_rao`: how good a law is, and could be.
* `scoreboard`, `odebench`: benchmarks that others use, and our solver without each mechanism.
* `published`: what the paper prints, and others of the scoreboard's benchmarks, as data.
* `sweeps`: many tasks in parallel, each computed once.
* `plots`: figures that several notebooks or the report have, and the look of all.

The names below are at hand at once. Modules that need large libraries are imported by name, as in
``from vidsindy_lite.study import baselines, plots``: `baselines` needs pysindy, `spline_ado` torch,
`plots` matplotlib.
"""

from .corruption import add_noise, drop_blocks, drop_fibers
from .films import SAMPLES_PER_PERIOD, FilmTask, film, run_film
from .metrics import Score, pulls, score, term_errors, trajectory_error
from .odebench import ODEBENCH
from .published import ABLATION, DATASETS_CLAIMED, LAB, LAWS, RIVALS, SCORES, SYSTEMS_S1
from .scoreboard import CONTESTANTS, ERRORS, MOTIONS, FlowContest, LorenzContest, OdeContest
from .scoreboard import ablation_table, ablations, run_ablation, run_contest, standings
from .sweeps import sweep
from .systems import FLOWS, REFERENCE_OFFSET, SYSTEMS, Benchmark
from .trials import LEAST, METHODS, Trial, Weights, by_condition, grid, rate, run_trial, run_trials
from .trials import run_weights, significant, summary, tabulate, trial_path
