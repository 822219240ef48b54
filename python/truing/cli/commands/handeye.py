# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Find where the camera is, from poses of the hand and of a board, or from images of the board.

Writes result.json, report.html, residuals.csv; camera.yaml if the camera's values were found, next_poses.csv
with --plan, robot.yaml with --with-kinematics.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from truing.cli import run
from truing.cli.options import (
    Angle,
    BaseLink,
    Choice,
    Count,
    EffectNames,
    File,
    Flag,
    Kind,
    Length,
    Names,
    Parts,
    Pixels,
    Seed,
    TipLink,
    core,
    read_with_common_units,
    refused,
    words_of,
)
from truing.cli.tables import AXES, mm, mrad, say, say_first, table
from truing.errors import InputError

if TYPE_CHECKING:
    from truing.files import HandEyeAnswer, HandEyeData
    from truing.files.table import Beside
    from truing.hand_eye import ClockOffset, HandEyeOptions, NextHandPose
    from truing.hand_eye.result import Solved
    from truing.model import Robot

PANEL = "Hand-eye"
IMAGES = "Images"
NOISE = "Noise"
KINEMATICS = "With --with-kinematics"


class Point(Kind):
    """Three lengths; a unit holds for the numbers before it that have none."""

    metavar = "X,Y,Z"

    def read(self, text: str, option: str) -> list[float]:
        parts = words_of(text)
        if len(parts) != 3 or parts[2][-1].isdigit():
            raise refused(
                option,
                text,
                "three lengths with their unit such as 0,0,800mm: x to the right, y down, z out of the lens",
            )
        return read_with_common_units(parts, [Length()] * 3, [option] * 3)


class Sigmas(Parts):
    """Noise of one component of a pose."""

    metavar = "LENGTH,ANGLE"

    def __init__(self, help: str, **common: Any) -> None:
        parts = (Length(above=0), Angle(above=0))
        super().__init__(help, parts, "a length and an angle, such as 0.1mm,0.05deg", **common)


