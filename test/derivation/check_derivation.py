#!/usr/bin/python3
"""Checks docs/model.md by computer algebra, independently of the C++ code.

The equations of motion are derived twice, from the free body and from a Lagrangian with a dissipation function, and
compared with the corrected equations (10)-(12) of the paper. Every correction is then undone alone, to show which law
the printed form breaks. Prints a table; exit status 1 if anything disagrees. Needs sympy (and mpmath, which comes with it).
"""

import random
import sys
import time
from itertools import combinations

import mpmath
import sympy as sp

START = time.monotonic()
ROWS = []


def check(what, holds, note=""):
    ROWS.append((bool(holds), what, note))


# --- Symbols: three cars, all different. Car 2 is the typical one, 1 and 3 are the ends. -------------------------------

CARS = (1, 2, 3)
COUPLERS = ((1, 2), (2, 3))


def per_car(name, **assumptions):
    return {k: sp.Symbol(f"{name}{k}", real=True, **assumptions) for k in CARS}


x, y, theta = per_car("x"), per_car("y"), per_car("theta")
vx, vy, omega = per_car("vx"), per_car("vy"), per_car("omega")
M, I, L, D, load = (per_car(n, positive=True) for n in ("M", "I", "L", "D", "N"))  # N = mu W / 2
eps = sp.Symbol("v_eps", positive=True)

F = {c: sp.Symbol("F%d%d" % c, real=True) for c in COUPLERS}        # axial force, buff positive: -dU_axial/dG
m_rear = {k: sp.Symbol(f"mR{k}", real=True) for k in (1, 2)}        # dU_m/dgamma at the rear end of car k
m_front = {k: sp.Symbol(f"mF{k}", real=True) for k in (2, 3)}       # dU_m/dgamma at its front end


def axis(k):
    return sp.Matrix([sp.cos(theta[k]), sp.sin(theta[k])])


def centre(k):
    return sp.Matrix([x[k], y[k]])


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def rate(vector):
    """Time derivative of a function of the coordinates."""
    pairs = [(q[k], v[k]) for q, v in ((x, vx), (y, vy), (theta, omega)) for k in CARS]
    return sum((vector.diff(q) * v for q, v in pairs), sp.zeros(*vector.shape))


pin_front = {k: centre(k) + L[k] / 2 * axis(k) for k in CARS}       # eq. (1)
pin_rear = {k: centre(k) - L[k] / 2 * axis(k) for k in CARS}        # eq. (2)
truck = {(k, side): centre(k) + sign * D[k] / 2 * axis(k) for k in CARS for side, sign in (("F", 1), ("R", -1))}

bar = {(j, k): pin_rear[j] - pin_front[k] for j, k in COUPLERS}     # from the trail car's pin to the lead car's
G = {c: sp.sqrt(bar[c].dot(bar[c])) for c in COUPLERS}              # eqs. (8), (9)
beta = {c: sp.atan2(bar[c][1], bar[c][0]) for c in COUPLERS}        # eqs. (6), (7) with two arguments

# Proof of an identity: once every derivative is taken, the bars' components, the lengths G, the trucks' speeds and the
# cosines are given names of their own; what is left is a rational function that must cancel.
BAR_X, BAR_Y, GAP = ({c: sp.Symbol(f"{n}{c[0]}{c[1]}", real=True) for c in COUPLERS} for n in ("bx", "by", "G"))
COS, SIN = per_car("c"), per_car("s")
TRIG = {f(theta[k]): n[k] for f, n in ((sp.cos, COS), (sp.sin, SIN)) for k in CARS}
SPEED = {}  # filled below


