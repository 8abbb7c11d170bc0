"""Figures of the notebooks and of the report, a function each.

Every function takes what is plotted and returns a matplotlib Figure. The look is that of
``vidsindy.mplstyle``; colours are its cycle, C0 to C6.
"""

from .animation import (
    draw_tour,
)
from .audit import (
    plot_paths,
    plot_ratios,
    plot_recomputed,
    plot_what_l2_sees,
)
from .cameras import (
    plot_calibration_errors,
    plot_in_plane,
    plot_independence,
    plot_lags,
    plot_reconstruction,
    plot_residuals,
    plot_rig,
    plot_rotation_accuracy,
    plot_scale_error,
    plot_tracks,
    plot_view_plane,
)
from .lab import (
    plot_anywhere,
    plot_model_errors,
    plot_orthographic_error,
    plot_table,
)
from .paths import (
    plot_attractors,
    plot_coefficients,
    plot_divergence,
    plot_gaps,
    plot_path,
    plot_sampling,
)
from .robustness import (
    plot_methods,
    plot_pull_distribution,
    plot_pulls,
    plot_robustness,
    plot_shares,
    plot_verdicts,
)
from .solver import (
    plot_basis,
    plot_collocation,
    plot_errors_and_bound,
    plot_histories,
    plot_normal_matrix,
    plot_origin_map,
    plot_ranks,
    plot_windows,
)
from .videos import (
    plot_confidence,
    plot_frames,
    plot_loss,
    plot_track_errors,
    plot_tracker_steps,
    plot_views,
)

__all__ = [
    "draw_tour",
    "plot_anywhere",
    "plot_attractors",
    "plot_basis",
    "plot_calibration_errors",
    "plot_coefficients",
    "plot_collocation",
    "plot_confidence",
    "plot_divergence",
    "plot_errors_and_bound",
    "plot_frames",
    "plot_gaps",
    "plot_histories",
    "plot_in_plane",
    "plot_independence",
    "plot_lags",
    "plot_loss",
    "plot_methods",
    "plot_model_errors",
    "plot_normal_matrix",
    "plot_origin_map",
    "plot_orthographic_error",
    "plot_path",
    "plot_paths",
    "plot_pull_distribution",
    "plot_pulls",
    "plot_ranks",
    "plot_ratios",
    "plot_recomputed",
    "plot_reconstruction",
    "plot_residuals",
    "plot_rig",
    "plot_robustness",
    "plot_rotation_accuracy",
    "plot_sampling",
    "plot_scale_error",
    "plot_shares",
    "plot_table",
    "plot_track_errors",
    "plot_tracker_steps",
    "plot_tracks",
    "plot_verdicts",
    "plot_view_plane",
    "plot_views",
    "plot_what_l2_sees",
    "plot_windows",
]
