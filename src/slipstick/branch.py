"""A branch of solutions as users hold it: what can be done with it next.

The facade: each method is one call of a function that takes ``Solutions``, loaded when it is called. Nothing that this
file reaches imports it; analyses make ``Solutions``, and public functions end in ``Branch.of``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

from slipstick.faults import old_names
from slipstick.results.solutions import Solutions
from slipstick.typing import Array, DrawnAxes, Names, Points

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

    from slipstick.analysis.time_domain.check import TimeCheck
    from slipstick.contact.forces import ContactForces
    from slipstick.results.bifurcations import Bifurcation


class Branch(Solutions):
    """Points along a branch.

    Parameters
    ----------
    dataset
        Variables over ``point``, ``dof``, ``coefficient``, ``contact``, each with units and long name; or a
        ``slipstick.results.table.ResultTable``, of which the dataset is made when it is first asked for.
    outcome
        How the computation ended.
    problem
        The problem, where it is known.
    message
        How it ended in words; by default what the dataset says.
    without
        Why the problem is not known, in words.

    Attributes
    ----------
    subharmonics
        Branches of twice the period, where they were followed: see ``follow`` of ``ss.forced_response``. They are
        saved each on its own.
    """

    subharmonics: tuple[Branch, ...]

    @classmethod
    def of(cls, solutions: Solutions) -> Self:
        """Solutions with all that users do next."""
        if isinstance(solutions, cls):
            return solutions
        branch = cls.__new__(cls)
        vars(branch).update(vars(solutions))
        branch.subharmonics = tuple(map(cls.of, solutions.subharmonics))
        return branch

    def _repr_html_(self) -> str:
        from slipstick.results.view import branch_html

        return branch_html(self)

    def on_disc(self, dof: str) -> xarray.DataArray:
        """Amplitudes of a dof of every sector of a disc over (point, sector); those of a wave are all alike.

        Raises
        ------
        InputError
            Where the structure is no disc, or the dof is not in the results at every sector.
        """
        from slipstick.results.disc import amplitude_on_disc

        return amplitude_on_disc(self, dof)

    def bifurcations(self) -> list[Bifurcation]:
        """Points at which the kind of motion changes, in their order along the branch.

        Raises InputError where stability was not asked for.
        """
        from slipstick.results.bifurcations import bifurcations_of

        return bifurcations_of(self)

    @old_names(requested="at")
    def subharmonic(self, point: int, **options: Any) -> Branch:
        """Motion of twice the period, from a point where the period doubles, as a branch of its own.

        Its ``omega`` is half of this one's: loads act at harmonic 2 of it, and the odd harmonics are new. It is
        followed within the range of this branch until the new harmonics vanish. ``options`` are those of
        ``ss.forced_response``; stability is computed unless ``stability=False``.

        Raises InputError where the period does not double there, the problem is not known, or no such motion is found.
        """
        from slipstick.analysis.stability.subharmonics import subharmonic_response

        return self.of(subharmonic_response(self, point, **options))

    def contact_forces(self, point: int) -> ContactForces:
        """Forces of the friction contacts at a point, computed again with states and tangents from the dataset alone.

        Contacts of other laws have nan, and no states. Raises InputError where there is no such point, no friction, or
        values that are not numbers.
        """
        from slipstick.results.contacts import forces_at

        return forces_at(self, point)

    def states(self, point: int) -> dict[str, list[tuple[float, float, str]]]:
        """Intervals (start, end, state) of one period, rad, by contact: as its law gives them.

        The one interval of a contact whose law does not give its states, or is not known, is "unknown". Raises
        InputError where that is all of them.
        """
        from slipstick.results.contacts import states_at

        return states_at(self, point)

    def loop(
        self, point: int, contact: str | None = None, *, samples: int = 721, port: str | None = None
    ) -> dict[str, Array]:
        """One period of a contact along a port, by default the first: "tau", "motion" (without that of the opposing
        surface), "total" motion, "force"; of the friction of a friction contact "friction", the same, and "limit"; of
        each friction force of a planar one "limit", the radius mu fy of the circle.

        Each is (samples,). The force is that of the law at each time, not the truncated series: its area over the
        total motion is the energy dissipated along the port. ``contact`` is by default the first.

        Raises
        ------
        InputError
            If the law does not give its force in time, or is not known: that of a friction contact always is, others
            are known with the problem.
        """
        from slipstick.results.contacts import loop_at

        return loop_at(self, point, contact, samples=samples, port=port)

    def thermal_equilibria(self, point: int) -> Any:
        """All thermal equilibria at the motion of a point, of which the branch holds the one next to its neighbours.

        For each contact its ``ElementEquilibria``, or one ``SurfaceEquilibria`` where contacts heat each other
        (``slipstick.state.thermal.search``). Raises InputError where the problem is not known or nothing is heated.
        """
        from slipstick.results.contacts import equilibria_at

        return equilibria_at(self, point)

    @property
    def plot(self) -> BranchPlots:
        """Figures of this branch; each returns matplotlib Axes."""
        return BranchPlots(self)

    def save(self, path: str | Path) -> Path:
        """Write all as netCDF-4, with the problem, and return the path; ``ss.load`` reads it again.

        Results that are there are replaced, once the new ones are whole. So do ``report``, ``save_table`` and all that
        write, with files of their kind.

        Raises
        ------
        InputError
            If the file cannot be written, or there is one that is no netCDF, such as a case; it stays as it was.

        Warns
        -----
        SlipstickWarning
            Where the problem cannot be stored with the numbers: a law that is a function, a structure of your own.
        """
        from slipstick.io.store import save_branch

        return save_branch(self, path)

    def report(
        self,
        path: str | Path,
        *,
        title: str = "",
        contacts: int = 12,
        dofs: int = 12,
        tolerances: Mapping[str, float] | None = None,
    ) -> Path:
        """Write one self-contained page for any browser and return its path: curves, loops, states, provenance.

        ``contacts`` and ``dofs`` are how many are shown: those that dissipate most, those that move most. The loops
        in the page are exact. What ``tolerances`` such as ``{"damper.mu": 0.2}`` make of the amplitudes is drawn beside
        them. Several branches in one page: ``slipstick.report.write_report``.

        Raises
        ------
        InputError
            If the file cannot be written, or there is one that is no report.
        """
        from slipstick.report.writing import write_report

        return write_report(self, path, title=title, contacts=contacts, dofs=dofs, tolerances=tolerances)

    def save_shape(self, path: str | Path, point: int, *, frames: int = 36) -> Path:
        """Write the moving surface of a body at a point as XDMF and return the path: in ParaView, "Warp By Vector".

        Nodes round each contact show its ``contact_state`` (1 stick, 2 slip, 3 separation, 4 unknown, 0 no contact),
        ``dissipated_power`` and ``worn_depth``; of contacts between two surfaces ``pressure`` and
        ``dissipated_energy`` (a period, per area).

        Raises
        ------
        InputError
            If the file cannot be written, there is no such point, or the structure has no surface: reduced models with
            a mesh have one.
        """
        from slipstick.io.xdmf import write_shape

        return write_shape(self, path, point, frames=frames)

    def save_table(self, path: str | Path, table: str | None = None) -> Path:
        """Write all numbers for other programs and return the path, by its ending: .csv, .xlsx, .mat or .uff.

        A .csv file has a line for each point and columns such as ``displacement.x.c1 [m]``, an .xlsx file (Excel) a
        sheet of it, a .mat file every array under its name. ``table="peaks"`` writes the located peaks of every dof
        instead. A universal file (.uff, .unv) has the response functions of a frequency response, displacement per
        force of each output, as data sets 58; the problem needs one force, on one dof and of one harmonic.

        Raises
        ------
        InputError
            For another ending or table, results without response functions, and where the file cannot be written.
        """
        from slipstick.results.saved_table import write_table_of

        return write_table_of(self, path, table)

    def save_wear(self, path: str | Path) -> Path:
        """Write the worn depth on the surface of a body, a frame for each point of ``ss.wear``, as XDMF; the path.

        Raises
        ------
        InputError
            If the file cannot be written, this is no wear, the structure has no surface, or no contact lies on it.
        """
        from slipstick.io.xdmf import write_wear

        return write_wear(self, path)

    def save_stress(self, path: str | Path, points: Points = None, at: int | Sequence[int] | None = None) -> Path:
        """Write what :meth:`stress` gives for other programs, by the ending, and return the path.

        .xdmf: the chosen elements for ParaView, coloured by the largest von Mises stress, its amplitude, mean and
        alternating stress, a frame for each point. .csv: a line for each point and place. .mat: every array.

        Raises
        ------
        InputError
            For another ending, where the file cannot be written, and as :meth:`stress`.
        """
        from slipstick.io.xdmf import write_stress

        return write_stress(self, path, points, at)

    def sensitivity(
        self,
        parameters: Names = None,
        dof: str | None = None,
        *,
        points: Points = None,
        of: Literal["amplitude", "displacement"] = "amplitude",
    ) -> xarray.Dataset:
        """Exact derivatives by named parameters at every point, and of peaks: where they are and how high.

        Each point takes one factorisation, however many parameters there are. Friction heat is in them: temperatures
        follow. The frequency of limit cycles and nonlinear modes moves with the parameters: it is differentiated too.

        Parameters
        ----------
        parameters
            Names such as "damper.mu", ``"*.mu"``, "load.x.amplitude", "loss_factor", "friction"; by default all of
            every contact pair and load, and the damping of the structure.
        dof
            Name of the output; by default the first.
        points
            Numbers of the points wanted, one or a list; by default all. Negative ones count from the end.
        of
            "amplitude": that, with the mean, the power and the peaks. "displacement": the motion itself.

        Returns
        -------
        xarray.Dataset
            Of the "displacement" its coefficients, ``displacement`` over (parameter, point, coefficient), and ``phase``
            over (parameter, point, harmonic), rad, of ``x = a cos(m tau + phase)``; nan of a harmonic that is 0.

            Of the "amplitude" the derivatives ``amplitude``, ``mean``, ``dissipated_power`` (of all contacts together)
            and, where friction heats the contacts, ``temperature`` (of the hottest) over (parameter, point), at a fixed
            value of what the branch follows; ``peak_amplitude`` and ``peak_omega`` (``peak_parameter``) over
            (parameter, peak), where ``peak`` numbers the points that are located peaks of the dof.

            ``amplitude`` is nan where extremes are equal and part with the parameter, as by the velocity of an opposing
            surface at rest: ``amplitude_above`` and ``amplitude_below`` are the derivatives where the parameter grows
            and where it falls, elsewhere equal to it. All are nan where a state is born, those of a peak where it is a
            corner of the curve; those by the velocity of an opposing surface at rest where its contact is stuck all
            period (the mean force jumps); by ``kt`` at 0; and by what moves the sides of a contact that just touches.

            Of limit cycles also ``omega``, at a fixed value of the parameter followed; all are nan in steady sliding
            and where the cycles rise straight from the Hopf point. Of nonlinear modes ``omega`` and ``modal_damping``,
            at a fixed amplitude of the mode; by parameters of structure and loads these are central differences of the
            equations, to about seven digits. Their ``displacement`` is at a fixed phase of harmonic 1 of the dof.

        Raises
        ------
        InputError
            For an unknown name, a parameter that follows the temperature by its table, and where the problem is not
            known, as of a nonlinear mode from a file: there ``ss.load(path, problem)`` gives it.

        Warns
        -----
        SlipstickWarning
            For each parameter by which there is no derivative at some points, with the reason; and where points have
            none by any.

        Examples
        --------
        >>> import slipstick as ss
        >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
        >>> damper = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
        >>> problem = ss.Problem(structure, contacts=ss.ContactPair(name="damper", tangential="x", contact=damper),
        ...                      loads=ss.Load(dof="x", sin=100.0), harmonics=range(11))
        >>> slopes = ss.forced_response(problem, omega=(10.0, 12.0)).sensitivity(["damper.mu", "damper.kt"])
        >>> slopes["peak_amplitude"].values.round(5).tolist(), slopes["peak_omega"].values.round(5).tolist()
        ([[6.25539], [-0.03195]], [[5.53996], [0.03389]])
        """
        from slipstick.analysis.sensitivity.sensitivity import sensitivity_of

        return sensitivity_of(self, parameters, dof, points=points, of=of)

    def stress(self, points: Points = None, at: int | Sequence[int] | None = None) -> xarray.Dataset:
        """Strain and stress at the elements that were asked for at the reduction, at some points of the branch.

        They are those of the motion under the contact forces and loads of a point, by the modes and what these leave
        out (THEORY.md (10.5)), as the motion itself: that near a contact is in it. Isotropic and elastic, damping left
        out. The static part is that of mean contact forces and constant loads: a contact of constant ``normal_load``
        without a ``normal`` direction does not press on the structure, and the stress of rotation or assembly is not
        known.

        Parameters
        ----------
        points
            Numbers of the points wanted, one or a list; by default all. Negative ones count from the end.
        at
            Numbers of the elements (or nodes, with ``stress_at="nodes"``), one or a list; by default all kept.

        Returns
        -------
        xarray.Dataset
            ``stress`` (force/length^2) and ``strain`` (shear as angles) over (point, place, component, coefficient),
            components xx, yy, zz, xy, yz, zx in the axes of the model, coefficients as those of the displacement:
            ``c_m - i s_m`` is the complex amplitude of ``exp(i m tau)``. Over (point, place): ``von_mises_static`` of
            harmonic 0, ``von_mises_amplitude`` of the vibration about it, ``von_mises_largest`` and
            ``principal_largest``, ``principal_smallest`` over the period. For a Haigh diagram ``stress_alternating``
            and ``stress_mean``: of the two times of the period whose stresses differ most in von Mises stress, half
            that of the difference and that of the mean of both, negative where its trace is. Under tension and
            compression alone these are half the difference and the mean of the largest and the smallest stress.

        Raises
        ------
        InputError
            Where the structure was reduced without ``stress``, the problem is not known, a number is not there, or
            there would be too many.

        Examples
        --------
        A bar of eight elements under 10 N on 4 mm2, held at its other end.

        >>> import slipstick as ss
        >>> from slipstick.fem.box import box
        >>> steel = ss.Material(young=2e5, poisson=0.0, density=7.8e-9)
        >>> from slipstick.importers.mesh_model import MeshModel, assemble_mesh
        >>> bar = MeshModel(mesh=box((20.0, 2.0, 2.0), (2, 2, 2)))
        >>> model = assemble_mesh(bar, source="bar", material=steel, fixed=["x0"])
        >>> body = ss.reduced_body(
        ...     model, surface="x1", contacts=1, pressure="x1", modes=4, loss_factor=1e-3, stress="all"
        ... )
        >>> problem = ss.Problem(body.structure, loads=ss.Load(shape="pressure", cos=-2.5), harmonics=[0, 1])
        >>> stress = ss.linear_response(problem, omega=[100.0]).stress()
        >>> stress.stress.sel(component="xx", coefficient="c1").values.round(4)[0, [0, -1]].tolist()
        [2.5, 2.5]
        """
        from slipstick.results.stress import stress_of

        return stress_of(self, points, at)

    def stress_history(self, point: int, at: int | Sequence[int] | None = None, *, samples: int = 64) -> xarray.Dataset:
        """Strain and stress of :meth:`stress` over a period, at equidistant times.

        ``stress`` and ``strain`` over (place, component, time), ``von_mises`` (place, time) and ``principal``
        (place, time, rank), the largest first. Raises InputError as :meth:`stress`.
        """
        from slipstick.results.stress import stress_history

        return stress_history(self, point, at, samples)

    def check_in_time(self, point: int, **options: Any) -> TimeCheck:
        """Integrate in time from this point and compare: an independent check that cuts off no harmonics.

        An interpolated point is solved for first. Both use the same structure, so an error of its reduction to modes
        stays unseen: ``reduction_error`` of the outcome is its estimate. Heated contacts keep the parameters they
        have at this point. A loss factor becomes viscous damping, equal at each mode's own frequency: away from
        resonances that moves amplitudes, and the difference is no error of the balance. Nor is the force that contacts
        which never slip were left with, which has no one value. ``options`` are those of ``slipstick.transient``.
        Raises InputError where the problem is not known.
        """
        from slipstick.analysis.time_domain.check import check_in_time

        return check_in_time(self, point, **options)


class BranchPlots:
    """Figures of one branch, as ``branch.plot.response("x")``; each returns its Axes.

    Options are those of ``slipstick.plots``.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=10.0)
    >>> foot = ss.ContactPair(name="foot", contact=law, tangential="x")
    >>> problem = ss.Problem(structure, contacts=foot, loads=ss.Load(dof="x", sin=5.0), harmonics=range(6))
    >>> branch = ss.forced_response(problem, (4.0, 14.0))
    >>> axes = branch.plot.response("x")
    >>> axes.get_xlabel(), len(axes.lines[0].get_xdata()) == len(branch)
    ('Fundamental frequency [rad/s]', True)
    """

    def __init__(self, branch: Branch) -> None:
        self._branch = branch

    def __repr__(self) -> str:
        return f"plots of {self._branch!r}: {', '.join(name for name in dir(self) if not name.startswith('_'))}"

    def response(self, dof: Names = None, **options: Any) -> DrawnAxes:
        """Amplitude over the followed quantity."""
        return _plots().response(self._branch, dof, **options)

    def stability(self, **options: Any) -> DrawnAxes:
        """Largest magnitude of a Floquet multiplier, where stability was asked for."""
        return _plots().stability(self._branch, **options)

    def tolerance_band(self, tolerances: Mapping[str, float], dof: str | None = None, **options: Any) -> DrawnAxes:
        """Amplitude with the band that tolerances of parameters make of it, ``{"damper.mu": 0.2}``."""
        return _plots().tolerance_band(self._branch, tolerances, dof, **options)

    def tornado(
        self, tolerances: Mapping[str, float] | None = None, dof: str | None = None, **options: Any
    ) -> DrawnAxes:
        """Which parameters matter most at a point, by default at the highest peak."""
        return _plots().tornado(self._branch, tolerances, dof, **options)

    def phase(self, dof: Names = None, **options: Any) -> DrawnAxes:
        """Phase of a harmonic."""
        return _plots().phase(self._branch, dof, **options)

    def mean(self, dof: Names = None, **options: Any) -> DrawnAxes:
        """Mean of the motion (harmonic 0)."""
        return _plots().mean(self._branch, dof, **options)

    def power(self, contact: Names = None, **options: Any) -> DrawnAxes:
        """Dissipated power, of contacts or all together."""
        return _plots().power(self._branch, contact, **options)

    def friction(self, contact: Names = None, **options: Any) -> DrawnAxes:
        """Friction coefficient."""
        return _plots().friction(self._branch, contact, **options)

    def temperature(self, contact: Names = None, **options: Any) -> DrawnAxes:
        """Contact temperature, where friction heats the contacts."""
        return _plots().temperature(self._branch, contact, **options)

    def wear(self, contact: Names = None, dof: Names = None) -> tuple[Axes, Axes, Axes, Axes]:
        """Worn depth, normal load, amplitude and frequency over cycles, of ``ss.wear``."""
        drawn: tuple[Axes, Axes, Axes, Axes] = _plots().wear(self._branch, contact, dof)
        return drawn

    def worn_surface(self, points: Points = None) -> tuple[Axes, ...]:
        """Worn depth on the surface of a body at some points of ``ss.wear``; bars where the surface is not known."""
        drawn: tuple[Axes, ...] = _plots().worn_surface(self._branch, points)
        return drawn

    def fractions(self, contact: str | None = None, **options: Any) -> DrawnAxes:
        """Fractions of the period in stick, slip and separation."""
        return _plots().fractions(self._branch, contact, **options)

    def loop(self, point: int, contact: Names = None, **options: Any) -> DrawnAxes:
        """Hysteresis loop of a contact at a point: friction force over its vibration, or over="sliding"."""
        return _plots().loop(self._branch, point, contact, **options)

    def loops(self, point: int, contact: Names = None, **options: Any) -> tuple[Axes, Axes]:
        """The loop over the vibration and that over the sliding motion, side by side; of planar contacts both paths."""
        return _plots().loops(self._branch, point, contact, **options)

    def orbit(self, point: int, contact: str | None = None, **options: Any) -> DrawnAxes:
        """Orbit of a rotor in the clearance of its stator, in the colours of its states."""
        return _plots().orbit(self._branch, point, contact, **options)

    def states(self, point: int, contact: Names = None, **options: Any) -> DrawnAxes:
        """States of contacts over a period."""
        return _plots().states(self._branch, point, contact, **options)

    def history(self, point: int, dof: Names = None, **options: Any) -> DrawnAxes:
        """Motion of dofs over a period, or the friction force of ``contact=``."""
        return _plots().history(self._branch, point, dof, **options)

    def spectrum(self, point: int, dof: Names = None, **options: Any) -> DrawnAxes:
        """Harmonics of the motion of dofs, or of the friction force of ``contact=``."""
        return _plots().spectrum(self._branch, point, dof, **options)

    def haigh(self, point: int, at: int | Sequence[int] | None = None, **options: Any) -> DrawnAxes:
        """Alternating over mean stress of elements at a point; with the Goodman line, ``endurance=``, ``strength=``."""
        return _plots().haigh(self._branch, point, at, **options)

    def interface(self, point: int, name: str | None = None) -> tuple[Axes, ...]:
        """Pressure, state, slip and dissipated energy of contacts between two surfaces at a point, as flat maps."""
        drawn: tuple[Axes, ...] = _plots().interface(self._branch, point, name)
        return drawn

    def blades(self, dof: str | None = None, **options: Any) -> DrawnAxes:
        """Amplitudes of a dof of every blade of a disc, and the largest."""
        return _plots().blades(self._branch, dof, **options)

    def disc(self, point: int, dof: str | None = None, **options: Any) -> DrawnAxes:
        """A disc from the front at a point: blades coloured by the amplitude of a dof, as long as its motion."""
        return _plots().disc(self._branch, point, dof, **options)


def _plots() -> Any:
    from slipstick import plots

    return plots
