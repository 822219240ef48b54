// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The rooms of the library, one namespace a folder, and which room sees the names of which. A task room is named by a
// noun: its verb is the public function (truing::identify). Task rooms meet through public headers alone.
namespace truing {

namespace kernel {}  // namespace kernel
namespace math {}    // namespace math
namespace model {    // robot, measurements, effects, and the chain that they compile to
using namespace math;
}
namespace estimation {  // residuals and normal equations over all rows, evidence of groups of columns, two solvers
using namespace math;
using namespace model;
}  // namespace estimation

namespace identification {
using namespace math;
using namespace model;
using namespace estimation;
}  // namespace identification
namespace planning {
using namespace math;
using namespace model;
using namespace estimation;
}  // namespace planning
namespace diagnosis {
using namespace math;
using namespace model;
using namespace estimation;
}  // namespace diagnosis
namespace inverse_kinematics {
using namespace math;
using namespace model;
}  // namespace inverse_kinematics
namespace dynamics {
using namespace math;
using namespace model;
using namespace estimation;
}  // namespace dynamics
namespace hand_eye {
using namespace math;
}
namespace tracking {
using namespace math;
}

}  // namespace truing
