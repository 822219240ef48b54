# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Labels in sealed envelopes: the seal is given away before the answer, the envelope is opened after it."""

from __future__ import annotations

import hashlib
import json
import secrets
from dataclasses import dataclass
from typing import Any

import numpy as np

import truing

_COLUMNS = (
    "joints",
    "positions",
    "orientations",
    "directions",
    "payload",
    "temperature",
    "time",
    "joint_speeds",
    "targets",
    "pose",
)
"""What `scenes` hands over, besides covariates."""


@dataclass(frozen=True)
class Envelope:
    """A label, and the salt that keeps it from being guessed by its seal."""

    text: str
    salt: str

    @property
    def seal(self) -> str:
        return hashlib.sha256((self.salt + self.text).encode()).hexdigest()


class BrokenSealError(Exception):
    """A label is not the one that was sealed."""


def sealed(label: dict[str, Any]) -> Envelope:
    return resealed(label, secrets.token_hex(16))


def resealed(label: dict[str, Any], salt: str) -> Envelope:
    """A label, made anew, with the salt of its seal."""
    return Envelope(json.dumps(label, sort_keys=True), salt)


def opened(envelope: Envelope, seal: str) -> dict[str, Any]:
    """The label, if it is the one of `seal`; else BrokenSealError."""
    if envelope.seal != seal:
        raise BrokenSealError("the label is not the one that was sealed before the answer")
    label: dict[str, Any] = json.loads(envelope.text)
    return label


def fingerprint(data: truing.Measurements) -> str:
    """Of all columns: says which data were handed over."""
    digest = hashlib.sha256()
    for name in _COLUMNS:
        column = getattr(data, name)
        digest.update(name.encode() if column is None else np.ascontiguousarray(column).tobytes())
    for name, column in sorted(data.covariates.items()):
        digest.update(name.encode() + np.ascontiguousarray(column).tobytes())
    return digest.hexdigest()
