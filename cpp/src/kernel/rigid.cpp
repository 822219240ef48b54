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

/// Where a frame is, in the axes of the base.
struct Standing {
  Vec x, y, z, o;  ///< columns of R, origin

  Vec turned(Vec v) const { return v.x * x + v.y * y + v.z * z; }             ///< R v
  Vec turned_back(Vec v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }  ///< R^T v

  /// On to a frame that is fixed to this one.
  void pass(const double* frame) {
    o = o + turned(splat_vec(frame + 9));
    const Vec new_x = turned(splat_vec(frame)), new_y = turned(splat_vec(frame + 3));
    z = turned(splat_vec(frame + 6));
    x = new_x;
    y = new_y;
  }

  void turn(Pack angle) {
    Pack s, c;
    sine_cosine(angle, &s, &c);
    const Vec old_x = x;
    x = c * x + s * y;
    y = c * y - s * old_x;
  }
  void slide(Pack length) { o = o + length * z; }
};

/// And how it moves.
struct Moving : Standing {
  Vec w, alpha;  ///< angular velocity and acceleration
  Vec a;         ///< acceleration of the origin, less gravity

  Vec pull(Vec r) const { return cross(alpha, r) + cross(w, cross(w, r)); }  ///< of a point r further on, more

  void pass(const double* frame) {
    a = a + pull(turned(splat_vec(frame + 9)));
    Standing::pass(frame);
  }

