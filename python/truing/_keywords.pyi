# Made by python/bindings/keyword_stubs.py from _core.pyi: run scripts/stubs.sh.
"""Keywords that are the fields of an options class, by class."""
from collections.abc import Mapping, Sequence
from typing import Literal, TypedDict

from numpy.typing import ArrayLike

from truing import _core
from truing.effects import Effects


class IdentifyKeywords(TypedDict, total=False):
    free: str | Sequence[str]
    """Names and globs ('J2.*', '*.ratio'); empty: every geometric value and the targets. What belongs to
    the instrument (base frame, anchor, fixed points) is always found unless it is in `hold`."""
    hold: str | Sequence[str]
    """Names and globs that stay at nominal whatever else is asked for."""
    effects: Effects
    """Effects to fit as well."""
    hayati_angle: float
    """[rad] neighbouring axes nearer to parallel get beta (5 deg)"""
    max_iterations: int
    """The fit stops here at the latest: long valleys take thousands of short steps, well-seen robots stop
    after 3 to 5."""
    initial_damping: float
    """Damping mu of the first step, on columns of unit norm."""
    rms_fall: float
    """[m] stop when an accepted step lowers the rms by no more (the method's own: 1e-3 mm)"""
    gradient: float
    """Stop when |g| of unit columns, relative to the residual's norm, is no more."""
    undamped: bool
    """No damping, mu = 0: the least-squares iteration of the differential error model."""
    bounds: Mapping[str, tuple[float, float]]
    """(lowest, highest) by parameter; solver `ceres` only."""
    solver: Literal['lm', 'ceres']
    """What minimises.

    'lm': Levenberg-Marquardt on streamed normal equations
    'ceres': Ceres with the same residuals and Jacobians; takes bounds"""
    loss: Literal['reject', 'none', 'huber', 'cauchy', 'tukey']
    """How gross outliers are treated.

    'reject': Cauchy to find gross outliers, then plain least squares without them; they are listed
    'none': plain least squares
    'huber': Huber's loss
    'cauchy': Cauchy's loss
    'tukey': Tukey's loss"""
    frame_by: Literal['parameters', 'svd']
    """How the measurement frame is found.

    'parameters': the measurement frame is six more parameters
    'svd': refitted by registration (Umeyama) after every step, as the palletizer method has it; positions only"""
    rotation_length: float
    """[m] a rotation error of 1 rad counts as this length, where rows give no sigma."""
    test_share: float
    """Fraction of the pose groups held out when the data has no `set`."""
    seed: int
    """Of the split."""
    rank_tolerance: float
    """A unit column that the others explain up to this fraction is not observable."""
    priors: Mapping[str, float]
    """What is known beforehand: standard deviation about the nominal value [its unit], by parameter or
    glob (of several that match, the smallest). A fit of many parameters to few poses stays near the
    nominal robot where the data say little. Not of base, targets and anchor."""
    prior_noise: float
    """Noise that priors are weighed against: standard deviation of a position component [m], of rows with
    a sigma of their own a factor to it. 0: what a fit without priors leaves."""
    reject_beyond: float
    """Loss `reject`: rows whose residual is longer than this many medians."""
    shrink_beyond: float
    """Where the rows know a link only to more than this [rad, m], it would run away: links are then fitted
    near the nominal robot, under a prior whose size the rows choose. Infinity: never. Not beside priors
    or bounds of one's own."""
    resamples: int
    """Where the rows speak for links farther off than robots are, the fit to a few other poses may end at
    other values: standard errors are then what so many fits scatter by whose poses have weights drawn
    at random. 0: they are those about the one fit, as everywhere else."""
    threads: int
    """0: as many as the machine has."""

class PlanKeywords(TypedDict, total=False):
    poses: int
    """Number of poses."""
    min_step: float
    """[rad] least motion of a revolute joint between neighbours (15 deg)"""
    min_step_prismatic: float
    """[m] the same for prismatic joints."""
    index: Literal['d_optimal', 'a_optimal', 'e_optimal', 'inverse_condition', 'noise_amplification']
    """What the plan maximises.

    'd_optimal': determinant (O1 of Borm and Menq 1989)
    'a_optimal': minus the sum of variances of unit-scaled parameters
    'e_optimal': smallest singular value (O3 of Nahvi et al. 1994)
    'inverse_condition': smallest over largest singular value (O2 of Driels and Pathre 1990)
    'noise_amplification': smallest squared over largest singular value (O4 of Nahvi and Hollerbach 1996)"""
    orientation: bool
    """Full poses are measured, not only positions."""
    position_sigma: float
    """[m] noise of one component, for the standard errors promised."""
    rotation_sigma: float
    """[rad] likewise."""
    sweeps: int
    """Passes of exchange over all poses."""
    proposals: int
    """Candidates tried for a pose in a pass."""
    seed: int
    """Of the random start and the candidates."""
    free: str | Sequence[str]
    """As in `IdentifyOptions`."""
    effects: Effects
    """Effects that shall be seen as well."""

