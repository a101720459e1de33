"""What is given to the balance is a vector space: sums and multiples, part by part."""

import numpy as np
from helpers.problems import random_problem

POINT = random_problem(0).inputs
WAY = random_problem(1).inputs


def arrays(inputs):
    found = {"load": inputs.P}
    for k, batch in enumerate(inputs.batches):
        found |= {f"{k} {name}": value for name, value in batch.values.items()}
        found |= {f"{k} velocity": batch.velocity, f"{k} motion": batch.motion}
    return found


def test_sums_and_multiples():
    a, b = arrays(POINT), arrays(WAY)
    for name, value in arrays(POINT.moved(WAY, 0.3)).items():
        np.testing.assert_allclose(value, a[name] + 0.3 * b[name])
    for name, value in arrays(POINT.moved(WAY, 0.3).moved(WAY, -0.3)).items():
        np.testing.assert_allclose(value, a[name], atol=1e-13 * np.abs(b[name]).max(initial=1.0))
    for name, value in arrays(POINT.scaled(-2.0)).items():
        np.testing.assert_array_equal(value, -2.0 * a[name])


def test_the_parts_add_up_to_the_whole():
    names = ("load", "velocity", "motion", "kt", "mu", "kn", "gap")
    total = POINT.scaled(0.0)
    for name in names:
        part = POINT.only(name)
        assert part.any(name)
        assert not any(part.any(other) for other in names if other != name)
        total = total.moved(part, 1.0)
    for name, value in arrays(total).items():
        np.testing.assert_array_equal(value, arrays(POINT)[name])
    assert not POINT.any("no such parameter")


def test_one_batch_is_changed_alone():
    changed = POINT.with_batch(0, mu=np.zeros(3), velocity=np.ones((2, 3)))
    assert not changed.any("mu")
    np.testing.assert_array_equal(changed.batches[0].velocity, 1.0)
    np.testing.assert_array_equal(changed.batches[0].values["kt"], POINT.batches[0].values["kt"])
    assert POINT.any("mu")
