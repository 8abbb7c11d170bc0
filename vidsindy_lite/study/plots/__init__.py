"""Figures of the notebooks and of the report, a function each.

Every function takes what is plotted and returns a matplotlib Figure. The look is that of
``vidsindy.mplstyle``; colours are its cycle, C0 to C6.
"""

from .animation import draw_tour
from .audit import plot_ratios, plot_recomputed, plot_what_l2_sees
from .cameras import plot_calibration_errors, plot_independence, plot_lags
from .cameras import plot_reconstruction, plot_residuals, plot_rig, plot_rotation_accuracy
from .cameras import plot_scale_error, plot_tracks, plot_view_plane
from .lab import plot_anywhere, plot_model_errors, plot_orthographic_error, plot_table
from .paths import plot_attractors, plot_coefficients, plot_divergence, plot_gaps, plot_in_plane
from .paths import plot_path, plot_sampling
from .robustness import plot_methods, plot_pull_distribution, plot_pulls, plot_robustness
from .robustness import plot_shares, plot_verdicts
from .solver import plot_basis, plot_collocation, plot_errors_and_bound, plot_histories
from .solver import plot_normal_matrix, plot_origin_map, plot_ranks, plot_windows
from .videos import plot_confidence, plot_frames, plot_loss, plot_track_errors, plot_tracker_steps