def vanishes(expression):
    e = sp.sympify(expression).subs(TRIG)
    (a, b), (c, d) = COUPLERS
    e = e.subs({x[a]: BAR_X[a, b] + x[b] + L[a] / 2 * COS[a] + L[b] / 2 * COS[b],
                y[a]: BAR_Y[a, b] + y[b] + L[a] / 2 * SIN[a] + L[b] / 2 * SIN[b],
                x[d]: x[c] - BAR_X[c, d] - L[c] / 2 * COS[c] - L[d] / 2 * COS[d],
                y[d]: y[c] - BAR_Y[c, d] - L[c] / 2 * SIN[c] - L[d] / 2 * SIN[d]}, simultaneous=True)
    for p in COUPLERS:
        e = e.subs(sp.sqrt(BAR_X[p] ** 2 + BAR_Y[p] ** 2), GAP[p]).subs(BAR_X[p] ** 2 + BAR_Y[p] ** 2, GAP[p] ** 2)
    e = e.subs(SPEED)
    e = sp.expand(sp.numer(sp.together(sp.expand(e))))
    e = sp.expand(e.subs({GAP[p]: sp.sqrt(BAR_X[p] ** 2 + BAR_Y[p] ** 2) for p in COUPLERS}))
    return sp.simplify(e) == 0


# --- Truck velocities: eqs. (4), (5) -----------------------------------------------------------------------------------

u = {(k, s): vx[k] - g * D[k] / 2 * omega[k] * sp.sin(theta[k]) for k in CARS for s, g in (("F", 1), ("R", -1))}
v = {(k, s): vy[k] + g * D[k] / 2 * omega[k] * sp.cos(theta[k]) for k in CARS for s, g in (("F", 1), ("R", -1))}
check("(4), (5) are the velocities of the truck centres, u along x, v along y",
      all(vanishes(e) for t in truck for e in rate(truck[t]) - sp.Matrix([u[t], v[t]])))

# --- Ground force as the code has it: -N (u, v) / sqrt(u^2 + v^2 + v_eps^2) --------------------------------------------

speed = {t: sp.sqrt(u[t] ** 2 + v[t] ** 2 + eps ** 2) for t in truck}
SPEED.update({speed[t].subs(TRIG): sp.Symbol("S%d%s" % t, positive=True) for t in truck})
ground = {t: -load[t[0]] * sp.Matrix([u[t], v[t]]) / speed[t] for t in truck}

# --- Lateral force of the bar: eq. (14) from the bar's own balance -----------------------------------------------------

E = {(j, k): (m_rear[j] + m_front[k]) / G[j, k] for j, k in COUPLERS}


def bar_balance(j, k, lateral):
    """Sum of moments on the bar about the trail car's pin; it feels the opposite of what it does to the cars."""
    b = bar[j, k] / G[j, k]
    on_lead = F[j, k] * b + lateral * sp.Matrix([b[1], -b[0]])
    return cross(bar[j, k], -on_lead) - m_rear[j] - m_front[k]


check("(14) E = (m_rear + m_front) / G, and no other, keeps the massless bar in balance",
      all(vanishes(bar_balance(j, k, E[j, k])) and not vanishes(bar_balance(j, k, -E[j, k])) for j, k in COUPLERS))

force_on_lead = {c: F[c] * bar[c] / G[c] + E[c] * sp.Matrix([bar[c][1], -bar[c][0]]) / G[c] for c in COUPLERS}


def from_free_body(k):
    """M x'', M y'', I theta'' of car k: sum of forces, sum of moments about the centre."""
    force, moment = sp.zeros(2, 1), sp.Integer(0)
    for side in ("F", "R"):
        force += ground[k, side]
        moment += cross(truck[k, side] - centre(k), ground[k, side])
    for lead, trail in COUPLERS:
        if k == lead:
            force += force_on_lead[lead, trail]
            moment += cross(pin_rear[k] - centre(k), force_on_lead[lead, trail]) + m_rear[k]
        if k == trail:
            force -= force_on_lead[lead, trail]
            moment += cross(pin_front[k] - centre(k), -force_on_lead[lead, trail]) + m_front[k]
    return [force[0], force[1], moment]


