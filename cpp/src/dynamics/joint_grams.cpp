// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/joint_grams.hpp"

#include <algorithm>
#include <memory>
#include <mutex>

#include "kernel/kernel.hpp"
#include "math/batch.hpp"

namespace truing::dynamics {
namespace {

// Rows of a tile: longer columns gain the Gram nothing, and would not stay in the cache.
constexpr Eigen::Index kTile = 256;

/// Clearing pages for new tiles costs as much as filling them: who needs some takes those that others are done with.
template <class T>
class Pool {
 public:
  template <class Make>
  std::unique_ptr<T> take(Make make) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<T> out = std::move(idle_.back());
        idle_.pop_back();
        return out;
      }
    }
    return make();
  }
  void give(std::unique_ptr<T> one) {
    const std::lock_guard<std::mutex> lock(mutex_);
    idle_.push_back(std::move(one));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> idle_;
};

/// Tiles of all joints, and their sums.
class JointSums {
 public:
  JointSums(const RigidChain& chain, const std::vector<Eigen::Index>& further)
      : chain_(chain), blocks_(static_cast<std::size_t>(chain.driven() * chain.links()), nullptr) {
    for (Eigen::Index k = 0; k < chain.driven(); ++k) {
      const std::vector<Eigen::Index>& felt = chain.felt_links(k);
      const Eigen::Index inertial = kLinkParameters * static_cast<Eigen::Index>(felt.size());
      rows_.emplace_back(kTile, inertial + further[static_cast<std::size_t>(k)] + 1);
      sums_.emplace_back(kernel::functions().gram_size(static_cast<int>(rows_.back().cols())), 0.0);
      for (std::size_t i = 0; i < felt.size(); ++i)
        blocks_[static_cast<std::size_t>(k * chain.links() + felt[i])] =
            rows_.back().col(kLinkParameters * static_cast<Eigen::Index>(i)).data();
    }
  }

  void add(const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd, const Eigen::MatrixXd& qdd, Eigen::Index begin,
           Eigen::Index end, const CompleteRows& complete) {
    const Eigen::Index rows = end - begin, all = RigidChain::padded(rows);
    chain_.regressors(q, qd, qdd, begin, end, blocks_.data(), kTile);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      Eigen::MatrixXd& tile = rows_[k];
      complete(static_cast<Eigen::Index>(k), begin,
               JointRows(tile.data(), rows, tile.cols(), Eigen::OuterStride<>(kTile)));
      tile.middleRows(rows, all - rows).setZero();
      kernel::functions().gram_add(tile.data(), kTile, static_cast<int>(tile.cols()), 0, static_cast<int>(all),
                                   sums_[k].data());
    }
    n_ += static_cast<double>(rows);
  }

  /// The sums so far; what comes then begins others.
  std::vector<estimation::Gram> finish() {
    std::vector<estimation::Gram> out;
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const Eigen::Index columns = rows_[k].cols(), x = columns - 1;
      Eigen::MatrixXd all = Eigen::MatrixXd::Zero(columns, columns);
      kernel::functions().gram_reduce(sums_[k].data(), static_cast<int>(columns), 0, all.data());
      estimation::Gram gram;
      gram.xx = all.topLeftCorner(x, x).selfadjointView<Eigen::Upper>();
      gram.xy = all.col(x).head(x);
      gram.yy = all(x, x);
      gram.n = n_;
      out.push_back(std::move(gram));
    }
    n_ = 0.0;
    return out;
  }

 private:
  const RigidChain& chain_;
  std::vector<Eigen::MatrixXd> rows_;  ///< of every joint, shape (kTile, columns + 1)
  std::vector<double*> blocks_;
  std::vector<std::vector<double>> sums_;  ///< the kernel's own
  double n_ = 0.0;
};

}  // namespace

std::vector<estimation::Gram> joint_grams(const RigidChain& chain, const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd,
                                          const Eigen::MatrixXd& qdd, const std::vector<Eigen::Index>& further,
                                          const CompleteRows& complete, int threads) {
  // So many sums whatever the number of threads, added in order. A thread takes the parts of one after the other.
  constexpr Eigen::Index kMostSlots = 8, kPartsOfSlot = kBatchChunk;
  const Eigen::Index tiles = (q.rows() + kTile - 1) / kTile;
  const Eigen::Index slots = std::clamp<Eigen::Index>(tiles / 4, 1, kMostSlots);
  Pool<JointSums> pool;
  std::vector<std::unique_ptr<JointSums>> sums(static_cast<std::size_t>(slots));
  std::vector<std::vector<estimation::Gram>> grams(static_cast<std::size_t>(slots));
  for_each_on_threads(static_cast<std::size_t>(slots * kPartsOfSlot), threads, {}, [&](std::size_t at) {
    const std::size_t slot = at / kPartsOfSlot, part = at % kPartsOfSlot;
    if (part == 0) sums[slot] = pool.take([&] { return std::make_unique<JointSums>(chain, further); });
    const auto edge = [&](std::size_t k) { return static_cast<Eigen::Index>(k) * tiles / (slots * kPartsOfSlot); };
    for (Eigen::Index tile = edge(at); tile < edge(at + 1); ++tile)
      sums[slot]->add(q, qd, qdd, tile * kTile, std::min((tile + 1) * kTile, q.rows()), complete);
    if (part + 1 < kPartsOfSlot) return;
    grams[slot] = sums[slot]->finish();
    pool.give(std::move(sums[slot]));
  });
  std::vector<estimation::Gram> out = std::move(grams[0]);
  for (std::size_t slot = 1; slot < grams.size(); ++slot) {
    for (std::size_t k = 0; k < out.size(); ++k) out[k].add(grams[slot][k]);
  }
  return out;
}

}  // namespace truing::dynamics
