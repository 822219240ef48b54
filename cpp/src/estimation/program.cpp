// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "estimation/program.hpp"

#include <algorithm>

#include "model/motion.hpp"

namespace truing::estimation {
namespace {

using kernel::Code;
using kernel::Kind;

int axis_of(Motion motion) { return static_cast<int>(motion) % 3; }

/// Does a free parameter have a column in this segment?
bool is_seen(const ParameterInfo& info, const Segment& segment) {
  switch (info.role) {
    case Role::anchor:
      return segment.kind == Kind::distance;
    case Role::point:
      return info.owner == segment.point;
    case Role::target:
      return info.owner == segment.target && (!info.rotation || segment.kind == Kind::pose);
    default:
      return true;
  }
}

/// Goes down the chain site by site; the current frame's vectors change their slot where a column still wants the old
/// one.
class Compiler {
 public:
  Compiler(const Model& model, const Segment& segment, const std::vector<int>& free, const Eigen::VectorXd& values)
      : model_(model),
        segment_(segment),
        free_(free),
        values_(values),
        moved_by_(model.sites.size()),
        dynamic_(model.sites.size(), false),
        wanted_(model.sites.size(), false),
        is_free_(model.sites.size(), false),
        axis_slot_(model.sites.size(), -1),
        origin_slot_(model.sites.size(), -1) {
    out_.slot_count = 4;
  }

  Program run() {
    find_what_moves();
    find_what_is_wanted();
    for (int s = 0; s < model_.common_sites; ++s) add_site(s);
    for (int s = model_.target_first[segment_.target]; s < model_.target_first[segment_.target + 1]; ++s) add_site(s);
    if (in_prefix_) end_prefix();
    std::copy(current_, current_ + 4, out_.tip_slots);
    add_columns();
    return std::move(out_);
  }

 private:
  /// Sites that differ from pose to pose, and the coordinates that move them.
  void find_what_moves() {
    for (std::size_t k = 0; k < model_.coordinates.size(); ++k) {
      const Coordinate& coordinate = model_.coordinates[k];
      for (const auto& [site, weight] : coordinate.sites) {
        moved_by_[site].push_back({static_cast<int>(k), weight});
        if (coordinate.reading >= 0 || !coordinate.terms.empty()) dynamic_[site] = true;
      }
    }
  }

  /// Sites that free parameters act at, and those among them that have a column here.
  void find_what_is_wanted() {
    for (const int parameter : free_) {
      const ParameterInfo& info = model_.parameters[parameter];
      for (const ColumnTerm& column : info.columns) {
        for (const auto& part : column.sites) {
          is_free_[part.first] = true;
          if (is_seen(info, segment_)) wanted_[part.first] = true;
        }
      }
    }
  }

  int keep(int vector) {
    wanted_as_is_[vector] = true;
    return current_[vector];
  }

  /// Where the vector's new value goes.
  int next_slot(int vector) {
    if (wanted_as_is_[vector]) current_[vector] = out_.slot_count++;
    wanted_as_is_[vector] = false;
    return current_[vector];
  }

  void end_prefix() {
    in_prefix_ = false;
    for (int k = 0; k < 4; ++k) {
      if (!wanted_as_is_[k]) out_.start_slots.push_back(current_[k]);
    }
    out_.prefix.swap(out_.steps);
  }

  /// Axis and origin of a site that has a column stay in their slots.
  void keep_for_column(int index) {
    const Site& site = model_.sites[index];
    axis_slot_[index] = keep(axis_of(site.motion));
    if (is_rotation(site.motion)) origin_slot_[index] = keep(3);
    if (!in_prefix_) return;
    for (const int slot : {axis_slot_[index], origin_slot_[index]}) {
      if (slot >= 0 && std::find(out_.fixed_slots.begin(), out_.fixed_slots.end(), slot) == out_.fixed_slots.end())
        out_.fixed_slots.push_back(slot);
    }
  }

  /// A value that is zero and stays zero moves nothing.
  bool moves_nothing(int index) const {
    const Site& site = model_.sites[index];
    return !dynamic_[index] && !is_free_[index] && site.motion != Motion::fixed &&
           (site.parameter < 0 || values_[site.parameter] == 0.0);
  }

  void add_site(int index) {
    const Site& site = model_.sites[index];
    if (dynamic_[index] && in_prefix_) end_prefix();
    if (wanted_[index]) keep_for_column(index);
    if (moves_nothing(index)) {
      if (site.parameter >= 0) out_.left_out.push_back(site.parameter);
      return;
    }
    kernel::Step step{Code::fixed, -1, static_cast<int>(out_.constants.size()), {0, 0, 0}, {0, 0, 0}};
    if (site.motion == Motion::fixed)
      set_fixed(site, &step);
    else
      set_motion(index, &step);
    out_.steps.push_back(step);
  }

