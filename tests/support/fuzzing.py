# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Files with bytes cut, doubled, swapped and replaced."""

from __future__ import annotations

from hypothesis import HealthCheck, settings, strategies as st

quick = settings(
    max_examples=200, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck)
)

# Pieces that files go wrong with.
TOKENS = [
    b"",
    b",",
    b"\n",
    b"\r",
    b"\r\n",
    b"\t",
    b" ",
    b'"',
    b"'",
    b"\x00",
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"\xe9",
    b"nan",
    b"inf",
    b"-inf",
    b".nan",
    b".inf",
    b"1e999",
    b"-1e-999",
    b"1e99999999999999999999",
    b"0",
    b"-0",
    b"-1",
    b"1e300",
    b"9" * 400,
    b"1_0",
    b"0x1f",
    b"1:30",
    b"null",
    b"~",
    b"true",
    b"{",
    b"}",
    b"[",
    b"]",
    b"[]",
    b"{}",
    b": ",
    b"- ",
    b"? ",
    b"&a ",
    b"*a",
    b"!!float ",
    b"!x ",
    b"<<: ",
    b"|",
    b">",
    b"%",
    b"@",
    b"#",
    b"---\n",
    b"...\n",
    b"\\ud800",
    b'"\\ud800"',
    b'"\\UFFFFFFFF"',
    b"m",
    b"mm",
    b"deg",
    b"rad",
    b"urdf",
    b"mdh",
    b"joints: []\n",
    b"q1_rad",
    b"q3_rad",
    b"x_m",
    b"target",
    b"set",
    b"<",
    b">",
    b"</robot>",
    b"&lt;",
    b"\xf0\x9f\x98\x80",
    b"\xc2\x85",
]


@st.composite
def mutated(draw: st.DrawFn, original: bytes) -> bytes:
    """`original` with a few pieces cut, doubled, swapped or replaced."""
    data = original
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(data)))
        end = min(len(data), start + draw(st.sampled_from([0, 1, 1, 2, 5, 20, 100])))
        kind = draw(st.sampled_from(["replace", "replace", "cut", "double", "byte", "line"]))
        if kind == "replace":
            data = data[:start] + draw(st.sampled_from(TOKENS)) + data[end:]
        elif kind == "cut":
            data = data[:start] + data[end:]
        elif kind == "double":
            data = data[:end] + data[start:]
        elif kind == "byte":
            data = data[:start] + draw(st.binary(min_size=1, max_size=3)) + data[end:]
        else:
            lines = data.split(b"\n")
            first, second = draw(st.integers(0, len(lines) - 1)), draw(st.integers(0, len(lines) - 1))
            lines[first], lines[second] = lines[second], lines[first]
            data = b"\n".join(lines)
    return data
