// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Two bodies on one axis, a rotor and the link that it drives, with a play or a spring between them: one step of both.

#include <algorithm>
#include <cmath>

namespace truing::dynamics {

/// One of the two, and what acts on it in a step: a torque, damping that goes with its speed, dry friction that holds.
struct PairedBody {
  double inertia = 0.0, angle = 0.0, speed = 0.0;
  double applied = 0.0, damping = 0.0, friction = 0.0;
};

/// Speed after implicit Coulomb friction (Moreau 1988) that takes `most` of it.
inline double braked(double free, double most) { return std::copysign(std::max(0.0, std::abs(free) - most), free); }

/// Speed after a step by itself.
inline double speed_alone(const PairedBody& b, double h) {
  const double light = 1.0 / (b.inertia + h * b.damping);
  return braked((b.inertia * b.speed + h * b.applied) * light, h * b.friction * light);
}

/// A play of `half` to either side whose stops are hard and do not throw back. While they touch the two are one body,
/// as long as neither would have to pull; between the stops each moves by itself, and where they meet within the step
/// they go on with their common momentum.
class Play {
 public:
  explicit Play(double half = 0.0) : half_(half) {}
  /// side: 1: the rotor is at the stop ahead of the link, -1: at that behind it, 0: somewhere between.
  void begin(double side = 0.0) { side_ = side; }

  void step(double h, PairedBody* rotor, PairedBody* link) {
    if (side_ != 0.0 && together(h, rotor, link)) return;
    const double before = rotor->angle - link->angle;
    rotor->speed = speed_alone(*rotor, h);
    link->speed = speed_alone(*link, h);
    const double closing = h * (rotor->speed - link->speed), after = before + closing;
    side_ = std::abs(after) > half_ ? std::copysign(1.0, after) : 0.0;
    if (side_ == 0.0) {
      rotor->angle += h * rotor->speed;
      link->angle += h * link->speed;
      return;
    }
    const double alone = h * std::clamp((side_ * half_ - before) / closing, 0.0, 1.0);  // until they meet
    const double common =
        (rotor->inertia * rotor->speed + link->inertia * link->speed) / (rotor->inertia + link->inertia);
    link->angle += alone * link->speed + (h - alone) * common;
    touch(common, rotor, link);
  }

 private:
  /// One body, unless the stop would have to pull.
  bool together(double h, PairedBody* rotor, PairedBody* link) const {
    const double inertia = rotor->inertia + link->inertia;
    const double light = 1.0 / (inertia + h * (rotor->damping + link->damping));
    const double momentum = rotor->inertia * rotor->speed + link->inertia * link->speed;
    const double free = (momentum + h * (rotor->applied + link->applied)) * light;
    const double common = braked(free, h * (rotor->friction + link->friction) * light);
    // What the rotor gives the link in this step; friction of a link at its own is not known here, and rotors have it.
    const double given = link->inertia * (common - link->speed) + h * (link->damping * common - link->applied);
    if (given * side_ < 0.0) return false;
    link->angle += h * common;
    touch(common, rotor, link);
    return true;
  }
  void touch(double speed, PairedBody* rotor, PairedBody* link) const {
    rotor->speed = link->speed = speed;
    rotor->angle = link->angle + side_ * half_;
  }

  double half_;
  double side_ = 0.0;  ///< 1: the rotor is ahead and pushes on, -1: it is behind; 0: they do not touch
};

/// What a spring between the two, beyond a play of `half` to either side, gives in a step: linearly implicit in both
/// speeds, and no more implicit in the twist than the step needs to be stable, as that takes energy.
struct SpringStep {
  double pushed = 0.0;   ///< [Nm s] that the link gets and the rotor loses, of the twist where the step begins
  double coupled = 0.0;  ///< [Nm s^2] the same, by the difference of their speeds where it ends

  SpringStep(double h, double half, double stiffness, double rub, const PairedBody& rotor, const PairedBody& link) {
    const double apart = rotor.angle - link.angle, soon = apart + 0.5 * h * (rotor.speed - link.speed);
    if (half > 0.0 && std::abs(soon) <= half) return;  // they do not touch
    const double quick = h * h * stiffness * (1.0 / rotor.inertia + 1.0 / link.inertia);
    const double implicit = std::max(0.0, 0.5 - 1.0 / quick);
    pushed = h * stiffness * (apart - (half == 0.0 ? 0.0 : std::copysign(half, soon)));
    coupled = h * (rub + implicit * h * stiffness);
  }
};

/// A step with it: (J_l + h d_l + c) v - c w = p, (J_r + h d_r + c) w - c v + h F sgn w = s
inline void step_with_spring(double h, double half, double stiffness, double rub, PairedBody* rotor, PairedBody* link) {
  const SpringStep spring(h, half, stiffness, rub, *rotor, *link);
  const double c = spring.coupled, links = 1.0 / (link->inertia + h * link->damping + c);
  const double p = link->inertia * link->speed + h * link->applied + spring.pushed;
  const double s = rotor->inertia * rotor->speed + h * rotor->applied - spring.pushed + c * links * p;
  const double light = 1.0 / (rotor->inertia + h * rotor->damping + c - c * c * links);
  rotor->speed = braked(s * light, h * rotor->friction * light);
  link->speed = (p + c * rotor->speed) * links;
  rotor->angle += h * rotor->speed;
  link->angle += h * link->speed;
}

}  // namespace truing::dynamics