  void set_fixed(const Site& site, kernel::Step* step) {
    for (int k = 0; k < 9; ++k) out_.constants.push_back(site.fixed(k % 3, k / 3));
    for (int k = 0; k < 3; ++k) step->in[k] = current_[k];
    for (int k = 0; k < 3; ++k) step->out[k] = next_slot(k);
  }

  void set_motion(int index, kernel::Step* step) {
    const Site& site = model_.sites[index];
    const bool rotation = is_rotation(site.motion);
    const int axis = axis_of(site.motion);
    if (dynamic_[index]) {
      step->dynamic = static_cast<int>(out_.dynamic.size());
      out_.dynamic.push_back({site.parameter, moved_by_[index]});
    } else {
      out_.sources.push_back({site.parameter, rotation, step->constant});
      out_.constants.resize(out_.constants.size() + (rotation ? 2 : 1));
    }
    if (rotation) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      step->code = Code::rotate;
      step->in[0] = current_[u];
      step->in[1] = current_[v];
      step->out[0] = next_slot(u);
      step->out[1] = next_slot(v);
    } else {
      step->code = Code::translate;
      step->in[0] = current_[3];
      step->in[1] = current_[axis];
      step->out[0] = next_slot(3);
    }
  }

  void add_columns() {
    for (std::size_t f = 0; f < free_.size(); ++f) {
      const ParameterInfo& info = model_.parameters[free_[f]];
      if (!is_seen(info, segment_)) continue;
      if (info.axis >= 0) {  // anchor or fixed point: no sites
        out_.columns.push_back({0, 0, -1, info.axis});
        out_.column_free.push_back(static_cast<int>(f));
      }
      for (const ColumnTerm& column : info.columns) add_column(column, static_cast<int>(f));
    }
  }

  void add_column(const ColumnTerm& column, int free) {
    kernel::ColumnPlan plan{static_cast<int>(out_.parts.size()), 0, -1, -1};
    for (const auto& [site, weight] : column.sites) {
      if (axis_slot_[site] < 0) continue;  // on another target
      out_.parts.push_back({axis_slot_[site], origin_slot_[site], weight});
      ++plan.part_count;
    }
    if (plan.part_count == 0) return;
    if (column.reading >= 0 || column.term >= 0) {
      plan.basis = static_cast<int>(out_.bases.size());
      out_.bases.push_back({column.reading, column.term});
    }
    out_.columns.push_back(plan);
    out_.column_free.push_back(free);
  }

  const Model& model_;
  const Segment& segment_;
  const std::vector<int>& free_;
  const Eigen::VectorXd& values_;
  std::vector<std::vector<SiteWeight>> moved_by_;
  std::vector<bool> dynamic_, wanted_, is_free_;  // by site
  std::vector<int> axis_slot_, origin_slot_;      // by site
  int current_[4] = {0, 1, 2, 3};                 // slots of x y z p
  bool wanted_as_is_[4] = {false, false, false, false};
  bool in_prefix_ = true;
  Program out_;
};

}  // namespace

Program compile(const Model& model, const Segment& segment, const std::vector<int>& free,
                const Eigen::VectorXd& values) {
  return Compiler(model, segment, free, values).run();
}

void sweep_prefix(const Program& program, const std::vector<double>& constants, std::vector<double>* start_vectors,
                  std::vector<double>* fixed_vectors) {
  Eigen::Matrix3Xd slots = Eigen::Matrix3Xd::Zero(3, program.slot_count);
  slots.leftCols<3>().setIdentity();
  for (const kernel::Step& step : program.prefix) {
    const double* constant = constants.data() + step.constant;
    const Eigen::Vector3d a = slots.col(step.in[0]), b = slots.col(step.in[1]), c = slots.col(step.in[2]);
    switch (step.code) {
      case Code::rotate:
        slots.col(step.out[0]) = constant[0] * a + constant[1] * b;
        slots.col(step.out[1]) = constant[0] * b - constant[1] * a;
        break;
      case Code::translate:
        slots.col(step.out[0]) = a + constant[0] * b;
        break;
      case Code::fixed:
        for (int k = 0; k < 3; ++k)
          slots.col(step.out[k]) = constant[3 * k] * a + constant[3 * k + 1] * b + constant[3 * k + 2] * c;
        break;
    }
  }
  const auto collect = [&slots](const std::vector<int>& wanted, std::vector<double>* out) {
    out->clear();
    for (const int slot : wanted) out->insert(out->end(), slots.col(slot).data(), slots.col(slot).data() + 3);
  };
  collect(program.start_slots, start_vectors);
  collect(program.fixed_slots, fixed_vectors);
}

}  // namespace truing::estimation
