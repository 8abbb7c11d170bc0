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
homogeneous: of one flight, the law that is the same at every place, if there is one
turning: the same in the axes in which the law is sparsest (orientation), where these are unknown
beside the way: cramer_rao, the least errors that any estimate could have
"""

from .candidates import Library, check_library
from .collocation import Collocation, Status
from .cramer_rao import cramer_rao
from .discovery import Discovery
from .form import Form
from .homogeneous import homogeneous
from .integrate import runge_kutta_4
from .library import Function, monomial_exponents, monomial_gradients, monomials, variable_names
from .order import check_order
from .origin import ShiftedLaw
from .persistence import Plateau
from .physics import Quantity
from .polynomials import PolynomialSystem
from .problem import FALSE_ALARM, fit_curves, term_penalties
from .rounds import Round, on_circle, on_sphere
from .selection import closest_rival, subset_search
from .sindy import SplineSINDy
from .shape import is_on_circle
from .smoothing import smooth
from .solver import discover
from .splines import DEGREE, Segment, clamped_knots, design_matrix, local_basis
from .state import State
from .swing import LIBRARY as SWINGS
from .swing import Swing, swinging
from .trajectories import Trajectory, check_trajectory, cut, typical_step
from .turning import check_orientation
from .units import Units