def from_lagrangian(k):
    """Generalised forces -dU/dq - dR/dq' with U = U_axial(G) + U_m(gamma_rear) + U_m(gamma_front) by the chain rule
    (F = -dU_axial/dG, m = dU_m/dgamma, gamma = beta - theta) and R = N sqrt(|v_truck|^2 + v_eps^2) a truck."""
    rows = []
    for q, q_dot in ((x[k], vx[k]), (y[k], vy[k]), (theta[k], omega[k])):
        total = sp.Integer(0)
        for j, i in COUPLERS:
            gamma_rear, gamma_front = beta[j, i] - theta[j], beta[j, i] - theta[i]
            total += F[j, i] * G[j, i].diff(q) - m_rear[j] * gamma_rear.diff(q) - m_front[i] * gamma_front.diff(q)
        dissipation = sum(load[t[0]] * speed[t] for t in truck)
        rows.append(total - dissipation.diff(q_dot))
    return rows


# --- The corrected equations (10)-(12), as a list of signed terms in the paper's notation -----------------------------

def paper_terms(k):
    """{name of term: expression} a row; angles stand as the paper has them: alpha by its sine and cosine, F_F = N f."""
    rows = [{}, {}, {}]

    def angle_parts(vector, length):
        return vector[0] / length, vector[1] / length

    def sin_minus(c, s):  # sin(theta_k - angle), the angle given by its cosine and sine
        return sp.sin(theta[k]) * c - sp.cos(theta[k]) * s

    def cos_minus(c, s):
        return sp.cos(theta[k]) * c + sp.sin(theta[k]) * s

    for pair, sign, end, m in (((k, k + 1), 1, "k,k+1", m_rear), ((k - 1, k), -1, "k-1,k", m_front)):
        if pair not in F:
            continue
        c, s = angle_parts(bar[pair], G[pair])
        rows[0][f"F_C {end} cos beta"] = sign * F[pair] * c
        rows[0][f"E_C {end} sin beta"] = sign * E[pair] * s
        rows[1][f"F_C {end} sin beta"] = sign * F[pair] * s
        rows[1][f"E_C {end} cos beta"] = -sign * E[pair] * c
        rows[2][f"m of coupler {end}"] = m[k]
        rows[2][f"F_C {end} sin(theta - beta)"] = L[k] / 2 * F[pair] * sin_minus(c, s)
        rows[2][f"E_C {end} cos(theta - beta)"] = L[k] / 2 * E[pair] * cos_minus(c, s)
    for side, sign in (("F", 1), ("R", -1)):
        c, s = angle_parts(sp.Matrix([u[k, side], v[k, side]]), speed[k, side])
        rows[0][f"F_{side} cos alpha"] = -load[k] * c
        rows[1][f"F_{side} sin alpha"] = -load[k] * s
        rows[2][f"F_{side} sin(theta - alpha)"] = sign * D[k] / 2 * load[k] * sin_minus(c, s)
    return rows


LABEL = ("(10)", "(11)", "(12)")
free_body = {k: from_free_body(k) for k in CARS}
lagrangian = {k: from_lagrangian(k) for k in CARS}
terms = {k: paper_terms(k) for k in CARS}
for r in range(3):
    check(f"{LABEL[r]} corrected = free body, cars 1, 2, 3",
          all(vanishes(sum(terms[k][r].values()) - free_body[k][r]) for k in CARS))
    check(f"{LABEL[r]} corrected = Lagrangian with dissipation function, cars 1, 2, 3",
          all(vanishes(sum(terms[k][r].values()) - lagrangian[k][r]) for k in CARS))

# Negative control: with any one sign turned round, or any one term left out, the comparison must fail.
rng = random.Random(2007)
generic = {s: sp.Rational(rng.randint(-40, 40) * 2 + 1, 17) for q in (x, y, theta, vx, vy, omega) for s in q.values()}
generic.update({s: sp.Rational(rng.randint(20, 90), 17) for q in (M, I, L, D, load) for s in q.values()})
generic.update({s: sp.Rational(rng.randint(10, 90), 17) for q in (F, m_rear, m_front) for s in q.values()})
generic[eps] = sp.Rational(1, 3)
caught = tried = 0
for r in range(3):
    for name, term in terms[2][r].items():
        for factor in (-1, 0):
            tried += 1
            wrong = sum(terms[2][r].values()) + (factor - 1) * term - free_body[2][r]
            caught += bool(abs(wrong.subs(generic).evalf(30)) > 1e-6)
