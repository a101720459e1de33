"""A mass on a belt integrated piece by piece up to located changes of state: nothing of the package is used.

x'' + c x' + x + f = 0 with f = kt (x' - V) integrated in a stick, f = +-mu(|x' - V|) in slip. A state is (x, x', f,
integral of x over time); its side 0 is a stick, +-1 a slip. Period and multiplier are those of the return to the next
largest x, where a state of slip has one coordinate.
"""

import numpy as np
from scipy.integrate import solve_ivp


class Belt:
    def __init__(self, V, mu, slope, *, kt=30.0, c=0.1):
        self.V, self.mu, self.slope, self.kt, self.c = V, mu, slope, kt, c

    def piece(self, side):
        V, kt, c = self.V, self.kt, self.c

        def limit(y):
            return self.mu(abs(y[1] - V))

        if not side:

            def rate(t, y):
                return [y[1], -c * y[1] - y[0] - y[2], kt * (y[1] - V), y[0]]

            return rate, [lambda t, y: limit(y) - y[2], lambda t, y: limit(y) + y[2]]

        def rate(t, y):
            return [y[1], -c * y[1] - y[0] - side * limit(y), 0.0, y[0]]

        def grows(t, y):
            return self.slope(abs(y[1] - V)) * np.sign(y[1] - V) * rate(t, y)[1]

        return rate, [lambda t, y: side * kt * (y[1] - V) - grows(t, y), lambda t, y: side * (y[1] - V)]

    def go(self, y, side, time, stop=None, tolerance=1e-11):
        t, y = 0.0, np.array(y)
        while True:
            rate, events = self.piece(side)
            events += [stop] if stop else []
            for event in events:
                event.direction, event.terminal = -1, True
            s = solve_ivp(rate, (t, time), y, "DOP853", events=events, rtol=tolerance, atol=1e-12, max_step=0.1)
            t, y = s.t[-1], s.y[:, -1].copy()
            if side:
                y[2] = side * self.mu(abs(y[1] - self.V))
            if s.status == 0 or (stop and s.t_events[2].size):
                return t, y, side
            side = 0 if side else 1 if s.t_events[0].size else -1

    def returned(self, x):
        """From a largest x, in slip, to the next: period, state."""
        start = [x, 0.0, -self.mu(self.V), 0.0]
        before, y, side = self.go(start, -1, 0.3)
        t, y, side = self.go(y, side, 60.0, stop=lambda t, y: y[1])
        assert side == -1
        return before + t, y

    def cycle(self, x, step=1e-5):
        """Frequency, largest x over the mean, multiplier of the cycle near a largest x, by Newton's method."""
        for _ in range(20):
            period, y = self.returned(x)
            multiplier = (self.returned(x + step)[1][0] - self.returned(x - step)[1][0]) / (2.0 * step)
            if abs(y[0] - x) < 1e-10:
                break
            x += (y[0] - x) / (1.0 - multiplier)
        return 2.0 * np.pi / period, x - y[3] / period, multiplier
