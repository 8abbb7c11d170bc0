"""Which views are of the target and of something like it in one."""

import numpy as np
import pytest

from vidsindy_lite.vision.refining import _BESIDE, joined


@pytest.mark.parametrize("missing", [0, 1])
def test_two_that_meet_and_part_are_one_in_between_if_both_sides_are_seen(missing):
    before, during, after = [100.0] * _BESIDE, [220.0] * 6, [100.0] * (_BESIDE - missing)
    expected = [False] * _BESIDE + [not missing] * 6 + [False] * len(after)
    assert joined(np.array(before + during + after)).tolist() == expected
    assert joined(np.array(after + during + before)).tolist() == expected[::-1]
