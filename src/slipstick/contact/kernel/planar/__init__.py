"""Compiled planar friction: one spring kt in series with a Coulomb circle of radius ``b = mu kn (y - gap)``.

While stuck ``f' = kt w'``; while slipping ``f = b (cos theta, sin theta)`` with ``theta' = kt w'.t / b`` and the slip
velocity ``lambda = w'.n - b'/kt >= 0``, ``n`` along the force and ``t`` across it. Stick is integrated in closed form;
slip by collocation (Radau IIA, ``STAGES`` nodes a panel) between located events; the derivatives are those of the
collocation itself. Sources: B. D. Yang and C. H. Menq (1998) for the circle; E. Hairer and G. Wanner, Solving Ordinary
Differential Equations II (1996), section IV.5, for the method.

A period is marched for its values alone, from a force at its start, until it is periodic. Its pieces are stored, and
derivatives follow from them. Columns of a derivative: ``X1 (L), X2 (L), Y (L), v1, v2, kt, mu, kn, gap``, and the
force at the start of the period ``f1, f2``.

``motion`` holds the element and its pieces, ``slip`` and ``march`` make the pieces, ``resting`` treats contacts that
never slip, ``derivatives`` sums the forces of the pieces, ``elements`` runs batches.
"""
