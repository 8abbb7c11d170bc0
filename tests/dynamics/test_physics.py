"""What laws say of bodies, against the textbook."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from vidsindy_lite.dynamics import Library, PolynomialSystem
from vidsindy_lite.dynamics.mechanics import physics_of

TIMES = np.linspace(0, 6, 300)
DRAG = Library.terms({"|v|v": lambda vx, vy: np.hypot(vx, vy) * np.array([vx, vy])})

DRY = Library.terms({"sign(vx)": lambda vx: np.sign(vx)})
POLE = Library.terms({"1/x": lambda x: 1 / (x - 2)})


def law_of(library=None, **accelerations):
    """A law of motion; the first letter of a keyword is its coordinate."""
    tied = {name: {f"v{name}": 1.0} for name in accelerations}
    forces = {f"v{name}": terms for name, terms in accelerations.items()}
    return PolynomialSystem.from_terms(tied | forces, library=library)


def told(law, *starts, errors=0.0, down=None, t=TIMES):
    """Physics of a law that is known to a share of its coefficients, seen from some starts."""
    share = errors * law.coefficients.T.ravel()
    share[: share.size // 2] = 0.0
    curves = [make_interp_spline(t, law.simulate(t, np.array(start, float))) for start in starts]
    return physics_of(law, np.diag(share**2), curves, down)


FALL = law_of(x={"1": 0.3, "vx": -0.4}, y={"1": -9.8, "vy": -0.4})


def test_g_its_direction_and_drag():
    said = told(FALL, [0, 1, 4, 5], errors=0.01)
    g = np.hypot(0.3, 9.8)
    assert said["g"].value == pytest.approx(g)
    # |a| changes by a / |a|, coefficient by coefficient.
    assert said["g"].error == pytest.approx(0.01 * np.hypot(0.3**2, 9.8**2) / g, rel=1e-5)
    assert said["direction"].value == pytest.approx([0.3 / g, -9.8 / g])
    assert [quantity.name for quantity in said] == ["g", "direction", "drag"]
    # It turns by 0.3 * 9.8 / g^2 times the root of both relative variances.
    turn = 0.3 * 9.8 / g**2 * 0.01 * np.sqrt(2)
    assert np.linalg.norm(said["direction"].error) == pytest.approx(turn, rel=1e-5)
    assert said["drag"].value == pytest.approx(0.4)
    assert said["drag"].error == pytest.approx(0.004 / np.sqrt(2), rel=1e-5)
    said = told(FALL, [0, 1, 4, 5], errors=0.01, down=[0, -2])
    assert said["g"].value == pytest.approx(9.8)
    assert said["g"].error == pytest.approx(0.098, rel=1e-5)
    assert "direction" not in str(said)


SWING = 2 * np.pi / np.sqrt(2 - 0.0025)


@pytest.mark.parametrize(
    ("law", "start", "values"),
    [
        (law_of(x={"vx": -0.1}, y={"1": -9.8, "vy": -0.4}), [0, 1, 4, 5],
         {"g": 9.8, "drag x": 0.1, "drag y": 0.4}),
        (law_of(x={}, y={"1": -9.8, "vy": -0.4}), [0, 1, 4, 5], {"g": 9.8, "drag y": 0.4}),
        (law_of(DRAG, x={"|v|v_x": -0.05}, y={"1": -9.8, "|v|v_y": -0.05}), [0, 1, 4, 5],
         {"g": 9.8, "quadratic drag": 0.05}),
        (law_of(x={"x": -3, "y": 1, "vx": -0.1}, y={"x": 1, "y": -3, "vy": -0.1}), [1, 0, 0, 1],
         {"natural frequency 1": np.sqrt(2), "natural frequency 2": 2, "damping 2": 0.1,
          "period 1": SWING}),
        (law_of(x={"x": 1, "x^3": -1, "vx": -0.5}), [1.6, 0], {"spring constant": 2}),
        (law_of(x={"x": -1, "vx": 0.1, "x^2 vx": -0.1}), [2, 0],
         {"spring constant": 1, "period": 2 * np.pi / np.sqrt(0.9975)}),
        (law_of(x={"vx": -0.3, "vy": 1.0}, y={"vx": -1.0, "vy": -0.3, "1": 1.0}), [0, 0, 0, 1],
         {"drag": 0.3}),
        (law_of(x={"vx": -0.3, "vy": 1.0}, y={"vy": -0.3, "1": 1.0}), [0, 0, 0, 1], {}),
    ],
)  # fmt: skip
def test_what_a_law_says(law, start, values):
    said = told(law, start, errors=0.01, t=5 * TIMES if "x^3" in law.terms else TIMES)
    assert {name: float(said[name].value) for name in values} == pytest.approx(values)
    for name in ("drag x", "drag", "spring constant"):  # of two that differ there is not one
        assert name in values or name not in {quantity.name for quantity in said}


def test_a_damped_spring():
    # A function that is not in the law may have a pole at rest.
    said = told(law_of(POLE, x={"1": 8.0, "x": -4.0, "vx": -0.4}), [3, 0], errors=0.01)
    values = {quantity.name: float(np.squeeze(quantity.value)) for quantity in said.quantities}
    assert values == pytest.approx(
        {
            "rest": 2.0, "spring constant": 4.0, "damping": 0.4,
            "natural frequency": 2.0, "period": 2 * np.pi / np.sqrt(4 - 0.04),
        }
    )  # fmt: skip
    errors = [said[name].error for name in ("spring constant", "natural frequency")]
    assert errors == pytest.approx([0.04, 0.01], rel=1e-4)
    assert np.squeeze(said["rest"].error) == pytest.approx(0.02 * np.sqrt(2), rel=1e-4)
    said = told(law_of(x={"x": -1.0, "vx": -1.9999999}), [1, 0], errors=0.01)
    assert said.notes[0] == "no period: by its errors it may as well creep back to rest"


def test_the_energy_along_the_path():
    spring = told(law_of(x={"x": -4.0, "vx": -0.2}), [1, 0])
    t, energy = spring.energy[0].T
    path = law_of(x={"x": -4.0, "vx": -0.2}).simulate(t, np.array([1.0, 0]))
    assert energy == pytest.approx(2 * path[:, 0] ** 2 + path[:, 1] ** 2 / 2, abs=1e-6)
    assert "falls" in str(spring)
    assert "is kept" in str(told(law_of(x={"x": -4.0, "x^3": -1}), [1, 0]))
    assert "it is driven" in str(told(law_of(x={"x": -1.0, "vx": 1, "x^2 vx": -1}), [0.1, 0]))
    swirl = law_of(x={"x": -1.0, "y": -1}, y={"x": 1.0, "y": -1})
    assert "no potential" in str(told(swirl, [1, 0, 0, 1]))
    assert told(swirl, [1, 0, 0, 1]).energy == ()
    throws = told(law_of(x={}, y={"1": -9.8}), [0, 0, 1, 3], [5, 9, 1, 3])
    assert [pair[0, 1] for pair in throws.energy] == pytest.approx([5, 5])


@pytest.mark.parametrize(
    ("law", "start", "words"),
    [
        (PolynomialSystem.from_terms({"x": {"x": -1}}), [1], "first order"),
        (law_of(x={"x": 1.0}), [0.1, 0], "nothing holds it"),
        (law_of(x={"x": -4.0}, y={"1": -1.0}), [1, 0, 0, 0], "no period y: nothing pulls it back"),
        (law_of(DRY, x={"x": -1.0, "sign(vx)": -0.1}), [1, 0], "or a force jumps there: no spring"),
        (law_of(x={"x": -1.0, "vx": -3.0}), [1, 0], "no period: it creeps back"),
        (law_of(x={"x": -1.0, "vx": 1.0}), [1, 0], "no period: what is near rest leaves it"),
        (law_of(x={"x": -4.0, "x^3": 1.0}), [1, 0], "of small swings, if its powers imitate no"),
        (law_of(x={"vx": -1.0}), [0, 1], "no constant force: no g"),
        (law_of(x={"vy": 1.0}, y={"vx": -1.0, "1": 1.0}), [0, 0, 0, 1], "turns the motion"),
    ],
)
def test_what_cannot_be_said_is_said_in_a_line(law, start, words):
    said = told(law, start)
    assert sum(words in note for note in said.notes) == 1
    assert "\n" not in " ".join(said.notes)


def test_bad_input():
    with pytest.raises(ValueError, match="down: must be 2 finite numbers"):
        told(FALL, [0, 1, 4, 5], down=[0, 0, 1])
    with pytest.raises(ValueError, match="down: must be a direction"):
        told(FALL, [0, 1, 4, 5], down=[0, 0])
    with pytest.raises(
        KeyError, match=r"of what the law says \(g, direction, drag\), got 'period'"
    ):
        told(FALL, [0, 1, 4, 5])["period"]
