"""A branch of solutions: one labelled dataset, and what can be asked of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from slipstick.balance.reduction import reduction_attributes, worst_error
from slipstick.contact.forces import ContactForces, element_forces
from slipstick.contact.law import Motion
from slipstick.errors import InputError, Outcome
from slipstick.faults import MOST_ITEMS, number, one, shown, suggestion, whole, wrong
from slipstick.results.measures import friction_force
from slipstick.results.record import KINDS, Recorder
from slipstick.trig.harmonics import Harmonics

if TYPE_CHECKING:
    import xarray

    from slipstick.balance.problem import Problem
    from slipstick.results.plotting import BranchPlots

Array = NDArray[np.float64]

_ROUNDING = 1e-9

_PARAMETERS = {"kt": "tangential_stiffness", "mu": "friction_coefficient", "kn": "normal_stiffness", "gap": "gap"}


@dataclass(frozen=True, kw_only=True)
class TimeCheck:
    """A point of a branch against time integration, by output dof, both (n_outputs,)."""

    omega: float
    dofs: tuple[str, ...]
    amplitude: Array
    amplitude_in_time: Array
    mean: Array
    mean_in_time: Array
    relative_difference: float
    """Largest difference of amplitudes and zero harmonics over the largest of all of them."""
    converged: bool
    """Whether the time integration became periodic."""
    reduction_error: float | None = None
    """Estimated error of the reduced structure here, which both share: the comparison cannot see it. None: unknown."""


class Branch:
    """Points along a branch.

    Parameters
    ----------
    dataset
        Variables over ``point``, ``dof``, ``coefficient``, ``contact``, each with units and long name; or a function
        that makes it when it is first asked for.
    outcome
        How the computation ended.
    problem
        The problem, where it is known: a branch read from a file has none.
    message
        How it ended in words; by default what the dataset says.
    """

    def __init__(self, dataset: Any, outcome: Outcome, problem: Problem | None = None, message: str = "") -> None:
        if not (callable(dataset) or hasattr(dataset, "data_vars")):
            raise wrong("branch, dataset", dataset, "an xarray.Dataset, or a function that makes one")
        self.outcome = one("branch, outcome", outcome, Outcome, "an ss.Outcome")
        self._source, self.problem, self._message = dataset, problem, message

    def __getstate__(self) -> dict[str, Any]:
        return {"_source": self.dataset, "outcome": self.outcome, "problem": self.problem}

    @cached_property
    def dataset(self) -> xarray.Dataset:
        """All numbers with their labels."""
        dataset: xarray.Dataset = self._source() if callable(self._source) else self._source
        return dataset

    @property
    def message(self) -> str:
        """How it ended: the text of the outcome and, where it stopped early, at which point, contact, temperature."""
        return self._message or str(self.dataset.attrs.get("outcome_text", "")) or self.outcome.text

    @property
    def warnings(self) -> tuple[str, ...]:
        """What could be computed but looked wrong, one sentence each."""
        return tuple(str(self.dataset.attrs.get("warnings", "")).splitlines())

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, problem: Problem | None = None) -> Branch:
        """From a stored dataset; the outcome is read from its attributes."""
        name = str(dataset.attrs.get("outcome", ""))
        outcome = Outcome[name] if name in Outcome.__members__ else Outcome.INTERRUPTED
        if "kind" not in dataset and "kind_code" in dataset:
            dataset = dataset.assign(kind=("point", _kinds(dataset["kind_code"].to_numpy())))
        return cls(dataset, outcome, problem)

    def __len__(self) -> int:
        return int(self.dataset.sizes.get("point", 0))

    def __repr__(self) -> str:
        return f"Branch({len(self)} points, {self.outcome.name.lower()})"

    @property
    def harmonics(self) -> Harmonics:
        """The harmonics kept."""
        labels = [str(label) for label in self.dataset["coefficient"].to_numpy()]
        return Harmonics([0, *(int(label[1:]) for label in labels[1::2])])

    @property
    def followed(self) -> str:
        """Name of the variable that was followed: ``omega`` or ``parameter``."""
        return "parameter" if "parameter" in self.dataset else "omega"

    def peaks(self, dof: str | None = None) -> list[tuple[float, float]]:
        """Local maxima of a dof's amplitude along the branch: (omega or parameter, amplitude).

        ``dof`` is by default the first one. They were located by the solver; those of a linear response are the largest
        among the frequencies that were given.
        """
        d = self._index("dof", dof)
        where, size = self.dataset[self.followed].to_numpy(), self.dataset["amplitude"].to_numpy()[:, d]
        if "peak_dof" in self.dataset:
            at = np.flatnonzero(self.dataset["peak_dof"].to_numpy() == d)
        else:
            at = _largest_nearby(where, size)
        return [(float(w), float(a)) for w, a in zip(where[at], size[at], strict=True)]

    def at(self, value: float) -> int:
        """Number of the first point at a requested frequency or parameter, else of the nearest one."""
        value = number("value", value)
        if not len(self):
            raise InputError(f"the branch has no points; its outcome is: {self.message}")
        return int(np.argmin(np.abs(self.dataset[self.followed].to_numpy() - value)))

    def contact_forces(self, point: int) -> ContactForces:
        """Contact forces at a point, computed again with states and tangents from the dataset alone."""
        d = self._point(point)
        omega = float(d["omega"])
        forces = element_forces(
            self.harmonics,
            d["contact_tangential"].to_numpy() + d["rubbing_motion"].to_numpy(),
            d["contact_normal"].to_numpy() + d["normal_motion"].to_numpy(),
            v=d["rubbing_velocity"].to_numpy() / omega,
            **{key: d[name].to_numpy() for key, name in _PARAMETERS.items()},
        )
        forces.omega = omega
        return forces

    def states(self, point: int) -> dict[str, list[tuple[float, float, str]]]:
        """Intervals (start, end, state) of one period, rad, by contact."""
        names = (str(name) for name in self.dataset["contact"].to_numpy())
        return dict(zip(names, self.contact_forces(point).states, strict=True))

    def loop(self, point: int, contact: str | None = None, *, samples: int = 721) -> dict[str, Array]:
        """One period of a contact, exactly: "tau", "motion" (without rubbing), "total" motion, "friction", "limit".

        Each is (samples,); friction is not the truncated series but the force of the states themselves.
        """
        d = self._point(point)
        c, samples = self._index("contact", contact), whole("samples", samples, 2, MOST_ITEMS)
        h, forces, tau = self.harmonics, self.contact_forces(point), np.linspace(0.0, 2.0 * np.pi, samples)
        X = d["contact_tangential"].to_numpy()[c]
        Y = d["contact_normal"].to_numpy()[c] + d["normal_motion"].to_numpy()[c]
        W, v = X + d["rubbing_motion"].to_numpy()[c], float(d["rubbing_velocity"][c] / d["omega"])
        kt, kn, gap = (float(d[name][c]) for name in ("tangential_stiffness", "normal_stiffness", "gap"))
        mu, H = float(d["friction_coefficient"][c]), h.H_minus(tau)
        force = friction_force(
            h, forces.states[c], tau, W=W, Y=Y, v=v, kt=kt, mu=mu, kn=kn, gap=gap, mean=float(forces.Fx[c, 0])
        )
        limit = mu * kn * np.maximum(H @ Y - gap, 0.0)
        return {"tau": tau, "motion": H @ X, "total": H @ W + v * tau, "friction": force, "limit": limit}

    def thermal_equilibria(self, point: int) -> Any:
        """All thermal equilibria at the motion of a point, of which the branch holds the one next to its neighbours.

        For each contact its ``ElementEquilibria``, or one ``SurfaceEquilibria`` where contacts heat each other
        (``slipstick.thermal.search``). Raises InputError where the problem is not known or nothing is heated.
        """
        d, problem = self._point(point), self._problem_at(point)
        heated = problem.heated
        if heated is None:
            raise InputError("no contact of this branch is heated; give the problem a thermal model")
        batch, given = problem.batches[heated.batch], problem.inputs.batches[heated.batch]
        omega = float(d["omega"])
        Q = tuple(
            d[f"contact_{port}"].to_numpy()[batch.elements] + given.motion[i] for i, port in enumerate(batch.law.ports)
        )
        motion = Motion(self.harmonics, omega, Q, given.velocity / omega)
        return heated.all_equilibria(batch.law, motion, given.values)

    @property
    def plot(self) -> BranchPlots:
        """Figures of this branch; each returns matplotlib Axes."""
        from slipstick.results.plotting import BranchPlots

        return BranchPlots(self)

    def save(self, path: str | Path) -> Path:
        """Write all as netCDF-4 and return the path."""
        from slipstick.io.store import save_dataset

        save_dataset(self.dataset, path)
        return Path(path)

    def check_in_time(self, point: int, **options: Any) -> TimeCheck:
        """Integrate in time from this point and compare: an independent check that cuts off no harmonics.

        Both use the same structure, so an error of its reduction to modes stays unseen: ``reduction_error`` of the
        outcome tells its estimate. Heated contacts keep the parameters they have at this point. ``options`` are those
        of ``slipstick.transient``.
        Raises InputError where the problem is not known.
        """
        from slipstick.analysis.starting import HarmonicStart
        from slipstick.analysis.transient import transient

        d, problem = self._point(point), self._problem_at(point)
        start = HarmonicStart(
            harmonics=problem.harmonics,
            tangential=d["contact_tangential"].to_numpy(),
            normal=d["contact_normal"].to_numpy(),
        )
        held = {name: d[variable].to_numpy() for name, variable in _PARAMETERS.items()}
        result = transient(problem, float(d["omega"]), initial=start, held=held, **options)
        amplitude, mean = d["amplitude"].to_numpy(), d["mean"].to_numpy()
        pairs = ((amplitude, result.amplitude), (mean, result.mean))
        worst = worst_error(problem, [float(d["omega"])])
        size = max(float(np.abs(value).max()) for pair in pairs for value in pair) or 1.0
        return TimeCheck(
            omega=float(d["omega"]),
            dofs=tuple(result.outputs),
            amplitude=amplitude,
            amplitude_in_time=result.amplitude,
            mean=mean,
            mean_in_time=result.mean,
            relative_difference=max(float(np.abs(a - b).max()) for a, b in pairs) / size,
            converged=result.converged,
            reduction_error=None if worst is None or worst.kind == "unknown" else worst.value,
        )

    def _problem_at(self, point: int) -> Problem:
        """The problem with the followed parameter as it is at a point; friction parameters as they are when hot."""
        if self.problem is None:
            raise InputError("this branch was read from a file and has no problem; build it again from its case")
        problem, name = self.problem, str(self.dataset.attrs.get("parameter", ""))
        if name:
            problem = problem.at_parameter(name, float(self.dataset["parameter"][point]))
        return problem

    def _point(self, point: int) -> xarray.Dataset:
        """A point with its contacts; InputError where there is none."""
        if not len(self):
            raise InputError(f"the branch has no points; its outcome is: {self.message}")
        point = whole("point", point, -len(self), len(self) - 1)
        if "contact_tangential" not in self.dataset:
            raise InputError("these results are of a linear response, which holds no contact forces")
        return self.dataset.isel(point=point)

    def _index(self, dim: str, name: str | None) -> int:
        known = [str(label) for label in self.dataset[dim].to_numpy()]
        if name is None and known:
            return 0
        if not isinstance(name, str) or name not in known:
            raise InputError(f"there is no {dim} {shown(name)} in the results; {suggestion(name, known)}")
        return known.index(name)


def _largest_nearby(where: Array, size: Array) -> NDArray[np.intp]:
    """Indices of values above those at the neighbouring places, by more than rounding."""
    order = np.argsort(where, kind="stable")
    a = size[order]
    least = _ROUNDING * np.max(a, initial=0.0)
    return order[1:-1][(a[1:-1] > a[:-2] + least) & (a[1:-1] >= a[2:])]


def _kinds(codes: Array) -> NDArray[np.str_]:
    return np.array([KINDS[int(code)] for code in codes], dtype=np.str_).reshape(len(codes))


def make_dataset(recorder: Recorder, values: Mapping[str, Array], attributes: dict[str, Any]) -> xarray.Dataset:
    """The dataset of a branch from the values of its points, as ``recorder`` gives them."""
    import xarray

    meanings, variables = recorder.meanings, recorder.variables
    describe = {name: {"units": units, "long_name": text} for name, (units, text) in meanings.items()}
    coords: dict[str, Any] = {dim: (dim, list(names), describe[dim]) for dim, names in recorder.labels.items()}
    coords["point"] = ("point", np.arange(len(values["omega"])), describe["point"])
    data: dict[str, Any] = {
        name: (("point", *variables[name]), value, describe[name]) for name, value in values.items()
    }
    meaning = {"units": "1", "long_name": "kind of point"}
    data["kind"] = (("point",), _kinds(values["kind_code"]), meaning)
    return xarray.Dataset(data, coords=coords, attrs=attributes)


def attributes_of(
    problem: Problem, outcome: Outcome, message: str, warnings: Sequence[str] = (), *, parameter: str = "", **more: Any
) -> dict[str, Any]:
    """Attributes of a results dataset: outcome, warnings, versions, title, settings, work."""
    from importlib.metadata import version

    return {
        "title": problem.title,
        "outcome": outcome.name,
        "outcome_text": message or outcome.text,
        "warnings": "\n".join(warnings),
        "harmonics": " ".join(str(m) for m in problem.harmonics.orders),
        "parameter": parameter,
        **reduction_attributes(problem),
        "slipstick_version": version("slipstick"),
        "numpy_version": np.__version__,
        **more,
    }
