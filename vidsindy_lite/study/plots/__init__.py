"""Figures of the notebooks and of the report, a function each.

Every function takes what is plotted and returns a matplotlib Figure. The look is that of
``vidsindy.mplstyle``; colours are its cycle, C0 to C6.
"""

from .cameras import plot_anywhere, plot_calibration_errors, plot_independence, plot_lags
from .cameras import plot_model_errors, plot_orthographic_error, plot_reconstruction
from .cameras import plot_residuals, plot_rig, plot_rotation_accuracy, plot_scale_error, plot_table
from .cameras import plot_tracks, plot_view_plane
from .paths import plot_attractors, plot_coefficients, plot_divergence, plot_gaps, plot_in_plane
from .paths import plot_forecast, plot_path, plot_sampling
from .robustness import plot_methods, plot_pull_distribution, plot_pulls, plot_ratios
from .robustness import plot_recomputed, plot_robustness, plot_shares, plot_verdicts
from .robustness import plot_weights, plot_what_l2_sees
from .scoreboard import plot_lorenz_grids, plot_standings
from .solver import plot_asked, plot_basis, plot_collocation, plot_errors_and_bound
from .solver import plot_histories, plot_normal_matrix, plot_origin_map, plot_price, plot_ranks
from .solver import plot_windows
from .videos import draw_tour, plot_confidence, plot_frames, plot_loss, plot_track_errors
from .videos import plot_tracker_steps
