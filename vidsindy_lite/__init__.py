"""Governing equations of a moving target from the videos of several cameras.

::

    video files --vision--> pixel tracks --cameras--> path in space --dynamics--> equations
                                                      and its errors
    `----------------------------------- pipeline ------------------------------------'

`discover_from_videos` goes all the way, and `discover_from_video` of one camera, where the motion
is in a plane; each room can be used by itself. The paper's world
(benchmark systems, trials, baselines, scores) is `vidsindy_lite.study`, what turns the notebooks
into figures and pages is `vidsindy_lite.companion`.
"""

import lazy_loader

__version__ = "0.2.0"

# The names of `__init__.pyi`, imported when they are first used.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
