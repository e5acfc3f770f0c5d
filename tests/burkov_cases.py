"""Machines and gains on which the laws of Burkov (1998) are tried, with figures computed elsewhere.

The figures come from two implementations other than this one, MuJoCo with a continuous law and
Lagrange's or Euler-Poisson's equations derived symbolically, which agree to 1e-10 or better.
"""

import numpy as np

from controllers import burkov
from controllers.programmes import Harmonic
from spacecraft_sim.euler_poisson import RigidBody
from spacecraft_sim.mechanisms import FlexibleJointArm, PlanarArm

# Two links under gravity; the length of the last has no effect.
ARM = PlanarArm(lengths=(1.0, 1.0), centres=(0.5, 0.4), masses=(3.0, 2.0), inertias=(0.3, 0.12))
TARGET = (0.6, -0.9)
GAINS = {"K1": ((80.0, 9.0), (9.0, 40.0)), "K2": (600.0, 250.0), "K3": (20.0, 25.0)}

# Three links through springs, no gravity.
LINKS = PlanarArm(
    lengths=(0.5, 0.4, 0.3),
    centres=(0.25, 0.2, 0.15),
    masses=(2.0, 1.5, 1.0),
    inertias=(0.05, 0.03, 0.012),
    g=0.0,
)
FLEXIBLE = FlexibleJointArm(links=LINKS, rotors=(0.2, 0.1, 0.05), stiffnesses=(100.0, 60.0, 30.0))
FLEXIBLE_TARGET = (0.5, -0.8, 0.6)
FLEXIBLE_GAINS = {"K0": (40.0, 25.0, 12.0), "K2": (400.0, 250.0, 120.0), "K3": (20.0,) * 3}

PROGRAMME = Harmonic(mean=(0.0, 0.0), amplitude=(0.8, 0.6), frequency=(1.5, 2.0), phase=(0.0, 0.5))
PATH_GAINS = {"K0": (4.0, 2.0), "K1": (1.0, 0.5), "K3": (1.0, 1.0), "K4": (1.0, 1.0)}

BODY = RigidBody(inertia=(0.9, 1.6, 1.0))
R2 = (-0.86868687, 0.49494949, 0.02020202)
R3 = (-0.46464646, -0.82828283, 0.31313131)
VECTORS = {"r2": R2, "r3": R3, "k2": 2.0, "k3": 1.2}
RATED = {"G": (1.5, 1.8, 1.2)}
UNRATED = {
    "G2": (8.0, 9.0, 7.0),
    "G3": (6.0, 8.0, 9.0),
    "D2": (5.0, 4.0, 6.0),
    "D3": (6.0, 5.0, 4.0),
}
SPIN = {"alpha": 1.0, "beta": 1.0, "gamma": 1.0, "k": 1.6}


def position(**changes):
    """The law (2.1) on the two links, with some arguments changed."""
    return burkov.position(ARM, **{"target": TARGET, **GAINS, **changes})


def path(**changes):
    """The law (3.1) on the two links, with some arguments changed."""
    arguments = {"programme": PROGRAMME, **PATH_GAINS, "gamma": 50.0, "nu": 30.0, **changes}
    return burkov.path(ARM, **arguments)


def flexible(**changes):
    """The law (4.2) on the three links with springs, with some arguments changed."""
    return burkov.flexible_joint(
        FLEXIBLE, **{"target": FLEXIBLE_TARGET, **FLEXIBLE_GAINS, **changes}
    )


def vectors(*, rated, **changes):
    """The law (5.4), with measured rates, or (5.8), with some arguments changed."""
    return burkov.body_vectors(BODY, **{**VECTORS, **(RATED if rated else UNRATED), **changes})


def goal():
    """The attitude s_i = r_i, rows s1, s2, s3."""
    law, _ = vectors(rated=True)
    r2, r3 = law.formula.r
    return np.array([np.cross(r2, r3), r2, r3])


def named(matrix, names):
    """Readings as columns, one row a sample, of a trajectory."""
    return np.array([matrix[name] for name in names]).T
