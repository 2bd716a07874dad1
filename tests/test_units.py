"""Units: exact numbers in, and an algebra that knows what fits."""

from __future__ import annotations

import math
import re
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from awiwi_gen.errors import InputError
from awiwi_gen.units import A, Hz, J, N, Pa, Unit, V, W, kg, m, name_of, one, parse_quantity, parse_unit, rad, s

BASES = [m, kg, s, A, rad, N, J, W, V, Pa, Hz]
units = st.lists(st.tuples(st.sampled_from(BASES), st.integers(-3, 3)), max_size=4).map(
    lambda powers: math.prod((unit**power for unit, power in powers), start=one)
)


@pytest.mark.parametrize(
    ("text", "value", "label"),
    [
        ("6.5 mm", Fraction(13, 2000), "m"),
        ("6.2 mm", Fraction(62, 10000), "m"),
        ("  .62cm ", Fraction(62, 10000), "m"),
        ("6200 um", Fraction(62, 10000), "m"),
        ("6200 µm", Fraction(62, 10000), "m"),
        ("-1.2 g", Fraction(-12, 10000), "kg"),
        ("35 g mm^2", Fraction(35, 10**9), "kg m^2"),
        ("35 g*mm^2", Fraction(35, 10**9), "kg m^2"),
        ("7 N/mm", Fraction(7000), "N/m"),
        ("9.81 m/s^2", Fraction(981, 100), "m/s^2"),
        ("1e-3 N m s/rad", Fraction(1, 1000), "N m s/rad"),
        ("2 kg/(m s^2)", Fraction(2), "kg/(m s^2)"),
        ("4 1/s", Fraction(4), "1/s"),
        ("0.5", Fraction(1, 2), "1"),
        ("3.3 V", Fraction(33, 10), "V"),
        ("250 mA", Fraction(1, 4), "A"),
        ("2 GPa", Fraction(2 * 10**9), "Pa"),
        ("3 kHz", Fraction(3000), "Hz"),
    ],
)
def test_text_is_read_exactly(text: str, value: Fraction, label: str) -> None:
    quantity = parse_quantity(text)
    assert quantity.value == value
    assert quantity.unit.label == label


def test_a_float_is_rounded_only_once() -> None:
    assert float(parse_quantity("6.5 mm")) == 0.0065
    assert float(parse_quantity("0.1 mm")) == 0.0001
    assert float(parse_quantity("180 deg")) == math.pi
    assert float(parse_quantity("-20 deg")) == pytest.approx(math.radians(-20), rel=1e-15)


def test_a_degree_is_exact_to_a_hundred_digits() -> None:
    mpmath = pytest.importorskip("mpmath")
    with mpmath.workdps(110):
        half_turn = parse_quantity("180 deg").value
        assert abs(mpmath.mpf(half_turn.numerator) / half_turn.denominator - mpmath.pi) < mpmath.mpf(10) ** -99


