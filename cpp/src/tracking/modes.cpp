// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Frequencies of the sway from a recording.

#include <algorithm>
#include <cmath>
#include <complex>
#include <stdexcept>

#include "math/constants.hpp"
#include "math/gauss_newton.hpp"
#include "math/linear_algebra.hpp"
#include "math/text.hpp"
#include "rooms.hpp"
#include "tracking/deviation.hpp"

namespace truing {
using namespace tracking;

namespace {
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kLowest = 0.3, kHighest = 12.0;  // frequencies that are looked for [Hz]
constexpr int kInputs = 3 * ModalModel::kMost;    // a mode and an axis of the plan's acceleration each
constexpr int kColumns = 6 + kInputs;
constexpr int kEvery = 3;  // of the rows, one is predicted from
// A gain is the fraction of the tip's acceleration that a mode feels: of the order of one. Slow motion does not tell
// modes apart, and without this prior their gains would be huge and cancel each other, at these frequencies only.
constexpr double kGain = 0.5, kPredictionNoise = 2e-3;  // standard deviations [-], [m]

struct Mode {
  double frequency, damping;
};

bool follows(const std::vector<DeviationRow>& rows, std::size_t k, double period) {
  return std::abs(rows[k + 1].t - rows[k].t - period) < 0.1 * period;
}

// ---- A start: eigensystem realisation -------------------------------------------------------------------------------

/// Poles of the autocovariance of the acceleration: for a structure that is shaken at random it decays as the structure
/// does (James, Carne and Lauffer 1993); its Hankel matrices have the poles as in Juang and Pappa 1985, eqs. (12)-(20).
std::vector<Mode> realise(const std::vector<DeviationRow>& rows, double period, int most) {
  const auto every = std::max<std::size_t>(1, static_cast<std::size_t>(std::llround(0.02 / period)));
  const double step = static_cast<double>(every) * period;
  const int blocks = 45;
  std::vector<Vector3d> y;  // acceleration, NaN across gaps
  for (std::size_t k = 0; k + 2 * every < rows.size(); k += every) {
    const bool whole = std::abs(rows[k + 2 * every].t - rows[k].t - 2.0 * step) < 0.1 * period;
    y.push_back(whole ? Vector3d((rows[k + 2 * every].rate - rows[k].rate).head<3>() / (2.0 * step))
                      : Vector3d::Constant(std::nan("")));
  }
  std::vector<Matrix3d> covariance(static_cast<std::size_t>(2 * blocks + 1), Matrix3d::Zero());
  for (std::size_t lag = 0; lag < covariance.size(); ++lag) {
    for (std::size_t k = 0; k + lag < y.size(); ++k) {
      const Matrix3d product = y[k + lag] * y[k].transpose();
      if (product.allFinite()) covariance[lag] += product;
    }
  }
  MatrixXd H0(3 * blocks, 3 * blocks), H1(3 * blocks, 3 * blocks);
  for (int i = 0; i < blocks; ++i) {
    for (int j = 0; j < blocks; ++j) {
      H0.block<3, 3>(3 * i, 3 * j) = covariance[static_cast<std::size_t>(i + j + 1)];
      H1.block<3, 3>(3 * i, 3 * j) = covariance[static_cast<std::size_t>(std::min(i + j + 2, 2 * blocks))];
    }
  }
  const ThinSingularValues svd = thin_singular_values(H0);
  const int order = 2 * most + 4;
  const VectorXd root = svd.values.head(order).cwiseSqrt().cwiseInverse();
  const MatrixXd A =
      root.asDiagonal() * svd.U.leftCols(order).transpose() * H1 * svd.V.leftCols(order) * root.asDiagonal();
  std::vector<Mode> out;
  const Eigen::VectorXcd poles = eigenvalues(A);
  for (Eigen::Index k = 0; k < poles.size(); ++k) {
    if (poles[k].imag() <= 0.0) continue;
    const std::complex<double> s = std::log(poles[k]) / step;
    const double frequency = std::abs(s) / kTwoPi, damping = -s.real() / std::abs(s);
    if (frequency > kLowest && frequency < kHighest && damping < 0.3)
      out.push_back({frequency, std::clamp(damping, 0.005, 0.1)});
  }
  return out;
}

// ---- Errors of predictions ------------------------------------------------------------------------------------------

struct ModeFit {
  double cost = 0.0;   // mean square of position errors [m^2]
  VectorXd residuals;  // position only
  std::array<Eigen::Matrix<double, 6, 3>, ModalModel::kMost> gain;
};

/// Runs the model's filter over the rows with these modes. A state is linear in what was observed and in the gains, so
/// it is carried in columns: six for the observations without any gain, and one for a unit gain of every mode and axis;
/// the best gains are then linear least squares.
ModeFit evaluate(const std::vector<DeviationRow>& rows, const std::vector<Mode>& modes,
                 const DeviationOptions& options) {
  const int count = static_cast<int>(modes.size()), inputs = 3 * count;
  ModalModel model;
  model.count = count;
  for (std::size_t k = 0; k < modes.size(); ++k) {
    model.frequency[k] = modes[k].frequency;
    model.damping[k] = modes[k].damping;
  }
  ModalFilter filter(model);
  ModalSteps steps;
  filter.steps(options.period, &steps);
  const auto ahead = static_cast<std::size_t>(std::llround(2.0 * options.horizon / options.period));
  using Forces = Eigen::Matrix<double, kParts, kColumns>;
  const auto forces_of = [&](const DeviationRow& row) {
    Forces forces = Forces::Zero();
    for (int k = 0; k < count; ++k) forces.block<1, 3>(k + 1, 6 + 3 * k) = row.plan_acceleration.transpose();
    return forces;
  };
  Eigen::Matrix<double, kInputs, kInputs> gram = Eigen::Matrix<double, kInputs, kInputs>::Zero();
  Eigen::Matrix<double, kInputs, 6> right = Eigen::Matrix<double, kInputs, 6>::Zero();
  std::vector<Eigen::Matrix<double, 1, kColumns>> errors;
  std::size_t since = 0;  // rows since the last gap
  ModalState<kColumns> X;
  for (std::size_t i = 0; i + ahead < rows.size(); ++i) {
    if (i == 0 || !follows(rows, i - 1, options.period)) {
      filter = ModalFilter(model);
      X.setZero(filter.states(), kColumns);
      X.row(0).head<6>() = rows[i].deviation.transpose();
      since = 0;
    } else {
      step_state<kColumns>(steps, filter.parts, forces_of(rows[i - 1]), &X);
      filter.predict_covariance(steps, options.period, options);
    }
    for (int first = 0; first < 2; ++first) {
      ModalVector gain;
      filter.observe(first,
                     first == 0 ? options.position_noise * options.position_noise
                                : options.velocity_noise * options.velocity_noise,
                     &gain);
      Eigen::Matrix<double, 1, kColumns> observed = Eigen::Matrix<double, 1, kColumns>::Zero();
      observed.head<6>() = (first == 0 ? rows[i].deviation : rows[i].rate).transpose();
      X += gain * (observed - sum_of<kColumns>(X, first));
    }
    if (++since < 100 || i % kEvery != 0 ||
        std::abs(rows[i + ahead].t - rows[i].t - static_cast<double>(ahead) * options.period) > 0.1 * options.period)
      continue;

    ModalState<kColumns> Y = X;
    for (std::size_t n = 0; n < ahead; ++n) step_state<kColumns>(steps, filter.parts, forces_of(rows[i + n]), &Y);
    const double h = static_cast<double>(ahead) *
                     options.period;  // the deviation and its rate are the observed ones, the model adds the rest
    Eigen::Matrix<double, 1, kColumns> error =
        displacement_of<kColumns>(X) + h * speed_of<kColumns>(X) - displacement_of<kColumns>(Y);
    error.head<6>() += (rows[i + ahead].deviation - rows[i].deviation - h * rows[i].rate).transpose();
    errors.push_back(error);
    gram += error.tail<kInputs>().transpose() * error.tail<kInputs>();
    right -= error.tail<kInputs>().transpose() * error.head<6>();
  }
  ModeFit fit;
  MatrixXd solution = MatrixXd::Zero(kInputs, 6);
  if (inputs > 0) {
    MatrixXd A = gram.topLeftCorner(inputs, inputs);
    A.diagonal().array() += kPredictionNoise * kPredictionNoise / (kGain * kGain);
    solution.topRows(inputs) = solve_symmetric<Eigen::Dynamic, Eigen::Dynamic>(A, right.topRows(inputs));
  }
  fit.residuals.resize(static_cast<Eigen::Index>(3 * errors.size()));
  for (std::size_t n = 0; n < errors.size(); ++n) {
    fit.residuals.segment<3>(static_cast<Eigen::Index>(3 * n)) =
        (errors[n].head<6>() + errors[n].tail<kInputs>() * solution).head<3>().transpose();
  }
  fit.cost = errors.empty() ? 0.0 : fit.residuals.squaredNorm() / static_cast<double>(errors.size());
  for (std::size_t k = 0; k < static_cast<std::size_t>(ModalModel::kMost); ++k)
    fit.gain[k] = solution.middleRows<3>(static_cast<Eigen::Index>(3 * k)).transpose();
  return fit;
}

Mode moved(const Mode& mode, double log_frequency, double log_damping) {
  return {std::clamp(mode.frequency * std::exp(log_frequency), 0.5 * kLowest, 1.5 * kHighest),
          std::clamp(mode.damping * std::exp(log_damping), 1e-3, 0.5)};
}

/// Logarithms of frequencies and dampings, differences for derivatives.
struct ModesProblem {
  const std::vector<DeviationRow>& rows;
  const DeviationOptions& options;
  std::vector<Mode> modes, tried;
  ModeFit fit, next;
  NormalSystem<> normal;

