// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
//
// ros2_control's kinematics plugin on truing's forward kinematics and Jacobian: what admittance and Cartesian
// controllers ask for, of a calibrated URDF. Everything is prepared by initialize; a call afterwards takes nothing from
// the heap where the caller's vectors have their size. Products are written coefficient by coefficient (lazyProduct):
// they are small, and so compile in half the time.

#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include <urdf_parser/urdf_parser.h>
#include <Eigen/Cholesky>
#include <kinematics_interface/kinematics_interface.hpp>
#include <pluginlib/class_list_macros.hpp>
#include <rclcpp/logging.hpp>
#include <rclcpp/parameter.hpp>

#include "chain.hpp"

namespace truing_ros {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

// Added to J J^T, whose rotation and translation rows are compared as they are [rad^2 | m^2]: what the KDL plugin has.
constexpr double kDamping = 5e-6;

rclcpp::Logger logger() { return rclcpp::get_logger("truing_ros.controller_kinematics"); }

}  // namespace

class ControllerKinematics : public kinematics_interface::KinematicsInterface {
 public:
  using Parameters = std::shared_ptr<rclcpp::node_interfaces::NodeParametersInterface>;
  using kinematics_interface::KinematicsInterface::calculate_jacobian;
  using kinematics_interface::KinematicsInterface::calculate_jacobian_inverse;
  using kinematics_interface::KinematicsInterface::calculate_link_transform;
  using kinematics_interface::KinematicsInterface::convert_cartesian_deltas_to_joint_deltas;
  using kinematics_interface::KinematicsInterface::convert_joint_deltas_to_cartesian_deltas;

  bool initialize(const std::string& robot_description, Parameters parameters,
                  const std::string& param_namespace) override {
    return tell([&] { prepare(robot_description, *parameters, param_namespace); });
  }

  bool convert_cartesian_deltas_to_joint_deltas(const Eigen::VectorXd& joint_pos, const Vector6d& delta_x,
                                                const std::string& link_name, Eigen::VectorXd& delta_theta) override {
    return tell([&] {
      const truing::TipJacobian& J = jacobian_at(joint_pos, link_name);
      const Vector6d weighed = damped(J).solve(delta_x);
      delta_theta = J.transpose().lazyProduct(weighed);
    });
  }

  bool convert_joint_deltas_to_cartesian_deltas(const Eigen::VectorXd& joint_pos, const Eigen::VectorXd& delta_theta,
                                                const std::string& link_name, Vector6d& delta_x) override {
    return tell([&] {
      const truing::TipJacobian& J = jacobian_at(joint_pos, link_name);
      require_size(delta_theta);
      delta_x = J.lazyProduct(delta_theta);
    });
  }

  bool calculate_link_transform(const Eigen::VectorXd& joint_pos, const std::string& link_name,
                                Eigen::Isometry3d& transform) override {
    return tell([&] {
      require_size(joint_pos);
      transform = forward(link_named(link_name), joint_pos, nullptr);
    });
  }

  bool calculate_jacobian(const Eigen::VectorXd& joint_pos, const std::string& link_name, Jacobian& jacobian) override {
    return tell([&] { jacobian = jacobian_at(joint_pos, link_name); });
  }

  bool calculate_jacobian_inverse(const Eigen::VectorXd& joint_pos, const std::string& link_name,
                                  Eigen::Matrix<double, Eigen::Dynamic, 6>& inverse) override {
    return tell([&] {
      const truing::TipJacobian& J = jacobian_at(joint_pos, link_name);
      const Matrix6d damped_inverse = damped(J).solve(Matrix6d::Identity());
      inverse = J.transpose().lazyProduct(damped_inverse);
    });
  }

  /// The twist that takes pose a to pose b (x y z, qx qy qz qw) in dt [s], in the base frame. Interfaces since Kilted
  /// (2.0) ask for it; that of Jazzy does not, so that it cannot say override.
  virtual bool calculate_frame_difference(Vector7d& x_a, Vector7d& x_b, double dt, Vector6d& delta_x) {
    return tell([&] {
      if (!(dt > 0.0)) throw std::invalid_argument("the period has to be above 0 s");
      const Eigen::Quaterniond a(x_a[6], x_a[3], x_a[4], x_a[5]), b(x_b[6], x_b[3], x_b[4], x_b[5]);
      const Eigen::AngleAxisd turn(b.normalized() * a.normalized().conjugate());
      delta_x.head<3>() = (x_b.head<3>() - x_a.head<3>()) / dt;
      delta_x.tail<3>() = turn.angle() * turn.axis() / dt;
    });
  }

