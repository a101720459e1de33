"""Base class of contact laws: ports, named parameters, and forces at a multiharmonic motion.

A port is a direction of relative motion with the force along it. Forces act ON the left-hand side of the structure's
equations: they resist the motion (THEORY.md (1.1)). The balance and the analyses use ports and names only, so a new
law is one subclass of ``Law``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import Fault
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, IntArray, Numbers

Key = TypeVar("Key", int, tuple[int, int])

ByPort = Mapping[int, Array]
"""Derivatives of the forces at some ports, (n, L) each; ports left out do not depend on it."""


def add_to(parts: dict[Key, Array], key: Key, part: Array) -> None:
    """Add to the value of a key, or set it; arrays are not changed in place."""
    present = parts.get(key)
    parts[key] = part if present is None else present + part


class Motion(NamedTuple):
    """Relative motion of n elements at the ports of their law, the rubbing motion included."""

    harmonics: Harmonics
    omega: float | Array
    """Fundamental frequency, rad/s; (n,) where the elements belong to different solutions."""
    Q: tuple[Array, ...]
    """Coefficients (n, L) for each port, length; zero where an element does not have the port."""
    drift: Array
    """Constant velocity along each port over omega, (n_ports, n), length per rad."""
    swept: float | Array = 0.0
    """Part of the drift that does not depend on omega, because its velocity is proportional to omega."""


class Placed(NamedTuple):
    """Elements on the ports of a balance, at one motion of all ports or at k of them: (k, count) elements."""

    X: Array
    """Motion of all ports (k, n_ports, L), length."""
    rows: IntArray
    """Port of the balance for each port of the law and each element (n_law_ports, count); -1: none."""
    rubbing: Array
    """Periodic motion of the opposing surface, which is added (n_law_ports, k * count, L), length."""
    velocity: Array
    """Its constant velocity (n_law_ports, k * count), length/time."""
    velocity_per_omega: Array
    """Increase of that velocity with omega (n_law_ports, k * count), length."""
    omega: Array
    """Fundamental frequency of each motion (k,), rad/s."""
    values: Array
    """Parameters (k * count, n_parameters), in the order of ``Law.tabulated``."""


class Response(NamedTuple):
    """Forces of n elements with their exact derivatives, each at fixed other arguments. Ports are counted from 0."""

    force: tuple[Array, ...]
    """Coefficients (n, L) for each port, force, in the order of ``Harmonics``."""
    by_motion: Mapping[tuple[int, int], Array]
    """``(i, j) -> dF_i/dQ_j`` (n, L, L); pairs left out are zero."""
    by_parameter: Callable[[str], ByPort]
    """``name -> {i: dF_i/dname}``."""
    values: Mapping[str, Array]
    """The parameters it was computed with, (n,) each."""
    work: Array
    """Dissipated energy a period over 2 pi, (n,), force x length [THEORY.md (7.1)]."""
    by_drift: Mapping[tuple[int, int], Array] = MappingProxyType({})
    """``(i, j) -> dF_i/ddrift_j`` (n, L)."""
    by_omega: ByPort = MappingProxyType({})
    """``i -> dF_i/domega`` (n, L) at fixed motion and drift: of laws that depend on velocity."""
    detail: Any = None
    """Data of the law itself, such as its states."""


_T = TypeVar("_T")

Interval = tuple[float, float, str]
"""Start and end, rad, and the state between."""


class Linear(NamedTuple):
    """``F_i = sum_j stiffness[i, j] Q_j + constant[i] e1``: a law fixed in one state; missing entries are zero."""

    stiffness: Mapping[tuple[int, int], Array]
    """(n,) each."""
    constant: Mapping[int, Array]
    """(n,) each, on the zero harmonic."""


class Variable(NamedTuple):
    """A results variable of a law: a parameter, or an attribute of ``Response.detail``."""

    source: str
    dims: tuple[str, ...]
    """Dimensions after point and contact."""
    units: str
    long_name: str


class TimeSlopes(NamedTuple):
    """Derivatives of ``Law.rate``, at k motions of n elements each.

    Rows are the forces at the ports, then the rates of the memory; columns are the motions at the ports, the
    velocities, then the memory: (n_ports + n_memory, 2 n_ports + n_memory, n, k).
    """

    values: Array
    force: Array
    """The forces themselves, (n_ports, n, k)."""
    memory_rate: Array
    """(n_memory, n, k)."""


if TYPE_CHECKING:
    from slipstick.contact.quasi_static import Increment
    from slipstick.contact.regimes import Regimes

    def default(function: Callable[[Any], _T]) -> _T:
        """To type checkers it is an attribute, which a subclass may set."""

else:

    class default:
        """A property that a subclass or an instance may replace by an attribute."""

        def __init__(self, function: Callable[[Any], Any]) -> None:
            self._function, self.__doc__ = function, function.__doc__

        def __get__(self, law: Any, owner: Any = None) -> Any:
            return self if law is None else self._function(law)


class Law(ABC):
    """A contact law with its parameters: numbers, or arrays (n,) for n elements.

    A subclass has the attributes ``ports`` and ``values`` and the methods ``changed`` and ``respond``. All else has a
    default. States, forces and rates in time that a law does not give are unknown. They are never taken for those of
    friction, whatever the names of the ports.

    Attributes
    ----------
    ports
        Names of the ports, such as ("tangential", "normal").
    values
        Every parameter by name.
    optional_ports
        Ports that a contact may go without.
    prescribed_ports
        Those of them along which the opposing surface may move all the same.
    surface_ports
        Along which port the opposing surface slides ("tangential") and approaches ("normal") in a ``RubbingMotion``.
        By default it slides along the first port and approaches along one called "normal".
    dissipating
        Numbers of the ports whose force does work over a period; by default all.
    factors
        Names of factors on one parameter of all contacts, such as "friction" on mu.
    derived_parameters
        Names for a parameter times a factor, see ``derived``; each is an attribute too.
    units
        Units of parameters by name; by default "1".
    variables
        Results variables; by default the parameters under their own names.
    linear_states
        States for which ``linear`` gives a first guess, the likeliest first.
    kind
        Laws of equal kind are computed together, as one batch; by default each law is its own.
    force_names
        Names of the forces along the ports; by default those of the ports.
    stiffness_names
        The parameter that is a stiffness along a port, by port.
    memory
        Names of the internal variables of an element: the unknowns of ``rate``, such as ("z",).
    regimes
        Its equations in time if it switches between regimes that are each smooth; ``rate`` is not used then.
    slider_count
        Number of parallel friction contacts that it consists of, as Iwan's joint; ``rate`` is not used then.
    tabulated
        Parameters, in order, of a law that computes its forces by the compiled ``respond_on_ports``; a subclass with a
        ``respond`` of its own has none.
    coulomb
        Whether it is dry friction with the limit ``mu N`` at any velocity: between surfaces that do not move on their
        own it takes energy out, and under a constant normal load mu and the load are one parameter.

    Examples
    --------
    A spring to ground, of stiffness k.

    >>> import numpy as np
    >>> import slipstick as ss
    >>> from slipstick.contact.law import Law, Response
    >>> class Spring(Law):
    ...     ports, units = ("x",), {"k": "force/length"}
    ...     def __init__(self, k):
    ...         self.values = {"k": k}
    ...     def changed(self, **values):
    ...         return Spring(**{**self.values, **values})
    ...     def respond(self, motion, values):
    ...         (x,), k = motion.Q, values["k"][:, None]
    ...         return Response(
    ...             force=(k * x,), by_motion={(0, 0): k[:, :, None] * np.eye(x.shape[1])},
    ...             by_parameter=lambda name: {0: x}, values=values, work=np.zeros(len(x)),
    ...         )
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> spring = ss.ContactPair(name="spring", contact=Spring(60.0), ports={"x": "x"})
    >>> problem = ss.Problem(structure, contacts=spring, loads=ss.Load(dof="x", sin=1.0), harmonics=[0, 1])
    >>> ss.steady_response(problem, omega=5.0).dataset.amplitude.values.round(6)
    array([[0.013329]])
    """

    _scaled: ClassVar[bool] = False
    """Whether no normal stiffness was given, so that its value is a mere scale."""

    if TYPE_CHECKING:
        ports: tuple[str, ...]
        values: Mapping[str, Numbers]

    @default
    def derived_parameters(self) -> tuple[str, ...]:
        """Names for a parameter times a factor."""
        return ()

    @default
    def factors(self) -> Mapping[str, str]:
        """Names of factors on one parameter of all contacts."""
        return {}

    @default
    def units(self) -> Mapping[str, str]:
        """Units of parameters by name."""
        return {}

    @default
    def linear_states(self) -> tuple[str, ...]:
        """States for which ``linear`` gives a first guess."""
        return ("stuck", "free")

    @default
    def stiffness_names(self) -> Mapping[int, str]:
        """The parameter that is a stiffness along a port."""
        return {}

    @default
    def memory(self) -> tuple[str, ...]:
        """Names of the internal variables of an element."""
        return ()

    @default
    def slow(self) -> str | None:
        """Name of the parameter that is the velocity over which friction reverses, length/time; None: it has none."""
        return None

    @default
    def coulomb(self) -> bool:
        """Whether it is dry friction with the limit ``mu N`` at any velocity."""
        return False

    @default
    def tabulated(self) -> tuple[str, ...]:
        """Parameters, in order, of a law that computes its forces by ``respond_on_ports``."""
        return ()

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        if "respond" not in cls.__dict__:
            return
        if "respond_on_ports" not in cls.__dict__:
            # its own ``respond`` is not that of the compiled call that it inherits
            cls.tabulated = ()  # type: ignore[method-assign]
        inherited = next(base.__dict__["kind"] for base in cls.__mro__ if "kind" in base.__dict__)
        if "kind" not in cls.__dict__ and inherited is not Law.__dict__["kind"]:
            # nor is it computed with, or taken for, the laws whose kind it inherits
            cls.kind = default(lambda law: (cls, super(cls, law).kind))  # type: ignore[method-assign,misc]

    @abstractmethod
    def changed(self, **values: Numbers) -> Law:
        """A copy with other parameters."""

    @abstractmethod
    def respond(self, motion: Motion, values: Mapping[str, Array]) -> Response:
        """Forces of n elements whose parameters are ``values``, (n,) each."""

    def respond_on_ports(
        self, harmonics: Harmonics, placed: Placed, on_ports: Array, values: Mapping[str, Array]
    ) -> Response:
        """``respond`` in one compiled call, of a law with ``tabulated`` parameters.

        ``on_ports`` (2, k, n_ports, L) receives the forces on the ports, and their derivatives by omega at fixed
        motion.
        """
        raise NotImplementedError(f"a {type(self).__name__} has no tabulated parameters")

    # in time

    def states(self, motion: Motion, values: Mapping[str, Array]) -> list[list[Interval]] | None:
        """Intervals (start, end, state) of one period of n elements, in rad; None: unknown."""
        del motion, values
        return None

    def smooth_states(self, motion: Motion, values: Mapping[str, Array]) -> list[list[Interval]] | None:
        """``states``, cut also where the slopes of the law jump; None: unknown.

        With it, and ``memory_in_sliding``, multipliers of stick-slip motion follow from the pieces.
        """
        del motion, values
        return None

    def forces_in_time(self, motion: Motion, values: Mapping[str, Array], tau: Array) -> tuple[Array, ...] | None:
        """Forces at phases ``tau`` (k,), (n, k) for each port, not truncated to harmonics; None: unknown."""
        del motion, values, tau
        return None

    def rate(self, q: Array, velocity: Array, memory: Array, values: Mapping[str, Array]) -> tuple[Array, Array] | None:
        """The law in time: forces and rates of the internal variables; None: unknown.

        With it the law is integrated in time (``transient``, ``check_in_time``) and has multipliers (stability). Where
        it jumps it has no slope: multipliers are not known then, see ``regimes``.

        Parameters
        ----------
        q, velocity
            Motion (length) and velocity (length/time) along the ports, (n_ports, n, k) for n elements at k instants;
            the motion of the opposing surface is included, except for its drift at constant velocity in ``q``.
        memory
            Internal variables, (n_memory, n, k); zero where a motion begins.
        values
            Parameters, (n, 1) each.

        Returns
        -------
        tuple
            Forces (n_ports, n, k), and time derivatives of the memory (n_memory, n, k).
        """
        del q, velocity, memory, values
        return None

    def memory_in_sliding(self, q: Array, velocity: Array, values: Mapping[str, Array]) -> Array | None:
        """Internal variables (n_memory, n, k) in steady sliding whose small changes change no force; None: unknown.

        With it self-excited vibration can be computed: eigenvalues of steady sliding leave these variables out.
        Arguments as of ``rate``.
        """
        del q, velocity, values
        return None

    def time_slopes(
        self, q: Array, velocity: Array, memory: Array, values: Mapping[str, Array], scale: tuple[float, float]
    ) -> TimeSlopes:
        """Derivatives of ``rate``, arguments as there; by default central differences.

        ``scale``: sizes of motion and velocity, from which the steps follow; internal variables have their own size.
        """
        returned = self.rate(q, velocity, memory, values)
        assert returned is not None
        columns = []
        for argument, size in ((0, scale[0]), (1, scale[1]), (2, float(np.abs(memory).max(initial=0.0)) or 1.0)):
            step = _DIFFERENCE * size
            for j in range(len((q, velocity, memory)[argument])):
                ends = []
                for way in (step, -step):
                    moved = [q, velocity, memory]
                    moved[argument] = moved[argument].copy()
                    moved[argument][j] += way
                    end = self.rate(moved[0], moved[1], moved[2], values)
                    assert end is not None
                    ends.append(np.concatenate(end))
                columns.append((ends[0] - ends[1]) / (2.0 * step))
        return TimeSlopes(np.stack(columns, axis=1), *returned)

    @default
    def regimes(self) -> Regimes | None:
        """Equations in time of a law that switches; None: it does not switch."""
        return None

    @default
    def in_time(self) -> bool:
        """Whether the law is known in time, by ``rate`` or ``regimes``."""
        if self.regimes is not None or self.slider_count:
            return True
        still = np.zeros((len(self.ports), 1, 1))
        values = {name: np.ravel(np.asarray(value, dtype=float))[:1, None] for name, value in self.values.items()}
        with np.errstate(all="ignore"):
            return self.rate(still, still.copy(), np.zeros((len(self.memory), 1, 1)), values) is not None

    @default
    def rate_remedy(self) -> str:
        """Remedy in messages where the law is needed in time and has no ``rate``."""
        return "give the law the method rate (slipstick.contact.law.Law)"

    @default
    def slider_count(self) -> int:
        """Number of parallel friction contacts along its first port that it consists of, see ``slider_parameters``."""
        return 0

    def slider_parameters(self, values: Mapping[str, Array]) -> tuple[Array, Array]:
        """Stiffness and limit (n, slider_count) of the sliders of n elements.

        In time, and for multipliers, the law is these contacts, which stick and slip one by one.
        """
        raise NotImplementedError

    @default
    def slips_at_once(self) -> bool:
        """Whether a contact may begin to slip at all times at once, so that a curve has a corner of a square root."""
        return False

    def quasi_static(
        self, force: Array, before: Array, after: Array, values: Mapping[str, Array], gap_before: Array | None = None
    ) -> Increment | None:
        """Forces after a slow, straight increment of motion from those before it; None: unknown.

        With it the law can be preloaded (``ss.preload``). Arguments as of ``contact.quasi_static.incremented``.
        """
        del force, before, after, values, gap_before
        return None

    # properties and first guesses

    @default
    def optional_ports(self) -> tuple[str, ...]:
        """Ports that a contact may go without."""
        return ()

    @default
    def prescribed_ports(self) -> tuple[str, ...]:
        """Optional ports along which the opposing surface may move all the same, such as the turning of a rotor."""
        return ()

    @default
    def surface_ports(self) -> Mapping[str, str]:
        """Ports along which the opposing surface slides and approaches."""
        approach = {"normal": "normal"} if "normal" in self.ports else {}
        return {"tangential": self.ports[0], **approach}

    @default
    def dissipating(self) -> tuple[int, ...]:
        """Numbers of the ports whose force does work over a period."""
        return tuple(range(len(self.ports)))

    @default
    def kind(self) -> Hashable:
        """Laws of equal kind are computed together."""
        return id(self)

    @default
    def force_names(self) -> tuple[str, ...]:
        """Names of the forces along the ports."""
        return tuple(self.ports)

    @default
    def variables(self) -> Mapping[str, Variable]:
        """Results variables."""
        return {name: Variable(name, (), self.unit(name), f"parameter {name}") for name in self.values}

    def unit(self, parameter: str) -> str:
        """Units of a parameter."""
        return str(self.units.get(parameter, "1"))

    def stands_for(self, name: str, values: Mapping[str, Array]) -> tuple[str, Numbers] | None:
        """``(parameter, factor)`` where ``name`` is a parameter, or a parameter times a factor, else None."""
        return (name, 1.0) if name in self.values else self.derived(name, values)

    def derived(self, name: str, values: Mapping[str, Array]) -> tuple[str, Numbers] | None:
        """``(parameter, factor)`` where ``parameter = factor * name``, else None."""
        del name, values
        return None

    def linear(self, state: str, values: Mapping[str, Array], drift: Array) -> Linear | None:
        """The law fixed in one state; by default no force ("free"), or the tangent at rest ("stuck")."""
        if state == "free":
            return Linear({}, {})
        if state != "stuck":
            return None
        n, p = drift.shape[1], len(self.ports)
        still = Motion(Harmonics([0]), 1.0, tuple(np.zeros((n, 1)) for _ in range(p)), np.zeros((p, n)))
        response = self.respond(still, values)
        return Linear(
            {key: tangent[:, 0, 0] for key, tangent in response.by_motion.items()},
            {i: force[:, 0] for i, force in enumerate(response.force)},
        )

    def ramps(self, values: Mapping[str, Array]) -> Iterator[tuple[str, str, float]]:
        """Label, parameter and starting fraction of the ramps towards a first point; by default each from 0."""
        del values
        return ((f"{name} ramp", name, 0.0) for name in self.values)

    def size(self, values: Mapping[str, Array]) -> Array:
        """Typical motion set by the law itself, (n,); zero where it has none."""
        del values
        return np.zeros(1)

    def widened(self, narrow: Harmonics, wide: Harmonics) -> Law:
        """The law for forces in more harmonics than the motion has; by default itself."""
        del narrow, wide
        return self

    def springs(self, response: Response) -> Mapping[int, Array]:
        """Effective stiffness (n,) at each port, by which the rounding of the forces is estimated."""
        total: dict[int, Array] = {}
        for (i, _), tangent in response.by_motion.items():
            add_to(total, i, np.abs(tangent).max(axis=(1, 2)))
        return total

    def undecided(self, response: Response) -> NDArray[np.bool_]:
        """Elements whose mean force is indeterminate and jumps with any steady sliding, (n,) of bool."""
        return np.zeros(len(response.work), dtype=bool)

    def kinked(self, values: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Elements with active friction, (n,) of bool: their forces have kinks and many harmonics."""
        return np.zeros(len(next(iter(values.values()), ())), dtype=bool)

    def warnings(self, values: Mapping[str, float], ports: set[str], approach: float) -> Iterator[str]:
        """Sentences on suspicious parameters of a contact; ``approach`` is the largest of its opposing surface."""
        del values, ports, approach
        return iter(())

    def missing(self, ports: set[str]) -> Iterator[Fault]:
        """Parameters that were not given, but are needed where something moves along these ports."""
        del ports
        return iter(())


_DIFFERENCE = 1e-6
"""Step of central differences over the size of the argument: near the cube root of the rounding."""