check("control: each sign turned, each term dropped in (10)-(12) is noticed", caught == tried, f"{caught} of {tried}")

# --- Structure of the Jacobian ----------------------------------------------------------------------------------------

below = above = 0
place = {s: 6 * (k - 1) + i for i, q in enumerate((x, y, theta, vx, vy, omega)) for k, s in q.items()}
law = {F[c]: sp.Function("f%d%d" % c)(G[c]) for c in COUPLERS}
law.update({m_rear[j]: sp.Function("r%d%d" % (j, k))(beta[j, k] - theta[j]) for j, k in COUPLERS})
law.update({m_front[k]: sp.Function("g%d%d" % (j, k))(beta[j, k] - theta[k]) for j, k in COUPLERS})
for k in CARS:
    right_hand_sides = [vx[k], vy[k], omega[k]] + [e.subs(law) for e in free_body[k]]
    for i, e in enumerate(right_hand_sides):
        for s in e.free_symbols & set(place):
            offset = 6 * (k - 1) + i - place[s]
            below, above = max(below, offset), max(above, -offset)
check("Jacobian is block-tridiagonal; band 11 below, 5 above the diagonal", (below, above) == (11, 5))

# --- Invariants, and the law that each misprint breaks ----------------------------------------------------------------
# A loaded state in numbers: three different cars, both couplers strained, all four ends past the swing stop, moving.

K, K_M, G0, SLACK, STOP = 50.0e6, 1.0e6, 4.0, 0.25, sp.rad(sp.Rational(35, 2))
HALF_BAND = SLACK / 2
NUMBERS = {
    theta[1]: 0.9, theta[2]: -0.5, theta[3]: 0.55, x[1]: 0.0, y[1]: 3.0,
    vx[1]: 31.0, vy[1]: 12.0, omega[1]: 0.7, vx[2]: 43.0, vy[2]: -9.0, omega[2]: -1.1,
    vx[3]: 49.0, vy[3]: 6.0, omega[3]: 0.8,
    M[1]: 4000.0, M[2]: 5000.0, M[3]: 6100.0, I[1]: 1.2e6, I[2]: 1.6e6, I[3]: 2.1e6,
    L[1]: 55.0, L[2]: 60.0, L[3]: 64.0, D[1]: 36.0, D[2]: 40.0, D[3]: 43.0,
    load[1]: 32000.0, load[2]: 40000.0, load[3]: 14000.0, eps: 1.0,
}
LENGTH_OF_BAR = {(1, 2): (3.84, 0.1), (2, 3): (4.17, -0.15)}  # gap (buff, draft) and direction
for (j, k), (gap, direction) in LENGTH_OF_BAR.items():
    tip = pin_rear[j].subs(NUMBERS) - gap * sp.Matrix([sp.cos(direction), sp.sin(direction)])
    offset = tip - (L[k] / 2 * axis(k)).subs(NUMBERS)
    NUMBERS[x[k]], NUMBERS[y[k]] = offset[0], offset[1]
NUMBERS = {s: sp.sympify(number).evalf(40) for s, number in NUMBERS.items()}


def swing_moment(gamma):
    excess = abs(gamma) - STOP.evalf(40)
    return sp.sign(gamma) * K_M * excess if excess > 0 else sp.Float(0)


def axial_force(gap):
    if gap < G0 - HALF_BAND:
        return K * (G0 - HALF_BAND - gap)
    return -K * (gap - G0 - HALF_BAND) if gap > G0 + HALF_BAND else sp.Float(0)


def at_state(state):
    """state, completed by the coupler forces and moments that it implies."""
    full = dict(state)
    for j, k in COUPLERS:
        gap, angle = G[j, k].subs(state).evalf(30), beta[j, k].subs(state).evalf(30)
        full[F[j, k]] = axial_force(gap)
        full[m_rear[j]] = swing_moment(angle - full[theta[j]])
        full[m_front[k]] = swing_moment(angle - full[theta[k]])
    return full


