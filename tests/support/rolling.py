"""Random problems with elliptic and rolling friction, and the laws as they are written."""

import amontons
import numpy as np

KINDS = ("elliptic-3", "elliptic-4", "elliptic-6", "rolling")
BLOCK = {"elliptic-3": 3, "elliptic-4": 4, "elliptic-6": 6, "rolling": 5}


def cone_of(kind, rng, contacts, size=1.0):
    """Coefficients of moments are of the size of the bodies (m); some are zero."""
    values = rng.uniform(0.1, 1, (contacts, 5))
    values[:, 2:] *= 0.3 * size
    values[rng.random((contacts, 5)) < 0.1] = 0
    if kind == "rolling":
        return amontons.vi.RollingFriction(values[:, 0], values[:, 3])
    return amontons.vi.EllipticFriction(
        values[:, :2],
        values[:, 2] if kind != "elliptic-3" else None,
        values[:, 3:] if kind == "elliptic-6" else None,
    )


def random_problem(kind, seed, size=1.0, compliance=0.0, joints=0):
    """Contacts of random bodies of a size (m), with b = D v + c, c_n >= 0, so that the problem is bounded."""
    rng = np.random.default_rng(seed)
    bodies, contacts = int(rng.integers(2, 6)), int(rng.integers(2, 9))
    body_a = rng.integers(0, bodies, contacts)
    body_b = np.where(rng.random(contacts) < 0.4, -1, (body_a + 1) % bodies)
    normal = rng.normal(size=(contacts, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    inverse_mass = 10 ** rng.uniform(-1, 1, bodies)
    roots = rng.normal(size=(bodies, 3, 3))
    inertia = inverse_mass[:, None, None] * (roots @ roots.transpose(0, 2, 1) / 3 + 0.3 * np.eye(3))
    A = amontons.vi.Contacts(
        inverse_mass,
        inertia / size**2,
        body_a,
        body_b,
        size * rng.normal(size=(contacts, 3)),
        size * rng.normal(size=(contacts, 3)),
        normal,
        compliance,
        direction=np.where(rng.random((contacts, 1)) < 0.5, rng.normal(size=(contacts, 3)), 0),
        rows=BLOCK[kind],
        joint_body_a=np.zeros(joints, int),
        joint_body_b=np.full(joints, -1),
        joint_jacobian_a=rng.normal(size=(joints, 6)),
        joint_jacobian_b=np.zeros((joints, 6)),
    )
    velocities = rng.normal(size=(bodies, 6))
    velocities[:, 3:] /= size
    b = A.stored().jacobian() @ velocities.ravel()
    b[: contacts * BLOCK[kind] : BLOCK[kind]] += 0.3 * rng.integers(0, 2, contacts)
    cones = [cone_of(kind, rng, contacts, size), amontons.vi.Bilateral(joints)]
    return amontons.vi.Problem(A, b, cones)


def de_saxce(cone, u):
    """The largest power, per unit of normal force, that friction can take out of the motion u, (n, rows)."""
    if isinstance(cone, amontons.vi.RollingFriction):
        return cone.mu * np.hypot(u[:, 1], u[:, 2]) + cone.rolling * np.hypot(u[:, 3], u[:, 4])
    return np.linalg.norm(np.stack(cone.parameters, axis=1) * u[:, 1:], axis=1)


def friction_used(cone, x):
    """How much of the normal force the friction of x, (n, rows), asks for: at most x_n inside the cone."""
    if isinstance(cone, amontons.vi.RollingFriction):
        pairs = [(np.hypot(x[:, 1], x[:, 2]), cone.mu), (np.hypot(x[:, 3], x[:, 4]), cone.rolling)]
    else:
        pairs = [(np.abs(x[:, k]), mu) for k, mu in enumerate(cone.parameters, 1)]
    used = [np.divide(part, mu, where=mu > 0, out=np.where(part > 1e-9, np.inf, 0.0)) for part, mu in pairs]
    return np.max(used, axis=0) if len(pairs) == 2 else np.linalg.norm(used, axis=0)


def check_laws(problem, s, law):
    """The law itself, in the user's units and without any code of the solver, to what the residual leaves."""
    cone = problem.cones[0]
    rows = cone.rows
    u = problem.A @ s.x + problem.b
    assert np.allclose(u, s.u, rtol=0, atol=1e-9 * (1 + np.abs(u).max()))
    slow = 1e-8 + 1e3 * s.residual * (1 + np.abs(problem.b).max())
    small = 1e-8 + 1e3 * s.residual * (1 + np.abs(s.x).max())
    tolerance = small * (1 + np.abs(u).max())
    assert np.allclose(u[rows:], 0, atol=slow)
    x, u = s.x[:rows].reshape(cone.n, -1), u[:rows].reshape(cone.n, -1)
    assert np.all(friction_used(cone, x) <= x[:, 0] + 100 * small)  # coefficients of 0.01 and more
    power = np.sum(x[:, 1:] * u[:, 1:], axis=1)  # of friction
    term = de_saxce(cone, u)
    if law == "coulomb":
        assert np.all(u[:, 0] >= -slow)
        assert np.allclose(x[:, 0] * u[:, 0], 0, atol=tolerance)
        assert np.allclose(power, -x[:, 0] * term, atol=tolerance)  # maximal dissipation
    else:
        assert np.all(u[:, 0] >= term - slow)
        assert np.allclose(x[:, 0] * u[:, 0] + power, 0, atol=tolerance)
