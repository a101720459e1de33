"""What Newton and the continuation ask of a Jacobian: they never see its entries."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from slipstick.typing import Array


@runtime_checkable
class Jacobian(Protocol):
    """A square matrix J (N, N) in whatever form serves it; it is not changed once made."""

    @property
    def size(self) -> int:
        """N."""
        ...

    @property
    def singular(self) -> bool:
        """Whether J is exactly singular: ``solve`` and ``sign`` then have no meaning."""
        ...

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """``J @ x`` or ``J.T @ x`` for x (N,) or (N, k)."""
        ...

    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Solution of ``J @ x = right`` or ``J.T @ x = right`` for right (N,) or (N, k)."""
        ...

    def sign(self) -> int:
        """Sign of the determinant, 1 or -1."""
        ...

    def bound(self, x: Array) -> Array:
        """``|J| @ |x|`` (N,), or more: the sizes of the terms whose sum each entry of ``J @ x`` is."""
        ...

    def bordered(self, column: Array, row: Array) -> Jacobian:
        """J with a further ``column`` (N,) and then a further ``row`` (N + 1,), the corner being the row's last."""
        ...