STATE = at_state(NUMBERS)
assert all(abs(STATE[s]) > 1e3 for q in (F, m_rear, m_front) for s in q.values()), "the state must load every term"


def axial_energy(gap):
    return K / 2 * max(abs(gap - G0) - HALF_BAND, 0) ** 2


def swing_moment_plateau(gamma, top):
    m = swing_moment(gamma)
    return sp.sign(m) * min(abs(m), top)


def swing_energy(gamma, top):
    q, q_top = max(abs(gamma) - STOP.evalf(40), 0), top / K_M
    return K_M / 2 * q ** 2 if q <= q_top else top * (q - q_top / 2)


def slope(function, at, h=sp.Rational(1, 1000)):  # exact for pieces of parabolas
    return (function(at + h) - function(at - h)) / (2 * h)


gaps_ft = [sp.Rational(g, 100) for g in (370, 386, 395, 405, 414, 430)]
swings = [sp.Rational(g, 10) for g in (-25, -12, -4, -2, 1, 4, 12, 25)]
half_turn = sp.pi.evalf(40)
check("coupler laws: F = -dU_axial/dG (buff > 0), m = dU_m/dgamma, with and without plateau",
      all(abs(slope(axial_energy, g) + axial_force(g)) < 1e-3 for g in gaps_ft)
      and axial_force(gaps_ft[0]) > 0 > axial_force(gaps_ft[-1])
      and all(abs(slope(lambda e: swing_energy(e, top), g) - swing_moment_plateau(g, top)) < 1e-3
              for g in swings for top in (1e9, 5e5))
      and swing_moment(swings[-1]) > 0 and swing_energy(half_turn, 5e5) == swing_energy(-half_turn, 5e5))


def mirrored(state):
    flipped = set(y.values()) | set(theta.values()) | set(vy.values()) | set(omega.values())
    return at_state({s: -value if s in flipped else value for s, value in state.items()})


ARGUMENTS = sorted(STATE, key=str)
COMPILED = {}
mpmath.mp.dps = 30


def value(expression, state=None):
    numbers = [mpmath.mpf(str((state or STATE)[s])) for s in ARGUMENTS]
    if expression not in COMPILED:
        COMPILED[expression] = sp.lambdify(ARGUMENTS, sp.sympify(expression), "mpmath")
    return COMPILED[expression](*numbers)


def evaluate(change=None, state=None):
    """Right-hand sides of all cars in numbers; change(k, rows of terms) undoes a correction."""
    result = {}
    for k in CARS:
        rows = [dict(row) for row in terms[k]]
        if change:
            change(k, rows)
        result[k] = [sum(value(term, state) for term in row.values()) for row in rows]
    return result


NO_GROUND = {load[k]: sp.Float(0) for k in CARS}
FREE = {**STATE, **NO_GROUND}
FREE_MIRRORED = {**mirrored(NUMBERS), **NO_GROUND}


def laws_broken(change=None):
    """Names of the laws that the equations with `change` break, and by how much: couplers alone, then ground power."""
    f = evaluate(change, FREE)
    scale = max(abs(f[k][0]) + abs(f[k][1]) for k in CARS)
    broken = {"x-momentum": sum(f[k][0] for k in CARS) / scale, "y-momentum": sum(f[k][1] for k in CARS) / scale}
    arm = 60
    about_origin = sum(value(x[k]) * f[k][1] - value(y[k]) * f[k][0] + f[k][2] for k in CARS)
    broken["angular momentum"] = about_origin / scale / arm
    power = sum(value(vx[k]) * f[k][0] + value(vy[k]) * f[k][1] + value(omega[k]) * f[k][2] for k in CARS)
    strain = sum(value(-F[c] * rate(sp.Matrix([G[c]]))[0]) for c in COUPLERS)
    for j, k in COUPLERS:
        turning = rate(sp.Matrix([beta[j, k]]))[0]
        strain += value(m_rear[j] * (turning - omega[j]) + m_front[k] * (turning - omega[k]))
    broken["energy"] = (power + strain) / scale / 50
    g = evaluate(change, FREE_MIRRORED)
    broken["mirror"] = max(max(abs(f[k][0] - g[k][0]), abs(f[k][1] + g[k][1])) / scale for k in CARS)
    # Ground alone: the power that the equations give must be force times velocity of the trucks.
    full = evaluate(change)
    gained = sum(value(w[k]) * (full[k][r] - f[k][r]) for k in CARS for r, w in enumerate((vx, vy, omega)))
    at_trucks = sum(value(ground[t].dot(sp.Matrix([u[t], v[t]]))) for t in truck)
    broken["ground power"] = (gained - at_trucks) / at_trucks
    return {name for name, size in broken.items() if abs(size) > 1e-6}, broken


