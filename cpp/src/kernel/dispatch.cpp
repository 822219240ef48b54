// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <stdexcept>
#include <string>

#include "drive.hpp"
#include "kernel.hpp"
#include "laws.hpp"
#include "rigid.hpp"

namespace truing::kernel {

namespace scalar {
extern const Functions table;
extern const RigidFunctions rigid_table;
extern const DriveFunctions drive_table;
extern const LawFunctions law_table;
}  // namespace scalar
namespace sse2 {
extern const Functions table;
extern const RigidFunctions rigid_table;
extern const DriveFunctions drive_table;
extern const LawFunctions law_table;
}  // namespace sse2
#if TRUING_X86
namespace avx2 {
extern const Functions table;
extern const RigidFunctions rigid_table;
extern const DriveFunctions drive_table;
extern const LawFunctions law_table;
}  // namespace avx2
namespace avx512 {
extern const Functions table;
extern const RigidFunctions rigid_table;
extern const DriveFunctions drive_table;
extern const LawFunctions law_table;
}  // namespace avx512
#endif

const Functions* functions(const char* name) {
  const auto is = [name](const char* other) { return std::strcmp(name, other) == 0; };
#if TRUING_X86
  __builtin_cpu_init();
  if (is("avx512") && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl"))
    return &avx512::table;
  if (is("avx2") && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return &avx2::table;
#endif
  if (is("sse2")) return &sse2::table;  // the machine's baseline: two lanes, plain code where there is no SSE2
  if (is("scalar")) return &scalar::table;
  return nullptr;
}

const Functions& functions() {
  static const Functions& chosen = []() -> const Functions& {
    if (const char* wanted = std::getenv("TRUING_KERNEL")) {
      if (const Functions* found = functions(wanted)) return *found;
      throw std::runtime_error(std::string("TRUING_KERNEL=") + wanted +
                               " is not to be had here; scalar, sse2, avx2, avx512 may be");
    }
    for (const char* name : {"avx512", "avx2"}) {
      if (const Functions* found = functions(name)) return *found;
    }
    return sse2::table;
  }();
  return chosen;
}

namespace {

/// Of these copies, the one that the named copy of kernel.cpp goes with.
template <class Table>
const Table* beside(const char* name, std::initializer_list<const Table*> copies) {
  const Functions* found = functions(name);
  if (!found) return nullptr;
  for (const Table* copy : copies) {
    if (std::strcmp(copy->name, found->name) == 0) return copy;
  }
  return nullptr;
}

}  // namespace

#if TRUING_X86
#define TRUING_COPIES(table) {&scalar::table, &sse2::table, &avx2::table, &avx512::table}
#else
#define TRUING_COPIES(table) {&scalar::table, &sse2::table}
#endif

const RigidFunctions* rigid_functions(const char* name) {
  return beside<RigidFunctions>(name, TRUING_COPIES(rigid_table));
}
const DriveFunctions* drive_functions(const char* name) {
  return beside<DriveFunctions>(name, TRUING_COPIES(drive_table));
}
const LawFunctions* law_functions(const char* name) { return beside<LawFunctions>(name, TRUING_COPIES(law_table)); }

const RigidFunctions& rigid_functions() {
  static const RigidFunctions& chosen = *rigid_functions(functions().name);
  return chosen;
}

const DriveFunctions& drive_functions() {
  static const DriveFunctions& chosen = *drive_functions(functions().name);
  return chosen;
}

const LawFunctions& law_functions() {
  static const LawFunctions& chosen = *law_functions(functions().name);
  return chosen;
}

}  // namespace truing::kernel
