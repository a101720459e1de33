from threadpoolctl import threadpool_info

from slipstick.analysis.curve.record import one_thread


def test_linear_algebra_has_one_thread_inside():
    import numpy  # noqa: F401

    with one_thread():
        assert {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"} == {1}
