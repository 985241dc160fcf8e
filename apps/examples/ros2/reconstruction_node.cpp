// SPDX-License-Identifier: BSD-3-Clause
/// A ROS 2 node that reconstructs each cloud of the topic `points` and publishes `mesh`, and `marker` for RViz.
///
///     ros2 run pcl_mrf_ros reconstruction_node --ros-args -r points:=/camera/depth/points -p quality:=draft
#include "conversion.h"

#include <pcl/surface/mrf/option_table.h>

#include <rclcpp/rclcpp.hpp>

#include <algorithm>
#include <memory>
#include <stdexcept>

namespace {

double valueOf(const rclcpp::Parameter& parameter, const pcl::mrf::OptionDeclaration& option)
{
  switch (parameter.get_type()) {
  case rclcpp::ParameterType::PARAMETER_BOOL: // YAML's on and off
    return parameter.as_bool() ? 1 : 0;
  case rclcpp::ParameterType::PARAMETER_INTEGER:
    return static_cast<double>(parameter.as_int());
  case rclcpp::ParameterType::PARAMETER_DOUBLE:
    return parameter.as_double();
  default:
    for (const auto& [word, value] : option.words)
      if (word == parameter.as_string())
        return value;
    throw std::invalid_argument(parameter.get_name() + ": '" + parameter.as_string() + "' is " + option.refusal());
  }
}

class ReconstructionNode : public rclcpp::Node {
public:
  ReconstructionNode() : Node("mrf_reconstruction")
  {
    rcl_interfaces::msg::ParameterDescriptor descriptor;
    descriptor.dynamic_typing = true; // so that 1 is a length, as 1.0 is
    for (const pcl::mrf::OptionDeclaration& option : pcl::mrf::optionDeclarations()) {
      std::string name = option.flag.substr(2);
      std::replace(name.begin(), name.end(), '-', '_');
      descriptor.description = option.help;
      declare_parameter(name, rclcpp::ParameterValue(), descriptor);
      const rclcpp::Parameter parameter = get_parameter(name);
      if (parameter.get_type() == rclcpp::ParameterType::PARAMETER_NOT_SET)
        continue;
      const double value = valueOf(parameter, option);
      if (!option.accepts(value) || !option.set(request_.options, value))
        throw std::invalid_argument(name + ": " + parameter.value_to_string() + " is " + option.refusal());
    }
    const auto sensor = declare_parameter("sensor", std::vector<double>()); // x, y, z in the cloud's frame
    if (!sensor.empty() && sensor.size() != 3)
      throw std::invalid_argument("sensor is not [x, y, z]");
    if (!sensor.empty())
      request_.sensors.emplace_back(sensor[0], sensor[1], sensor[2]);
    request_.progress = [](const std::string&, double) { return rclcpp::ok(); };
    mesh_ = create_publisher<shape_msgs::msg::Mesh>("mesh", 1);
    marker_ = create_publisher<visualization_msgs::msg::Marker>("marker", 1);
    // Of the clouds that arrive during a reconstruction only the last one is kept.
    points_ = create_subscription<sensor_msgs::msg::PointCloud2>(
        "points", rclcpp::SensorDataQoS().keep_last(1),
        [this](const sensor_msgs::msg::PointCloud2::ConstSharedPtr& cloud) { receive(*cloud); });
  }

private:
  void receive(const sensor_msgs::msg::PointCloud2& cloud)
  {
    const mrf_ros::Surface surface = mrf_ros::reconstruct(cloud, request_);
    if (surface.report.status != pcl::mrf::Status::ok) {
      RCLCPP_ERROR(get_logger(), "no mesh: %s", surface.report.message.c_str());
      return;
    }
    RCLCPP_INFO(get_logger(), "%zu triangles in %.1f s", surface.mesh.triangles.size(), surface.report.seconds);
    mesh_->publish(surface.mesh);
    marker_->publish(surface.marker);
  }

  mrf_ros::Request request_;
  rclcpp::Publisher<shape_msgs::msg::Mesh>::SharedPtr mesh_;
  rclcpp::Publisher<visualization_msgs::msg::Marker>::SharedPtr marker_;
  rclcpp::Subscription<sensor_msgs::msg::PointCloud2>::SharedPtr points_;
};

} // namespace

int main(int argc, char** argv)
{
  rclcpp::init(argc, argv);
  try {
    rclcpp::spin(std::make_shared<ReconstructionNode>());
  } catch (const std::exception& error) { // a parameter with a wrong value
    RCLCPP_FATAL(rclcpp::get_logger("mrf_reconstruction"), "%s", error.what());
    return 2;
  }
  rclcpp::shutdown();
  return 0;
}
