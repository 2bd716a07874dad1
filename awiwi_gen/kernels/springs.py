"""The kernels of the lever springs and of their angle sensors."""

from __future__ import annotations

from typing import Any

from awiwi_gen.hand import Hand, Spring
from awiwi_gen.hand.lever import POWERS, Lever
from awiwi_gen.kernel import Kernel, Port
from awiwi_gen.kernels.declare import Family, Parameterless
from awiwi_gen.units import N, m, one, rad

of_spring: Family[None] = Family("spring_curve")
of_sensors: Family[int] = Family("spring_curve")  # sized by the number of tendons
of_bench: Family[None] = Family("calibration")

WITHIN = ("the argument is within the lever's travel, with a margin of 0.4 %",)


def spring_kernels(hand: Hand, spring: Spring) -> list[Kernel]:
    """All kernels of the spring, which all tendons share, and of its sensors, which may differ."""
    structure = {"spring": spring.structure(), "tendons": hand.tendons}
    ports, bench = spring_ports(spring), bench_ports(spring)
    sensors = {"readings": reading_port(spring, hand.tendons)}
    return [
        *of_spring.kernels("spring", spring, "spring", structure, ports, None),
        *of_sensors.kernels("calibration", spring, "spring", structure, sensors, hand.tendons),
        *of_bench.kernels("calibration", Parameterless(), "calibration", {"powers": POWERS}, bench, None),
    ]


def spring_ports(spring: Spring) -> dict[str, Port]:
    """Lever angle, elongation and force, with the ranges of the lever's travel."""
    lever = Lever(spring)
    return {
        "theta": Port((), rad, *sorted((lever.slack, lever.taut))),
        "x": Port((), m, 0.0, lever.travel),
        "f": Port((), N, lever.at(lever.slack).force, lever.at(lever.taut).force),
    }


def reading_port(spring: Spring, tendons: int) -> Port:
    """The readings of all sensors [counts]."""
    calibrated = spring.calibrated
    sensors = [calibrated.get(tendon, spring).sensor for tendon in range(tendons)]
    ends = [sorted((float(sensor.slack), float(sensor.taut))) for sensor in sensors]
    return Port((tendons,), one, tuple(low for low, _ in ends), tuple(high for _, high in ends))


def bench_ports(spring: Spring) -> dict[str, Port]:
    """One reading, the sensor's ends, up to a sixteenth of the travel off the designed ones, and coefficients."""
    lever = Lever(spring)
    slack, taut = float(spring.sensor.slack), float(spring.sensor.taut)
    play, (low, high) = abs(taut - slack) / 16, sorted((slack, taut))
    pose = lever.at(lever.taut)
    path = lever.at(lever.slack).path
    return {
        "counts": Port((), one, low + play, high - play),
        "ends": Port((2,), one, (slack - play, taut - play), (slack + play, taut + play)),
        "force_powers": Port((POWERS,), N, -pose.force, pose.force),
        "stiffness_powers": Port((POWERS,), N / m, -pose.stiffness, pose.stiffness),
        "length_powers": Port((POWERS,), m, -path, path),
    }


def tendon_state(shape: tuple[int, ...]) -> dict[str, Port]:
    """The tendon's length in the mechanism, its force and its stiffness."""
    return {"dL": Port(shape, m), "force": Port(shape, N), "stiffness": Port(shape, N / m)}


@of_spring(
    lambda _: tendon_state(()),
    "table 4.1, figure 4.6",
    subject="spring",
    guards=(
        "the roller is clear of the motor's pulley",
        "the roller is clear of the fixed pulley",
        "the tendon pulls the lever towards its taut end",
        "the spring is stretched",
    ),
)
def lever(spring: Any, theta: Any) -> Any:
    """Length dL of tendon in the mechanism, force and stiffness of the tendon at the lever angle theta."""


@of_spring(lambda _: {"f": Port((), N)}, "figure 4.7", guards=WITHIN)
def force(spring: Any, x: Any) -> Any:
    """Tendon force at the elongation x, counted from the slack end of the lever's travel.

    A polynomial; checking the hand file ensures that it differs from the mechanism by less than 1e-6 of the largest force.
    """


@of_spring(lambda _: {"k": Port((), N / m)}, "figure 4.7", guards=WITHIN)
def stiffness(spring: Any, x: Any) -> Any:
    """Tendon stiffness at the elongation x, counted from the slack end of the lever's travel."""


@of_spring(lambda _: {"x": Port((), m)}, "figure 4.7", guards=WITHIN)
def elongation(spring: Any, f: Any) -> Any:
    """Elongation at which the tendon's force is f."""


@of_sensors(lambda tendons: tendon_state((tendons,)), "section 4.1", guards=WITHIN)
def readings(spring: Any, readings: Any) -> Any:
    """dL, force and stiffness of every tendon from its sensor, by the design or by the tendon's own calibration."""


@of_sensors(lambda tendons: {"dL": Port((tendons,), m), "force": Port((tendons,), N)}, "section 4.1", guards=WITHIN)
def tensions(spring: Any, readings: Any) -> Any:
    """dL and force of every tendon from its sensor: what a tick of the hand needs of `calibration_readings`."""


@of_bench(lambda _: tendon_state(()), "section 4.1", guards=WITHIN)
def polynomials(_: Any, counts: Any, ends: Any, length_powers: Any, force_powers: Any, stiffness_powers: Any) -> Any:
    """dL, force and stiffness at one sensor's counts by polynomials from the bench, constant coefficient first.

    The argument is (2 counts - ends[0] - ends[1]) / (ends[1] - ends[0]): -1 at the slack end, 1 at the taut end.
    """
