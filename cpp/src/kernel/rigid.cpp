// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Compiled once per instruction set, like kernel.cpp.

#include "rigid.hpp"

#include "lanes.hpp"

namespace truing::kernel::TRUING_KERNEL_NAMESPACE {
namespace {

inline Vec splat_vec(const double* v) { return {splat(v[0]), splat(v[1]), splat(v[2])}; }
inline Vec load_lanes(const double* p) { return {load(p), load(p + kLanes), load(p + 2 * kLanes)}; }
inline void store_lanes(double* p, Vec v) {
  store(p, v.x);
  store(p + kLanes, v.y);
  store(p + 2 * kLanes, v.z);
}

/// Where a frame is and how it moves, in the axes of the base.
struct Moving {
  Vec x, y, z, o;  ///< columns of R, origin
  Vec w, alpha;    ///< angular velocity and acceleration
  Vec a;           ///< acceleration of the origin, less gravity

  Vec turned(Vec v) const { return v.x * x + v.y * y + v.z * z; }             ///< R v
  Vec turned_back(Vec v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }  ///< R^T v
  Vec pull(Vec r) const { return cross(alpha, r) + cross(w, cross(w, r)); }   ///< of a point r further on, more

  /// On to a frame that is fixed to this one.
  void pass(const double* frame) {
    const Vec r = turned(splat_vec(frame + 9));
    a = a + pull(r);
    o = o + r;
    const Vec new_x = turned(splat_vec(frame)), new_y = turned(splat_vec(frame + 3));
    z = turned(splat_vec(frame + 6));
    x = new_x;
    y = new_y;
  }

  /// Luh, Walker and Paul 1980, eq. 1 to 3, seen from the base; what slides takes its origin along.
  void turn(Pack angle, Pack rate, Pack acceleration) {
    alpha = alpha + acceleration * z + rate * cross(w, z);
    w = w + rate * z;
    Pack s, c;
    sine_cosine(angle, &s, &c);
    const Vec old_x = x;
    x = c * x + s * y;
    y = c * y - s * old_x;
  }
  void slide(Pack length, Pack rate, Pack acceleration) {
    const Vec r = length * z;
    a = a + pull(r) + acceleration * z + (rate + rate) * cross(w, z);
    o = o + r;
  }
};

/// Force and moment about the origin that a parameter of one takes, in the axes of the link (Atkeson, An and Hollerbach
/// 1986, eq. 7): of the mass `a`; of the first moment the columns of `S`; of the inertia those of `N`.
struct Load {
  Vec a;
  Vec S[3];  ///< [alpha]x + [w]x [w]x
  Vec N[6];

  explicit Load(const Moving& at) : a(at.turned_back(at.a)) {
    const Vec u = at.turned_back(at.alpha), w = at.turned_back(at.w);
    const Pack xx = w.x * w.x, yy = w.y * w.y, zz = w.z * w.z, xy = w.x * w.y, xz = w.x * w.z, yz = w.y * w.z;
    S[0] = {-(yy + zz), xy + u.z, xz - u.y};
    S[1] = {xy - u.z, -(xx + zz), yz + u.x};
    S[2] = {xz + u.y, yz - u.x, -(xx + yy)};
    N[0] = {u.x, xz, -xy};
    N[1] = {-yz, u.y, xy};
    N[2] = {yz, -xz, u.z};
    N[3] = {u.y - xz, u.x + yz, xx - yy};
    N[4] = {u.z + xy, zz - xx, u.x - yz};
    N[5] = {yy - zz, u.z - xy, u.y + xz};
  }

