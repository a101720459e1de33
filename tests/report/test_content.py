"""What a page holds of a branch."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from helpers.reports import branch, decoded, decoded_coefficients

import slipstick as ss
from slipstick.report.content import content_of
from slipstick.report.encoding import gathered, safe_json
from slipstick.results.peaks import peak_points


@pytest.fixture(scope="module")
def made() -> ss.Branch:
    return branch()


def test_outcome_warnings_and_provenance(made: ss.Branch) -> None:
    data = made.dataset.assign_attrs(note="", warnings="one thing\nanother", case="title = 'x'", seconds=1.25)
    found = content_of(ss.Branch.from_dataset(data), "a", contacts=12, dofs=12)
    assert found["outcome"] == {"name": "COMPLETED", "ok": True, "text": ss.Outcome.COMPLETED.text}
    assert found["warnings"] == ["one thing", "another"]
    assert found["case"] == "title = 'x'"
    about = dict(found["about"])
    assert all(about.values())  # what is empty is not listed
    assert about["seconds"] == "1.25"
    assert about["slipstick version"] == ss.__version__
    assert about["Newton iterations"] == str(int(data["newton_iterations"].sum()))
    assert safe_json(gathered(found)[0])


def test_the_largest_are_kept_in_their_own_order(made: ss.Branch) -> None:
    power = made.dataset["dissipated_power"].max("point").values
    size = made.dataset["amplitude"].max("point").values
    found = content_of(made, "a", contacts=1, dofs=2)
    assert found["contacts"]["names"] == [["joint", "tip"][int(power.argmax())]]
    assert found["contacts"]["count"] == 2
    assert found["dofs"]["names"] == [name for i, name in enumerate("abz") if i != int(size.argmin())]
    assert decoded_coefficients(found["dofs"]["displacement"]).shape == (len(made), 2, 11)
    assert content_of(made, "a", contacts=0, dofs=1)["contacts"]["names"] == []


def test_peaks_are_points_and_places_of_dofs(made: ss.Branch) -> None:
    found = content_of(made, "a", contacts=2, dofs=3)
    of = made.dataset["peak_dof"].values
    assert found["notes"] == [[int(p), int(of[p]), "peak"] for p in peak_points(made.dataset)]
    assert found["notes"]


def test_the_dofs_that_were_asked_for(made: ss.Branch) -> None:
    asked = ss.forced_response(made.problem, omega=(10.0, 11.0), peaks_of="a")
    assert content_of(asked, "a", contacts=2, dofs=3)["asked"] == [0]  # z moves more
    assert content_of(made, "a", contacts=2, dofs=3)["asked"] == [0, 1, 2]
    largest = made.dataset.assign_attrs(peaks_of="b", largest_of="a\nz")  # by default, of more than a few dofs
    assert content_of(ss.Branch.from_dataset(largest), "a", contacts=2, dofs=3)["asked"] == [0, 1, 2]
    tracked = largest.assign_attrs(peak_of="b").assign(parameter=largest["omega"])
    assert content_of(ss.Branch.from_dataset(tracked), "a", contacts=2, dofs=3)["asked"] == [1]


def test_frequencies_in_the_unit_of_the_results(made: ss.Branch) -> None:
    data = made.dataset.assign_attrs(frequency_unit="Hz")
    frequency = content_of(ss.Branch.from_dataset(data), "a", contacts=1, dofs=1)["frequency"]
    assert frequency["unit"] == "Hz"
    assert frequency["factors"]["Hz"] == pytest.approx(1 / (2 * np.pi))
    assert frequency["factors"]["rpm"] == pytest.approx(30 / np.pi)
    slow = made.dataset.assign_attrs(time_unit="ms", frequency_unit="nonsense")
    assert content_of(ss.Branch.from_dataset(slow), "a", contacts=1, dofs=1)["frequency"] == {
        "unit": "rad/ms", "factors": {"rad/ms": 1.0},
    }  # fmt: skip


def test_unstable_stretches_where_they_are_known(made: ss.Branch) -> None:
    assert "unstable" not in content_of(made, "a", contacts=1, dofs=1)
    stable = np.ones(len(made), dtype=int)
    stable[3:5], stable[6] = 0, -1
    data = made.dataset.assign(stable=("point", stable))
    found = content_of(ss.Branch.from_dataset(data), "a", contacts=1, dofs=1)
    verdicts = np.asarray(decoded(found["unstable"]))
    assert [np.flatnonzero(verdicts == own).tolist() for own in (1, 2)] == [[3, 4], [6]]


def test_branches_without_points_or_contacts(made: ss.Branch) -> None:
    none = ss.Branch(made.dataset.isel(point=slice(0, 0)), ss.Outcome.NO_FIRST_POINT)
    found = content_of(none, "a", contacts=12, dofs=12)
    assert (found["points"], found["outcome"]["ok"]) == (0, False)
    assert safe_json(gathered(found)[0])
    linear = ss.linear_response(made.problem, omega=[6.0, 7.0], state="free")
    found = content_of(linear, "b", contacts=1, dofs=1)
    assert found["contacts"]["names"] == []
    assert safe_json(gathered(found)[0])


def test_results_of_something_else() -> None:
    import xarray

    with pytest.raises(ss.InputError, match=r"r\.nc: these results hold no motion of dofs"):
        content_of(ss.Branch(xarray.Dataset(), ss.Outcome.COMPLETED), "r.nc", contacts=1, dofs=1)


def test_results_that_are_not_what_they_say(made: ss.Branch) -> None:
    """A stranger's file: refused with a sentence, or shown without what is missing; never a hang or a fault of ours."""
    data = made.dataset
    for name in map(str, data.data_vars):
        others = [data.drop_vars(name), data.assign({name: data[name].transpose()}), data.assign({name: 1.0})]
        fillings = [np.nan, np.inf, 1e308, -7.0, "a"]
        others += [data.assign({name: (data[name].dims, np.full(data[name].shape, value))}) for value in fillings]
        for other in others:
            with contextlib.suppress(ss.InputError):
                found = content_of(ss.Branch.from_dataset(other), "a", contacts=2, dofs=3)
                assert safe_json(gathered(found)[0])
    for odd in (["x"] * 11, [str(i) for i in range(11)]):
        with pytest.raises(ss.InputError, match="the harmonic coefficients are not named"):
            content_of(ss.Branch.from_dataset(data.assign_coords(coefficient=odd)), "a", contacts=2, dofs=3)
