"""What is recorded of stability: padded, with what is not known as such."""

from collections.abc import Sequence

import numpy as np
from helpers.oscillator import oscillator

from slipstick.results.postprocessing import Postprocessing
from slipstick.results.stability import (
    PIECES,
    UNKNOWN,
    PointStability,
    Unjudged,
    between_known,
    judged,
    ranks,
    stability_sentences,
    stability_values,
    truncated_folds,
)


def test_multipliers_are_padded_and_cut() -> None:
    some = PointStability(multipliers=np.array([-1.2, 0.5 + 0.1j]), unstable=1, method="PW", neutral=2)
    unknown = PointStability(multipliers=np.zeros(0, dtype=complex), unstable=-1, method="", neutral=0)
    found = stability_values([some, unknown, None], 3)
    assert found["multiplier"][0].tolist()[:2] == [[-1.2, 0.0], [0.5, 0.1]]
    assert np.isnan(found["multiplier"][0, 2]).all()
    assert np.isnan(found["multiplier"][1:]).all()
    assert found["stable"].tolist() == [0, -1, -1]
    assert found["unstable_multipliers"].tolist() == [1, -1, -1]
    assert found["multiplier_max"][0] == 1.2
    assert stability_values([some], 1)["multiplier"].shape == (1, 1, 2)


def test_there_is_room_for_all_multipliers_of_a_small_problem() -> None:
    assert ranks(oscillator(1.0)) == ("1", "2", "3")


def test_doubts_are_told_once_with_the_worst_point() -> None:
    values = {"stable": np.array([1, -1, 1]), "hill_pw_difference": np.array([np.nan, 0.001, 0.05])}
    unknown, apart = stability_sentences("omega", np.array([1.0, 2.0, 3.0]), values, "rad/s")
    assert unknown == "stability is not known at 1 of 3 points, the first at omega = 2 rad/s"
    assert apart.startswith(
        "stability: the exact pieces and the harmonic form give multipliers 0.05 apart at omega = 3"
    )
    sound = {"stable": np.array([1, 0]), "hill_pw_difference": np.array([np.nan, 0.001])}
    assert list(stability_sentences("omega", np.array([1.0, 2.0]), sound, "rad/s")) == []


def test_what_is_not_known_is_drawn_as_a_straight_line() -> None:
    assert between_known(np.array([1.0, np.nan, np.nan, 4.0, np.nan])).tolist() == [1.0, 2.0, 3.0, 4.0, 4.0]
    assert np.isnan(between_known(np.full(2, np.nan))).all()


def test_turning_points_that_the_motion_itself_has_not_are_told() -> None:
    """No multiplier is 1 there and as many disturbances grow on both sides; a doubling beside it is taken off."""
    kinds = ["regular", "turning point", "regular", "period doubling", "turning point", "regular"]
    multipliers = np.zeros((6, 2, 2))
    multipliers[:, 0, 0] = 0.8
    assert truncated_folds(kinds, np.array([0, 0, 0, 0, 0, 1]), multipliers) == [1, 4]
    multipliers[1, 0, 0] = 1.001
    assert truncated_folds(kinds, np.array([0, 0, 0, 0, 0, 2]), multipliers) == []
    assert truncated_folds(kinds[:3], np.array([0, 0, UNKNOWN]), 0.9 * multipliers[:3]) == []


def test_what_waits_is_judged_together_and_where_that_fails_each_alone() -> None:
    first, second = (
        PointStability(multipliers=np.array([m + 0j]), unstable=0, method=PIECES, neutral=0) for m in (0.1, 0.2)
    )

    def several(known: Sequence[int]) -> list[PointStability | None]:
        return [second if k == 2 else None for k in known if k or 1 // k]

    def waits(known: int, alone: PointStability | None = None) -> Unjudged:
        return Unjudged(lambda: alone or 1 // 0, several, known)

    postprocessing = Postprocessing()
    assert judged([None, first, waits(2), waits(1, first)], postprocessing) == [None, first, second, first]
    assert not postprocessing.failures
    assert judged([waits(2, first), waits(0)], postprocessing) == [first, None]
    assert [s.split(",")[0] for s in postprocessing.failures] == ["stability is not known at 1 place"]
