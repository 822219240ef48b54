// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <unordered_map>

#include "convert/columns.hpp"
#include "convert/options.hpp"
#include "convert/text.hpp"
#include "parts.hpp"
#include "tables/model/robot.hpp"

namespace truing::python {

namespace {

/// Reads a table's columns and remembers whose memory they are in.
class Reader {
 public:
  std::size_t rows = 0;
  std::vector<py::object> kept;

  /// shape=(n, width), or a list or tuple of `width` columns. width 0: any.
  std::vector<Column> block(const py::object& given, const std::string& name, std::size_t width, bool first = false) {
    std::vector<Column> columns;
    if (is_list_of_columns(given)) {
      check_width(py::len(given), width, name, "; a list of arrays holds columns: for rows use np.array(...)");
      for (const py::handle item : given) {
        const py::array array = float_array(item, name);
        if (array.ndim() != 1)
          throw std::invalid_argument(name + ": a list of arrays holds columns, each of shape (n,)");
        if (first && columns.empty()) rows = static_cast<std::size_t>(array.shape(0));
        check_rows(array, name);
        columns.push_back(column_of(array));
        kept.push_back(array);
      }
      return columns;
    }
    const py::array array = float_array(given, name);
    if (array.ndim() != 2)
      throw std::invalid_argument(name + " must have shape (n, " +
                                  (width == 0 ? "driven joints" : std::to_string(width)) + "); found " +
                                  shape_text(array));
    if (first) rows = static_cast<std::size_t>(array.shape(0));
    check_rows(array, name);
    check_width(static_cast<std::size_t>(array.shape(1)), width, name, "");
    for (py::ssize_t j = 0; j < array.shape(1); ++j)
      columns.push_back(
          {static_cast<const double*>(array.data()) + j * array.strides(1) / size, array.strides(0) / size});
    kept.push_back(array);
    return columns;
  }

  template <std::size_t Width>
  std::array<Column, Width> block(const std::optional<ArrayLike>& given, const std::string& name) {
    std::array<Column, Width> columns;
    if (given) {
      const std::vector<Column> read = block(*given, name, Width);
      std::copy(read.begin(), read.end(), columns.begin());
    }
    return columns;
  }

  /// shape=(n,), or one number for all rows where that makes sense.
  Column column(const std::optional<ArrayLike>& given, const std::string& name, bool or_number = false) {
    if (!given) return {};
    const py::array array = float_array(*given, name);
    kept.push_back(array);
    if (or_number && array.ndim() == 0) return column_of(array);
    if (array.ndim() != 1)
      throw std::invalid_argument(name + " must have shape (n,)" + (or_number ? " or be one number" : "") + "; found " +
                                  shape_text(array));
    check_rows(array, name);
    return column_of(array);
  }

 private:
  static constexpr auto size = static_cast<py::ssize_t>(sizeof(double));

  /// Lists of plain numbers are rows, as numpy reads them; lists of arrays are columns, as Arrow and pandas
  /// have them.
  static bool is_list_of_columns(const py::object& given) {
    if (!py::isinstance<py::list>(given) && !py::isinstance<py::tuple>(given)) return false;
    const py::sequence items = given;
    return !items.empty() && (py::hasattr(items[0], "__array__") || py::hasattr(items[0], "__arrow_array__"));
  }
  static std::string shape_text(const py::array& array) {
    return "shape " + py::str(array.attr("shape")).cast<std::string>();
  }