  /// By virtual work, for a link that moves with v at its origin and turns with n.
  void felt(Vec v, Vec n, double* out, std::ptrdiff_t stride) const {
    const Vec lever = cross(a, n);
    store(out, dot(a, v));
    store(out + stride, dot(S[0], v) + lever.x);
    store(out + 2 * stride, dot(S[1], v) + lever.y);
    store(out + 3 * stride, dot(S[2], v) + lever.z);
    for (int k = 0; k < 6; ++k) store(out + (4 + k) * stride, dot(N[k], n));
  }
};

/// I v of a link's inertia xx yy zz xy xz yz.
inline Vec times_inertia(const double* p, Vec v) {
  return {splat(p[0]) * v.x + splat(p[3]) * v.y + splat(p[4]) * v.z,
          splat(p[3]) * v.x + splat(p[1]) * v.y + splat(p[5]) * v.z,
          splat(p[4]) * v.x + splat(p[5]) * v.y + splat(p[2]) * v.z};
}

/// The turning and, at the base's origin, the velocity that a reading's rate of one gives to what is behind joint i:
/// the joint about z through o, or along z, adds to those before it.
inline void add_twists(const RigidProgram& program, const RigidTile& tile, int i, const Moving& at) {
  const bool revolute = program.links[i].revolute;
  const Vec shift = revolute ? cross(at.o, at.z) : at.z;
  for (int k = 0; k < program.driven_count; ++k) {
    const double by = program.coupling[i * program.driven_count + k];
    if (by == 0.0) continue;
    double* twist = tile.scratch + 6 * kLanes * k;
    if (revolute) store_lanes(twist, load_lanes(twist) + splat(by) * at.z);
    store_lanes(twist + 3 * kLanes, load_lanes(twist + 3 * kLanes) + splat(by) * shift);
  }
}

inline void add_columns(const RigidProgram& program, const RigidTile& tile, int i, int first, const Moving& at) {
  const Load load_of_link(at);
  for (int k = 0; k < program.driven_count; ++k) {
    double* out = tile.blocks[k * program.link_count + i];
    if (!out) continue;
    const double* twist = tile.scratch + 6 * kLanes * k;
    const Vec n = load_lanes(twist), v = load_lanes(twist + 3 * kLanes) + cross(n, at.o);
    load_of_link.felt(at.turned_back(v), at.turned_back(n), out + first, tile.column_stride);
  }
}

/// Newton and Euler (Luh, Walker and Paul 1980, eq. 4 to 6) of a link with mass p[0], first moment and inertia about
/// its origin.
inline void add_torques(const RigidProgram& program, const RigidTile& tile, int i, int first, const Moving& at,
                        const double* p) {
  const Vec moment_of_mass = at.turned(splat_vec(p + 1)), w = at.turned_back(at.w);
  const Vec force = splat(p[0]) * at.a + at.pull(moment_of_mass);
  const Vec turning = times_inertia(p + 4, at.turned_back(at.alpha)) + cross(w, times_inertia(p + 4, w));
  const Vec moment = cross(moment_of_mass, at.a) + at.turned(turning) + cross(at.o, force);  // about the base's origin
  for (int k = 0; k < program.driven_count; ++k) {
    const double* twist = tile.scratch + 6 * kLanes * k;
    double* out = tile.blocks[0] + k * tile.column_stride + first;
    store(out,
          (i > 0 ? load(out) : Pack{}) + dot(load_lanes(twist), moment) + dot(load_lanes(twist + 3 * kLanes), force));
  }
}

/// Calls out(i, first, at) for every link behind its joint, a few samples at a time.
template <typename Out>
inline void sweep(const RigidProgram& program, const RigidTile& tile, Out out) {
  const Pack zero{}, one = splat(1.0);
  const Vec nothing{zero, zero, zero};
  for (int first = 0; first < tile.samples; first += kLanes) {
    Moving at{{one, zero, zero}, {zero, one, zero}, {zero, zero, one}, nothing, nothing, nothing, nothing};
    at.a = nothing - splat_vec(program.gravity);
    for (int k = 0; k < 2 * program.driven_count; ++k) store_lanes(tile.scratch + 3 * kLanes * k, nothing);
    for (int i = 0; i < program.link_count; ++i) {
      const RigidLink& link = program.links[i];
      const std::ptrdiff_t row = i * tile.stride + first;
      const Pack motion = load(tile.motion + row), rate = load(tile.rate + row), acc = load(tile.acceleration + row);
      if (link.moves_before) at.pass(link.before);
      add_twists(program, tile, i, at);
      if (link.revolute)
        at.turn(motion, rate, acc);
      else
        at.slide(motion, rate, acc);
      if (link.moves_after) at.pass(link.after);
      out(i, first, at);
    }
  }
}

void regressor(const RigidProgram& program, const RigidTile& tile) {
  sweep(program, tile, [&](int i, int first, const Moving& at) { add_columns(program, tile, i, first, at); });
}

void torque(const RigidProgram& program, const RigidTile& tile, const double* parameters) {
  sweep(program, tile, [&](int i, int first, const Moving& at) {
    add_torques(program, tile, i, first, at, parameters + kLinkColumns * i);
  });
}

/// What an acceleration of one of every reading asks of a link at rest, in the link's axes, and the work that it does
/// along every reading: M = sum of J^T I J over the links.
inline void add_masses(const RigidProgram& program, const RigidTile& tile, int i, int first, const Moving& at,
                       const double* p) {
  const int driven = program.driven_count;
  const Vec moment_of_mass = splat_vec(p + 1);
  double* const local = tile.scratch + 6 * kLanes * driven;  // twists at the link's origin, in its axes
  for (int k = 0; k < driven; ++k) {
    const double* twist = tile.scratch + 6 * kLanes * k;
    const Vec n = load_lanes(twist), v = load_lanes(twist + 3 * kLanes) + cross(n, at.o);
    store_lanes(local + 6 * kLanes * k, at.turned_back(n));
    store_lanes(local + 6 * kLanes * k + 3 * kLanes, at.turned_back(v));
  }
  for (int k = 0; k < driven; ++k) {
    const Vec n = load_lanes(local + 6 * kLanes * k), v = load_lanes(local + 6 * kLanes * k + 3 * kLanes);
    const Vec force = splat(p[0]) * v + cross(n, moment_of_mass);
    const Vec moment = cross(moment_of_mass, v) + times_inertia(p + 4, n);
    for (int l = 0; l <= k; ++l) {
      const double* other = local + 6 * kLanes * l;
      double* out = tile.blocks[0] + (k * driven + l) * tile.column_stride + first;
      double* mirrored = tile.blocks[0] + (l * driven + k) * tile.column_stride + first;
      const Pack sum =
          (i > 0 ? load(out) : Pack{}) + dot(load_lanes(other), moment) + dot(load_lanes(other + 3 * kLanes), force);
      store(out, sum);
      store(mirrored, sum);
    }
  }
}

void mass_matrix(const RigidProgram& program, const RigidTile& tile, const double* parameters) {
  sweep(program, tile, [&](int i, int first, const Moving& at) {
    add_masses(program, tile, i, first, at, parameters + kLinkColumns * i);
  });
}

void sine_cosine_of(const double* angle, int count, double* sine, double* cosine) {
  for (int first = 0; first < count; first += kLanes) {
    Pack s, c;
    sine_cosine(load(angle + first), &s, &c);
    store(sine + first, s);
    store(cosine + first, c);
  }
}

}  // namespace

#define TRUING_TEXT_OF(x) #x
#define TRUING_TEXT(x) TRUING_TEXT_OF(x)
extern const RigidFunctions rigid_table;
const RigidFunctions rigid_table{TRUING_TEXT(TRUING_KERNEL_NAMESPACE), regressor, torque, mass_matrix, sine_cosine_of};

}  // namespace truing::kernel::TRUING_KERNEL_NAMESPACE
