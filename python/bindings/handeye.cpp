// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>

#include "casters.hpp"

namespace truing::python {

namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// "1.23 mm"
std::string millimetres(double metres) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.3g mm", 1e3 * metres);
  return buffer;
}

std::string milliradians(double radians) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.3g mrad", 1e3 * radians);
  return buffer;
}

std::optional<double> known(double value) { return std::isnan(value) ? std::nullopt : std::optional<double>(value); }

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

template <class Columns>
py::array_t<double> array_from_columns(const Columns& columns) {
  py::array_t<double> out({columns.cols(), columns.rows()});
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      out.mutable_data(), columns.cols(), columns.rows()) = columns.transpose();
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

// ---- Data

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
  cls.def_readwrite("width", &Camera::width, "[px]");
  cls.def_readwrite("height", &Camera::height, "[px]");
  cls.def_readwrite("fx", &Camera::fx, "[px]");
  cls.def_readwrite("fy", &Camera::fy, "[px]");
  cls.def_readwrite("cx", &Camera::cx, "[px]");
  cls.def_readwrite("cy", &Camera::cy, "[px]");
  cls.def_property(
      "distortion", [](const Camera& c) { return py::typing::Tuple<double, py::ellipsis>(py::cast(c.distortion)); },
      [](Camera& c, const std::array<double, 5>& v) { c.distortion = v; }, "k1 k2 p1 p2 k3");
  cls.def("__repr__", [](const Camera& c) {
    return "Camera(" + std::to_string(c.width) + " x " + std::to_string(c.height) + ", fx " + text(c.fx) + ", fy " +
           text(c.fy) + ", centre " + text(c.cx) + " " + text(c.cy) + ")";
  });
  define_value(cls, {"width", "height", "fx", "fy", "cx", "cy", "distortion"});
}

using ImageArrays = std::vector<std::pair<ArrayLike, ArrayLike>>;

