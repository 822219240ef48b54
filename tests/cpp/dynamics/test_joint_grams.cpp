// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/joint_grams.hpp"

#include <doctest/doctest.h>

#include "support/newton_euler.hpp"

namespace {

using namespace rigid;
using truing::dynamics::joint_grams;
using truing::dynamics::JointRows;
using truing::dynamics::kLinkParameters;
using truing::dynamics::RigidChain;
using truing::estimation::Gram;

constexpr Index kFurther = 3;

struct Tables {
  MatrixXd q, qd, qdd, columns, torque;

  Tables(const RigidChain& chain, Index rows, unsigned seed) {
    std::mt19937_64 random(seed);
    const auto table = [&](Index columns_of) { return random_vector(rows * columns_of, 2.0, &random); };
    q = table(chain.driven()).reshaped(rows, chain.driven());
    qd = table(chain.driven()).reshaped(rows, chain.driven());
    qdd = table(chain.driven()).reshaped(rows, chain.driven());
    columns = table(kFurther).reshaped(rows, kFurther);
    torque = table(chain.driven()).reshaped(rows, chain.driven());
  }

  std::vector<Gram> grams(const RigidChain& chain, int threads) const {
    const std::vector<Index> further(static_cast<std::size_t>(chain.driven()), kFurther);
    return joint_grams(
        chain, q, qd, qdd, further,
        [&](Index k, Index begin, JointRows rows) {
          rows.middleCols(rows.cols() - 1 - kFurther, kFurther) = columns.middleRows(begin, rows.rows());
          rows.col(rows.cols() - 1) = torque.col(k).segment(begin, rows.rows());
          rows *= 0.5;
        },
        threads);
  }
};

/// Row by row, by the plain regressor.
Gram plain(const RigidChain& chain, const Tables& t, Index k) {
  const std::vector<Index>& felt = chain.felt_links(k);
  const Index inertial = kLinkParameters * static_cast<Index>(felt.size());
  MatrixXd X(t.q.rows(), inertial + kFurther), Y(chain.driven(), kLinkParameters * chain.links());
  for (Index row = 0; row < X.rows(); ++row) {
    const VectorXd q = t.q.row(row), qd = t.qd.row(row), qdd = t.qdd.row(row);
    chain.regressor(q.data(), qd.data(), qdd.data(), Y);
    for (std::size_t i = 0; i < felt.size(); ++i)
      X.row(row).segment(kLinkParameters * static_cast<Index>(i), kLinkParameters) =
          Y.row(k).segment(kLinkParameters * felt[i], kLinkParameters);
    X.row(row).tail(kFurther) = t.columns.row(row);
  }
  Gram out;
  out.xx = 0.25 * X.transpose() * X;
  out.xy = 0.25 * X.transpose() * t.torque.col(k);
  out.yy = 0.25 * t.torque.col(k).squaredNorm();
  out.n = static_cast<double>(X.rows());
  return out;
}

}  // namespace

TEST_CASE("Grams of all joints are those of the plain rows, whatever the number of rows") {
  for (const Convention convention : {Convention::dh, Convention::urdf}) {
    const RigidChain chain(linked_arm(convention, 4));
    for (const Index rows : {1, 20, 128, 1100, 5003}) {
      CAPTURE(rows);
      const Tables t(chain, rows, 9);
      const std::vector<Gram> found = t.grams(chain, 1);
      REQUIRE(found.size() == static_cast<std::size_t>(chain.driven()));
      for (Index k = 0; k < chain.driven(); ++k) {
        const Gram expected = plain(chain, t, k);
        const Gram& gram = found[static_cast<std::size_t>(k)];
        CHECK((gram.xx - expected.xx).cwiseAbs().maxCoeff() < 1e-12 * expected.xx.cwiseAbs().maxCoeff());
        CHECK((gram.xy - expected.xy).cwiseAbs().maxCoeff() < 1e-11 * expected.xx.cwiseAbs().maxCoeff());
        CHECK(std::abs(gram.yy - expected.yy) < 1e-12 * expected.yy);
        CHECK(gram.n == expected.n);
      }
    }
  }
}

TEST_CASE("one thread and more give the same bits") {
  const RigidChain chain(linked_arm(Convention::mdh, 4));
  const Tables t(chain, 20011, 10);
  const std::vector<Gram> one = t.grams(chain, 1);
  for (const int threads : {2, 3}) {
    const std::vector<Gram> more = t.grams(chain, threads);
    for (std::size_t k = 0; k < one.size(); ++k) {
      CHECK(more[k].xx == one[k].xx);
      CHECK(more[k].xy == one[k].xy);
      CHECK(more[k].yy == one[k].yy);
    }
  }
}

TEST_CASE("a joint's Gram has the links that it feels, and no others") {
  const RigidChain chain(arms::ur10());
  const std::vector<Gram> grams = Tables(chain, 40, 11).grams(chain, 1);
  for (Index k = 0; k < 6; ++k)
    CHECK(grams[static_cast<std::size_t>(k)].xx.cols() == kLinkParameters * (6 - k) + kFurther);
  // The second and the third move the fourth joint, which is before the fifth: all of them feel the fourth link.
  const RigidChain linked(arms::palletizer());
  CHECK(linked.felt_links(2) == std::vector<Index>{2, 3, 4});
  CHECK(linked.felt_links(3) == std::vector<Index>{4});
}