class DistinguishKeywords(TypedDict, total=False):
    columns: str | Sequence[str]
    """What is recorded beside joints and tip, of 'dir', 'payload', 'temp', 't'."""
    separate: Effects
    """Effects to be told apart; poses are added if it takes any. Empty: the whole catalogue is looked at,
    and none are."""
    payload: float
    """[kg] a pose is measured with this or with nothing."""
    temperature_low: float
    """[deg C] at the first and the last pose."""
    temperature_high: float
    """[deg C] halfway."""
    seconds_per_pose: float
    """[s]"""
    orientation: bool
    """Full poses are measured, not only positions."""
    position_sigma: float
    """[m] noise of one component."""
    rotation_sigma: float
    """[rad] likewise."""
    alike: float
    """An effect of which another explains a larger fraction is not told from it."""
    add: int
    """Maximum number of poses added."""
    proposals: int
    """Candidates that each of them is chosen from."""
    min_step: float
    """[rad] least motion of a revolute joint to an added pose."""
    min_step_prismatic: float
    """[m] the same for prismatic joints."""
    seed: int
    """Of directions, payloads and proposals."""

class DiagnoseKeywords(TypedDict, total=False):
    leave_out: str | Sequence[str]
    """Effects that are not to be considered, by name."""
    false_alarm: float
    """False-positive rate: chance that a robot without any gap is said to have one."""
    max_effects: int
    """Maximum number of effects named."""
    test_share: float
    """Fraction of the pose groups held out when the data has no `set`."""
    search_poses: int
    """Maximum number of pose groups searched; errors are those of all rows."""
    resamples: int
    """Bootstrap samples of folds of pose groups for the intervals, the chosen effects fitted again; at
    most 10 more repeat the selection."""
    rotation_length: float
    """[m] a rotation error of 1 rad counts as this length in reported errors."""
    seed: int
    """Of the split and of every simulation."""
    threads: int
    """0: as many as the machine has."""
    also: str | Sequence[str]
    """Effects that are considered only when they are asked for, by name."""

class HandEyeKeywords(TypedDict, total=False):
    setup: Literal['eye-in-hand', 'eye-to-hand']
    """Where the camera is.

    'eye-in-hand': camera on the hand, board in the cell
    'eye-to-hand': camera in the cell, board on the hand"""
    method: Literal['refined', 'closed-form']
    """How the frames are found.

    'refined': maximum likelihood: what was measured, robot poses and board poses (or pixels), each with its noise
    'closed-form': dual quaternions and one SVD alone (Daniilidis 1999)"""
    hand_position_sigma: float | None
    """[m] of the reported robot positions. Position noise of hand and board poses adds up: give both, or
    neither."""
    hand_rotation_sigma: float | None
    """[rad] of the reported robot rotations."""
    camera_position_sigma: float | None
    """[m] of the board's positions, without images."""
    camera_rotation_sigma: float | None
    """[rad] of the board's rotations, without images."""
    pixel_sigma: float | None
    """[px] of the board's points, with images."""
    refine_camera: bool
    """With images: focal lengths, centre and distortion are found as well."""
    working_point: ArrayLike | None
    """Shape=(3,) [m] in the camera frame: where accuracy is asked for; not given: the mean of the board's
    positions."""
    known_height: float | None
    """[m] where all rotation axes are parallel: the camera's coordinate along that axis, in the frame that
    carries the camera."""
    known_height_sigma: float
    """[m] standard deviation of `known_height`."""
    reject: bool
    """Find poses that do not fit the others, list them, go on without."""
    reject_beyond: float
    """Poses whose root mean square of six standardised residuals is larger."""
    recognise: bool
    """Where the loop does not close: try other readings of the same numbers, and name the one that closes."""
    reading: str
    """Use the poses in this other reading, a name of `handeye_readings`; empty: as given."""
    max_iterations: int
    """The fit stops here at the latest: which noise is whose may take hundreds of short steps to find from
    few poses."""

class HandEyePlanKeywords(TypedDict, total=False):
    count: int
    """Number of poses."""
    candidates: int
    """Candidates tried for each."""
    tilt: float
    """[rad] the board is seen at no more than this from its normal, beyond what was seen (45 deg)."""
    reach: float
    """[m] hands stay this close to a measured one."""
    seed: int
    """Of the candidates."""

