"""Logs of a tick: run again with the same bits; a log that is none is refused in one sentence."""

from __future__ import annotations

import pytest

from awiwi_gen.errors import InputError
from awiwi_gen.tick.log import Writer, replay
from awiwi_gen.tick.loop import ClosedLoop

TICKS = 200


@pytest.fixture(scope="module")
def log(lib, tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "hand.log"
    loop = ClosedLoop(lib, seed=3)
    with path.open("wb") as stream:
        write = Writer(stream, loop)
        for tick in range(TICKS):
            loop.hand.measure(loop.step.input)
            loop.step.input.law = int(tick > TICKS / 2)
            loop.step.input.q_des = loop.start + 0.1
            loop.step.gains.motor_kp = 100 + tick // 50
            loop.hand.move(loop.step.step())
            write(loop)
    return path


def test_a_log_runs_again_with_the_same_bits(lib, log):
    found = replay(lib, log)

    assert found.ticks == TICKS
    assert found.first_difference == -1
    assert found.telemetry["torque"].tobytes() == found.torque.tobytes()
    assert found.telemetry["q"].shape == (TICKS, 19)


@pytest.mark.parametrize("part", ["torque", "input"])
def test_one_other_bit_is_found_in_its_tick(lib, log, tmp_path, part):
    """The lowest bit of a logged torque, and one of a reading, from which the law computes another torque."""
    size, where = lib.ffi.sizeof("awiwi_hand_record"), lib.ffi.offsetof("awiwi_hand_record", part)
    data = bytearray(log.read_bytes())
    data[lib.ffi.sizeof("awiwi_hand_log") + 150 * size + where + (0 if part == "torque" else 6)] ^= 1
    other = tmp_path / "other.log"
    other.write_bytes(data)

    assert replay(lib, other).first_difference == 150


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda data: b"", "is no log"),
        (lambda data: b"x" + data[1:], "is no log"),
        (lambda data: data[:100], "the head of a log alone"),
        (lambda data: data[:-3], "ends within a record"),
        (lambda data: data[:8] + b"\x09" + data[9:], "version 9; expected 2"),
        (lambda data: data[:12] + b"\x00\x01\x02\x03" + data[16:], "from build 0x03020100"),
    ],
)
def test_a_file_that_is_no_log_of_this_build_is_refused(lib, log, tmp_path, damage, message):
    path = tmp_path / "damaged.log"
    path.write_bytes(damage(log.read_bytes()))
    with pytest.raises(InputError, match=message):
        replay(lib, path)
