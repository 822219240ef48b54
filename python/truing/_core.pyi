"""
The C++ core of truing. Use it through `import truing`.
"""
from __future__ import annotations
import collections.abc
import numpy
import numpy.typing
import types
import typing
__all__: list[str] = ['Alternative', 'Anchor', 'AppliedEffect', 'BeforeAfter', 'Branches', 'Camera', 'Candidate', 'CatalogueEffect', 'ClockEstimate', 'ClockOffset', 'ClosedForm', 'ColumnGain', 'CompensateOptions', 'Compensated', 'Compensation', 'CompensationRow', 'Compensations', 'Compensator', 'Conditions', 'Contact', 'CorrectionLimits', 'Curve', 'Detectable', 'DeviationOptions', 'DiagnoseOptions', 'Diagnosis', 'Distinction', 'DistinguishOptions', 'EffectPair', 'EffectRequest', 'EffectSize', 'EffectTraits', 'ErrorStatistics', 'FilterOptions', 'FlexibleMode', 'FoundEffect', 'FoundTorqueEffect', 'FramesResult', 'FreeParameter', 'Frozen', 'GroupChoice', 'HandEyeConcern', 'HandEyeErrors', 'HandEyeKinematics', 'HandEyeNoise', 'HandEyeOptions', 'HandEyePlanOptions', 'HandEyePoses', 'HandEyeResidual', 'HandEyeResult', 'HeldOutFall', 'Identification', 'IdentifyOptions', 'ImuErrors', 'InertialResult', 'InverseOptions', 'InverseSolver', 'Joint', 'JointPath', 'LinkCapsule', 'Measurements', 'Mistake', 'ModalModel', 'ModesResult', 'Motion', 'NextHandPose', 'NextPose', 'NotTestable', 'Obstacle', 'OwnEffect', 'Parameter', 'PathGap', 'PathOptions', 'PlanOptions', 'PlanResult', 'PosePrediction', 'PositionError', 'Prediction', 'Reading', 'RecordedStreams', 'Recording', 'ReplayResult', 'Residuals', 'RestPose', 'Robot', 'RowSums', 'SanityFinding', 'Scene', 'SeenColumns', 'ServoArm', 'ServoBodies', 'ServoPath', 'ServoRecording', 'ServoSet', 'ServoWindow', 'Share', 'Shift', 'SimulatedStreams', 'Solution', 'Solutions', 'SolverSummary', 'StreamSimulationOptions', 'Target', 'Task', 'ToolResult', 'TorqueAlternative', 'TorqueBlock', 'TorqueClass', 'TorqueColumns', 'TorqueDiagnoseOptions', 'TorqueDiagnosis', 'TorqueEffectPair', 'TorqueEffectSize', 'TorqueError', 'TorqueErrors', 'TorqueFit', 'TorqueOptions', 'TorqueOrder', 'TorqueOutlook', 'TorquePlan', 'TorquePlanOptions', 'TorquePrediction', 'TorqueRegime', 'TorqueRun', 'TorqueSumOptions', 'TorqueTrace', 'TrackOptions', 'TrackSetup', 'Tracker', 'TrackerErrors', 'TrackerNoise', 'UncertainFrame', 'UnknownEffect', 'UnknownTorque', 'Unobservable', 'WatchOptions', 'WhereInput', 'WhereJoint', 'WorkspaceCell', 'assemble_setup', 'calibrate_frames', 'calibrate_inertial', 'calibrate_tool', 'catalogue', 'catalogue_effects', 'choose_groups', 'diagnose', 'distinguish', 'dynamics_diagnose', 'dynamics_identify', 'dynamics_plan', 'dynamics_predict', 'find_rests', 'flange_poses', 'forward_kinematics', 'frame_from_xyz_rpy', 'free_parameters', 'gravity_torque_rows', 'gravity_torques', 'handeye', 'handeye_clock', 'handeye_closed_form', 'handeye_plan', 'handeye_readings', 'handeye_with_kinematics', 'identify', 'identify_modes', 'inferred_directions', 'inferred_speeds', 'joint_motion', 'lacks_directions', 'lacks_speeds', 'large_boom', 'large_boom_modes', 'last_moving_link', 'link_parameters', 'links_off_chain', 'nearest_contact', 'noise_from_repeats', 'plan', 'pose_groups', 'predict', 'project', 'rank_columns', 'replay', 'residuals', 'review', 'rigid_torques', 'robot_at', 'robot_from_urdf', 'robot_with_torques', 'rotation_from_rpy', 'rpy_from_rotation', 'seen_columns', 'servo_fields', 'servo_inputs', 'simulate_servos', 'simulate_servos_apart', 'simulate_streams', 'sum_columns', 'sum_rows', 'sum_torques', 'torque_columns', 'torque_effects', 'torque_regressor', 'torques_of_bodies', 'unknown_effect_values', 'unknown_torque_values', 'urdf_with_calibration', 'validate_measurements', 'validate_recording', 'validate_robot', 'validate_scene', 'version']
class Parameter:
    """
    One parameter of a result. Names: `J2.a`, `J3.ratio`, `tool.x`, `base.rz`, `backlash.J3`,
    `anchor.zero` … Orientation corrections rx ry rz are rotation vectors from the nominal to the found
    orientation, about the parent's axes.
    """
    def __repr__(self) -> str:
        ...
    @property
    def frozen(self) -> bool:
        """
        Held at nominal, because the data cannot see it.
        """
    @property
    def name(self) -> str:
        """
        Full name.
        """
    @property
    def nominal(self) -> float:
        """
        Value before, in `unit`.
        """
    @property
    def sigma(self) -> float:
        """
        Standard error, in `unit`; NaN when frozen.
        """
    @property
    def unit(self) -> str:
        """
        m, rad, -, rad/Nm ….
        """
    @property
    def value(self) -> float:
        """
        Value found, in `unit`.
        """
class Frozen:
    """
    A combination of parameters that the data cannot see: moving them together so changes no
    measurement.
    """
    def __repr__(self) -> str:
        ...
    @property
    def combination(self) -> types.MappingProxyType[str, float]:
        """
        Weight by parameter, 1 for `parameter`.
        """
    @property
    def parameter(self) -> str:
        """
        The one held at nominal.
        """
    @property
    def why(self) -> str:
        """
        Why it is frozen.
        """
class ErrorStatistics:
    """
    Length of the position (or distance) errors of a set of rows.
    """
    def __repr__(self) -> str:
        ...
    @property
    def max(self) -> float:
        """
        [m]
        """
    @property
    def mean(self) -> float:
        """
        [m]
        """
    @property
    def median(self) -> float:
        """
        [m]
        """
    @property
    def n(self) -> int:
        """
        Number of rows.
        """
    @property
    def p95(self) -> float:
        """
        [m] 95th percentile.
        """
    @property
    def rms(self) -> float:
        """
        [m]
        """
    @property
    def rotation_rms(self) -> float:
        """
        [rad]; NaN: no orientation measured.
        """
class SolverSummary:
    """
    How the solver ended.
    """
    def __repr__(self) -> str:
        ...
    @property
    def converged(self) -> bool:
        """
        False: the result must not be used.
        """
    @property
    def iterations(self) -> int:
        """
        Steps made.
        """
    @property
    def name(self) -> str:
        """
        'lm' or 'ceres'.
        """
    @property
    def stopped_because(self) -> str:
        """
        The reason, in words.
        """
class NotTestable:
    """
    An effect that the data could not show, whether it is there or not.
    """
    def __repr__(self) -> str:
        ...
    @property
    def effect(self) -> str:
        """
        Its name.
        """
    @property
    def joints(self) -> tuple[str, ...]:
        """
        Where; empty: at any joint.
        """
    @property
    def reason(self) -> typing.Literal['column_missing', 'masses_missing', 'joint_at_rest', 'input_constant', 'no_motion', 'same_as_frames', 'same_as_masses', 'other']:
        """
        The same for programs.
        
        'column_missing': a column is missing, or has rows without a number
        'masses_missing': masses of the links are missing
        'joint_at_rest': the joint does not move
        'input_constant': its input never changes
        'no_motion': it moves nothing at these poses
        'same_as_frames': base and tool do the same
        'same_as_masses': other masses of the links do the same
        'other': as `why` says
        """
    @property
    def why(self) -> str:
        """
        "no column temp_C", "J1 does not move", "the same as the base frame" ….
        """
