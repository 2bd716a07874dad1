"""The flat file of numbers that C reads without a compiler; csrc/awiwi_params_file.h has its layout."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from fractions import Fraction

from awiwi_gen.emit.options import Options

MAGIC, VERSION, HEADER = b"AWIWIPAR", 1, 64
COVERED = struct.Struct("<8sIIII32sI")  # all of the header but its CRC


def pack(values: Sequence[Fraction], digest: str, options: Options) -> bytes:
    """The bytes of a file; ``digest`` is that of the structure, in hexadecimal digits."""
    size = options.bits // 8
    data = b"".join(
        struct.pack("<d" if size == 8 else "<f", options.dtype(x.numerator / x.denominator)) for x in values
    )
    total = HEADER + len(data)
    header = COVERED.pack(MAGIC, VERSION, size, len(values), total, bytes.fromhex(digest), 0)
    return header + struct.pack("<I", zlib.crc32(header + data)) + data
