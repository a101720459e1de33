// The friction element in closed form (THEORY.md sections 2 and 3), from coefficients, parameters and states.

const PERIOD = 2 * Math.PI;

/** Value at tau of the trigonometric polynomial with coefficients (0, c1, s1, ...) at these orders. */
function series(X, orders, tau) {
  let sum = X[0];
  for (let j = 1; j < orders.length; j++) {
    sum += X[2 * j - 1] * Math.cos(orders[j] * tau) + X[2 * j] * Math.sin(orders[j] * tau);
  }
  return sum;
}

function limitAt(e, tau) {
  return e.mu * e.kn * Math.max(series(e.Y, e.orders, tau) - e.gap, 0);
}

function since(tau, start) {
  const passed = (tau - start) % PERIOD;
  return passed < 0 ? passed + PERIOD : passed;
}

/** Place in the period's intervals, each [start, end, state], of a time. */
function intervalAt(e, tau) {
  for (let k = 0; k < e.states.length; k++) {
    if (since(tau, e.states[k][0]) <= e.states[k][1] - e.states[k][0]) return k;
  }
  return e.states.length - 1;
}

/** Friction force at tau in interval k: at its limit while slipping, else the spring from where the stick began. */
function frictionIn(e, k, tau) {
  const [start, , state] = e.states[k];
  if (state === "separation") return 0;
  if (state === "slip+") return limitAt(e, tau);
  if (state === "slip-") return -limitAt(e, tau);
  if (e.states.length === 1) return e.mean + e.kt * (series(e.W, e.orders, tau) - e.W[0]);
  const before = e.states[(k + e.states.length - 1) % e.states.length][2];
  const sign = before === "slip+" ? 1 : before === "slip-" ? -1 : 0;
  const moved = e.v * since(tau, start) + series(e.W, e.orders, tau) - series(e.W, e.orders, start);
  return sign * limitAt(e, start) + e.kt * moved;
}

function frictionAt(e, tau) {
  return frictionIn(e, intervalAt(e, tau), tau);
}

/** Everything over one period at tau: motion x, total motion x + u, friction, its limit; arrays of one length. */
function period(e, tau) {
  const of = (f) => Float64Array.from(tau, f);
  return {
    tau: Float64Array.from(tau),
    motion: of((t) => series(e.X, e.orders, t)),
    total: of((t) => series(e.W, e.orders, t) + e.v * t),
    friction: of((t) => frictionAt(e, t)),
    limit: of((t) => limitAt(e, t)),
  };
}

/** Pieces [start, end, state, interval] of the period from 0 to 2 pi; an interval over its end is cut in two. */
function pieces(e) {
  const found = [];
  e.states.forEach(([start, end, state], k) => {
    const shift = Math.floor(start / PERIOD) * PERIOD;
    const [a, b] = [start - shift, end - shift];
    found.push([a, Math.min(b, PERIOD), state, k]);
    if (b > PERIOD + 1e-12) found.push([0, b - PERIOD, state, k]);
  });
  return found.sort((p, q) => p[0] - q[0]);
}

/** Equidistant times from a to b, both ends among them. */
function times(a, b, count) {
  return Float64Array.from({ length: count }, (_, i) => a + ((b - a) * i) / (count - 1));
}

/** Coefficients of a function of time by the trapezoidal rule, as amplitudes at each order; the mean first. */
function amplitudes(f, orders) {
  const count = Math.max(1024, 32 * orders[orders.length - 1]);
  const c = new Float64Array(orders.length), s = new Float64Array(orders.length);
  for (let i = 0; i < count; i++) {
    const tau = (PERIOD * i) / count, value = f(tau);
    for (let j = 0; j < orders.length; j++) {
      c[j] += value * Math.cos(orders[j] * tau);
      s[j] += value * Math.sin(orders[j] * tau);
    }
  }
  return orders.map((m, j) => (m === 0 ? c[j] / count : (2 / count) * Math.hypot(c[j], s[j])));
}