broken, sizes = laws_broken()
check("corrected equations keep momentum, angular momentum, energy, mirror, ground power", not broken,
      "largest %.0e" % max(abs(s) for s in sizes.values()))
check("the end moments alone do not sum to zero (angular momentum does)",
      abs(sum(STATE[m] for q in (m_rear, m_front) for m in q.values())) > 1e3)


def misprint(name, change, expected):
    broken, _ = laws_broken(change)
    check(f"as printed: {name}", broken == expected, "breaks " + (", ".join(sorted(broken)) or "nothing"))


def cosine_for_sine(k, rows):
    if "E_C k-1,k sin beta" in rows[0]:
        pair = (k - 1, k)
        rows[0]["E_C k-1,k sin beta"] = -E[pair] * bar[pair][0] / G[pair]


def other_cars_moment(k, rows):
    if "m of coupler k-1,k" in rows[2]:
        rows[2]["m of coupler k-1,k"] = 0
    if k + 1 in m_front:
        rows[2]["printed m_FC,k+1"] = m_front[k + 1]


def turned_rear_truck(k, rows):
    rows[2]["F_R sin(theta - alpha)"] = -rows[2]["F_R sin(theta - alpha)"]


misprint("(10) E_k-1,k cos beta", cosine_for_sine, {"x-momentum", "angular momentum", "energy", "mirror"})
misprint("(10) no front truck", lambda k, rows: rows[0].pop("F_F cos alpha"), {"ground power"})
misprint("(11) no front truck", lambda k, rows: rows[1].pop("F_F sin alpha"), {"ground power"})
misprint("(12) m_FC,k+1 on car k", other_cars_moment, {"energy"})
misprint("(12) + F sin(theta - alpha_R)", turned_rear_truck, {"ground power"})

spin = {s: sp.Float(0) for q in (x, y, theta, vx, vy) for s in q.values()}
spin.update({omega[1]: 0.5, D[1]: 40.0, load[1]: 1.0, eps: 0.0})
torque = {n: t for n, t in terms[1][2].items() if n.startswith(("F_F", "F_R"))}
check("(12) as printed leaves a spinning car undamped, corrected it brakes it",
      abs(sum(torque.values()).subs(spin) + 40.0) < 1e-12
      and abs((torque["F_F sin(theta - alpha)"] - torque["F_R sin(theta - alpha)"]).subs(spin)) < 1e-12)

# (12): theta-dot on the left. Exponents of (mass, length, time): inertia x angular rate is no moment.
dimension = {"I": (1, 2, 0), "theta-dot": (0, 0, -1), "theta-double-dot": (0, 0, -2), "moment": (1, 2, -2)}


def product(a, b):
    return tuple(p + q for p, q in zip(dimension[a], dimension[b]))


check("(12) theta-dot has the wrong dimension, theta-double-dot the right one",
      product("I", "theta-dot") != dimension["moment"] and product("I", "theta-double-dot") == dimension["moment"])