def test_the_same_number_in_other_words_is_the_same_quantity() -> None:
    assert parse_quantity("6.2 mm") == parse_quantity("0.62 cm")
    assert hash(parse_quantity("6.2 mm")) == hash(parse_quantity("0.62 cm"))
    assert str(parse_quantity("0.62 cm")) == "0.62 cm"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "does not begin with a number"),
        ("mm", "does not begin with a number"),
        ("nan", "does not begin with a number"),
        ("inf mm", "does not begin with a number"),
        ("-inf mm", "does not begin with a number"),
        ("６ mm", "does not begin with a number"),
        ("0x10 mm", 'unknown unit "x10"'),
        ("1_000 mm", 'unknown unit "_000"'),
        ("1,5 mm", 'unknown unit ",5"'),
        ("1e400 mm", "powers of ten end at 30"),
        ("1e-400 mm", "powers of ten end at 30"),
        ("1e999999999", "powers of ten end at 30"),
        ("1e" + "9" * 70, "powers of ten end at 30"),
        ("9" * 100_000, "is longer than 80 characters"),
        ("6 furlong", 'unknown unit "furlong"'),
        ("6 MM", 'unknown unit "MM"; did you mean "mm"?'),
        ("6 Deg", 'unknown unit "Deg"; did you mean "deg"?'),
        ("6 degree", 'unknown unit "degree"; did you mean "deg"?'),
        ("6 mm^", 'unknown unit "mm^"'),
        ("6 mm^99", 'unknown unit "mm^99"'),
        ("6 N/m s", "bracket them"),
        ("6 N/m/s", "bracket them"),
        ("6 N/", "bracket them"),
        ("6 (N m)", 'unknown unit "(N"'),
    ],
)
def test_nonsense_is_refused_with_a_reason(text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_quantity(text)
    assert message in str(caught.value)
    assert len(str(caught.value)) < 250


@given(st.text(max_size=90))
def test_any_text_is_a_quantity_or_an_input_error(text: str) -> None:
    try:
        quantity = parse_quantity(text)
    except InputError:
        return
    assert math.isfinite(quantity)


@given(st.fractions(-(10**9), 10**9, max_denominator=10**6), units)
def test_labels_are_read_back(value: Fraction, unit: Unit) -> None:
    assert parse_unit(unit.label) == unit
    assert parse_unit(unit.label).label == unit.label
    decimal = value.limit_denominator(1000).numerator
    assert parse_quantity(f"{decimal} {unit}").value == decimal


def test_labels_read_as_people_write_them() -> None:
    assert str(N * m / rad) == "N m/rad"
    assert str(kg * m**2) == "kg m^2"
    assert str(m / m) == str(one) == "1"
    assert str(one / s) == "1/s"
    assert str(kg / (m * s**2)) == "kg/(m s^2)"
    assert str(m ** Fraction(1, 2)) == "m^(1/2)"
    assert repr(N / m) == "Unit(N/m)"


def test_units_are_equal_when_their_dimensions_are() -> None:
    assert N * m == J == kg * m**2 / s**2 == W * s
    assert m * rad == m
    assert len({N * m, J, N * m / rad}) == 1
    assert N * m != N
    assert (m**2) ** Fraction(1, 2) == m


@given(units, units, units)
def test_the_algebra_is_a_group(a: Unit, b: Unit, c: Unit) -> None:
    assert a * b == b * a
    assert (a * b) * c == a * (b * c)
    assert a / a == one
    assert (a * b) ** 2 == a**2 * b**2
    assert hash(a * b) == hash(b * a)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0.25 in", 'is in inches, which are not read; did you mean "6.35 mm"?'),
        ("2 lb", 'is in pounds, which are not read; did you mean "907.18474 g"?'),
        ("35 g mm²", 'has the unknown unit "mm²"; did you mean "mm^2"?'),
        ("2 m s⁻¹", 'has the unknown unit "s⁻¹"; did you mean "s^-1"?'),
        ("3 mm2", 'has the unknown unit "mm2"; did you mean "mm^2"?'),
        ("3 MM", 'has the unknown unit "MM"; did you mean "mm"?'),
        ("3 foo", 'has the unknown unit "foo"'),
    ],
)
def test_an_unknown_unit_suggests_what_was_meant(text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_quantity(text)
    (fault,) = caught.value.faults
    assert fault.message == message
    for suggested in re.findall(r'did you mean "(.*)"', message):
        assert parse_quantity(suggested if suggested[0].isdigit() else f"1 {suggested}")


def test_dimensions_have_english_names() -> None:
    assert name_of(N) == "a force"
    assert name_of(m) == name_of(m * rad) == "a length"
    assert name_of(kg * m**2) == "a moment of inertia"
    assert name_of(one) == "a plain number"
    assert name_of(rad) == "an angle"
    assert name_of(kg**2 / s) == "a quantity in kg^2/s"


def test_an_angular_velocity_is_not_called_a_frequency() -> None:
    assert rad / s == Hz
    assert name_of(rad / s) == "an angular velocity"
    assert name_of(Hz) == "a frequency"
    assert parse_quantity("60 rpm").unit.radians == 1
