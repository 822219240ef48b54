# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A sheet of joint zeros, with their signs in words: for whoever stands at the controller.

Mastering counts and machine data are not written: they carry the safety functions of the robot, and only its
own procedures change them.
"""

from __future__ import annotations

import csv
import io
import math
from importlib import resources

from truing import _core
from truing.controllers.distances import between, dropped_effects, dropped_links, dropped_ratios, poses_of
from truing.controllers.frames import BRANDS, NamedFrame, in_flange, inverse, printed
from truing.controllers.nearest import Nearest
from truing.controllers.written import Written, numbers
from truing.files import NOTATIONS
from truing.report.words import escaped

SHEET = "zeros.html"
TABLE = "zeros.csv"
_DIGITS = {"deg": 4, "mm": 4}
_REASON = "a joint zero is no place for it"
WHY = (
    "Mastering counts and machine data are not written by this program: limits, monitored zones and stops of"
    " the safety controller hang on them (FANUC DCS, KUKA SafeOperation), a wrong count moves the arm where"
    " nobody expects it, and they can only be put in by the maker's own mastering procedure. Use that"
    " procedure, check the marks of every axis afterwards at low speed, and touch up programs that were"
    " taught with the old zeros."
)


def written(found: Nearest, calibrated: _core.Robot) -> Written:
    robot = found.robot
    again = robot.copy()
    rows = []
    for index in robot.driven_joints():
        joint = again.joints[index]
        unit, scale = ("deg", 180 / math.pi) if joint.type == "revolute" else ("mm", 1e3)
        text = numbers([joint.offset * scale], _DIGITS[unit])[0]
        rows.append((joint.name, text, unit))
        joint.offset = float(text) / scale
    bare = calibrated.replace(targets=[calibrated.targets[0]])
    remaining = between(bare, again, poses_of(calibrated))
    first, last = rows[0][0], rows[-1][0]
    lines = [(name, words(text, unit)) for name, text, unit in rows]
    lines[0] = (first, "none of its own: the base takes it")
    lines[-1] = (last, "none of its own: the tool takes it")
    frames = [
        NamedFrame("tool", in_flange(robot.targets[0], found.T_last_flange), True, "tool in the flange"),
        NamedFrame("base", inverse(robot.T_measurement_base), False, "measurement frame in the robot's base"),
    ]
    notes = [
        f"{first} and {last} have no zero of their own: that of {first} cannot be told from the base, that"
        f" of {last} not from the tool; enter tool and base with the zeros",
        WHY,
    ]
    head = (
        f"With these zeros, tool and base the controller's robot is {1e3 * remaining.rms:.3f} mm (rms) from"
        f" the calibrated one, at most {1e3 * remaining.largest:.3f} mm; with tool and base alone"
        f" {1e3 * found.before.rms:.3f} mm."
    )
    return Written(
        files={SHEET: _sheet(calibrated.name, head, lines, frames, notes), TABLE: _table(rows)},
        values={
            "zeros": {name: {"offset": float(text), "unit": unit} for name, text, unit in rows},
        },
        lines=lines,
        dropped=[
            dropped_links(remaining, _REASON),
            *dropped_ratios(calibrated, _REASON),
            *dropped_effects(calibrated, _REASON),
        ],
        notes=notes,
        remaining=remaining,
        before=found.before,
    )


def words(text: str, unit: str) -> str:
    """What an offset means at the machine: offset 0.1 deg, the joint stands 0.1 deg further on than it
    says.
    """
    value = float(text)
    if value == 0:
        return "0: the joint stands where the controller says"
    size = text.lstrip("-")
    further = "further on in its positive" if value > 0 else "further in its negative"
    shows = f"-{size}" if value > 0 else f"+{size}"
    sign = "+" if value > 0 else ""
    return (
        f"{sign}{text} {unit}: the joint stands {size} {unit} {further} direction than the controller says;"
        f" at its true zero the controller shows {shows} {unit}"
    )


def _table(rows: list[tuple[str, str, str]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["joint", "offset", "unit", "shown_at_true_zero"])
    for name, text, unit in rows:
        opposite = numbers([-float(text)], _DIGITS[unit])[0]
        writer.writerow([name, text, unit, opposite])
    return out.getvalue()


def _sheet(
    name: str, head: str, lines: list[tuple[str, str]], frames: list[NamedFrame], notes: list[str]
) -> str:
    style = (resources.files("truing") / "report" / "page.css").read_text(encoding="utf-8")
    joints = "".join(f"<tr><th>{escaped(joint)}</th><td>{escaped(said)}</td></tr>" for joint, said in lines)
    entries = "".join(
        f"<tr><th>{escaped(frame.about)}, {brand}</th><td>"
        + escaped(
            "  ".join(
                f"{key} {text}"
                for key, text in zip(NOTATIONS[brand].names, printed(brand, frame.T), strict=True)
            )
        )
        + "</td></tr>"
        for frame in frames
        for brand in BRANDS
    )
    remarks = "".join(f"<li>{escaped(note)}</li>" for note in notes)
    policy = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
    style += "\nth { text-align: left; white-space: nowrap } td { text-align: left; white-space: normal }"
    title = f"Joint zeros of {escaped(name)}"

    def card(heading: str, content: str) -> str:
        return f'<section class="card"><h2>{heading}</h2>{content}</section>'

    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        f"<title>{title}</title><style>{style}</style></head>\n"
        f"<body><main><h1>{title}</h1><p>{escaped(head)}</p>"
        + card("Zeros", f"<table>{joints}</table>")
        + card("Tool and base that go with them (mm, deg; ur: m, rad)", f"<table>{entries}</table>")
        + card("Before you enter them", f'<ul class="plain">{remarks}</ul>')
        + "</main></body></html>\n"
    )
