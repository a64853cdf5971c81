"""Attachments that depend on their amplitude: describing functions, the least root, time histories.

Friction and gaps are compared with their force along a cycle, roots with scans and polynomials, and
the response with integrated equations of motion.
"""

import inspect
import types

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement.criticism.missing import _more_effects
from bayes_placement.experiment import closure
from tests.effects import models_in_space

AT = 0.4  # no law depends on it
FORCE, STIFFNESS, CLEARANCE = 3.0, 2e5, 7e-6
CUBIC = effects.cubic_stiffness(AT, 1e15)
FRICTION = effects.coulomb_friction(AT, FORCE, STIFFNESS)
GAP = effects.gap(AT, STIFFNESS, CLEARANCE)
STIFF_STOP = effects.gap(AT, 1e10, CLEARANCE)  # of which hardly anything is felt before all of it
LAWS = {"cubic": CUBIC, "friction": FRICTION, "gap": GAP, "stiff stop": STIFF_STOP}
of_each_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)


def stiffness_of(law, amplitude, omega=1.0):
    shape = (1, np.size(amplitude))
    amplitude = jnp.reshape(jnp.asarray(amplitude), shape)
    return np.asarray(law.equivalent_stiffness(amplitude, jnp.full(shape[1], omega)))[0]


# ------------------------------------------------------------------- describing functions


def first_harmonic(force, amplitude):
    """Complex stiffness of the first harmonic of a force along a cycle of cos(t)."""
    return 2 * np.fft.fft(force)[1] / force.size / amplitude


def rubbing(displacement):
    """Force of the contact along a path, by its increments, of which it slips beyond its limit."""
    force, path = 0.0, []
    for step in np.diff(displacement, prepend=0.0):
        force = np.clip(force + STIFFNESS * step, -FORCE, FORCE)
        path.append(force)
    return np.array(path)


def cycles(amplitude, count=2, samples=20_000):
    return amplitude * np.cos(2 * np.pi * np.arange(count * samples) / samples), samples


@pytest.mark.parametrize("over_threshold", [0.5, 1.0, 1.02, 1.7, 6.0, 300.0])
def test_friction_has_the_first_harmonic_of_its_cycle(over_threshold):
    amplitude = over_threshold * FORCE / STIFFNESS
    path, samples = cycles(amplitude)
    force = rubbing(path)
    expected = first_harmonic(force[samples:], amplitude)
    seen = stiffness_of(FRICTION, [amplitude])[0]
    np.testing.assert_allclose(seen, expected, atol=1e-6 * STIFFNESS)
    lost = np.trapezoid(force[samples - 1 :], path[samples - 1 :])
    slipped = max(amplitude - FORCE / STIFFNESS, 0.0)
    np.testing.assert_allclose(lost, 4 * FORCE * slipped, atol=1e-6 * FORCE * amplitude)
    np.testing.assert_allclose(stiffness_of(FRICTION, [amplitude], -1.0)[0], np.conj(seen))


def test_a_stiff_contact_is_plain_coulomb_friction():
    amplitude = np.array([1e-6, 1e-3, 0.2])
    rigid = effects.coulomb_friction(AT, FORCE, 1e14)
    expected = 4j * FORCE / (np.pi * amplitude)
    np.testing.assert_allclose(stiffness_of(rigid, amplitude), expected, rtol=1e-3)
    np.testing.assert_allclose(stiffness_of(rigid, amplitude)[1:], expected[1:], rtol=1e-5)


@pytest.mark.parametrize("over_clearance", [0.3, 1.0, 1.001, 1.4, 5.0, 900.0])
def test_a_gap_has_the_first_harmonic_of_its_force(over_clearance):
    amplitude = over_clearance * CLEARANCE
    path, _ = cycles(amplitude, count=1)
    force = STIFFNESS * np.sign(path) * np.maximum(np.abs(path) - CLEARANCE, 0.0)
    expected = first_harmonic(force, amplitude)
    np.testing.assert_allclose(stiffness_of(GAP, [amplitude])[0], expected, atol=1e-8 * STIFFNESS)
    closed = effects.gap(AT, STIFFNESS, 0.0)
    np.testing.assert_allclose(stiffness_of(closed, [0.0, amplitude]), STIFFNESS, rtol=1e-15)


# ------------------------------------------------------------------------- the least root