  /// Modes moved by a step of (logarithm of frequency, of damping) each.
  std::vector<Mode> moved_by(const VectorXd& step) const {
    std::vector<Mode> out = modes;
    for (std::size_t k = 0; k < out.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(2 * k);
      out[k] = moved(out[k], step[at], step[at + 1]);
    }
    return out;
  }
  const NormalSystem<>& system() {
    const auto n = static_cast<Eigen::Index>(2 * modes.size());
    MatrixXd J(fit.residuals.size(), n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double h = k % 2 == 0 ? 1e-3 : 2e-2;
      J.col(k) = (evaluate(rows, moved_by(h * VectorXd::Unit(n, k)), options).residuals - fit.residuals) / h;
    }
    normal = {J.transpose() * J, J.transpose() * fit.residuals, fit.residuals.squaredNorm()};
    return normal;
  }
  double attempt(VectorXd step) {
    for (Eigen::Index k = 0; k < step.size(); ++k)
      step[k] = std::clamp(step[k], k % 2 == 0 ? -0.1 : -0.7, k % 2 == 0 ? 0.1 : 0.7);
    tried = moved_by(step);
    next = evaluate(rows, tried, options);
    return next.residuals.squaredNorm();
  }
  void accept() {
    fit = std::move(next);
    modes = tried;
  }
  void move(const VectorXd& step) {
    attempt(step);
    accept();
  }
};

/// The modes whose predictions err least; `information`: of the logarithms, where the last step began.
ModeFit refine(const std::vector<DeviationRow>& rows, const DeviationOptions& options, int iterations,
               std::vector<Mode>* modes, MatrixXd* information) {
  ModesProblem problem{rows, options, *modes, {}, evaluate(rows, *modes, options), {}, {}};
  LevenbergMarquardtOptions how;
  how.max_linearisations = iterations;
  how.max_failures = 5;
  how.first_damping = 0.0;
  how.small_fall = [](double from, double to) { return 1.0 - to / from < 1e-4; };
  levenberg_marquardt(&problem, how);
  *modes = problem.modes;
  *information = problem.normal.gram;
  return std::move(problem.fit);
}

}  // namespace

ModesResult identify_modes(const std::vector<DeviationRow>& rows, const DeviationOptions& options, int most,
                           double worth) {
  if (rows.size() < 500)
    throw std::invalid_argument("identify_modes: " + std::to_string(rows.size()) + " rows, at least 500 are needed");
  most = std::clamp(most, 0, ModalModel::kMost);
  ModesResult out;
  out.rows = static_cast<double>(rows.size());
  ModeFit fit = evaluate(rows, {}, options);
  out.error = {std::sqrt(fit.cost)};
  std::vector<Mode> candidates = realise(rows, options.period, most), modes;
  MatrixXd information;
  out.stopped_because = "most modes allowed";
  while (static_cast<int>(modes.size()) < most) {
    std::size_t best = candidates.size();
    ModeFit best_fit;
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      if (std::any_of(modes.begin(), modes.end(), [&](const Mode& mode) {
            return std::abs(std::log(mode.frequency / candidates[k].frequency)) < 0.15;
          }))
        continue;
      std::vector<Mode> other = modes;
      other.push_back(candidates[k]);
      ModeFit next = evaluate(rows, other, options);
      if (best == candidates.size() || next.cost < best_fit.cost) {
        best = k;
        best_fit = std::move(next);
      }
    }
    if (best == candidates.size()) {
      out.stopped_because = "no further mode in the recording";
      break;
    }
    std::vector<Mode> other = modes;
    other.push_back(candidates[best]);
    MatrixXd other_information;
    ModeFit next = refine(rows, options, 6, &other, &other_information);
    if (!(std::sqrt(next.cost) < (1.0 - worth) * std::sqrt(fit.cost))) {
      out.stopped_because = "another mode would not be worth it";
      break;
    }
    modes = other;
    fit = std::move(next);
    information = other_information;
    out.error.push_back(std::sqrt(fit.cost));
  }
  if (!modes.empty()) fit = refine(rows, options, 20, &modes, &information);

  out.model.count = static_cast<int>(modes.size());
  std::vector<std::size_t> order(modes.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return modes[a].frequency < modes[b].frequency; });
  // Predictions overlap: neighbouring residuals say the same, `overlap` of them count as one.
  const double overlap = std::max(1.0, 2.0 * options.horizon / options.period / kEvery);
  const double variance = fit.residuals.size() > 0
                              ? fit.residuals.squaredNorm() / static_cast<double>(fit.residuals.size()) * overlap
                              : 0.0;
  MatrixXd covariance = MatrixXd::Zero(information.rows(), information.cols());
  if (!modes.empty()) covariance = variance * inverse_symmetric<Eigen::Dynamic>(information);
  for (std::size_t k = 0; k < modes.size(); ++k) {
    const std::size_t m = order[k];
    out.model.frequency[k] = modes[m].frequency;
    out.model.damping[k] = modes[m].damping;
    out.model.gain[k] = fit.gain[m];
    out.model.frequency_sigma[k] =
        modes[m].frequency *
        std::sqrt(std::max(0.0, covariance(static_cast<Eigen::Index>(2 * m), static_cast<Eigen::Index>(2 * m))));
  }
  return out;
}

}  // namespace truing