@dataclass(frozen=True)
class Loaded:
    data: HandEyeData | None  # None: the clocks of hand and camera could not be compared
    clock: ClockOffset | None
    robot: Robot | None
    answers: tuple[HandEyeAnswer, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Command(run.Command[Loaded, "Solved | None"]):
    doing = "solving"
    sometimes = ("next_poses.csv",)

    poses: Annotated[
        Path,
        File(
            "Hand poses, and board poses or images, one row per robot pose: CSV or Parquet; or a file of"
            " easy_handeye, MoveIt, OpenCV, ROS messages or lines of matrices; or pose_fPe_%d.yaml, the files"
            " of ViSP.",
            argument=True,
            metavar="POSES",
        ),
    ]
    setup: Annotated[
        Literal["eye-in-hand", "eye-to-hand"],
        Choice("Camera on the hand and board in the cell, or camera in the cell and board on the hand."),
    ] = core("HandEyeOptions", "setup")
    method: Annotated[
        Literal["refined", "closed-form"],
        Choice("Maximum likelihood, or dual quaternions and one SVD alone."),
    ] = core("HandEyeOptions", "method")
    angles: Annotated[
        str,
        Kind(
            "What columns hand_rx_deg … mean: rotation-vector (UR), zyx (KUKA A B C, Fanuc W P R), xyz,"
            " zyz …",
            metavar="CONVENTION",
        ),
    ] = ""
    board_poses: Annotated[
        Path | None,
        File(
            "Board poses in a file of their own; POSES then has hand poses. With times (t_s) in both the"
            " offset of the clocks is found; without they belong together row by row."
        ),
    ] = None
    program: Annotated[
        Path | None,
        File(
            "Robot program of poses (.src, .mod, .ls, .script, .jbi) that gives the hand poses of a table"
            " POSES without columns hand_x_m …: one row per move to a literal target, in their order.",
            metavar="PROGRAM",
        ),
    ] = None
    compare: Annotated[
        Sequence[Path],
        File(
            "Where another program says that the camera is: result of easy_handeye, MoveIt, OpenCV, ViSP or"
            " truing."
            " May be repeated.",
            several=True,
        ),
    ] = ()
    working_point: Annotated[
        list[float] | None,
        Point(
            "Where accuracy is asked for, in the camera frame: 0,0,800mm. Default: the mean of the board's"
            " positions."
        ),
    ] = None
    known_height: Annotated[
        float | None,
        Length("If the hand turned about parallel axes only: the camera's coordinate along them, 850mm."),
    ] = None
    keep_all: Annotated[bool, Flag("Reject no pose.")] = False
    reading: Annotated[
        str, Kind("Read the numbers as this reading, which an earlier run proposed.", metavar="NAME")
    ] = ""
    plan: Annotated[
        int, Count("Number of robot poses that would help most, written to next_poses.csv.", most=100)
    ] = 0
    seed: Seed = 0
    board: Annotated[
        str,
        Kind(
            "What is in the images: chessboard:9x6:25mm (inner corners), charuco:5x7:40mm:30mm,"
            " circles:10x10:25.4mm, acircles:4x11:20mm, apriltag:36h11:6x6:88mm:0.3, apriltag:36h11:88mm.",
            metavar="BOARD",
            panel=IMAGES,
        ),
    ] = ""
    camera: Annotated[
        Path | None,
        File("Camera file with focal lengths and distortion. Default: found from the images.", panel=IMAGES),
    ] = None
    refine_camera: Annotated[
        bool, Flag("Find the values of the given camera file anew, from the images.", panel=IMAGES)
    ] = False
    hand_sigma: Annotated[
        tuple[float, float] | None,
        Sigmas(
            "Standard deviation of the robot's poses, one component: 0.1mm,0.05deg. Default: found from the"
            " data.",
            panel=NOISE,
        ),
    ] = None
    camera_sigma: Annotated[
        tuple[float, float] | None,
        Sigmas("Standard deviation of the board's poses, one component; without images.", panel=NOISE),
    ] = None
    pixel_sigma: Annotated[
        float | None,
        Pixels(
            "Standard deviation of the board's points in images: 0.2px. Default: found from the data.",
            above=0,
            panel=NOISE,
        ),
    ] = None
    with_kinematics: Annotated[
        Path | None,
        File(
            "Find the robot's own parameters as well, from columns q1_rad … and this robot file.",
            metavar="ROBOT",
            panel=KINEMATICS,
        ),
    ] = None
    free: Annotated[
        str, Names("Parameters to find, names and globs. Default: all geometry.", panel=KINEMATICS)
    ] = ""
    hold: Annotated[str, Names("Names and globs that stay at nominal.", panel=KINEMATICS)] = ""
    effects: Annotated[
        str, EffectNames("Effects to find as well. `truing effects` lists them.", panel=KINEMATICS)
    ] = ""
    base_link: BaseLink = ""
    tip_link: TipLink = ""

    def load(self, progress: run.Progress) -> Loaded:
        from truing.cli.reading import load_robot
        from truing.files import read_handeye_answer
        from truing.hand_eye.comparison import require_setup
        from truing.hand_eye.reading import load_on_one_clock

        self._require_sense()
        answers = tuple(read_handeye_answer(path) for path in self.compare)
        require_setup(answers, self.setup)
        path = self.with_kinematics
        robot = None if path is None else load_robot(path, self.base_link, self.tip_link)
        if self.board:
            progress.now("finding the board")
        data, clock = load_on_one_clock(
            self.poses,
            board=self.board,
            camera=self.camera,
            angles=self.angles,
            board_poses=self.board_poses,
            beside=self._hand(),
            setup=self.setup,
            progress=progress.of if self.board else None,
        )
        if robot is not None and data is not None:
            self._require_joints(robot, data)
        return Loaded(data, clock, robot, answers)

    def _hand(self) -> Beside | None:
        if self.program is None:
            return None
        from truing.programs import commanded_hand

        return commanded_hand(self.program)

    def _require_sense(self) -> None:
        """Raises InputError about options that need others."""
        if self.program is not None and self.board_poses is not None:
            raise InputError(
                "--program: gives the hand poses of a table POSES; with --board-poses it is POSES"
            )
        if self.board_poses is not None and (self.board or self.camera is not None):
            raise InputError(
                "--board-poses: board poses are given, so --board and --camera have no images to be for"
            )
        if self.board_poses is not None and self.with_kinematics is not None:
            raise InputError(
                "--board-poses: streams have no joints at the camera's times, which --with-kinematics needs"
            )
        for name, given in (
            ("--camera", self.camera is not None),
            ("--refine-camera", self.refine_camera),
            ("--pixel-sigma", self.pixel_sigma is not None),
        ):
            if given and not self.board:
                raise InputError(f"{name}: is about images; say with --board what is in them")
        if self.camera_sigma and self.board:
            raise InputError("--camera-sigma: is about board poses; with images use --pixel-sigma")
        if (self.free or self.hold or self.effects) and self.with_kinematics is None:
            raise InputError(
                "--free, --hold and --effects are about the robot: say which with --with-kinematics"
            )

    def _require_joints(self, robot: Robot, data: HandEyeData) -> None:
        if data.joints is None:
            raise InputError(
                f"{self.poses}: --with-kinematics needs the joints, but there is no column q1_rad (or another"
                " unit)"
            )
        if data.joints.shape[1] != robot.driven_count:
            raise InputError(
                f"{self.poses}: has joints q1 to q{data.joints.shape[1]}, but {self.with_kinematics} has"
                f" {robot.driven_count} driven joints"
            )

    def _keywords(self) -> dict[str, Any]:
        """Of `truing.handeye`; what was not given is found from the data."""
        keywords: dict[str, Any] = {
            "setup": self.setup,
            "method": self.method,
            "reject": not self.keep_all,
            "reading": self.reading,
        }
        if self.hand_sigma:
            keywords["hand_position_sigma"], keywords["hand_rotation_sigma"] = self.hand_sigma
        if self.camera_sigma:
            keywords["camera_position_sigma"], keywords["camera_rotation_sigma"] = self.camera_sigma
        given = {
            "pixel_sigma": self.pixel_sigma,
            "working_point": self.working_point,
            "known_height": self.known_height,
            "refine_camera": self.refine_camera or None,
        }
        return {**keywords, **{name: value for name, value in given.items() if value is not None}}

    def solve(self, loaded: Loaded, progress: run.Progress) -> Solved | None:
        import truing
        from truing.hand_eye.api import handeye_options, handeye_plan
        from truing.hand_eye.result import Solved

        data = loaded.data
        if data is None:
            return None
        keywords = self._keywords()
        options = handeye_options(data, **keywords)
        found = truing.handeye(data, **keywords, raise_if_undecided=False)
        both = None
        following: tuple[NextHandPose, ...] = ()
        if found.status == "done":
            both = self._kinematics(loaded.robot, data, options)
            if self.plan:
                following = handeye_plan(data, found, options=options, count=self.plan, seed=self.seed)
        return Solved(data, options, found, following, loaded.clock, both, self.seed, loaded.answers)

    def _kinematics(self, robot: Robot | None, data: HandEyeData, options: HandEyeOptions) -> Any:
        from truing.hand_eye.api import handeye_with_kinematics

        if robot is None or data.joints is None:
            return None
        return handeye_with_kinematics(
            robot,
            data.joints,
            data,
            options=options,
            free=self.free,
            hold=self.hold,
            effects=self.effects,
            seed=self.seed,
        )

    def write(
        self, folder: Path, loaded: Loaded, found: Solved | None, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.hand_eye.result import write_handeye, write_without_clock

        if found is None:
            assert loaded.clock is not None
            return write_without_clock(folder, loaded.clock, self._keywords(), warnings=warnings)
        return write_handeye(
            folder,
            found,
            warnings=warnings,
            nominal_file=self.with_kinematics,
            base_link=self.base_link,
            tip_link=self.tip_link,
        )

    def table(self, result: Mapping[str, Any], found: Solved | None) -> None:
        if result["status"] == "done":
            print_camera(result)
            print_errors(result)
            print_comparison(result)
            if "clock" in result:
                say(f"clocks: t_hand = t_camera {result['clock']['offset_s']:+.4f} s")
        else:
            print_what_is_missing(result)
        rejected = []
        for pose in result["rejected_poses"]:
            image = f" ({pose['image']})" if "image" in pose else ""
            rejected.append(f"rejected: pose {pose['pose']}{image}: {pose['cause']}")
        say_first(rejected, 12, "more rejected poses: see residuals.csv")
        if result["next_poses"]:
            sigma = mm(result["next_poses"][-1]["working_point_sigma_m"])
            say(
                f"measure next: {self.out / 'next_poses.csv'} ({len(result['next_poses'])} poses, then +-"
                f" {sigma})"
            )

    def failure(self, result: Mapping[str, Any]) -> str:
        return "" if result["status"] == "done" else f"{result['status']}: {result['message']}"


def print_what_is_missing(result: Mapping[str, Any]) -> None:
    for u in result["observability"]["unobservable"]:
        say(f"{u['what']} cannot be seen: {u['advice'].replace('(known height)', '(--known-height)')}")
    for other in result["convention"]["other_readings"]:
        say(f"the loop closes to {mm(other['rms_m'])} if {other['explanation']}: {other['option']}")


def print_camera(result: Mapping[str, Any]) -> None:
    camera, point = result["camera"], result["working_point"]
    sigma = camera["sigma"]
    lines = [
        (axis, f"{camera[f'{axis}_m'] * 1e3:.3f} mm", mm(sigma[f"{axis}_m"]), mrad(sigma[f"r{axis}_rad"]))
        for axis in AXES
    ]
    table(f"camera in the {camera['in']}", ("", "position", "sigma", "sigma about it"), lines)
    say("quaternion w x y z: " + " ".join(f"{camera[name]:.7f}" for name in ("qw", "qx", "qy", "qz")))
    say(
        f"at the working point, {point['in_camera_m'][2] * 1e3:.0f} mm in front of it: +-"
        f" {mm(point['sigma_m'])}, +- {mrad(point['rotation_sigma_rad'])} per axis (1 sigma)"
    )


def print_comparison(result: Mapping[str, Any]) -> None:
    """Beside the answers of other programs."""
    for other in result.get("compared", ()):
        away = f"{mm(other['position_m'])}, {mrad(other['rotation_rad'])} from ours"
        line = f"{other['file']} ({other['tool']}): {away}"
        if other["largest_sigmas"] is not None:
            line += f", at most {other['largest_sigmas']:.2g} sigma in a component"
        if other["closure"] is not None:
            theirs, ours = (mm(other[name]["rms_m"]) for name in ("closure", "closure_of_ours"))
            line += f"; the loop closes to {theirs}, with ours to {ours} ({other['poses']} poses)"
        say(line + (f". {other['remark'].capitalize()}" if other["remark"] else ""))


def print_errors(result: Mapping[str, Any]) -> None:
    errors = result["errors"]
    for name, label in (("left_out", "each pose left out"), ("test", "held-out poses")):
        if name in errors and errors[name]["n"]:
            e = errors[name]
            pixels = f", {e['rms_px']:.3g} px" if e.get("rms_px") is not None else ""
            say(
                f"{label}: {mm(e['rms_m'])}, {mrad(e['rotation_rms_rad'])}{pixels} rms over {e['n']}; maximum"
                f" {mm(e['max_m'])}"
            )
    of_robot = result["kinematics"]["errors"] if "kinematics" in result else {}
    for name, label in (("train", "fitted poses"), ("test", "held-out poses")):
        if name in of_robot:
            before, after = (mm(of_robot[name][when]["rms_m"]) for when in ("before", "after"))
            say(f"with the robot's own parameters, {label}: {before} -> {after} rms")