class UncertainFrame:
    """
    A frame with its uncertainty.
    """
    def __repr__(self) -> str:
        ...
    @property
    def T(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        [m]
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        Of x, y, z [m] and the rotation vector about the parent's axes [rad]: small changes that move the
        frame's origin, and turn it about that origin.
        """
    @property
    def sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(6,): standard errors of x, y, z [m] and of the turns about x, y, z [rad].
        """
class Joint:
    """
    One joint and the link that belongs to it. Lengths in m, angles in rad, masses in kg.
    
    A driven joint moves by `ratio * reading + offset`. A passive joint has no reading: it moves by the weighted sum of
    the corrected motions of the joints in `driven_by`, a mapping or pairs of name and weight (a palletizer's J4:
    {"J2": -1, "J3": -1}).
    """
    def __init__(self, name: str, *, type: typing.Literal['revolute', 'prismatic'] = 'revolute', theta: typing.SupportsFloat | typing.SupportsIndex = 0.0, d: typing.SupportsFloat | typing.SupportsIndex = 0.0, a: typing.SupportsFloat | typing.SupportsIndex = 0.0, alpha: typing.SupportsFloat | typing.SupportsIndex = 0.0, beta: typing.SupportsFloat | typing.SupportsIndex = 0.0, T_parent_joint: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ..., axis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ..., ratio: typing.SupportsFloat | typing.SupportsIndex = 1.0, offset: typing.SupportsFloat | typing.SupportsIndex = 0.0, driven_by: collections.abc.Sequence[tuple[str, typing.SupportsFloat | typing.SupportsIndex]] | dict[str, typing.SupportsFloat | typing.SupportsIndex] = [], lower: typing.SupportsFloat | typing.SupportsIndex = ..., upper: typing.SupportsFloat | typing.SupportsIndex = ..., mass: typing.SupportsFloat | typing.SupportsIndex | None = None, center_of_mass: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ..., inertia: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None = None, rotor_inertia: typing.SupportsFloat | typing.SupportsIndex = 0.0, torque_per_ampere: typing.SupportsFloat | typing.SupportsIndex | None = None, speed_limit: typing.SupportsFloat | typing.SupportsIndex = ..., torque_limit: typing.SupportsFloat | typing.SupportsIndex = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> Joint:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> Joint:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def T_parent_joint(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4) [m], convention `urdf` only.
        """
    @T_parent_joint.setter
    def T_parent_joint(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> None:
        ...
    @property
    def a(self) -> float:
        """
        [m] link length.
        """
    @a.setter
    def a(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def alpha(self) -> float:
        """
        [rad] link twist.
        """
    @alpha.setter
    def alpha(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def axis(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(3,) unit vector, convention `urdf` only.
        """
    @axis.setter
    def axis(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def beta(self) -> float:
        """
        [rad] Hayati's twist about y, for near-parallel neighbouring axes.
        """
    @beta.setter
    def beta(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def center_of_mass(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(3,) [m] in the frame after the link.
        """
    @center_of_mass.setter
    def center_of_mass(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def d(self) -> float:
        """
        [m] the motion of a prismatic joint adds to it.
        """
    @d.setter
    def d(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def driven_by(self) -> tuple[tuple[str, float], ...]:
        """
        Pairs of driving joint and weight; empty: the joint has a reading. A mapping may be set.
        """
    @driven_by.setter
    def driven_by(self, arg1: collections.abc.Sequence[tuple[str, typing.SupportsFloat | typing.SupportsIndex]] | dict[str, typing.SupportsFloat | typing.SupportsIndex]) -> None:
        ...
    @property
    def inertia(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"] | None:
        """
        Shape=(3, 3) [kg m^2] of the link about its centre of mass, in the axes of the frame after the link,
        if known.
        """
    @inertia.setter
    def inertia(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None) -> None:
        ...
    @property
    def lower(self) -> float:
        """
        [rad | m] lower limit, -inf if there is none.
        """
    @lower.setter
    def lower(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def mass(self) -> float | None:
        """
        [kg] of the link that this joint moves, if known.
        """
    @mass.setter
    def mass(self, arg1: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    @property
    def name(self) -> str:
        """
        Name, unique within the robot.
        """
    @name.setter
    def name(self, arg1: str) -> None:
        ...
    @property
    def offset(self) -> float:
        """
        [rad | m] joint zero.
        """
    @offset.setter
    def offset(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def passive(self) -> bool:
        """
        Whether other joints drive it.
        """
    @property
    def ratio(self) -> float:
        """
        [-] gear-ratio correction.
        """
    @ratio.setter
    def ratio(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rotor_inertia(self) -> float:
        """
        [kg m^2 | kg] of the motor's rotor, as the joint feels it.
        """
    @rotor_inertia.setter
    def rotor_inertia(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def speed_limit(self) -> float:
        """
        [rad/s | m/s] inf if there is none.
        """
    @speed_limit.setter
    def speed_limit(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def theta(self) -> float:
        """
        [rad] the motion of a revolute joint adds to it.
        """
    @theta.setter
    def theta(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def torque_limit(self) -> float:
        """
        [Nm | N] inf if there is none.
        """
    @torque_limit.setter
    def torque_limit(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def torque_per_ampere(self) -> float | None:
        """
        [Nm/A | N/A] at the joint, of the drive, if known.
        """
    @torque_per_ampere.setter
    def torque_per_ampere(self, arg1: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    @property
    def type(self) -> typing.Literal['revolute', 'prismatic']:
        """
        The kind of motion.
        """
    @type.setter
    def type(self, arg1: typing.Literal['revolute', 'prismatic']) -> None:
        ...
    @property
    def upper(self) -> float:
        """
        [rad | m] upper limit, inf if there is none.
        """
    @upper.setter
    def upper(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class Target:
    """
    A measured point (and orientation) on the last link.
    """
    def __init__(self, name: str, T_last_target: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> Target:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> Target:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def T_last_target(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4) [m]: target in the frame after the last link.
        """
    @T_last_target.setter
    def T_last_target(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> None:
        ...
    @property
    def name(self) -> str:
        """
        Name, unique within the robot.
        """
    @name.setter
    def name(self, arg1: str) -> None:
        ...
class Anchor:
    """
    The far end of a draw-wire or ballbar: reading = distance + zero.
    
    It does not change: set `robot.anchor = robot.anchor.replace(zero=0.01)`.
    """
    def __init__(self, point: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ..., zero: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> Anchor:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> Anchor:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def point(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) [m] in the measurement frame.
        """
    @property
    def zero(self) -> float:
        """
        [m] the length that the instrument leaves out.
        """
class AppliedEffect:
    """
    An effect with its fitted parameters, as `identify` found them.
    
    It does not change; make another one.
    """
    def __init__(self, effect: str, joints: collections.abc.Sequence[str], parameters: collections.abc.Mapping[str, typing.SupportsFloat | typing.SupportsIndex]) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> AppliedEffect:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> AppliedEffect:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def effect(self) -> str:
        """
        Name, as in `catalogue()`.
        """
    @property
    def joints(self) -> tuple[str, ...]:
        """
        Names of the joints it acts on.
        """
    @property
    def parameters(self) -> types.MappingProxyType[str, float]:
        """
        Value by full name: {'backlash.J3': 2e-4}.
        """
class Robot:
    """
    A robot model, nominal or calibrated. `truing.validate` says whether it can be used.
    
    `robot.joints[1].a = 0.3` and `robot.joint("J2").a = 0.3` change the robot. The number of joints and targets is fixed:
    `robot.replace(joints=...)` makes another robot.
    """
    def __init__(self, name: str, *, joints: collections.abc.Sequence[Joint], targets: collections.abc.Sequence[Target] = ..., convention: typing.Literal['dh', 'mdh', 'urdf'] = 'dh', gravity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ..., T_measurement_base: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ..., effects: collections.abc.Sequence[AppliedEffect] = [], anchor: Anchor | None = None, fitted_range: collections.abc.Mapping[str, tuple[typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]] = {}, torque_effects: collections.abc.Sequence[AppliedEffect] = []) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> Robot:
        """
        An independent copy.
        """
    def driven_joints(self) -> tuple[int, ...]:
        """
        Index of each driven joint, in chain order.
        """
    def joint(self, name: str) -> Joint:
        """
        The joint of that name; what is set on it changes the robot. Raises InputError that lists the joints there are.
        """
    def joint_index(self, name: str) -> int:
        """
        Index of the joint of that name; raises InputError that lists the joints there are.
        """
    def replace(self, **kwargs: typing.Any) -> Robot:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def T_measurement_base(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4) [m]: base in the measurement frame.
        """
    @T_measurement_base.setter
    def T_measurement_base(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> None:
        ...
    @property
    def anchor(self) -> Anchor | None:
        """
        The far end of a draw-wire or ballbar, if there is one.
        """
    @anchor.setter
    def anchor(self, arg1: Anchor | None) -> None:
        ...
    @property
    def convention(self) -> typing.Literal['dh', 'mdh', 'urdf']:
        """
        How the links are read.
        
        'dh': Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta): Denavit-Hartenberg, distal
        'mdh': Rx(alpha) Tx(a) Ry(beta) Rz(theta) Tz(d): modified DH (Craig), proximal
        'urdf': T_parent_joint, then the motion about or along `axis`
        """
    @convention.setter
    def convention(self, arg1: typing.Literal['dh', 'mdh', 'urdf']) -> None:
        ...
    @property
    def driven_count(self) -> int:
        """
        Number of joints that have a reading.
        """
    @property
    def effects(self) -> tuple[AppliedEffect, ...]:
        """
        Effects with their fitted parameters.
        """
    @effects.setter
    def effects(self, arg1: collections.abc.Sequence[AppliedEffect]) -> None:
        ...
    @property
    def fitted_range(self) -> types.MappingProxyType[str, tuple[float, float]]:
        """
        Smallest and largest value of the inputs that the effects were fitted on: 'q1' … [rad | m], 'qd1' …
        [rad/s | m/s], 'payload' [kg], 'temp' [deg C], and 'frequency' [Hz] of the motion and torques that
        effects on torques were fitted on. Beyond it nobody has seen what they do. Empty: not known.
        """
    @fitted_range.setter
    def fitted_range(self, arg1: collections.abc.Mapping[str, tuple[typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]]) -> None:
        ...
    @property
    def gravity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(3,) [m/s^2] in the base frame.
        """
    @gravity.setter
    def gravity(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def joints(self) -> tuple[Joint, ...]:
        """
        The joints in chain order; what is set on them changes the robot.
        """
    @property
    def name(self) -> str:
        """
        Name of the model.
        """
    @name.setter
    def name(self, arg1: str) -> None:
        ...
    @property
    def targets(self) -> tuple[Target, ...]:
        """
        The targets, the tool first; what is set on them changes the robot.
        """
    @property
    def torque_effects(self) -> tuple[AppliedEffect, ...]:
        """
        Effects on the torques of the joints with their parameters, as in `torque_catalogue()`: friction
        that the file states, and what `truing::dynamics` found.
        """
    @torque_effects.setter
    def torque_effects(self, arg1: collections.abc.Sequence[AppliedEffect]) -> None:
        ...
class Measurements:
    """
    One row per measurement: n rows of joint readings, and what was measured there.
    
    joints: shape=(n, driven joints) [rad | m], chain order.
    positions: shape=(n, 3) [m] of the target in the measurement frame; NaN rows: not measured.
    orientations: shape=(n, 4) w x y z, Hamilton; NaN rows: not measured.
    distances: shape=(n,) [m] to the robot's anchor; NaN: not measured.
    fixed_points: n names ('' or None: none), or indices into `fixed_point_names` (-1: none).
    targets: n names, or indices into `robot.targets`; absent: the tool. `target_names`: the targets in the robot's order,
        unless `robot` is given; default ["tool"].
    directions: shape=(n, driven joints), approach direction -1, 0, 1. joint_speeds: shape=(n, driven joints) [rad/s | m/s].
    payload [kg], temperature [deg C], time [s], position_sigma [m], rotation_sigma [rad], weight: shape=(n,); all but time
        may be one number for all rows.
    pose: n numbers or names, rows of one robot pose share one; absent: equal joints. set: n of 'train', 'test' (or 0, 1).
    covariates: more columns by name, shape=(n,).
    
    Arrays of float64 are not copied, whatever their strides: do not change them while this object is in use. A list or
    tuple of arrays holds columns (from Arrow or pandas); a list of lists of numbers holds rows.
    Raises InputError naming the column when shapes or types do not fit; `validate_measurements` checks the values.
    """
    def __init__(self, joints: numpy.typing.ArrayLike, *, positions: numpy.typing.ArrayLike | None = None, orientations: numpy.typing.ArrayLike | None = None, distances: numpy.typing.ArrayLike | None = None, fixed_points: numpy.typing.ArrayLike | collections.abc.Sequence[str | None] | None = None, fixed_point_names: collections.abc.Sequence[str] = [], targets: numpy.typing.ArrayLike | collections.abc.Sequence[str | None] | None = None, target_names: collections.abc.Sequence[str] | None = None, directions: numpy.typing.ArrayLike | None = None, joint_speeds: numpy.typing.ArrayLike | None = None, payload: numpy.typing.ArrayLike | None = None, temperature: numpy.typing.ArrayLike | None = None, time: numpy.typing.ArrayLike | None = None, pose: numpy.typing.ArrayLike | collections.abc.Sequence[str | None] | None = None, set: numpy.typing.ArrayLike | collections.abc.Sequence[str | None] | None = None, position_sigma: numpy.typing.ArrayLike | None = None, rotation_sigma: numpy.typing.ArrayLike | None = None, weight: numpy.typing.ArrayLike | None = None, covariates: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, robot: Robot | None = None) -> None:
        ...
    def __len__(self) -> int:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> Measurements:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> Measurements:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def covariates(self) -> types.MappingProxyType[str, numpy.typing.NDArray[numpy.float64]]:
        """
        More columns by name, each of shape (n,).
        """
    @property
    def directions(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(n, driven joints), a copy, or None.
        """
    @property
    def distances(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(n,) [m], or None.
        """
    @property
    def fixed_point_names(self) -> tuple[str, ...]:
        """
        Names of the fixed points.
        """
    @property
    def fixed_points(self) -> numpy.typing.NDArray[numpy.int32] | None:
        """
        shape=(n,): index into `fixed_point_names`, -1: none; or None.
        """
    @property
    def joint_speeds(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(n, driven joints) [rad/s | m/s], a copy, or None.
        """
    @property
    def joints(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n, driven joints) [rad | m], a copy.
        """
    @property
    def orientations(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(n, 4) w x y z, a copy, or None.
        """
    @property
    def payload(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(n,) [kg], or None.
        """
    @property
    def pose(self) -> numpy.typing.NDArray[numpy.int32] | None:
        """
        shape=(n,): number of the pose, or None.
        """
    @property
    def position_sigma(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(n,) [m], or None.
        """
    @property
    def positions(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(n, 3) [m], a copy, or None.
        """
    @property
    def rotation_sigma(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(n,) [rad], or None.
        """
    @property
    def rows(self) -> int:
        """
        Number of rows n.
        """
    @property
    def set(self) -> numpy.typing.NDArray[numpy.int8] | None:
        """
        shape=(n,): 0 train, 1 test; or None.
        """
    @property
    def targets(self) -> numpy.typing.NDArray[numpy.int32] | None:
        """
        shape=(n,): index into `robot.targets`, or None.
        """
    @property
    def temperature(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(n,) [deg C], or None.
        """
    @property
    def time(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(n,) [s], or None.
        """
    @property
    def weight(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(n,), or None.
        """
class EffectTraits:
    """
    What diagnosis, planning and simulation know of an effect; they read these and no name.
    """
    def __init__(self, *, driver: str = 'several', moves: str = 'joint', law: str = '', law_test: str = '', of_instrument: bool = False, needs_masses: bool = False, mimicked_by: collections.abc.Sequence[str] = [], separated_by: collections.abc.Mapping[str, str] = {}, prior: typing.SupportsFloat | typing.SupportsIndex = 0.01, usual: typing.SupportsFloat | typing.SupportsIndex = 0.0, plausible: typing.SupportsFloat | typing.SupportsIndex = 0.0, main_part: str = '') -> None:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def documentation(self) -> typing.Annotated[list[str], "FixedSize(3)"]:
        """
        Law, parameters and needs, as docs/reference/effects.md has them.
        """
    @property
    def driver(self) -> str:
        """
        The input that its basis is a function of.
        """
    @property
    def law(self) -> str:
        """
        The law of one input that its motion of a joint follows.
        """
    @property
    def law_test(self) -> str:
        """
        The free function that the law is tested against.
        """
    @property
    def main_part(self) -> str:
        """
        The parameter that is meant by the effect's name alone.
        """
    @property
    def mimicked_by(self) -> tuple[str, ...]:
        """
        Effects that may do the same, and show only with a column of their own.
        """
    @property
    def moves(self) -> str:
        """
        joint, axis, link, base or target.
        """
    @property
    def needs_masses(self) -> bool:
        """
        Searched only where the links' masses are known.
        """
    @property
    def of_instrument(self) -> bool:
        """
        Not a motion of the robot.
        """
    @property
    def plausible(self) -> float:
        """
        No machine in working order has more, in the parameter's unit; 0: unknown.
        """
    @property
    def prior(self) -> float:
        """
        Motion of its site that it may well make [rad | m].
        """
    @property
    def search(self) -> str:
        """
        When it takes part in a diagnosis or a plan.
        """
    @property
    def separated_by(self) -> dict[str, str]:
        """
        By other effect ('': any): what to measure to tell them apart. Of own effects.
        """
    @property
    def stands_for(self) -> str:
        """
        Parameters of the model that it stands for; empty: it has terms of its own.
        """
    @property
    def usual(self) -> float:
        """
        Size that a simulation draws, in the parameter's unit; 0: unknown.
        """
    @property
    def wanders(self) -> bool:
        """
        Also tried as a free function of time.
        """
    @property
    def weights_found_by(self) -> str:
        """
        The effect that finds the weights where no mass is known.
        """
class CatalogueEffect:
    """
    An effect that truing knows by name.
    """
    def __repr__(self) -> str:
        ...
    @property
    def name(self) -> str:
        """
        Its name.
        """
    @property
    def per_joint(self) -> bool:
        """
        False: it belongs to the robot as a whole.
        """
    @property
    def summary(self) -> str:
        """
        What it is.
        """
    @property
    def traits(self) -> EffectTraits:
        """
        What it says of itself.
        """
class EffectRequest:
    """
    An effect asked for: its name, and joints (none: every driven joint).
    """
    def __init__(self, effect: str, joints: collections.abc.Sequence[str] = []) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> EffectRequest:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> EffectRequest:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def effect(self) -> str:
        """
        Name, as in `catalogue()`.
        """
    @property
    def joints(self) -> tuple[str, ...]:
        """
        Names of joints; none: every driven one.
        """
class OwnEffect:
    """
    The values of a user's effect for the rows of some data; `truing.Effect` makes these.
    """
    def __init__(self, name: str, summary: str = '', traits: EffectTraits = ...) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def add(self, *, joint: str, parameter: str, unit: str, site: str, values: numpy.typing.ArrayLike) -> None:
        """
        Adds a term: parameter * values[row] on `site`, listed under `joint`. values: shape=(n,); not copied when float64. Raises InputError.
        """
    @property
    def name(self) -> str:
        """
        Name of the effect.
        """
    @property
    def traits(self) -> EffectTraits:
        """
        What it says of itself.
        """
class Recording:
    """
    A recording of motion: one file, one fold. It does not change; `replace` makes another.
    
    Arrays are copied. Tables have a column for each joint that has a reading, in chain order. A table that was not recorded
    is left out, and then has the shape (n, 0); a joint that was not recorded is NaN throughout.
    pieces: of a recording that is longer than memory a callable that returns an iterator of its rows, some of them each as a
    Recording with the same tables, from the first on whenever it is called; the tables given are then its first rows, and
    end [s] is the time of the last.
    Raises InputError naming the array when shapes or types do not fit; `validate_recording` checks the values.
    """
    def __init__(self, name: str, *, time: numpy.typing.ArrayLike, position: numpy.typing.ArrayLike, speed: numpy.typing.ArrayLike | None = None, torque: numpy.typing.ArrayLike | None = None, current: numpy.typing.ArrayLike | None = None, command: numpy.typing.ArrayLike | None = None, speed_command: numpy.typing.ArrayLike | None = None, torque_command: numpy.typing.ArrayLike | None = None, columns: collections.abc.Mapping[str, numpy.typing.ArrayLike] = {}, torque_is_mean: bool = False, test: bool = False, pieces: collections.abc.Callable[[], collections.abc.Iterator[Recording]] | None = None, end: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __len__(self) -> int:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> Recording:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> Recording:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def columns(self) -> types.MappingProxyType[str, numpy.typing.NDArray[numpy.float64]]:
        """
        Shape=(n,) each, by name: 'payload_kg', 'temp1_C' … or 'temp_C', 'volt_V', 'enabled', and one's own.
        """
    @property
    def command(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(n, joints) [rad | m] positions commanded, if they were recorded.
        """
    @property
    def current(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(n, joints) [A] of the drives, measured, if it was.
        """
    @property
    def end(self) -> float:
        """
        [s] of a recording that is read: time of its last row.
        """
    @property
    def name(self) -> str:
        """
        Of the file, in messages and results.
        """
    @property
    def pieces(self) -> collections.abc.Callable[[], collections.abc.Iterator[Recording]] | None:
        """
        Of a recording that is longer than memory: returns an iterator of its rows, as recordings; the tables are then the first rows. None: they are all there is.
        """
    @property
    def position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(n, joints) [rad | m] as read.
        """
    @property
    def speed(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(n, joints) [rad/s | m/s] as recorded, if it was.
        """
    @property
    def speed_command(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(n, joints) [rad/s | m/s] speeds commanded, if they were recorded.
        """
    @property
    def test(self) -> bool:
        """
        Held out: it is judged on, and never fitted to.
        """
    @property
    def time(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Shape=(n,) [s], increasing.
        """
    @property
    def torque(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(n, joints) [Nm | N] of the drives, measured, if it was.
        """
    @property
    def torque_command(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(n, joints) [Nm | N] torques commanded, if they were recorded.
        """
    @property
    def torque_is_mean(self) -> bool:
        """
        Torques and currents are means over the time of a row, which is in its middle, and not values at its
        instant: of rows that are more than 12 ms apart, as nearer ones show no difference.
        """
class Obstacle:
    """
    A fixed obstacle; `replace(...)` makes another one.
    
    shape: 'sphere' (radius about the frame's origin), 'capsule' (radius about the segment from the origin to
    (0, 0, size[2])) or 'box' (`size` along the frame's axes, its centre at the origin).
    """
    def __init__(self, name: str, *, shape: typing.Literal['sphere', 'capsule', 'box'] = 'box', T_measurement_shape: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ..., size: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ..., radius: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> Obstacle:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> Obstacle:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def T_measurement_shape(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4) [m]
        """
    @property
    def name(self) -> str:
        """
        Unique within the scene.
        """
    @property
    def radius(self) -> float:
        """
        [m] of spheres and capsules.
        """
    @property
    def shape(self) -> typing.Literal['sphere', 'capsule', 'box']:
        """
        What it is.
        
        'sphere': `radius` about the frame's origin
        'capsule': `radius` about the segment from the origin to (0, 0, `size.z()`)
        'box': `size` along the frame's axes, its centre at the origin
        """
    @property
    def size(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) [m] whole lengths, of a box; of a capsule z alone.
        """
class LinkCapsule:
    """
    Part of a link, a capsule: `radius` about the segment between two points.
    """
    def __init__(self, name: str, *, link: str, start: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], end: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], radius: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> LinkCapsule:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> LinkCapsule:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def end(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) [m]
        """
    @property
    def link(self) -> str:
        """
        The joint whose link carries it, in the frame after it; 'base': the base frame; 'tool': the target's
        frame.
        """
    @property
    def name(self) -> str:
        """
        Unique within the scene.
        """
    @property
    def radius(self) -> float:
        """
        [m]
        """
    @property
    def start(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) [m]
        """
class Scene:
    """
    The obstacles around the robot, and the capsules of the robot that must not touch them or each
    other.
    """
    def __init__(self, *, obstacles: collections.abc.Sequence[Obstacle] = [], capsules: collections.abc.Sequence[LinkCapsule] = [], clearance: typing.SupportsFloat | typing.SupportsIndex = 0.0, ignored: collections.abc.Sequence[tuple[str, str]] = []) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> Scene:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> Scene:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def capsules(self) -> tuple[LinkCapsule, ...]:
        """
        The robot's own shape.
        """
    @property
    def clearance(self) -> float:
        """
        [m] smallest distance that is no collision.
        """
    @property
    def ignored(self) -> tuple[tuple[str, str], ...]:
        """
        Pairs of names that are not checked. Capsules of one link and of neighbouring links never are, nor
        is the base's with obstacles.
        """
    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """
        What the robot must not touch.
        """
class Contact:
    """
    The pair that collides most deeply, or comes nearest.
    """
    def __repr__(self) -> str:
        ...
    @property
    def distance(self) -> float:
        """
        [m] between their surfaces; negative: how deep they are in each other.
        """
    @property
    def first(self) -> str:
        """
        A capsule.
        """
    @property
    def second(self) -> str:
        """
        A capsule or an obstacle.
        """
class IdentifyOptions:
    """
    How `identify` works.
    
    free = []: Names and globs ('J2.*', '*.ratio'); empty: every geometric value and the targets. What belongs to
        the instrument (base frame, anchor, fixed points) is always found unless it is in `hold`.
    hold = []: Names and globs that stay at nominal whatever else is asked for.
    effects = []: Effects to fit as well.
    hayati_angle = 0.08726646259971647: [rad] neighbouring axes nearer to parallel get beta (5 deg)
    max_iterations = 5000: The fit stops here at the latest: long valleys take thousands of short steps, well-seen robots stop
        after 3 to 5.
    initial_damping = 1e-09: Damping mu of the first step, on columns of unit norm.
    rms_fall = 1e-12: [m] stop when an accepted step lowers the rms by no more (the method's own: 1e-3 mm)
    gradient = 1e-14: Stop when |g| of unit columns, relative to the residual's norm, is no more.
    undamped = False: No damping, mu = 0: the least-squares iteration of the differential error model.
    bounds = {}: (lowest, highest) by parameter; solver `ceres` only.
    solver = 'lm': What minimises.
        'lm': Levenberg-Marquardt on streamed normal equations
        'ceres': Ceres with the same residuals and Jacobians; takes bounds
    loss = 'reject': How gross outliers are treated.
        'reject': Cauchy to find gross outliers, then plain least squares without them; they are listed
        'none': plain least squares
        'huber': Huber's loss
        'cauchy': Cauchy's loss
        'tukey': Tukey's loss
    frame_by = 'parameters': How the measurement frame is found.
        'parameters': the measurement frame is six more parameters
        'svd': refitted by registration (Umeyama) after every step, as the palletizer method has it; positions only
    rotation_length = 0.1: [m] a rotation error of 1 rad counts as this length, where rows give no sigma.
    test_share = 0.2: Fraction of the pose groups held out when the data has no `set`.
    seed = 0: Of the split.
    rank_tolerance = 1e-06: A unit column that the others explain up to this fraction is not observable.
    priors = {}: What is known beforehand: standard deviation about the nominal value [its unit], by parameter or
        glob (of several that match, the smallest). A fit of many parameters to few poses stays near the
        nominal robot where the data say little. Not of base, targets and anchor.
    prior_noise = 0.0: Noise that priors are weighed against: standard deviation of a position component [m], of rows with
        a sigma of their own a factor to it. 0: what a fit without priors leaves.
    reject_beyond = 6.0: Loss `reject`: rows whose residual is longer than this many medians.
    shrink_beyond = 0.05: Where the rows know a link only to more than this [rad, m], it would run away: links are then fitted
        near the nominal robot, under a prior whose size the rows choose. Infinity: never. Not beside priors
        or bounds of one's own.
    resamples = 8: Where the rows speak for links farther off than robots are, the fit to a few other poses may end at
        other values: standard errors are then what so many fits scatter by whose poses have weights drawn
        at random. 0: they are those about the one fit, as everywhere else.
    threads = 0: 0: as many as the machine has.
    """
    def __init__(self, *, free: collections.abc.Sequence[str] = [], hold: collections.abc.Sequence[str] = [], effects: collections.abc.Sequence[EffectRequest] = [], hayati_angle: typing.SupportsFloat | typing.SupportsIndex = 0.08726646259971647, max_iterations: typing.SupportsInt | typing.SupportsIndex = 5000, initial_damping: typing.SupportsFloat | typing.SupportsIndex = 1e-09, rms_fall: typing.SupportsFloat | typing.SupportsIndex = 1e-12, gradient: typing.SupportsFloat | typing.SupportsIndex = 1e-14, undamped: bool = False, bounds: collections.abc.Mapping[str, tuple[typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]] = {}, solver: typing.Literal['lm', 'ceres'] = 'lm', loss: typing.Literal['reject', 'none', 'huber', 'cauchy', 'tukey'] = 'reject', frame_by: typing.Literal['parameters', 'svd'] = 'parameters', rotation_length: typing.SupportsFloat | typing.SupportsIndex = 0.1, test_share: typing.SupportsFloat | typing.SupportsIndex = 0.2, seed: typing.SupportsInt | typing.SupportsIndex = 0, rank_tolerance: typing.SupportsFloat | typing.SupportsIndex = 1e-06, priors: collections.abc.Mapping[str, typing.SupportsFloat | typing.SupportsIndex] = {}, prior_noise: typing.SupportsFloat | typing.SupportsIndex = 0.0, reject_beyond: typing.SupportsFloat | typing.SupportsIndex = 6.0, shrink_beyond: typing.SupportsFloat | typing.SupportsIndex = 0.05, resamples: typing.SupportsInt | typing.SupportsIndex = 8, threads: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> IdentifyOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> IdentifyOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def bounds(self) -> types.MappingProxyType[str, tuple[float, float]]:
        """
        (lowest, highest) by parameter; solver `ceres` only.
        """
    @bounds.setter
    def bounds(self, arg1: collections.abc.Mapping[str, tuple[typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]]) -> None:
        ...
    @property
    def effects(self) -> tuple[EffectRequest, ...]:
        """
        Effects to fit as well.
        """
    @effects.setter
    def effects(self, arg1: collections.abc.Sequence[EffectRequest]) -> None:
        ...
    @property
    def frame_by(self) -> typing.Literal['parameters', 'svd']:
        """
        How the measurement frame is found.
        
        'parameters': the measurement frame is six more parameters
        'svd': refitted by registration (Umeyama) after every step, as the palletizer method has it; positions only
        """
    @frame_by.setter
    def frame_by(self, arg1: typing.Literal['parameters', 'svd']) -> None:
        ...
    @property
    def free(self) -> tuple[str, ...]:
        """
        Names and globs ('J2.*', '*.ratio'); empty: every geometric value and the targets. What belongs to
        the instrument (base frame, anchor, fixed points) is always found unless it is in `hold`.
        """
    @free.setter
    def free(self, arg1: collections.abc.Sequence[str]) -> None:
        ...
    @property
    def gradient(self) -> float:
        """
        Stop when |g| of unit columns, relative to the residual's norm, is no more.
        """
    @gradient.setter
    def gradient(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def hayati_angle(self) -> float:
        """
        [rad] neighbouring axes nearer to parallel get beta (5 deg)
        """
    @hayati_angle.setter
    def hayati_angle(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def hold(self) -> tuple[str, ...]:
        """
        Names and globs that stay at nominal whatever else is asked for.
        """
    @hold.setter
    def hold(self, arg1: collections.abc.Sequence[str]) -> None:
        ...
    @property
    def initial_damping(self) -> float:
        """
        Damping mu of the first step, on columns of unit norm.
        """
    @initial_damping.setter
    def initial_damping(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def loss(self) -> typing.Literal['reject', 'none', 'huber', 'cauchy', 'tukey']:
        """
        How gross outliers are treated.
        
        'reject': Cauchy to find gross outliers, then plain least squares without them; they are listed
        'none': plain least squares
        'huber': Huber's loss
        'cauchy': Cauchy's loss
        'tukey': Tukey's loss
        """
    @loss.setter
    def loss(self, arg1: typing.Literal['reject', 'none', 'huber', 'cauchy', 'tukey']) -> None:
        ...
    @property
    def max_iterations(self) -> int:
        """
        The fit stops here at the latest: long valleys take thousands of short steps, well-seen robots stop
        after 3 to 5.
        """
    @max_iterations.setter
    def max_iterations(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def prior_noise(self) -> float:
        """
        Noise that priors are weighed against: standard deviation of a position component [m], of rows with
        a sigma of their own a factor to it. 0: what a fit without priors leaves.
        """
    @prior_noise.setter
    def prior_noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def priors(self) -> types.MappingProxyType[str, float]:
        """
        What is known beforehand: standard deviation about the nominal value [its unit], by parameter or
        glob (of several that match, the smallest). A fit of many parameters to few poses stays near the
        nominal robot where the data say little. Not of base, targets and anchor.
        """
    @priors.setter
    def priors(self, arg1: collections.abc.Mapping[str, typing.SupportsFloat | typing.SupportsIndex]) -> None:
        ...
    @property
    def rank_tolerance(self) -> float:
        """
        A unit column that the others explain up to this fraction is not observable.
        """
    @rank_tolerance.setter
    def rank_tolerance(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def reject_beyond(self) -> float:
        """
        Loss `reject`: rows whose residual is longer than this many medians.
        """
    @reject_beyond.setter
    def reject_beyond(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def resamples(self) -> int:
        """
        Where the rows speak for links farther off than robots are, the fit to a few other poses may end at
        other values: standard errors are then what so many fits scatter by whose poses have weights drawn
        at random. 0: they are those about the one fit, as everywhere else.
        """
    @resamples.setter
    def resamples(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def rms_fall(self) -> float:
        """
        [m] stop when an accepted step lowers the rms by no more (the method's own: 1e-3 mm)
        """
    @rms_fall.setter
    def rms_fall(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rotation_length(self) -> float:
        """
        [m] a rotation error of 1 rad counts as this length, where rows give no sigma.
        """
    @rotation_length.setter
    def rotation_length(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def seed(self) -> int:
        """
        Of the split.
        """
    @seed.setter
    def seed(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def shrink_beyond(self) -> float:
        """
        Where the rows know a link only to more than this [rad, m], it would run away: links are then fitted
        near the nominal robot, under a prior whose size the rows choose. Infinity: never. Not beside priors
        or bounds of one's own.
        """
    @shrink_beyond.setter
    def shrink_beyond(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def solver(self) -> typing.Literal['lm', 'ceres']:
        """
        What minimises.
        
        'lm': Levenberg-Marquardt on streamed normal equations
        'ceres': Ceres with the same residuals and Jacobians; takes bounds
        """
    @solver.setter
    def solver(self, arg1: typing.Literal['lm', 'ceres']) -> None:
        ...
    @property
    def test_share(self) -> float:
        """
        Fraction of the pose groups held out when the data has no `set`.
        """
    @test_share.setter
    def test_share(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def threads(self) -> int:
        """
        0: as many as the machine has.
        """
    @threads.setter
    def threads(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def undamped(self) -> bool:
        """
        No damping, mu = 0: the least-squares iteration of the differential error model.
        """
    @undamped.setter
    def undamped(self, arg1: bool) -> None:
        ...
class BeforeAfter:
    """
    Errors before and after calibration.
    """
    def __repr__(self) -> str:
        ...
    @property
    def after(self) -> ErrorStatistics:
        """
        Calibrated robot.
        """
    @property
    def before(self) -> ErrorStatistics:
        """
        Nominal robot with base, targets (and anchor, fixed points) fitted.
        """
class Identification:
    """
    What `identify` found.
    """
    def __repr__(self) -> str:
        ...
    def parameter(self, name: str) -> Parameter:
        """
        The parameter of that name; raises InputError that lists the parameters there are.
        """
    def summary(self) -> str:
        """
        A few lines for people.
        """
    @property
    def before(self) -> Robot:
        """
        Nominal, with base and targets fitted; part of this result.
        """
    @property
    def columns(self) -> int:
        """
        Number of parameters asked for.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(rank, rank), of the fitted (not frozen) parameters in order of `parameters`, in their units.
        """
    @property
    def errors(self) -> types.MappingProxyType[str, BeforeAfter]:
        """
        Errors by set: 'train', and 'test' if rows were held out.
        """
    @property
    def frozen(self) -> tuple[Frozen, ...]:
        """
        What the data cannot see.
        """
    @property
    def local_sigma(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Shape=(rank,): standard errors about this one fit, of the fitted parameters in their units. Those of
        `parameters` and `covariance` are larger where they are what `resamples` fits scatter by.
        """
    @property
    def noise_sigma(self) -> float:
        """
        [m] of one position component (or distance), from the training residuals.
        """
    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """
        Every parameter asked for, frozen ones included.
        """
    @property
    def rank(self) -> int:
        """
        Number of parameters fitted.
        """
    @property
    def rejected_rows(self) -> tuple[int, ...]:
        """
        Training rows (counted from 0) left out as gross outliers.
        """
    @property
    def robot(self) -> Robot:
        """
        Calibrated; part of this result: copy it before changing it.
        """
    @property
    def rotation_noise_sigma(self) -> float:
        """
        [rad] of one rotation component; NaN: none measured.
        """
    @property
    def set(self) -> numpy.typing.NDArray[numpy.int8]:
        """
        Shape=(n,): 0 train, 1 test, for every row.
        """
    @property
    def shrunk_to(self) -> float:
        """
        [rad, m] standard deviation about the nominal robot under which links were fitted; 0: freely. See
        shrink_beyond.
        """
    @property
    def solver(self) -> SolverSummary:
        """
        How the solver ended.
        """
    @property
    def test(self) -> BeforeAfter | None:
        """
        Errors of the held-out rows, if any.
        """
    @property
    def train(self) -> BeforeAfter:
        """
        Errors of the training rows.
        """
    @property
    def warnings(self) -> tuple[str, ...]:
        """
        What to know before trusting it.
        """
class Prediction:
    """
    What the robot predicts for the rows of some data.
    """
    def __repr__(self) -> str:
        ...
    @property
    def distance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Shape=(n,) [m]; empty without an anchor.
        """
    @property
    def orientation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 4]"]:
        """
        Shape=(n, 4): w x y z, w >= 0.
        """
    @property
    def position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        Shape=(n, 3) [m]: target in the measurement frame.
        """
class Residuals:
    """
    Predicted minus measured; NaN where not measured.
    """
    def __repr__(self) -> str:
        ...
    @property
    def distance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Shape=(n,) [m]
        """
    @property
    def position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        Shape=(n, 3) [m]
        """
    @property
    def rotation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        Shape=(n, 3) [rad]: twice the vector part of the error quaternion.
        """
class Mistake:
    """
    What speaks against the robot file or the columns that were handed to `identify`.
    """
    def __repr__(self) -> str:
        ...
    @property
    def changes(self) -> tuple[Parameter, ...]:
        """
        What changed by more than a workshop makes, most first: 10 mm or 2 % of the robot's reach if that is
        more, 3 degrees, 5 % of a gear ratio. Three standard errors are taken off first. Zeros of joints are
        here only beside a reading that explains them: a controller may count from anywhere.
        """
    @property
    def kind(self) -> str:
        """
        'joint_sign', 'joint_order', 'joint_unit', 'length_unit', 'handedness', 'link_unit', 'row_shift',
        'convention', 'orientation_order', 'orientation_inverse' or 'pose_inverse': reading it otherwise
        explains the measurements; 'frame_change': two frames do; 'lag': joints of an instant before or
        after do; 'unexplained': nothing of this does.
        """
    @property
    def text(self) -> str:
        """
        What is wrong, and what to do, in sentences.
        """
class FreeParameter:
    """
    A parameter that some rows may determine, and where a fit of it starts.
    """
    def __repr__(self) -> str:
        ...
    @property
    def name(self) -> str:
        """
        Full name, as in a result: J2.a, base.rz, backlash.J3.
        """
    @property
    def role(self) -> str:
        """
        Base, geometry, offset, ratio, target, anchor or effect.
        """
    @property
    def unit(self) -> str:
        """
        m, rad, - ….
        """
    @property
    def value(self) -> float:
        """
        Of the robot as given, in `unit`; frames turn from where they stand, so rx ry rz are 0.
        """
class RowSums:
    """
    Normal equations of rows, and the errors of each.
    """
    def __repr__(self) -> str:
        ...
    @property
    def gradient(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Shape=(p,): J^T W r, r predicted minus measured.
        """
    @property
    def gram(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(p, p): J^T W J.
        """
    @property
    def position_error(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n,) [m] length of every row's position or distance error.
        """
    @property
    def rotation_error(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n,) [rad] of its rotation error, NaN: not measured; empty: none is.
        """
    @property
    def scores(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(p, p): sum over poses of g g^T, g = J^T W r of the pose's rows; empty: not asked.
        """
    @property
    def squares(self) -> float:
        """
        r^T W r.
        """
    @property
    def units(self) -> tuple[str, ...]:
        """
        Of the parameters.
        """
    @property
    def values(self) -> int:
        """
        Measured numbers that went in.
        """
class SeenColumns:
    """
    Which columns of a Gram matrix it can see.
    """
    @property
    def combination(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(kept, frozen): a frozen column is the kept ones times this.
        """
    @property
    def frozen(self) -> tuple[int, ...]:
        """
        Columns that those kept explain.
        """
    @property
    def kept(self) -> tuple[int, ...]:
        """
        Columns to fit, in increasing order.
        """
class GroupChoice:
    """
    Which groups of columns explain y, from normal equations of y = X theta + noise alone.
    """
    @property
    def groups(self) -> tuple[int, ...]:
        """
        Indices of those chosen.
        """
    @property
    def nats(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        For each of these: log Bayes factor against the choice without it, less its cost.
        """
    @property
    def rivals(self) -> tuple[list[int], ...]:
        """
        For each of these: groups that would lose less than 3 nats in its place.
        """
    @property
    def sigma(self) -> float:
        """
        Of the noise of one value, in its unit.
        """
    @property
    def solution(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Shape=(p,): theta, 0 for columns that are not chosen.
        """
class PlanOptions:
    """
    How `plan` works.
    
    poses = 50: Number of poses.
    min_step = 0.2617993877991494: [rad] least motion of a revolute joint between neighbours (15 deg)
    min_step_prismatic = 0.0: [m] the same for prismatic joints.
    index = 'd_optimal': What the plan maximises.
        'd_optimal': determinant (O1 of Borm and Menq 1989)
        'a_optimal': minus the sum of variances of unit-scaled parameters
        'e_optimal': smallest singular value (O3 of Nahvi et al. 1994)
        'inverse_condition': smallest over largest singular value (O2 of Driels and Pathre 1990)
        'noise_amplification': smallest squared over largest singular value (O4 of Nahvi and Hollerbach 1996)
    orientation = False: Full poses are measured, not only positions.
    position_sigma = 3e-05: [m] noise of one component, for the standard errors promised.
    rotation_sigma = 0.0001: [rad] likewise.
    sweeps = 4: Passes of exchange over all poses.
    proposals = 64: Candidates tried for a pose in a pass.
    seed = 0: Of the random start and the candidates.
    free = []: As in `IdentifyOptions`.
    effects = []: Effects that shall be seen as well.
    """
    def __init__(self, *, poses: typing.SupportsInt | typing.SupportsIndex = 50, min_step: typing.SupportsFloat | typing.SupportsIndex = 0.2617993877991494, min_step_prismatic: typing.SupportsFloat | typing.SupportsIndex = 0.0, index: typing.Literal['d_optimal', 'a_optimal', 'e_optimal', 'inverse_condition', 'noise_amplification'] = 'd_optimal', orientation: bool = False, position_sigma: typing.SupportsFloat | typing.SupportsIndex = 3e-05, rotation_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.0001, sweeps: typing.SupportsInt | typing.SupportsIndex = 4, proposals: typing.SupportsInt | typing.SupportsIndex = 64, seed: typing.SupportsInt | typing.SupportsIndex = 0, free: collections.abc.Sequence[str] = [], effects: collections.abc.Sequence[EffectRequest] = []) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> PlanOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> PlanOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def effects(self) -> tuple[EffectRequest, ...]:
        """
        Effects that shall be seen as well.
        """
    @effects.setter
    def effects(self, arg1: collections.abc.Sequence[EffectRequest]) -> None:
        ...
    @property
    def free(self) -> tuple[str, ...]:
        """
        As in `IdentifyOptions`.
        """
    @free.setter
    def free(self, arg1: collections.abc.Sequence[str]) -> None:
        ...
    @property
    def index(self) -> typing.Literal['d_optimal', 'a_optimal', 'e_optimal', 'inverse_condition', 'noise_amplification']:
        """
        What the plan maximises.
        
        'd_optimal': determinant (O1 of Borm and Menq 1989)
        'a_optimal': minus the sum of variances of unit-scaled parameters
        'e_optimal': smallest singular value (O3 of Nahvi et al. 1994)
        'inverse_condition': smallest over largest singular value (O2 of Driels and Pathre 1990)
        'noise_amplification': smallest squared over largest singular value (O4 of Nahvi and Hollerbach 1996)
        """
    @index.setter
    def index(self, arg1: typing.Literal['d_optimal', 'a_optimal', 'e_optimal', 'inverse_condition', 'noise_amplification']) -> None:
        ...
    @property
    def min_step(self) -> float:
        """
        [rad] least motion of a revolute joint between neighbours (15 deg)
        """
    @min_step.setter
    def min_step(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_step_prismatic(self) -> float:
        """
        [m] the same for prismatic joints.
        """
    @min_step_prismatic.setter
    def min_step_prismatic(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def orientation(self) -> bool:
        """
        Full poses are measured, not only positions.
        """
    @orientation.setter
    def orientation(self, arg1: bool) -> None:
        ...
    @property
    def poses(self) -> int:
        """
        Number of poses.
        """
    @poses.setter
    def poses(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def position_sigma(self) -> float:
        """
        [m] noise of one component, for the standard errors promised.
        """
    @position_sigma.setter
    def position_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def proposals(self) -> int:
        """
        Candidates tried for a pose in a pass.
        """
    @proposals.setter
    def proposals(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def rotation_sigma(self) -> float:
        """
        [rad] likewise.
        """
    @rotation_sigma.setter
    def rotation_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def seed(self) -> int:
        """
        Of the random start and the candidates.
        """
    @seed.setter
    def seed(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def sweeps(self) -> int:
        """
        Passes of exchange over all poses.
        """
    @sweeps.setter
    def sweeps(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class PlanResult:
    """
    What `plan` found.
    """
    def __repr__(self) -> str:
        ...
    @property
    def exchanges(self) -> int:
        """
        Number of poses exchanged.
        """
    @property
    def frozen(self) -> tuple[Frozen, ...]:
        """
        What no plan of this kind could see.
        """
    @property
    def index_end(self) -> float:
        """
        Index of this plan.
        """
    @property
    def index_start(self) -> float:
        """
        Index of the random plan that the exchange began with.
        """
    @property
    def joints(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(poses, driven joints) [rad | m].
        """
    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """
        Sigma: the standard error that this plan promises.
        """
class DistinguishOptions:
    """
    How `distinguish` works: what will be recorded beside joints and tip, how far it will be varied, and
    what shall be told apart.
    
    columns = []: What is recorded beside joints and tip, of 'dir', 'payload', 'temp', 't'.
    separate = []: Effects to be told apart; poses are added if it takes any. Empty: the whole catalogue is looked at,
        and none are.
    payload = 5.0: [kg] a pose is measured with this or with nothing.
    temperature_low = 20.0: [deg C] at the first and the last pose.
    temperature_high = 35.0: [deg C] halfway.
    seconds_per_pose = 30.0: [s]
    orientation = False: Full poses are measured, not only positions.
    position_sigma = 3e-05: [m] noise of one component.
    rotation_sigma = 0.0001: [rad] likewise.
    alike = 0.98: An effect of which another explains a larger fraction is not told from it.
    add = 12: Maximum number of poses added.
    proposals = 300: Candidates that each of them is chosen from.
    min_step = 0.2617993877991494: [rad] least motion of a revolute joint to an added pose.
    min_step_prismatic = 0.0: [m] the same for prismatic joints.
    seed = 0: Of directions, payloads and proposals.
    """
    def __init__(self, *, columns: collections.abc.Sequence[str] = [], separate: collections.abc.Sequence[EffectRequest] = [], payload: typing.SupportsFloat | typing.SupportsIndex = 5.0, temperature_low: typing.SupportsFloat | typing.SupportsIndex = 20.0, temperature_high: typing.SupportsFloat | typing.SupportsIndex = 35.0, seconds_per_pose: typing.SupportsFloat | typing.SupportsIndex = 30.0, orientation: bool = False, position_sigma: typing.SupportsFloat | typing.SupportsIndex = 3e-05, rotation_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.0001, alike: typing.SupportsFloat | typing.SupportsIndex = 0.98, add: typing.SupportsInt | typing.SupportsIndex = 12, proposals: typing.SupportsInt | typing.SupportsIndex = 300, min_step: typing.SupportsFloat | typing.SupportsIndex = 0.2617993877991494, min_step_prismatic: typing.SupportsFloat | typing.SupportsIndex = 0.0, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> DistinguishOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> DistinguishOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def add(self) -> int:
        """
        Maximum number of poses added.
        """
    @add.setter
    def add(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def alike(self) -> float:
        """
        An effect of which another explains a larger fraction is not told from it.
        """
    @alike.setter
    def alike(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def columns(self) -> tuple[str, ...]:
        """
        What is recorded beside joints and tip, of 'dir', 'payload', 'temp', 't'.
        """
    @columns.setter
    def columns(self, arg1: collections.abc.Sequence[str]) -> None:
        ...
    @property
    def min_step(self) -> float:
        """
        [rad] least motion of a revolute joint to an added pose.
        """
    @min_step.setter
    def min_step(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def min_step_prismatic(self) -> float:
        """
        [m] the same for prismatic joints.
        """
    @min_step_prismatic.setter
    def min_step_prismatic(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def orientation(self) -> bool:
        """
        Full poses are measured, not only positions.
        """
    @orientation.setter
    def orientation(self, arg1: bool) -> None:
        ...
    @property
    def payload(self) -> float:
        """
        [kg] a pose is measured with this or with nothing.
        """
    @payload.setter
    def payload(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def position_sigma(self) -> float:
        """
        [m] noise of one component.
        """
    @position_sigma.setter
    def position_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def proposals(self) -> int:
        """
        Candidates that each of them is chosen from.
        """
    @proposals.setter
    def proposals(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def rotation_sigma(self) -> float:
        """
        [rad] likewise.
        """
    @rotation_sigma.setter
    def rotation_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def seconds_per_pose(self) -> float:
        """
        [s]
        """
    @seconds_per_pose.setter
    def seconds_per_pose(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def seed(self) -> int:
        """
        Of directions, payloads and proposals.
        """
    @seed.setter
    def seed(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def separate(self) -> tuple[EffectRequest, ...]:
        """
        Effects to be told apart; poses are added if it takes any. Empty: the whole catalogue is looked at,
        and none are.
        """
    @separate.setter
    def separate(self, arg1: collections.abc.Sequence[EffectRequest]) -> None:
        ...
    @property
    def temperature_high(self) -> float:
        """
        [deg C] halfway.
        """
    @temperature_high.setter
    def temperature_high(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def temperature_low(self) -> float:
        """
        [deg C] at the first and the last pose.
        """
    @temperature_low.setter
    def temperature_low(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class EffectSize:
    """
    The smallest effect that a plan would see.
    """
    def __repr__(self) -> str:
        ...
    @property
    def effect(self) -> str:
        """
        Its name.
        """
    @property
    def joint(self) -> str:
        """
        Where; empty: it belongs to no joint.
        """
    @property
    def parameter(self) -> str:
        """
        The one of its parameters that shows best.
        """
    @property
    def size(self) -> float:
        """
        In `unit`, when base and tool are fitted.
        """
    @property
    def size_at_tip(self) -> float:
        """
        [m] rms motion of the tip that this makes.
        """
    @property
    def size_with_geometry(self) -> float:
        """
        In `unit`, when all geometry is fitted as well; NaN: geometry takes it all up.
        """
    @property
    def size_with_geometry_at_tip(self) -> float:
        """
        [m] rms motion of the tip that this makes.
        """
    @property
    def standard_errors(self) -> float:
        """
        `size` in standard errors of the parameter, the others of its effect left out.
        """
    @property
    def unit(self) -> str:
        """
        Of `size`.
        """
class EffectPair:
    """
    Two effects, and how far the other can explain the first.
    """
    def __repr__(self) -> str:
        ...
    @property
    def effect(self) -> str:
        """
        The first.
        """
    @property
    def joint(self) -> str:
        """
        Where; empty: it belongs to no joint.
        """
    @property
    def other(self) -> str:
        """
        The other.
        """
    @property
    def other_joint(self) -> str:
        """
        Where the other is; empty: it belongs to no joint.
        """
    @property
    def parameter(self) -> str:
        """
        Of the first: what `size` is of.
        """
    @property
    def r2(self) -> float:
        """
        Fraction of the first's motion of the tip, beyond base and tool, that the other explains.
        """
    @property
    def r2_after(self) -> float:
        """
        With the added poses; NaN: none were asked for.
        """
    @property
    def separated_by(self) -> str:
        """
        What to measure to tell.
        """
    @property
    def size(self) -> float:
        """
        From which on the two are told apart; NaN: never.
        """
    @property
    def size_after(self) -> float:
        """
        The same with the added poses.
        """
    @property
    def unit(self) -> str:
        """
        Of `size`.
        """
class Distinction:
    """
    What `distinguish` found, of all poses, added ones included.
    """
    def __repr__(self) -> str:
        ...
    @property
    def added(self) -> int:
        """
        Number of poses added; they are the last ones.
        """
    @property
    def alike(self) -> tuple[EffectPair, ...]:
        """
        Pairs that are not told apart, largest r2 first.
        """
    @property
    def direction(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(poses, driven joints): approach direction, -1 or 1; None unless asked for.
        """
    @property
    def effects(self) -> tuple[EffectSize, ...]:
        """
        The smallest sizes that the plan would see.
        """
    @property
    def joints(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(poses, driven joints) [rad | m]: the poses given, then those added.
        """
    @property
    def not_testable(self) -> tuple[NotTestable, ...]:
        """
        Effects that such data could not show.
        """
    @property
    def payload(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(poses,) [kg]; None unless asked for.
        """
    @property
    def r2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(effects, effects): fraction of the row's effect that the column's explains.
        """
    @property
    def separated(self) -> tuple[EffectPair, ...]:
        """
        Every pair of those to be told apart, before and after poses were added.
        """
    @property
    def temperature(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(poses,) [deg C]; None unless asked for.
        """
    @property
    def time(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(poses,) [s]; None unless asked for.
        """
class DiagnoseOptions:
    """
    How `diagnose` works.
    
    leave_out = []: Effects that are not to be considered, by name.
    false_alarm = 0.01: False-positive rate: chance that a robot without any gap is said to have one.
    max_effects = 12: Maximum number of effects named.
    test_share = 0.2: Fraction of the pose groups held out when the data has no `set`.
    search_poses = 6000: Maximum number of pose groups searched; errors are those of all rows.
    resamples = 60: Bootstrap samples of folds of pose groups for the intervals, the chosen effects fitted again; at
        most 10 more repeat the selection.
    rotation_length = 0.1: [m] a rotation error of 1 rad counts as this length in reported errors.
    seed = 0: Of the split and of every simulation.
    threads = 0: 0: as many as the machine has.
    also = []: Effects that are considered only when they are asked for, by name.
    """
    def __init__(self, *, leave_out: collections.abc.Sequence[str] = [], false_alarm: typing.SupportsFloat | typing.SupportsIndex = 0.01, max_effects: typing.SupportsInt | typing.SupportsIndex = 12, test_share: typing.SupportsFloat | typing.SupportsIndex = 0.2, search_poses: typing.SupportsInt | typing.SupportsIndex = 6000, resamples: typing.SupportsInt | typing.SupportsIndex = 60, rotation_length: typing.SupportsFloat | typing.SupportsIndex = 0.1, seed: typing.SupportsInt | typing.SupportsIndex = 0, threads: typing.SupportsInt | typing.SupportsIndex = 0, also: collections.abc.Sequence[str] = []) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> DiagnoseOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> DiagnoseOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def also(self) -> tuple[str, ...]:
        """
        Effects that are considered only when they are asked for, by name.
        """
    @also.setter
    def also(self, arg1: collections.abc.Sequence[str]) -> None:
        ...
    @property
    def false_alarm(self) -> float:
        """
        False-positive rate: chance that a robot without any gap is said to have one.
        """
    @false_alarm.setter
    def false_alarm(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def leave_out(self) -> tuple[str, ...]:
        """
        Effects that are not to be considered, by name.
        """
    @leave_out.setter
    def leave_out(self, arg1: collections.abc.Sequence[str]) -> None:
        ...
    @property
    def max_effects(self) -> int:
        """
        Maximum number of effects named.
        """
    @max_effects.setter
    def max_effects(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def resamples(self) -> int:
        """
        Bootstrap samples of folds of pose groups for the intervals, the chosen effects fitted again; at
        most 10 more repeat the selection.
        """
    @resamples.setter
    def resamples(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def rotation_length(self) -> float:
        """
        [m] a rotation error of 1 rad counts as this length in reported errors.
        """
    @rotation_length.setter
    def rotation_length(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def search_poses(self) -> int:
        """
        Maximum number of pose groups searched; errors are those of all rows.
        """
    @search_poses.setter
    def search_poses(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def seed(self) -> int:
        """
        Of the split and of every simulation.
        """
    @seed.setter
    def seed(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def test_share(self) -> float:
        """
        Fraction of the pose groups held out when the data has no `set`.
        """
    @test_share.setter
    def test_share(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def threads(self) -> int:
        """
        0: as many as the machine has.
        """
    @threads.setter
    def threads(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class Share:
    """
    A fraction and its 90 % interval.
    """
    def __repr__(self) -> str:
        ...
    @property
    def high(self) -> float:
        """
        Upper end.
        """
    @property
    def low(self) -> float:
        """
        Lower end.
        """
    @property
    def value(self) -> float:
        """
        1: all of it.
        """
class HeldOutFall:
    """
    How the error of a held-out pose falls with what was found, pose by pose: of its rms error, so that
    no single pose far out decides.
    """
    def __repr__(self) -> str:
        ...
    @property
    def mean(self) -> float:
        """
        [m] over the poses: error without what was found, less that with it.
        """
    @property
    def poses(self) -> int:
        """
        Number of held-out poses.
        """
    @property
    def probability(self) -> float:
        """
        That errors of other poses fall, too: Student's t of the paired differences.
        """
    @property
    def sigma(self) -> float:
        """
        [m] standard error of the mean, by its scatter over the poses.
        """
class Alternative:
    """
    An effect that would explain the data as well.
    """
    def __repr__(self) -> str:
        ...
    @property
    def effect(self) -> str:
        """
        Its name.
        """
    @property
    def joints(self) -> tuple[str, ...]:
        """
        Where.
        """
    @property
    def probability(self) -> float:
        """
        Its part of the class's posterior probability.
        """
    @property
    def separated_by(self) -> str:
        """
        What to measure to tell.
        """
class Curve:
    """
    A fitted law, or a free function, drawn against its input: value at the site [rad | m].
    """
    def __repr__(self) -> str:
        ...
    @property
    def input(self) -> str:
        """
        'q4', 'torque2', 'temp', 'time', 'dir3', 'payload', a covariate.
        """
    @property
    def input_unit(self) -> str:
        """
        Of the input.
        """
    @property
    def period(self) -> float:
        """
        That the input is folded by, in its unit; 0: it is not folded.
        """
    @property
    def points(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n, 3): input, value, standard error.
        """
    @property
    def samples(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n, 2): input and value of single poses, at most 600.
        """
    @property
    def second_high(self) -> float:
        """
        Of the second input: upper bound.
        """
    @property
    def second_input(self) -> str:
        """
        Of a function of two inputs the other one, held between the two bounds below; or empty.
        """
    @property
    def second_low(self) -> float:
        """
        Of the second input: lower bound.
        """
    @property
    def site(self) -> str:
        """
        What moves: a joint's name, 'base.x' ….
        """
    @property
    def unit(self) -> str:
        """
        Of the value and its standard error: rad or m.
        """
class FoundEffect:
    """
    An effect that `diagnose` named.
    """
    def __repr__(self) -> str:
        ...
    @property
    def confounded_with(self) -> tuple[Alternative, ...]:
        """
        Effects that would explain these data as well.
        """
    @property
    def curves(self) -> tuple[Curve, ...]:
        """
        The law, drawn through single poses.
        """
    @property
    def effect(self) -> str:
        """
        Its name, as in `catalogue()`, or that of an effect of one's own.
        """
    @property
    def grounds(self) -> types.MappingProxyType[str, float]:
        """
        What that was worked out from: the class's `posterior` against others, and what speaks for a name or
        against it.
        """
    @property
    def held_out_after(self) -> ErrorStatistics:
        """
        Held-out errors with all named effects.
        """
    @property
    def held_out_before(self) -> ErrorStatistics:
        """
        Errors of poses that the fit did not see, without this effect, all others in.
        """
    @property
    def identify_as(self) -> str:
        """
        What `effects` of `identify` and `truing identify --effects` take for it: 'backlash:J3'; empty for a
        frame that wanders.
        """
    @property
    def joints(self) -> tuple[str, ...]:
        """
        Where.
        """
    @property
    def note(self) -> str:
        """
        What else is to be known of it: 'not linear in the torque' …; may be empty.
        """
    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """
        Values and standard errors.
        """
    @property
    def probability(self) -> float:
        """
        Posterior of the class: this effect or one of `confounded_with`.
        """
    @property
    def share(self) -> float:
        """
        Fraction of the gap's mean square: its fall when the effect is added with the size found, averaged
        over the orders in which effects may be added; those of all effects and unknowns add up to what was
        closed.
        """
    @property
    def share_alone(self) -> float:
        """
        Fraction of the gap's mean square that it closes when it is the only one.
        """
    @property
    def share_last(self) -> float:
        """
        Fraction that it closes when all others are in already.
        """
    @property
    def shrink(self) -> Share:
        """
        Of the rms, rotations counted by their noise: 1 - after / before.
        """
    @property
    def size_at_tip(self) -> float:
        """
        [m] rms motion of the tip that it makes, beyond what base and tool could do as well.
        """
class UnknownEffect:
    """
    A gap that no effect of the catalogue explains: a joint that moves as a smooth, stepwise or two-
    input function of recorded inputs; or more than repeats show, and no such function describes it.
    """
    def __repr__(self) -> str:
        ...
    @property
    def curves(self) -> tuple[Curve, ...]:
        """
        Along the first input; of two inputs, one for each of three ranges of the second.
        """
    @property
    def held_out_after(self) -> ErrorStatistics:
        """
        Held-out errors with it.
        """
    @property
    def held_out_before(self) -> ErrorStatistics:
        """
        Held-out errors without it.
        """
    @property
    def inputs(self) -> tuple[str, ...]:
        """
        One or two; none: no function of them describes it.
        """
    @property
    def joint(self) -> str:
        """
        A joint's name, 'base', or empty when only 'somewhere' can be said.
        """
    @property
    def looks_like(self) -> str:
        """
        In words: 'a step at q4 = 0.41 rad'.
        """
    @property
    def probability(self) -> float:
        """
        Posterior that there is such a thing.
        """
    @property
    def share(self) -> float:
        """
        Fraction of the gap's mean square, as that of an effect.
        """
    @property
    def shrink(self) -> Share:
        """
        Of the held-out rms: 1 - after / before.
        """
    @property
    def size_at_tip(self) -> float:
        """
        [m] rms motion of the tip, as that of an effect.
        """
class Detectable:
    """
    The smallest effect that would have been found.
    """
    def __repr__(self) -> str:
        ...
    @property
    def effect(self) -> str:
        """
        Its name.
        """
    @property
    def joint(self) -> str:
        """
        Where.
        """
    @property
    def parameter(self) -> str:
        """
        Of which parameter `size` is.
        """
    @property
    def size(self) -> float:
        """
        In `unit`.
        """
    @property
    def size_at_tip(self) -> float:
        """
        [m] rms motion of the tip that this makes.
        """
    @property
    def unit(self) -> str:
        """
        Of `size`.
        """
class Candidate:
    """
    One candidate before any selection: what methods without a search would go by.
    """
    def __repr__(self) -> str:
        ...
    @property
    def columns(self) -> int:
        """
        Number of parameters that the data can see.
        """
    @property
    def effect(self) -> str:
        """
        Its name.
        """
    @property
    def evidence(self) -> float:
        """
        Log Bayes factor against frames only.
        """
    @property
    def gain(self) -> float:
        """
        Fall of the sum of squares when it is added alone, in units of the noise.
        """
    @property
    def held_out_gain(self) -> float:
        """
        Cross-validated fall of the mean square, as a fraction of the gap.
        """
    @property
    def joints(self) -> tuple[str, ...]:
        """
        Where.
        """
    @property
    def largest_z(self) -> float:
        """
        Largest |estimate / standard error| when everything is fitted together.
        """
class SanityFinding:
    """
    What looks wrong with the data themselves.
    """
    def __repr__(self) -> str:
        ...
    @property
    def kind(self) -> str:
        """
        'joint_record', 'joint_order', 'joint_sign', 'joint_unit', 'length_unit', 'handedness', 'link_unit',
        'row_shift', 'convention', 'orientation_order', 'orientation_inverse', 'pose_inverse',
        'frame_change', 'gravity_direction', 'duplicates', 'direction', 'speed', 'lag', 'moved_target',
        'constant' or 'outliers'.
        """
    @property
    def mistake(self) -> bool:
        """
        The robot file or the columns are to be corrected: until then nothing is named.
        """
    @property
    def rows(self) -> tuple[int, ...]:
        """
        Rows (counted from 0) that it is about, if few.
        """
    @property
    def text(self) -> str:
        """
        A sentence with what to do.
        """
class NextPose:
    """
    A pose worth measuring next.
    """
    def __repr__(self) -> str:
        ...
    @property
    def direction(self) -> tuple[int, ...]:
        """
        Approach direction of every driven joint; empty: any.
        """
    @property
    def joints(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(driven joints,) [rad | m]
        """
    @property
    def payload(self) -> float:
        """
        [kg]; NaN: any.
        """
    @property
    def why(self) -> str:
        """
        What it tells.
        """
class WhereJoint:
    """
    How much of the closable gap sits at a joint.
    """
    def __repr__(self) -> str:
        ...
    @property
    def joint(self) -> str:
        """
        Its name.
        """
    @property
    def share(self) -> Share:
        """
        Fraction of the closable gap that a free function of the inputs at this joint explains.
        """
class WhereInput:
    """
    How much of the closable gap goes with an input.
    """
    def __repr__(self) -> str:
        ...
    @property
    def input(self) -> str:
        """
        Its name.
        """
    @property
    def share(self) -> float:
        """
        Fraction of the closable gap.
        """
class WorkspaceCell:
    """
    The error in one part of the workspace.
    """
    def __repr__(self) -> str:
        ...
    @property
    def center(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(3,) [m] in the base frame.
        """
    @property
    def n(self) -> int:
        """
        Number of rows.
        """
    @property
    def rms(self) -> float:
        """
        [m] of the gap.
        """
class Diagnosis:
    """
    What `diagnose` found.
    """
    def __repr__(self) -> str:
        ...
    def summary(self) -> str:
        """
        A few lines for people.
        """
    @property
    def after(self) -> ErrorStatistics:
        """
        Held-out errors with all named effects, corrections of their laws and drifts included.
        """
    @property
    def after_robot_with_unknown(self) -> ErrorStatistics:
        """
        Held-out errors by `robot_with_unknown`.
        """
    @property
    def after_unknown(self) -> ErrorStatistics:
        """
        Held-out errors with the unknown functions as well.
        """
    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """
        Every candidate, before any selection.
        """
    @property
    def closable(self) -> float:
        """
        Fraction of the gap's mean square above the noise floor that the named effects close.
        """
    @property
    def detectable(self) -> tuple[Detectable, ...]:
        """
        The smallest effects that would have been found, easiest joint first.
        """
    @property
    def direction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Shape=(3, 3): principal axes of the residual in the base frame, as columns.
        """
    @property
    def direction_rms(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) [m]: along them.
        """
    @property
    def directions(self) -> numpy.typing.NDArray[numpy.float64] | None:
        """
        shape=(n, driven joints): approach directions that were inferred from the order of the rows; None: the data had them.
        """
    @property
    def effects(self) -> tuple[FoundEffect, ...]:
        """
        By how much of the gap each explains, most first.
        """
    @property
    def error_after(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n,) [m]: of every row, as `after`.
        """
    @property
    def error_before(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n,) [m]: of every row, as `gap`.
        """
    @property
    def explained(self) -> typing.Literal['explained', 'partly explained', 'not explained', 'no gap', 'does not hold']:
        """
        How much is left.
        
        'explained': no more than the noise itself
        'partly explained': more than the noise, and at most half of the gap
        'not explained': more than half of the gap; or nothing was named
        'no gap': there was none beyond noise
        'does not hold': held-out errors are larger with what was found, for sure
        """
    @property
    def gap(self) -> ErrorStatistics:
        """
        Held-out errors with base, targets (and anchor) fitted only.
        """
    @property
    def held_out_fall(self) -> HeldOutFall:
        """
        How sure held-out poses are that what was found holds.
        """
    @property
    def joint_record(self) -> str:
        """
        'q' or 'qr': the record that explains the measurements better.
        """
    @property
    def neighbour_p95(self) -> float:
        """
        [m] 95th percentile of the errors of a nearest-neighbour predictor; NaN: too few rows.
        """
    @property
    def neighbour_share(self) -> float:
        """
        Fraction of the remaining mean square that a nearest-neighbour predictor explains.
        """
    @property
    def next_poses(self) -> tuple[NextPose, ...]:
        """
        Poses worth measuring next.
        """
    @property
    def noise_floor(self) -> float:
        """
        [m] rms length of a row's error that is noise.
        """
    @property
    def noise_from_repeats(self) -> bool:
        """
        The noise is that of repeated poses, not what a flexible fit leaves.
        """
    @property
    def not_testable(self) -> tuple[NotTestable, ...]:
        """
        What these data could not show.
        """
    @property
    def outliers(self) -> tuple[int, ...]:
        """
        Rows (counted from 0) with little weight.
        """
    @property
    def p_gap(self) -> float:
        """
        p-value of the gap: probability of a gain as large under noise alone.
        """
    @property
    def remaining_structure_p(self) -> float:
        """
        p-value of the free functions on the residual, by permutation.
        """
    @property
    def residuals_after(self) -> Residuals:
        """
        Predicted minus measured, of every row, as `after`.
        """
    @property
    def residuals_before(self) -> Residuals:
        """
        Predicted minus measured, of every row, as `gap`.
        """
    @property
    def robot(self) -> Robot:
        """
        With the effects that were named, free functions left out; part of this result.
        """
    @property
    def robot_before(self) -> Robot:
        """
        Nominal, with base and targets (and anchor) fitted; part of this result: copy it to change it.
        """
    @property
    def robot_with_unknown(self) -> Robot | None:
        """
        The same with the unknown functions of joint motions, directions, gravity torques, payload and
        temperature, as tables (effect lookup_table). None: there are none, or held-out poses do not gain by
        them for sure.
        """
    @property
    def sanity(self) -> tuple[SanityFinding, ...]:
        """
        What looks wrong with the data themselves.
        """
    @property
    def seed(self) -> int:
        """
        Of the split and of every simulation.
        """
    @property
    def sentence(self) -> str:
        """
        The verdict in words.
        """
    @property
    def set(self) -> numpy.typing.NDArray[numpy.int8]:
        """
        Shape=(n,): 0 train, 1 test, for every row.
        """
    @property
    def shrink(self) -> Share:
        """
        Of the held-out rms, by `robot`: 1 - its error / gap.
        """
    @property
    def unknown(self) -> tuple[UnknownEffect, ...]:
        """
        What no effect of the catalogue explains.
        """
    @property
    def verdict(self) -> typing.Literal['none', 'effects', 'unknown', 'effects+unknown', 'does_not_hold']:
        """
        Whether there is a gap, and whether the effects named explain it.
        
        'none': no gap beyond noise
        'effects': named, and nothing is left
        'unknown': a gap that no effect of the catalogue explains
        'effects+unknown': named, and something is left
        'does_not_hold': what was found makes errors of held-out poses larger, for sure: nothing of it is in `robot`
        """
    @property
    def warnings(self) -> tuple[str, ...]:
        """
        What to know before trusting it.
        """
    @property
    def where_inputs(self) -> tuple[WhereInput, ...]:
        """
        The gap by input.
        """
    @property
    def where_joints(self) -> tuple[WhereJoint, ...]:
        """
        The gap by joint.
        """
    @property
    def workspace(self) -> tuple[WorkspaceCell, ...]:
        """
        The gap by part of the workspace.
        """
class Camera:
    """
    A pinhole camera with lens distortion k1 k2 p1 p2 k3 (plumb bob, as OpenCV counts them). Focal lengths and centre in pixels.
    """
    def __init__(self, *, width: typing.SupportsInt | typing.SupportsIndex, height: typing.SupportsInt | typing.SupportsIndex, fx: typing.SupportsFloat | typing.SupportsIndex, fy: typing.SupportsFloat | typing.SupportsIndex, cx: typing.SupportsFloat | typing.SupportsIndex, cy: typing.SupportsFloat | typing.SupportsIndex, distortion: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = []) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> Camera:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> Camera:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def cx(self) -> float:
        """
        [px]
        """
    @cx.setter
    def cx(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def cy(self) -> float:
        """
        [px]
        """
    @cy.setter
    def cy(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def distortion(self) -> tuple[float, ...]:
        """
        k1 k2 p1 p2 k3
        """
    @distortion.setter
    def distortion(self, arg1: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(5)"]) -> None:
        ...
    @property
    def fx(self) -> float:
        """
        [px]
        """
    @fx.setter
    def fx(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def fy(self) -> float:
        """
        [px]
        """
    @fy.setter
    def fy(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def height(self) -> int:
        """
        [px]
        """
    @height.setter
    def height(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def width(self) -> int:
        """
        [px]
        """
    @width.setter
    def width(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class HandEyePoses:
    """
    One robot pose after the other: where the hand was, and where the camera saw the board.
    
    T_base_hand: shape=(n, 4, 4), the flange in the robot base, as the controller reports it.
    T_camera_board: shape=(n, 4, 4), the board in the camera.
    images: of each pose, the points of the board, shape=(m, 3) [m] in its frame, and where they were seen, shape=(m, 2)
        [px]; then pixels are what was measured, and T_camera_board is what was found from them. None: board poses were
        measured.
    camera: needed with images.
    set: 0 or 'train', 1 or 'test' (held out) for each pose; None: all are fitted.
    board_symmetries: turns after which the board looks the same, T_board_turned, shape=(4, 4), without the identity.
    
    Raises InputError that names the pose: values that are not finite, rotations that are not
    orthonormal (to 1e-6) or left-handed.
    """
    def __init__(self, T_base_hand: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"], T_camera_board: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"], *, images: collections.abc.Sequence[tuple[numpy.typing.ArrayLike, numpy.typing.ArrayLike]] | None = None, camera: Camera | None = None, set: numpy.typing.ArrayLike | collections.abc.Sequence[str | None] | None = None, board_symmetries: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]] = []) -> None:
        ...
    def __len__(self) -> int:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> HandEyePoses:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> HandEyePoses:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def T_base_hand(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n, 4, 4): the flange in the robot base.
        """
    @property
    def T_camera_board(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n, 4, 4): the board in the camera.
        """
    @property
    def board_symmetries(self) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"], ...]:
        """
        Turns after which the board looks the same.
        """
    @property
    def camera(self) -> Camera | None:
        """
        None without images.
        """
    @property
    def images(self) -> tuple[tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]], ...] | None:
        """
        Of each pose, points shape=(m, 3) [m] and pixels shape=(m, 2) [px]; None without images.
        """
    @property
    def set(self) -> numpy.typing.NDArray[numpy.int8] | None:
        """
        shape=(n,): 0 fitted, 1 held out; None: all are fitted.
        """
class HandEyeOptions:
    """
    How `handeye` works. Sigmas are standard deviations of one component; those that are not given are
    estimated.
    
    setup = 'eye-in-hand': Where the camera is.
        'eye-in-hand': camera on the hand, board in the cell
        'eye-to-hand': camera in the cell, board on the hand
    method = 'refined': How the frames are found.
        'refined': maximum likelihood: what was measured, robot poses and board poses (or pixels), each with its noise
        'closed-form': dual quaternions and one SVD alone (Daniilidis 1999)
    hand_position_sigma = None: [m] of the reported robot positions. Position noise of hand and board poses adds up: give both, or
        neither.
    hand_rotation_sigma = None: [rad] of the reported robot rotations.
    camera_position_sigma = None: [m] of the board's positions, without images.
    camera_rotation_sigma = None: [rad] of the board's rotations, without images.
    pixel_sigma = None: [px] of the board's points, with images.
    refine_camera = False: With images: focal lengths, centre and distortion are found as well.
    working_point = None: Shape=(3,) [m] in the camera frame: where accuracy is asked for; not given: the mean of the board's
        positions.
    known_height = None: [m] where all rotation axes are parallel: the camera's coordinate along that axis, in the frame that
        carries the camera.
    known_height_sigma = 0.0: [m] standard deviation of `known_height`.
    reject = True: Find poses that do not fit the others, list them, go on without.
    reject_beyond = 3.0: Poses whose root mean square of six standardised residuals is larger.
    recognise = True: Where the loop does not close: try other readings of the same numbers, and name the one that closes.
    reading = '': Use the poses in this other reading, a name of `handeye_readings`; empty: as given.
    max_iterations = 1000: The fit stops here at the latest: which noise is whose may take hundreds of short steps to find from
        few poses.
    """
    def __init__(self, *, setup: typing.Literal['eye-in-hand', 'eye-to-hand'] = 'eye-in-hand', method: typing.Literal['refined', 'closed-form'] = 'refined', hand_position_sigma: typing.SupportsFloat | typing.SupportsIndex | None = None, hand_rotation_sigma: typing.SupportsFloat | typing.SupportsIndex | None = None, camera_position_sigma: typing.SupportsFloat | typing.SupportsIndex | None = None, camera_rotation_sigma: typing.SupportsFloat | typing.SupportsIndex | None = None, pixel_sigma: typing.SupportsFloat | typing.SupportsIndex | None = None, refine_camera: bool = False, working_point: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None = None, known_height: typing.SupportsFloat | typing.SupportsIndex | None = None, known_height_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.0, reject: bool = True, reject_beyond: typing.SupportsFloat | typing.SupportsIndex = 3.0, recognise: bool = True, reading: str = '', max_iterations: typing.SupportsInt | typing.SupportsIndex = 1000) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> HandEyeOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> HandEyeOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def camera_position_sigma(self) -> float | None:
        """
        [m] of the board's positions, without images.
        """
    @camera_position_sigma.setter
    def camera_position_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    @property
    def camera_rotation_sigma(self) -> float | None:
        """
        [rad] of the board's rotations, without images.
        """
    @camera_rotation_sigma.setter
    def camera_rotation_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    @property
    def hand_position_sigma(self) -> float | None:
        """
        [m] of the reported robot positions. Position noise of hand and board poses adds up: give both, or
        neither.
        """
    @hand_position_sigma.setter
    def hand_position_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    @property
    def hand_rotation_sigma(self) -> float | None:
        """
        [rad] of the reported robot rotations.
        """
    @hand_rotation_sigma.setter
    def hand_rotation_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    @property
    def known_height(self) -> float | None:
        """
        [m] where all rotation axes are parallel: the camera's coordinate along that axis, in the frame that
        carries the camera.
        """
    @known_height.setter
    def known_height(self, arg1: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    @property
    def known_height_sigma(self) -> float:
        """
        [m] standard deviation of `known_height`.
        """
    @known_height_sigma.setter
    def known_height_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def max_iterations(self) -> int:
        """
        The fit stops here at the latest: which noise is whose may take hundreds of short steps to find from
        few poses.
        """
    @max_iterations.setter
    def max_iterations(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def method(self) -> typing.Literal['refined', 'closed-form']:
        """
        How the frames are found.
        
        'refined': maximum likelihood: what was measured, robot poses and board poses (or pixels), each with its noise
        'closed-form': dual quaternions and one SVD alone (Daniilidis 1999)
        """
    @method.setter
    def method(self, arg1: typing.Literal['refined', 'closed-form']) -> None:
        ...
    @property
    def pixel_sigma(self) -> float | None:
        """
        [px] of the board's points, with images.
        """
    @pixel_sigma.setter
    def pixel_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    @property
    def reading(self) -> str:
        """
        Use the poses in this other reading, a name of `handeye_readings`; empty: as given.
        """
    @reading.setter
    def reading(self, arg1: str) -> None:
        ...
    @property
    def recognise(self) -> bool:
        """
        Where the loop does not close: try other readings of the same numbers, and name the one that closes.
        """
    @recognise.setter
    def recognise(self, arg1: bool) -> None:
        ...
    @property
    def refine_camera(self) -> bool:
        """
        With images: focal lengths, centre and distortion are found as well.
        """
    @refine_camera.setter
    def refine_camera(self, arg1: bool) -> None:
        ...
    @property
    def reject(self) -> bool:
        """
        Find poses that do not fit the others, list them, go on without.
        """
    @reject.setter
    def reject(self, arg1: bool) -> None:
        ...
    @property
    def reject_beyond(self) -> float:
        """
        Poses whose root mean square of six standardised residuals is larger.
        """
    @reject_beyond.setter
    def reject_beyond(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def setup(self) -> typing.Literal['eye-in-hand', 'eye-to-hand']:
        """
        Where the camera is.
        
        'eye-in-hand': camera on the hand, board in the cell
        'eye-to-hand': camera in the cell, board on the hand
        """
    @setup.setter
    def setup(self, arg1: typing.Literal['eye-in-hand', 'eye-to-hand']) -> None:
        ...
    @property
    def working_point(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"] | None:
        """
        Shape=(3,) [m] in the camera frame: where accuracy is asked for; not given: the mean of the board's
        positions.
        """
    @working_point.setter
    def working_point(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None) -> None:
        ...
class HandEyeResidual:
    """
    How far a pose is from closing the loop: seen minus predicted board pose.
    """
    def __repr__(self) -> str:
        ...
    @property
    def cause(self) -> str:
        """
        Of a rejected pose: what it looks like.
        """
    @property
    def distance(self) -> float:
        """
        Root mean square of its six standardised residuals; about 1.
        """
    @property
    def pixels(self) -> float:
        """
        [px] rms with the robot pose as reported; NaN without images.
        """
    @property
    def pixels_corrected(self) -> float:
        """
        [px] rms with the robot pose as found; NaN without images.
        """
    @property
    def position(self) -> float:
        """
        [m] length.
        """
    @property
    def position_left_out(self) -> float:
        """
        [m] when the pose is left out of the fit, of the lens too where that was found from the images
        (held-out poses: the same as `position`). NaN where the other poses do not hold the answer.
        """
    @property
    def rejected(self) -> bool:
        """
        Left out of the fit.
        """
    @property
    def rotation(self) -> float:
        """
        [rad] angle.
        """
    @property
    def rotation_left_out(self) -> float:
        """
        [rad] likewise.
        """
class HandEyeErrors:
    """
    Closure of the loop over a set of poses.
    """
    def __repr__(self) -> str:
        ...
    @property
    def n(self) -> int:
        """
        Number of poses.
        """
    @property
    def pixel_rms(self) -> float:
        """
        [px] NaN without images.
        """
    @property
    def position_max(self) -> float:
        """
        [m]
        """
    @property
    def position_mean(self) -> float:
        """
        [m]
        """
    @property
    def position_p95(self) -> float:
        """
        [m] 95th percentile.
        """
    @property
    def position_rms(self) -> float:
        """
        [m]
        """
    @property
    def rotation_rms(self) -> float:
        """
        [rad]
        """
class Unobservable:
    """
    What the motions cannot show.
    """
    def __repr__(self) -> str:
        ...
    @property
    def advice(self) -> str:
        """
        What to do.
        """
    @property
    def direction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,): unit vector in the frame with the camera.
        """
    @property
    def reason(self) -> typing.Literal['no_rotation', 'one_axis', 'large_error', 'singular']:
        """
        Why, for programs.
        
        'no_rotation': the hand moved without turning
        'one_axis': all rotations are about one axis: the camera's coordinate along it
        'large_error': the standard error is too large to be an answer
        'singular': camera and board can move together without opening the loop
        """
    @property
    def rotation(self) -> bool:
        """
        About the direction, not along it.
        """
    @property
    def sigma(self) -> float:
        """
        [m] or [rad]; infinite: not at all.
        """
    @property
    def what(self) -> str:
        """
        In words: "the camera's position along base z".
        """
class Reading:
    """
    Another reading of the numbers: what it would mean, and how well the loop then closes.
    """
    def __repr__(self) -> str:
        ...
    @property
    def explanation(self) -> str:
        """
        In words: 'hand poses are base in hand (inverted)'.
        """
    @property
    def name(self) -> str:
        """
        To be given as `reading`; empty: as given. "other-setup": the set-up is to be given as the other
        one.
        """
    @property
    def other_setup(self) -> bool:
        """
        It is about the set-up: camera and board are in each other's place.
        """
    @property
    def position_rms(self) -> float:
        """
        [m] median closure.
        """
    @property
    def rotation_rms(self) -> float:
        """
        [rad]
        """
class HandEyeConcern:
    """
    What a warning is about, with its numbers.
    """
    def __repr__(self) -> str:
        ...
    @property
    def kind(self) -> typing.Literal['not_like_noise', 'beyond_pixels', 'noise_of_one_side', 'noise_too_small', 'board_scale', 'other_lens', 'behind_camera']:
        """
        What it is.
        
        'not_like_noise': plain weights predict poses left out to `value`, the noise that was found to `reference` [m]
        'beyond_pixels': boards scatter by `value` [rad], `reference` times what their pixels can tell
        'noise_of_one_side': position noise was given of hand or board alone: it was not used
        'noise_too_small': poses scatter by `value` times the noise that was given
        'board_scale': the loop closes best with lengths of board poses times `value`, standard error `reference`
        'other_lens': pixels scatter by `value` [px] with the lens as given, by `reference` with one that fits them
        'behind_camera': `value` of `reference` boards are not in front of the camera
        """
    @property
    def reference(self) -> float:
        """
        As `kind` says.
        """
    @property
    def value(self) -> float:
        """
        As `kind` says.
        """
class HandEyeNoise:
    """
    Standard deviations of one component, as given or as found. Position noise of hand and board poses
    adds up: data see the sum alone.
    """
    def __repr__(self) -> str:
        ...
    @property
    def camera_rotation(self) -> float:
        """
        [rad] of board poses; with images what is beyond their pixels' noise.
        """
    @property
    def estimated(self) -> bool:
        """
        Any of them was estimated from the data.
        """
    @property
    def hand_rotation(self) -> float:
        """
        [rad]
        """
    @property
    def pixel(self) -> float:
        """
        [px] NaN without images.
        """
    @property
    def position(self) -> float:
        """
        [m] of hand and board pose together; with images of the hand alone.
        """
class ClosedForm:
    """
    The dual-quaternion solution alone, in its parts.
    """
    def __repr__(self) -> str:
        ...
    @property
    def T_parent_board(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4): in the base (eye in hand) or in the hand.
        """
    @property
    def T_parent_camera(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4): in the hand (eye in hand) or in the base.
        """
    @property
    def axes_spread(self) -> float:
        """
        Second over first principal rotation of the motions: 0 one axis, 1 two alike.
        """
    @property
    def length_scale(self) -> float:
        """
        [m] the unit of length in the equations.
        """
    @property
    def motions(self) -> int:
        """
        Number of motions used.
        """
    @property
    def residual(self) -> float:
        """
        Of the unit dual quaternion in the equations, per motion.
        """
    @property
    def rotation(self) -> float:
        """
        [rad] rms angle of the motions.
        """
    @property
    def singular_values(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[8, 1]"]:
        """
        Shape=(8,), descending; of exact data the last two are 0.
        """
class NextHandPose:
    """
    A robot pose that would help.
    """
    def __repr__(self) -> str:
        ...
    @property
    def T_base_hand(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4)
        """
    @property
    def T_camera_board(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4): what the camera is expected to see.
        """
    @property
    def working_point_sigma(self) -> float:
        """
        [m] standard error of the working point per axis (rms over three), with this pose and those before
        it measured.
        """
class ClockOffset:
    """
    Two records of the same motion by two clocks.
    """
    def __repr__(self) -> str:
        ...
    @property
    def T_base_hand(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(rows, 4, 4): hand poses at the times of those rows.
        """
    @property
    def correlation(self) -> float:
        """
        Of the two angular velocities, smoothed, at that offset.
        """
    @property
    def found(self) -> bool:
        """
        False: `message` says why.
        """
    @property
    def message(self) -> str:
        """
        Why not, or how sure.
        """
    @property
    def offset(self) -> float:
        """
        [s] t_hand = t_camera + offset.
        """
    @property
    def rows(self) -> tuple[int, ...]:
        """
        Camera rows (counted from 0) inside the hand's record.
        """
    @property
    def sigma(self) -> float:
        """
        [s]
        """
class HandEyeResult:
    """
    What `handeye` found.
    """
    def __repr__(self) -> str:
        ...
    def summary(self) -> str:
        """
        A few lines for people.
        """
    @property
    def T_base_hand(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n, 4, 4): fitted poses as found, others as reported.
        """
    @property
    def as_given(self) -> Reading:
        """
        Closure of the poses as they are; with status `not closing` alone.
        """
    @property
    def axes_spread(self) -> float:
        """
        Second over first principal rotation of the motions: 0 one axis, 1 two alike.
        """
    @property
    def board(self) -> UncertainFrame:
        """
        T_parent_board, in the base (eye in hand) or in the hand.
        """
    @property
    def board_degrees_of_freedom(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        Shape=(6,): the same of `board`.
        """
    @property
    def board_scale(self) -> float:
        """
        Factor on the board's lengths that would fit best; 1: as given. With status `not closing` the loop
        closes with it.
        """
    @property
    def board_scale_sigma(self) -> float:
        """
        Standard error of `board_scale`; NaN: not known.
        """
    @property
    def camera(self) -> UncertainFrame:
        """
        T_parent_camera, in the hand (eye in hand) or in the base; only with status `done` or `not
        converged`.
        """
    @property
    def camera_degrees_of_freedom(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        Shape=(6,): an interval of `camera` is its standard error times the quantile of Student's t of so
        many degrees of freedom, in the order of its covariance; infinite: the noise was given, and the
        quantile is the normal one.
        """
    @property
    def camera_model(self) -> Camera | None:
        """
        As refined, if it was.
        """
    @property
    def camera_model_sigma(self) -> tuple[float, ...]:
        """
        Standard errors of fx fy cx cy [px] k1 k2 p1 p2 k3.
        """
    @property
    def concerns(self) -> tuple[HandEyeConcern, ...]:
        """
        What each warning is about, for programs, which must not go by its text.
        """
    @property
    def left_out(self) -> HandEyeErrors:
        """
        The same, each predicted without itself; NaN where one cannot be.
        """
    @property
    def message(self) -> str:
        """
        One sentence.
        """
    @property
    def noise(self) -> HandEyeNoise:
        """
        As given or estimated.
        """
    @property
    def readings(self) -> tuple[Reading, ...]:
        """
        Other readings that close, best first; with status `not closing` alone.
        """
    @property
    def rejected(self) -> tuple[int, ...]:
        """
        Poses (counted from 0) that do not fit the others.
        """
    @property
    def residuals(self) -> tuple[HandEyeResidual, ...]:
        """
        One per pose.
        """
    @property
    def singular_gap(self) -> float:
        """
        Sixth over seventh singular value: how clearly two null vectors stand out.
        """
    @property
    def singular_values(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[8, 1]"]:
        """
        Shape=(8,), of the motions' equations, descending, lengths in units of the closed form's
        `length_scale`.
        """
    @property
    def solver(self) -> SolverSummary:
        """
        How the solver ended.
        """
    @property
    def status(self) -> typing.Literal['done', 'not observable', 'not closing', 'not converged']:
        """
        Whether there is a result, and why not.
        
        'not observable': `unobservable` says which directions, and what to do
        'not closing': the loop does not close; `readings` has the one that does, if any
        """
    @property
    def symmetry(self) -> tuple[int, ...]:
        """
        Per pose: which of board_symmetries (1 …) it was read in; 0: as given.
        """
    @property
    def test(self) -> HandEyeErrors | None:
        """
        Held-out poses, all of them, if any.
        """
    @property
    def train(self) -> HandEyeErrors:
        """
        Poses fitted, without rejected ones.
        """
    @property
    def unobservable(self) -> tuple[Unobservable, ...]:
        """
        What the motions cannot show.
        """
    @property
    def warnings(self) -> tuple[str, ...]:
        """
        What to know or do: a board of another size, a robot that is off, noise given too small ….
        """
    @property
    def working_point(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) [m] in the camera frame.
        """
    @property
    def working_point_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Shape=(3, 3) [m^2] of that point in the frame that carries the camera.
        """
class HandEyeKinematics:
    """
    What `handeye_with_kinematics` found: hand-eye, board mount and the robot's own parameters.
    """
    def __repr__(self) -> str:
        ...
    @property
    def board(self) -> UncertainFrame:
        """
        As in `HandEyeResult`, of the calibrated robot.
        """
    @property
    def camera(self) -> UncertainFrame:
        """
        As in `HandEyeResult`, of the calibrated robot.
        """
    @property
    def identification(self) -> Identification:
        """
        Of the robot whose tool is the camera (eye in hand) or the board, measured in the frame of the
        other.
        """
    @property
    def residuals(self) -> tuple[HandEyeResidual, ...]:
        """
        One per pose, with the calibrated robot; none is left out.
        """
    @property
    def robot(self) -> Robot:
        """
        Calibrated, its tool the flange as given, its base the origin; part of this result: copy it before
        changing it.
        """
    @property
    def test_after(self) -> HandEyeErrors | None:
        """
        The same of held-out poses, if any.
        """
    @property
    def test_before(self) -> HandEyeErrors | None:
        """
        The same of held-out poses, if any.
        """
    @property
    def train_after(self) -> HandEyeErrors:
        """
        Closure with the calibrated robot.
        """
    @property
    def train_before(self) -> HandEyeErrors:
        """
        Closure with the robot as it was, base and tool fitted.
        """
    @property
    def working_point(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) [m] in the camera frame.
        """
    @property
    def working_point_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Shape=(3, 3) [m^2] of that point in the frame that carries the camera.
        """
class HandEyePlanOptions:
    """
    How `handeye_plan` chooses.
    
    count = 5: Number of poses.
    candidates = 400: Candidates tried for each.
    tilt = 0.7853981633974483: [rad] the board is seen at no more than this from its normal, beyond what was seen (45 deg).
    reach = 0.15: [m] hands stay this close to a measured one.
    seed = 0: Of the candidates.
    """
    def __init__(self, *, count: typing.SupportsInt | typing.SupportsIndex = 5, candidates: typing.SupportsInt | typing.SupportsIndex = 400, tilt: typing.SupportsFloat | typing.SupportsIndex = 0.7853981633974483, reach: typing.SupportsFloat | typing.SupportsIndex = 0.15, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> HandEyePlanOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> HandEyePlanOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def candidates(self) -> int:
        """
        Candidates tried for each.
        """
    @candidates.setter
    def candidates(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def count(self) -> int:
        """
        Number of poses.
        """
    @count.setter
    def count(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def reach(self) -> float:
        """
        [m] hands stay this close to a measured one.
        """
    @reach.setter
    def reach(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def seed(self) -> int:
        """
        Of the candidates.
        """
    @seed.setter
    def seed(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def tilt(self) -> float:
        """
        [rad] the board is seen at no more than this from its normal, beyond what was seen (45 deg).
        """
    @tilt.setter
    def tilt(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class Task:
    """
    What is wanted of one target; `replace(...)` makes another one.
    
    The wanted pose's own axes say what the angles mean: with the default axes z is the torch, x the direction of
    travel.
    """
    def __init__(self, T_measurement_target: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"], *, kind: typing.Literal['pose', 'torch', 'point'] = 'pose', axis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ..., travel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ..., roll: tuple[float, float] = ..., preferred_roll: typing.SupportsFloat | typing.SupportsIndex | None = None, lead: tuple[float, float] = (0.0, 0.0), work: tuple[float, float] = (0.0, 0.0), retreat: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ..., longest_retreat: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> Task:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> Task:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def T_measurement_target(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4) [m] the wanted pose.
        """
    @property
    def axis(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) of a torch: its axis in the target's frame, unit vector.
        """
    @property
    def kind(self) -> typing.Literal['pose', 'torch', 'point']:
        """
        What of it is asked for.
        
        'pose': position and orientation
        'torch': axis-symmetric tool (5-DOF task): position and axis direction; the roll about the axis is free
        'point': position alone
        """
    @property
    def lead(self) -> tuple[float, float]:
        """
        (lower, upper) [rad] of a torch: how far the axis may lean towards `travel`.
        """
    @property
    def longest_retreat(self) -> float:
        """
        [m] maximum of that motion; 0: the target is not moved.
        """
    @property
    def preferred_roll(self) -> float | None:
        """
        [rad] the roll is as near to it as can be; None: any.
        """
    @property
    def retreat(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) unit vector in the wanted frame. Where every way to the target collides, the target is
        moved along it by the least that frees it; by default back along the torch.
        """
    @property
    def roll(self) -> tuple[float, float]:
        """
        (lower, upper) [rad] of a torch: the turn about `axis` that takes the wanted frame to the reached
        one, in (-pi, pi].
        """
    @property
    def travel(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) across `axis`: the direction that lead is measured in.
        """
    @property
    def work(self) -> tuple[float, float]:
        """
        (lower, upper) [rad] of a torch: how far the axis may lean towards `axis` x `travel`.
        """
class Conditions:
    """
    What acts on the robot besides its joints. Only what its effects ask for is looked at.
    
    direction = []: Approach direction of every driven joint, -1, 0 or 1; empty: the way from the seed to the answer.
    payload = 0.0: [kg] at the tool.
    temperature = None: [deg C]
    time = None: [s]
    joint_speed = []: [rad/s | m/s] of every driven joint.
    covariates = {}: What else the effects look at, by column name.
    """
    def __init__(self, *, direction: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex] = [], payload: typing.SupportsFloat | typing.SupportsIndex = 0.0, temperature: typing.SupportsFloat | typing.SupportsIndex | None = None, time: typing.SupportsFloat | typing.SupportsIndex | None = None, joint_speed: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], covariates: collections.abc.Mapping[str, typing.SupportsFloat | typing.SupportsIndex] = {}) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> Conditions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> Conditions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def covariates(self) -> types.MappingProxyType[str, float]:
        """
        What else the effects look at, by column name.
        """
    @covariates.setter
    def covariates(self, arg1: collections.abc.Mapping[str, typing.SupportsFloat | typing.SupportsIndex]) -> None:
        ...
    @property
    def direction(self) -> tuple[int, ...]:
        """
        Approach direction of every driven joint, -1, 0 or 1; empty: the way from the seed to the answer.
        """
    @direction.setter
    def direction(self, arg1: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> None:
        ...
    @property
    def joint_speed(self) -> tuple[float, ...]:
        """
        [rad/s | m/s] of every driven joint.
        """
    @joint_speed.setter
    def joint_speed(self, arg1: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> None:
        ...
    @property
    def payload(self) -> float:
        """
        [kg] at the tool.
        """
    @payload.setter
    def payload(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def temperature(self) -> float | None:
        """
        [deg C]
        """
    @temperature.setter
    def temperature(self, arg1: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
    @property
    def time(self) -> float | None:
        """
        [s]
        """
    @time.setter
    def time(self, arg1: typing.SupportsFloat | typing.SupportsIndex | None) -> None:
        ...
class InverseOptions:
    """
    How `InverseSolver` works.
    
    position_tolerance = 1e-06: [m] a solution misses the task by no more.
    rotation_tolerance = 1e-06: [rad] likewise.
    choose = 'nearest': Which of several solutions.
        'nearest': nearest to the seed
        'limits_margin': furthest from the joint limits: by the smallest fraction of a joint's range left on either side
        'manipulability': of the joints that turn, furthest from singular: sqrt(det(J J^T)), lengths over `reach / pi`
        'rail_travel': least way of the prismatic joints from the seed, then nearest
    max_iterations = 60: Of one descent.
    max_restarts = 200: Descents from other seeds before a target is given up.
    wrist_tolerance = 0.01: [m] axes that miss each other by no more are taken to meet, for the seeds alone.
    parallel_tolerance = 0.02: [rad] axes nearer to parallel than this are taken to be, for the seeds alone.
    scene = Scene(): What the robot must not touch.
    """
    def __init__(self, *, position_tolerance: typing.SupportsFloat | typing.SupportsIndex = 1e-06, rotation_tolerance: typing.SupportsFloat | typing.SupportsIndex = 1e-06, choose: typing.Literal['nearest', 'limits_margin', 'manipulability', 'rail_travel'] = 'nearest', max_iterations: typing.SupportsInt | typing.SupportsIndex = 60, max_restarts: typing.SupportsInt | typing.SupportsIndex = 200, wrist_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.01, parallel_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.02, scene: Scene = ...) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> InverseOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> InverseOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def choose(self) -> typing.Literal['nearest', 'limits_margin', 'manipulability', 'rail_travel']:
        """
        Which of several solutions.
        
        'nearest': nearest to the seed
        'limits_margin': furthest from the joint limits: by the smallest fraction of a joint's range left on either side
        'manipulability': of the joints that turn, furthest from singular: sqrt(det(J J^T)), lengths over `reach / pi`
        'rail_travel': least way of the prismatic joints from the seed, then nearest
        """
    @choose.setter
    def choose(self, arg1: typing.Literal['nearest', 'limits_margin', 'manipulability', 'rail_travel']) -> None:
        ...
    @property
    def max_iterations(self) -> int:
        """
        Of one descent.
        """
    @max_iterations.setter
    def max_iterations(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def max_restarts(self) -> int:
        """
        Descents from other seeds before a target is given up.
        """
    @max_restarts.setter
    def max_restarts(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def parallel_tolerance(self) -> float:
        """
        [rad] axes nearer to parallel than this are taken to be, for the seeds alone.
        """
    @parallel_tolerance.setter
    def parallel_tolerance(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def position_tolerance(self) -> float:
        """
        [m] a solution misses the task by no more.
        """
    @position_tolerance.setter
    def position_tolerance(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rotation_tolerance(self) -> float:
        """
        [rad] likewise.
        """
    @rotation_tolerance.setter
    def rotation_tolerance(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def scene(self) -> Scene:
        """
        What the robot must not touch.
        """
    @scene.setter
    def scene(self, arg0: Scene) -> None:
        ...
    @property
    def wrist_tolerance(self) -> float:
        """
        [m] axes that miss each other by no more are taken to meet, for the seeds alone.
        """
    @wrist_tolerance.setter
    def wrist_tolerance(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class Solution:
    """
    One solution of inverse kinematics.
    """
    def __repr__(self) -> str:
        ...
    @property
    def branch(self) -> int:
        """
        Which of the closed form's branches it came from; -1: by descent.
        """
    @property
    def contact(self) -> tuple[int, int] | None:
        """
        With a scene the nearest pair: index of a capsule; of another one, or number of capsules + index of an obstacle.
        """
    @property
    def contact_distance(self) -> float:
        """
        [m] between their surfaces; negative: so deep. Infinite without a scene.
        """
    @property
    def direction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Of a failure, shape=(3,): from the nearest to the wanted, in the measurement frame.
        """
    @property
    def excess(self) -> float:
        """
        [rad | m] how far beyond its limit it would have to go.
        """
    @property
    def iterations(self) -> int:
        """
        Of all descents together.
        """
    @property
    def joint(self) -> int:
        """
        Driven joint whose limit is in the way, after them passive ones with limits; -1: none.
        """
    @property
    def joints(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(driven joints,) [rad | m]: readings; of a failure the nearest that was found, within limits.
        """
    @property
    def miss(self) -> float:
        """
        Of a failure: [m], or [rad] when the position is reached and the orientation is not.
        """
    @property
    def position_error(self) -> float:
        """
        [m] of the task, from a second forward computation.
        """
    @property
    def reached(self) -> bool:
        """
        Whether the task is met.
        """
    @property
    def reason(self) -> typing.Literal['reached', 'retreated', 'collision', 'out_of_reach', 'limit', 'singular']:
        """
        What came of it.
        
        'reached': the task is met
        'retreated': the target was moved by `retreat`, and is reached there
        'collision': it could be reached, but there is a collision: `contact`
        'out_of_reach': no joints reach it, limits aside: it stays away by `miss` along `direction`
        'limit': the limit of `joint` is in the way, by `excess`
        'singular': the target is within reach, but the way ends where the tip cannot move along `direction`
        """
    @property
    def retreat(self) -> float:
        """
        [m] how far the target was moved along the task's `retreat`.
        """
    @property
    def roll(self) -> float:
        """
        [rad] of a torch: the turn about the axis from the wanted frame.
        """
    @property
    def rotation_error(self) -> float:
        """
        [rad] of the task: what of the orientation is asked for.
        """
class Solutions:
    """
    Solutions for many targets, in their order: a sequence of `Solution`, and their values as arrays.
    """
    def __getitem__(self, k: typing.SupportsInt | typing.SupportsIndex) -> Solution:
        ...
    def __iter__(self) -> collections.abc.Iterator[Solution]:
        ...
    def __len__(self) -> int:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def branch(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        shape=(n,): -1: by descent.
        """
    @property
    def contact_distance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n,) [m]
        """
    @property
    def direction(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n, 3)
        """
    @property
    def excess(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n,) [rad | m]
        """
    @property
    def iterations(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        shape=(n,)
        """
    @property
    def joint(self) -> numpy.typing.NDArray[numpy.int32]:
        """
        shape=(n,): whose limit is in the way; -1: none.
        """
    @property
    def joints(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n, driven joints) [rad | m]; of a failure the nearest that was found, within limits.
        """
    @property
    def miss(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n,) [m | rad]
        """
    @property
    def position_error(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n,) [m]
        """
    @property
    def reached(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        shape=(n,): whether the task is met.
        """
    @property
    def reasons(self) -> tuple[typing.Literal['reached', 'retreated', 'collision', 'out_of_reach', 'limit', 'singular'], ...]:
        """
        Of each, as `Solution.reason`.
        """
    @property
    def retreat(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n,) [m]
        """
    @property
    def roll(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n,) [rad]
        """
    @property
    def rotation_error(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n,) [rad]
        """
class Branches:
    """
    Solutions that differ in configuration, at most as many as a closed form has.
    """
    def __len__(self) -> int:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def beyond_limits(self) -> int:
        """
        How many further ones are outside the limits.
        """
    @property
    def solutions(self) -> tuple[Solution, ...]:
        """
        Those within the joint limits.
        """
class PathOptions:
    """
    How `InverseSolver.path` works.
    
    longest_turn = 0.3490658503988659: [rad] maximum step of a revolute joint between neighbouring targets; more is a gap (20 deg).
    longest_slide = 0.25: [m] the same of a prismatic joint.
    rolls = 24: Samples of a torch's roll, where it is free.
    rail_places = 5: Samples of each rail before the arm, over what it can be reached from.
    smoothing = 20: Smoothing iterations of the path, where the task leaves degrees of freedom; up to ten times as many
        while a step is longer than allowed.
    """
    def __init__(self, *, longest_turn: typing.SupportsFloat | typing.SupportsIndex = 0.3490658503988659, longest_slide: typing.SupportsFloat | typing.SupportsIndex = 0.25, rolls: typing.SupportsInt | typing.SupportsIndex = 24, rail_places: typing.SupportsInt | typing.SupportsIndex = 5, smoothing: typing.SupportsInt | typing.SupportsIndex = 20) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> PathOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> PathOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def longest_slide(self) -> float:
        """
        [m] the same of a prismatic joint.
        """
    @longest_slide.setter
    def longest_slide(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def longest_turn(self) -> float:
        """
        [rad] maximum step of a revolute joint between neighbouring targets; more is a gap (20 deg).
        """
    @longest_turn.setter
    def longest_turn(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rail_places(self) -> int:
        """
        Samples of each rail before the arm, over what it can be reached from.
        """
    @rail_places.setter
    def rail_places(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def rolls(self) -> int:
        """
        Samples of a torch's roll, where it is free.
        """
    @rolls.setter
    def rolls(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def smoothing(self) -> int:
        """
        Smoothing iterations of the path, where the task leaves degrees of freedom; up to ten times as many
        while a step is longer than allowed.
        """
    @smoothing.setter
    def smoothing(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class PathGap:
    """
    Two neighbouring targets that the joints do not pass between in steps that are allowed.
    """
    def __repr__(self) -> str:
        ...
    @property
    def joint(self) -> int:
        """
        The joint whose step is too long; -1: one of the two is not reached.
        """
    @property
    def start(self) -> int:
        """
        Index of the target before it; the next is start + 1.
        """
    @property
    def step(self) -> float:
        """
        [rad | m]
        """
class JointPath:
    """
    Joints along a chain of targets.
    """
    def __repr__(self) -> str:
        ...
    @property
    def continuous(self) -> bool:
        """
        No gaps.
        """
    @property
    def gaps(self) -> tuple[PathGap, ...]:
        """
        Empty: every step is within the bounds.
        """
    @property
    def longest_slide(self) -> float:
        """
        [m] the same of a prismatic joint.
        """
    @property
    def longest_turn(self) -> float:
        """
        [rad] the longest step of a revolute joint that is no gap.
        """
    @property
    def solutions(self) -> Solutions:
        """
        One per target.
        """
class InverseSolver:
    """
    A robot made ready for inverse kinematics, nominal or calibrated, effects included.
    
    Built once it does not change, and any number of threads may use it. Where a seed is asked for, None is the middle of
    every joint's range.
    conditions: those of every solve that names no others; they also say which inputs there are. target: its index in
    `robot.targets`. Raises InputError when robot, target or options cannot be used, or effects lack an input.
    """
    def __init__(self, robot: Robot, options: InverseOptions | None = None, conditions: Conditions | None = None, *, target: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def branches(self, task: Task, seed: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] | None = None, conditions: Conditions | None = None) -> Branches:
        """
        Every solution for a full pose; prismatic joints before the arm stay at the seed's.
        
        Without a closed form what descents from many seeds found, not known to be all. Raises InputError.
        """
    def describe(self, solution: Solution) -> str:
        """
        In a sentence: 'J4 would have to go 0.12 rad beyond its limit'.
        """
    def follow(self, task: Task, previous: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], conditions: Conditions | None = None) -> Solution:
        """
        The next of a chain of poses that lie close together: Newton from `previous`, shape=(driven joints,) [rad | m].
        
        It stays on its branch; where it cannot, the reason says why, and nothing else is tried. Raises InputError.
        """
    def forward(self, joints: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], conditions: Conditions | None = None) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Where the target is, shape=(4, 4) [m], effects included: what `predict` says. Raises InputError.
        """
    def middle(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(driven joints,) [rad | m]: the middle of every joint's range, or 0.
        """
    def path(self, targets: collections.abc.Sequence[Task] | typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"], seed: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] | None = None, options: PathOptions | None = None, conditions: Conditions | None = None, *, like: Task | None = None, progress: collections.abc.Callable[[int], typing.Any] | None = None) -> JointPath:
        """
        A path through the targets in steps as short as can be; where none keeps within the bounds, the gap is told.
        
        targets, like, progress: as in `solve_batch`. seed: where the robot comes from. Raises InputError.
        """
    def solve(self, task: Task, seed: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] | None = None, conditions: Conditions | None = None) -> Solution:
        """
        One solution. What cannot be reached is told in the result.
        
        seed: shape=(driven joints,) [rad | m]. Raises InputError on a seed of the wrong size and on values that are not
        finite.
        """
    def solve_batch(self, targets: collections.abc.Sequence[Task] | typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"], seeds: numpy.typing.ArrayLike | None = None, conditions: Conditions | collections.abc.Sequence[Conditions] | None = None, *, like: Task | None = None, threads: typing.SupportsInt | typing.SupportsIndex = 0, progress: collections.abc.Callable[[int], typing.Any] | None = None) -> Solutions:
        """
        One solution per target, the same for any number of threads (0: as many as the machine has).
        
        targets: tasks, or shape=(n, 4, 4) [m] poses, each a task like `like` (None: a full pose).
        seeds: shape=(driven joints,) or (n, driven joints) [rad | m]. conditions: one, or one per target.
        progress: called with targets done, now and then; what it raises stops the work. Raises InputError.
        """
    @property
    def closed_form(self) -> typing.Literal['none', 'spherical_wrist', 'three_parallel']:
        """
        Which closed form the geometry has, once axes that nearly meet are taken to meet.
        """
    @property
    def driven_count(self) -> int:
        """
        Number of joints that have a reading.
        """
    @property
    def options(self) -> InverseOptions:
        """
        A copy of the options.
        """
    @property
    def robot(self) -> Robot:
        """
        A copy of the robot.
        """
class CompensateOptions:
    """
    How `Compensator` works.
    
    inverse = InverseOptions(): Of both solvers.
    in_base = False: Wanted poses and commands are in each robot's own base frame, as programs have them; else in the
        measurement frame.
    """
    def __init__(self, *, inverse: InverseOptions = ..., in_base: bool = False) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> CompensateOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> CompensateOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def in_base(self) -> bool:
        """
        Wanted poses and commands are in each robot's own base frame, as programs have them; else in the
        measurement frame.
        """
    @in_base.setter
    def in_base(self, arg1: bool) -> None:
        ...
    @property
    def inverse(self) -> InverseOptions:
        """
        Of both solvers.
        """
    @inverse.setter
    def inverse(self, arg0: InverseOptions) -> None:
        ...
class Compensated:
    """
    What to command of a controller that computes with the nominal robot.
    """
    def __repr__(self) -> str:
        ...
    @property
    def T_command(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4) [m]: pose to command. A controller whose inverse kinematics is the nominal robot's
        takes these joints for it, if it stays in their configuration.
        """
    @property
    def other_configuration(self) -> bool:
        """
        The joints are more than half a radian from those that the nominal robot would take: a controller
        that is given T_command may choose others.
        """
    @property
    def position_before(self) -> float | None:
        """
        [m] how far off the real robot would be if the wanted pose were commanded; None: the nominal robot cannot reach it.
        """
    @property
    def rotation_before(self) -> float | None:
        """
        [rad] likewise.
        """
    @property
    def sigma(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        Shape=(6,): standard error of where the target will be, from the covariance of the calibration:
        position [m] and rotation [rad] along the measurement frame's axes. NaN: no uncertainty was given.
        """
    @property
    def solution(self) -> Solution:
        """
        Of the calibrated robot: joints to command, whether the target is reached with them, and why not if
        it is not.
        """
class Compensations:
    """
    Of many targets, in their order: a sequence of `Compensated`, and values as arrays.
    """
    def __getitem__(self, k: typing.SupportsInt | typing.SupportsIndex) -> Compensated:
        ...
    def __iter__(self) -> collections.abc.Iterator[Compensated]:
        ...
    def __len__(self) -> int:
        ...
    def __repr__(self) -> str:
        ...
    @property
    def T_command(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n, 4, 4) [m]: poses to command.
        """
    @property
    def other_configuration(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        shape=(n,): a controller that is given T_command may choose other joints.
        """
    @property
    def position_before(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n,) [m]; NaN: the nominal robot cannot reach it.
        """
    @property
    def rotation_before(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n,) [rad]; NaN likewise.
        """
    @property
    def sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n, 6) [m], [rad]; NaN: no uncertainty was given.
        """
    @property
    def solutions(self) -> Solutions:
        """
        Joints to command, as `Solutions`.
        """
class Compensator:
    """
    Computes what to command so that the real robot, which `calibrated` describes, goes where it is wanted.
    
    Built once from both robots, then any number of threads may use it. conditions, target: as of `InverseSolver`.
    Raises InputError when the robots have different joints, or as InverseSolver does.
    """
    def __init__(self, nominal: Robot, calibrated: Robot, options: CompensateOptions | None = None, conditions: Conditions | None = None, *, target: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def joints(self, program: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], seed: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] | None = None, conditions: Conditions | None = None, *, like: Task | None = None) -> Compensated:
        """
        A joint position of a program, shape=(driven joints,) [rad | m]: the nominal robot's pose there is the target.
        
        seed: where the robot comes from; None: it stands there already. like: what of that pose is asked for; None: all of
        it. Raises InputError.
        """
    def joints_batch(self, program: numpy.typing.ArrayLike, conditions: Conditions | collections.abc.Sequence[Conditions] | None = None, *, like: Task | None = None, threads: typing.SupportsInt | typing.SupportsIndex = 0, progress: collections.abc.Callable[[int], typing.Any] | None = None) -> Compensations:
        """
        One result per row of a program of joint positions, shape=(n, driven joints) [rad | m].
        
        The robot comes from the row before; to the first it does not move. like: what of the nominal robot's poses is asked
        for; None: all of them. Raises InputError.
        """
    def pose(self, task: Task, seed: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] | None = None, conditions: Conditions | None = None) -> Compensated:
        """
        A pose of a program. Raises InputError.
        
        seed: shape=(driven joints,) [rad | m], where the robot comes from; it decides the configuration.
        """
    def pose_batch(self, targets: collections.abc.Sequence[Task] | typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"], seeds: numpy.typing.ArrayLike | None = None, conditions: Conditions | collections.abc.Sequence[Conditions] | None = None, *, like: Task | None = None, threads: typing.SupportsInt | typing.SupportsIndex = 0, progress: collections.abc.Callable[[int], typing.Any] | None = None) -> Compensations:
        """
        One result per target; arguments as of `InverseSolver.solve_batch`. Raises InputError.
        """
    def set_uncertainty(self, names: collections.abc.Sequence[str], values: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> None:
        """
        What `identify` found of its parameters: names and values of the fitted ones,
        and their covariance, shape=(n, n).
        
        Raises InputError on a parameter that the calibrated robot does not have, or a covariance of another size.
        """
    @property
    def calibrated(self) -> InverseSolver:
        """
        The solver of the calibrated robot.
        """
    @property
    def nominal(self) -> InverseSolver:
        """
        The solver of the nominal robot.
        """
class TrackSetup:
    """
    Where things are, and how clocks differ. `T_a_b` maps b-coordinates into a.
    
    T_tracker_base = identity: Shape=(4, 4)
    T_flange_receiver = identity: Shape=(4, 4)
    T_flange_tool = identity: Shape=(4, 4)
    T_flange_imu = identity: Shape=(4, 4)
    gravity = [0.0, 0.0, -9.81]: Shape=(3,) [m/s^2] in the base frame.
    clock_offset = 0.0: [s] t_imu = t_tracker - clock_offset.
    clock_offset_sigma = 0.0: [s] standard error of `clock_offset`; 0: known, and not estimated.
    controller_clock_offset = 0.0: [s] t_imu = t_controller - controller_clock_offset.
    actuator_lag = 0.0: [s] delay of the joints behind the plan.
    gyro_bias = [0.0, 0.0, 0.0]: Shape=(3,) [rad/s] as it was when it was calibrated.
    accel_bias = [0.0, 0.0, 0.0]: Shape=(3,) [m/s^2] likewise.
    gyro_bias_sigma = 0.0: [rad/s] its standard error, one component; 0: not known.
    accel_bias_sigma = 0.0: [m/s^2] likewise.
    """
    def __init__(self, *, T_tracker_base: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ..., T_flange_receiver: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ..., T_flange_tool: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ..., T_flange_imu: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"] = ..., gravity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ..., clock_offset: typing.SupportsFloat | typing.SupportsIndex = 0.0, clock_offset_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.0, controller_clock_offset: typing.SupportsFloat | typing.SupportsIndex = 0.0, actuator_lag: typing.SupportsFloat | typing.SupportsIndex = 0.0, gyro_bias: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ..., accel_bias: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ..., gyro_bias_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.0, accel_bias_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> TrackSetup:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> TrackSetup:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def T_flange_imu(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4)
        """
    @T_flange_imu.setter
    def T_flange_imu(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> None:
        ...
    @property
    def T_flange_receiver(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4)
        """
    @T_flange_receiver.setter
    def T_flange_receiver(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> None:
        ...
    @property
    def T_flange_tool(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4)
        """
    @T_flange_tool.setter
    def T_flange_tool(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> None:
        ...
    @property
    def T_tracker_base(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4)
        """
    @T_tracker_base.setter
    def T_tracker_base(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> None:
        ...
    @property
    def accel_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(3,) [m/s^2] likewise.
        """
    @accel_bias.setter
    def accel_bias(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def accel_bias_sigma(self) -> float:
        """
        [m/s^2] likewise.
        """
    @accel_bias_sigma.setter
    def accel_bias_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def actuator_lag(self) -> float:
        """
        [s] delay of the joints behind the plan.
        """
    @actuator_lag.setter
    def actuator_lag(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def clock_offset(self) -> float:
        """
        [s] t_imu = t_tracker - clock_offset.
        """
    @clock_offset.setter
    def clock_offset(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def clock_offset_sigma(self) -> float:
        """
        [s] standard error of `clock_offset`; 0: known, and not estimated.
        """
    @clock_offset_sigma.setter
    def clock_offset_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def controller_clock_offset(self) -> float:
        """
        [s] t_imu = t_controller - controller_clock_offset.
        """
    @controller_clock_offset.setter
    def controller_clock_offset(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gravity(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(3,) [m/s^2] in the base frame.
        """
    @gravity.setter
    def gravity(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def gyro_bias(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(3,) [rad/s] as it was when it was calibrated.
        """
    @gyro_bias.setter
    def gyro_bias(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def gyro_bias_sigma(self) -> float:
        """
        [rad/s] its standard error, one component; 0: not known.
        """
    @gyro_bias_sigma.setter
    def gyro_bias_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class ModalModel:
    """
    Sway as damped modes of each component of the deviation from the plan.
    
    x'' + 2 zeta omega x' + omega^2 x = gain a_plan + noise.
    
    frequency: shape=(n,) [Hz], n at most 4. damping: shape=(n,) ratio.
    gain: shape=(n, 6, 3) [-], [rad/m]; None: 0. frequency_sigma: shape=(n,) [Hz] standard error; None: 0.
    """
    def __init__(self, frequency: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], damping: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], gain: typing.Annotated[numpy.typing.ArrayLike, numpy.float64] | None = None, frequency_sigma: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] | None = None) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> ModalModel:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> ModalModel:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def count(self) -> int:
        """
        Number of modes.
        """
    @property
    def damping(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n,) ratios.
        """
    @property
    def frequency(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n,) [Hz], undamped.
        """
    @property
    def frequency_sigma(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n,) [Hz] standard errors.
        """
    @property
    def gain(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n, 6, 3): per planned acceleration in the frame of the planned inertial sensor; translation [-], rotation [rad/m].
        """
class FilterOptions:
    """
    Noise, gaps and gates of the filter.
    
    window = 0.5: [s] maximum lateness of a measurement that is still put at its place.
    future_limit = 0.1: [s] maximum lead of a stamp over the newest inertial sample.
    highest_imu_rate = 2000.0: [Hz] sizes the ring buffer.
    highest_pose_rate = 400.0: [Hz] likewise.
    gyro_noise = 0.0001: [rad/s/sqrt(Hz)] noise density.
    accel_noise = 0.001: [m/s^2/sqrt(Hz)] noise density.
    gyro_bias = 0.01: [rad/s] standard deviation before any data, of a sensor not calibrated.
    accel_bias = 0.1: [m/s^2] likewise.
    gyro_bias_change = 0.002: [rad/s] standard deviation of its change since it was calibrated.
    accel_bias_change = 0.03: [m/s^2] likewise.
    gyro_bias_walk = 2e-05: [rad/s/sqrt(s)] random walk of the bias.
    accel_bias_walk = 0.0002: [m/s^2/sqrt(s)] random walk of the bias.
    imu_scale = 0.0005: Standard deviation of the relative scale error of gyro and accelerometer.
    gyro_range = 34.0: [rad/s] a component at or beyond is saturated.
    accel_range = 156.0: [m/s^2] a component at or beyond is saturated.
    largest_gap = 0.02: [s] maximum gap between inertial samples before uncertainty is widened.
    restart_gap = 5.0: [s] gap between inertial samples after which the filter starts anew.
    gap_acceleration = 2.0: [m/s^2] standard deviation of what a gap or saturation hides.
    gap_rate = 0.2: [rad/s] likewise.
    position_sigma = 0.001: [m] noise of the tracker, one component.
    rotation_sigma = 0.001: [rad] likewise.
    noise_time = 10.0: [s] over which the noise of the tracker is averaged, and that of the inertial sensor follows; 0: as
        given.
    noise_range = 10.0: Maximum ratio of a noise so found to the given one, and of the given to it.
    gate = 50.0: Tracker samples with a larger normalised innovation squared are outliers.
    reacquire_after = 25: Consecutive outliers after which the filter follows the tracker again.
    frozen_after = 3: Consecutive equal tracker samples after which they are refused.
    clock_walk = 2e-05: [s/sqrt(s)] random walk of the tracker's clock.
    clock_drift = 0.0001: [s/s] standard deviation of the clock's drift.
    clock_drift_walk = 1e-06: [1/sqrt(s)] random walk of the clock's drift.
    sway_position = 0.02: [m] standard deviation of the tip about its slow mean before any data; afterwards it is estimated.
    sway_rotation = 0.003: [rad] likewise.
    sway_correlation = 0.5: [s] correlation time of the sway.
    slow_position = 0.05: [m] standard deviation of the deviation from forward kinematics before any data.
    slow_rotation = 0.02: [rad] likewise.
    slow_position_walk = 0.003: [m/sqrt(s)] random walk of that deviation.
    slow_rotation_walk = 0.0005: [rad/sqrt(s)] likewise.
    """
    def __init__(self, *, window: typing.SupportsFloat | typing.SupportsIndex = 0.5, future_limit: typing.SupportsFloat | typing.SupportsIndex = 0.1, highest_imu_rate: typing.SupportsFloat | typing.SupportsIndex = 2000.0, highest_pose_rate: typing.SupportsFloat | typing.SupportsIndex = 400.0, gyro_noise: typing.SupportsFloat | typing.SupportsIndex = 0.0001, accel_noise: typing.SupportsFloat | typing.SupportsIndex = 0.001, gyro_bias: typing.SupportsFloat | typing.SupportsIndex = 0.01, accel_bias: typing.SupportsFloat | typing.SupportsIndex = 0.1, gyro_bias_change: typing.SupportsFloat | typing.SupportsIndex = 0.002, accel_bias_change: typing.SupportsFloat | typing.SupportsIndex = 0.03, gyro_bias_walk: typing.SupportsFloat | typing.SupportsIndex = 2e-05, accel_bias_walk: typing.SupportsFloat | typing.SupportsIndex = 0.0002, imu_scale: typing.SupportsFloat | typing.SupportsIndex = 0.0005, gyro_range: typing.SupportsFloat | typing.SupportsIndex = 34.0, accel_range: typing.SupportsFloat | typing.SupportsIndex = 156.0, largest_gap: typing.SupportsFloat | typing.SupportsIndex = 0.02, restart_gap: typing.SupportsFloat | typing.SupportsIndex = 5.0, gap_acceleration: typing.SupportsFloat | typing.SupportsIndex = 2.0, gap_rate: typing.SupportsFloat | typing.SupportsIndex = 0.2, position_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.001, rotation_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.001, noise_time: typing.SupportsFloat | typing.SupportsIndex = 10.0, noise_range: typing.SupportsFloat | typing.SupportsIndex = 10.0, gate: typing.SupportsFloat | typing.SupportsIndex = 50.0, reacquire_after: typing.SupportsInt | typing.SupportsIndex = 25, frozen_after: typing.SupportsInt | typing.SupportsIndex = 3, clock_walk: typing.SupportsFloat | typing.SupportsIndex = 2e-05, clock_drift: typing.SupportsFloat | typing.SupportsIndex = 0.0001, clock_drift_walk: typing.SupportsFloat | typing.SupportsIndex = 1e-06, sway_position: typing.SupportsFloat | typing.SupportsIndex = 0.02, sway_rotation: typing.SupportsFloat | typing.SupportsIndex = 0.003, sway_correlation: typing.SupportsFloat | typing.SupportsIndex = 0.5, slow_position: typing.SupportsFloat | typing.SupportsIndex = 0.05, slow_rotation: typing.SupportsFloat | typing.SupportsIndex = 0.02, slow_position_walk: typing.SupportsFloat | typing.SupportsIndex = 0.003, slow_rotation_walk: typing.SupportsFloat | typing.SupportsIndex = 0.0005) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> FilterOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> FilterOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def accel_bias(self) -> float:
        """
        [m/s^2] likewise.
        """
    @accel_bias.setter
    def accel_bias(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def accel_bias_change(self) -> float:
        """
        [m/s^2] likewise.
        """
    @accel_bias_change.setter
    def accel_bias_change(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def accel_bias_walk(self) -> float:
        """
        [m/s^2/sqrt(s)] random walk of the bias.
        """
    @accel_bias_walk.setter
    def accel_bias_walk(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def accel_noise(self) -> float:
        """
        [m/s^2/sqrt(Hz)] noise density.
        """
    @accel_noise.setter
    def accel_noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def accel_range(self) -> float:
        """
        [m/s^2] a component at or beyond is saturated.
        """
    @accel_range.setter
    def accel_range(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def clock_drift(self) -> float:
        """
        [s/s] standard deviation of the clock's drift.
        """
    @clock_drift.setter
    def clock_drift(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def clock_drift_walk(self) -> float:
        """
        [1/sqrt(s)] random walk of the clock's drift.
        """
    @clock_drift_walk.setter
    def clock_drift_walk(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def clock_walk(self) -> float:
        """
        [s/sqrt(s)] random walk of the tracker's clock.
        """
    @clock_walk.setter
    def clock_walk(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def frozen_after(self) -> int:
        """
        Consecutive equal tracker samples after which they are refused.
        """
    @frozen_after.setter
    def frozen_after(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def future_limit(self) -> float:
        """
        [s] maximum lead of a stamp over the newest inertial sample.
        """
    @future_limit.setter
    def future_limit(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gap_acceleration(self) -> float:
        """
        [m/s^2] standard deviation of what a gap or saturation hides.
        """
    @gap_acceleration.setter
    def gap_acceleration(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gap_rate(self) -> float:
        """
        [rad/s] likewise.
        """
    @gap_rate.setter
    def gap_rate(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gate(self) -> float:
        """
        Tracker samples with a larger normalised innovation squared are outliers.
        """
    @gate.setter
    def gate(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyro_bias(self) -> float:
        """
        [rad/s] standard deviation before any data, of a sensor not calibrated.
        """
    @gyro_bias.setter
    def gyro_bias(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyro_bias_change(self) -> float:
        """
        [rad/s] standard deviation of its change since it was calibrated.
        """
    @gyro_bias_change.setter
    def gyro_bias_change(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyro_bias_walk(self) -> float:
        """
        [rad/s/sqrt(s)] random walk of the bias.
        """
    @gyro_bias_walk.setter
    def gyro_bias_walk(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyro_noise(self) -> float:
        """
        [rad/s/sqrt(Hz)] noise density.
        """
    @gyro_noise.setter
    def gyro_noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyro_range(self) -> float:
        """
        [rad/s] a component at or beyond is saturated.
        """
    @gyro_range.setter
    def gyro_range(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def highest_imu_rate(self) -> float:
        """
        [Hz] sizes the ring buffer.
        """
    @highest_imu_rate.setter
    def highest_imu_rate(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def highest_pose_rate(self) -> float:
        """
        [Hz] likewise.
        """
    @highest_pose_rate.setter
    def highest_pose_rate(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def imu_scale(self) -> float:
        """
        Standard deviation of the relative scale error of gyro and accelerometer.
        """
    @imu_scale.setter
    def imu_scale(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def largest_gap(self) -> float:
        """
        [s] maximum gap between inertial samples before uncertainty is widened.
        """
    @largest_gap.setter
    def largest_gap(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def noise_range(self) -> float:
        """
        Maximum ratio of a noise so found to the given one, and of the given to it.
        """
    @noise_range.setter
    def noise_range(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def noise_time(self) -> float:
        """
        [s] over which the noise of the tracker is averaged, and that of the inertial sensor follows; 0: as
        given.
        """
    @noise_time.setter
    def noise_time(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def position_sigma(self) -> float:
        """
        [m] noise of the tracker, one component.
        """
    @position_sigma.setter
    def position_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def reacquire_after(self) -> int:
        """
        Consecutive outliers after which the filter follows the tracker again.
        """
    @reacquire_after.setter
    def reacquire_after(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def restart_gap(self) -> float:
        """
        [s] gap between inertial samples after which the filter starts anew.
        """
    @restart_gap.setter
    def restart_gap(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rotation_sigma(self) -> float:
        """
        [rad] likewise.
        """
    @rotation_sigma.setter
    def rotation_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def slow_position(self) -> float:
        """
        [m] standard deviation of the deviation from forward kinematics before any data.
        """
    @slow_position.setter
    def slow_position(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def slow_position_walk(self) -> float:
        """
        [m/sqrt(s)] random walk of that deviation.
        """
    @slow_position_walk.setter
    def slow_position_walk(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def slow_rotation(self) -> float:
        """
        [rad] likewise.
        """
    @slow_rotation.setter
    def slow_rotation(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def slow_rotation_walk(self) -> float:
        """
        [rad/sqrt(s)] likewise.
        """
    @slow_rotation_walk.setter
    def slow_rotation_walk(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sway_correlation(self) -> float:
        """
        [s] correlation time of the sway.
        """
    @sway_correlation.setter
    def sway_correlation(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sway_position(self) -> float:
        """
        [m] standard deviation of the tip about its slow mean before any data; afterwards it is estimated.
        """
    @sway_position.setter
    def sway_position(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def sway_rotation(self) -> float:
        """
        [rad] likewise.
        """
    @sway_rotation.setter
    def sway_rotation(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def window(self) -> float:
        """
        [s] maximum lateness of a measurement that is still put at its place.
        """
    @window.setter
    def window(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class DeviationOptions:
    """
    The model of the deviation from the plan.
    
    period = 0.01: [s] step of the model.
    horizon = 0.04: [s] lead for which predictions are graded.
    position_noise = 0.0003: [m] noise of the filter's position as the model sees it, rotations as 1 m.
    velocity_noise = 0.001: [m/s] likewise.
    slow_noise = 0.003: [m/s^2/sqrt(Hz)] acceleration that drives the slow part.
    static_time = 2.0: [s] averaging time of the static deviation.
    mode_noise = 0.02: [m/s^2/sqrt(Hz)] acceleration that drives a mode beside the plan's.
    frequency_sigma = 0.05: Relative standard deviation of the given frequencies; 0: they stay.
    frequency_walk = 0.003: [1/sqrt(s)] relative random walk of the frequencies.
    frequency_range = 0.2: Maximum relative change of a frequency.
    grade_time = 3.0: [s] averaging time of the grades.
    settle_time = 0.1: [s] delay before a prediction is graded, in which late samples may come.
    least_evidence = 1.0: [s] duration of grades after which predictions of modes are used.
    plan_limit = 10.0: [s] plan samples further ahead are refused.
    """
    def __init__(self, *, period: typing.SupportsFloat | typing.SupportsIndex = 0.01, horizon: typing.SupportsFloat | typing.SupportsIndex = 0.04, position_noise: typing.SupportsFloat | typing.SupportsIndex = 0.0003, velocity_noise: typing.SupportsFloat | typing.SupportsIndex = 0.001, slow_noise: typing.SupportsFloat | typing.SupportsIndex = 0.003, static_time: typing.SupportsFloat | typing.SupportsIndex = 2.0, mode_noise: typing.SupportsFloat | typing.SupportsIndex = 0.02, frequency_sigma: typing.SupportsFloat | typing.SupportsIndex = 0.05, frequency_walk: typing.SupportsFloat | typing.SupportsIndex = 0.003, frequency_range: typing.SupportsFloat | typing.SupportsIndex = 0.2, grade_time: typing.SupportsFloat | typing.SupportsIndex = 3.0, settle_time: typing.SupportsFloat | typing.SupportsIndex = 0.1, least_evidence: typing.SupportsFloat | typing.SupportsIndex = 1.0, plan_limit: typing.SupportsFloat | typing.SupportsIndex = 10.0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> DeviationOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> DeviationOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def frequency_range(self) -> float:
        """
        Maximum relative change of a frequency.
        """
    @frequency_range.setter
    def frequency_range(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def frequency_sigma(self) -> float:
        """
        Relative standard deviation of the given frequencies; 0: they stay.
        """
    @frequency_sigma.setter
    def frequency_sigma(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def frequency_walk(self) -> float:
        """
        [1/sqrt(s)] relative random walk of the frequencies.
        """
    @frequency_walk.setter
    def frequency_walk(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def grade_time(self) -> float:
        """
        [s] averaging time of the grades.
        """
    @grade_time.setter
    def grade_time(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def horizon(self) -> float:
        """
        [s] lead for which predictions are graded.
        """
    @horizon.setter
    def horizon(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def least_evidence(self) -> float:
        """
        [s] duration of grades after which predictions of modes are used.
        """
    @least_evidence.setter
    def least_evidence(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def mode_noise(self) -> float:
        """
        [m/s^2/sqrt(Hz)] acceleration that drives a mode beside the plan's.
        """
    @mode_noise.setter
    def mode_noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def period(self) -> float:
        """
        [s] step of the model.
        """
    @period.setter
    def period(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def plan_limit(self) -> float:
        """
        [s] plan samples further ahead are refused.
        """
    @plan_limit.setter
    def plan_limit(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def position_noise(self) -> float:
        """
        [m] noise of the filter's position as the model sees it, rotations as 1 m.
        """
    @position_noise.setter
    def position_noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def settle_time(self) -> float:
        """
        [s] delay before a prediction is graded, in which late samples may come.
        """
    @settle_time.setter
    def settle_time(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def slow_noise(self) -> float:
        """
        [m/s^2/sqrt(Hz)] acceleration that drives the slow part.
        """
    @slow_noise.setter
    def slow_noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def static_time(self) -> float:
        """
        [s] averaging time of the static deviation.
        """
    @static_time.setter
    def static_time(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def velocity_noise(self) -> float:
        """
        [m/s] likewise.
        """
    @velocity_noise.setter
    def velocity_noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class WatchOptions:
    """
    Detection of jumps of the tracker against inertial sensor and forward kinematics.
    
    threshold = 55.0: Of averages that are chi-square distributed with six degrees of freedom.
    forget = 1.0: [s] after a longer gap of the tracker the averages begin anew.
    compare = 120.0: [s] after a shift, station and receiver are told apart for this time; further jumps are taken for
        its after-effect.
    least = 1.0: A jump counts when its length or its angle is at least so many times the tracker's noise of one
        component.
    """
    def __init__(self, *, threshold: typing.SupportsFloat | typing.SupportsIndex = 55.0, forget: typing.SupportsFloat | typing.SupportsIndex = 1.0, compare: typing.SupportsFloat | typing.SupportsIndex = 120.0, least: typing.SupportsFloat | typing.SupportsIndex = 1.0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> WatchOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> WatchOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def compare(self) -> float:
        """
        [s] after a shift, station and receiver are told apart for this time; further jumps are taken for
        its after-effect.
        """
    @compare.setter
    def compare(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def forget(self) -> float:
        """
        [s] after a longer gap of the tracker the averages begin anew.
        """
    @forget.setter
    def forget(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def least(self) -> float:
        """
        A jump counts when its length or its angle is at least so many times the tracker's noise of one
        component.
        """
    @least.setter
    def least(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def threshold(self) -> float:
        """
        Of averages that are chi-square distributed with six degrees of freedom.
        """
    @threshold.setter
    def threshold(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class CorrectionLimits:
    """
    Bounds of the corrections that are sent to the arm.
    
    position = 0.15: [m] maximum length.
    rotation = 0.05: [rad] maximum angle.
    position_rate = 0.5: [m/s]
    rotation_rate = 0.2: [rad/s]
    position_jerk = 100.0: [m/s^3]
    rotation_jerk = 40.0: [rad/s^3]
    """
    def __init__(self, *, position: typing.SupportsFloat | typing.SupportsIndex = 0.15, rotation: typing.SupportsFloat | typing.SupportsIndex = 0.05, position_rate: typing.SupportsFloat | typing.SupportsIndex = 0.5, rotation_rate: typing.SupportsFloat | typing.SupportsIndex = 0.2, position_jerk: typing.SupportsFloat | typing.SupportsIndex = 100.0, rotation_jerk: typing.SupportsFloat | typing.SupportsIndex = 40.0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> CorrectionLimits:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> CorrectionLimits:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def position(self) -> float:
        """
        [m] maximum length.
        """
    @position.setter
    def position(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def position_jerk(self) -> float:
        """
        [m/s^3]
        """
    @position_jerk.setter
    def position_jerk(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def position_rate(self) -> float:
        """
        [m/s]
        """
    @position_rate.setter
    def position_rate(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rotation(self) -> float:
        """
        [rad] maximum angle.
        """
    @rotation.setter
    def rotation(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rotation_jerk(self) -> float:
        """
        [rad/s^3]
        """
    @rotation_jerk.setter
    def rotation_jerk(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rotation_rate(self) -> float:
        """
        [rad/s]
        """
    @rotation_rate.setter
    def rotation_rate(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class TrackOptions:
    """
    How `Tracker` works.
    
    filter = FilterOptions(): Noise, gaps and gates of the filter.
    deviation = DeviationOptions(): The model of the deviation from the plan.
    watch = WatchOptions(): Detection of jumps of the tracker.
    modes = ModalModel(): Of `identify_modes`; none: predictions at constant acceleration.
    limits = CorrectionLimits(): Bounds of corrections.
    coast_position = 0.03: [m] without the tracker, estimates with a larger standard deviation than this and than forward
        kinematics' are not used.
    coast_rotation = 0.02: [rad] likewise.
    imu_timeout = 0.1: [s] lag behind the joints after which the inertial sensor is taken for dead.
    joints_timeout = 0.5: [s] the same of the joints.
    """
    def __init__(self, *, filter: FilterOptions = ..., deviation: DeviationOptions = ..., watch: WatchOptions = ..., modes: ModalModel = ..., limits: CorrectionLimits = ..., coast_position: typing.SupportsFloat | typing.SupportsIndex = 0.03, coast_rotation: typing.SupportsFloat | typing.SupportsIndex = 0.02, imu_timeout: typing.SupportsFloat | typing.SupportsIndex = 0.1, joints_timeout: typing.SupportsFloat | typing.SupportsIndex = 0.5) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> TrackOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> TrackOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def coast_position(self) -> float:
        """
        [m] without the tracker, estimates with a larger standard deviation than this and than forward
        kinematics' are not used.
        """
    @coast_position.setter
    def coast_position(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def coast_rotation(self) -> float:
        """
        [rad] likewise.
        """
    @coast_rotation.setter
    def coast_rotation(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def deviation(self) -> DeviationOptions:
        """
        The model of the deviation from the plan.
        """
    @deviation.setter
    def deviation(self, arg0: DeviationOptions) -> None:
        ...
    @property
    def filter(self) -> FilterOptions:
        """
        Noise, gaps and gates of the filter.
        """
    @filter.setter
    def filter(self, arg0: FilterOptions) -> None:
        ...
    @property
    def imu_timeout(self) -> float:
        """
        [s] lag behind the joints after which the inertial sensor is taken for dead.
        """
    @imu_timeout.setter
    def imu_timeout(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def joints_timeout(self) -> float:
        """
        [s] the same of the joints.
        """
    @joints_timeout.setter
    def joints_timeout(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def limits(self) -> CorrectionLimits:
        """
        Bounds of corrections.
        """
    @limits.setter
    def limits(self, arg0: CorrectionLimits) -> None:
        ...
    @property
    def modes(self) -> ModalModel:
        """
        Of `identify_modes`; none: predictions at constant acceleration.
        """
    @modes.setter
    def modes(self, arg0: ModalModel) -> None:
        ...
    @property
    def watch(self) -> WatchOptions:
        """
        Detection of jumps of the tracker.
        """
    @watch.setter
    def watch(self, arg0: WatchOptions) -> None:
        ...
class ModesResult:
    """
    What `identify_modes` found.
    """
    def __repr__(self) -> str:
        ...
    @property
    def error(self) -> tuple[float, ...]:
        """
        [m] rms of predictions twice the horizon ahead: of no change, with one mode, with two ...
        """
    @property
    def model(self) -> ModalModel:
        """
        The modes.
        """
    @property
    def rows(self) -> float:
        """
        Number of rows used.
        """
    @property
    def stopped_because(self) -> str:
        """
        Why there are no more modes.
        """
class PosePrediction:
    """
    The tool at time `t`, as known at time `made`; the inertial sensor's clock.
    """
    def __repr__(self) -> str:
        ...
    @property
    def T_base_tool(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4)
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        Shape=(6, 6), of position [m] and rotation vector [rad] about the base frame's axes.
        """
    @property
    def made(self) -> float:
        """
        [s]
        """
    @property
    def predictor(self) -> typing.Literal['slow', 'acceleration', 'modes']:
        """
        How it was made.
        
        'slow': plan and slow deviation: what forward kinematics would give, and the last static deviation
        'acceleration': plan and deviation at constant acceleration
        'modes': plan, slow deviation and damped modes driven by the plan
        """
    @property
    def status(self) -> typing.Literal['valid', 'coasting', 'hold', 'lost']:
        """
        What it rests on.
        
        'valid': inertial sensor and tracker
        'coasting': inertial sensor and forward kinematics, the tracker is away
        'hold': forward kinematics (or the plan) and the last static deviation
        'lost': nothing to go by
        """
    @property
    def t(self) -> float:
        """
        [s]
        """
class Compensation:
    """
    What to add to the plan so that the tool is where it was planned.
    """
    def __repr__(self) -> str:
        ...
    @property
    def T_base_flange(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4): corrected.
        """
    @property
    def T_base_tool_planned(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4)
        """
    @property
    def correction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        Shape=(6,): within the limits.
        """
    @property
    def has_plan(self) -> bool:
        """
        False: the plan does not reach that far, and nothing is corrected.
        """
    @property
    def limited(self) -> bool:
        """
        The two differ by more than 1 mm or 1 mrad.
        """
    @property
    def predicted(self) -> PosePrediction:
        """
        The prediction behind it.
        """
    @property
    def wanted(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        Shape=(6,) [m], rotation vector [rad]: the correction in the base frame.
        """
class ClockEstimate:
    """
    The tracker's clock: t_imu = t_tracker - offset.
    """
    def __repr__(self) -> str:
        ...
    @property
    def drift(self) -> float:
        """
        [s/s]
        """
    @property
    def offset(self) -> float:
        """
        [s]
        """
    @property
    def sigma(self) -> float:
        """
        [s] standard error.
        """
class TrackerNoise:
    """
    Noise of the sensors as the filter has found it.
    """
    def __repr__(self) -> str:
        ...
    @property
    def accel_factor(self) -> float:
        """
        Of the accelerometer, in terms of the given.
        """
    @property
    def gyro_factor(self) -> float:
        """
        Of the gyro, in terms of the given.
        """
    @property
    def position(self) -> float:
        """
        [m] of the tracker, one component.
        """
    @property
    def rotation(self) -> float:
        """
        [rad] likewise.
        """
class Shift:
    """
    The last jump of the tracker that was noticed.
    """
    def __repr__(self) -> str:
        ...
    @property
    def cause(self) -> typing.Literal['station_or_receiver', 'station', 'receiver']:
        """
        What jumped.
        
        'station_or_receiver': not told apart (yet): the arm has to move and turn
        'station': constant in the tracker frame: a base station was moved
        'receiver': constant on the flange: the receiver has slipped
        """
    @property
    def count(self) -> int:
        """
        Number of jumps since the start; 0: the rest means nothing.
        """
    @property
    def flagged(self) -> float:
        """
        [s] stamp of the tracker sample that it was noticed by.
        """
    @property
    def jump(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        Shape=(6,) [m], rotation vector [rad]: of the receiver as measured, base frame.
        """
    @property
    def odds(self) -> float:
        """
        Log odds of station against receiver.
        """
    @property
    def position_noise(self) -> float:
        """
        [m] of the tracker then, one component.
        """
    @property
    def rotation_noise(self) -> float:
        """
        [rad] likewise.
        """
    @property
    def t(self) -> float:
        """
        [s] when it happened, the inertial sensor's clock.
        """
class Tracker:
    """
    Fusion and prediction, sample by sample.
    
    Samples may come late, twice, or out of order within the window: the result is the same. Stamps are of each device's
    own clock; the answers' times are of the inertial sensor's. Refused samples change nothing. Not for two threads at
    once.
    """
    def __init__(self, setup: TrackSetup, options: TrackOptions | None = None) -> None:
        """
        Raises InputError on options that make no sense.
        """
    def compensate(self, t: typing.SupportsFloat | typing.SupportsIndex) -> Compensation:
        """
        Prediction, and the correction that it asks for, within limits; to be called at growing times. t: [s].
        """
    def predict(self, t: typing.SupportsFloat | typing.SupportsIndex) -> PosePrediction:
        """
        The tool at a time of the inertial sensor's clock, past (within the window), now or to come. t: [s].
        """
    def push_imu(self, t: typing.SupportsFloat | typing.SupportsIndex, gyro: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], accel: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> typing.Literal['accepted', 'accepted_gap', 'accepted_saturated', 'accepted_restart', 'duplicate', 'backwards', 'future', 'too_late', 'not_finite', 'not_unit', 'frozen']:
        """
        t: [s]. gyro: shape=(3,) [rad/s]. accel: shape=(3,) [m/s^2], specific force, +9.81 upward at rest; both in the sensor frame.
        """
    def push_imu_rows(self, t: numpy.typing.ArrayLike, gyro: numpy.typing.ArrayLike, accel: numpy.typing.ArrayLike) -> tuple[typing.Literal['accepted', 'accepted_gap', 'accepted_saturated', 'accepted_restart', 'duplicate', 'backwards', 'future', 'too_late', 'not_finite', 'not_unit', 'frozen'], ...]:
        """
        Many at once: shape=(n,), (n, 3), (n, 3). What became of each.
        """
    def push_joints(self, t: typing.SupportsFloat | typing.SupportsIndex, T_base_flange: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> typing.Literal['accepted', 'accepted_gap', 'accepted_saturated', 'accepted_restart', 'duplicate', 'backwards', 'future', 'too_late', 'not_finite', 'not_unit', 'frozen']:
        """
        t: [s] the controller's stamp. T_base_flange: shape=(4, 4), forward kinematics of the encoders.
        """
    def push_plan(self, t: typing.SupportsFloat | typing.SupportsIndex, T_base_tool: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]) -> typing.Literal['accepted', 'accepted_gap', 'accepted_saturated', 'accepted_restart', 'duplicate', 'backwards', 'future', 'too_late', 'not_finite', 'not_unit', 'frozen']:
        """
        t: [s] the controller's clock, ahead of its time and in order. T_base_tool: shape=(4, 4), planned.
        """
    def push_pose(self, t: typing.SupportsFloat | typing.SupportsIndex, position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], orientation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 1]"] | None = None) -> typing.Literal['accepted', 'accepted_gap', 'accepted_saturated', 'accepted_restart', 'duplicate', 'backwards', 'future', 'too_late', 'not_finite', 'not_unit', 'frozen']:
        """
        t: [s] the tracker's stamp. position: shape=(3,) [m], orientation: shape=(4,) w x y z, the receiver in the tracker frame; None: the tracker gives none.
        """
    def push_pose_rows(self, t: numpy.typing.ArrayLike, position: numpy.typing.ArrayLike, orientation: numpy.typing.ArrayLike | None = None) -> tuple[typing.Literal['accepted', 'accepted_gap', 'accepted_saturated', 'accepted_restart', 'duplicate', 'backwards', 'future', 'too_late', 'not_finite', 'not_unit', 'frozen'], ...]:
        """
        Many at once: shape=(n,), (n, 3), (n, 4).
        """
    def set_modes(self, modes: ModalModel) -> None:
        """
        Raises InputError.
        """
    def take_innovations(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        Settled tracker samples against what was expected of them, since the last call: t [s], nis, dimensions, accepted (1 or 0).
        """
    def take_rows(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        Settled rows since the last call, for `identify_modes`: its arguments by name. Call often: few are kept.
        """
    @property
    def clock(self) -> ClockEstimate:
        """
        The tracker's clock as it is now estimated.
        """
    @property
    def counters(self) -> dict[str, dict[str, int]]:
        """
        Samples by stream and outcome.
        """
    @property
    def frequencies(self) -> tuple[float, ...]:
        """
        [Hz] of the modes, as tracked; 0 beyond them.
        """
    @property
    def noise(self) -> TrackerNoise:
        """
        Noise of the sensors as the filter has found it.
        """
    @property
    def now(self) -> float:
        """
        [s] stamp of the newest inertial sample.
        """
    @property
    def shift(self) -> Shift:
        """
        The last jump of the tracker. After one the filter follows the tracker: calibrate anew.
        """
class RecordedStreams:
    """
    A recording: samples of all devices, each with its stamp and its arrival. Build it with `streams` or by `set_...`.
    """
    def __init__(self) -> None:
        ...
    def __repr__(self) -> str:
        ...
    def set_flange(self, t: numpy.typing.ArrayLike, T_base_flange: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"], arrival: numpy.typing.ArrayLike | None = None) -> None:
        """
        T_base_flange: shape=(n, 4, 4), forward kinematics of the encoders.
        """
    def set_imu(self, t: numpy.typing.ArrayLike, gyro: numpy.typing.ArrayLike, accel: numpy.typing.ArrayLike, arrival: numpy.typing.ArrayLike | None = None) -> None:
        """
        t, arrival: shape=(n,) [s]. gyro, accel: shape=(n, 3) [rad/s], [m/s^2]. arrival None: at once.
        """
    def set_plan(self, t: numpy.typing.ArrayLike, T_base_tool: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"], arrival: numpy.typing.ArrayLike | None = None) -> None:
        """
        T_base_tool: shape=(n, 4, 4), planned.
        """
    def set_tracker(self, t: numpy.typing.ArrayLike, position: numpy.typing.ArrayLike, orientation: numpy.typing.ArrayLike | None = None, arrival: numpy.typing.ArrayLike | None = None) -> None:
        """
        position: shape=(n, 3) [m]. orientation: shape=(n, 4) w x y z, or None.
        """
    @property
    def counts(self) -> dict[str, int]:
        """
        Samples by stream.
        """
class CompensationRow:
    """
    A row of the plan: what to add there.
    """
    @property
    def compensation(self) -> Compensation:
        """
        What to add there.
        """
    @property
    def made(self) -> bool:
        """
        False: the streams do not reach there, and nothing else is set but `t`.
        """
    @property
    def t(self) -> float:
        """
        [s] when the tool is to be there, the inertial sensor's clock.
        """
class ReplayResult:
    """
    What a replay gave. Times are of the inertial sensor's clock.
    """
    def __repr__(self) -> str:
        ...
    @property
    def clock(self) -> ClockEstimate:
        """
        At the end.
        """
    @property
    def compensation(self) -> dict[str, typing.Any]:
        """
        The same as columns: made (bool), t, made_at [s], T_base_tool, T_base_tool_planned, T_base_flange (n, 4, 4), correction, wanted (n, 6), covariance (n, 36), limited, status, predictor.
        """
    @property
    def counters(self) -> dict[str, dict[str, int]]:
        """
        Samples by stream and outcome.
        """
    @property
    def graded(self) -> dict[str, typing.Any]:
        """
        Predictions against the tracker's later samples, measured minus predicted receiver in the base frame: t, made_at, horizon [s], dimensions (0: lost), position (n, 3) [m], rotation (n, 3) [rad], position_sigma (n, 3) [m], squares, the errors [m] of hold, velocity, fk, fk_velocity (infinite: not to be had), status, predictor.
        """
    @property
    def innovations(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        Tracker samples against the filter: t [s], nis, dimensions, accepted.
        """
    @property
    def modes(self) -> ModesResult:
        """
        As identified in the replay; none where none were asked for or found.
        """
    @property
    def modes_from(self) -> float:
        """
        [s] they are used from then on; 0: never.
        """
    @property
    def noise(self) -> TrackerNoise:
        """
        At the end.
        """
    @property
    def rows(self) -> tuple[CompensationRow, ...]:
        """
        One per row of the plan, in its order.
        """
    @property
    def shifts(self) -> tuple[Shift, ...]:
        """
        Of the tracker, as they were noticed.
        """
    @property
    def timeline(self) -> dict[str, typing.Any]:
        """
        Every tenth of a second: t, offset, sigma [s], drift [s/s] of the tracker's clock, frequencies (n, 4) [Hz], status, predictor.
        """
class FlexibleMode:
    """
    A flexible mode of the arm: one damped oscillator, driven by the acceleration of the rigid arm's
    tip, by gravity and by gusts,
    
    q'' + 2 zeta omega q' + omega^2 q = -participation . (a_tip - g) * reach/reference + gust,
    
    that moves the tip by direction * q and turns it by rotation * q. Vectors stand in the base's axes,
    slewed with the first joint.
    """
    def __init__(self, *, frequency: typing.SupportsFloat | typing.SupportsIndex, damping: typing.SupportsFloat | typing.SupportsIndex, direction: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], participation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], gust: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> FlexibleMode:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> FlexibleMode:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def damping(self) -> float:
        """
        Damping ratio zeta.
        """
    @damping.setter
    def damping(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def direction(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(3,): of the tip's motion, per unit of the mode.
        """
    @direction.setter
    def direction(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def frequency(self) -> float:
        """
        [Hz] undamped, at the reference reach.
        """
    @frequency.setter
    def frequency(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gust(self) -> float:
        """
        [m] standard deviation of the sway that gusts alone would make.
        """
    @gust.setter
    def gust(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def participation(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(3,): fraction of the tip's acceleration driving it.
        """
    @participation.setter
    def participation(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
    @property
    def rotation(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(3,) [rad/m]: of the tip, per unit of the mode.
        """
    @rotation.setter
    def rotation(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None:
        ...
class ImuErrors:
    """
    Errors of a simulated inertial sensor (densities as in data sheets).
    
    gyro_noise = 0.0001: [rad/s/sqrt(Hz)] noise density.
    accel_noise = 0.001: [m/s^2/sqrt(Hz)] noise density.
    gyro_bias = 0.002: [rad/s] standard deviation at the start.
    accel_bias = 0.03: [m/s^2] standard deviation at the start.
    gyro_bias_walk = 1e-05: [rad/s/sqrt(s)] random walk.
    accel_bias_walk = 0.0001: [m/s^2/sqrt(s)] random walk.
    gyro_scale = 0.0003: Standard deviation of each axis' scale error.
    accel_scale = 0.0003: Standard deviation of each axis' scale error.
    """
    def __init__(self, *, gyro_noise: typing.SupportsFloat | typing.SupportsIndex = 0.0001, accel_noise: typing.SupportsFloat | typing.SupportsIndex = 0.001, gyro_bias: typing.SupportsFloat | typing.SupportsIndex = 0.002, accel_bias: typing.SupportsFloat | typing.SupportsIndex = 0.03, gyro_bias_walk: typing.SupportsFloat | typing.SupportsIndex = 1e-05, accel_bias_walk: typing.SupportsFloat | typing.SupportsIndex = 0.0001, gyro_scale: typing.SupportsFloat | typing.SupportsIndex = 0.0003, accel_scale: typing.SupportsFloat | typing.SupportsIndex = 0.0003) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> ImuErrors:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> ImuErrors:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def accel_bias(self) -> float:
        """
        [m/s^2] standard deviation at the start.
        """
    @accel_bias.setter
    def accel_bias(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def accel_bias_walk(self) -> float:
        """
        [m/s^2/sqrt(s)] random walk.
        """
    @accel_bias_walk.setter
    def accel_bias_walk(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def accel_noise(self) -> float:
        """
        [m/s^2/sqrt(Hz)] noise density.
        """
    @accel_noise.setter
    def accel_noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def accel_scale(self) -> float:
        """
        Standard deviation of each axis' scale error.
        """
    @accel_scale.setter
    def accel_scale(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyro_bias(self) -> float:
        """
        [rad/s] standard deviation at the start.
        """
    @gyro_bias.setter
    def gyro_bias(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyro_bias_walk(self) -> float:
        """
        [rad/s/sqrt(s)] random walk.
        """
    @gyro_bias_walk.setter
    def gyro_bias_walk(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyro_noise(self) -> float:
        """
        [rad/s/sqrt(Hz)] noise density.
        """
    @gyro_noise.setter
    def gyro_noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gyro_scale(self) -> float:
        """
        Standard deviation of each axis' scale error.
        """
    @gyro_scale.setter
    def gyro_scale(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class TrackerErrors:
    """
    Errors of a simulated tracker, and of its way to the computer.
    
    position_noise = 0.001: [m] of one component.
    rotation_noise = 0.001: [rad] of one component.
    latency = 0.03: [s] mean.
    latency_jitter = 0.004: [s] standard deviation; no sample arrives before it was taken.
    clock_offset = 0.0: [s] t_tracker = t_imu * (1 + clock_drift) + clock_offset.
    clock_drift = 0.0: [s/s]
    out_of_order = 0.0: Fraction of the samples that take 25 ms more.
    lost = 0.0: Fraction of single samples that never arrive.
    """
    def __init__(self, *, position_noise: typing.SupportsFloat | typing.SupportsIndex = 0.001, rotation_noise: typing.SupportsFloat | typing.SupportsIndex = 0.001, latency: typing.SupportsFloat | typing.SupportsIndex = 0.03, latency_jitter: typing.SupportsFloat | typing.SupportsIndex = 0.004, clock_offset: typing.SupportsFloat | typing.SupportsIndex = 0.0, clock_drift: typing.SupportsFloat | typing.SupportsIndex = 0.0, out_of_order: typing.SupportsFloat | typing.SupportsIndex = 0.0, lost: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> TrackerErrors:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> TrackerErrors:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def clock_drift(self) -> float:
        """
        [s/s]
        """
    @clock_drift.setter
    def clock_drift(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def clock_offset(self) -> float:
        """
        [s] t_tracker = t_imu * (1 + clock_drift) + clock_offset.
        """
    @clock_offset.setter
    def clock_offset(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def latency(self) -> float:
        """
        [s] mean.
        """
    @latency.setter
    def latency(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def latency_jitter(self) -> float:
        """
        [s] standard deviation; no sample arrives before it was taken.
        """
    @latency_jitter.setter
    def latency_jitter(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def lost(self) -> float:
        """
        Fraction of single samples that never arrive.
        """
    @lost.setter
    def lost(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def out_of_order(self) -> float:
        """
        Fraction of the samples that take 25 ms more.
        """
    @out_of_order.setter
    def out_of_order(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def position_noise(self) -> float:
        """
        [m] of one component.
        """
    @position_noise.setter
    def position_noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rotation_noise(self) -> float:
        """
        [rad] of one component.
        """
    @rotation_noise.setter
    def rotation_noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class StreamSimulationOptions:
    """
    A simulated recording.
    
    seconds = 60.0: [s] length.
    motion = 'gentle': How the arm moves.
        'still': no motion, gusts only
        'gentle': slow waves of all joints
        'stop-and-go': jerk-limited moves between random joint positions, with rests
    tip_speed = 0.3: [m/s] rms of a gentle motion, maximum of stop-and-go.
    imu_rate = 1000.0: [Hz]
    tracker_rate = 100.0: [Hz]
    joint_rate = 250.0: [Hz]
    plan_rate = 100.0: [Hz]
    plan_ahead = 0.5: [s] how long before its time a planned pose is known.
    joint_noise = 2e-06: [rad | m] standard deviation of encoder readings.
    actuator_lag = 0.04: [s] delay of the joints behind the plan.
    modes = []: Flexible modes of the arm; empty: those of `large_boom_modes`.
    frequency_spread = 0.05: Every mode's frequency is drawn anew by the seed, to within this fraction.
    gust_corner = 6.0: [Hz] gusts are white noise below this frequency.
    reach_exponent = 0.5: Frequencies go as (reference reach / reach)^this.
    imu = ImuErrors(): Errors of the inertial sensor.
    tracker = TrackerErrors(): Errors of the tracker.
    dropouts = []: Of the tracker: start and length [s]
    shifts = []: From a time [s] on the tracker frame is another: T_old_new, shape=(4, 4)
    setup = None: Where the sensors truly are (clock offsets and actuator lag are taken from above); not given: as on
        a large arm.
    seed = 0: Of everything that is drawn.
    """
    def __init__(self, *, seconds: typing.SupportsFloat | typing.SupportsIndex = 60.0, motion: typing.Literal['still', 'gentle', 'stop-and-go'] = 'gentle', tip_speed: typing.SupportsFloat | typing.SupportsIndex = 0.3, imu_rate: typing.SupportsFloat | typing.SupportsIndex = 1000.0, tracker_rate: typing.SupportsFloat | typing.SupportsIndex = 100.0, joint_rate: typing.SupportsFloat | typing.SupportsIndex = 250.0, plan_rate: typing.SupportsFloat | typing.SupportsIndex = 100.0, plan_ahead: typing.SupportsFloat | typing.SupportsIndex = 0.5, joint_noise: typing.SupportsFloat | typing.SupportsIndex = 2e-06, actuator_lag: typing.SupportsFloat | typing.SupportsIndex = 0.04, modes: collections.abc.Sequence[FlexibleMode] = [], frequency_spread: typing.SupportsFloat | typing.SupportsIndex = 0.05, gust_corner: typing.SupportsFloat | typing.SupportsIndex = 6.0, reach_exponent: typing.SupportsFloat | typing.SupportsIndex = 0.5, imu: ImuErrors = ..., tracker: TrackerErrors = ..., dropouts: collections.abc.Sequence[tuple[typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]] = [], shifts: collections.abc.Sequence[tuple[typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]]] = [], setup: TrackSetup | None = None, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> StreamSimulationOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> StreamSimulationOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def actuator_lag(self) -> float:
        """
        [s] delay of the joints behind the plan.
        """
    @actuator_lag.setter
    def actuator_lag(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def dropouts(self) -> tuple[tuple[float, float], ...]:
        """
        Of the tracker: start and length [s]
        """
    @dropouts.setter
    def dropouts(self, arg1: collections.abc.Sequence[tuple[typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]]) -> None:
        ...
    @property
    def frequency_spread(self) -> float:
        """
        Every mode's frequency is drawn anew by the seed, to within this fraction.
        """
    @frequency_spread.setter
    def frequency_spread(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def gust_corner(self) -> float:
        """
        [Hz] gusts are white noise below this frequency.
        """
    @gust_corner.setter
    def gust_corner(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def imu(self) -> ImuErrors:
        """
        Errors of the inertial sensor.
        """
    @imu.setter
    def imu(self, arg0: ImuErrors) -> None:
        ...
    @property
    def imu_rate(self) -> float:
        """
        [Hz]
        """
    @imu_rate.setter
    def imu_rate(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def joint_noise(self) -> float:
        """
        [rad | m] standard deviation of encoder readings.
        """
    @joint_noise.setter
    def joint_noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def joint_rate(self) -> float:
        """
        [Hz]
        """
    @joint_rate.setter
    def joint_rate(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def modes(self) -> tuple[FlexibleMode, ...]:
        """
        Flexible modes of the arm; empty: those of `large_boom_modes`.
        """
    @modes.setter
    def modes(self, arg1: collections.abc.Sequence[FlexibleMode]) -> None:
        ...
    @property
    def motion(self) -> typing.Literal['still', 'gentle', 'stop-and-go']:
        """
        How the arm moves.
        
        'still': no motion, gusts only
        'gentle': slow waves of all joints
        'stop-and-go': jerk-limited moves between random joint positions, with rests
        """
    @motion.setter
    def motion(self, arg1: typing.Literal['still', 'gentle', 'stop-and-go']) -> None:
        ...
    @property
    def plan_ahead(self) -> float:
        """
        [s] how long before its time a planned pose is known.
        """
    @plan_ahead.setter
    def plan_ahead(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def plan_rate(self) -> float:
        """
        [Hz]
        """
    @plan_rate.setter
    def plan_rate(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def reach_exponent(self) -> float:
        """
        Frequencies go as (reference reach / reach)^this.
        """
    @reach_exponent.setter
    def reach_exponent(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def seconds(self) -> float:
        """
        [s] length.
        """
    @seconds.setter
    def seconds(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def seed(self) -> int:
        """
        Of everything that is drawn.
        """
    @seed.setter
    def seed(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def setup(self) -> TrackSetup | None:
        """
        Where the sensors truly are (clock offsets and actuator lag are taken from above); not given: as on
        a large arm.
        """
    @setup.setter
    def setup(self, arg1: TrackSetup | None) -> None:
        ...
    @property
    def shifts(self) -> tuple[tuple[float, typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]], ...]:
        """
        From a time [s] on the tracker frame is another: T_old_new, shape=(4, 4)
        """
    @shifts.setter
    def shifts(self, arg1: collections.abc.Sequence[tuple[typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[4, 4]"]]]) -> None:
        ...
    @property
    def tip_speed(self) -> float:
        """
        [m/s] rms of a gentle motion, maximum of stop-and-go.
        """
    @tip_speed.setter
    def tip_speed(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def tracker(self) -> TrackerErrors:
        """
        Errors of the tracker.
        """
    @tracker.setter
    def tracker(self, arg0: TrackerErrors) -> None:
        ...
    @property
    def tracker_rate(self) -> float:
        """
        [Hz]
        """
    @tracker_rate.setter
    def tracker_rate(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class SimulatedStreams:
    """
    Streams of a simulated arm, with their truth. Every stream is sorted by arrival.
    """
    def __repr__(self) -> str:
        ...
    def tool_at(self, t: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(n, 4, 4): the true tool in the base frame. t: shape=(n,) [s], the inertial sensor's clock.
        """
    @property
    def flange(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        t, T_base_flange, arrival: forward kinematics of the joints.
        """
    @property
    def imu(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        t, gyro, accel, arrival: arguments of `RecordedStreams.set_imu`.
        """
    @property
    def joints(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        t, joints (n, driven joints), arrival.
        """
    @property
    def modes(self) -> tuple[FlexibleMode, ...]:
        """
        As they were drawn.
        """
    @property
    def plan(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        t, T_base_tool, arrival.
        """
    @property
    def recorded(self) -> RecordedStreams:
        """
        What a recording would hold.
        """
    @property
    def setup(self) -> TrackSetup:
        """
        True frames, clock offset at t = 0.
        """
    @property
    def tracker(self) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
        """
        t, position, orientation (w x y z), arrival.
        """
class RestPose:
    """
    A standstill, averaged.
    """
    def __repr__(self) -> str:
        ...
    @property
    def T_base_flange(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4)
        """
    @property
    def T_tracker_receiver(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
        """
        Shape=(4, 4)
        """
    @property
    def end(self) -> float:
        """
        [s] controller's clock.
        """
    @property
    def samples(self) -> int:
        """
        Number of samples of the tracker.
        """
    @property
    def scatter(self) -> float:
        """
        [m] of the tracker's position, rms of a component: noise and sway.
        """
    @property
    def start(self) -> float:
        """
        [s] controller's clock.
        """
class PositionError:
    """
    How far a test position is from the frames found, and what it counted in the refinement.
    """
    def __repr__(self) -> str:
        ...
    @property
    def position(self) -> float:
        """
        [m]
        """
    @property
    def rotation(self) -> float:
        """
        [rad]
        """
    @property
    def weight(self) -> float:
        """
        About 1 where errors are usual, towards 0 where they are large.
        """
class FramesResult:
    """
    Tracker frame and receiver, of `calibrate_frames`.
    """
    def __repr__(self) -> str:
        ...
    @property
    def T_flange_receiver(self) -> UncertainFrame:
        """
        With covariance.
        """
    @property
    def T_tracker_base(self) -> UncertainFrame:
        """
        With covariance.
        """
    @property
    def errors(self) -> tuple[PositionError, ...]:
        """
        One per test position.
        """
    @property
    def iterations(self) -> int:
        """
        Of the refinement.
        """
    @property
    def message(self) -> str:
        """
        One sentence.
        """
    @property
    def position_sigma(self) -> float:
        """
        [m] usual error of one component.
        """
    @property
    def rotation_sigma(self) -> float:
        """
        [rad] likewise.
        """
    @property
    def status(self) -> typing.Literal['done', 'not observable', 'not consistent', 'not converged']:
        """
        Whether there is a result, and why not.
        
        'not observable': the message says what does not show, and what to do
        'not consistent': the message names the reading that would make the numbers agree, if any
        """
    @property
    def warnings(self) -> tuple[str, ...]:
        """
        What to know or do.
        """
class ToolResult:
    """
    The tool on the flange, of `calibrate_tool`.
    """
    def __repr__(self) -> str:
        ...
    @property
    def T_flange_tool(self) -> UncertainFrame:
        """
        With covariance.
        """
    @property
    def message(self) -> str:
        """
        One sentence.
        """
    @property
    def orientation_error(self) -> tuple[float, ...]:
        """
        [rad] of every orientation pose.
        """
    @property
    def pivot_error(self) -> tuple[float, ...]:
        """
        [m] of every pivot pose.
        """
    @property
    def point(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) [m] where the tip was, in the base frame.
        """
    @property
    def status(self) -> typing.Literal['done', 'not observable', 'not consistent', 'not converged']:
        """
        Whether there is a result, and why not.
        
        'not observable': the message says what does not show, and what to do
        'not consistent': the message names the reading that would make the numbers agree, if any
        """
class InertialResult:
    """
    Inertial sensor, gravity and clock, of `calibrate_inertial`.
    """
    def __repr__(self) -> str:
        ...
    @property
    def T_receiver_imu(self) -> UncertainFrame:
        """
        With covariance.
        """
    @property
    def accel_bias(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) [m/s^2]
        """
    @property
    def accel_bias_sigma(self) -> float:
        """
        [m/s^2] likewise.
        """
    @property
    def advice(self) -> str:
        """
        What would make it so.
        """
    @property
    def clock_offset(self) -> float:
        """
        [s] t_imu = t_tracker - clock_offset.
        """
    @property
    def clock_offset_sigma(self) -> float:
        """
        [s] standard error.
        """
    @property
    def gravity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) [m/s^2] in the tracker frame.
        """
    @property
    def gravity_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Shape=(3, 3)
        """
    @property
    def gyro_bias(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) [rad/s]
        """
    @property
    def gyro_bias_sigma(self) -> float:
        """
        [rad/s] standard error, rms over the components.
        """
    @property
    def iterations(self) -> int:
        """
        Of the fit.
        """
    @property
    def message(self) -> str:
        """
        One sentence.
        """
    @property
    def position_rms(self) -> float:
        """
        [m] residual of one component.
        """
    @property
    def rich_enough(self) -> bool:
        """
        The offset is known as well as wanted.
        """
    @property
    def rotation_rate(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Shape=(3,) [rad/s] rms about the three principal axes, descending.
        """
    @property
    def rotation_rms(self) -> float:
        """
        [rad] likewise.
        """
    @property
    def status(self) -> typing.Literal['done', 'not observable', 'not consistent', 'not converged']:
        """
        Whether there is a result, and why not.
        
        'not observable': the message says what does not show, and what to do
        'not consistent': the message names the reading that would make the numbers agree, if any
        """
    @property
    def tracker_up(self) -> str:
        """
        The tracker's axis that points up: '+z', '+y' ….
        """
    @property
    def warnings(self) -> tuple[str, ...]:
        """
        What to know or do.
        """
class Motion:
    """
    A stretch of a recording, as the basis of an effect on torques sees it. Arrays are copies.
    """
    def __len__(self) -> int:
        ...
    def column(self, name: str) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"] | None:
        """
        shape=(rows,) A further column of the recording; None: it has none of this name.
        """
    @property
    def direction(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(rows, joints) -1 … 1: of the motion, as dry friction knows it
        """
    @property
    def q(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(rows, joints) [rad | m]
        """
    @property
    def qd(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(rows, joints) [rad/s | m/s]
        """
    @property
    def qdd(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(rows, joints) [rad/s^2 | m/s^2]
        """
    @property
    def step(self) -> float:
        """
        [s] between rows
        """
    @property
    def time(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        shape=(rows,) [s] from the start of the recording
        """
    @property
    def torque(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        shape=(rows, joints) [Nm | N] that the model predicts in all, friction included
        """
class TorqueOptions:
    """
    How torques are fitted.
    
    effects = []: Effects to fit. None: what is usual, the links' inertial parameters, armature, Coulomb and viscous
        friction, an offset.
    leave_out_forms = []: Forms of laws that are not fitted, by effect and part: 'viscous_law.root'.
    fit_inertials = True: The links' inertial parameters are fitted beside the effects.
    cutoff = 8.0: [Hz] of the low-pass without phase that both sides of the equation of motion go through.
    test_share = 0.3: Fraction of the time held out when there is one recording, or none is marked as test.
    threads = 0: 0: as many as the machine has.
    """
    def __init__(self, *, effects: collections.abc.Sequence[EffectRequest] = [], leave_out_forms: collections.abc.Sequence[str] = [], fit_inertials: bool = True, cutoff: typing.SupportsFloat | typing.SupportsIndex = 8.0, test_share: typing.SupportsFloat | typing.SupportsIndex = 0.3, threads: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> TorqueOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> TorqueOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def cutoff(self) -> float:
        """
        [Hz] of the low-pass without phase that both sides of the equation of motion go through.
        """
    @cutoff.setter
    def cutoff(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def effects(self) -> tuple[EffectRequest, ...]:
        """
        Effects to fit. None: what is usual, the links' inertial parameters, armature, Coulomb and viscous
        friction, an offset.
        """
    @effects.setter
    def effects(self, arg1: collections.abc.Sequence[EffectRequest]) -> None:
        ...
    @property
    def fit_inertials(self) -> bool:
        """
        The links' inertial parameters are fitted beside the effects.
        """
    @fit_inertials.setter
    def fit_inertials(self, arg1: bool) -> None:
        ...
    @property
    def leave_out_forms(self) -> tuple[str, ...]:
        """
        Forms of laws that are not fitted, by effect and part: 'viscous_law.root'.
        """
    @leave_out_forms.setter
    def leave_out_forms(self, arg1: collections.abc.Sequence[str]) -> None:
        ...
    @property
    def test_share(self) -> float:
        """
        Fraction of the time held out when there is one recording, or none is marked as test.
        """
    @test_share.setter
    def test_share(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def threads(self) -> int:
        """
        0: as many as the machine has.
        """
    @threads.setter
    def threads(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class TorqueDiagnoseOptions:
    """
    How a gap of torques is diagnosed.
    
    leave_out = []: Effects that are not to be considered, by name.
    cutoff = 8.0: [Hz] of the low-pass without phase that both sides of the equation of motion go through.
    test_share = 0.3: Fraction of the time held out when there is one recording, or none is marked as test.
    max_effects = 40: Maximum number of effects named.
    least_gain = 0.01: [-] fraction of a joint's squared error on unseen recordings that a name must remove.
    threads = 0: 0: as many as the machine has.
    """
    def __init__(self, *, leave_out: collections.abc.Sequence[str] = [], cutoff: typing.SupportsFloat | typing.SupportsIndex = 8.0, test_share: typing.SupportsFloat | typing.SupportsIndex = 0.3, max_effects: typing.SupportsInt | typing.SupportsIndex = 40, least_gain: typing.SupportsFloat | typing.SupportsIndex = 0.01, threads: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> TorqueDiagnoseOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> TorqueDiagnoseOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def cutoff(self) -> float:
        """
        [Hz] of the low-pass without phase that both sides of the equation of motion go through.
        """
    @cutoff.setter
    def cutoff(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def least_gain(self) -> float:
        """
        [-] fraction of a joint's squared error on unseen recordings that a name must remove.
        """
    @least_gain.setter
    def least_gain(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def leave_out(self) -> tuple[str, ...]:
        """
        Effects that are not to be considered, by name.
        """
    @leave_out.setter
    def leave_out(self, arg1: collections.abc.Sequence[str]) -> None:
        ...
    @property
    def max_effects(self) -> int:
        """
        Maximum number of effects named.
        """
    @max_effects.setter
    def max_effects(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def test_share(self) -> float:
        """
        Fraction of the time held out when there is one recording, or none is marked as test.
        """
    @test_share.setter
    def test_share(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def threads(self) -> int:
        """
        0: as many as the machine has.
        """
    @threads.setter
    def threads(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class TorqueError:
    """
    Errors of a joint's torque, both sides low-passed.
    """
    def __repr__(self) -> str:
        ...
    @property
    def joint(self) -> str:
        """
        Its name.
        """
    @property
    def n(self) -> float:
        """
        Number of rows.
        """
    @property
    def percent(self) -> float:
        """
        [%] of the measured torque's standard deviation.
        """
    @property
    def rms(self) -> float:
        """
        [Nm | N]
        """
class TorqueErrors:
    """
    Errors of one model on the recordings that were held out, and on the others.
    """
    def __repr__(self) -> str:
        ...
    @property
    def held_out(self) -> tuple[TorqueError, ...]:
        """
        Joint by joint.
        """
    @property
    def in_motion(self) -> tuple[TorqueError, ...]:
        """
        Joint by joint, of the held-out rows in which it moves: at rest friction is a history, and is not
        fitted.
        """
    @property
    def model(self) -> str:
        """
        'nominal', 'standard', 'named' or 'with_unknown'.
        """
    @property
    def train(self) -> tuple[TorqueError, ...]:
        """
        Joint by joint.
        """
class TorqueFit:
    """
    What a fit of torques found.
    """
    def __repr__(self) -> str:
        ...
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(m, m): of the parameters that are not frozen, in their order.
        """
    @property
    def cutoff(self) -> float:
        """
        [Hz] of the low-pass.
        """
    @property
    def errors(self) -> tuple[TorqueErrors, ...]:
        """
        'nominal', 'standard' (what is usual), 'named' (what was asked for)
        """
    @property
    def held_out(self) -> tuple[str, ...]:
        """
        Names of the recordings that were held out; of one recording: 'blocks of time'.
        """
    @property
    def not_testable(self) -> tuple[NotTestable, ...]:
        """
        What the recordings could not show.
        """
    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """
        Of the effects, with standard errors; 'link_inertia…': change from nominal.
        """
    @property
    def robot(self) -> Robot:
        """
        With the inertial parameters and Robot::torque_effects that were found.
        """
    @property
    def warnings(self) -> tuple[str, ...]:
        """
        What to know before trusting it.
        """
class TorquePrediction:
    """
    Torques of a recording as a robot predicts them.
    """
    def __repr__(self) -> str:
        ...
    @property
    def current(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(n, joints) [A] of drives whose torque per ampere is known, else NaN.
        """
    @property
    def cutoff(self) -> float:
        """
        [Hz] of the low-pass that the angles went through for their derivatives.
        """
    @property
    def time(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Shape=(n,) [s] as recorded.
        """
    @property
    def torque(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(n, joints) [Nm | N]
        """
class TorqueAlternative:
    """
    An effect that explains torques as well as the one named.
    """
    def __repr__(self) -> str:
        ...
    @property
    def effect(self) -> str:
        """
        Its name.
        """
    @property
    def joints(self) -> tuple[str, ...]:
        """
        Where.
        """
    @property
    def probability(self) -> float:
        """
        Its part of the class's posterior probability.
        """
class FoundTorqueEffect:
    """
    An effect on the torques that `diagnose` named.
    """
    def __repr__(self) -> str:
        ...
    @property
    def confounded_with(self) -> tuple[TorqueAlternative, ...]:
        """
        Effects that would explain these recordings as well.
        """
    @property
    def effect(self) -> str:
        """
        Its name, as in `torque_catalogue()`.
        """
    @property
    def grounds(self) -> types.MappingProxyType[str, float]:
        """
        What that was worked out from, as in `FoundEffect`.
        """
    @property
    def joints(self) -> tuple[str, ...]:
        """
        Where; of a coupling the joint that is moved first, the acting one second.
        """
    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """
        Values and standard errors, constants of its law among them.
        """
    @property
    def plain(self) -> str:
        """
        What it is in plain words, without the joints.
        """
    @property
    def probability(self) -> float:
        """
        Posterior of the class: this effect or one of `confounded_with`.
        """
    @property
    def rms(self) -> float:
        """
        [Nm | N] of its torque.
        """
    @property
    def sentence(self) -> str:
        """
        What it is, where, and how large.
        """
    @property
    def share(self) -> Share:
        """
        Fraction of the squared error that standard practice leaves (of a standard one: that the nominal
        model leaves) that it removes, all others in, on recordings that were not fitted; over all joints,
        each by its noise.
        """
    @property
    def standard(self) -> bool:
        """
        What everybody fits: inertial parameters, Coulomb, viscous, an offset.
        """
class UnknownTorque:
    """
    A part of the torques that goes with an input, and that no effect of the catalogue explains.
    """
    def __repr__(self) -> str:
        ...
    @property
    def curve(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n, 3): input, torque, standard error [Nm | N]; empty where its past counts.
        """
    @property
    def inputs(self) -> tuple[str, ...]:
        """
        'angle', 'angle J2' (another joint's), 'speed', 'load', 'time', 'direction' or a column; 'its past'
        after 'load' where the load is remembered.
        """
    @property
    def joint(self) -> str:
        """
        Its name.
        """
    @property
    def probability(self) -> float:
        """
        Posterior that there is such a thing.
        """
    @property
    def rms(self) -> float:
        """
        [Nm | N] of its torque.
        """
    @property
    def share(self) -> Share:
        """
        As that of an effect.
        """
class TorqueRegime:
    """
    How much of the gap lies in one part of the motion.
    """
    def __repr__(self) -> str:
        ...
    @property
    def high(self) -> float:
        """
        Of the input: upper end.
        """
    @property
    def input(self) -> str:
        """
        'speed', 'direction', 'acceleration', 'load', 'time', 'temperature', 'angle'.
        """
    @property
    def joint(self) -> str:
        """
        Its name.
        """
    @property
    def low(self) -> float:
        """
        Of the input: lower end.
        """
    @property
    def n(self) -> float:
        """
        Number of rows.
        """
    @property
    def named(self) -> float:
        """
        [Nm | N] rms error that is left with what was named.
        """
    @property
    def standard(self) -> float:
        """
        [Nm | N] rms error that standard practice leaves there.
        """
class TorqueOrder:
    """
    Waves of the torque that are left and repeat with the turn of a joint, so often that something turns
    faster behind it: its motor (as often as the gear reduces), the wave generator of a harmonic drive
    (twice as often), teeth.
    """
    def __repr__(self) -> str:
        ...
    @property
    def amplitude(self) -> float:
        """
        [Nm] of the waves, low-passed.
        """
    @property
    def joint(self) -> str:
        """
        Its name.
        """
    @property
    def order(self) -> float:
        """
        Waves in a turn of the joint, to half of one.
        """
    @property
    def share(self) -> float:
        """
        Of the squares that what was named leaves at this joint while it moves.
        """
    @property
    def with_direction(self) -> bool:
        """
        They change their sign with the direction of motion, as friction does.
        """
class TorqueClass:
    """
    What cannot be told apart from these recordings.
    """
    def __repr__(self) -> str:
        ...
    @property
    def effects(self) -> tuple[str, ...]:
        """
        'motor_constant:J2', 'payload' ….
        """
    @property
    def sentence(self) -> str:
        """
        In words, with what to record to tell.
        """
class TorqueTrace:
    """
    A stretch of a held-out recording, to look at.
    """
    def __repr__(self) -> str:
        ...
    @property
    def joint(self) -> str:
        """
        Its name.
        """
    @property
    def measured(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n,) [Nm | N]
        """
    @property
    def named(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n,) [Nm | N]
        """
    @property
    def nominal(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n,) [Nm | N]
        """
    @property
    def recording(self) -> str:
        """
        Its name.
        """
    @property
    def standard(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n,) [Nm | N]
        """
    @property
    def time(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(n,) [s]
        """
class TorqueDiagnosis:
    """
    What `truing::dynamics::diagnose` found.
    """
    def __repr__(self) -> str:
        ...
    def summary(self) -> str:
        """
        A few lines for people.
        """
    @property
    def classes(self) -> tuple[TorqueClass, ...]:
        """
        What cannot be told apart.
        """
    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(m, m): of the effects' parameters that are not frozen, one after the other.
        """
    @property
    def cutoff(self) -> float:
        """
        [Hz] of the low-pass.
        """
    @property
    def design_effect(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Shape=(joints,): rows that count as one.
        """
    @property
    def effects(self) -> tuple[FoundTorqueEffect, ...]:
        """
        Beyond standard practice, by share: what `identify` would not have fitted unasked and is likelier
        than not, then the others; then what is standard.
        """
    @property
    def errors(self) -> tuple[TorqueErrors, ...]:
        """
        'nominal', 'standard', 'named', 'with_unknown'.
        """
    @property
    def held_out(self) -> tuple[str, ...]:
        """
        Names of the recordings that were held out; of one recording: 'blocks of time'.
        """
    @property
    def not_testable(self) -> tuple[NotTestable, ...]:
        """
        What the recordings could not show.
        """
    @property
    def orders(self) -> tuple[TorqueOrder, ...]:
        """
        What is left and repeats many times a turn.
        """
    @property
    def remainders(self) -> tuple[str, ...]:
        """
        Joints at which 'with_unknown' has a little of every other effect beside what was named, for folds
        gain by it: what is left there is no noise, but small causes or other laws that cannot be told
        apart.
        """
    @property
    def robot(self) -> Robot:
        """
        With what was named.
        """
    @property
    def sentence(self) -> str:
        """
        The verdict in words.
        """
    @property
    def traces(self) -> tuple[TorqueTrace, ...]:
        """
        A held-out stretch of every joint.
        """
    @property
    def unknown(self) -> tuple[UnknownTorque, ...]:
        """
        What no effect explains.
        """
    @property
    def verdict(self) -> typing.Literal['none', 'effects', 'unknown', 'effects+unknown', 'does_not_hold']:
        """
        Whether there is a gap beyond standard practice, and whether names explain it.
        
        'none': no gap beyond noise
        'effects': named, and nothing is left
        'unknown': a gap that no effect of the catalogue explains
        'effects+unknown': named, and something is left
        'does_not_hold': what was found makes errors of held-out poses larger, for sure: nothing of it is in `robot`
        """
    @property
    def warnings(self) -> tuple[str, ...]:
        """
        What to know before trusting it.
        """
    @property
    def where(self) -> tuple[TorqueRegime, ...]:
        """
        The gap by joint and part of the motion.
        """
    @property
    def without_names(self) -> float:
        """
        [%] held-out error, geometric mean over the joints, that names start from.
        """
class TorqueSumOptions:
    """
    How torques are summed.
    
    cutoff = 8.0: [Hz] of the low-pass without phase that both sides of the equation of motion go through.
    shortest = 2.0: [s] a recording is cut into blocks of equal time that are no shorter.
    most_blocks = 100: And no more than these.
    threads = 1: 0: as many as the machine has.
    """
    def __init__(self, *, cutoff: typing.SupportsFloat | typing.SupportsIndex = 8.0, shortest: typing.SupportsFloat | typing.SupportsIndex = 2.0, most_blocks: typing.SupportsInt | typing.SupportsIndex = 100, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> TorqueSumOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> TorqueSumOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def cutoff(self) -> float:
        """
        [Hz] of the low-pass without phase that both sides of the equation of motion go through.
        """
    @cutoff.setter
    def cutoff(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def most_blocks(self) -> int:
        """
        And no more than these.
        """
    @most_blocks.setter
    def most_blocks(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def shortest(self) -> float:
        """
        [s] a recording is cut into blocks of equal time that are no shorter.
        """
    @shortest.setter
    def shortest(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def threads(self) -> int:
        """
        0: as many as the machine has.
        """
    @threads.setter
    def threads(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class TorqueColumns:
    """
    What a joint's torque may be a sum of.
    """
    def __repr__(self) -> str:
        ...
    @property
    def joints(self) -> tuple[str, ...]:
        """
        Names of the joints that have a reading.
        """
    @property
    def names(self) -> tuple[str, ...]:
        """
        Of the parameters: link_inertia.J2.m, armature.J2, coulomb.J2 ….
        """
    @property
    def of_joint(self) -> tuple[list[int], ...]:
        """
        By joint: numbers of the parameters that its torque knows, ascending.
        """
    @property
    def prior(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        Size that each may well have; of inertias alone it says something.
        """
    @property
    def units(self) -> tuple[str, ...]:
        """
        Of these.
        """
class TorqueBlock:
    """
    Normal equations of one joint's torque over the rows of a block in which the joint moves. What is
    explained is the measured torque less the nominal model's [Nm | N]; behind the columns of the
    parameters the nominal torque itself is one more.
    """
    def __repr__(self) -> str:
        ...
    @property
    def gram(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(p + 1, p + 1): X^T X.
        """
    @property
    def right(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Shape=(p + 1,): X^T y.
        """
    @property
    def rows(self) -> float:
        """
        How many; 0: the joint was at rest, or not measured.
        """
    @property
    def squares(self) -> float:
        """
        y^T y.
        """
class TorquePlanOptions:
    """
    Which motions to plan, within which limits, and what will be recorded along them.
    
    duration = 40.0: [s] of the motion.
    rate = 100.0: [Hz] of its rows.
    speed = 0.8: Fraction of the joints' speed limits that is used.
    usual_speed = 1.5: [rad/s | m/s] speed limit of joints that state none.
    acceleration = 5.0: [rad/s^2 | m/s^2] largest acceleration of a joint.
    reach = 1.5: [rad | m] farthest to either side of `home`, within 95 % of the joint's range.
    home = []: [rad | m] around which the joints move; none: the middle of their limits, or zero.
    columns = []: What is recorded beside joints and torques: 'current' (torques are drives' currents), 'torque' (they
        are sensors'), 'payload' (a known one, in half of the recordings), 'temp'.
    payload = 2.0: [kg] at the tool in half of the recordings, if 'payload' is recorded.
    temperature_low = 20.0: [deg C] of cold recordings, if 'temp' is recorded.
    temperature_high = 35.0: [deg C] of warm ones.
    separate = []: Effects to be told from each other; none: all effects count alike.
    noise = 0.02: Standard deviation of the torques' noise, as a fraction of that of the torque along a random motion
        (of a joint with little torque: of 5 % of the largest joint's).
    torque_noise = []: [Nm | N] of every joint, instead of `noise`.
    noise_time = 0.2: [s] correlation time of the noise.
    cutoff = 8.0: [Hz] of the low-pass that a diagnosis will use.
    alike = 0.98: An effect of which another explains a larger fraction is not told from it.
    starts = 12: Random motions, the best of which is refined.
    rounds = 24: Of refinement, four proposals each.
    seed = 0: Of all random choices.
    threads = 0: 0: as many as the machine has.
    """
    def __init__(self, *, duration: typing.SupportsFloat | typing.SupportsIndex = 40.0, rate: typing.SupportsFloat | typing.SupportsIndex = 100.0, speed: typing.SupportsFloat | typing.SupportsIndex = 0.8, usual_speed: typing.SupportsFloat | typing.SupportsIndex = 1.5, acceleration: typing.SupportsFloat | typing.SupportsIndex = 5.0, reach: typing.SupportsFloat | typing.SupportsIndex = 1.5, home: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], columns: collections.abc.Sequence[str] = [], payload: typing.SupportsFloat | typing.SupportsIndex = 2.0, temperature_low: typing.SupportsFloat | typing.SupportsIndex = 20.0, temperature_high: typing.SupportsFloat | typing.SupportsIndex = 35.0, separate: collections.abc.Sequence[EffectRequest] = [], noise: typing.SupportsFloat | typing.SupportsIndex = 0.02, torque_noise: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [], noise_time: typing.SupportsFloat | typing.SupportsIndex = 0.2, cutoff: typing.SupportsFloat | typing.SupportsIndex = 8.0, alike: typing.SupportsFloat | typing.SupportsIndex = 0.98, starts: typing.SupportsInt | typing.SupportsIndex = 12, rounds: typing.SupportsInt | typing.SupportsIndex = 24, seed: typing.SupportsInt | typing.SupportsIndex = 0, threads: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        ...
    def __reduce__(self) -> tuple[typing.Any, ...]:
        ...
    def __repr__(self) -> str:
        ...
    def copy(self) -> TorquePlanOptions:
        """
        An independent copy.
        """
    def replace(self, **kwargs: typing.Any) -> TorquePlanOptions:
        """
        A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).
        """
    @property
    def acceleration(self) -> float:
        """
        [rad/s^2 | m/s^2] largest acceleration of a joint.
        """
    @acceleration.setter
    def acceleration(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def alike(self) -> float:
        """
        An effect of which another explains a larger fraction is not told from it.
        """
    @alike.setter
    def alike(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def columns(self) -> tuple[str, ...]:
        """
        What is recorded beside joints and torques: 'current' (torques are drives' currents), 'torque' (they
        are sensors'), 'payload' (a known one, in half of the recordings), 'temp'.
        """
    @columns.setter
    def columns(self, arg1: collections.abc.Sequence[str]) -> None:
        ...
    @property
    def cutoff(self) -> float:
        """
        [Hz] of the low-pass that a diagnosis will use.
        """
    @cutoff.setter
    def cutoff(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def duration(self) -> float:
        """
        [s] of the motion.
        """
    @duration.setter
    def duration(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def home(self) -> tuple[float, ...]:
        """
        [rad | m] around which the joints move; none: the middle of their limits, or zero.
        """
    @home.setter
    def home(self, arg1: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> None:
        ...
    @property
    def noise(self) -> float:
        """
        Standard deviation of the torques' noise, as a fraction of that of the torque along a random motion
        (of a joint with little torque: of 5 % of the largest joint's).
        """
    @noise.setter
    def noise(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def noise_time(self) -> float:
        """
        [s] correlation time of the noise.
        """
    @noise_time.setter
    def noise_time(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def payload(self) -> float:
        """
        [kg] at the tool in half of the recordings, if 'payload' is recorded.
        """
    @payload.setter
    def payload(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rate(self) -> float:
        """
        [Hz] of its rows.
        """
    @rate.setter
    def rate(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def reach(self) -> float:
        """
        [rad | m] farthest to either side of `home`, within 95 % of the joint's range.
        """
    @reach.setter
    def reach(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def rounds(self) -> int:
        """
        Of refinement, four proposals each.
        """
    @rounds.setter
    def rounds(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def seed(self) -> int:
        """
        Of all random choices.
        """
    @seed.setter
    def seed(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def separate(self) -> tuple[EffectRequest, ...]:
        """
        Effects to be told from each other; none: all effects count alike.
        """
    @separate.setter
    def separate(self, arg1: collections.abc.Sequence[EffectRequest]) -> None:
        ...
    @property
    def speed(self) -> float:
        """
        Fraction of the joints' speed limits that is used.
        """
    @speed.setter
    def speed(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def starts(self) -> int:
        """
        Random motions, the best of which is refined.
        """
    @starts.setter
    def starts(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def temperature_high(self) -> float:
        """
        [deg C] of warm ones.
        """
    @temperature_high.setter
    def temperature_high(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def temperature_low(self) -> float:
        """
        [deg C] of cold recordings, if 'temp' is recorded.
        """
    @temperature_low.setter
    def temperature_low(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def threads(self) -> int:
        """
        0: as many as the machine has.
        """
    @threads.setter
    def threads(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def torque_noise(self) -> tuple[float, ...]:
        """
        [Nm | N] of every joint, instead of `noise`.
        """
    @torque_noise.setter
    def torque_noise(self, arg1: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]) -> None:
        ...
    @property
    def usual_speed(self) -> float:
        """
        [rad/s | m/s] speed limit of joints that state none.
        """
    @usual_speed.setter
    def usual_speed(self, arg1: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class TorqueEffectSize:
    """
    The smallest size of an effect that motions would show.
    """
    def __repr__(self) -> str:
        ...
    @property
    def closest(self) -> str:
        """
        That effect, 'none' where no other shows.
        """
    @property
    def closest_joints(self) -> tuple[str, ...]:
        """
        Where that is.
        """
    @property
    def effect(self) -> str:
        """
        Its name.
        """
    @property
    def joint(self) -> str:
        """
        The joint at whose torque it shows most.
        """
    @property
    def joints(self) -> tuple[str, ...]:
        """
        Where; empty: it belongs to no joint.
        """
    @property
    def parameter(self) -> str:
        """
        The one of its parameters that shows best.
        """
    @property
    def r2(self) -> float:
        """
        Fraction of its torque that that one explains.
        """
    @property
    def size(self) -> float:
        """
        In `unit`: seen beside inertias, Coulomb and viscous friction, and an offset.
        """
    @property
    def size_apart(self) -> float:
        """
        In `unit`: told from the effect that is most like it; NaN: never.
        """
    @property
    def torque(self) -> float:
        """
        [Nm | N] rms of its torque there at this size.
        """
    @property
    def unit(self) -> str:
        """
        Of `size`.
        """
class TorqueEffectPair:
    """
    Two effects that motions do not tell apart.
    """
    def __repr__(self) -> str:
        ...
    @property
    def effect(self) -> str:
        """
        The first.
        """
    @property
    def joints(self) -> tuple[str, ...]:
        """
        Where.
        """
    @property
    def other(self) -> str:
        """
        The other.
        """
    @property
    def other_joints(self) -> tuple[str, ...]:
        """
        Where the other is.
        """
    @property
    def r2(self) -> float:
        """
        Fraction of the first's torque that the other explains.
        """
    @property
    def separated_by(self) -> str:
        """
        What to record to tell.
        """
class TorqueOutlook:
    """
    What motions could show, before any torque is measured.
    """
    def __repr__(self) -> str:
        ...
    @property
    def alike(self) -> tuple[TorqueEffectPair, ...]:
        """
        Not told apart, largest r2 first.
        """
    @property
    def effects(self) -> tuple[TorqueEffectSize, ...]:
        """
        The smallest sizes, by effect and joint.
        """
    @property
    def not_testable(self) -> tuple[NotTestable, ...]:
        """
        Effects that would not show, and why.
        """
class TorqueRun:
    """
    One recording to make.
    """
    def __repr__(self) -> str:
        ...
    @property
    def payload(self) -> float:
        """
        [kg] at the tool.
        """
    @property
    def temperature(self) -> float:
        """
        [deg C] of the joints; NaN: any.
        """
class TorquePlan:
    """
    What `truing::dynamics::plan` found.
    """
    def __repr__(self) -> str:
        ...
    def summary(self) -> str:
        """
        A few lines for people.
        """
    @property
    def acceleration(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(n, joints) [rad/s^2 | m/s^2]
        """
    @property
    def evaluated(self) -> int:
        """
        Number of motions looked at.
        """
    @property
    def given(self) -> TorqueOutlook:
        """
        What the recordings that were given can show.
        """
    @property
    def information(self) -> float:
        """
        [nats] along the planned motion.
        """
    @property
    def information_random(self) -> float:
        """
        [nats] along the random motion (Chaloner and Verdinelli 1995)
        """
    @property
    def planned(self) -> TorqueOutlook:
        """
        What these recordings would show.
        """
    @property
    def position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(n, joints) [rad | m]
        """
    @property
    def random(self) -> TorqueOutlook:
        """
        What recordings along a random motion as long would show.
        """
    @property
    def runs(self) -> tuple[TorqueRun, ...]:
        """
        Recordings to make, each along the whole motion.
        """
    @property
    def separated(self) -> tuple[TorqueEffectPair, ...]:
        """
        Pairs that were to be told apart, along the planned motion.
        """
    @property
    def speed(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Shape=(n, joints) [rad/s | m/s]
        """
    @property
    def time(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Shape=(n,) [s]
        """
    @property
    def torque_noise(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        [Nm | N] of every joint that sizes are for.
        """
    @property
    def warnings(self) -> tuple[str, ...]:
        """
        What to know before moving.
        """
class ServoArm:
    """
    Where the joints of an arm are in the simulator.
    """
    def __init__(self, qpos: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], dof: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], step: typing.SupportsFloat | typing.SupportsIndex, bodies: typing.SupportsInt | typing.SupportsIndex, gravity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], torque_command: bool = False) -> None:
        ...
class ServoBodies:
    """
    Masses of all bodies of the simulator.
    """
    def __init__(self, mass: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], ipos: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], iquat: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], inertia: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None:
        ...
class ServoRecording:
    """
    A recording as the simulation takes it, rows at even times.
    """
    def __init__(self, step: typing.SupportsFloat | typing.SupportsIndex, command: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], speed: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], gain: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], supply: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], enabled: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], warmth: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]) -> None:
        ...
class ServoWindow:
    """
    Rows of a recording that are simulated from the state of the first.
    """
    def __init__(self, recording: typing.SupportsInt | typing.SupportsIndex, first: typing.SupportsInt | typing.SupportsIndex, rows: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
class ServoSet:
    """
    Values of the chain of every joint, shape=(joints, fields).
    
    charge: integrals of the command error at the first rows of recordings, shape=(recordings, joints); empty: zero.
    """
    def __init__(self, chain: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], weight_scale: typing.SupportsFloat | typing.SupportsIndex = 1.0, bodies: typing.SupportsInt | typing.SupportsIndex = -1, functions: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, str, typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]]] = [], only: typing.SupportsInt | typing.SupportsIndex = -1, charge: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] = ...) -> None:
        ...
class ServoPath:
    """
    What each joint feels along a recorded motion of the others.
    """
    def __init__(self, inertia: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], bias: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], cosine: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], sine: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], turns: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None:
        ...
class ColumnGain:
    """
    What adding a candidate's columns would win.
    """
    @property
    def explains_best(self) -> float:
        """
        Of what the candidate of the best score does, the part that this one can do.
        """
    @property
    def folds(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Squares of each fold, by the fit to the others.
        """
    @property
    def rank(self) -> int:
        """
        Columns that the data can see.
        """
    @property
    def scale(self) -> float:
        """
        Of the prior, the most likely one.
        """
    @property
    def score(self) -> float:
        """
        Log Bayes factor less the candidate's cost [nats].
        """
    @property
    def share(self) -> float:
        """
        Of the squares that are left, the part that it removes.
        """
    @property
    def values(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Of its columns.
        """
def assemble_setup(frames: FramesResult, inertial: InertialResult, tool: ToolResult | None = None) -> tuple[TrackSetup, list[str]]:
    """
    The parts put together, gravity in the base frame; and what to know, as a base that is not level. Without `tool` it is the flange.
    """
def calibrate_frames(T_base_flange: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"], T_tracker_receiver: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"]) -> FramesResult:
    """
    Tracker frame and receiver on the flange from test positions.
    
    A closed form, then least squares in which every position is weighted by its own error.
    T_base_flange, T_tracker_receiver: shape=(n, 4, 4). Raises InputError.
    """
def calibrate_inertial(t: numpy.typing.ArrayLike, gyro: numpy.typing.ArrayLike, accel: numpy.typing.ArrayLike, tracker_t: numpy.typing.ArrayLike, position: numpy.typing.ArrayLike, orientation: numpy.typing.ArrayLike, *, clock_search: typing.SupportsFloat | typing.SupportsIndex = 2.0, clock_wanted: typing.SupportsFloat | typing.SupportsIndex = 0.001, segment: typing.SupportsFloat | typing.SupportsIndex = 2.0, gyro_bias: typing.SupportsFloat | typing.SupportsIndex = 0.05, accel_bias: typing.SupportsFloat | typing.SupportsIndex = 0.1, max_iterations: typing.SupportsInt | typing.SupportsIndex = 30) -> InertialResult:
    """
    Where the inertial sensor is on the receiver, gravity, and the clock offset, from one motion that both saw.
    
    t, gyro, accel: shape=(n,) [s], (n, 3) [rad/s], (n, 3) [m/s^2].
    tracker_t, position, orientation: shape=(m,) [s], (m, 3) [m], (m, 4) w x y z.
    
    Raises InputError on data that cannot be used.
    
    clock_search = 2.0: [s] offsets up to this are searched.
    clock_wanted = 0.001: [s] standard error of the offset that is wanted; above it, advice is given.
    segment = 2.0: [s] length of the segments over which inertial data are integrated.
    gyro_bias = 0.05: [rad/s] standard deviation before any data.
    accel_bias = 0.1: [m/s^2] standard deviation before any data.
    max_iterations = 30: The fit stops here at the latest.
    """
def calibrate_tool(pivot: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"], orientation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"] | None = None, prescribed: collections.abc.Sequence[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]] = []) -> ToolResult:
    """
    The tool from poses of the flange.
    
    pivot: shape=(n, 4, 4), the tool tip on one point in three or more orientations.
    orientation: shape=(m, 4, 4), the tool in prescribed orientations; None: the flange's axes are the tool's.
    prescribed: R_base_tool of those, shape=(3, 3) each.
    
    Raises InputError.
    """
def catalogue() -> list[tuple[str, str]]:
    """
    Name and summary of the effects that truing knows.
    """
def catalogue_effects() -> tuple[CatalogueEffect, ...]:
    """
    The effects that truing knows, with what they say of themselves.
    """
def choose_groups(gram: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], right: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], squares: typing.SupportsFloat | typing.SupportsIndex, values: typing.SupportsFloat | typing.SupportsIndex, groups: collections.abc.Sequence[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]], prior: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], cost: typing.SupportsFloat | typing.SupportsIndex, threshold: typing.SupportsFloat | typing.SupportsIndex = 4.0) -> GroupChoice:
    """
    Which groups of columns explain y, from the normal equations of y = X theta + noise alone.
    
    gram: shape=(p, p) X^T X. right: shape=(p,) X^T y. squares: y^T y. values: how many. groups: column numbers of each.
    prior: shape=(p,), the size that each parameter may have. cost: nats for having looked at as many groups. threshold: nats
    that a group must win beyond that. Raises InputError on shapes that do not fit.
    """
def diagnose(robot: Robot, data: Measurements, options: DiagnoseOptions | None = None, own_effects: collections.abc.Sequence[OwnEffect] = []) -> Diagnosis:
    """
    Where the gap between robot and model lies, which effect causes it, and how far it shrinks.
    
    Raises InputError on data or options that cannot be used.
    """
def distinguish(robot: Robot, joints: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], options: DistinguishOptions | None = None, own_effects: collections.abc.Sequence[typing.Any] = []) -> Distinction:
    """
    Before any data: which effects a plan can tell apart, how small it would still see them, and the poses to add.
    
    Raises InputError: unknown effects, joints or columns.
    """
def dynamics_diagnose(robot: Robot, recordings: collections.abc.Sequence[Recording], options: TorqueDiagnoseOptions | None = None, own_effects: collections.abc.Sequence[typing.Any] = []) -> TorqueDiagnosis:
    """
    Which effects stand between a robot's model and the torques that it was recorded with.
    
    Raises InputError on recordings or options that cannot be used.
    """
def dynamics_identify(robot: Robot, recordings: collections.abc.Sequence[Recording], options: TorqueOptions | None = None, own_effects: collections.abc.Sequence[typing.Any] = []) -> TorqueFit:
    """
    Finds inertial parameters and the effects asked for from recordings with torques or currents.
    
    Raises InputError on recordings or options that cannot be used.
    """
def dynamics_plan(robot: Robot, options: TorquePlanOptions | None = None, recordings: collections.abc.Sequence[Recording] = [], own_effects: collections.abc.Sequence[typing.Any] = []) -> TorquePlan:
    """
    A motion that tells effects on torques apart, within the joints' limits, and what it could show.
    
    recordings: looked at as well, for what they can show. Raises InputError: options, names or recordings that cannot be
    used, a robot without masses, a joint without room to move.
    """
def dynamics_predict(robot: Robot, recording: Recording, cutoff: typing.SupportsFloat | typing.SupportsIndex | None = None, own_effects: collections.abc.Sequence[typing.Any] = []) -> TorquePrediction:
    """
    Torques of every row of a recording: links, rotors, and the effects that the robot carries. cutoff: [Hz];
    None: the highest frequency that the robot's effects were fitted on, or what is usual.
    
    Raises InputError on a recording that cannot be used.
    """
def find_rests(t: numpy.typing.ArrayLike, T_base_flange: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"], tracker_t: numpy.typing.ArrayLike, position: numpy.typing.ArrayLike, orientation: numpy.typing.ArrayLike, *, least: typing.SupportsFloat | typing.SupportsIndex = 2.0, margin: typing.SupportsFloat | typing.SupportsIndex = 0.5, moved_by: typing.SupportsFloat | typing.SupportsIndex = 0.0005, turned_by: typing.SupportsFloat | typing.SupportsIndex = 0.0005, clock_offset: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> tuple[RestPose, ...]:
    """
    Standstills of forward kinematics, with what the tracker saw during them.
    
    t, tracker_t: shape=(n,), shape=(m,) [s]. T_base_flange: shape=(n, 4, 4). position: shape=(m, 3) [m].
    orientation: shape=(m, 4) w x y z.
    
    Raises InputError.
    
    least = 2.0: [s] shorter ones do not count: sway has to average out.
    margin = 0.5: [s] left out after the arm has stopped and before it starts.
    moved_by = 0.0005: [m] the flange of forward kinematics stays within this.
    turned_by = 0.0005: [rad] likewise.
    clock_offset = 0.0: [s] t_controller = t_tracker - clock_offset, to within a fraction of `margin`.
    """
def flange_poses(robot: Robot, joints: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    shape=(n, 4, 4): the frame after the last link in the robot base. joints: shape=(n, driven joints) [rad | m].
    """
def forward_kinematics(robot: Robot, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], target: typing.SupportsInt | typing.SupportsIndex = 0) -> numpy.typing.NDArray[numpy.float64]:
    """
    Frames of the links and of a target in the measurement frame, effects left out.
    
    q: shape=(driven joints,) [rad | m]. target: its index in `robot.targets`.
    Returns shape=(joints + 1, 4, 4) [m]: the frame after every joint, then the target's. Raises InputError.
    """
def frame_from_xyz_rpy(xyz: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"], rpy: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[4, 4]"]:
    """
    Frame, shape=(4, 4), of a position, shape=(3,) [m], and roll, pitch, yaw, shape=(3,) [rad].
    """
def free_parameters(robot: Robot, data: Measurements, *, free: collections.abc.Sequence[str] = [], hold: collections.abc.Sequence[str] = [], effects: collections.abc.Sequence[EffectRequest] = []) -> list[FreeParameter]:
    """
    The parameters that `identify` would fit to these rows, before anything is known of what the rows can see.
    
    Raises InputError on rows that touch fixed points, and on names or effects that are not known.
    """
def gravity_torque_rows(robot: Robot, data: Measurements) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
    """
    shape=(n, joints) [Nm | N]: `gravity_torques` of every row, with its payload. Raises InputError.
    """
def gravity_torques(robot: Robot, q: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], payload: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    Gravity torque on every joint, passive ones included.
    
    q: shape=(driven joints,) [rad | m]. payload: [kg] at the tool. Returns shape=(joints,) [Nm | N].
    Raises InputError when no mass is known and the payload is zero.
    """
def handeye(poses: HandEyePoses, options: HandEyeOptions | None = None) -> HandEyeResult:
    """
    Where the camera is, from poses of the hand and of a board that the camera sees.
    
    Raises InputError on data or options that cannot be used. What the data cannot answer is a status, not a number.
    """
def handeye_clock(hand_time: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], T_base_hand: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"], camera_time: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], T_camera_board: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[n, 4, 4]"], setup: typing.Literal['eye-in-hand', 'eye-to-hand'] = 'eye-in-hand', search: typing.SupportsFloat | typing.SupportsIndex = 10.0) -> ClockOffset:
    """
    The offset between the clocks of robot and camera, from the motion that both saw.
    
    hand_time, camera_time: [s], increasing. search: [s] offsets up to this are tried. Raises InputError.
    """
def handeye_closed_form(poses: HandEyePoses, setup: typing.Literal['eye-in-hand', 'eye-to-hand'] = 'eye-in-hand') -> ClosedForm:
    """
    The dual-quaternion solution alone: every pose of the fit counts, none is rejected, nothing is judged.
    
    Raises InputError on data that cannot be used.
    """
def handeye_plan(poses: HandEyePoses, result: HandEyeResult, options: HandEyeOptions | None = None, plan: HandEyePlanOptions | None = None) -> tuple[NextHandPose, ...]:
    """
    Robot poses, one after the other, that shrink the covariance of the working point most.
    
    Raises InputError.
    """
def handeye_readings() -> tuple[Reading, ...]:
    """
    All readings of the numbers that `handeye` tries, in the order tried; their closures are not set.
    """
def handeye_with_kinematics(robot: Robot, joints: numpy.typing.ArrayLike, poses: HandEyePoses, options: HandEyeOptions | None = None, identify_options: IdentifyOptions | None = None) -> HandEyeKinematics:
    """
    Hand-eye, board mount and the robot's own parameters in one problem.
    
    joints: shape=(n, driven joints) [rad | m], one row per pose. Raises InputError.
    """
def identify(robot: Robot, data: Measurements, options: IdentifyOptions | None = None, own_effects: collections.abc.Sequence[OwnEffect] = []) -> Identification:
    """
    Finds the robot's parameters from measurements. Raises InputError on data or options that cannot be used.
    
    A fit that did not converge returns with solver.converged == False.
    """
def identify_modes(t: numpy.typing.ArrayLike, deviation: numpy.typing.ArrayLike, rate: numpy.typing.ArrayLike, plan_acceleration: numpy.typing.ArrayLike, options: DeviationOptions | None = None, most: typing.SupportsInt | typing.SupportsIndex = 4, worth: typing.SupportsFloat | typing.SupportsIndex = 0.03) -> ModesResult:
    """
    Frequencies, damping and gains of the sway from what `Tracker.take_rows` gave over a recording.
    
    t: shape=(n,) [s], `options.period` apart. deviation, rate: shape=(n, 6) [m, rad], [m/s, rad/s].
    plan_acceleration: shape=(n, 3) [m/s^2].
    most: maximum number of modes; another is taken while it lowers the error of predictions by at least the fraction
    `worth`.
    
    Raises InputError on fewer than 500 rows.
    """
def inferred_directions(data: Measurements) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
    """
    shape=(n, driven joints): approach directions -1, 0, 1 as the order of the rows shows them, if the poses were driven to one after the other.
    """
def inferred_speeds(data: Measurements) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
    """
    shape=(n, driven joints) [rad/s | m/s]: joint speeds as joints and times show them, of a robot that moved while it was measured; shape=(n, 0) of one that stopped for each row.
    """
def joint_motion(robot: Robot, data: Measurements, joint: str) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    shape=(n,) [rad | m]: motion of a joint as read, of a passive one from its drivers' readings. Raises InputError.
    """
def lacks_directions(robot: Robot, data: Measurements, own_effects: collections.abc.Sequence[OwnEffect] = []) -> bool:
    """
    True when an effect of the robot needs approach directions that the data lack.
    """
def lacks_speeds(robot: Robot, data: Measurements, own_effects: collections.abc.Sequence[OwnEffect] = []) -> bool:
    """
    True when an effect of the robot needs joint speeds that the data lack, and that can be inferred.
    """
def large_boom() -> Robot:
    """
    A concrete pump's or crane's arm in its plane: slew, luff, elbow and a levelled tip, 12 m of reach.
    """
def large_boom_modes() -> tuple[FlexibleMode, ...]:
    """
    Four modes from 0.6 to 6 Hz: lateral, vertical, lateral, vertical.
    """
def last_moving_link(urdf_text: str, base_link: str = '') -> str:
    """
    The last moving link of the only chain below `base_link` of a URDF text, whatever is fixed to it.
    
    Raises InputError: not a URDF, unknown base, nothing moves, several chains move.
    """
def link_parameters(robot: Robot) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    Inertial parameters of all links, one after the other, shape=(10 * joints,).
    
    Of a link: mass, mass times centre of mass (x, y, z), inertia about the origin of the frame after the link (xx, yy, zz,
    xy, xz, yz) [kg, kg m, kg m^2]; what is not known is zero.
    """
def links_off_chain(urdf_text: str, base_link: str = '', tip_link: str = '') -> list[str]:
    """
    Links that the chain carries and that move by joints of their own, as a gripper's fingers do.
    
    Their masses are merged into the link that carries them, as they stand at zero. Raises InputError as robot_from_urdf.
    """
def nearest_contact(scene: Scene, robot: Robot, joints: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], target: typing.SupportsInt | typing.SupportsIndex = 0) -> Contact:
    """
    The nearest pair at these readings, effects left out; without names when there is none to look at.
    
    joints: shape=(driven joints,) [rad | m]. target: its index in `robot.targets`. Raises InputError.
    """
def noise_from_repeats(data: Measurements) -> float | None:
    """
    Noise of one position component (or distance) [m], as rows measured again at one pose scatter. None: the repeats have fewer than 20 degrees of freedom.
    """
def plan(robot: Robot, options: PlanOptions | None = None) -> PlanResult:
    """
    Measurement poses by exchange on an observability index.
    
    Revolute joints without limits use -pi ... pi. Raises InputError: fewer poses than the parameters need, a joint
    whose range is too small for `min_step`.
    """
def pose_groups(data: Measurements) -> numpy.typing.NDArray[numpy.int32]:
    """
    shape=(n,): group of every row, 0 ... count-1 in order of appearance; `pose` if given, else equal joint readings.
    """
def predict(robot: Robot, data: Measurements, own_effects: collections.abc.Sequence[OwnEffect] = [], threads: typing.SupportsInt | typing.SupportsIndex = 0) -> Prediction:
    """
    What the robot predicts for the rows of `data`. Raises InputError on unknown effects or columns that they need.
    """
def project(camera: Camera, points: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    Pixels, shape=(m, 2), of points in the camera frame, shape=(m, 3) [m]; z points out of the lens, x right, y
    down.
    """
def rank_columns(folds: collections.abc.Sequence[tuple[typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], typing.SupportsFloat | typing.SupportsIndex, typing.SupportsFloat | typing.SupportsIndex]], always: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], candidates: collections.abc.Sequence[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]], costs: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], prior: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> list[ColumnGain]:
    """
    Evidence of candidates beside columns that are always in; the first entry is that of none.
    
    folds: of each X^T X, X^T y, y^T y and the number of rows that count. Raises InputError: other shapes.
    """
def replay(streams: RecordedStreams, setup: TrackSetup, options: TrackOptions | None = None, *, horizons: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [0.02, 0.04, 0.08], learn_modes: typing.SupportsFloat | typing.SupportsIndex = 0.0, progress: collections.abc.Callable[[float], bool] | None = None) -> ReplayResult:
    """
    Plays a recording as it would have gone on the day: nothing is used before it arrived.
    
    horizons: [s] at which predictions are graded against the tracker's later samples.
        Compensations are made `options.deviation.horizon` ahead.
    learn_modes: [s] modes are identified from the recording's start of this length and used from then on; 0: never.
    progress: called with the fraction that is done; it returns False to stop. Ctrl-C stops as well.
    
    Raises InputError.
    """
def residuals(robot: Robot, data: Measurements, own_effects: collections.abc.Sequence[OwnEffect] = [], threads: typing.SupportsInt | typing.SupportsIndex = 0) -> Residuals:
    """
    Predicted minus measured, NaN where not measured. Raises InputError.
    
    Rows of a fixed point are compared with the mean of that point's predictions.
    """
def review(robot: Robot, data: Measurements, found: Identification, options: IdentifyOptions | None = None, own_effects: collections.abc.Sequence[OwnEffect] = []) -> Mistake | None:
    """
    What speaks against the robot file or the columns that `found` was identified from. None: nothing. Raises InputError.
    """
def rigid_torques(robot: Robot, q: numpy.typing.ArrayLike, qd: numpy.typing.ArrayLike, qdd: numpy.typing.ArrayLike) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
    """
    Torques that the drives must give to move the rigid chain, rotor inertias included, friction not.
    
    What the robot does not state (mass, inertia) counts as zero; a passive joint's torque is felt by those that drive it.
    q, qd, qdd: shape=(n, driven joints) [rad | m, per s, per s^2]. Returns shape=(n, driven joints) [Nm | N]. Raises
    InputError: other shapes, values that are not finite.
    """
def robot_at(robot: Robot, data: Measurements, names: collections.abc.Sequence[str], values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], effects: collections.abc.Sequence[EffectRequest] = []) -> Robot:
    """
    The robot with these parameters at these values, which count from `robot` as those of `free_parameters` do. Raises InputError on names that the model does not have.
    """
def robot_from_urdf(urdf_text: str, base_link: str = '', tip_link: str = '') -> Robot:
    """
    The chain from `base_link` to `tip_link` of a URDF text, as a robot of convention 'urdf'.
    
    Fixed joints are folded into the next moving joint, the last ones into the tool; masses and inertias of links are
    merged the same way, also of what moves off the chain (fingers), as it stands at zero; `mimic` becomes `driven_by`, `<dynamics>` the torque effects coulomb and viscous. Empty link names: the only root, the only leaf.
    Raises InputError: not a URDF, unknown base or tip (lists the links there are), tip not below base, planar or
    floating joint.
    """
def robot_with_torques(robot: Robot, values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> Robot:
    """
    The robot with these values of all parameters of `torque_columns`, shape=(p,), added to what it has.
    
    Raises InputError on another shape.
    """
def rotation_from_rpy(rpy: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
    """
    Rotation of roll, pitch and yaw as in URDF: R = Rz(yaw) Ry(pitch) Rx(roll).
    
    rpy: shape=(3,) [rad]. Returns shape=(3, 3).
    """
def rpy_from_rotation(rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
    """
    Roll, pitch and yaw of a rotation: shape=(3, 3) to shape=(3,) [rad]. At pitch = +-pi/2 roll is 0.
    """
def seen_columns(gram: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], priority: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], tolerance: typing.SupportsFloat | typing.SupportsIndex = 1e-06) -> SeenColumns:
    """
    Which columns of a Gram matrix, shape=(p, p), it can see, as `identify` decides it: of two that cannot be told apart the one of lower `priority` stays, or the first.
    """
def servo_fields() -> list[str]:
    """
    Names of the columns of ServoSet's chain.
    """
def servo_inputs() -> list[str]:
    """
    Names of what a torque added at a joint may be a function of.
    """
def simulate_servos(calls: collections.abc.Mapping[str, typing.SupportsInt | typing.SupportsIndex], workspaces: collections.abc.Sequence[collections.abc.Mapping[str, typing.SupportsInt | typing.SupportsIndex]], arm: ServoArm, bodies: collections.abc.Sequence[ServoBodies], recordings: collections.abc.Sequence[ServoRecording], windows: collections.abc.Sequence[ServoWindow], sets: collections.abc.Sequence[ServoSet], torques: bool = False) -> tuple[list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]], list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]]]:
    """
    Simulates every set over every window: positions and torques, a list of shape=(rows, joints) each.
    
    calls, workspaces: addresses of the simulator's functions, and of each thread's model, data and arrays, which must live
    as long as the call takes. Raises InputError: shapes that do not fit, addresses that are missing.
    """
def simulate_servos_apart(arm: ServoArm, paths: collections.abc.Sequence[collections.abc.Sequence[ServoPath]], recordings: collections.abc.Sequence[ServoRecording], windows: collections.abc.Sequence[ServoWindow], sets: collections.abc.Sequence[ServoSet], threads: typing.SupportsInt | typing.SupportsIndex = 1, torques: bool = False) -> tuple[list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]], list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]]]:
    """
    As simulate_servos, joint by joint along the measured motion of the others, without a simulator.
    
    paths: of every kind of masses, those of every recording; a set's `bodies` is the number of its kind. Raises InputError:
    shapes that do not fit, masses without paths.
    """
def simulate_streams(robot: Robot, options: StreamSimulationOptions | None = None) -> SimulatedStreams:
    """
    Streams of an arm that sways, with known truth; shares no equation with the filter. Raises InputError on options that make no sense.
    """
def sum_columns(columns: collections.abc.Sequence[tuple[typing.SupportsInt | typing.SupportsIndex, typing.Annotated[numpy.typing.ArrayLike, numpy.float64]]], measured: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], weight: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], fold: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], folds: typing.SupportsInt | typing.SupportsIndex = 1, every: typing.SupportsInt | typing.SupportsIndex = 1, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> list[tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"], typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"], float, float]]:
    """
    Of each fold X^T X, X^T y, y^T y and the number of rows, weighted; the same bits whatever the threads.
    
    columns: a joint and its values, shape=(rows,), or -1 and those of all joints, shape=(rows, joints). measured: y,
    shape=(rows, joints). weight: of each joint. fold: of each row, from 0 on. every: rows are thinned to each
    so-many-th. Raises InputError: shapes that do not fit, folds or joints that there are not.
    """
def sum_rows(robot: Robot, data: Measurements, names: collections.abc.Sequence[str], values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"], counts: typing.Annotated[numpy.typing.ArrayLike, numpy.bool] | None = None, *, effects: collections.abc.Sequence[EffectRequest] = [], rotation_length: typing.SupportsFloat | typing.SupportsIndex = 0.1, scores: bool = False, threads: typing.SupportsInt | typing.SupportsIndex = 1) -> RowSums:
    """
    Normal equations of the rows that count at these values of these parameters, and the errors of every row.
    
    counts: shape=(n,), False for rows of which only the errors are told. rotation_length: [m] a rotation error of 1 rad
    counts as this length, where rows give no sigma. The same bits for any number of threads. Raises InputError.
    """
def sum_torques(robot: Robot, recording: Recording, options: TorqueSumOptions | None = None) -> list[TorqueBlock]:
    """
    Normal equations of a recording's torques: block after block of time, and in each joint after joint.
    
    Of a recording that is read in pieces no more than a stretch is in memory. A known payload is part of the nominal
    torque. The same bits for any number of threads. Raises InputError on a recording or options that cannot be used.
    """
def torque_columns(robot: Robot) -> TorqueColumns:
    """
    The parameters that torques are summed for: inertial ones of the links, and of every joint armature, Coulomb and
    viscous friction and an offset.
    
    Raises InputError: a robot that cannot be used, no link has a mass.
    """
def torque_effects() -> list[dict[str, str]]:
    """
    What every effect on torques is, in words, by the catalogue's order.
    """
def torque_regressor(robot: Robot, q: numpy.typing.ArrayLike, qd: numpy.typing.ArrayLike, qdd: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]:
    """
    Y of tau = Y pi, shape=(n, driven joints, 10 * joints): torques against inertia and gravity, linear in
    `link_parameters`.
    
    q, qd, qdd: shape=(n, driven joints), readings, their speeds and accelerations [rad | m, s]. Rotors are no part of it.
    Raises InputError: a robot that cannot be used, another shape, values that are not finite.
    """
def torques_of_bodies(robot: Robot, gram: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"], right: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    Values of all parameters with inertias that bodies can have, nearest to the solution of gram values = right.
    
    gram: shape=(p, p), right: shape=(p,), of the parameters of `torque_columns`; the sum of squares is in units of the
    noise. Raises InputError on other shapes.
    """
def unknown_effect_values(robot: Robot) -> list[str]:
    """
    Of each of the robot's effects what is wrong with its values, in words: one that its law does not look at.
    """
def unknown_torque_values(robot: Robot) -> list[str]:
    """
    The same of its effects on torques.
    """
def urdf_with_calibration(urdf_text: str, calibrated: Robot, base_link: str = '', tip_link: str = '') -> str:
    """
    The URDF text with the joint origins of the chain replaced by those of `calibrated`.
    
    What URDF cannot hold (gear ratios, base frame, effects) is named in a comment at the top. Raises InputError.
    """
def validate_measurements(data: Measurements, robot: Robot, joints_only: bool = False) -> None:
    """
    Raises InputError naming the row (counted from 0) and what is wrong with the measurements for this robot.
    
    Checked are: counts that do not fit the robot, joints or inputs that are not finite, a row without any measurement
    (unless `joints_only`), half a position, a quaternion that is not of unit length, directions, sigmas.
    """
def validate_recording(recording: Recording, robot: Robot) -> None:
    """
    Raises InputError naming the recording, the column (q2, tau3) and the row, counted from 1.
    
    Checked are: tables of another shape, times that do not increase, values that are not finite (but for joints that are
    NaN throughout, which a position must not be) or beyond 1e12, fewer than 20 rows.
    """
def validate_robot(robot: Robot) -> None:
    """
    Raises InputError when the robot cannot be used.
    
    The error names the joint and what is wrong: no joints, duplicate or empty names, unknown or circular `driven_by`,
    values that are not finite, an axis that is not of unit length, lower > upper, an inertia that is not symmetric, a
    negative rotor inertia, limits of speed or torque that are not above zero, torque_per_ampere of zero.
    """
def validate_scene(scene: Scene, robot: Robot) -> None:
    """
    Raises InputError on unknown links, empty or equal names, sizes that are not positive, frames that are not rigid.
    """
def version() -> str:
    """
    Version of the C++ core: 'major.minor.patch'.
    """
