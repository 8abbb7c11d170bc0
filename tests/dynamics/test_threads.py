"""BLAS threads are what they were, however many discoveries ran at the same time."""

from threading import Barrier, Thread

from threadpoolctl import threadpool_info, threadpool_limits

from vidsindy_lite.dynamics.solver import one_blas_thread


def threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_overlapping_limits_give_back_what_was_there():
    began, second, within = Barrier(2), Barrier(2), []

    def longer():
        began.wait()
        with one_blas_thread():
            second.wait()  # the first one has ended
            within.append(threads())

    def first():
        with one_blas_thread():
            began.wait()
            other.join(0.2)
        second.wait()

    with threadpool_limits(limits=2, user_api="blas"):
        other = Thread(target=longer)
        other.start()
        first()
        other.join()
        assert threads() == {2}
        with one_blas_thread():
            assert threads() == {1}
        assert threads() == {2}
    assert within == [{1}]