def ports(count, seed=8):
    """Receptances of ports, mostly of little loss, and their displacements when free."""
    draws = np.random.default_rng(seed)
    loss = 10 ** draws.uniform(-4, 0, count)
    angle = np.where(draws.random(count) < 0.5, -loss, loss - np.pi)
    receptance = 10 ** draws.uniform(-8, -4, count) * np.exp(1j * angle)
    free = 10 ** draws.uniform(-7, -3, count) * np.exp(2j * np.pi * draws.random(count))
    return receptance, free


@jax.jit
def moved(law, receptance, free):
    """Amplitudes at ports that are driven, each at a line of its own."""
    return closure.amplitude(law, jnp.ones(receptance.size), receptance, free[None])[0]


def scanned(law, receptance, free):
    """The first crossing on a fine grid of amplitudes, halved until nothing is left of it."""
    threshold = float(law.threshold())
    near = threshold * (1 + np.geomspace(1e-9, 1.0, 3000)) if threshold else []
    grid = np.unique([*np.geomspace(1e-7 * abs(free), 1e5 * abs(free), 6000), *near])

    def excess(amplitude):
        return amplitude * np.abs(1 + receptance * stiffness_of(law, amplitude)) - abs(free)

    first = np.flatnonzero(excess(grid) >= 0)[0]
    low, high = grid[first - 1], grid[first]
    for _ in range(4):
        finer = np.linspace(low, high, 3000)
        place = max(int(np.argmax(excess(finer) >= 0)), 1)
        low, high = finer[place - 1], finer[place]
    return high


@of_each_law
def test_the_amplitude_is_the_first_that_a_scan_finds(law):
    receptance, free = ports(30)
    expected = [scanned(law, *port) for port in zip(receptance, free, strict=True)]
    seen = moved(law, receptance, free)
    np.testing.assert_allclose(seen, expected, rtol=1e-8)
    assert np.abs(seen / np.abs(free) - 1).max() > 0.5  # it is felt


def test_of_the_roots_of_a_cubic_it_is_the_least():
    receptance, free = ports(2000)
    product = 0.75 * CUBIC.stiffness * receptance
    several = 0
    for seen, r, u in zip(moved(CUBIC, receptance, free), product, free, strict=True):
        roots = np.roots([abs(r) ** 2, 2 * r.real, 1.0, -(abs(u) ** 2)])
        real = roots.real[(np.abs(roots.imag) < 1e-6 * np.abs(roots)) & (roots.real > 0)]
        several += len(real) > 1
        np.testing.assert_allclose(seen**2, real.min(), rtol=1e-6)
    assert several > 100


@pytest.mark.parametrize("law", [CUBIC, effects.gap(AT, 4e6, CLEARANCE)], ids=["cubic", "gap"])
def test_it_jumps_where_the_least_two_roots_meet(law):
    """A crest of a |1 + h Z(a)|: below it the least root is before, above it far beyond."""
    receptance = ports(200)[0]
    receptance = receptance[receptance.real < 0]
    jumps = 0
    grid = np.unique([*np.geomspace(1e-10, 1e-1, 20_000), float(law.threshold())])
    stiffness = stiffness_of(law, grid)
    for h in receptance:
        height = grid * np.abs(1 + h * stiffness)
        crests = np.flatnonzero((height[1:-1] >= height[:-2]) & (height[1:-1] > height[2:]))
        if crests.size:
            top = crests[0] + 1
            free = height[top] * np.array([1 - 2e-4, 1 + 2e-4])
            before, beyond = moved(law, np.full(2, h), free + 0j)
            assert before <= grid[top] * (1 + 1e-3) < beyond
            jumps += 1
    assert jumps > 20


def test_a_stop_is_felt_from_its_clearance_on_however_stiff():
    """Right behind the clearance the stiffness grows by all powers of ten."""
    receptance, _ = ports(300)
    distance = np.geomspace(1e-6, 0.5, 300)
    before, beyond = CLEARANCE * (1 - distance) + 0j, CLEARANCE * (1 + distance) + 0j
    np.testing.assert_allclose(moved(STIFF_STOP, receptance, before), before.real, rtol=1e-12)
    seen = moved(STIFF_STOP, receptance, beyond)
    resisting = np.abs(1 + receptance * stiffness_of(STIFF_STOP, seen))
    np.testing.assert_allclose(seen * resisting, beyond.real, rtol=1e-7)


# ------------------------------------------------------------------------------ derivatives


def response_of(kind, numbers, receptance, free):
    """What an attachment makes of two channels at its port: real and imaginary part."""
    matrix = jnp.full((2, 2, 1), receptance)
    law = kind(AT, *numbers)
    (frf,) = closure.attached(matrix, law, jnp.ones(1), jnp.array([free])).ravel()
    return jnp.array([frf.real, frf.imag])