  /// Luh, Walker and Paul 1980, eq. 1 to 3, seen from the base; what slides takes its origin along.
  void turn(Pack angle, Pack rate, Pack acceleration) {
    alpha = alpha + acceleration * z + rate * cross(w, z);
    w = w + rate * z;
    Standing::turn(angle);
  }
  void slide(Pack length, Pack rate, Pack acceleration) {
    a = a + pull(length * z) + acceleration * z + (rate + rate) * cross(w, z);
    Standing::slide(length);
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
  for (int k = 0; i == 0 && k < 2 * program.driven_count; ++k) store_lanes(tile.scratch + 3 * kLanes * k, Vec{});
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

/// What joints' torques are felt as by the readings that move them: joint i's is added to those of `out`.
inline void add_felt(const RigidProgram& program, const RigidTile& tile, int i, Pack torque, double* out) {
  for (int k = 0; k < program.driven_count; ++k) {
    const double by = program.coupling[i * program.driven_count + k];
    if (by == 0.0) continue;
    double* const felt = out + k * tile.column_stride;
    store(felt, load(felt) + splat(by) * torque);
  }
}

/// Newton and Euler (Luh, Walker and Paul 1980, eq. 4 to 6) of a link with mass p[0], first moment and inertia about
/// its origin: the force on it, and the moment about the base's origin behind it in `wrench`.
inline void store_wrench(const Moving& at, const double* p, double* wrench) {
  const Vec moment_of_mass = at.turned(splat_vec(p + 1)), w = at.turned_back(at.w);
  const Vec force = splat(p[0]) * at.a + at.pull(moment_of_mass);
  const Vec turning = times_inertia(p + 4, at.turned_back(at.alpha)) + cross(w, times_inertia(p + 4, w));
  store_lanes(wrench, force);
  store_lanes(wrench + 3 * kLanes, cross(moment_of_mass, at.a) + at.turned(turning) + cross(at.o, force));
}

/// Calls joint(i, first, at) at every joint and out(i, first, at) for the link behind it, a few samples at a time.
template <typename Joint, typename Out>
inline void sweep(const RigidProgram& program, const RigidTile& tile, Joint joint, Out out) {
  const Pack zero{}, one = splat(1.0);
  const Vec nothing{zero, zero, zero};
  for (int first = 0; first < tile.samples; first += kLanes) {
    Moving at{{{one, zero, zero}, {zero, one, zero}, {zero, zero, one}, nothing}, nothing, nothing, nothing};
    at.a = nothing - splat_vec(program.gravity);
    for (int i = 0; i < program.link_count; ++i) {
      const RigidLink& link = program.links[i];
      const std::ptrdiff_t row = i * tile.stride + first;
      const Pack motion = load(tile.motion + row), rate = load(tile.rate + row), acc = load(tile.acceleration + row);
      if (link.moves_before) at.pass(link.before);
      joint(i, first, at);
      if (link.revolute)
        at.turn(motion, rate, acc);
      else
        at.slide(motion, rate, acc);
      if (link.moves_after) at.pass(link.after);
      out(i, first, at);
    }
  }
}

/// The same with the twists of the readings.
template <typename Out>
inline void sweep(const RigidProgram& program, const RigidTile& tile, Out out) {
  sweep(program, tile, [&](int i, int, const Moving& at) { add_twists(program, tile, i, at); }, out);
}

void regressor(const RigidProgram& program, const RigidTile& tile) {
  sweep(program, tile, [&](int i, int first, const Moving& at) { add_columns(program, tile, i, first, at); });
}

/// Links in front carry those behind: wrenches are added up from the last link to the first, and felt by virtual work.
void torque(const RigidProgram& program, const RigidTile& tile, const double* parameters) {
  const auto place = [&](int i) { return tile.scratch + 12 * kLanes * i; };  // axis, its velocity; force, moment
  const auto joint = [&](int i, int, const Moving& at) {
    const bool revolute = program.links[i].revolute;
    store_lanes(place(i), revolute ? at.z : Vec{});
    store_lanes(place(i) + 3 * kLanes, revolute ? cross(at.o, at.z) : at.z);
  };
  const auto feel = [&](int first) {
    double* const out = tile.blocks[0] + first;
    for (int k = 0; k < program.driven_count; ++k) store(out + k * tile.column_stride, Pack{});
    Vec force{}, moment{};
    for (int i = program.link_count - 1; i >= 0; --i) {
      const double* const at = place(i);
      force = force + load_lanes(at + 6 * kLanes);
      moment = moment + load_lanes(at + 9 * kLanes);
      const Pack work = dot(load_lanes(at), moment) + dot(load_lanes(at + 3 * kLanes), force);
      add_felt(program, tile, i, work, out);
    }
  };
  sweep(program, tile, joint, [&](int i, int first, const Moving& at) {
    store_wrench(at, parameters + kLinkColumns * i, place(i) + 6 * kLanes);
    if (i + 1 == program.link_count) feel(first);
  });
}

/// What gravity asks of the joints, by virtual work: with m the mass and s the first moment about the base's origin of
/// all that is behind joint i, -g . (z x (s - m o)) where it turns about z through o, -g . (m z) where it slides.
void weight(const RigidProgram& program, const RigidTile& tile, const double* parameters) {
  const Pack zero{}, one = splat(1.0);
  const int links = program.link_count, driven = program.driven_count;
  const Vec gravity = splat_vec(program.gravity);
  const auto place = [&](int i) { return tile.scratch + 9 * kLanes * i; };  // axis, origin, first moment of its link
  for (int first = 0; first < tile.samples; first += kLanes) {
    Standing at{{one, zero, zero}, {zero, one, zero}, {zero, zero, one}, {zero, zero, zero}};
    for (int i = 0; i < links; ++i) {
      const RigidLink& link = program.links[i];
      const double* const p = parameters + kLinkColumns * i;
      const Pack motion = load(tile.motion + i * tile.stride + first);
      if (link.moves_before) at.pass(link.before);
      store_lanes(place(i), at.z);
      store_lanes(place(i) + 3 * kLanes, at.o);
      if (link.revolute)
        at.turn(motion);
      else
        at.slide(motion);
      if (link.moves_after) at.pass(link.after);
      store_lanes(place(i) + 6 * kLanes, at.turned(splat_vec(p + 1)) + splat(p[0]) * at.o);
    }
    double* const out = tile.blocks[0] + first;
    for (int k = 0; k < driven; ++k) store(out + k * tile.column_stride, zero);
    Vec moment{zero, zero, zero};
    Pack mass = zero;
    for (int i = links - 1; i >= 0; --i) {
      moment = moment + load_lanes(place(i) + 6 * kLanes);
      mass = mass + splat(parameters[kLinkColumns * i]);
      const Vec axis = load_lanes(place(i)), o = load_lanes(place(i) + 3 * kLanes);
      const Vec way = program.links[i].revolute ? cross(axis, moment - mass * o) : mass * axis;  // of what is behind it
      add_felt(program, tile, i, -dot(gravity, way), out);
    }
  }
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
      double* out = tile.blocks[k] + l * tile.column_stride + first;
      double* mirrored = tile.blocks[l] + k * tile.column_stride + first;
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

// --- what the torques change by (Carpentier and Mansard, Analytical derivatives of rigid body dynamics algorithms,
// 2018); spatial vectors (Featherstone 2008) at the base's origin, in its axes

struct Twist {
  Vec n, v;  ///< turning, and the velocity at the origin
};
struct Wrench {
  Vec n, f;  ///< moment about the origin, and force
};
inline Twist operator+(Twist a, Twist b) { return {a.n + b.n, a.v + b.v}; }
inline Twist operator*(Pack s, Twist a) { return {s * a.n, s * a.v}; }
inline Wrench operator+(Wrench a, Wrench b) { return {a.n + b.n, a.f + b.f}; }
inline Wrench operator*(Pack s, Wrench a) { return {s * a.n, s * a.f}; }
inline Twist cross(Twist a, Twist b) { return {cross(a.n, b.n), cross(a.n, b.v) + cross(a.v, b.n)}; }
inline Wrench cross(Twist a, Wrench b) { return {cross(a.n, b.n) + cross(a.v, b.f), cross(a.n, b.f)}; }
inline Pack dot(Twist a, Wrench b) { return dot(a.n, b.n) + dot(a.v, b.f); }

/// A matrix by its columns.
struct Columns {
  Vec x, y, z;

  Vec times(Vec v) const { return v.x * x + v.y * y + v.z * z; }
  Vec transposed_times(Vec v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }
};
inline Columns operator+(const Columns& a, const Columns& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }

/// A link, or several as one, and the wrench that moves them as they move.
struct Bodies {
  Pack mass;
  Vec first;        ///< first moment
  Columns inertia;  ///< about the origin
  Vec momentum;
  Columns gyration;  ///< sum of 2 [w]x I - tr(I) [w]x - 2 [first]x [v]x
  Wrench load;

  Wrench times(Twist a) const { return {inertia.times(a.n) + cross(first, a.v), mass * a.v + cross(a.n, first)}; }
  /// What the load changes by when all of them move faster by `more`, less what an acceleration of more x v takes:
  /// I (more x v) + more x* (I v) + v x* (I more). Nothing comes of more.v.
  Wrench carried_along(Twist more) const { return {gyration.times(more.n), cross(more.n + more.n, momentum)}; }
};

inline void add(const Bodies& more, Bodies* all) {
  all->mass += more.mass;
  all->first = all->first + more.first;
  all->inertia = all->inertia + more.inertia;
  all->momentum = all->momentum + more.momentum;
  all->gyration = all->gyration + more.gyration;
  all->load = all->load + more.load;
}

/// A link with ten parameters p that moves with v and accelerates with a.
inline void set_body(const Moving& at, Twist v, Twist a, const double* p, Bodies* body) {
  const Pack zero{}, one = splat(1.0);
  const Vec ex{one, zero, zero}, ey{zero, one, zero}, ez{zero, zero, one};
  Bodies& out = *body;
  out.mass = splat(p[0]);
  const Vec m = at.turned(splat_vec(p + 1));
  out.first = m + out.mass * at.o;
  // R I R^T, and on to the origin: + (o . m + o . first) 1 - first o^T - o m^T (Steiner).
  const Vec Rx = at.turned({splat(p[4]), splat(p[7]), splat(p[8])}),
            Ry = at.turned({splat(p[7]), splat(p[5]), splat(p[9])}),
            Rz = at.turned({splat(p[8]), splat(p[9]), splat(p[6])});
  const Pack size = dot(at.o, m + out.first);
  out.inertia.x = at.x.x * Rx + at.y.x * Ry + at.z.x * Rz + size * ex - at.o.x * out.first - m.x * at.o;
  out.inertia.y = at.x.y * Rx + at.y.y * Ry + at.z.y * Rz + size * ey - at.o.y * out.first - m.y * at.o;
  out.inertia.z = at.x.z * Rx + at.y.z * Ry + at.z.z * Rz + size * ez - at.o.z * out.first - m.z * at.o;
  const Wrench momentum = out.times(v);
  out.momentum = momentum.f;
  out.load = out.times(a) + cross(v, momentum);
  const Pack trace = out.inertia.x.x + out.inertia.y.y + out.inertia.z.z;
  const auto gyration = [&](Vec column, Vec unit) {
    return cross(v.n, column + column - trace * unit) - cross(out.first + out.first, cross(v.v, unit));
  };
  out.gyration = {gyration(out.inertia.x, ex), gyration(out.inertia.y, ey), gyration(out.inertia.z, ez)};
}

/// A joint: its axis, and how the link before it moves.
struct JointMotion {
  Twist axis, v, a;
};
/// What acceleration and velocity along a joint's axis take of all behind it.
struct JointLoad {
  Wrench inertia;
  Vec gyration;
};

/// What is found of a link on the way. It stays where it is: GCC copies what is so large a word at a time.
struct __attribute__((may_alias)) Found {
  JointMotion motion;
  JointLoad load;
  Bodies all;  ///< the link and, in the end, those behind it
};
static_assert(sizeof(Found) == 58 * kLanes * sizeof(double) && kLanes <= kSampleMultiple, "as rigid_scratch() has it");

/// Of every link, where the scratch begins that packs may stand at.
inline Found* found(const RigidTile& tile) {
  const auto begin = reinterpret_cast<std::uintptr_t>(tile.scratch);
  return reinterpret_cast<Found*>((begin + alignof(Found) - 1) / alignof(Found) * alignof(Found));
}

/// Of every link that of all behind it as well; of every joint what it takes of them.
inline void add_up_bodies(const RigidProgram& program, Found* links) {
  for (int i = program.link_count - 1; i >= 0; --i) {
    Bodies& all = links[i].all;
    if (i + 1 < program.link_count) add(links[i + 1].all, &all);
    const Twist& axis = links[i].motion.axis;
    links[i].load.inertia = all.times(axis);
    links[i].load.gyration = all.gyration.transposed_times(axis.n) + cross(all.momentum + all.momentum, axis.v);
  }
}

/// Adds what joint m by `by` adds to a reading's columns: what the torques change by when it moves otherwise, and what
/// they are for an acceleration of one. Seen from the links behind it their velocity changes by `more`, their
/// acceleration by `pull` and more x v, and the wrench on them turns with them.
inline void add_change(const RigidProgram& program, const RigidTile& tile, const Found* links, int m, double by,
                       const Pack* change, double* changes, double* masses) {
  const JointMotion& at = links[m].motion;
  const Bodies& all = links[m].all;
  const Twist swept = cross(at.v, at.axis);
  const Pack angle = splat(by) * change[0], rate = splat(by) * change[1], acceleration = splat(by) * change[2];
  const Twist more = angle * swept + rate * at.axis;
  const Twist pull =
      angle * (cross(at.a, at.axis) + cross(at.v, swept)) + (rate + rate) * swept + acceleration * at.axis;
  const Wrench wrench = all.times(pull) + all.carried_along(more) + angle * cross(at.axis, all.load);
  const Wrench inertia = splat(by) * all.times(at.axis);
  for (int l = 0; l < program.link_count; ++l) {
    Pack felt, mass;
    if (l <= m) {
      const Twist& axis = links[l].motion.axis;
      felt = dot(axis, wrench);
      mass = dot(axis, inertia);
    } else {
      const JointLoad& load_of_joint = links[l].load;
      felt = dot(pull, load_of_joint.inertia) + dot(more.n, load_of_joint.gyration);
      mass = splat(by) * dot(at.axis, load_of_joint.inertia);
    }
    for (int k = 0; k < program.driven_count; ++k) {
      const double follows = program.coupling[l * program.driven_count + k];
      if (follows == 0.0) continue;
      const std::ptrdiff_t column = k * tile.column_stride;
      store(changes + column, load(changes + column) + splat(follows) * felt);
      if (masses) store(masses + column, load(masses + column) + splat(follows) * mass);
    }
  }
}

void torque_change(const RigidProgram& program, const RigidTile& tile, const double* parameters, const double* change) {
  const int driven = program.driven_count;
  Found* const links = found(tile);
  const auto add_changes = [&](int first) {
    add_up_bodies(program, links);
    for (int k = 0; k < driven; ++k) {
      double* const changes = tile.blocks[k] + first;
      double* const masses = tile.blocks[driven + k] ? tile.blocks[driven + k] + first : nullptr;
      for (int l = 0; l < driven; ++l) {
        store(changes + l * tile.column_stride, Pack{});
        if (masses) store(masses + l * tile.column_stride, Pack{});
      }
      Pack of_reading[3];
      for (int d = 0; d < 3; ++d) of_reading[d] = load(change + (d * driven + k) * tile.stride + first);
      for (int m = 0; m < program.link_count; ++m) {
        const double by = program.coupling[m * driven + k];
        if (by != 0.0) add_change(program, tile, links, m, by, of_reading, changes, masses);
      }
    }
  };
  Twist v, a;
  const auto joint = [&](int i, int first, const Moving& at) {
    const Vec nothing{};
    if (i == 0) {
      v = {nothing, nothing};
      a = {nothing, nothing - splat_vec(program.gravity)};
    }
    const Twist axis = program.links[i].revolute ? Twist{at.z, cross(at.o, at.z)} : Twist{nothing, at.z};
    links[i].motion = {axis, v, a};
    const std::ptrdiff_t row = i * tile.stride + first;
    a = a + load(tile.acceleration + row) * axis + load(tile.rate + row) * cross(v, axis);
    v = v + load(tile.rate + row) * axis;
  };
  sweep(program, tile, joint, [&](int i, int first, const Moving& at) {
    set_body(at, v, a, parameters + kLinkColumns * i, &links[i].all);
    if (i + 1 == program.link_count) add_changes(first);
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
const RigidFunctions rigid_table{
    TRUING_TEXT(TRUING_KERNEL_NAMESPACE), regressor, torque, weight, mass_matrix, torque_change, sine_cosine_of};

}  // namespace truing::kernel::TRUING_KERNEL_NAMESPACE
