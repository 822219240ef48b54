// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "convert/columns.hpp"
#include "convert/options.hpp"
#include "convert/text.hpp"
#include "parts.hpp"
#include "tables/handeye.hpp"

namespace truing::python {

namespace {

/// Rows of N numbers as columns of an Eigen matrix.
template <int N>
Eigen::Matrix<double, N, Eigen::Dynamic> columns_from(const ArrayLike& given, const std::string& name) {
  const Array array = Array::ensure(given);
  if (!array || array.ndim() != 2 || array.shape(1) != N) {
    PyErr_Clear();
    throw std::invalid_argument(name + " must have shape (m, " + std::to_string(N) + ")");
  }
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, N, Eigen::RowMajor>> rows(array.data(), array.shape(0),
                                                                                         N);
  return rows.transpose();
}

py::array_t<double> rows_of(const Eigen::Ref<const Eigen::MatrixXd>& columns) {
  py::array_t<double> out({columns.cols(), columns.rows()});
  Eigen::Map<RowMajor>(out.mutable_data(), columns.cols(), columns.rows()) = columns.transpose();
  return read_only(std::move(out));
}

std::vector<std::int8_t> set_from(const Labels& given, std::size_t rows) {
  std::vector<std::int8_t> out;
  for (const py::handle item : given) {
    const std::string word = py::str(item).cast<std::string>();
    if (word != "train" && word != "test" && word != "0" && word != "1")
      throw std::invalid_argument("set: pose " + std::to_string(out.size()) + " holds " +
                                  py::repr(item).cast<std::string>() +
                                  ", expected 0 (train) or 1 (test), or these words");
    out.push_back(word == "test" || word == "1" ? 1 : 0);
  }
  if (out.size() != rows)
    throw std::invalid_argument("set has " + std::to_string(out.size()) + " entries, T_base_hand has " +
                                std::to_string(rows));
  return out;
}

// ---- Camera and poses

void bind_camera(py::module_& m) {
  py::class_<Camera> cls(m, "Camera",
                         "A pinhole camera with lens distortion k1 k2 p1 p2 k3 (plumb bob, as OpenCV counts "
                         "them). Focal lengths and centre in pixels.");
  cls.def(py::init([](int width, int height, double fx, double fy, double cx, double cy,
                      const std::vector<double>& distortion) {
            Camera c;
            c.width = width;
            c.height = height;
            c.fx = fx;
            c.fy = fy;
            c.cx = cx;
            c.cy = cy;
            if (distortion.size() > 5)
              throw std::invalid_argument("distortion has " + std::to_string(distortion.size()) +
                                          " coefficients, expected at most 5: k1 k2 p1 p2 k3");
            std::copy(distortion.begin(), distortion.end(), c.distortion.begin());
            return c;
          }),
          py::kw_only(), py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"), py::arg("cx"),
          py::arg("cy"), py::arg("distortion") = std::vector<double>{});
  define_attributes(cls, {"distortion"});
  cls.def_property(
      "distortion", [](const Camera& c) { return TupleOf<double>(py::cast(c.distortion)); },
      [](Camera& c, const std::array<double, 5>& v) { c.distortion = v; }, "k1 k2 p1 p2 k3");
  cls.def("__repr__", [](const Camera& c) {
    return "Camera(" + std::to_string(c.width) + " x " + std::to_string(c.height) + ", fx " + text(c.fx) + ", fy " +
           text(c.fy) + ", centre " + text(c.cx) + " " + text(c.cy) + ")";
  });
  define_value(cls, {"width", "height", "fx", "fy", "cx", "cy", "distortion"});
}

using ImageArrays = std::vector<std::pair<ArrayLike, ArrayLike>>;

/// The image of every pose; errors name the pose.
std::vector<BoardImage> images_from(const ImageArrays& given, std::size_t poses) {
  std::vector<BoardImage> images;
  for (const auto& [points, pixels] : given) {
    const std::string which = "images, pose " + std::to_string(images.size());
    BoardImage image{columns_from<3>(points, which + ": points"), columns_from<2>(pixels, which + ": pixels")};
    if (image.points.cols() != image.pixels.cols())
      throw std::invalid_argument(which + ": " + std::to_string(image.points.cols()) + " points, but " +
                                  std::to_string(image.pixels.cols()) + " pixels");
    images.push_back(std::move(image));
  }
  if (images.size() != poses)
    throw std::invalid_argument("images has " + std::to_string(images.size()) + " entries, T_base_hand has " +
                                std::to_string(poses));
  return images;
}

HandEyePoses make_poses(const FrameArray& T_base_hand, const FrameArray& T_camera_board,
                        const std::optional<ImageArrays>& images, const std::optional<Camera>& camera,
                        const std::optional<Labels>& set, const std::vector<Eigen::Isometry3d>& symmetries) {
  HandEyePoses p;
  p.T_base_hand = frames_from(T_base_hand, "T_base_hand");
  p.T_camera_board = frames_from(T_camera_board, "T_camera_board");
  if (p.T_camera_board.size() != p.T_base_hand.size())
    throw std::invalid_argument("T_camera_board has " + std::to_string(p.T_camera_board.size()) +
                                " poses, T_base_hand has " + std::to_string(p.T_base_hand.size()));
  if (images) p.images = images_from(*images, p.T_base_hand.size());
  if (images && !camera) throw std::invalid_argument("images need a camera: its focal lengths and centre");
  p.camera = camera;
  if (set) p.set = set_from(*set, p.T_base_hand.size());
  p.board_symmetries = symmetries;
  return p;
}

using ImagesOut = std::optional<TupleOf<std::pair<py::array_t<double>, py::array_t<double>>>>;

ImagesOut images_of(const HandEyePoses& p) {
  if (p.images.empty()) return std::nullopt;
  py::tuple out(p.images.size());
  for (std::size_t i = 0; i < p.images.size(); ++i)
    out[i] = py::make_tuple(rows_of(p.images[i].points), rows_of(p.images[i].pixels));
  return py::reinterpret_steal<ImagesOut::value_type>(out.release());
}

void bind_poses(py::module_& m) {
  py::class_<HandEyePoses> cls(
      m, "HandEyePoses",
      R"(One robot pose after the other: where the hand was, and where the camera saw the board.

T_base_hand: shape=(n, 4, 4), the flange in the robot base, as the controller reports it.
T_camera_board: shape=(n, 4, 4), the board in the camera.
images: of each pose, the points of the board, shape=(m, 3) [m] in its frame, and where they were seen, shape=(m, 2)
    [px]; then pixels are what was measured, and T_camera_board is what was found from them. None: board poses were
    measured.
camera: needed with images.
set: 0 or 'train', 1 or 'test' (held out) for each pose; None: all are fitted.
board_symmetries: turns after which the board looks the same, T_board_turned, shape=(4, 4), without the identity.

Raises InputError that names the pose: values that are not finite, rotations that are not
orthonormal (to 1e-6) or left-handed.)");
  cls.def(py::init(&make_poses), py::arg("T_base_hand"), py::arg("T_camera_board"), py::kw_only(),
          py::arg("images") = py::none(), py::arg("camera") = py::none(), py::arg("set") = py::none(),
          py::arg("board_symmetries") = std::vector<Eigen::Isometry3d>{});
  cls.def_property_readonly(
      "T_base_hand", [](const HandEyePoses& p) { return array_from(p.T_base_hand); },
      "shape=(n, 4, 4): the flange in the robot base.");
  cls.def_property_readonly(
      "T_camera_board", [](const HandEyePoses& p) { return array_from(p.T_camera_board); },
      "shape=(n, 4, 4): the board in the camera.");
  cls.def_property_readonly("images", &images_of,
                            "Of each pose, points shape=(m, 3) [m] and pixels shape=(m, 2) [px]; None without images.");
  cls.def_property_readonly("camera", [](const HandEyePoses& p) { return p.camera; }, "None without images.");
  cls.def_property_readonly(
      "set",
      [](const HandEyePoses& p) -> std::optional<py::array_t<std::int8_t>> {
        if (p.set.empty()) return std::nullopt;
        return py::array_t<std::int8_t>(static_cast<py::ssize_t>(p.set.size()), p.set.data());
      },
      "shape=(n,): 0 fitted, 1 held out; None: all are fitted.");
  cls.def_property_readonly(
      "board_symmetries", [](const HandEyePoses& p) { return tuple_of(p.board_symmetries); },
      "Turns after which the board looks the same.");
  cls.def("__len__", [](const HandEyePoses& p) { return p.T_base_hand.size(); });
  cls.def("__repr__", [](const HandEyePoses& p) {
    return "HandEyePoses(" + std::to_string(p.T_base_hand.size()) + " poses" +
           (p.images.empty() ? "" : " with images") + ")";
  });
  define_value(cls, {"T_base_hand", "T_camera_board", "images", "camera", "set", "board_symmetries"});
}

// ---- Results

void bind_parts(py::module_& m) {
  auto residual = define_result<HandEyeResidual>(m, "HandEyeResidual");
  residual.def("__repr__", [](const HandEyeResidual& r) {
    return "HandEyeResidual(" + millimetres(r.position) + ", " + milliradians(r.rotation) +
           (r.rejected ? ", rejected: " + r.cause : "") + ")";
  });

  auto errors = define_result<HandEyeErrors>(m, "HandEyeErrors");
  errors.def("__repr__", [](const HandEyeErrors& e) {
    return "HandEyeErrors(rms " + millimetres(e.position_rms) + ", " + milliradians(e.rotation_rms) +
           ", n=" + std::to_string(e.n) + ")";
  });

  auto unobservable = define_result<Unobservable>(m, "Unobservable");
  unobservable.def("__repr__", [](const Unobservable& u) { return "Unobservable(" + u.what + ": " + u.advice + ")"; });

  auto reading = define_result<Reading>(m, "Reading");
  reading.def("__repr__", [](const Reading& r) { return "Reading('" + r.name + "': " + r.explanation + ")"; });

  auto concern = define_result<HandEyeConcern>(m, "HandEyeConcern");
  concern.def("__repr__", [](const HandEyeConcern& c) {
    return std::string("HandEyeConcern('") + word(c.kind) + "', " + text(c.value) + ", " + text(c.reference) + ")";
  });

  auto noise = define_result<HandEyeNoise>(m, "HandEyeNoise");
  noise.def("__repr__", [](const HandEyeNoise& n) {
    return "HandEyeNoise(" + millimetres(n.position) + ", hand " + milliradians(n.hand_rotation) +
           (std::isnan(n.pixel) ? ", camera " + milliradians(n.camera_rotation) : ", " + text(n.pixel) + " px") + ")";
  });

  auto closed = define_result<ClosedForm>(m, "ClosedForm");
  closed.def("__repr__", [](const ClosedForm& c) { return "ClosedForm(" + std::to_string(c.motions) + " motions)"; });

  auto next = define_result<NextHandPose>(m, "NextHandPose");
  next.def("__repr__", [](const NextHandPose& p) {
    return "NextHandPose(working point to " + millimetres(p.working_point_sigma) + ")";
  });

  auto clock = define_result<ClockOffset>(m, "ClockOffset");
  clock.def("__repr__", [](const ClockOffset& c) {
    return c.found ? "ClockOffset(" + text(c.offset) + " s)" : "ClockOffset(not found: " + c.message + ")";
  });
}

/// "12.3456 -4.5 6.78 mm"
std::string position_text(const Eigen::Isometry3d& frame) {
  char buffer[96];
  const Eigen::Vector3d p = 1e3 * frame.translation();
  std::snprintf(buffer, sizeof buffer, "%.2f %.2f %.2f mm", p.x(), p.y(), p.z());
  return buffer;
}

std::string closure_text(const char* name, const HandEyeErrors& e) {
  return std::string(name) + ": rms " + millimetres(e.position_rms) + ", " + milliradians(e.rotation_rms) + " (worst " +
         millimetres(e.position_max) + ", n = " + std::to_string(e.n) + ")\n";
}

std::string summary(const HandEyeResult& r) {
  std::string out = r.message + "\n";
  if (r.status == HandEyeStatus::done) {
    const Eigen::Matrix<double, 6, 1> sigma = r.camera.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    const double third = std::sqrt(1.0 / 3.0);
    out += "camera at " + position_text(r.camera.T) + ", +- " + millimetres(third * sigma.head<3>().norm()) + ", " +
           milliradians(third * sigma.tail<3>().norm()) + " per axis; at the working point +- " +
           millimetres(third * std::sqrt(std::max(0.0, r.working_point_covariance.trace()))) + "\n";
    out += closure_text("left out", r.left_out);
    if (r.test) out += closure_text("held out", *r.test);
  }
  for (const std::string& warning : r.warnings) out += "warning: " + warning + "\n";
  for (const std::size_t i : r.rejected)
    out += "rejected pose " + std::to_string(i) + ": " + r.residuals.at(i).cause + "\n";
  for (const Unobservable& u : r.unobservable) out += u.what + ": " + u.advice + "\n";
  for (const Reading& reading : r.readings)
    out += "the loop closes (" + millimetres(reading.position_rms) + ") if " + reading.explanation + ": reading '" +
           reading.name + "'\n";
  return out;
}

void bind_result(py::module_& m) {
  auto cls = define_result<HandEyeResult>(m, "HandEyeResult", {"camera_model_sigma"});
  cls.def_property_readonly(
      "camera_model_sigma", [](const HandEyeResult& r) { return tuple_of(r.camera_model_sigma); },
      "Standard errors of fx fy cx cy [px] k1 k2 p1 p2 k3.");
  cls.def("summary", &summary, "A few lines for people.");
  cls.def("__repr__", [](const HandEyeResult& r) {
    return std::string("HandEyeResult('") + word(r.status) + "': " + r.message + ")";
  });

  auto both = define_result<HandEyeKinematics>(m, "HandEyeKinematics");
  both.def("__repr__", [](const HandEyeKinematics& k) {
    return "HandEyeKinematics(closure rms " + millimetres(k.train_before.position_rms) + " -> " +
           millimetres(k.train_after.position_rms) + ")";
  });
}

// ---- Functions

void bind_solving(py::module_& m) {
  m.def(
      "project",
      [](const Camera& camera, const ArrayLike& points) {
        const Eigen::Matrix3Xd in = columns_from<3>(points, "points");
        Eigen::Matrix2Xd out(2, in.cols());
        for (Eigen::Index k = 0; k < in.cols(); ++k) out.col(k) = project(camera, in.col(k));
        return rows_of(out);
      },
      py::arg("camera"), py::arg("points"),
      R"(Pixels, shape=(m, 2), of points in the camera frame, shape=(m, 3) [m]; z points out of the lens, x right, y
down.)");
  m.def(
      "handeye",
      [](const HandEyePoses& poses, const std::optional<HandEyeOptions>& given) {
        const HandEyeOptions options = given.value_or(HandEyeOptions{});
        const py::gil_scoped_release unlocked;
        return handeye(poses, options);
      },
      py::arg("poses"), py::arg("options") = py::none(),
      R"(Where the camera is, from poses of the hand and of a board that the camera sees.

Raises InputError on data or options that cannot be used. What the data cannot answer is a status, not a number.)");
  m.def(
      "handeye_closed_form",
      [](const HandEyePoses& poses, HandEyeSetup setup) {
        const py::gil_scoped_release unlocked;
        return handeye_closed_form(poses, setup);
      },
      py::arg("poses"), py::arg("setup") = HandEyeSetup::eye_in_hand,
      R"(The dual-quaternion solution alone: every pose of the fit counts, none is rejected, nothing is judged.

Raises InputError on data that cannot be used.)");
  m.def(
      "handeye_readings", [] { return tuple_of(handeye_readings()); },
      "All readings of the numbers that `handeye` tries, in the order tried; their closures are not set.");
}

void bind_more(py::module_& m) {
  define_options<HandEyePlanOptions>(m, "HandEyePlanOptions");
  m.def(
      "handeye_plan",
      [](const HandEyePoses& poses, const HandEyeResult& result, const std::optional<HandEyeOptions>& given,
         const std::optional<HandEyePlanOptions>& given_plan) {
        const HandEyeOptions options = given.value_or(HandEyeOptions{});
        const HandEyePlanOptions plan = given_plan.value_or(HandEyePlanOptions{});
        std::vector<NextHandPose> next;
        {
          const py::gil_scoped_release unlocked;
          next = handeye_plan(poses, result, options, plan);
        }
        return tuple_of(next);
      },
      py::arg("poses"), py::arg("result"), py::arg("options") = py::none(), py::arg("plan") = py::none(),
      R"(Robot poses, one after the other, that shrink the covariance of the working point most.

Raises InputError.)");
  m.def(
      "handeye_clock",
      [](const std::vector<double>& hand_time, const FrameArray& T_base_hand, const std::vector<double>& camera_time,
         const FrameArray& T_camera_board, HandEyeSetup setup, double search) {
        const auto hand = frames_from(T_base_hand, "T_base_hand");
        const auto board = frames_from(T_camera_board, "T_camera_board");
        const py::gil_scoped_release unlocked;
        return handeye_clock(hand_time, hand, camera_time, board, setup, search);
      },
      py::arg("hand_time"), py::arg("T_base_hand"), py::arg("camera_time"), py::arg("T_camera_board"),
      py::arg("setup") = HandEyeSetup::eye_in_hand, py::arg("search") = 10.0,
      R"(The offset between the clocks of robot and camera, from the motion that both saw.

hand_time, camera_time: [s], increasing. search: [s] offsets up to this are tried. Raises InputError.)");
  m.def(
      "handeye_with_kinematics",
      [](const Robot& given_robot, const ArrayLike& joints, const HandEyePoses& poses,
         const std::optional<HandEyeOptions>& given, const std::optional<IdentifyOptions>& given_identify) {
        const RowMajor readings = matrix_from(joints, "joints", "(n, driven joints)");
        const HandEyeOptions options = given.value_or(HandEyeOptions{});
        const IdentifyOptions identify_options = given_identify.value_or(IdentifyOptions{});
        const Robot robot = given_robot;  // other Python threads may change theirs once the GIL is released
        const py::gil_scoped_release unlocked;
        return handeye_with_kinematics(robot, readings, poses, options, identify_options);
      },
      py::arg("robot"), py::arg("joints"), py::arg("poses"), py::arg("options") = py::none(),
      py::arg("identify_options") = py::none(),
      R"(Hand-eye, board mount and the robot's own parameters in one problem.

joints: shape=(n, driven joints) [rad | m], one row per pose. Raises InputError.)");
}

}  // namespace

void bind_handeye(py::module_& m) {
  bind_camera(m);
  bind_poses(m);
  define_options<HandEyeOptions>(m, "HandEyeOptions");
  bind_parts(m);
  bind_result(m);
  bind_solving(m);
  bind_more(m);
}

}  // namespace truing::python