# (3): the arctangent of a quotient turns the force of a truck that moves backwards along with its motion.
u0, v0 = sp.Rational(-3), sp.Rational(1)
power_atan = -(sp.cos(sp.atan(v0 / u0)) * u0 + sp.sin(sp.atan(v0 / u0)) * v0)
power_atan2 = -(sp.cos(sp.atan2(v0, u0)) * u0 + sp.sin(sp.atan2(v0, u0)) * v0)
check("(3) as printed feeds energy to a truck with u < 0; two arguments: power -|v|",
      power_atan > 0 and sp.simplify(power_atan2 + sp.sqrt(u0 ** 2 + v0 ** 2)) == 0)
u0, v0 = sp.Rational(3), sp.Rational(1)
swapped = -(sp.cos(sp.atan2(u0, v0)) * u0 + sp.sin(sp.atan2(u0, v0)) * v0)
check("nomenclature (u along y, v along x) contradicts (3)-(5): force not against motion",
      sp.simplify(swapped + sp.sqrt(u0 ** 2 + v0 ** 2)) != 0)
dx, dy = -sp.Integer(2), sp.Integer(1)
check("(6), (7) as printed lose the quadrant when the bar points backwards",
      sp.cos(sp.atan(dy / dx)) * sp.sqrt(dx ** 2 + dy ** 2) == -dx)

# (15): gaps at the start.
lengths, g0 = sp.symbols("l1:6", positive=True), sp.Symbol("G0", positive=True)


def gaps(positions):
    return [sp.expand(positions[i] - positions[i + 1] - (lengths[i] + lengths[i + 1]) / 2) for i in range(4)]


pitch = [(lengths[j] + lengths[j + 1]) / 2 + g0 for j in range(4)]
meant = [-sum(pitch[:k], sp.Integer(0)) for k in range(5)]
printed = [sp.Integer(0)]
for k in range(1, 5):
    printed.append(-sum(printed[j] + pitch[j] for j in range(k)))
check("(15) corrected: every gap is G0; as printed (sum over x_j): not so",
      all(g == g0 for g in gaps(meant)) and any(g != g0 for g in gaps(printed)))
at_start = {theta[1]: 0, vx[1]: 54, vy[1]: 0, omega[1]: sp.Rational(1, 5), D[1]: 40}
check("text after (15): alpha of car 1 is not zero at t = 0 (Omega turns its trucks' velocities)",
      sp.atan2(v[1, "F"], u[1, "F"]).subs(at_start) == sp.atan2(4, 54))

# --- Closed forms that docs/model.md states ---------------------------------------------------------------------------

tilt = sp.Symbol("z", positive=True)
V, V_E, MU, GR = sp.symbols("V v_e mu g", positive=True)
slide = (V * sp.sqrt(V ** 2 + V_E ** 2) + V_E ** 2 * sp.asinh(V / V_E)) / (2 * MU * GR)
# v dv/dx = -mu g v / sqrt(v^2 + v_e^2)  =>  dX/dV = sqrt(V^2 + v_e^2) / (mu g), X(0) = 0
check("sliding distance with regularised friction",
      sp.simplify((slide.diff(V) - sp.sqrt(V ** 2 + V_E ** 2) / (MU * GR)).subs(V, V_E * sp.sinh(tilt))) == 0
      and slide.subs(V, 0) == 0
      and sp.limit(sp.simplify((slide * 2 * MU * GR / V ** 2).subs(V, V_E * tilt)).rewrite(sp.log), tilt, sp.oo) == 1)
excess = (slide * 2 * MU * GR / V ** 2).subs({V: 54.2667, V_E: 1.0}) - 1
check("... 0.18 % longer at 37 mph, v_eps = 1 ft/s; 0.5 % less force at 10 v_eps",
      abs(excess - 0.00176) < 2e-5 and abs(1 - 10 / sp.sqrt(101.0) - 0.005) < 1e-4, f"{float(100 * excess):.3f} %")
# f = z / sqrt(1 + z^2) runs through (0, 1)
load_share = tilt / sp.sqrt(1 + tilt ** 2)
creep = sp.simplify(V_E * load_share / sp.sqrt(1 - load_share ** 2))
check("creep under a load of f mu W: v_eps f / sqrt(1 - f^2)",
      sp.simplify(creep / sp.sqrt(creep ** 2 + V_E ** 2) - load_share) == 0)

