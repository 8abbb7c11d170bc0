"""A trajectory goes in, its law comes out."""

from .collocation import Collocation, Segment, State
from .cramer_rao import cramer_rao
from .discovery import Discovery, Units
from .origin import FrameAlgebra
from .polynomials import (
    PolynomialSystem,
    monomial_exponents,
    monomial_gradients,
    monomials,
    runge_kutta_4,
    variable_names,
)
from .selection import closest_rival, subset_search
from .smoothing import smooth
from .solver import discover, term_charges
from .splines import DEGREE, clamped_knots, design_matrix, local_basis
from .trajectories import Record, check_record, cut, typical_step

__all__ = [
    "Collocation",
    "DEGREE",
    "Discovery",
    "FrameAlgebra",
    "PolynomialSystem",
    "Record",
    "Segment",
    "State",
    "Units",
    "check_record",
    "clamped_knots",
    "closest_rival",
    "cramer_rao",
    "cut",
    "design_matrix",
    "discover",
    "local_basis",
    "monomial_exponents",
    "monomial_gradients",
    "monomials",
    "smooth",
    "runge_kutta_4",
    "subset_search",
    "term_charges",
    "typical_step",
    "variable_names",
]
