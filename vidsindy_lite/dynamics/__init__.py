"""A trajectory goes in, its law comes out.

trajectories -> posing -> problem (smoothing: noise, gaps, units; form: order, candidates, what is
known)
-> solver -> discovery (diagnostics)
solver: `discover`; its stages (search, then polish and settle) use collocation on splines,
selection of terms, origin, gaps, errors that last, precision (whom to trust how far),
process_noise (is the motion kicked?), persistence (which law stays the same while more error is
tolerated?), and settling on that law
discovery: the result; conclusion makes it, with error bars, from the last fit; diagnostics: all its
warnings, of which shape looks at where the motion takes place, beyond at terms that the library
lacks, and elsewhere at other origins; absent: what candidates that are not in the law could be
physics: what a law of motion says of a body, in named numbers
history: how a discovery went
rounds: circles and spheres, whose angles are coordinates; swing: the law of the angle, by itself
storage: the result as a file; drawing: its path of laws as a picture
law: polynomials, on a library of monomials, also of functions of the state; candidates are the
libraries that a user asks for, inputs what is known of the time; integrate solves a law
sindy: the same for code that is written for pysindy
order: first or second, where that is left open
turning: the same in the axes in which the law is sparsest (orientation), where these are unknown
beside the way: cramer_rao, the least errors that any estimate could have
"""

from .library import Library, check_library
from .collocation import Collocation, Status
from .inference import cramer_rao
from .result import Discovery
from .model import Form
from .model import runge_kutta_4
from .library import Function, monomial_exponents, monomial_gradients, monomials, variable_names
from .solver import check_order
from .frames import ShiftedLaw
from .result import Plateau, Swing
from .model import PolynomialSystem
from .problem import FALSE_ALARM, fit_curves, term_penalties
from .mechanics import Round, on_circle, on_sphere
from .l0 import closest_rival, subset_search
from .solver import SplineSINDy
from .smoothing import smooth
from .solver import discover
from .bspline import DEGREE, Segment, clamped_knots, design_matrix, local_basis
from .model import State
from .data import Trajectory, check_trajectory, cut, typical_step
from .solver import check_orientation
from .data import Units