t, k_spring, mass_1, mass_2, dv = sp.symbols("t K M1 M2 dv", positive=True)
reduced = mass_1 * mass_2 / (mass_1 + mass_2)
w = sp.sqrt(k_spring / reduced)
closing = dv / w * sp.sin(w * t)
check("two cars meeting at dv: peak dv sqrt(K M1 M2 / (M1 + M2)), equal cars dv sqrt(K M / 2)",
      sp.simplify(reduced * closing.diff(t, 2) + k_spring * closing) == 0 and closing.diff(t).subs(t, 0) == dv
      and sp.simplify(k_spring * dv / w - dv * sp.sqrt(k_spring * reduced)) == 0
      and sp.simplify((reduced - mass_1 / 2).subs(mass_2, mass_1)) == 0)

# Truck velocities p = (a, b), q = (c, d): (|p| + |q|)^2 - |p + q|^2 = 2 (|p||q| - p.q), and |p|^2 |q|^2 - (p.q)^2
# is a square.
a, b, c, d = sp.symbols("a b c d", real=True)
check("Coulomb friction takes at least mu W |v of the centre| from a car, however it turns",
      sp.expand((a ** 2 + b ** 2) * (c ** 2 + d ** 2) - (a * c + b * d) ** 2 - (a * d - b * c) ** 2) == 0)


def cars_past_pod_at_most(mean_path, cars, pitch_ft, play=0.0):
    """Largest N = q + 1 with pitch q (1 - (q + 1) / (2 n)) - play (n - 1) / 2 <= mean path."""
    return max(q + 1 for q in range(cars)
               if pitch_ft * q * (1 - (q + 1) / (2 * cars)) - play * (cars - 1) / 2 <= mean_path)


paths = {mph: (mph * 5280 / 3600) ** 2 / (2 * 0.15 * 32.17405) for mph in (18.5, 37.0, 55.5)}
check("mean path at most V^2 / (2 mu g): 76, 305, 686 ft", [round(p) for p in paths.values()] == [76, 305, 686])
simple = [round(1 + p / 64, 1) for p in paths.values()]
check("... 1 + path / 64 ft = 2.2, 5.8, 11.7", simple == [2.2, 5.8, 11.7], str(simple))
strict = [cars_past_pod_at_most(p, 60, 64, 0.16) for p in paths.values()]
check("... strictly, 60 cars: no more than 2, 6, 13 past the POD (paper: 6, 13, 24)", strict == [2, 6, 13], str(strict))
needed = [round((paths[mph] + 0.16 * 59 / 2) / (q * (1 - (q + 1) / 120)))
          for mph, q in ((18.5, 5), (37.0, 12), (55.5, 23))]
check("... 6, 13, 24 past the POD would need cars 17, 29, 38 ft apart", needed == [17, 29, 38], str(needed))


def least_total(cars, count):
    """Least sum of paths, in pitches, by trying every set of `count` cars past the POD (car 1 among them)."""
    best = None
    for rest in combinations(range(2, cars + 1), count - 1):
        members, total, last = {1, *rest}, 0, 1
        for car in range(1, cars + 1):
            last = car if car in members else last
            total += last - 1
        best = total if best is None else min(best, total)
    return best


check("... the counting step of that bound, by trying every set of cars (n = 2..9)",
      all(2 * least_total(n, q + 1) == q * (2 * n - q - 1) for n in range(2, 10) for q in range(n)))

# --- Table ------------------------------------------------------------------------------------------------------------

for holds, what, note in ROWS:
    print(f"{'ok  ' if holds else 'FAIL'}  {what}{'  [' + note + ']' if note else ''}")
failures = sum(not holds for holds, _, _ in ROWS)
print(f"{len(ROWS)} checks, {failures} failed, {time.monotonic() - START:.0f} s")
sys.exit(1 if failures else 0)
