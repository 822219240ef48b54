// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/dynamics/recording.hpp"

#include "convert/columns.hpp"
#include "convert/options.hpp"
#include "convert/text.hpp"
#include "parts.hpp"
#include "tables/dynamics/recording.hpp"

namespace truing::python {

namespace {

using Arrays = Mapping<std::string, py::array_t<double>>;

std::string shape_of(const py::array& array) { return py::str(array.attr("shape")).cast<std::string>(); }

/// shape=(n,), copied.
Eigen::VectorXd vector_of(const ArrayLike& given, const std::string& name) {
  const py::array array = float_array(given, name);
  if (array.ndim() != 1) throw std::invalid_argument(name + " must have shape (n,); found shape " + shape_of(array));
  return array.cast<Eigen::VectorXd>();
}

/// shape=(n, joints), copied; nothing given: shape (n, 0).
Eigen::MatrixXd table_of(const std::optional<ArrayLike>& given, const std::string& name, Eigen::Index rows) {
  if (!given) return Eigen::MatrixXd(rows, 0);
  const py::array array = float_array(*given, name);
  if (array.ndim() != 2 || array.shape(0) != rows)
    throw std::invalid_argument(name + " must have shape (" + std::to_string(rows) +
                                ", joints): a row for every time; found shape " + shape_of(array));
  return array.cast<Eigen::MatrixXd>();
}

/// Python's objects are let go of under its lock, whichever thread does it.
template <class Object>
std::shared_ptr<Object> held(Object object) {
  return std::shared_ptr<Object>(new Object(std::move(object)), [](Object* one) {
    const py::gil_scoped_acquire locked;
    delete one;
  });
}

using ReadPieces = py::typing::Callable<py::typing::Iterator<Recording>()>;

/// What Recording::read is in Python: a callable that returns an iterator of recordings.
struct Pieces {
  std::shared_ptr<py::object> callable;