class InverseKeywords(TypedDict, total=False):
    position_tolerance: float
    """[m] a solution misses the task by no more."""
    rotation_tolerance: float
    """[rad] likewise."""
    choose: Literal['nearest', 'limits_margin', 'manipulability', 'rail_travel']
    """Which of several solutions.

    'nearest': nearest to the seed
    'limits_margin': furthest from the joint limits: by the smallest fraction of a joint's range left on either side
    'manipulability': of the joints that turn, furthest from singular: sqrt(det(J J^T)), lengths over `reach / pi`
    'rail_travel': least way of the prismatic joints from the seed, then nearest"""
    max_iterations: int
    """Of one descent."""
    max_restarts: int
    """Descents from other seeds before a target is given up."""
    wrist_tolerance: float
    """[m] axes that miss each other by no more are taken to meet, for the seeds alone."""
    parallel_tolerance: float
    """[rad] axes nearer to parallel than this are taken to be, for the seeds alone."""
    scene: _core.Scene
    """What the robot must not touch."""

class PathKeywords(TypedDict, total=False):
    longest_turn: float
    """[rad] maximum step of a revolute joint between neighbouring targets; more is a gap (20 deg)."""
    longest_slide: float
    """[m] the same of a prismatic joint."""
    rolls: int
    """Samples of a torch's roll, where it is free."""
    rail_places: int
    """Samples of each rail before the arm, over what it can be reached from."""
    smoothing: int
    """Smoothing iterations of the path, where the task leaves degrees of freedom; up to ten times as many
    while a step is longer than allowed."""

class TorqueKeywords(TypedDict, total=False):
    effects: Effects
    """Effects to fit. None: what is usual, the links' inertial parameters, armature, Coulomb and viscous
    friction, an offset."""
    leave_out_forms: str | Sequence[str]
    """Forms of laws that are not fitted, by effect and part: 'viscous_law.root'."""
    fit_inertials: bool
    """The links' inertial parameters are fitted beside the effects."""
    cutoff: float
    """[Hz] of the low-pass without phase that both sides of the equation of motion go through."""
    test_share: float
    """Fraction of the time held out when there is one recording, or none is marked as test."""
    threads: int
    """0: as many as the machine has."""

class TorqueDiagnoseKeywords(TypedDict, total=False):
    leave_out: str | Sequence[str]
    """Effects that are not to be considered, by name."""
    cutoff: float
    """[Hz] of the low-pass without phase that both sides of the equation of motion go through."""
    test_share: float
    """Fraction of the time held out when there is one recording, or none is marked as test."""
    max_effects: int
    """Maximum number of effects named."""
    least_gain: float
    """[-] fraction of a joint's squared error on unseen recordings that a name must remove."""
    threads: int
    """0: as many as the machine has."""

class TorquePlanKeywords(TypedDict, total=False):
    duration: float
    """[s] of the motion."""
    rate: float
    """[Hz] of its rows."""
    speed: float
    """Fraction of the joints' speed limits that is used."""
    usual_speed: float
    """[rad/s | m/s] speed limit of joints that state none."""
    acceleration: float
    """[rad/s^2 | m/s^2] largest acceleration of a joint."""
    reach: float
    """[rad | m] farthest to either side of `home`, within 95 % of the joint's range."""
    home: Sequence[float]
    """[rad | m] around which the joints move; none: the middle of their limits, or zero."""
    columns: str | Sequence[str]
    """What is recorded beside joints and torques: 'current' (torques are drives' currents), 'torque' (they
    are sensors'), 'payload' (a known one, in half of the recordings), 'temp'."""
    payload: float
    """[kg] at the tool in half of the recordings, if 'payload' is recorded."""
    temperature_low: float
    """[deg C] of cold recordings, if 'temp' is recorded."""
    temperature_high: float
    """[deg C] of warm ones."""
    separate: Effects
    """Effects to be told from each other; none: all effects count alike."""
    noise: float
    """Standard deviation of the torques' noise, as a fraction of that of the torque along a random motion
    (of a joint with little torque: of 5 % of the largest joint's)."""
    torque_noise: Sequence[float]
    """[Nm | N] of every joint, instead of `noise`."""
    noise_time: float
    """[s] correlation time of the noise."""
    cutoff: float
    """[Hz] of the low-pass that a diagnosis will use."""
    alike: float
    """An effect of which another explains a larger fraction is not told from it."""
    starts: int
    """Random motions, the best of which is refined."""
    rounds: int
    """Of refinement, four proposals each."""
    seed: int
    """Of all random choices."""
    threads: int
    """0: as many as the machine has."""