SLOPES = {
    "cubic": (effects.cubic_stiffness, (1e15,)),
    "friction": (effects.coulomb_friction, (FORCE, STIFFNESS)),
    "gap": (effects.gap, (STIFFNESS, CLEARANCE)),
}


@pytest.mark.parametrize(
    "name", ["friction", *(pytest.param(n, marks=pytest.mark.long) for n in ("gap", "cubic"))]
)
def test_derivatives_are_those_of_finite_differences_either_way(name):
    kind, numbers = SLOPES[name]

    def response(scales):
        scaled = [number * scale for number, scale in zip(numbers, scales[3:], strict=True)]
        receptance = 4e-6 * jax.lax.complex(scales[0], -0.3 * scales[1])
        return 1e6 * response_of(kind, scaled, receptance, 20.0 * scales[2])

    @jax.jit
    def derivatives(scales):
        slope = jax.jacrev(response)
        return (
            response(scales),
            slope(scales),
            jax.jacfwd(response)(scales),
            jax.jacfwd(slope)(scales),
        )

    ones, step = jnp.ones(3 + len(numbers)), 1e-6
    _, reverse, forward, curvature = derivatives(ones)
    np.testing.assert_allclose(reverse, forward, rtol=1e-10, atol=1e-12)
    either_way = [
        (derivatives(ones + step * way), derivatives(ones - step * way))
        for way in np.eye(ones.size)
    ]
    differences = [(up[0] - down[0]) / (2 * step) for up, down in either_way]
    np.testing.assert_allclose(forward, np.transpose(differences), atol=1e-7)
    assert np.all(np.abs(forward).max(axis=0) > 1e-3)
    up, down = either_way[2]
    np.testing.assert_allclose(curvature[:, 2], (up[1] - down[1]) / (2 * step), atol=1e-6)


@pytest.mark.parametrize("name", SLOPES)
def test_what_is_absent_or_at_rest_changes_nothing_and_has_derivatives(name):
    kind, numbers = SLOPES[name]
    receptance = 4e-6 - 1e-6j

    def response(strength, force):
        return response_of(kind, (strength, *numbers[1:]), receptance, force)

    @jax.jit
    def with_derivatives(strength, force):
        either_way = [derivative(response, (0, 1)) for derivative in (jax.jacfwd, jax.jacrev)]
        return response(strength, force), [derivative(strength, force) for derivative in either_way]

    for free in (5.0, 0.0):
        for strength in (0.0, numbers[0]):
            seen, derivatives = with_derivatives(strength, free)
            assert np.all(np.isfinite(derivatives))
            if strength == 0.0:
                np.testing.assert_array_equal(seen, [receptance.real, receptance.imag])


# -------------------------------------------------------------------------- time histories

MASS, SPRING, DASHPOT, DRIVE = 1.0, 1e4, 4.0, 10.0


def history(contact, omega, cycles=60):
    """First harmonic of an oscillator, per force, once its motion has settled.

    The contact gives a force and its rate by displacement, velocity and the force so far.
    """
    period = 2 * np.pi / omega

    def rates(t, state):
        x, v, sliding = state
        force, rate = contact(x, v, sliding)
        return [v, (DRIVE * np.cos(omega * t) - DASHPOT * v - SPRING * x - force) / MASS, rate]

    at = period * (cycles - 4 + np.arange(4 * 256) / 256)
    tight = {"max_step": period / 150, "rtol": 1e-7, "atol": 1e-10}
    settled = solve_ivp(rates, (0.0, period * cycles), np.zeros(3), t_eval=at, **tight)
    return 2 * np.mean(settled.y[0] * np.exp(-1j * omega * at)) / DRIVE


def in_the_gap(x, v, _):
    return STOP.stiffness * np.sign(x) * max(abs(x) - STOP.clearance, 0.0), 0.0


def under_friction(x, v, force):
    slips = abs(force) >= RUBBING.force and force * v > 0
    return force, 0.0 if slips else RUBBING.stiffness * v


STOP = effects.gap(AT, 3e3, 5e-3)
RUBBING = effects.coulomb_friction(AT, 4.0, 4e3)


