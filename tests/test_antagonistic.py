"""The antagonistic backstepping law of section 15.5: exact for six states; what the print makes of it."""

from __future__ import annotations

from proofs import column, rate, shifts, spelled_out, vanishes

from awiwi_gen.definitions.backstepping.laws import antagonistic_law

JOINT = q, qd = column("q qd")
TORQUES = tau1, tau1d, tau2, tau2d = column("tau1 tau1d tau2 tau2d")
DESIRED, PRETENSION = column("r:5"), column("o:3")
EXTERNAL = tau_ext, _ = column("tau_ext tau_extd")
INERTIAS = m, b1, b2 = column("m b1 b2")
SPRINGS = s1, c1, s2, c2 = column("slope1 curvature1 slope2 curvature2")
IMPEDANCE = K_p, K_d = column("K_p K_d")
TUNINGS = column("K31 K41 Ct1 Cs1 K32 K42 Ct2 Cs2")
GIVEN = (JOINT, TORQUES, DESIRED, PRETENSION, EXTERNAL, INERTIAS, SPRINGS, IMPEDANCE, TUNINGS)


def flow(motors):
    """Two motors with different nonlinear springs on one link (eq. 15.82)."""
    accelerated = (tau1 - tau2 + tau_ext) / m
    stretch1 = c1 * (tau1d / s1) ** 2 + s1 * ((motors[0] - tau1) / b1 - accelerated)
    stretch2 = c2 * (tau2d / s2) ** 2 + s2 * ((motors[1] - tau2) / b2 + accelerated)
    moving = {q: qd, qd: accelerated, tau1: tau1d, tau1d: stretch1, tau2: tau2d, tau2d: stretch2}
    return moving | shifts(DESIRED, PRETENSION, EXTERNAL)


def test_the_energy_of_all_six_states_falls_but_for_the_power_of_the_outer_torque():
    law = antagonistic_law(*GIVEN)
    motors = [spelled_out(motor) for motor in law.control]
    (et1, et2), (es1, es2) = law.errors
    speed = qd - DESIRED[1]
    K31, K41, Ct1, Cs1, K32, K42, Ct2, Cs2 = TUNINGS
    lost = Ct1 * K31 * et1**2 + Ct2 * K32 * et2**2 + Cs1 * K41 * es1**2 + Cs2 * K42 * es2**2

    assert vanishes(rate(law.energy, flow(motors)) - law.rate)
    assert vanishes(law.rate + K_d * speed**2 + lost - speed * tau_ext)
