"""Stabilisation of a mechanical system, and of a rigid body, without measuring velocities.

I. V. Burkov, "Stabilization of a natural mechanical system without measuring its velocities, with
an application to the control of a rigid body" (1998, in Russian).

Plant.  A(q) q'' + b(q, q') + g(q) = M (1.2), links driven through springs (4.1), or a rigid body
about its centre of mass, Theta om' + om x Theta om = M, s_i' = s_i x om (5.1)-(5.3).

Laws.  A filter w' = -K w + z' of what is measured, z, takes the place of its velocity:

- `position`: M = -K1 (q - q_p) - K2 w + g(q), (2.1): asymptotically stable in the large.
  With g(q_p) for g(q), (2.4): if K1 + g_q(q_p) > 0, nearby.
- `path`: M = M_p - gamma (K0 x + kappa K1 w), (3.1): nearby, if the gains are large enough; no
  bound of them is known.  Without M_p, (3.7): it stays in a tube of O(1/gamma).
- `flexible_joint`: M = -K0 (q2 - q2_p) - K2 w2, (4.2), q2 of the rotors: in the large, no gravity.
- `body_vectors`: M = -G om + sum k_i r_i x s_i, (5.4), or without rates
  M = sum (s_i x G_i w_i + k_i r_i x s_i), (5.8): from V(0) < 2 min(k2, k3) for certain.
- `permanent_rotation`: M_x = -alpha (p - p_p), M_y = -beta q - k s_z, M_z = -gamma r + k s_y,
  (5.18): if 4 beta gamma > p_p^2 (B - C)^2, (5.19), from V(0) < 2 k for certain.
- `two_torques`: the same without M_x, (5.20): if c^2 (B - C)^2 < 4 beta gamma for the spin c.

Only (5.4), (5.18) and (5.20) read rates.  The laws are those of the paper as corrected: what is
printed otherwise, and one theorem that is false as it stands, are listed in ERRATA.md.
"""

from controllers.burkov_attitude import body_axes, body_vectors, permanent_rotation, two_torques
from controllers.burkov_mechanisms import flexible_joint, position
from controllers.burkov_path import path

__all__ = [
    "body_axes",
    "body_vectors",
    "flexible_joint",
    "path",
    "permanent_rotation",
    "position",
    "two_torques",
]