 private:
  /// A link of the chain; a solver of its own where joints move it.
  struct Place {
    Chain::Link link;
    Eigen::Index driven = 0;  ///< so many of the readings move it
    std::unique_ptr<truing::InverseSolver> solver;
  };

  /// The interface answers by true and false: what went wrong is in the log.
  template <class Work>
  static bool tell(const Work& work) {
    try {
      work();
      return true;
    } catch (const std::exception& error) {
      RCLCPP_ERROR(logger(), "%s", error.what());
      return false;
    }
  }

  void prepare(const std::string& description, rclcpp::node_interfaces::NodeParametersInterface& parameters,
               const std::string& param_namespace) {
    places_.clear();
    const std::string prefix = param_namespace.empty() ? "" : param_namespace + ".";
    const auto text = [&parameters](const std::string& name) {
      rclcpp::Parameter found;
      return parameters.get_parameter(name, found) ? found.as_string() : std::string();
    };
    const std::string urdf_text = description.empty() ? text("robot_description") : description;
    if (urdf_text.empty()) throw std::invalid_argument("no robot description, and no parameter robot_description");
    const auto model = urdf::parseURDF(urdf_text);
    if (!model) throw std::invalid_argument("the robot description is not a URDF that can be used");
    const std::string tip = text(prefix + "tip"), base = text(prefix + "base");
    if (tip.empty()) throw std::invalid_argument("parameter '" + prefix + "tip' is missing: the last link");
    rclcpp::Parameter alpha;
    damping_ = parameters.get_parameter(prefix + "alpha", alpha) ? alpha.as_double() : kDamping;
    if (!(damping_ >= 0.0)) throw std::invalid_argument("parameter '" + prefix + "alpha' has to be 0 or more");

    const Chain chain = chain_between(*model, base.empty() ? model->getRoot()->name : base, tip);
    driven_count_ = static_cast<Eigen::Index>(chain.robot.driven_count());
    std::map<std::string, Place> places;
    for (const Chain::Link& link : chain.links) {
      Place& place = places[link.name];
      place.link = link;
      if (link.moving == 0) continue;
      place.solver = std::make_unique<truing::InverseSolver>(robot_up_to(chain, link));
      place.driven = place.solver->driven_count();
    }
    places_ = std::move(places);
  }

  void require_size(const Eigen::VectorXd& joints) const {
    if (places_.empty()) throw std::invalid_argument("the plugin was not initialised");
    if (joints.size() != driven_count_)
      throw std::invalid_argument("found " + std::to_string(joints.size()) + " joints, expected " +
                                  std::to_string(driven_count_));
  }

  const Place& link_named(const std::string& name) const {
    const auto found = places_.find(name);
    if (found != places_.end()) return found->second;
    std::string known;
    for (const auto& entry : places_) known += (known.empty() ? "" : ", ") + entry.first;
    throw std::invalid_argument("link '" + name + "' is not in the chain; its links are " + known);
  }

  /// Where a link is; its Jacobian too, linear [m] above angular [rad], where it is asked for.
  static Eigen::Isometry3d forward(const Place& place, const Eigen::VectorXd& joints, truing::TipJacobian* jacobian) {
    if (jacobian != nullptr) jacobian->setZero(6, joints.size());
    if (!place.solver) return place.link.T_last_link;
    const truing::Joints readings = joints.head(place.driven);
    if (jacobian == nullptr) return place.solver->forward(readings);
    truing::TipJacobian moved;
    const Eigen::Isometry3d T = place.solver->forward(readings, &moved);
    jacobian->leftCols(place.driven) = moved;
    return T;
  }

  const truing::TipJacobian& jacobian_at(const Eigen::VectorXd& joints, const std::string& link_name) {
    require_size(joints);
    forward(link_named(link_name), joints, &jacobian_);
    return jacobian_;
  }

  /// J J^T + alpha I: damped least squares (Wampler 1986): J^T times its inverse is the step.
  Eigen::LDLT<Matrix6d> damped(const truing::TipJacobian& J) const {
    Matrix6d normal = J.lazyProduct(J.transpose());
    normal.diagonal().array() += damping_;
    return normal.ldlt();
  }

  std::map<std::string, Place> places_;
  truing::TipJacobian jacobian_;
  Eigen::Index driven_count_ = 0;
  double damping_ = kDamping;
};

}  // namespace truing_ros

PLUGINLIB_EXPORT_CLASS(truing_ros::ControllerKinematics, kinematics_interface::KinematicsInterface)