  NextRows operator()() const {
    const py::gil_scoped_acquire locked;
    return [rows = held(py::iter((*callable)()))](Recording* out) {
      const py::gil_scoped_acquire again;
      if (*rows == py::iterator::sentinel()) return false;
      *out = py::cast<const Recording&>(**rows);
      ++*rows;
      return true;
    };
  }
};

Recording make(std::string name, const ArrayLike& time, const ArrayLike& position,
               const std::optional<ArrayLike>& speed, const std::optional<ArrayLike>& torque,
               const std::optional<ArrayLike>& current, const std::optional<ArrayLike>& command,
               const std::optional<ArrayLike>& speed_command, const std::optional<ArrayLike>& torque_command,
               const std::map<std::string, ArrayLike>& columns, bool torque_is_mean, bool test,
               const std::optional<ReadPieces>& pieces, double end) {
  Recording out;
  out.name = std::move(name);
  out.time = vector_of(time, "time");
  const Eigen::Index rows = out.time.size();
  out.position = table_of(position, "position", rows);
  out.speed = table_of(speed, "speed", rows);
  out.torque = table_of(torque, "torque", rows);
  out.current = table_of(current, "current", rows);
  out.command = table_of(command, "command", rows);
  out.speed_command = table_of(speed_command, "speed_command", rows);
  out.torque_command = table_of(torque_command, "torque_command", rows);
  for (const auto& [key, values] : columns) {
    Eigen::VectorXd column = vector_of(values, "column " + key);
    if (column.size() != rows)
      throw std::invalid_argument("column " + key + " has " + std::to_string(column.size()) + " rows, time has " +
                                  std::to_string(rows));
    out.columns.emplace(key, std::move(column));
  }
  out.torque_is_mean = torque_is_mean;
  out.test = test;
  if (pieces) out.read = Pieces{held(py::object(*pieces))};
  out.end = end;
  return out;
}

std::optional<ReadPieces> pieces_of(const Recording& recording) {
  const Pieces* pieces = recording.read.target<Pieces>();
  if (!pieces) return std::nullopt;
  return py::reinterpret_borrow<ReadPieces>(*pieces->callable);
}

/// Views that keep `self` alive.
Arrays columns_of(const py::object& self) {
  py::dict views;
  for (const auto& [name, column] : self.cast<const Recording&>().columns)
    views[py::str(name)] = read_only(py::array_t<double>(column.size(), column.data(), self));
  return py::reinterpret_steal<Arrays>(mapping_proxy(views).release());
}

std::string repr(const Recording& r) {
  std::string out = "Recording('" + r.name + "', " + std::to_string(r.rows()) + " rows";
  if (r.rows() > 1) out += " in " + text(r.time[r.time.size() - 1] - r.time[0]) + " s";
  out += ", " + std::to_string(r.position.cols()) + " joints";
  std::vector<std::string> there;
  const auto add = [&there](const char* name, const Eigen::MatrixXd& table) {
    if (table.cols() > 0) there.emplace_back(name);
  };
  add("speed", r.speed);
  add("torque", r.torque);
  add("current", r.current);
  add("command", r.command);
  add("speed_command", r.speed_command);
  add("torque_command", r.torque_command);
  for (const auto& column : r.columns) there.push_back(column.first);
  if (!there.empty()) out += ", with " + joined(there);
  if (r.read) out += ", and more on disk";
  return out + (r.test ? ", test)" : ")");
}

}  // namespace

void bind_motion_recording(py::module_& m) {
  py::class_<Recording> cls(m, "Recording",
                            R"(A recording of motion: one file, one fold. It does not change; `replace` makes another.

Arrays are copied. Tables have a column for each joint that has a reading, in chain order. A table that was not recorded
is left out, and then has the shape (n, 0); a joint that was not recorded is NaN throughout.
pieces: of a recording that is longer than memory a callable that returns an iterator of its rows, some of them each as a
Recording with the same tables, from the first on whenever it is called; the tables given are then its first rows, and
end [s] is the time of the last.
Raises InputError naming the array when shapes or types do not fit; `validate_recording` checks the values.)");
  cls.def(py::init(&make), py::arg("name"), py::kw_only(), py::arg("time"), py::arg("position"),
          py::arg("speed") = py::none(), py::arg("torque") = py::none(), py::arg("current") = py::none(),
          py::arg("command") = py::none(), py::arg("speed_command") = py::none(),
          py::arg("torque_command") = py::none(), py::arg("columns") = std::map<std::string, ArrayLike>{},
          py::arg("torque_is_mean") = false, py::arg("test") = false, py::arg("pieces") = py::none(),
          py::arg("end") = 0.0);
  define_read_only_attributes(cls, {"columns"});
  cls.def_property_readonly("columns", &columns_of,
                            "Shape=(n,) each, by name: 'payload_kg', 'temp1_C' … or 'temp_C', 'volt_V', 'enabled', and "
                            "one's own.");
  cls.def_property_readonly("pieces", &pieces_of,
                            "Of a recording that is longer than memory: returns an iterator of its rows, as "
                            "recordings; the tables are then the first rows. None: they are all there is.");
  cls.def("__len__", &Recording::rows);
  cls.def("__repr__", [](const Recording& recording) { return repr(recording); });
  define_value(cls, {"name", "time", "position", "speed", "torque", "current", "command", "speed_command",
                     "torque_command", "columns", "torque_is_mean", "test", "pieces", "end"});

  m.def("validate_recording", py::overload_cast<const Recording&, const Robot&>(&validate), py::arg("recording"),
        py::arg("robot"), py::call_guard<py::gil_scoped_release>(),
        R"(Raises InputError naming the recording, the column (q2, tau3) and the row, counted from 1.

Checked are: tables of another shape, times that do not increase, values that are not finite (but for joints that are
NaN throughout, which a position must not be) or beyond 1e12, fewer than 20 rows.)");
}

}  // namespace truing::python
