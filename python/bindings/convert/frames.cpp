// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "convert/frames.hpp"

#include <Eigen/SVD>

#include "convert/columns.hpp"
#include "convert/text.hpp"

namespace truing::python {

py::array_t<double> read_only(py::array_t<double> array) {
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

py::array_t<double> array_from(const Eigen::Vector3d& v) { return read_only(py::array_t<double>(3, v.data())); }

py::array_t<double> array_from(const Eigen::Matrix<double, 6, 1>& v) {
  return read_only(py::array_t<double>(6, v.data()));
}

py::array_t<double> array_from(const std::vector<double>& values) {
  return read_only(py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data()));
}

void write_frame(const Eigen::Isometry3d& frame, double* out) {
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>{out} = frame.matrix();
}

Eigen::Isometry3d frame_from(const py::array_t<double, py::array::c_style | py::array::forcecast>& matrix) {
  constexpr double accepted = 1e-6;  // [-] what six decimals in a file leave
  // Below this the matrix is taken as it is, so that frames survive a round trip.
  constexpr double rounding = 1e-12;  // [-]
  if (matrix.ndim() != 2 || matrix.shape(0) != 4 || matrix.shape(1) != 4) {
    std::string shape;
    for (py::ssize_t i = 0; i < matrix.ndim(); ++i) shape += (i == 0 ? "" : ", ") + std::to_string(matrix.shape(i));
    throw std::invalid_argument("a frame is a 4x4 matrix; found an array of shape (" + shape + ")");
  }
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> given(matrix.data());
  if (!given.allFinite()) throw std::invalid_argument("a frame must be finite; found NaN or infinity");
  if (given.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw std::invalid_argument("a frame must be rigid; its last row must be 0 0 0 1");
  Eigen::Matrix3d rotation = given.topLeftCorner<3, 3>();
  const double off = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (off > accepted)
    throw std::invalid_argument("a frame must be rigid; its rotation is off orthonormal by " + text(off) +
                                " (at most 1e-6)");
  if (rotation.determinant() < 0)
    throw std::invalid_argument("a frame must be rigid; its rotation is left-handed (determinant -1)");
  if (off > rounding) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
    rotation = svd.matrixU() * svd.matrixV().transpose();
  }
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear() = rotation;
  frame.translation() = given.topRightCorner<3, 1>();
  return frame;
}

std::vector<Eigen::Isometry3d> frames_from(const FrameArray& given, const std::string& name) {
  const Array array = Array::ensure(given);
  if (!array || array.ndim() != 3 || array.shape(1) != 4 || array.shape(2) != 4) {
    PyErr_Clear();
    throw std::invalid_argument(name + " must have shape (n, 4, 4): one frame per pose");
  }
  std::vector<Eigen::Isometry3d> frames;
  frames.reserve(static_cast<std::size_t>(array.shape(0)));
  for (py::ssize_t i = 0; i < array.shape(0); ++i) {
    const Array matrix({4, 4}, array.data(i, 0, 0));
    try {
      frames.push_back(frame_from(matrix));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(name + ", pose " + std::to_string(i) + ": " + error.what());
    }
  }
  return frames;
}

py::array_t<double> array_from(const std::vector<Eigen::Isometry3d>& frames) {
  py::array_t<double> out({frames.size(), std::size_t{4}, std::size_t{4}});
  for (std::size_t i = 0; i < frames.size(); ++i)
    write_frame(frames[i], out.mutable_data(static_cast<py::ssize_t>(i), 0, 0));
  return read_only(std::move(out));
}

}  // namespace truing::python