@pytest.mark.parametrize(
    ("law", "contact", "ratios"),
    [
        pytest.param(STOP, in_the_gap, (0.93, 1.02), id="gap", marks=pytest.mark.long),
        pytest.param(RUBBING, under_friction, (1.0, 1.1), id="friction"),
    ],
)
def test_the_response_is_the_first_harmonic_of_a_time_history(law, contact, ratios):
    """Within 0.5 %: other harmonics of the force, which it leaves out, act on the motion too."""
    for ratio in ratios:
        omega = ratio * np.sqrt(SPRING / MASS)
        free = 1 / (SPRING - MASS * omega**2 + 1j * omega * DASHPOT)
        matrix = jnp.full((2, 2, 1), free)
        lines = jnp.array([omega]), jnp.array([DRIVE])
        seen = complex(closure.attached(matrix, law, *lines)[0, 0, 0])
        expected = history(contact, omega)
        assert abs(seen / expected - 1) < 0.005
        assert abs(free / expected - 1) > 0.1


# ------------------------------------------------------------------ structures and searches


@pytest.mark.long
def test_friction_sticks_along_its_direction_and_slips_under_large_forces():
    scene = models_in_space.frame()
    along = (0.6, 0.0, 0.8)
    rubbing = effects.coulomb_friction(scene.place, 1.0, 1e4, direction=along)
    spring = effects.ground_spring(scene.place, 1e4, direction=along)

    def response(additions, force):
        levels = jnp.full(len(scene.frequency), force)
        return np.asarray(jax.jit(lambda: scene.response(additions, force=levels))())

    free, held = response([], 1.0), response([spring], 1.0)
    size = np.abs(held).max()
    np.testing.assert_allclose(response([rubbing], 1e-6), held, atol=1e-12 * size)
    np.testing.assert_allclose(response([rubbing], 1e7), free, atol=1e-4 * np.abs(free).max())
    assert np.abs(held - free).max() > 0.05 * size
    everywhere = effects.gap(scene.place, 1e4, 1e-5)
    with pytest.raises(ValueError, match=r'"gap" was given without a direction; one is needed'):
        response([everywhere], 1.0)


@pytest.mark.parametrize(
    ("kind", "numbers", "message"),
    [
        (effects.coulomb_friction, (-1.0, 1e4), r"coulomb_friction.force=-1 .* not be negative"),
        (effects.coulomb_friction, (1.0, 0.0), r"coulomb_friction.stiffness=0 .* above zero"),
        (effects.gap, (1e4, -1e-6), r"gap.clearance=-1e-06 .* not be negative"),
    ],
)
def test_numbers_that_mean_nothing_are_refused(kind, numbers, message):
    with pytest.raises(ValueError, match=message):
        driven() + kind(AT, *numbers)


def driven(levels=(1.0, 5.0)):
    line = bp.beams.bar(
        3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0, ends="fixed-free"
    )
    return bp.Experiment(
        bp.Structure(line, damping=bp.damping.Modal(0.02)),
        sensors=[bp.Sensor("s1", at=0.9)],
        actuators=[bp.Actuator("a1", at=0.6)],
        frequency=np.linspace(50.0, 400.0, 30),
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Gaussian(1.0),
        force_levels=levels,
    )


def test_they_are_tried_by_name_where_forces_are_known_and_none_is_there():
    names = ["cubic_stiffness", "coulomb_friction", "gap"]
    assert effects.library(driven(), names).kinds == names
    assert {*names} & {*effects.library(driven()).kinds} == {"cubic_stiffness"}
    assert effects.library(driven(None), names).kinds == []
    assert effects.library(driven() + effects.gap(AT, 1e5, 1e-6), names).kinds == []


def test_no_search_puts_two_of_them_on_a_structure(monkeypatch):
    mass = effects.point_mass(AT, 0.1)
    kinds = (GAP, CUBIC, mass, FRICTION)
    candidates = [types.SimpleNamespace(effect=effect, problem=None) for effect in kinds]
    monkeypatch.setattr(_more_effects, "_by_promise", lambda branch, null, candidates: candidates)
    monkeypatch.setattr(_more_effects, "_further_swaps", lambda comparison, branch: [])
    monkeypatch.setattr(_more_effects, "may_be_added", inspect.unwrap(_more_effects.may_be_added))
    alone = types.SimpleNamespace(kinds=("gap",), effects=(GAP,))
    comparison = types.SimpleNamespace(
        of=lambda kinds: None,
        distinct=lambda: [alone],
        hypotheses=[alone],
        candidates=candidates,
    )
    pairs = inspect.unwrap(_more_effects._pairs)(
        comparison, [alone], 5
    )  # types of stand-ins differ
    assert [effect.name for group in pairs for _, effect in group] == ["point_mass"]
