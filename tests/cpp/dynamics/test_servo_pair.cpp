// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <doctest/doctest.h>

#include "dynamics/servo_pair.hpp"

using namespace truing::dynamics;

namespace {

double momentum_of(const PairedBody& rotor, const PairedBody& link) {
  return rotor.inertia * rotor.speed + link.inertia * link.speed;
}

/// A motor that turns back and forth, a link that hangs: the link after two seconds, in so many steps.
PairedBody swings_to(double half, double compliance, int steps) {
  PairedBody rotor{0.02, 0.0, 0.0, 0.0, 0.05, 0.03}, link{0.03, 0.0, 0.0, 0.0, 0.0, 0.0};
  Play play(half);
  const double h = 2.0 / steps;
  for (int k = 0; k < steps; ++k) {
    rotor.applied = 6.0 * (0.5 * std::sin(5.0 * k * h) - link.angle) - 0.1 * rotor.speed;
    link.applied = -1.5 * std::sin(link.angle + 0.4);
    if (compliance > 0.0) {
      step_with_spring(h, half, 1.0 / compliance, 0.01, &rotor, &link);
    } else {
      play.step(h, &rotor, &link);
    }
  }
  return link;
}

}  // namespace

TEST_CASE("bodies that meet keep their momentum, and go on as one") {
  PairedBody rotor{0.02, 0.0, 3.0, 0.0, 0.0, 0.0}, link{0.05, 0.0, 0.0, 0.0, 0.0, 0.0};
  const double before = momentum_of(rotor, link);
  Play play(0.01);
  double apart = 0.0;
  for (int k = 0; k < 10; ++k) {
    play.step(0.002, &rotor, &link);
    apart = std::max(apart, std::abs(rotor.angle - link.angle));
  }
  CHECK(momentum_of(rotor, link) == doctest::Approx(before).epsilon(1e-12));
  CHECK(rotor.speed == doctest::Approx(link.speed).epsilon(1e-12));
  CHECK(apart < 0.01 + 1e-12);
  // 3 rad/s for 10 mrad, and what is left of 20 ms together
  CHECK(link.angle == doctest::Approx(before / 0.07 * (0.02 - 0.01 / 3.0)).epsilon(1e-9));
}

TEST_CASE("a stop pushes and does not pull") {
  PairedBody rotor{0.02, 0.0, 0.0, 1.0, 0.0, 0.0}, link{0.05, 0.0, 0.0, 0.0, 0.0, 0.0};
  Play play(0.01);
  for (int k = 0; k < 40; ++k) play.step(0.002, &rotor, &link);
  CHECK(rotor.angle - link.angle == doctest::Approx(0.01));
  rotor.applied = -1.0;
  const double gone = link.speed;
  for (int k = 0; k < 4; ++k) play.step(0.002, &rotor, &link);
  CHECK(link.speed == doctest::Approx(gone));
  CHECK(rotor.speed < link.speed);
}

TEST_CASE("dry friction of the rotor holds both where they touch, and the rotor alone where they do not") {
  // The link falls through the play, takes the rotor along, and friction stops both.
  PairedBody rotor{0.02, 0.0, 0.0, 0.0, 0.0, 0.5}, link{0.05, 0.0, 0.0, 0.3, 0.0, 0.0};
  Play play(0.01);
  for (int k = 0; k < 100; ++k) play.step(0.002, &rotor, &link);
  const double common = 0.05 / 0.07 * std::sqrt(2.0 * 0.3 / 0.05 * 0.01), slowed = (0.5 - 0.3) / 0.07;
  CHECK(rotor.angle == doctest::Approx(0.5 * common * common / slowed).epsilon(0.05));
  CHECK(link.angle - rotor.angle == doctest::Approx(0.01));
  CHECK(link.speed == 0.0);
}

TEST_CASE("a spring of a rotor and a link keeps momentum and, without losses, energy") {
  for (const double h : {0.0005, 0.002}) {
    PairedBody rotor{0.02, 0.05, 0.0, 0.0, 0.0, 0.0}, link{0.05, 0.0, 0.0, 0.0, 0.0, 0.0};
    double most = 0.0;
    for (int k = 0; k < static_cast<int>(1.0 / h); ++k) {
      step_with_spring(h, 0.0, 40.0, 0.0, &rotor, &link);
      if (k * h > 0.8) most = std::max(most, std::abs(rotor.angle - link.angle));
    }
    CHECK(std::abs(momentum_of(rotor, link)) < 1e-12);
    CHECK(most == doctest::Approx(0.05).epsilon(0.06));
  }
}

TEST_CASE("steps of 4 ms end where short ones end") {
  for (const double compliance : {0.0, 0.01, 1e-4})
    for (const double half : {0.0, 0.01}) {
      if (half == 0.0 && compliance == 0.0) continue;
      const double fine = swings_to(half, compliance, 200000).angle;
      CHECK(std::abs(swings_to(half, compliance, 500).angle - fine) < 0.01);
    }
}