void bind_poses(py::module_& m) {
  py::class_<HandEyePoses> cls(
      m, "HandEyePoses",
      R"(One robot pose after the other: where the hand was, and where the camera saw the board.

T_base_hand: shape=(n, 4, 4), the flange in the robot base, as the controller reports it.
T_camera_board: shape=(n, 4, 4), the board in the camera.
images: of each pose, the points of the board, shape=(m, 3) [m] in its frame, and where they were seen, shape=(m, 2) [px];
    then pixels are what was measured, and T_camera_board is what was found from them. None: board poses were measured.
camera: needed with images.
set: 0 or 'train', 1 or 'test' (held out) for each pose; None: all are fitted.
board_symmetries: turns after which the board looks the same, T_board_turned, shape=(4, 4), without the identity.

Raises InputError that names the pose: values that are not finite, rotations that are not orthonormal (to 1e-6) or left-handed.)");
  cls.def(py::init([](const FrameArray& T_base_hand, const FrameArray& T_camera_board,
                      const std::optional<ImageArrays>& images, const std::optional<Camera>& camera,
                      const std::optional<Labels>& set, const std::vector<Eigen::Isometry3d>& symmetries) {
            HandEyePoses p;
            p.T_base_hand = frames_from(T_base_hand, "T_base_hand");
            p.T_camera_board = frames_from(T_camera_board, "T_camera_board");
            if (p.T_camera_board.size() != p.T_base_hand.size())
              throw std::invalid_argument("T_camera_board has " + std::to_string(p.T_camera_board.size()) +
                                          " poses, T_base_hand has " + std::to_string(p.T_base_hand.size()));
            if (images) {
              for (const auto& [points, pixels] : *images) {
                const std::string which = "images, pose " + std::to_string(p.images.size());
                BoardImage image{columns_from<3>(points, which + ": points"),
                                 columns_from<2>(pixels, which + ": pixels")};
                if (image.points.cols() != image.pixels.cols())
                  throw std::invalid_argument(which + ": " + std::to_string(image.points.cols()) + " points, but " +
                                              std::to_string(image.pixels.cols()) + " pixels");
                p.images.push_back(std::move(image));
              }
              if (p.images.size() != p.T_base_hand.size())
                throw std::invalid_argument("images has " + std::to_string(p.images.size()) +
                                            " entries, T_base_hand has " + std::to_string(p.T_base_hand.size()));
              if (!camera) throw std::invalid_argument("images need a camera: its focal lengths and centre");
            }
            p.camera = camera;
            if (set) p.set = set_from(*set, p.T_base_hand.size());
            p.board_symmetries = symmetries;
            return p;
          }),
          py::arg("T_base_hand"), py::arg("T_camera_board"), py::kw_only(), py::arg("images") = py::none(),
          py::arg("camera") = py::none(), py::arg("set") = py::none(),
          py::arg("board_symmetries") = std::vector<Eigen::Isometry3d>{});
  cls.def_property_readonly(
      "T_base_hand", [](const HandEyePoses& p) { return array_from(p.T_base_hand); },
      "shape=(n, 4, 4): the flange in the robot base.");
  cls.def_property_readonly(
      "T_camera_board", [](const HandEyePoses& p) { return array_from(p.T_camera_board); },
      "shape=(n, 4, 4): the board in the camera.");
  cls.def_property_readonly(
      "images",
      [](const HandEyePoses& p) -> std::optional<TupleOf<std::pair<py::array_t<double>, py::array_t<double>>>> {
        if (p.images.empty()) return std::nullopt;
        py::tuple out(p.images.size());
        for (std::size_t i = 0; i < p.images.size(); ++i)
          out[i] = py::make_tuple(array_from_columns(p.images[i].points), array_from_columns(p.images[i].pixels));
        return py::reinterpret_steal<TupleOf<std::pair<py::array_t<double>, py::array_t<double>>>>(out.release());
      },
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

void bind_options(py::module_& m) {
  const HandEyeOptions usual;
  py::class_<HandEyeOptions> cls(m, "HandEyeOptions",
                                 "How `handeye` works; see the attributes. Noise that is None is estimated.");
  cls.def(py::init([](HandEyeSetup setup, HandEyeMethod method, std::optional<double> hand_position_sigma,
                      std::optional<double> hand_rotation_sigma, std::optional<double> camera_position_sigma,
                      std::optional<double> camera_rotation_sigma, std::optional<double> pixel_sigma,
                      bool refine_camera, std::optional<Eigen::Vector3d> working_point,
                      std::optional<double> known_height, double known_height_sigma, bool reject, double reject_beyond,
                      bool recognise, std::string reading, int max_iterations) {
            HandEyeOptions o;
            o.setup = setup;
            o.method = method;
            o.hand_position_sigma = hand_position_sigma.value_or(kEstimate);
            o.hand_rotation_sigma = hand_rotation_sigma.value_or(kEstimate);
            o.camera_position_sigma = camera_position_sigma.value_or(kEstimate);
            o.camera_rotation_sigma = camera_rotation_sigma.value_or(kEstimate);
            o.pixel_sigma = pixel_sigma.value_or(kEstimate);
            o.refine_camera = refine_camera;
            o.working_point = working_point;
            o.known_height = known_height;
            o.known_height_sigma = known_height_sigma;
            o.reject = reject;
            o.reject_beyond = reject_beyond;
            o.recognise = recognise;
            o.reading = std::move(reading);
            o.max_iterations = max_iterations;
            return o;
          }),
          py::kw_only(), py::arg("setup") = usual.setup, py::arg("method") = usual.method,
          py::arg("hand_position_sigma") = py::none(), py::arg("hand_rotation_sigma") = py::none(),
          py::arg("camera_position_sigma") = py::none(), py::arg("camera_rotation_sigma") = py::none(),
          py::arg("pixel_sigma") = py::none(), py::arg("refine_camera") = usual.refine_camera,
          py::arg("working_point") = py::none(), py::arg("known_height") = py::none(),
          py::arg("known_height_sigma") = usual.known_height_sigma, py::arg("reject") = usual.reject,
          py::arg("reject_beyond") = usual.reject_beyond, py::arg("recognise") = usual.recognise,
          py::arg("reading") = usual.reading, py::arg("max_iterations") = usual.max_iterations);
  cls.def_readwrite("setup", &HandEyeOptions::setup,
                    "'eye-in-hand' (camera on the hand, board in the cell) or 'eye-to-hand' (camera in the "
                    "cell, board on the hand).");
  cls.def_readwrite("method", &HandEyeOptions::method,
                    "'refined' (maximum likelihood) or 'closed-form' (dual quaternions and one SVD alone).");
  const auto sigma = [&cls](const char* name, double HandEyeOptions::* member, const char* doc) {
    cls.def_property(
        name, [member](const HandEyeOptions& o) { return known(o.*member); },
        [member](HandEyeOptions& o, std::optional<double> v) { o.*member = v.value_or(kEstimate); }, doc);
  };
  sigma("hand_position_sigma", &HandEyeOptions::hand_position_sigma,
        "[m] standard deviation of one component of the reported robot positions; None: estimated.");
  sigma("hand_rotation_sigma", &HandEyeOptions::hand_rotation_sigma, "[rad] likewise.");
  sigma("camera_position_sigma", &HandEyeOptions::camera_position_sigma,
        "[m] of the board's positions, without images; None: estimated.");
  sigma("camera_rotation_sigma", &HandEyeOptions::camera_rotation_sigma, "[rad] likewise.");
  sigma("pixel_sigma", &HandEyeOptions::pixel_sigma, "[px] with images; None: estimated.");
  cls.def_readwrite("refine_camera", &HandEyeOptions::refine_camera,
                    "With images: focal lengths, centre and distortion are found as well.");
  cls.def_readwrite("working_point", &HandEyeOptions::working_point,
                    "shape=(3,) [m] in the camera frame: where accuracy is asked for; None: the mean of the "
                    "board's positions.");
  cls.def_readwrite("known_height", &HandEyeOptions::known_height,
                    "[m] where all rotation axes are parallel: the camera's coordinate along that axis, in "
                    "the frame that carries the camera.");
  cls.def_readwrite("known_height_sigma", &HandEyeOptions::known_height_sigma, "[m]");
  cls.def_readwrite("reject", &HandEyeOptions::reject,
                    "Find poses that do not fit the others, list them, go on without.");
  cls.def_readwrite("reject_beyond", &HandEyeOptions::reject_beyond,
                    "Poses whose root mean square of six standardised residuals is larger.");
  cls.def_readwrite("recognise", &HandEyeOptions::recognise,
                    "Where the loop does not close: try other readings of the same numbers, and name the one "
                    "that closes.");
  cls.def_readwrite("reading", &HandEyeOptions::reading,
                    "Use the poses in this other reading, a name of `handeye_readings`; '': as given.");
  cls.def_readwrite("max_iterations", &HandEyeOptions::max_iterations, "The fit stops here at the latest.");
  cls.def("__repr__", [](const HandEyeOptions& o) {
    return std::string("HandEyeOptions(") + word(o.setup) + ", " + word(o.method) + ")";
  });
  define_value(cls, {"setup", "method", "hand_position_sigma", "hand_rotation_sigma", "camera_position_sigma",
                     "camera_rotation_sigma", "pixel_sigma", "refine_camera", "working_point", "known_height",
                     "known_height_sigma", "reject", "reject_beyond", "recognise", "reading", "max_iterations"});
}

// ---- Results

void bind_parts(py::module_& m) {
  py::class_<UncertainFrame> frame(m, "UncertainFrame", "A frame with its uncertainty.");
  frame.def_readonly("T", &UncertainFrame::T, "shape=(4, 4), [m].");
  frame.def_readonly("covariance", &UncertainFrame::covariance,
                     "shape=(6, 6), of x, y, z [m] and the rotation vector about the parent's axes [rad]: small "
                     "changes that move the frame's origin, and turn it about that origin.");
  frame.def_property_readonly(
      "sigma",
      [](const UncertainFrame& f) {
        const Eigen::Matrix<double, 6, 1> sigma = f.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
        return read_only(py::array_t<double>(6, sigma.data()));
      },
      "shape=(6,): standard errors of x, y, z [m] and of the turns about x, y, z [rad].");
  frame.def("__repr__", [](const UncertainFrame& f) {
    const Eigen::Vector3d p = f.T.translation();
    return "UncertainFrame(at " + text(p.x()) + " " + text(p.y()) + " " + text(p.z()) + " m)";
  });

  py::class_<HandEyeResidual> residual(m, "HandEyeResidual",
                                       "How far a pose is from closing the loop: seen minus predicted board pose.");
  residual.def_readonly("position", &HandEyeResidual::position, "[m] length.");
  residual.def_readonly("rotation", &HandEyeResidual::rotation, "[rad] angle.");
  residual.def_readonly("position_left_out", &HandEyeResidual::position_left_out,
                        "[m] when the pose is left out of the fit (held-out poses: the same as `position`).");
  residual.def_readonly("rotation_left_out", &HandEyeResidual::rotation_left_out, "[rad] likewise.");
  residual.def_readonly("pixels", &HandEyeResidual::pixels,
                        "[px] rms with the robot pose as reported; NaN without images.");
  residual.def_readonly("pixels_corrected", &HandEyeResidual::pixels_corrected,
                        "[px] rms with the robot pose as found; NaN without images.");
  residual.def_readonly("distance", &HandEyeResidual::distance,
                        "Root mean square of its six standardised residuals; about 1.");
  residual.def_readonly("rejected", &HandEyeResidual::rejected, "Left out of the fit.");
  residual.def_readonly("cause", &HandEyeResidual::cause, "Of a rejected pose: what it looks like.");
  residual.def("__repr__", [](const HandEyeResidual& r) {
    return "HandEyeResidual(" + millimetres(r.position) + ", " + milliradians(r.rotation) +
           (r.rejected ? ", rejected: " + r.cause : "") + ")";
  });

  py::class_<HandEyeErrors> errors(m, "HandEyeErrors", "Closure of the loop over a set of poses.");
  errors.def_readonly("position_rms", &HandEyeErrors::position_rms, "[m]");
  errors.def_readonly("position_mean", &HandEyeErrors::position_mean, "[m]");
  errors.def_readonly("position_p95", &HandEyeErrors::position_p95, "[m] 95th percentile.");
  errors.def_readonly("position_max", &HandEyeErrors::position_max, "[m]");
  errors.def_readonly("rotation_rms", &HandEyeErrors::rotation_rms, "[rad]");
  errors.def_readonly("pixel_rms", &HandEyeErrors::pixel_rms, "[px] NaN without images.");
  errors.def_readonly("n", &HandEyeErrors::n, "Number of poses.");
  errors.def("__repr__", [](const HandEyeErrors& e) {
    return "HandEyeErrors(rms " + millimetres(e.position_rms) + ", " + milliradians(e.rotation_rms) +
           ", n=" + std::to_string(e.n) + ")";
  });

  py::class_<Unobservable> unobservable(m, "Unobservable", "What the motions cannot show.");
  unobservable.def_readonly("what", &Unobservable::what, "In words: \"the camera's position along base z\".");
  unobservable.def_readonly("direction", &Unobservable::direction,
                            "shape=(3,): unit vector in the frame that carries the camera.");
  unobservable.def_readonly("rotation", &Unobservable::rotation, "About the direction, not along it.");
  unobservable.def_readonly("sigma", &Unobservable::sigma, "[m] or [rad]; infinite: not at all.");
  unobservable.def_readonly("advice", &Unobservable::advice, "What to do.");
  unobservable.def("__repr__", [](const Unobservable& u) { return "Unobservable(" + u.what + ": " + u.advice + ")"; });

  py::class_<Reading> reading(m, "Reading",
                              "Another reading of the numbers: what it would mean, and how well the loop "
                              "then closes.");
  reading.def_readonly("name", &Reading::name, "To be given as `reading`.");
  reading.def_readonly("explanation", &Reading::explanation, "In words.");
  reading.def_readonly("position_rms", &Reading::position_rms, "[m] median closure.");
  reading.def_readonly("rotation_rms", &Reading::rotation_rms, "[rad]");
  reading.def("__repr__", [](const Reading& r) { return "Reading('" + r.name + "': " + r.explanation + ")"; });

  py::class_<HandEyeNoise> noise(m, "HandEyeNoise",
                                 "Standard deviations of one component, as given or as found. Position noise of hand "
                                 "and board poses adds up: data see the sum alone.");
  noise.def_readonly("position", &HandEyeNoise::position,
                     "[m] of hand and board pose together; with images of the hand alone.");
  noise.def_readonly("hand_rotation", &HandEyeNoise::hand_rotation, "[rad]");
  noise.def_readonly("camera_rotation", &HandEyeNoise::camera_rotation,
                     "[rad] of board poses; with images what is beyond their pixels' noise.");
  noise.def_readonly("pixel", &HandEyeNoise::pixel, "[px] NaN without images.");
  noise.def_readonly("estimated", &HandEyeNoise::estimated, "Any of them was found from the data.");
  noise.def("__repr__", [](const HandEyeNoise& n) {
    return "HandEyeNoise(" + millimetres(n.position) + ", hand " + milliradians(n.hand_rotation) +
           (std::isnan(n.pixel) ? ", camera " + milliradians(n.camera_rotation) : ", " + text(n.pixel) + " px") + ")";
  });

  py::class_<ClosedForm> closed(m, "ClosedForm", "The dual-quaternion solution alone, in its parts.");
  closed.def_readonly("T_parent_camera", &ClosedForm::T_parent_camera,
                      "shape=(4, 4): in the hand (eye in hand) or in the base.");
  closed.def_readonly("T_parent_board", &ClosedForm::T_parent_board,
                      "shape=(4, 4): in the base (eye in hand) or in the hand.");
  closed.def_readonly("singular_values", &ClosedForm::singular_values,
                      "shape=(8,), descending; of exact data the last two are 0.");
  closed.def_readonly("length_scale", &ClosedForm::length_scale, "[m] the unit of length in the equations.");
  closed.def_readonly("residual", &ClosedForm::residual, "Of the unit dual quaternion in the equations, per motion.");
  closed.def_readonly("axes_spread", &ClosedForm::axes_spread,
                      "Second over first principal rotation of the motions: 0 one axis, 1 two alike.");
  closed.def_readonly("rotation", &ClosedForm::rotation, "[rad] rms angle of the motions.");
  closed.def_readonly("motions", &ClosedForm::motions, "How many were used.");
  closed.def("__repr__", [](const ClosedForm& c) { return "ClosedForm(" + std::to_string(c.motions) + " motions)"; });

  py::class_<NextHandPose> next(m, "NextHandPose", "A robot pose that would help.");
  next.def_readonly("T_base_hand", &NextHandPose::T_base_hand, "shape=(4, 4)");
  next.def_readonly("T_camera_board", &NextHandPose::T_camera_board,
                    "shape=(4, 4): what the camera is expected to see.");
  next.def_readonly(
      "working_point_sigma", &NextHandPose::working_point_sigma,
      "[m] standard error of the working point per axis (rms over three), with this pose and those before "
      "it measured.");
  next.def("__repr__", [](const NextHandPose& p) {
    return "NextHandPose(working point to " + millimetres(p.working_point_sigma) + ")";
  });

  py::class_<ClockOffset> clock(m, "ClockOffset", "Two records of the same motion by two clocks.");
  clock.def_readonly("offset", &ClockOffset::offset, "[s] t_hand = t_camera + offset");
  clock.def_readonly("sigma", &ClockOffset::sigma, "[s]");
  clock.def_readonly("correlation", &ClockOffset::correlation, "Of the two angular speeds at that offset.");
  clock.def_readonly("found", &ClockOffset::found, "False: `message` says why.");
  clock.def_readonly("message", &ClockOffset::message, "Why not, or how sure.");
  clock.def_property_readonly(
      "rows", [](const ClockOffset& c) { return tuple_of(c.rows); },
      "Camera rows (counted from 0) inside the hand's record.");
  clock.def_property_readonly(
      "T_base_hand", [](const ClockOffset& c) { return array_from(c.T_base_hand); },
      "shape=(rows, 4, 4): hand poses at the times of those rows.");
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
  py::class_<HandEyeResult> cls(m, "HandEyeResult", "What `handeye` found.");
  cls.def_readonly("status", &HandEyeResult::status,
                   "'done'; 'not observable' (`unobservable` says which directions, and what to do); 'not closing' "
                   "(`readings` has the reading that closes, if any); 'not converged'.");
  cls.def_readonly("message", &HandEyeResult::message, "One sentence.");
  cls.def_property_readonly(
      "warnings", [](const HandEyeResult& r) { return tuple_of(r.warnings); },
      "What to know or do: a board of another size, a robot that is off, noise told too small ...");
  cls.def_readonly("camera", &HandEyeResult::camera,
                   "In the hand (eye in hand) or in the base. Only with status 'done' or 'not converged'.");
  cls.def_readonly("board", &HandEyeResult::board, "In the base (eye in hand) or in the hand.");
  cls.def_readonly("working_point", &HandEyeResult::working_point, "shape=(3,) [m] in the camera frame.");
  cls.def_readonly("working_point_covariance", &HandEyeResult::working_point_covariance,
                   "shape=(3, 3) [m^2] of that point in the frame that carries the camera.");
  cls.def_readonly("noise", &HandEyeResult::noise, "Given or found.");
  cls.def_property_readonly("residuals", [](const HandEyeResult& r) { return tuple_of(r.residuals); }, "One per pose.");
  cls.def_readonly("train", &HandEyeResult::train, "Poses fitted, without rejected ones.");
  cls.def_readonly("left_out", &HandEyeResult::left_out, "The same, each predicted without itself.");
  cls.def_property_readonly(
      "test", [](const HandEyeResult& r) { return r.test; }, "Held-out poses, all of them; or None.");
  cls.def_property_readonly(
      "rejected", [](const HandEyeResult& r) { return tuple_of(r.rejected); },
      "Poses (counted from 0) that do not fit the others.");
  cls.def_property_readonly(
      "unobservable", [](const HandEyeResult& r) { return tuple_of(r.unobservable); }, "What the motions cannot show.");
  cls.def_readonly("singular_values", &HandEyeResult::singular_values,
                   "shape=(8,), of the motions' equations, descending.");
  cls.def_readonly("singular_gap", &HandEyeResult::singular_gap,
                   "Sixth over seventh: how clearly two null vectors stand out.");
  cls.def_readonly("axes_spread", &HandEyeResult::axes_spread,
                   "Second over first principal rotation of the motions: 0 one axis, 1 two alike.");
  cls.def_readonly("board_scale", &HandEyeResult::board_scale,
                   "Factor on the board's lengths that would fit best; 1: as given.");
  cls.def_readonly("board_scale_sigma", &HandEyeResult::board_scale_sigma, "Of it; NaN: not known.");
  cls.def_property_readonly(
      "readings", [](const HandEyeResult& r) { return tuple_of(r.readings); },
      "Other readings that close, best first; 'not closing' only.");
  cls.def_property_readonly(
      "symmetry", [](const HandEyeResult& r) { return tuple_of(r.symmetry); },
      "Per pose: which of board_symmetries (1 ...) it was read in; 0 as given.");
  cls.def_property_readonly(
      "camera_model", [](const HandEyeResult& r) { return r.camera_model; }, "As refined; or None.");
  cls.def_property_readonly(
      "camera_model_sigma", [](const HandEyeResult& r) { return tuple_of(r.camera_model_sigma); },
      "Standard errors of fx fy cx cy [px] k1 k2 p1 p2 k3.");
  cls.def_property_readonly(
      "T_base_hand", [](const HandEyeResult& r) { return array_from(r.T_base_hand); },
      "shape=(n, 4, 4): robot poses as found, of fitted poses; as reported elsewhere.");
  cls.def_readonly("solver", &HandEyeResult::solver, "How the solver ended.");
  cls.def("summary", &summary, "A few lines for people.");
  cls.def("__repr__", [](const HandEyeResult& r) {
    return std::string("HandEyeResult('") + word(r.status) + "': " + r.message + ")";
  });

  py::class_<HandEyeKinematics> both(m, "HandEyeKinematics", "What `handeye_with_kinematics` found.");
  both.def_readonly(
      "identification", &HandEyeKinematics::identification,
      "Of the robot whose tool is the camera (eye in hand) or the board, measured in the frame of the other.");
  both.def_readonly(
      "robot", &HandEyeKinematics::robot,
      "Calibrated, its tool the flange as given, its base the origin. Part of this result: copy() it before "
      "changing it.");
  both.def_readonly("camera", &HandEyeKinematics::camera, "As in HandEyeResult, of the calibrated robot.");
  both.def_readonly("board", &HandEyeKinematics::board, "As in HandEyeResult, of the calibrated robot.");
  both.def_readonly("working_point", &HandEyeKinematics::working_point, "shape=(3,) [m] in the camera frame.");
  both.def_readonly("working_point_covariance", &HandEyeKinematics::working_point_covariance,
                    "shape=(3, 3) [m^2] of that point in the frame that carries the camera.");
  both.def_readonly("train_before", &HandEyeKinematics::train_before,
                    "Closure with the robot as it was, base and tool fitted.");
  both.def_readonly("train_after", &HandEyeKinematics::train_after, "Closure with the calibrated robot.");
  both.def_property_readonly(
      "test_before", [](const HandEyeKinematics& k) { return k.test_before; }, "Held-out poses, or None.");
  both.def_property_readonly(
      "test_after", [](const HandEyeKinematics& k) { return k.test_after; }, "Held-out poses, or None.");
  both.def_property_readonly(
      "residuals", [](const HandEyeKinematics& k) { return tuple_of(k.residuals); },
      "One per pose, with the calibrated robot.");
  both.def("__repr__", [](const HandEyeKinematics& k) {
    return "HandEyeKinematics(closure rms " + millimetres(k.train_before.position_rms) + " -> " +
           millimetres(k.train_after.position_rms) + ")";
  });
}

}  // namespace

void bind_handeye(py::module_& m) {
  bind_camera(m);
  bind_poses(m);
  bind_options(m);
  bind_parts(m);
  bind_result(m);

  m.def(
      "project",
      [](const Camera& camera, const ArrayLike& points) {
        const Eigen::Matrix3Xd in = columns_from<3>(points, "points");
        Eigen::Matrix2Xd out(2, in.cols());
        for (Eigen::Index k = 0; k < in.cols(); ++k) out.col(k) = project(camera, in.col(k));
        return array_from_columns(out);
      },
      py::arg("camera"), py::arg("points"),
      R"(Pixels, shape=(m, 2), of points in the camera frame, shape=(m, 3) [m]; z looks out of the lens, x right, y down.)");
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
  m.def(
      "handeye_plan",
      [](const HandEyePoses& poses, const HandEyeResult& result, const std::optional<HandEyeOptions>& given, int count,
         int candidates, double tilt, double reach, std::uint64_t seed) {
        const HandEyeOptions options = given.value_or(HandEyeOptions{});
        HandEyePlanOptions plan;
        plan.poses = count;
        plan.candidates = candidates;
        plan.tilt = tilt;
        plan.reach = reach;
        plan.seed = seed;
        std::vector<NextHandPose> next;
        {
          const py::gil_scoped_release unlocked;
          next = handeye_plan(poses, result, options, plan);
        }
        return tuple_of(next);
      },
      py::arg("poses"), py::arg("result"), py::arg("options") = py::none(), py::kw_only(),
      py::arg("count") = HandEyePlanOptions{}.poses, py::arg("candidates") = HandEyePlanOptions{}.candidates,
      py::arg("tilt") = HandEyePlanOptions{}.tilt, py::arg("reach") = HandEyePlanOptions{}.reach,
      py::arg("seed") = HandEyePlanOptions{}.seed,
      R"(Robot poses, one after the other, that shrink the covariance of the working point most.

count: how many. candidates: tried for each. tilt: [rad] the board is seen at no more than this from its normal, beyond what
was seen. reach: [m] hands stay this close to a measured one. Raises InputError.)");
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
        const Array array = Array::ensure(joints);
        if (!array || array.ndim() != 2) {
          PyErr_Clear();
          throw std::invalid_argument("joints must have shape (n, driven joints)");
        }
        const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> readings =
            Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
                array.data(), array.shape(0), array.shape(1));
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

}  // namespace truing::python