  void check_rows(const py::array& array, const std::string& name) const {
    if (static_cast<std::size_t>(array.shape(0)) != rows)
      throw std::invalid_argument(name + " has " + std::to_string(array.shape(0)) + " rows, joints has " +
                                  std::to_string(rows));
  }
  static void check_width(std::size_t found, std::size_t expected, const std::string& name, const std::string& hint) {
    if (expected != 0 && found != expected)
      throw std::invalid_argument(name + " has " + std::to_string(found) + " columns, expected " +
                                  std::to_string(expected) + hint);
  }
};

/// How labels become numbers.
struct LabelRule {
  const char* column;
  bool grow = false;  ///< unknown words are new names, in order of appearance
  bool none = false;  ///< '' and None (or a table's NaN) mean -1
};

bool is_missing(py::handle item) {
  if (item.is_none()) return true;
  if (PyUnicode_Check(item.ptr())) return PyUnicode_GET_LENGTH(item.ptr()) == 0;
  return PyFloat_Check(item.ptr()) && std::isnan(PyFloat_AS_DOUBLE(item.ptr()));
}

std::int32_t number_of(py::handle item, std::size_t row, const LabelRule& rule,
                       std::unordered_map<std::string, std::int32_t>& index, std::vector<std::string>& names) {
  if (rule.none && is_missing(item)) return -1;
  if (!PyUnicode_Check(item.ptr()))
    throw std::invalid_argument(std::string(rule.column) + ": row " + std::to_string(row) + " holds " +
                                py::repr(item).cast<std::string>() + ", expected a name");
  const auto name = item.cast<std::string>();
  if (const auto found = index.find(name); found != index.end()) return found->second;
  if (!rule.grow)
    throw std::invalid_argument(std::string(rule.column) + ": row " + std::to_string(row) + " holds '" + name +
                                "', expected one of: " + joined(names));
  names.push_back(name);
  return index[name] = static_cast<std::int32_t>(names.size()) - 1;
}

/// One number per row: integers as they are, words by their place in `names`.
std::vector<std::int32_t> read_labels(const Labels& given, std::size_t rows, const LabelRule& rule,
                                      std::vector<std::string>& names) {
  py::object items = given;
  const bool words = (py::isinstance<py::list>(given) || py::isinstance<py::tuple>(given)) && py::len(given) > 0 &&
                     (py::isinstance<py::str>(given[py::int_(0)]) || given[py::int_(0)].is_none());
  std::vector<std::int32_t> out;
  if (!words) {
    const auto array = py::array::ensure(given);
    if (!array || array.ndim() != 1)
      throw std::invalid_argument(std::string(rule.column) + " must have shape (n,): one name or number for each row");
    const char kind = array.dtype().kind();
    if (kind == 'i' || kind == 'u') {
      const auto numbers = array.cast<py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>>();
      out.reserve(static_cast<std::size_t>(numbers.size()));
      for (py::ssize_t i = 0; i < numbers.size(); ++i) {
        const std::int64_t number = numbers.data()[i];
        if (number < std::numeric_limits<std::int32_t>::min() || number > std::numeric_limits<std::int32_t>::max())
          throw std::invalid_argument(std::string(rule.column) + ": row " + std::to_string(i) + " holds " +
                                      std::to_string(number) + ", beyond 32 bits");
        out.push_back(static_cast<std::int32_t>(number));
      }
    } else {
      items = array.attr("tolist")();
    }
  }
  if (out.empty()) {
    std::unordered_map<std::string, std::int32_t> index;
    for (std::size_t i = 0; i < names.size(); ++i) index[names[i]] = static_cast<std::int32_t>(i);
    if (PySequence_Check(items.ptr())) out.reserve(py::len(items));
    for (const py::handle item : items) out.push_back(number_of(item, out.size(), rule, index, names));
  }
  if (out.size() != rows)
    throw std::invalid_argument(std::string(rule.column) + " has " + std::to_string(out.size()) + " rows, joints has " +
                                std::to_string(rows));
  return out;
}

void check_range(const std::vector<std::int32_t>& numbers, const char* column, std::int32_t lowest, std::size_t count,
                 const char* hint) {
  for (std::size_t row = 0; row < numbers.size(); ++row)
    if (numbers[row] < lowest || numbers[row] >= static_cast<std::int32_t>(count))
      throw std::invalid_argument(std::string(column) + ": row " + std::to_string(row) + " holds " +
                                  std::to_string(numbers[row]) + ", " + hint);
}

Measurements make(const ArrayLike& joints, const std::optional<ArrayLike>& positions,
                  const std::optional<ArrayLike>& orientations, const std::optional<ArrayLike>& distances,
                  const std::optional<Labels>& fixed_points, const std::vector<std::string>& fixed_point_names,
                  const std::optional<Labels>& targets, std::optional<std::vector<std::string>> target_names,
                  const std::optional<ArrayLike>& directions, const std::optional<ArrayLike>& joint_speeds,
                  const std::optional<ArrayLike>& payload, const std::optional<ArrayLike>& temperature,
                  const std::optional<ArrayLike>& time, const std::optional<Labels>& pose,
                  const std::optional<Labels>& set, const std::optional<ArrayLike>& position_sigma,
                  const std::optional<ArrayLike>& rotation_sigma, const std::optional<ArrayLike>& weight,
                  const std::map<std::string, ArrayLike>& covariates, const std::optional<Robot>& robot) {
  Reader reader;
  Measurements data;
  data.joints = reader.block(joints, "joints", robot ? robot->driven_count() : 0, true);
  data.rows = reader.rows;
  data.position = reader.block<3>(positions, "positions");
  data.orientation = reader.block<4>(orientations, "orientations");
  data.distance = reader.column(distances, "distances");
  if (directions) data.direction = reader.block(*directions, "directions", data.joints.size());
  if (joint_speeds) data.joint_speed = reader.block(*joint_speeds, "joint_speeds", data.joints.size());
  data.payload = reader.column(payload, "payload", true);
  data.temperature = reader.column(temperature, "temperature", true);
  data.time = reader.column(time, "time");
  data.position_sigma = reader.column(position_sigma, "position_sigma", true);
  data.rotation_sigma = reader.column(rotation_sigma, "rotation_sigma", true);
  data.weight = reader.column(weight, "weight", true);
  for (const auto& [name, values] : covariates)
    data.covariates[name] = reader.column(values, "covariate " + name, true);

  if (fixed_points) {
    data.fixed_point_names = fixed_point_names;
    data.fixed_point = read_labels(*fixed_points, data.rows, {"fixed_points", fixed_point_names.empty(), true},
                                   data.fixed_point_names);
    check_range(data.fixed_point, "fixed_points", -1, data.fixed_point_names.size(),
                "expected -1 (none) or an index into fixed_point_names");
  }
  if (targets) {
    if (!target_names) {
      target_names.emplace();
      if (robot)
        for (const Target& target : robot->targets) target_names->push_back(target.name);
      else
        target_names->push_back("tool");
    }
    data.target = read_labels(*targets, data.rows, {"targets"}, *target_names);
  }
  if (pose) {
    std::vector<std::string> names;
    data.pose = read_labels(*pose, data.rows, {"pose", true}, names);
  }
  if (set) {
    std::vector<std::string> names{"train", "test"};
    const std::vector<std::int32_t> numbers = read_labels(*set, data.rows, {"set"}, names);
    check_range(numbers, "set", 0, 2, "expected 0 (train) or 1 (test)");
    data.set.assign(numbers.begin(), numbers.end());
  }
  data.owner = keep_alive(std::move(reader.kept));
  return data;
}

// ---- Reading back ---------------------------------------------------------------------------------------------------

using Block = py::typing::Optional<py::array_t<double>>;

template <class T>
py::typing::Optional<T> optional_of(py::object object) {
  return py::reinterpret_steal<py::typing::Optional<T>>(object.release());
}

/// The column itself, read-only; it keeps `self` alive.
py::array_t<double> view_of(const Column& column, const py::object& self) {
  const auto rows = static_cast<py::ssize_t>(self.cast<const Measurements&>().rows);
  return read_only(
      py::array_t<double>({rows}, {column.stride * static_cast<py::ssize_t>(sizeof(double))}, column.data, self));
}

auto column_getter(Column Measurements::* member) {
  return [member](const py::object& self) -> Block {
    const Column& column = self.cast<const Measurements&>().*member;
    return column ? optional_of<py::array_t<double>>(view_of(column, self))
                  : optional_of<py::array_t<double>>(py::none());
  };
}

template <class Columns>
py::object block_of(const Measurements& data, const Columns& columns) {
  if (columns.empty() || !columns[0]) return py::none();
  py::array_t<double> out({data.rows, columns.size()});
  for (std::size_t j = 0; j < columns.size(); ++j)
    for (std::size_t i = 0; i < data.rows; ++i) out.mutable_data()[i * columns.size() + j] = columns[j][i];
  return read_only(std::move(out));
}

template <class Member>
auto block_getter(Member Measurements::* member) {
  return [member](const Measurements& data) -> Block {
    return optional_of<py::array_t<double>>(block_of(data, data.*member));
  };
}

template <class Number>
auto number_getter(std::vector<Number> Measurements::* member) {
  return [member](const py::object& self) -> py::typing::Optional<py::array_t<Number>> {
    const std::vector<Number>& numbers = self.cast<const Measurements&>().*member;
    if (numbers.empty()) return optional_of<py::array_t<Number>>(py::none());
    py::array_t<Number> out(static_cast<py::ssize_t>(numbers.size()), numbers.data(), self);
    py::detail::array_proxy(out.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
    return optional_of<py::array_t<Number>>(std::move(out));
  };
}

std::string repr(const Measurements& data) {
  std::string out =
      "Measurements(" + std::to_string(data.rows) + " rows, " + std::to_string(data.joints.size()) + " joints";
  const auto count = [&](const char* what, auto has) {
    std::size_t n = 0;
    for (std::size_t row = 0; row < data.rows; ++row) n += has(row) ? 1U : 0U;
    if (n > 0) out += ", " + std::to_string(n) + " " + what;
  };
  count("positions", [&](std::size_t row) { return data.has_position(row); });
  count("orientations", [&](std::size_t row) { return data.has_orientation(row); });
  count("distances", [&](std::size_t row) { return data.has_distance(row); });
  count("touches of fixed points", [&](std::size_t row) { return data.has_fixed_point(row); });
  return out + ")";
}

using Class = py::class_<Measurements>;

void bind_constructor(Class& cls) {
  cls.def(py::init(&make), py::arg("joints"), py::kw_only(), py::arg("positions") = py::none(),
          py::arg("orientations") = py::none(), py::arg("distances") = py::none(), py::arg("fixed_points") = py::none(),
          py::arg("fixed_point_names") = std::vector<std::string>{}, py::arg("targets") = py::none(),
          py::arg("target_names") = py::none(), py::arg("directions") = py::none(),
          py::arg("joint_speeds") = py::none(), py::arg("payload") = py::none(), py::arg("temperature") = py::none(),
          py::arg("time") = py::none(), py::arg("pose") = py::none(), py::arg("set") = py::none(),
          py::arg("position_sigma") = py::none(), py::arg("rotation_sigma") = py::none(),
          py::arg("weight") = py::none(), py::arg("covariates") = std::map<std::string, ArrayLike>{},
          py::arg("robot") = py::none());
}

/// What was measured, and where.
void bind_measured(Class& cls) {
  cls.def_readonly("rows", &Measurements::rows, "Number of rows n.");
  cls.def_property_readonly(
      "joints", [](const Measurements& data) { return block_of(data, data.joints).cast<py::array_t<double>>(); },
      "shape=(n, driven joints) [rad | m], a copy.");
  cls.def_property_readonly("positions", block_getter(&Measurements::position), "shape=(n, 3) [m], a copy, or None.");
  cls.def_property_readonly("orientations", block_getter(&Measurements::orientation),
                            "shape=(n, 4) w x y z, a copy, or None.");
  cls.def_property_readonly("distances", column_getter(&Measurements::distance), "shape=(n,) [m], or None.");
  cls.def_property_readonly("fixed_points", number_getter(&Measurements::fixed_point),
                            "shape=(n,): index into `fixed_point_names`, -1: none; or None.");
  cls.def_property_readonly(
      "fixed_point_names", [](const Measurements& data) { return tuple_of(data.fixed_point_names); },
      "Names of the fixed points.");
  cls.def_property_readonly("targets", number_getter(&Measurements::target),
                            "shape=(n,): index into `robot.targets`, or None.");
  cls.def_property_readonly("directions", block_getter(&Measurements::direction),
                            "shape=(n, driven joints), a copy, or None.");
  cls.def_property_readonly("joint_speeds", block_getter(&Measurements::joint_speed),
                            "shape=(n, driven joints) [rad/s | m/s], a copy, or None.");
}

/// What else was recorded.
void bind_recorded(Class& cls) {
  cls.def_property_readonly("payload", column_getter(&Measurements::payload), "shape=(n,) [kg], or None.");
  cls.def_property_readonly("temperature", column_getter(&Measurements::temperature), "shape=(n,) [deg C], or None.");
  cls.def_property_readonly("time", column_getter(&Measurements::time), "shape=(n,) [s], or None.");
  cls.def_property_readonly("pose", number_getter(&Measurements::pose), "shape=(n,): number of the pose, or None.");
  cls.def_property_readonly("set", number_getter(&Measurements::set), "shape=(n,): 0 train, 1 test; or None.");
  cls.def_property_readonly("position_sigma", column_getter(&Measurements::position_sigma), "shape=(n,) [m], or None.");
  cls.def_property_readonly("rotation_sigma", column_getter(&Measurements::rotation_sigma),
                            "shape=(n,) [rad], or None.");
  cls.def_property_readonly("weight", column_getter(&Measurements::weight), "shape=(n,), or None.");
  cls.def_property_readonly(
      "covariates",
      [](const py::object& self) {
        py::dict columns;
        for (const auto& [name, column] : self.cast<const Measurements&>().covariates)
          columns[py::str(name)] = view_of(column, self);
        return py::reinterpret_steal<Mapping<std::string, py::array_t<double>>>(mapping_proxy(columns).release());
      },
      "More columns by name, each of shape (n,).");
}

using Table = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Table table_of(const std::vector<Column>& columns, std::size_t rows) {
  Table out(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index k = 0; k < out.cols(); ++k) {
    for (Eigen::Index row = 0; row < out.rows(); ++row)
      out(row, k) = columns[static_cast<std::size_t>(k)][static_cast<std::size_t>(row)];
  }
  return out;
}

}  // namespace

void bind_measurement(py::module_& m) {
  Class cls(m, "Measurements",
            R"(One row per measurement: n rows of joint readings, and what was measured there.

joints: shape=(n, driven joints) [rad | m], chain order.
positions: shape=(n, 3) [m] of the target in the measurement frame; NaN rows: not measured.
orientations: shape=(n, 4) w x y z, Hamilton; NaN rows: not measured.
distances: shape=(n,) [m] to the robot's anchor; NaN: not measured.
fixed_points: n names ('' or None: none), or indices into `fixed_point_names` (-1: none).
targets: n names, or indices into `robot.targets`; absent: the tool. `target_names`: the targets in the robot's order,
    unless `robot` is given; default ["tool"].
directions: shape=(n, driven joints), approach direction -1, 0, 1. joint_speeds: shape=(n, driven joints) [rad/s | m/s].
payload [kg], temperature [deg C], time [s], position_sigma [m], rotation_sigma [rad], weight: shape=(n,); all but time
    may be one number for all rows.
pose: n numbers or names, rows of one robot pose share one; absent: equal joints. set: n of 'train', 'test' (or 0, 1).
covariates: more columns by name, shape=(n,).

Arrays of float64 are not copied, whatever their strides: do not change them while this object is in use. A list or
tuple of arrays holds columns (from Arrow or pandas); a list of lists of numbers holds rows.
Raises InputError naming the column when shapes or types do not fit; `validate_measurements` checks the values.)");
  bind_constructor(cls);
  bind_measured(cls);
  bind_recorded(cls);
  cls.def("__len__", [](const Measurements& data) { return data.rows; });
  cls.def("__repr__", [](const Measurements& data) { return repr(data); });
  define_value(cls, {"joints", "positions", "orientations", "distances", "fixed_points", "fixed_point_names", "targets",
                     "directions", "joint_speeds", "payload", "temperature", "time", "pose", "set", "position_sigma",
                     "rotation_sigma", "weight", "covariates"});

  m.def("validate_measurements", py::overload_cast<const Measurements&, const Robot&, bool>(&validate), py::arg("data"),
        py::arg("robot"), py::arg("joints_only") = false, py::call_guard<py::gil_scoped_release>(),
        R"(Raises InputError naming the row (counted from 0) and what is wrong with the measurements for this robot.

Checked are: counts that do not fit the robot, joints or inputs that are not finite, a row without any measurement
(unless `joints_only`), half a position, a quaternion that is not of unit length, directions, sigmas.)");
  m.def(
      "pose_groups",
      [](const Measurements& data) {
        std::vector<std::int32_t> groups;
        {
          const py::gil_scoped_release unlocked;
          groups = pose_groups(data);
        }
        return py::array_t<std::int32_t>(static_cast<py::ssize_t>(groups.size()), groups.data());
      },
      py::arg("data"),
      "shape=(n,): group of every row, 0 ... count-1 in order of appearance; `pose` if given, else equal "
      "joint readings.");
  m.def(
      "inferred_directions",
      [](const Measurements& data) { return table_of(with_inferred_directions(data).direction, data.rows); },
      py::arg("data"),
      "shape=(n, driven joints): approach directions -1, 0, 1 as the order of the rows shows them, if the poses were "
      "driven to one after the other.");
  m.def(
      "inferred_speeds",
      [](const Measurements& data) { return table_of(with_inferred_speeds(data).joint_speed, data.rows); },
      py::arg("data"),
      "shape=(n, driven joints) [rad/s | m/s]: joint speeds as joints and times show them, of a robot that moved while "
      "it was measured; shape=(n, 0) of one that stopped for each row.");
}

}  // namespace truing::python
