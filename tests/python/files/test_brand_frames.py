# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Frames in the notation of each brand, against scipy's rotations and numbers worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from truing.errors import InputError
from truing.files.brand_frames import NOTATIONS, Brand, frame_from_numbers, numbers_from_frame

BRANDS: list[Brand] = list(NOTATIONS)


def frames(count: int, seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    out = []
    for R in Rotation.random(count, random_state=seed).as_matrix():
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R, rng.uniform(-2, 2, 3)
        out.append(T)
    return out


def scipy_rotation(brand: Brand, v: np.ndarray) -> np.ndarray:
    if brand == "abb":
        return Rotation.from_quat([v[1], v[2], v[3], v[0]]).as_matrix()
    if brand == "ur":
        return Rotation.from_rotvec(v).as_matrix()
    if brand == "kuka":
        return Rotation.from_euler("ZYX", v, degrees=True).as_matrix()
    return Rotation.from_euler("xyz", v, degrees=True).as_matrix()  # about fixed axes


@pytest.mark.parametrize("brand", BRANDS)
def test_numbers_mean_what_scipy_makes_of_them(brand: Brand) -> None:
    for T in frames(50, 1):
        numbers = np.array(numbers_from_frame(brand, T))
        np.testing.assert_allclose(scipy_rotation(brand, numbers[3:]), T[:3, :3], atol=1e-12)
        np.testing.assert_allclose(numbers[:3] * NOTATIONS[brand].length, T[:3, 3], rtol=1e-15)
        np.testing.assert_allclose(frame_from_numbers(brand, numbers), T, atol=1e-12)


@pytest.mark.parametrize("brand", BRANDS)
@pytest.mark.parametrize("angle", [0.0, 1e-13, 1e-7, np.pi - 1e-9, np.pi])
@pytest.mark.parametrize(
    "axis", np.eye(3).tolist() + [[0.6, 0.0, -0.8], [0.0, 0.7071067811865476, -0.7071067811865476]]
)
def test_small_and_half_turns_lose_nothing(brand: Brand, angle: float, axis: list[float]) -> None:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(np.array(axis) * angle).as_matrix()
    np.testing.assert_allclose(frame_from_numbers(brand, numbers_from_frame(brand, T)), T, atol=1e-14)


@pytest.mark.parametrize("brand", ["kuka", "fanuc", "yaskawa"])
@pytest.mark.parametrize("middle", [90.0, -90.0, 90 - 1e-8, 89.9999])
def test_gimbal_lock_loses_nothing(brand: Brand, middle: float) -> None:
    numbers = (1.0, 2.0, 3.0, 33.0, middle, -120.0)
    T = frame_from_numbers(brand, numbers)
    np.testing.assert_allclose(frame_from_numbers(brand, numbers_from_frame(brand, T)), T, atol=1e-14)
    np.testing.assert_allclose(numbers_from_frame(brand, T, like=numbers), numbers, atol=1e-3)


def test_hand_checked_frames() -> None:
    """A quarter turn about z after one about y: x goes to -z, y to -x, z to y."""
    R = np.array([[0, -1, 0], [0, 0, 1], [-1, 0, 0]], dtype=float)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, (0.1, -0.2, 0.3)
    np.testing.assert_allclose(R, scipy_rotation("kuka", np.array([90, 90, 0])), atol=1e-15)
    np.testing.assert_allclose(frame_from_numbers("kuka", [100, -200, 300, 90, 90, 0]), T, atol=1e-15)
    np.testing.assert_allclose(frame_from_numbers("fanuc", [100, -200, 300, 0, 90, 90]), T, atol=1e-15)
    np.testing.assert_allclose(frame_from_numbers("yaskawa", [100, -200, 300, 0, 90, 90]), T, atol=1e-15)
    np.testing.assert_allclose(
        frame_from_numbers("abb", [100, -200, 300, 0.5, -0.5, 0.5, 0.5]), T, atol=1e-15
    )
    third = 2 * np.pi / 3 / np.sqrt(3)  # a third of a turn about (-1, 1, 1)
    np.testing.assert_allclose(
        frame_from_numbers("ur", [0.1, -0.2, 0.3, -third, third, third]), T, atol=1e-15
    )


LIKE: list[tuple[Brand, list[float]]] = [
    ("kuka", [0, 0, 0, -180.0, 10, 179]),
    ("kuka", [0, 0, 0, 30, 100.0, -170]),
    ("fanuc", [0, 0, 0, -180.0, 0, 350]),
    ("yaskawa", [0, 0, 0, 180.0, 23.13, 0]),
    ("abb", [0, 0, 0, -0.5, 0.5, -0.5, -0.5]),
    ("ur", [0, 0, 0, 0, 3.3, 0]),
    ("ur", [0, 0, 0, 0.0, -3.1415926, 0.2]),
    ("ur", [0, 0, 0, 0, 0, 2 * np.pi]),
]


@pytest.mark.parametrize(("brand", "numbers"), LIKE)
def test_the_way_of_writing_stays(brand: Brand, numbers: list[float]) -> None:
    T = frame_from_numbers(brand, numbers)
    np.testing.assert_allclose(numbers_from_frame(brand, T, like=numbers), numbers, atol=1e-9)


@pytest.mark.parametrize(
    ("brand", "numbers", "message"),
    [
        ("kuka", [1, 2, 3, 4, 5], "found 5 numbers, expected X Y Z A B C"),
        ("abb", [0, 0, 0, 1, 0, 0, 0.1], "has length 1.00499, expected 1"),
        ("ur", [0, 0, float("nan"), 1, 0, 0], "expected finite numbers"),
    ],
)
def test_what_is_no_frame_is_refused(brand: Brand, numbers: list[float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        frame_from_numbers(brand, numbers)
