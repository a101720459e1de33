"""Results of an integration in time over many periods: envelope, peak, section, spectra, kind of motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import number, shown, whole
from slipstick.results.saved_table import write_table
from slipstick.results.schema import Declared
from slipstick.results.table import is_dataset
from slipstick.results.view import names_of
from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray

CONTACT_STATES = ("separation", "stick", "slip+", "slip-", "slip")
"""The last one of contacts that slide in a plane."""
VARIABLES: Mapping[str, Declared] = {
    "time": Declared((), "time", "end of the period"),
    "omega": Declared((), "rad/time", "speed of the excitation in the middle of the period"),
    "amplitude": Declared(("dof",), "length", "half of the range of the displacement in the period"),
    "mean": Declared(("dof",), "length", "mean over the period"),
    "highest": Declared(("dof",), "length", "largest displacement in the period"),
    "highest_time": Declared(("dof",), "time", "when that was"),
    "lowest": Declared(("dof",), "length", "smallest displacement in the period"),
    "lowest_time": Declared(("dof",), "time", "when that was"),
    "section_displacement": Declared(("dof",), "length", "displacement at the end of the period (Poincare section)"),
    "section_velocity": Declared(("dof",), "length/time", "velocity at the end of the period"),
    "dissipated_power": Declared(("contact",), "force length/time", "mean power dissipated in the period"),
    "separation_fraction": Declared(("contact",), "1", "fraction of the period in separation"),
    "stick_fraction": Declared(("contact",), "1", "fraction of the period in stick"),
    "slip_fraction": Declared(("contact",), "1", "fraction of the period in slip"),
    "energy_error": Declared(
        (), "1", "what is missing in the energy balance, over all energy stored at the start or turned over since"
    ),
}
"""Variables stored of every period."""
_PHASES = 2000
_FEWEST, _HARMONICS, _SETTLED, _TORUS = 64, 8, 1e-6, 1e-3


class Peak(NamedTuple):
    """The largest amplitude on the way, and the speed at which it was."""

    omega: float
    amplitude: float


class Lag(NamedTuple):
    """A peak passed through against that of the steady curve."""

    omega: float
    amplitude: float
    steady_omega: float
    steady_amplitude: float

    @property
    def shift(self) -> float:
        """How far beyond the steady peak it is, rad/s; < 0 on the way down."""
        return self.omega - self.steady_omega

    @property
    def ratio(self) -> float:
        """Its amplitude over the steady one."""
        return self.amplitude / self.steady_amplitude


@dataclass(frozen=True, kw_only=True)
class MotionKind:
    """What the section of a motion at constant speed says of it.

    Attributes
    ----------
    kind
        "periodic" (with period 1), "subharmonic", "quasi-periodic", or "irregular": chaotic, or not settled yet.
    periods
        Of periodic and subharmonic motion, after how many periods it repeats itself; else 0.
    turns
        Of quasi-periodic motion, how far the second phase turns in a period, from 0 to 1/2; else nan.
    second_omega
        The second frequency, ``turns`` times that of the excitation, rad/s, up to multiples of that and its sign.
    remainder
        Deviation of the section from such a motion, relative to the size of the motion.
    """

    kind: str
    periods: int
    turns: float
    second_omega: float
    remainder: float


class RunUp:
    """An integration in time over many periods, of ``ss.runs.run_up``.

    Parameters
    ----------
    dataset
        As ``run_up.nc`` holds it: per period what ``VARIABLES`` lists; ``displacement`` over ``sample_time``; the exact
        events ``change_time``, ``change_contact``, ``change_before``, ``change_after``.
    """

    def __init__(self, dataset: xarray.Dataset) -> None:
        if not is_dataset(dataset, "section_displacement", "highest_time"):
            raise InputError(f"run-up: found {shown(dataset)}; expected the dataset in run_up.nc")
        self.dataset = dataset

    def __repr__(self) -> str:
        attrs = self.dataset.attrs
        return (
            f"RunUp({self.dataset.sizes['period']} periods, omega {attrs['start']:g} to {attrs['stop']:g}, "
            f"{attrs['outcome_text']})"
        )

    def _dof(self, dof: str | None) -> int:
        known = self.dataset["dof"].to_numpy().tolist()
        if dof is None:
            return 0
        if not isinstance(dof, str) or dof not in known:
            raise InputError(f"there is no output {shown(dof)}; the outputs are {', '.join(known)}")
        return int(known.index(dof))

    def speed(self, time: Array | float) -> Array:
        """Speed of the excitation at times, rad/s."""
        return np.asarray(self.dataset.attrs["start"] + self.dataset.attrs["rate"] * np.asarray(time))

    def envelope(self, dof: str | None = None) -> tuple[Array, Array]:
        """Speeds, rad/s, and half of the distance between the upper and the lower envelope there.

        The envelopes go through the largest and the smallest displacements of the periods, where and when they were;
        an end of a period, where the motion only goes on to its extreme, is none.
        """
        time, size = self._envelope(dof)
        return self.speed(time), size

    def _envelope(self, dof: str | None) -> tuple[Array, Array]:
        from scipy.interpolate import CubicSpline

        d, ends = self._dof(dof), self.dataset["time"].to_numpy()
        length = np.diff(ends, prepend=0.0)
        sides = []
        for name in ("highest", "lowest"):
            at, value = self.dataset[f"{name}_time"].to_numpy()[:, d], self.dataset[name].to_numpy()[:, d]
            inner = (ends - at > 1e-6 * length) & (at - (ends - length) > 1e-6 * length)
            kept = inner if inner.sum() > max(3, len(at) // 2) else np.ones(len(at), dtype=bool)
            sides.append((at[kept], value[kept]))
        (time, high), (other, low) = sides
        if min(len(time), len(other)) < 4:
            return ends, self.dataset["amplitude"].to_numpy()[:, d]
        within = (time >= other[0]) & (time <= other[-1])
        return time[within], 0.5 * (high[within] - CubicSpline(other, low)(time[within]))

    def peak(self, dof: str | None = None) -> Peak:
        """The largest amplitude of the envelope, and the speed at which it was."""
        from scipy.interpolate import CubicSpline

        time, size = self._envelope(dof)
        if len(time) < 4:
            k = int(np.argmax(size))
            return Peak(float(self.speed(time[k])), float(size[k]))
        curve = CubicSpline(time, size)
        at = np.concatenate([time, curve.derivative().roots(extrapolate=False)])
        best = at[int(np.argmax(curve(at)))]
        return Peak(float(self.speed(best)), float(curve(best)))

    def lag(self, branch: Any, dof: str | None = None) -> Lag:
        """The peak passed through against the highest of a steady curve, ``ss.forced_response``, in the same measure:
        half of the range of the displacement."""
        name = str(self.dataset["dof"].to_numpy()[self._dof(dof)])
        steady = branch.peaks(name)
        if not steady:
            raise InputError(f"the steady curve has no peak of {name}: widen its range")
        omega, _ = max(steady, key=lambda own: own[1])
        table, d = branch.table, branch.dof_index(name)
        of = np.flatnonzero(table["peak_dof"].to_numpy() == d)
        k = int(of[np.argmax(table["amplitude"].to_numpy()[of, d])])
        return Lag(*self.peak(dof), float(omega), float(half_range(branch, name)[k]))

    def section(self, dof: str | None = None, last: int | None = None) -> tuple[Array, Array]:
        """Displacement and velocity at the ends of the last periods, a Poincare section; by default of all."""
        d, count = self._dof(dof), self.dataset.sizes["period"]
        kept = slice(count - (count if last is None else min(count, whole("last", last, 1))), None)
        x, v = (self.dataset[name].to_numpy() for name in ("section_displacement", "section_velocity"))
        return x[kept, d], v[kept, d]

    def spectrogram(self, dof: str | None = None, *, window: float | None = None) -> xarray.DataArray:
        """Amplitudes of the motion over frequency and time, by scipy's short-time Fourier transform with a Hann window.

        Parameters
        ----------
        dof
            Name of the dof; by default the first.
        window
            Its length, s; by default that of 16 periods at the lower of the speeds.

        Returns
        -------
        xarray.DataArray
            (frequency, time), frequency in rad/s; a steady harmonic has its amplitude (0-to-peak).
        """
        import xarray
        from scipy.signal import ShortTimeFFT
        from scipy.signal.windows import hann

        x, dt = self._series(dof)
        attrs = self.dataset.attrs
        length = (
            32 * np.pi / min(attrs["start"], attrs["stop"]) if window is None else number("window", window, above=dt)
        )
        size = min(max(8, round(length / dt)), x.size)
        transform = ShortTimeFFT(hann(size, sym=False), max(1, size // 8), 1.0 / dt, scale_to="magnitude")
        low, high = transform.lower_border_end[1], transform.upper_border_begin(x.size)[1]
        low, high = (low, high) if high > low else (transform.p_min, transform.p_max(x.size))
        sizes = np.abs(transform.stft(x - x.mean(), p0=low, p1=high)) * np.where(transform.f > 0, 2.0, 1.0)[:, None]
        times = self.dataset["sample_time"].to_numpy()[0] + np.arange(low, high) * transform.delta_t
        coords = {"frequency": 2 * np.pi * transform.f, "time": times}
        return xarray.DataArray(sizes, coords, ("frequency", "time"), name=f"spectrum of {dof or self._name(0)}")

    def spectrum(self, dof: str | None = None, last: int | None = None) -> tuple[Array, Array]:
        """Frequencies, rad/s, and amplitudes of the last periods, by default of all, with a Hann window."""
        x, dt = self._series(dof)
        if last is not None:
            done = self.dataset["time"].to_numpy()
            begin = done[-min(whole("last", last, 1) + 1, done.size)]
            x = x[self.dataset["sample_time"].to_numpy() >= begin]
        window = np.hanning(x.size)
        sizes = 2.0 * np.abs(np.fft.rfft((x - x.mean()) * window)) / max(window.sum(), 1e-300)
        return np.asarray(2 * np.pi * np.fft.rfftfreq(x.size, dt), dtype=float), np.asarray(sizes, dtype=float)

    def motion(self, dof: str | None = None, last: int = 256) -> MotionKind:
        """What kind of motion the last periods at a constant speed are.

        Raises
        ------
        InputError
            For an integration at a speed that grows, or of fewer than 64 periods.
        """
        if self.dataset.attrs["rate"]:
            raise InputError("the kind of motion is that at a constant speed: integrate there, omega=9.0, periods=500")
        x, v = self.section(dof, last)
        return motion_kind(x, v, float(self.dataset.attrs["start"]), self._size(dof, last))

    def save_table(self, path: str | Path, table: str | None = None) -> Path:
        """Write numbers for other programs and return the path: a .csv file, one table, or .xlsx and .mat, all of them.

        ``table`` chooses: "period" (of a .csv file by default), "sample" (the motion), "change" (of contact states),
        and, made on request for all dofs, "envelope", "spectrum" and "spectrogram".

        Raises
        ------
        InputError
            For another ending or table, where the file cannot be written, and where there are no samples.
        """
        made = {"envelope": self._envelopes, "spectrum": self._spectra, "spectrogram": self._spectrograms}
        return write_table(self.dataset, path, table, made)

    def _names(self) -> list[str]:
        return names_of(self.dataset, "dof")

    def _envelopes(self) -> xarray.Dataset:
        """Envelopes of all dofs one after another: each has its extremes at times of its own."""
        import xarray

        found = [(name, *self._envelope(name)) for name in self._names()]
        time = np.concatenate([at for _, at, _ in found])
        data = {
            "dof": ("row", np.concatenate([[name] * len(at) for name, at, _ in found]).astype(np.str_)),
            "time": ("row", time, self._unit("time")),
            "omega": ("row", self.speed(time), self._unit("omega")),
            "amplitude": ("row", np.concatenate([size for *_, size in found]), self._unit("amplitude")),
        }
        return xarray.Dataset(data, attrs=self.dataset.attrs)

    def _spectra(self) -> xarray.Dataset:
        import xarray

        names = self._names()
        found = [self.spectrum(name) for name in names]
        sizes = ("frequency", "dof"), np.stack([size for _, size in found], axis=1), self._unit("displacement")
        coords = {"frequency": ("frequency", found[0][0], self._unit("omega")), "dof": names}
        return xarray.Dataset({"amplitude": sizes}, coords, self.dataset.attrs)

    def _spectrograms(self) -> xarray.Dataset:
        import xarray

        names = self._names()
        found = [self.spectrogram(name) for name in names]
        sizes = ("frequency", "time", "dof"), np.stack(found, axis=2), self._unit("displacement")
        axes = {"frequency": self._unit("omega"), "time": self._unit("time")}
        coords = {name: (name, found[0][name].to_numpy(), about) for name, about in axes.items()}
        return xarray.Dataset({"amplitude": sizes}, {**coords, "dof": names}, self.dataset.attrs)

    def _unit(self, name: str) -> dict[str, str]:
        return {"units": str(self.dataset[name].attrs.get("units", ""))}

    def _size(self, dof: str | None, last: int) -> float:
        return float(self.dataset["amplitude"].to_numpy()[-last:, self._dof(dof)].max())

    def _name(self, d: int) -> str:
        return str(self.dataset["dof"].to_numpy()[d])

    def _series(self, dof: str | None) -> tuple[Array, float]:
        if "displacement" not in self.dataset or self.dataset.sizes["sample"] < 16:
            raise InputError("there are no samples of the motion: integrate with samples=32")
        time = self.dataset["sample_time"].to_numpy()
        dt = float(np.median(np.diff(time)))
        return self.dataset["displacement"].to_numpy()[:, self._dof(dof)], dt


def time_unit(dataset: xarray.Dataset) -> str:
    """The unit of time as it is read, that of the speeds: "s" also where no units were named."""
    return str(dataset["omega"].attrs.get("units", "rad/s")).removeprefix("rad/")


def half_range(branch: Any, dof: str) -> Array:
    """Half of the range of the displacement of a dof, at every point of a branch, (n_points,)."""
    coefficients = branch.table["displacement"].to_numpy()[:, branch.dof_index(dof)]
    motion = coefficients @ branch.harmonics.H_minus(np.linspace(0.0, 2 * np.pi, _PHASES)).T
    return np.asarray(0.5 * np.ptp(motion, axis=1))


def motion_kind(x: Array, v: Array, omega: float, size: float) -> MotionKind:
    """What a Poincare section, displacement and velocity after each period (n,), says; ``size`` is that of the motion.

    The section of a quasi-periodic motion of two frequencies is a function of one phase that turns by the same angle in
    every period, ``c_0 + sum c_j exp(2 pi i j turns k)``: the angle is that of the largest line of the section's
    spectrum, refined until the sum fits best.
    """
    if len(x) < _FEWEST:
        raise InputError(f"the kind of motion: found {len(x)} periods; expected at least {_FEWEST}")
    points = np.stack([x, v / omega], axis=1)
    size = max(size, 1e-300)
    for p in range(1, 9):
        moved = float(np.abs(points[p:] - points[:-p])[-_FEWEST // 2 :].max()) / size
        if moved < _SETTLED:
            kind = "periodic" if p == 1 else "subharmonic"
            return MotionKind(kind=kind, periods=p, turns=np.nan, second_omega=np.nan, remainder=moved)
    from scipy.optimize import minimize_scalar

    window = np.hanning(len(x))[:, None]
    lines = np.sum(np.abs(np.fft.rfft((points - points.mean(axis=0)) * window, axis=0)) ** 2, axis=1)
    lines[:2] = 0.0
    middle, k = int(np.argmax(lines)) / len(x), np.arange(len(x))

    def remainder(turns: float) -> float:
        angles = 2 * np.pi * turns * np.multiply.outer(k, np.arange(1, _HARMONICS + 1))
        basis = np.hstack([np.ones((len(k), 1)), np.cos(angles), np.sin(angles)])
        left = points - basis @ np.linalg.lstsq(basis, points, rcond=1e-10)[0]
        return float(np.abs(left).max()) / size

    near = np.linspace(middle - 1.0 / len(x), middle + 1.0 / len(x), 41)
    best = near[int(np.argmin([remainder(turns) for turns in near]))]
    step = near[1] - near[0]
    found = minimize_scalar(remainder, bounds=(best - step, best + step), method="bounded", options={"xatol": 1e-12})
    turns, left = float(found.x), float(found.fun)
    if left < _TORUS:
        return MotionKind(kind="quasi-periodic", periods=0, turns=turns, second_omega=turns * omega, remainder=left)
    return MotionKind(kind="irregular", periods=0, turns=np.nan, second_omega=np.nan, remainder=left)
