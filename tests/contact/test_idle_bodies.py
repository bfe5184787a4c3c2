"""Bodies that carry nothing move no more than they must (scipy's SLSQP is the reference)."""

import numpy as np
import pytest
import scipy.optimize

from petcontact.contact.idle_bodies import idle_motions, least_motion
from petcontact.contact.laws import SignoriniCoulomb
from petcontact.contact.system import Modes


def drawn(seed):
    """Two discs, each with nodes that face walls: motions (m, 2, 6), and where their nodes begin."""
    rng = np.random.default_rng(seed)
    m, motion = 10, np.zeros((20, 2, 6))
    for body in range(2):
        nodes = slice(body * m, (body + 1) * m)
        angle = rng.uniform(0.2, 2.9, m)
        normal, along = (
            np.stack([np.cos(angle), np.sin(angle)]),
            np.stack([-np.sin(angle), np.cos(angle)]),
        )
        motion[nodes, 0, 3 * body : 3 * body + 3] = np.vstack([along, np.ones(m)]).T
        motion[nodes, 1, 3 * body : 3 * body + 3] = np.vstack([normal, 0.1 * rng.normal(size=m)]).T
    began = np.stack([rng.normal(size=2 * m), rng.uniform(-0.5, 0.2, 2 * m)], axis=1)
    resultant = np.moveaxis(motion, 2, 0)
    return Modes(motion, resultant, np.zeros(6)), began, rng.normal(size=6)


def law_of(m):
    return SignoriniCoulomb(np.full(m, 0.2), np.full(m, np.inf), np.ones(m, dtype=bool), 2)


@pytest.mark.parametrize("seed", range(5))
def test_idle_bodies_move_no_more_than_they_must(seed):
    modes, began, moved = drawn(seed)
    v = least_motion(modes, law_of(20), began + modes.motion @ moved, moved)
    beta = np.linalg.lstsq(modes.motion.reshape(40, 6), (v - began).ravel(), rcond=None)[0]
    assert v[:, 1].max() <= 0.0
    assert np.abs(began + modes.motion @ beta - v).max() < 1e-12
    reference = scipy.optimize.minimize(
        lambda b: ((modes.size * b) ** 2).sum(),
        np.zeros(6),
        constraints={"type": "ineq", "fun": lambda b: -(began + modes.motion @ b)[:, 1]},
    )
    assert reference.success
    assert np.linalg.norm(modes.size * beta) == pytest.approx(
        np.linalg.norm(modes.size * reference.x), abs=1e-5
    )


def test_what_carries_is_not_idle():
    modes, _, _ = drawn(0)
    sigma = np.zeros((20, 2))
    sigma[3, 1] = -1.0
    assert idle_motions(modes, law_of(20), sigma).tolist() == [False] * 3 + [True] * 3


def test_what_overlaps_however_it_moves_stays():
    """Two walls that are nearer than the disc is wide."""
    motion = np.array([[[0.0], [1.0]], [[0.0], [-1.0]]])
    modes = Modes(motion, np.moveaxis(motion, 2, 0), np.zeros(1))
    v = np.array([[0.0, 0.1], [0.0, 0.1]])
    assert (least_motion(modes, law_of(2), v, np.array([0.05])) == v).all()
