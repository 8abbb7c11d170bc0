"""A trajectory goes in, its law comes out: `discover` in `solver` reads as the method does.

::

    prepare   `data` (checked trajectories, units), `bspline` (smoothed curves), `problem` (standard
              units, penalties), `noise` (variance components: errors that last, process noise)
    path      `collocation` (splines and a law, fitted by banded Gauss-Newton steps), `l0` (which
              terms a quadratic model needs), `frames` (the origin in which a law is sparsest),
              `path` (a first law at a large tolerated error, its support path, the law that
              persists, the refit)
    infer     `inference` (error bars, the law in the frame of the data), `result` (`Discovery`)
    diagnose  `diagnostics` (each warning in words)
    below     `library` (candidate terms), `model` (systems, their integration, what a law may look
              like)
    beside    `orientation` (axes in which a law is sparsest), `mechanics` (what a law says of a
              body), `homogeneous` (of one flight, the law that is the same at every place)
"""

from .data import Trajectory, Units, check_trajectory, cut, typical_step, variable_names
from .bspline import DEGREE, Segment, clamped_knots, design_matrix, local_basis, smooth
from .library import Function, Library, check_library, monomial_exponents, monomials, shift_matrix
from .model import Form, PolynomialSystem, runge_kutta_4
from .collocation import Collocation, State, Status
from .problem import FALSE_ALARM, fit_curves, term_penalties
from .l0 import closest_rival, subset_search
from .orientation import check_orientation
from .mechanics import Quantity, Round, on_circle, on_sphere
from .homogeneous import homogeneous
from .result import Discovery, Swing
from .diagnostics import CLOSE
from .solver import check_order, discover
